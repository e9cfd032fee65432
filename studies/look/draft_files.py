"""Draft a sidecar, a channel map and a measurement file, with marks where only the user knows."""

import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote

import numpy as np

from studies.look.motion_uses import DECAY, Motion
from studies.look.opened import MOTION, QUANTITIES, TORQUES, Roles
from studies.look.overview import Look
from studies.look.rig_uses import ALL_PULL, ALL_ROLLING, Supposed
from tyre.channel_map import Reading, Window
from tyre.draft import UNKNOWN
from tyre.errors import InputError
from tyre.files import own_ends, slug, slugs, write_text
from tyre.preflight import TOLERANCES
from tyre.units import PASCAL_PER_BAR, SI, quantity_of

FILL, CHECK = "FILL IN", "CHECK"
SIDECAR = {
    "head": "# Draft of a sidecar by `velotyre look`. Fill in what is marked {FILL}, check what is marked {CHECK}.",
    "recording": "recording = {recording}",
    "tyre": 'tyre = ""  # {FILL}: name of the tyre',
    "known tyre": "tyre = {tyre}  # {CHECK}: of the constants of the file",
    "no load": 'load_N = ""  # {FILL}: vertical load in N',
    "load": "load_N = {load:g}  # {CHECK}: the declared vertical load in N; the median of the file is {measured:.4g}",
    "levels": "# {levels}: by the channels",
    "pressure": 'pressure_bar = ""  # {FILL}: inflation pressure in bar',
    "known pressure": "pressure_bar = {pressure:.6g}  # {CHECK}: of the constants of the file",
    "surface": 'surface = ""  # {FILL}: "flat", or "drum" and a line drum_radius_m = ...',
    "known surface": "surface = {surface}  # {CHECK}: of the constants of the file{drum}",
    "no axes": 'axes = ""  # {FILL}: "ISO", "SAE" or "adapted SAE" (conventions: docs/conventions.md)',
    "axes": "axes = {axes}  # {CHECK}: guessed, as the side force would have the wrong sign in {other} axes; ISO, SAE "
    "or adapted SAE",
    "step": 'kind = "slip_step"',
    "rigid rim": "rigid_rim = true  # {CHECK}: no rim displacement was found; true only if the rim cannot move",
    "step speed": 'speed_km_h = ""  # {FILL}: not recorded, and a step needs it',
    "sweep speed": "# speed_km_h = ...  (not recorded; a sweep tells more with it)",
    "more": "# temperature_C, camber_deg, rim = name of the rim, note = words: where known\n",
}
"""Lines of a sidecar, in their order."""

MOTION_MAP = """\
# Draft of a channel map by `velotyre look`. Fill in what is marked {FILL}; check signs above all:
# x forward, y right, z down: lean, roll rate and steer > 0 to the right (docs/conventions.md)
{channels}
"""
MEASUREMENT = """\
# Draft of a measurement file by `velotyre look`. Fill in what is marked {FILL}.
kind = "histories"
bicycle = ""  # {FILL}: a packaged bicycle (velotyre bicycles) or a file of yours

[histories]
channels = {channels}
drop_first_s = 0.0  # raise it where a kick lasts into the record

[[histories.runs]]  # one for every run; several, or nothing can be held out
file = {file}
speed_m_s = {speed}
"""


@dataclass(frozen=True)
class Draft:
    """A file to be written: ``name``, ``text``, and what it is for."""

    name: str
    text: str
    purpose: str

    @property
    def marks(self) -> int:
        """Number of places that the user must fill in."""
        return self.text.count(f"# {FILL}")


def stems(files: Sequence[Path]) -> list[str]:
    """Name the drafts of each of some ``files``, no two alike: by their names, with folders if these agree."""
    ends = own_ends(files)
    bare = {file: Path(end).with_suffix("").as_posix() for file, end in ends.items()}
    names = {file: name if list(bare.values()).count(name) == 1 else ends[file] for file, name in bare.items()}
    fit = slugs(names.values())
    return [fit[names[file]] for file in files]


def drafts(found: Look, folder: Path, stem: str = "") -> list[Draft]:
    """Draft files for a look, to be written into ``folder``; none if the maps are there already."""
    roles, motion = found.roles, found.motion
    if roles.map is not None and roles.sidecar is not None:
        return []
    stem = stem or slug(found.opened.path.stem)
    made = []
    if roles.sidecar is None:
        for given in found.rig:
            made += _sidecars(roles, given, folder, stem)
    if motion is not None and roles.map is None:
        text = _motion_map(found, motion.part, ())
        made.append(Draft(f"{stem}.channels.toml", text, "channel map of the bicycle's motion"))
        if motion.windows or motion.kept:
            text = _motion_map(found, motion.windows, motion.kept)
            made.append(Draft(f"{stem}.decays.toml", text, "channel map of the free decays, with their windows"))
    if motion is not None and motion.replayed:
        made.append(Draft(f"{stem}.measurement.toml", _measurement(found, motion, folder, stem), "file for diagnose"))
    if not made and roles.map is None and roles.sidecar is None:
        made.append(Draft(f"{stem}.channels.toml", _candidates(found), "channel map with all candidates"))
    return made


