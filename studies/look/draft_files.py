"""Draft a sidecar, a channel map and a measurement file, with marks where only the user knows."""

import json
import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote
from typing import Any

from studies.look.motion_uses import DECAY, RIDE, RideDrafts
from studies.look.opened import MOTION, QUANTITIES, TORQUES, Roles
from studies.look.overview import Look
from studies.look.rig_uses import ALL_PULL, ALL_ROLLING, Supposed
from studies.reporting.markdown_text import render_file
from tyre.formats.channel_map import Reading, Window
from tyre.ground.errors import InputError
from tyre.ground.files import own_ends, refuse_outside, slug, slugs, write_text
from tyre.ground.units import SI, quantity_of
from tyre.recordings.draft import UNKNOWN, unit_of
from tyre.recordings.run_checks import TOLERANCES

FILL = "FILL IN"
OWN_MAPS = {DECAY: (".decays.toml",), RIDE: (".ride.toml",)}  # use -> endings of drafts of a map for it alone


@dataclass(frozen=True)
class Draft:
    """A file to be written: ``name``, ``text``, and what it is for."""

    name: str  # of the file
    text: str  # content of the file
    purpose: str  # in words, for a list of the drafts

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


def drafts(look: Look, folder: Path, stem: str = "") -> list[Draft]:
    """Draft files for a look, to be written into ``folder``; none if the maps are there already."""
    roles, motion = look.roles, look.motion
    if roles.map is not None and roles.sidecar is not None:
        return []
    stem = stem or slug(look.opened.path.stem)
    files = []
    if roles.sidecar is None:
        for supposed in look.rig:
            files += _sidecars(roles, supposed, folder, stem)
    if motion is not None and roles.map is None:
        text = _motion_map(look, motion.part)
        files.append(Draft(f"{stem}.channels.toml", text, "channel map of the bicycle's motion"))
        if motion.windows:
            text = _motion_map(look, motion.windows)
            files.append(Draft(f"{stem}.decays.toml", text, "channel map of the free decays, with their windows"))
    if motion is not None and motion.replayed:
        mapped, file = roles.command_map, _relative(look.opened.path, folder)
        channels = _relative(Path(mapped.source), folder) if mapped else f"{stem}.channels.toml"
        text = _fill_template("measurement", channels=channels, file=file, speed=motion.speed)
        files.append(Draft(f"{stem}.measurement.toml", text, "file for diagnose"))
    if motion is not None:
        files += _ride_drafts(look, motion.ride, folder, stem)
    if not files and roles.map is None and roles.sidecar is None:
        files.append(Draft(f"{stem}.channels.toml", _candidates(look), "channel map with all candidates"))
    return files


def _ride_drafts(look: Look, ride: RideDrafts, folder: Path, stem: str) -> list[Draft]:
    """Draft the channel map of a ride where it differs from that of a run, and a file for diagnose."""
    files = []
    mapped = look.roles.command_map
    own_map = ride.own_map and look.roles.map is None
    if own_map:
        text = _motion_map(look, (), ride.channels)
        files.append(Draft(f"{stem}.ride.toml", text, "channel map of the ride"))
    if ride.spectra:
        channels = f"{stem}.ride.toml" if own_map else f"{stem}.channels.toml"
        if mapped is not None:
            channels = _relative(Path(mapped.source), folder)
        content = {"channels": channels if ride.mapped else "", "file": _relative(look.opened.path, folder)}
        text = _fill_template("spectra", **content, speed=ride.speed, recorded=ride.recorded)
        files.append(Draft(f"{stem}.spectra.toml", text, "file for diagnose, spectra of the ride"))
    return files


def write_drafts(drafts: Iterable[Draft], folder: Path, *, force: bool) -> list[Path]:
    """Write ``drafts`` into a ``folder``; one that is there and was changed is refused unless ``force``."""
    paths = {folder / draft.name: draft.text for draft in drafts}
    changed = [
        path
        for path, text in paths.items()
        if path.exists() and not (path.is_file() and path.read_bytes() == text.encode("utf-8"))
    ]
    if changed and not force:
        names = ", ".join(str(path) for path in changed)
        raise InputError(f"{names}: there already and not overwritten; take another --out, or --force if it may go")
    for path, text in paths.items():
        write_text(path, text)
    return list(paths)


def _sidecars(roles: Roles, supposed: Supposed, folder: Path, stem: str) -> list[Draft]:
    """Draft one sidecar for the sweeps and one for the steps: `tyre fit` finds their conditions from the channels."""
    if not supposed.axes and not roles.unknown_units([*ALL_ROLLING, *ALL_PULL]):
        return []
    if not supposed.windows:
        rolling = "slip step" if supposed.step else "steady curve" if supposed.steady else "slip sweep"
        kind = "lateral stiffness test" if supposed.pull else rolling
        name = f"{stem}.pull.toml" if supposed.pull else f"{stem}.toml"
        return [Draft(name, _sidecar(roles, supposed, folder), f"sidecar for tyre fit, {kind}")]
    files = []
    for step in (False, True):
        windows = tuple(event for event in supposed.windows if event.step == step)
        if windows:
            name = f"{stem}{'_step' * step}.toml"
            purpose = f"sidecar for tyre fit, {len(windows)} {'steps' if step else 'slip sweeps'}"
            files.append(Draft(name, _sidecar(roles, replace(supposed, step=step, windows=windows), folder), purpose))
    return files


