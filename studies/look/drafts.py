"""Drafts of a sidecar, a channel map and a measurement file, with marks where only the user knows."""

import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote

from studies.look.look import Look
from studies.look.motion_uses import DECAY, Motion
from studies.look.rig_events import ALL_PULL, ALL_ROLLING, Supposed
from studies.look.roles import MOTION, QUANTITIES, TORQUES, Roles
from tyre.base.errors import InputError
from tyre.base.files import slug, slugs, write_text
from tyre.base.paths import own_ends
from tyre.channels.draft import UNKNOWN
from tyre.channels.reading import Reading
from tyre.channels.units import SI
from tyre.channels.windows import Window

FILL = "FILL IN"
CHECK = "CHECK"
SAME_LOAD = 0.05
"""Events whose loads differ by less are of one condition."""


@dataclass(frozen=True)
class Draft:
    """A file to be written: ``name``, ``text``, what it is for, and how many places are marked."""

    name: str
    text: str
    purpose: str

    @property
    def marks(self) -> int:
        """How many places the user must fill in."""
        return self.text.count(f"# {FILL}")


def stems(files: Sequence[Path]) -> list[str]:
    """What the drafts of each of some ``files`` are called, no two alike: by their names, folders where these agree."""
    ends = own_ends(files)
    bare = {file: Path(end).with_suffix("").as_posix() for file, end in ends.items()}
    names = {file: name if list(bare.values()).count(name) == 1 else ends[file] for file, name in bare.items()}
    fit = slugs(names.values())
    return [fit[names[file]] for file in files]


def drafts(found: Look, folder: Path, stem: str = "") -> list[Draft]:
    """Drafts for a look at a file, to be written into ``folder``; none where the maps are there already.

    Their names begin with ``stem``, if it is given, else with that of the file.
    A folder that holds the drafts of a sidecar can be given to ``tyre fit``: they name the recording.
    """
    if found.roles.map is not None and found.roles.sidecar is not None:
        return []
    made = []
    stem = stem or slug(found.opened.path.stem)
    if found.roles.sidecar is None:
        for given in found.rig:
            made += _sidecars(found.roles, given, folder, stem)
    motion = found.motion
    if motion is not None and found.roles.map is None:
        made.append(
            Draft(f"{stem}.channels.toml", _motion_map(found, motion.part, ()), "channel map of the bicycle's motion")
        )
        if motion.windows or motion.kept:
            text = _motion_map(found, motion.windows, motion.kept)
            made.append(Draft(f"{stem}.decays.toml", text, "channel map of the free decays, with their windows"))
    if motion is not None and motion.replayed:
        made.append(Draft(f"{stem}.measurement.toml", _measurement(found, motion, folder, stem), "file for diagnose"))
    return made


def write_drafts(made: Iterable[Draft], folder: Path, *, force: bool) -> list[Path]:
    """Write drafts ``made`` into a ``folder``; one that is there and was changed is kept unless ``force``.

    Raises
    ------
    InputError
        A draft that is there and was changed.
    """
    paths = {folder / draft.name: draft for draft in made}
    there = [path for path, draft in paths.items() if path.exists() and not _untouched(path, draft.text)]
    if there and not force:
        names = ", ".join(str(path) for path in there)
        raise InputError(f"{names}: there already and not overwritten; take another --out, or --force if it may go")
    for path, draft in paths.items():
        write_text(path, draft.text)
    return list(paths)


def _untouched(path: Path, text: str) -> bool:
    """Whether a draft is as it would be written again, as a command leaves it that was stopped."""
    return path.is_file() and path.read_bytes() == text.encode("utf-8")