def write_drafts(made: Iterable[Draft], folder: Path, *, force: bool) -> list[Path]:
    """Write drafts ``made`` into a ``folder``; one that is there and was changed is refused unless ``force``."""
    paths = {folder / draft.name: draft.text for draft in made}
    there = [
        path for path, text in paths.items()
        if path.exists() and not (path.is_file() and path.read_bytes() == text.encode("utf-8"))
    ]  # fmt: skip
    if there and not force:
        names = ", ".join(str(path) for path in there)
        raise InputError(f"{names}: there already and not overwritten; take another --out, or --force if it may go")
    for path, text in paths.items():
        write_text(path, text)
    return list(paths)


def _sidecars(roles: Roles, given: Supposed, folder: Path, stem: str) -> list[Draft]:
    """Draft one sidecar for the sweeps and one for the steps: `tyre fit` tells their conditions by the channels."""
    if not given.axes and not roles.unknown_units([*ALL_ROLLING, *ALL_PULL]):
        return []
    if not given.windows:
        kind = "pull test" if given.pull else "slip step" if given.step else "slip sweep"
        name = f"{stem}.pull.toml" if given.pull else f"{stem}.toml"
        return [Draft(name, _sidecar(roles, given, folder), f"sidecar for tyre fit, {kind}")]
    made = []
    for step in (False, True):
        windows = tuple(found for found in given.windows if found.step == step)
        if windows:
            name = f"{stem}{'_step' * step}.toml"
            what = f"sidecar for tyre fit, {len(windows)} {'steps' if step else 'slip sweeps'}"
            made.append(Draft(name, _sidecar(roles, replace(given, step=step, windows=windows), folder), what))
    return made


def _sidecar(roles: Roles, given: Supposed, folder: Path) -> str:
    """Fill the lines of a sidecar."""
    conditions = [found.condition for found in given.windows] or ([given.condition] if given.condition else [])
    levels = {
        name: sorted({round(getattr(c, name) / TOLERANCES[name].size, 6) for c in conditions})
        for name in TOLERANCES if not given.pull and (name == "load" or name in given.recorded)
    }  # fmt: skip
    known, axes = given.known.condition if given.known else None, bool(given.axes) and not given.pull
    speed = not given.pull and "speed" not in given.recorded
    one_load = not given.pull and len(levels.get("load", ())) == 1
    told = {name: values for name, values in levels.items() if values and not (name == "load" and one_load)}
    used = {
        "tyre": "tyre" in given.unsaid, "known tyre": "tyre" not in given.unsaid,
        "no load": given.pull or not conditions, "load": one_load, "levels": bool(told),
        "pressure": "pressure" in given.unsaid,
        "known pressure": known is not None and not np.isnan(known.pressure) and "pressure" not in told,
        "surface": "surface" in given.unsaid, "known surface": "surface" not in given.unsaid,
        "no axes": not axes, "axes": axes, "step": given.step, "rigid rim": given.rigid_rim,
        "step speed": speed and given.step, "sweep speed": speed and not given.step,
    }  # fmt: skip
    content = {
        "FILL": FILL, "CHECK": CHECK, "recording": _quoted(_relative(roles.opened.path, folder)),
        "load": levels["load"][0] if one_load else np.nan, "axes": _quoted(given.axes),
        "measured": given.load,
        "levels": "; ".join(f"{n} {', '.join(f'{x:g}' for x in v)} {TOLERANCES[n].unit}" for n, v in told.items()),
        "other": "ISO" if given.axes == "adapted SAE" else "adapted SAE", "tyre": _quoted(known.tyre if known else ""),
        "pressure": known.pressure / PASCAL_PER_BAR if known else np.nan,
        "surface": _quoted(known.surface if known else ""),
        "drum": f"\ndrum_radius_m = {known.drum_radius:g}" if known and known.drum_radius else "",
    }  # fmt: skip
    lines = [line.format(**content) for name, line in SIDECAR.items() if used.get(name, True)]
    lines += _channels(roles, ALL_PULL if given.pull else ALL_ROLLING)
    for window, condition, _ in given.windows:
        levels_here = (f"{getattr(condition, n) / TOLERANCES[n].size:.6g} {TOLERANCES[n].unit}" for n in told)
        lines += _windows([window], "  # " + ", ".join(levels_here) if told else "")
    return "\n".join([*lines, *_reading(roles.opened.reading, folder), ""])