def _sidecar(roles: Roles, supposed: Supposed, folder: Path) -> str:
    conditions = [event.condition for event in supposed.windows] or [*supposed.levels]
    conditions = conditions or ([supposed.condition] if supposed.condition else [])
    levels = {
        name: sorted({round(getattr(c, name) / TOLERANCES[name].size, 6) for c in conditions})
        for name in TOLERANCES
        if conditions and (name in supposed.recorded or (name == "load" and not math.isnan(supposed.load)))
    }
    one_load = len(levels.get("load", ())) == 1
    return _fill_template(
        "sidecar",
        recording=_relative(roles.opened.path, folder),
        given=supposed,
        levels=levels,
        one_load=one_load,
        known=supposed.constants.condition if supposed.constants else None,
        tolerances=TOLERANCES,
        told={name: values for name, values in levels.items() if not (name == "load" and one_load)},
        lines=_channels(roles, ALL_PULL if supposed.pull else ALL_ROLLING),
        reading=_reading(roles.opened.reading, folder),
    )


def _channels(roles: Roles, channels: Sequence[str]) -> list[str]:
    if roles.map is not None:
        return [
            f"# the channels are those of --channels {roles.map.source}: give it to tyre fit too, or copy its",
            "# [channels] here, as recordings of other columns in one folder need",
        ]
    lines = ["[channels]", *roles.lines(channels)]
    untimed = all(signal.time is None for signal in roles.opened.signals.signals.values())
    needs_no_time = {"slip_angle", "lateral_force"} <= roles.guessed.keys() or channels is ALL_PULL
    if roles.opened.clock is None and roles.opened.time is None and untimed and not needs_no_time:
        lines.append("# time = {rate_hz = ...}  # no column could be the time")
    lacking = [name for name in channels if name not in roles.guessed]
    lines += [f'# {name} = {{column = "{UNKNOWN}", unit = "{SI[QUANTITIES[name]]}"}}' for name in lacking]
    return [*lines, *roles.resampling(channels)]


def _reading(reading: Reading, folder: Path) -> str:
    keys = {key: value for key, value in vars(reading).items() if value}
    keys |= {"dbc": [_relative(path, folder) for path in keys["dbc"]]} if "dbc" in keys else {}
    return "\n".join(["[reading]", *(f"{key} = {_quote(value)}" for key, value in keys.items())]) if keys else ""


def _motion_map(look: Look, windows: Iterable[Window], channels: Sequence[str] = (*MOTION, *TORQUES)) -> str:
    reading = _reading(look.opened.reading, look.opened.path.parent)
    lines = _channels(look.roles, channels)
    return _fill_template("motion_map", lines=lines, windows=windows, reading=reading)


def _candidates(look: Look) -> str:
    """List every column with the channels that it could be, where no use of the recording was recognised."""
    signals, clock = look.opened.signals, look.opened.clock
    guessed = {guess.column.name: (name, guess) for name, guess in look.roles.guessed.items()}
    lines = ["[channels]", *([clock.line("time")] if clock else ["# time = {rate_hz = ...}  # FILL IN"])]
    for column in signals.columns:
        if column.name in guessed:
            name, guess = guessed[column.name]
            lines.append(guess.line(name))
        elif clock is None or column.name != clock.column.name:
            unit = unit_of(column)
            quantity = quantity_of(unit)
            fitting = [name for name, measured in QUANTITIES.items() if quantity in ("", measured)]
            entry = {"column": column.name}
            if column.unit != unit or not quantity:
                entry["unit"] = unit if quantity else UNKNOWN
            keys = ", ".join(f"{key} = {_quote(value)}" for key, value in entry.items())
            lines.append(f"# {' or '.join(fitting) if quantity and fitting else 'NAME'} = {{{keys}}}")
    return _fill_template("motion_map", lines=lines, windows=(), reading=_reading(look.opened.reading, Path()))


def steps(look: Look, drafts: Iterable[Draft], folder: Path | None) -> dict[str, str]:
    """Find the next command of each use, once the ``drafts`` are in ``folder`` (None: they are not written)."""
    names, commands = [draft.name for draft in drafts], {}
    for use in look.uses:
        if not use.usable:
            continue
        step = use.next_step
        if folder is None and (use.windows or not step or "MAP.toml" in step or "MEASUREMENT" in step):
            step = f"velotyre look {quote(str(look.opened.path))} --out DIR writes drafts"
        elif not step:
            step = f"{_allowing(look, folder)}velotyre tyre fit {quote(str(folder))} --out fit"
            if look.roles.command_map is not None:
                step += f" --channels {quote(str(look.roles.command_map.source))}"
        else:
            endings = (*OWN_MAPS.get(use.name, ()), ".channels.toml")
            name = next((name for ending in endings for name in names if name.endswith(ending)), "MAP.toml")
            step = step.replace("MAP.toml", quote(f"{folder}/{name}"))
            ending = ".spectra.toml" if use.name == RIDE else ".measurement.toml"
            measured = next((name for name in names if name.endswith(ending)), "")
            if measured and "MEASUREMENT.toml" in step:
                step = _allowing(look, folder) + step.replace("MEASUREMENT.toml", quote(f"{folder}/{measured}"))
        commands[use.name] = step
    return commands


def _allowing(look: Look, folder: Path | None) -> str:
    """Set the variable that lets a draft in ``folder`` name its recording, if this lies elsewhere; else nothing."""
    if folder is None:
        return ""
    path = look.opened.path
    try:
        refuse_outside({"recording": _relative(path, folder)}, folder / "draft.toml")
    except InputError:
        return f"VELOTYRE_FOLDER={quote(str(path.resolve().parent))} "
    return ""


def _relative(path: Path, folder: Path) -> str:
    return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()


def _quote(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)  # a string of JSON is one of TOML


def _fill_template(template: str, **content: Any) -> str:
    filters = {"quoted": _quote}
    text = render_file("studies.look", f"{template}.toml.j2", content, escaped=False, filters=filters)
    return text.rstrip() + "\n"
