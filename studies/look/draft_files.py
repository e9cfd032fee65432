"""Draft a sidecar, a channel map and a measurement file, with marks where only the user knows."""

import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote
from typing import Any

from studies.look.motion_uses import DECAY
from studies.look.opened import MOTION, QUANTITIES, TORQUES, Roles
from studies.look.overview import Look
from studies.look.rig_uses import ALL_PULL, ALL_ROLLING, Supposed
from studies.reporting.markdown_text import render_file
from tyre.formats.channel_map import Reading, Window
from tyre.ground.errors import InputError
from tyre.ground.files import own_ends, refuse_outside, slug, slugs, write_text
from tyre.ground.units import SI, quantity_of
from tyre.recordings.draft import UNKNOWN
from tyre.recordings.run_checks import TOLERANCES

FILL = "FILL IN"


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
        text = _motion_map(found, motion.part)
        made.append(Draft(f"{stem}.channels.toml", text, "channel map of the bicycle's motion"))
        if motion.windows:
            text = _motion_map(found, motion.windows)
            made.append(Draft(f"{stem}.decays.toml", text, "channel map of the free decays, with their windows"))
    if motion is not None and motion.replayed:
        mapped, file = roles.given, _relative(found.opened.path, folder)
        channels = _relative(Path(mapped.source), folder) if mapped else f"{stem}.channels.toml"
        text = _fill_template("measurement", channels=channels, file=file, speed=motion.speed)
        made.append(Draft(f"{stem}.measurement.toml", text, "file for diagnose"))
    if not made and roles.map is None and roles.sidecar is None:
        made.append(Draft(f"{stem}.channels.toml", _candidates(found), "channel map with all candidates"))
    return made


def write_drafts(made: Iterable[Draft], folder: Path, *, force: bool) -> list[Path]:
    """Write drafts ``made`` into a ``folder``; one that is there and was changed is refused unless ``force``."""
    paths = {folder / draft.name: draft.text for draft in made}
    there = [
        path
        for path, text in paths.items()
        if path.exists() and not (path.is_file() and path.read_bytes() == text.encode("utf-8"))
    ]
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
        rolling = "slip step" if given.step else "steady curve" if given.steady else "slip sweep"
        kind = "pull test" if given.pull else rolling
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
    conditions = [found.condition for found in given.windows] or [*given.levels]
    conditions = conditions or ([given.condition] if given.condition else [])
    levels = {
        name: sorted({round(getattr(c, name) / TOLERANCES[name].size, 6) for c in conditions})
        for name in TOLERANCES
        if conditions and not given.pull and (name == "load" or name in given.recorded)
    }
    one_load = len(levels.get("load", ())) == 1
    return _fill_template(
        "sidecar",
        recording=_relative(roles.opened.path, folder),
        given=given,
        levels=levels,
        one_load=one_load,
        known=given.known.condition if given.known else None,
        tolerances=TOLERANCES,
        told={name: values for name, values in levels.items() if not (name == "load" and one_load)},
        lines=_channels(roles, ALL_PULL if given.pull else ALL_ROLLING),
        reading=_reading(roles.opened.reading, folder),
    )


def _channels(roles: Roles, wanted: Sequence[str]) -> list[str]:
    if roles.map is not None:
        return [f"# the channels are those of --channels {roles.map.source}: give it to tyre fit too"]
    lines = ["[channels]", *roles.lines(wanted)]
    untimed = all(signal.time is None for signal in roles.opened.signals.signals.values())
    needs_no_time = {"slip_angle", "side_force"} <= roles.guessed.keys() or wanted is ALL_PULL
    if roles.opened.clock is None and roles.opened.time is None and untimed and not needs_no_time:
        lines.append("# time = {rate_hz = ...}  # no column could be the time")
    lacking = [name for name in wanted if name not in roles.guessed]
    lines += [f'# {name} = {{column = "{UNKNOWN}", unit = "{SI[QUANTITIES[name]]}"}}' for name in lacking]
    return [*lines, *roles.resampling(wanted)]


def _reading(reading: Reading, folder: Path) -> str:
    given = {key: value for key, value in vars(reading).items() if value}
    given |= {"dbc": [_relative(path, folder) for path in given["dbc"]]} if "dbc" in given else {}
    return "\n".join(["[reading]", *(f"{key} = {_quote(value)}" for key, value in given.items())]) if given else ""


def _motion_map(found: Look, windows: Iterable[Window]) -> str:
    reading = _reading(found.opened.reading, found.opened.path.parent)
    lines = _channels(found.roles, (*MOTION, *TORQUES))
    return _fill_template("motion_map", lines=lines, windows=windows, reading=reading)


def _candidates(found: Look) -> str:
    """List every column with the channels that it could be, where no use of the recording was recognised."""
    signals, clock = found.opened.signals, found.opened.clock
    lines = ["[channels]", *([clock.line("time")] if clock else ["# time = {rate_hz = ...}  # FILL IN"])]
    for column in signals.columns:
        if clock is None or column.name != clock.column.name:
            quantity = quantity_of(column.unit)
            fitting = [name for name, measured in QUANTITIES.items() if quantity in ("", measured)]
            entry = {"column": column.name} | ({} if quantity else {"unit": UNKNOWN})
            keys = ", ".join(f"{key} = {_quote(value)}" for key, value in entry.items())
            lines.append(f"# {' or '.join(fitting) if quantity and fitting else 'NAME'} = {{{keys}}}")
    return _fill_template("motion_map", lines=lines, windows=(), reading=_reading(found.opened.reading, Path()))


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
            step = f"{_allowing(found, folder)}velotyre tyre fit {quote(str(folder))} --out fit"
            if found.roles.given is not None:
                step += f" --channels {quote(str(found.roles.given.source))}"
        else:
            endings = (".decays.toml", ".channels.toml") if use.name == DECAY else (".channels.toml",)
            name = next((name for ending in endings for name in names if name.endswith(ending)), "MAP.toml")
            step = step.replace("MAP.toml", quote(f"{folder}/{name}"))
            measured = next((name for name in names if name.endswith(".measurement.toml")), "")
            if measured:
                step = _allowing(found, folder) + step.replace("MEASUREMENT.toml", quote(f"{folder}/{measured}"))
        commands[use.name] = step
    return commands


def _allowing(found: Look, folder: Path | None) -> str:
    """Set the variable that lets a draft in ``folder`` name its recording, if this lies elsewhere; else nothing."""
    if folder is None:
        return ""
    path = found.opened.path
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