def _channels(roles: Roles, wanted: Sequence[str]) -> list[str]:
    if roles.map is not None:
        return [f"# the channels are those of --channels {roles.map.source}: give it to tyre fit too"]
    lines = ["[channels]", *roles.lines(wanted)]
    untimed = all(signal.time is None for signal in roles.opened.signals.signals.values())
    if roles.opened.clock is None and roles.opened.time is None and untimed:
        lines.append("# time = {rate_hz = ...}  # no column could be the time")
    lacking = [name for name in wanted if name not in roles.guessed]
    lines += [f'# {name} = {{column = "{UNKNOWN}", unit = "{SI[QUANTITIES[name]]}"}}' for name in lacking]
    return [*lines, *roles.resampling(wanted)]


def _windows(windows: Iterable[Window], comment: str = "") -> list[str]:
    lines = []
    for window in windows:
        lines += ["", "[[windows]]", f"name = {_quoted(window.name)}{comment}", f"from_s = {window.first:.10g}"]
        lines.append(f"to_s = {window.last:.10g}")
    return lines


def _reading(reading: Reading, folder: Path) -> list[str]:
    given = {key: value for key, value in vars(reading).items() if value}
    given |= {"dbc": [_relative(path, folder) for path in given["dbc"]]} if "dbc" in given else {}
    lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in given.items()]
    return ["", "[reading]", *lines] if lines else []


def _motion_map(found: Look, windows: Iterable[Window], kept: Sequence[str]) -> str:
    lines = [*_channels(found.roles, tuple(kept) or (*MOTION, *TORQUES)), *_windows(windows)]
    lines += _reading(found.opened.reading, found.opened.path.parent)
    return MOTION_MAP.format(FILL=FILL, channels="\n".join(lines))


def _candidates(found: Look) -> str:
    """List every column with the channels that it could be, where no use of the recording was recognised."""
    signals, clock = found.opened.signals, found.opened.clock
    lines = ["[channels]", *([clock.line("time")] if clock else ["# time = {rate_hz = ...}  # FILL IN"])]
    for column in signals.columns:
        if clock is None or column.name != clock.column.name:
            quantity = quantity_of(column.unit)
            fitting = [name for name, measured in QUANTITIES.items() if quantity in ("", measured)]
            entry = {"column": column.name} | ({} if quantity else {"unit": UNKNOWN})
            keys = ", ".join(f"{key} = {_quoted(value)}" for key, value in entry.items())
            lines.append(f"# {' or '.join(fitting) if quantity and fitting else 'NAME'} = {{{keys}}}")
    return MOTION_MAP.format(FILL=FILL, channels="\n".join([*lines, *_reading(found.opened.reading, Path())]))


def _measurement(found: Look, motion: Motion, folder: Path, stem: str) -> str:
    speed = f"{motion.speed:.4g}  # {CHECK}: median of the file" if motion.speed else f'""  # {FILL}: mean speed in m/s'
    channels = f"{stem}.channels.toml"
    if found.roles.given is not None:
        channels = _relative(Path(found.roles.given.source), folder)
    file = _quoted(_relative(found.opened.path, folder))
    return MEASUREMENT.format(FILL=FILL, channels=_quoted(channels), file=file, speed=speed)


def steps(found: Look, made: Iterable[Draft], folder: Path | None) -> dict[str, str]:
    """Find the next command of each use, once the drafts ``made`` are in ``folder`` (None: they are not written)."""
    names, commands = [draft.name for draft in made], {}
    for use in found.uses:
        if not use.usable:
            continue
        step = use.next_step
        if folder is None and (use.windows or not step or "MAP.toml" in step or "MEASUREMENT" in step):
            step = f"velotyre look {quote(str(found.opened.path))} --out DIR writes drafts"
        elif not step:
            step = f"velotyre tyre fit {quote(str(folder))} --out fit"
            if found.roles.given is not None:
                step += f" --channels {quote(str(found.roles.given.source))}"
        else:
            endings = (".decays.toml", ".channels.toml") if use.name == DECAY else (".channels.toml",)
            name = next((name for ending in endings for name in names if name.endswith(ending)), "MAP.toml")
            step = step.replace("MAP.toml", quote(f"{folder}/{name}"))
            measured = next((name for name in names if name.endswith(".measurement.toml")), "")
            step = step.replace("MEASUREMENT.toml", quote(f"{folder}/{measured}")) if measured else step
        commands[use.name] = step
    return commands


def _relative(path: Path, folder: Path) -> str:
    return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
