"""Cut a rolling recording into sweeps and steps under steady conditions, and find the levels they were run at.

The protocol of most rigs sweeps load, pressure and camber in one run. A stretch is where the slip angle moves while
load, pressure, camber and speed are steady; stretches whose load, pressure and camber agree within
:data:`tyre.recordings.run_checks.TOLERANCES` are repeats of one condition.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tyre.fits.relaxation import is_slip_step
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.recordings.recording import Channel, Condition, LateralStiffnessTest, RigRun, check_condition
from tyre.recordings.run_checks import TOLERANCES, Tolerance, part_means
from tyre.recordings.signal_quality import noise_level


@dataclass(frozen=True)
class Limits:
    """Limits by which stretches and levels are found."""

    parts: tuple[int, ...] = (400, 2000)  # of a recording, in which movement is told from rest; finer ones for many
    fewest: int = 30  # parts a stretch, or finer ones are taken
    load_change: float = 0.08  # of the load within three parts: the wheel is being set down, or the load changed
    lifted: float = 0.08  # of the largest load, below which the wheel is off the ground
    rest: int = 5  # parts without movement within one stretch: a sweep turns round
    astray: float = 0.02  # of the parts may lie off the level of a recording that is taken as a whole


LIMITS = Limits()
SPEED = Tolerance("speed", 0.2, 0.1, "m/s")  # cuts a recording, but is no part of its condition


@dataclass(frozen=True)
class Stretch:
    """Samples ``first`` to ``last`` (excluded) of a sweep, or of a step with the rest before and after it."""

    first: int  # sample
    last: int  # sample, excluded
    kind: str  # ``sweep`` or ``step``

    def of(self, run: RigRun) -> RigRun:
        """Cut the stretch out of a ``run``; a channel without a sample in it is left out."""
        channels: Any = {name: x[self.first : self.last] for name, x in vars(run).items() if isinstance(x, np.ndarray)}
        optional = ("aligning_moment", "inclination", "speed", "temperature", "pressure")
        channels |= {name: None for name in optional if name in channels and not np.isfinite(channels[name]).any()}
        return replace(run, **channels, kind="slip_step" if self.kind == "step" else run.kind)


def split(events: Mapping[str, RigRun | LateralStiffnessTest]) -> dict[str, RigRun | LateralStiffnessTest]:
    """Cut rolling ``events`` of one file where conditions change; undeclared ones are the levels of their channels."""
    pieces: dict[str, RigRun | LateralStiffnessTest] = {}
    for name, event in events.items():
        if isinstance(event, RigRun) and event.kind == "steady":
            pieces |= {f"{name}.{level}".strip("."): run for level, run in steady_levels(event).items()}
            continue
        cuts = stretches(event) if isinstance(event, RigRun) else []
        if not isinstance(event, RigRun) or not cuts or _is_level(event, cuts):
            pieces[name] = event
            continue
        for number, cut in enumerate(cuts, 1):
            pieces[f"{name}.{cut.kind}{number}".lstrip(".")] = cut.of(event)
    rolling = {name: run for name, run in pieces.items() if isinstance(run, RigRun)}
    for name, condition in level_conditions(rolling).items():
        pieces[name] = replace(rolling[name], condition=condition)
    return pieces


def steady_levels(run: RigRun) -> dict[str, RigRun]:
    """Sort the complete points of a steady table by the levels of what its sidecar leaves to the channels, each in the
    order of its slip; "" is the only level."""
    complete = np.isfinite(run.slip_angle) & np.isfinite(run.lateral_force) & np.isfinite(run.vertical_load)
    levels: dict[str, dict[int, str]] = {}  # of a quantity: point -> its level as it is called
    for quantity, tolerance in TOLERANCES.items():
        channel: Channel | None = getattr(run, tolerance.channel)
        if channel is None or not np.isnan(getattr(run.condition, quantity)):
            continue
        complete &= np.isfinite(channel)
        groups = _levels({str(place): float(channel[place]) for place in np.flatnonzero(complete)}, tolerance)
        levels[quantity] = {}
        if len(groups) == 1:  # it needs no name
            continue
        for group in groups:
            places = [int(name) for name in group]
            level = tolerance.nominal(float(np.median(channel[places]))) / tolerance.size
            levels[quantity] |= dict.fromkeys(places, f"{level:g}{tolerance.unit}")
    members_of: dict[str, list[int]] = {}
    columns = [getattr(run, tolerance.channel) for quantity, tolerance in TOLERANCES.items() if quantity in levels]
    rising = np.lexsort([np.nan_to_num(x) for x in (run.slip_angle, *reversed(columns))])
    for place in rising[complete[rising]].tolist():
        name = "_".join(called[place] for called in levels.values() if place in called)
        members_of.setdefault(name, []).append(place)
    levelled = {}
    for name, places in members_of.items():
        order = np.array(places)[np.argsort(run.slip_angle[places], kind="stable")]
        channels: Any = {key: x[order] for key, x in vars(run).items() if isinstance(x, np.ndarray)}
        levelled[name] = replace(run, **channels | {"time": np.arange(order.size, dtype=float)})
    return levelled


def stretches(run: RigRun) -> list[Stretch]:
    """Find the sweeps and steps of a rolling recording, in their order."""
    for parts in LIMITS.parts:
        moving = _moving(run, parts)
        if len(moving) * LIMITS.fewest <= parts:
            break
    pieces: list[Stretch] = []
    for place, (first, last) in enumerate(moving):
        step = Stretch(*_with_rest(moving, place, run), "step")
        rests = is_slip_step(replace(step.of(run), kind="slip_sweep"))
        pieces.append(step if rests else Stretch(first, last, "sweep"))
    return pieces


def level_conditions(runs: Mapping[str, RigRun]) -> dict[str, Condition]:
    """Complete the condition of every one of some ``runs`` of one file by the levels of their channels."""
    known_values: dict[str, Any] = {name: {} for name in runs}
    for quantity, tolerance in TOLERANCES.items():
        medians = {
            name: float(np.nanmedian(channel))
            for name, run in runs.items()
            if np.isnan(getattr(run.condition, quantity))
            and (channel := getattr(run, tolerance.channel)) is not None
            and np.isfinite(channel).any()
        }
        for members in _levels(medians, tolerance):
            values = np.array([medians[name] for name in members])
            middle = float(np.median(values))
            if np.abs(values - middle).max() > tolerance.width(middle):
                run, range_shown = runs[members[0]], [end / tolerance.size for end in (values.min(), values.max())]
                raise InputError(
                    f"{run.source}: the {quantity} of its {len(values)} stretches varies from {range_shown[0]:.4g} to "
                    f"{range_shown[1]:.4g} {tolerance.unit} without distinct levels: these are not repeats of one "
                    "condition; describe them in separate sidecars, with [[windows]]"
                )
            for name in members:
                known_values[name][quantity] = float(tolerance.nominal(middle))
    conditions = {}
    for name, run in runs.items():
        if np.isnan(run.condition.camber):
            known_values[name].setdefault("camber", 0.0)
        conditions[name] = replace(run.condition, **known_values[name])
        for quantity, key in (("load", "load_N = vertical load"), ("pressure", "pressure_bar = inflation pressure")):
            if np.isnan(getattr(conditions[name], quantity)):
                where = f"{run.source}{f', {name}' if name else ''}"
                raise InputError(f"{where}: key {quantity!r} is missing ({key}), and no channel has it")
        check_condition(conditions[name], where=str(run.source))
    return conditions


def _levels(medians: Mapping[str, float], tolerance: Tolerance) -> list[list[str]]:
    """Sort names into groups whose ``medians`` lie without a gap wider than the tolerance."""
    groups: list[list[str]] = []
    for name in sorted(medians, key=lambda name: medians[name]):
        if groups and medians[name] - medians[groups[-1][-1]] <= tolerance.width(medians[name]):
            groups[-1].append(name)
        else:
            groups.append([name])
    return groups


def _is_level(run: RigRun, cuts: list[Stretch]) -> bool:
    """True if nearly all of a recording lies at the level of its stretches, in every channel of the condition."""
    for tolerance in (*TOLERANCES.values(), SPEED):
        channel: Channel | None = getattr(run, tolerance.channel)
        if channel is None or not np.isfinite(channel).any():
            continue
        middles = {
            str(place): float(np.nanmedian(x))
            for place, cut in enumerate(cuts)
            if np.isfinite(x := channel[cut.first : cut.last]).any()
        }
        level = float(np.median([*middles.values()])) if middles else float(np.nanmedian(channel))
        distance = np.abs(part_means(channel) - level)
        spread = max((abs(middle - level) for middle in middles.values()), default=0.0)
        width = tolerance.width(level)
        if np.mean(distance > 1.5 * width) > LIMITS.astray or spread > width or len(_levels(middles, tolerance)) > 1:
            return False
    return True


def _moving(run: RigRun, parts: int) -> list[tuple[int, int]]:
    """Find where the slip angle moves under a steady condition: first sample and the one after the last, from 0."""
    count = run.time.size
    size = max(count // parts, 5)
    edges = np.arange(0, count, size)
    if edges.size < 4:
        return []
    slip, load = means_between(run.slip_angle, edges), means_between(run.vertical_load, edges)
    span = float(np.ptp(slip))
    if span == 0:
        return []
    noise = noise_level(run.slip_angle[np.isfinite(run.slip_angle)])
    change = np.abs(_change_across(slip)) / 2
    active = change > max(4 * noise / np.sqrt(size), 2e-3 * span)
    heavy = float(np.quantile(load, 0.9))
    on_ground = LIMITS.lifted * heavy
    active &= (load > on_ground) & (np.abs(_change_across(load)) < LIMITS.load_change * np.maximum(load, on_ground))
    held_channels: list[tuple[Array, Any]] = [(load, lambda level: LIMITS.load_change * level)]
    for tolerance in (*TOLERANCES.values(), SPEED):
        channel: Channel | None = getattr(run, tolerance.channel)
        if channel is not None and tolerance.channel != "vertical_load" and np.isfinite(channel).any():
            held_channels.append((means_between(channel, edges), tolerance.width))
    spans: list[list[int]] = []
    for place in np.flatnonzero(active):
        is_near = bool(spans) and place - spans[-1][1] <= LIMITS.rest
        if is_near and all(
            abs(x[place] - (level := x[slice(*spans[-1])].mean())) < width(level) for x, width in held_channels
        ):
            spans[-1][1] = int(place) + 1
        else:
            spans.append([int(place), int(place) + 1])
    return [
        (int(edges[first]), min(int(edges[last - 1]) + size, count))
        for first, last in spans
        if np.ptp(slip[max(first - 1, 0) : last + 1]) > 0.05 * span
    ]


def _with_rest(moving: list[tuple[int, int]], place: int, run: RigRun) -> tuple[int, int]:
    """Widen number ``place`` of the ``moving`` stretches by the standstill before and after it under its load."""
    first, last = moving[place]
    before = moving[place - 1][1] if place else 0
    after = moving[place + 1][0] if place + 1 < len(moving) else run.time.size
    within = run.vertical_load[first:last]
    load = float(np.nanmedian(within)) if np.isfinite(within).any() else 0.0
    at_load = np.abs(run.vertical_load - load) < 2 * LIMITS.load_change * abs(load)
    lifted = np.flatnonzero(~at_load & np.isfinite(run.vertical_load))
    before = max([before, *(lifted[lifted < first][-1:] + 1).tolist()])
    after = min([after, *lifted[lifted >= last][:1].tolist()])
    return int(before), int(after)


def means_between(channel: Array, edges: NDArray[np.intp]) -> Array:
    """Means between ``edges``, those without a sample filled from the side."""
    is_sample = np.isfinite(channel)
    total = np.add.reduceat(np.where(is_sample, channel, 0.0), edges)
    number = np.add.reduceat(is_sample.astype(float), edges)
    has_samples = number > 0
    if not has_samples.any():
        return np.zeros(edges.size)
    return np.interp(np.arange(edges.size), np.flatnonzero(has_samples), total[has_samples] / number[has_samples])


def _change_across(means: Array) -> Array:
    """Change from the part before to the part after, shape as given."""
    padded = np.pad(means, 1, mode="edge")
    return np.asarray(padded[2:] - padded[:-2])