def _sidecars(roles: Roles, given: Supposed, folder: Path, stem: str) -> list[Draft]:
    """One for every load, as a sidecar describes one condition."""
    if not given.axes and not roles.unknown_units([*ALL_ROLLING, *ALL_PULL]):
        return []
    kind = "pull test" if given.pull else "slip step" if given.step else "slip sweep"
    if not given.windows:
        name = f"{stem}.pull.toml" if given.pull else f"{stem}.toml"
        return [Draft(name, _sidecar(roles, given, folder, given.load, ()), f"sidecar for tyre fit, {kind}")]
    groups: list[tuple[float, bool, list[Window]]] = []
    for window, load, step in given.windows:
        group = next((g for g in groups if g[1] == step and abs(g[0] / load - 1) < SAME_LOAD), None)
        if group is None:
            groups.append((load, step, [window]))
        else:
            group[2].append(window)
    made = []
    for name, (load, step, windows) in zip(_names(stem, groups), groups, strict=True):
        text = _sidecar(roles, replace(given, step=step), folder, load, windows)
        made.append(Draft(name, text, f"sidecar for tyre fit, {'steps' if step else 'slip sweeps'} at {load:.0f} N"))
    return made


def _names(stem: str, groups: Sequence[tuple[float, bool, object]]) -> list[str]:
    if len(groups) == 1:
        return [f"{stem}.toml"]
    plain = [f"{'step_' if step else ''}{load:.0f}" for load, step, _ in groups]
    return [f"{stem}_{text}N.toml" if plain.count(text) == 1 else f"{stem}_{text}N_{place}.toml"
            for place, text in enumerate(plain, 1)]  # fmt: skip


def _sidecar(roles: Roles, given: Supposed, folder: Path, load: float | None, windows: Iterable[Window]) -> str:
    wanted = ALL_PULL if given.pull else ALL_ROLLING
    said = (
        "vertical load in N"
        if load is None
        else f"the declared vertical load in N; the median of the file is {load:.4g}"
    )
    lines = [
        f"# Draft of a sidecar by `velotyre look`. Fill in what is marked {FILL}, check what is marked {CHECK}.",
        f"recording = {_quoted(_relative(roles.opened.path, folder))}",
        f'tyre = ""  # {FILL}: name of the tyre',
        f'load_N = ""  # {FILL}: {said}' if load is None else f"load_N = {_nominal(load):g}  # {CHECK}: {said}",
        f'pressure_bar = ""  # {FILL}: inflation pressure in bar',
        f'surface = ""  # {FILL}: "flat", or "drum" and a line drum_radius_m = ...',
    ]
    if given.axes and not given.pull:
        other = "ISO" if given.axes == "adapted SAE" else "adapted SAE"
        lines.append(
            f"axes = {_quoted(given.axes)}  # {CHECK}: guessed, as the side force would have the wrong sign in "
            f"{other} axes; ISO, SAE or adapted SAE"
        )
    else:
        lines.append(f'axes = ""  # {FILL}: "ISO", "SAE" or "adapted SAE" (conventions: docs/conventions.md)')
    if given.step:
        lines.append('kind = "slip_step"')
    if given.rigid_rim:
        lines.append(f"rigid_rim = true  # {CHECK}: no rim displacement was found; true only if the rim cannot move")
    if not given.pull and given.speed_missing:
        lines.append(
            f'speed_km_h = ""  # {FILL}: not recorded, and a step needs it' if given.step
            else "# speed_km_h = ...  (not recorded; a sweep tells more with it)"
        )  # fmt: skip
    lines.append("# temperature_C, camber_deg, rim = name of the rim, note = words: where known")
    lines += ["", *_channels(roles, wanted), *_windows(windows), *_reading(roles.opened.reading, folder)]
    return "\n".join([*lines, ""])


def _nominal(load: float) -> float:
    """A round load within 1 % of the measured one (N): events of one condition must declare the same."""
    rounded = (step * round(load / step) for step in (50.0, 10.0, 5.0, 1.0))
    return next((value for value in rounded if abs(value / load - 1) < 0.01), load)


def _channels(roles: Roles, wanted: Iterable[str]) -> list[str]:
    if roles.map is not None:
        return [f"# the channels are those of --channels {roles.map.source}: give it to tyre fit too"]
    lines = ["[channels]", *roles.lines([*wanted])]
    if roles.opened.clock is None and roles.opened.time is None and _without_times(roles):
        lines.append("# time = {rate_hz = ...}  # no column could be the time")
    lacking = [name for name in wanted if name not in roles.guessed]
    lines += [f'# {name} = {{column = "{UNKNOWN}", unit = "{SI[QUANTITIES[name]]}"}}' for name in lacking]
    return [*lines, *roles.resampling([*wanted])]


