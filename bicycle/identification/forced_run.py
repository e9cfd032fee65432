"""Recordings of forced runs: motion and torques, a lateral force, and a reference signal from outside."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from bicycle.identification.recording import CHANNELS, INPUTS, QUANTITIES, run_of
from bicycle.identification.run import Run
from tyre.base.csv_table import read_columns
from tyre.base.errors import InputError
from tyre.channels.channel_map import ChannelMap
from tyre.channels.draft import draft_words, refuse_unmapped
from tyre.channels.even_steps import fills, how_to
from tyre.channels.read import contents
from tyre.channels.record import Record, read_records
from tyre.channels.units import quantity_of

LATERAL_FORCE = "lateral_force_N"
FORCED_INPUTS: Mapping[str, str] = {**{name: column for column, name in INPUTS.items()}, "lateral_force": LATERAL_FORCE}
"""Inputs and their columns."""

MOTIONS: Mapping[str, str] = {re.sub(r"_(rad|rad_s|m_s2)$", "", column): column for column in CHANNELS}
"""Motions and their columns."""


def read_forced(
    path: Path, speed: float, *, reference: str = "", channel_map: ChannelMap | None = None
) -> tuple[Run, ...]:
    """Read the events of a forced run; its ``inputs`` hold torques, the lateral force and the reference.

    Parameters
    ----------
    path : Path
        Without a channel map a CSV with ``time_s``, motions and inputs in SI units, as their names say.
    speed : float
        Forward speed, m/s.
    reference : str
        Column (with a channel map: channel) of a signal from outside, in any unit; empty for none.
    channel_map : ChannelMap, optional
        Which column is which channel.

    Raises
    ------
    InputError
        As :func:`bicycle.identification.recording.read_events`; a reference that is not there or does not move.
    """
    if channel_map is not None:
        known = {**QUANTITIES, "lateral_force": "force"}
        if reference and reference not in known:
            if reference not in channel_map.channels:
                raise InputError(
                    f"{path}: no channel {reference!r}; map it with a unit, any: {reference} = "
                    '{column = "...", unit = "N m"}'
                )
            known[reference] = quantity_of(channel_map.channels[reference].unit) or "moment"
        records = read_records(path, channel_map, known)
        return tuple(_run(record, path, speed, reference) for record in records)
    if path.suffix.casefold() not in ("", ".csv"):
        refuse_unmapped(path, QUANTITIES)
    own = ("time_s", *CHANNELS, *INPUTS, LATERAL_FORCE)
    more = [] if reference in ("", *own) else [reference]
    try:
        columns = read_columns(path, numbers=(*own, *more), needed=("time_s", *more))
    except InputError as error:
        there = [] if f"{path}, line" in str(error) else [column.name for column in contents(path).columns]
        if more and "time_s" in there and reference not in there:
            every = ", ".join(there)
            raise InputError(f"{path}: --instrument {reference}: there is no such column; it has {every}") from error
        words = "" if f"{path}, line" in str(error) else draft_words(path, QUANTITIES)
        more_words = f"; a reference is named with --instrument; or give a channel map: {words}" if words else ""
        raise InputError(f"{error}{more_words}") from error
    numbers = dict(columns.numbers)
    names = {column: name for name, column in {**FORCED_INPUTS, **MOTIONS}.items()}
    values = {names.get(column, column): x for column, x in numbers.items() if column != "time_s"}
    return (_run(Record(str(path), numbers["time_s"], values), path, speed, names.get(reference, reference)),)


def _run(record: Record, path: Path, speed: float, reference: str) -> Run:
    further = {k: x for k, x in record.values.items() if k not in QUANTITIES}
    own = replace(record, values={k: x for k, x in record.values.items() if k in QUANTITIES})
    run = run_of(own, path, speed)
    inputs = {FORCED_INPUTS.get(name, name): x for name, x in further.items()}
    column = {**FORCED_INPUTS, **MOTIONS}.get(reference, reference)
    if reference and column not in inputs:
        inputs[column] = {**run.channels, **run.inputs}[column]
    for name, x in inputs.items():
        if not np.isfinite(x).all():
            fill = f"{how_to(record.time)}, " if fills(record.time, x) else ""
            way_out = f"{fill}cut the recording with [[windows]] or repair it"
            raise InputError(f"{record.source}: {name} lacks samples; {way_out}")
        if np.ptp(x) == 0:
            raise InputError(f"{record.source}: {name} is constant ({x[0]:g}): it moves nothing; leave it out")
    return replace(run, inputs={**run.inputs, **inputs})