def _without_times(roles: Roles) -> bool:
    return all(signal.time is None for signal in roles.opened.signals.signals.values())


def _windows(windows: Iterable[Window]) -> list[str]:
    lines = []
    for window in windows:
        lines += ["", "[[windows]]", f"name = {_quoted(window.name)}", f"from_s = {window.first:.10g}"]
        lines.append(f"to_s = {window.last:.10g}")
    return lines


def _reading(reading: Reading, folder: Path) -> list[str]:
    given = {key: value for key, value in vars(reading).items() if value}
    if not given:
        return []
    lines = ["", "[reading]"]
    for key, value in given.items():
        shown = [_relative(path, folder) for path in value] if key == "dbc" else value
        lines.append(f"{key} = {json.dumps(shown, ensure_ascii=False)}")
    return lines


def _motion_map(found: Look, windows: Iterable[Window], kept: Iterable[str]) -> str:
    head = f"# Draft of a channel map by `velotyre look`. Fill in what is marked {FILL}; check signs above all:"
    signs = "# x forward, y right, z down: lean, roll rate and steer > 0 to the right (docs/conventions.md)"
    lines = [head, signs, *_channels(found.roles, tuple(kept) or (*MOTION, *TORQUES)), *_windows(windows)]
    return "\n".join([*lines, *_reading(found.opened.reading, found.opened.path.parent), ""])


def _measurement(found: Look, motion: Motion, folder: Path, stem: str) -> str:
    speed = f"{motion.speed:.4g}  # {CHECK}: median of the file" if motion.speed else f'""  # {FILL}: mean speed in m/s'
    map_file = found.roles.given.source if found.roles.given is not None else f"{stem}.channels.toml"
    channels = _relative(Path(map_file), folder) if found.roles.given is not None else map_file
    return "\n".join([
        f"# Draft of a measurement file by `velotyre look`. Fill in what is marked {FILL}.",
        'kind = "histories"',
        f'bicycle = ""  # {FILL}: a packaged bicycle (velotyre bicycles) or a file of yours',
        "", "[histories]", f"channels = {_quoted(channels)}",
        "drop_first_s = 0.0  # raise it where a kick lasts into the record",
        "", "[[histories.runs]]  # one for every run; several, or nothing can be held out",
        f"file = {_quoted(_relative(found.opened.path, folder))}", f"speed_m_s = {speed}", "",
    ])  # fmt: skip


def steps(found: Look, made: Iterable[Draft], folder: Path | None) -> dict[str, str]:
    """Use -> the next command, once the drafts ``made`` are in ``folder`` (None: they are not written)."""
    named = {draft.name: draft for draft in made}
    said = {}
    for use in found.uses:
        if not use.usable:
            continue
        step = use.next_step
        if folder is None and (use.windows or (not step) or "MAP.toml" in step or "MEASUREMENT" in step):
            step = f"velotyre look {quote(str(found.opened.path))} --out DIR writes drafts"
        elif not step:
            step = f"velotyre tyre fit {quote(str(folder))} --out fit"
            if found.roles.given is not None:
                step += f" --channels {quote(str(found.roles.given.source))}"
        else:
            endings = (".decays.toml", ".channels.toml") if use.name == DECAY else (".channels.toml",)
            name = next((name for ending in endings for name in named if name.endswith(ending)), "MAP.toml")
            step = step.replace("MAP.toml", quote(f"{folder}/{name}"))
            measured = next((name for name in named if name.endswith(".measurement.toml")), "")
            step = step.replace("MEASUREMENT.toml", quote(f"{folder}/{measured}")) if measured else step
        said[use.name] = step
    return said


def _relative(path: Path, folder: Path) -> str:
    return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
