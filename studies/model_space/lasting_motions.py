"""Stable limit cycles on tyres that saturate: wobble amplitude over speed, and the effect of a steering damper."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bicycle.effects.effect_registry import effect_class
from bicycle.model.model import Model
from bicycle.model.model_family import ModelFamily
from bicycle.model.wheel_tyres import wheel_curves
from bicycle.motion.limit_cycles import SLOWEST, Branch, Cycle, LimitCycles, Onset, find_limit_cycles, find_onsets
from bicycle.motion.nonlinear import CurveTyre
from bicycle.stability.critical import CriticalSpeed, critical_speeds_of_many
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError

WOBBLE, WEAVE, DAMPER = "wobble", "weave", "steer_damper"
BALANCED = 1.5  # Hz, up to which a rider is taken to balance what grows: slow weave and capsize
GROWS = 1e-6  # 1/s: what leaves a motion more slowly does not leave it


def curves_of(content: Mapping[str, Any]) -> dict[str, CurveTyre]:
    """Full curves, by wheel, that the tyre file of a model file's ``content`` holds; {} without any."""
    return {wheel: CurveTyre(*curve) for wheel, curve in wheel_curves(content.get("effects") or {}).items()}


def with_onsets(
    model: Model, content: Mapping[str, Any], critical: Sequence[CriticalSpeed]
) -> tuple[CriticalSpeed, ...]:
    """Critical speeds of a model with how the motion begins there; as they are without tyres that saturate."""
    try:
        onsets = find_onsets(model, critical, **curves_of(content))
    except InputError:
        return tuple(critical)
    begins = {onset.critical: onset.kind for onset in onsets}
    return tuple(replace(speed, bifurcation=begins.get(speed)) for speed in critical)


class Trace(NamedTuple):
    """Numbers along a branch, for tables and figures; at rest the amplitude is 0."""

    mode: str  # name, two joined by a plus where in doubt
    speed: Array  # (m,), m/s
    amplitude: Array  # degrees at the bar
    frequency: Array  # Hz
    stable: tuple[str, ...]  # as in :meth:`LimitCycles.stability`; at rest that of the neighbour
    lasting: NDArray[np.bool_]  # if nothing leaves it that a rider does not balance
    followed: bool  # to an end within linear geometry


def branches_of(cycles: LimitCycles, mode: str) -> list[Branch]:
    """Branches of the motions ``cycles`` that are, or may be, of a ``mode``."""
    return [branch for branch in cycles.branches if mode in branch.mode.split("+")]


def traces_of(cycles: LimitCycles, mode: str = "") -> list[Trace]:
    """Numbers along every branch of the motions ``cycles``, or along those of a ``mode``."""
    traces = []
    for branch in branches_of(cycles, mode) if mode else cycles.branches:
        rows = []
        for cycle in (point.cycle for point in branch.points):
            moves = cycle.slips.any()
            angle = np.degrees(cycles.amplitude(cycle)) if moves else 0.0
            kind = cycles.stability(cycle) if moves else ""
            stays = moves and (kind != "no" or lasts(cycles, cycle))  # what falls slowly is balanced
            rows.append((cycle.speed, angle, cycle.frequency_hz, kind, stays))
        speed, amplitude, frequency, stable, lasting = zip(*rows, strict=True)
        stable = (stable[0] or stable[1], *stable[1:-1], stable[-1] or stable[-2])
        followed = branch.reason not in ("geometry", "lost")
        v, height, hertz = map(np.array, (speed, amplitude, frequency))
        traces.append(Trace(branch.mode, v, height, hertz, stable, np.array(lasting), followed))
    return traces


def lasts(cycles: LimitCycles, cycle: Cycle) -> bool:
    """True if nothing faster than 1.5 Hz leaves a ``cycle``."""
    multipliers = cycles.multipliers(cycle)
    across = np.delete(multipliers, np.abs(multipliers - 1).argmin())  # all but the one along the cycle
    growing = across[np.abs(across) > np.exp(GROWS * cycle.period / 2)]
    hertz = np.abs(np.angle(-growing)) / (np.pi * cycle.period)  # of half a period and the mirror image
    return bool((hertz < BALANCED).all())


class Extent(NamedTuple):
    """Speeds between which a mode has a stable limit cycle, and the largest steer amplitude."""

    low: float  # m/s
    high: float  # m/s
    largest: float  # degrees
    at: float  # m/s
    followed: bool  # False if larger motions than could be followed may exist


def extent(traces: Iterable[Trace], up_to: float = np.inf) -> Extent | None:
    """Extent over the speed (to ``up_to``, m/s) of the wobbles that last; None without any."""
    parts = []
    for trace in traces:
        last, speed = trace.lasting & (trace.speed <= up_to), trace.speed
        if WOBBLE not in trace.mode.split("+") or not last.any():
            continue
        height = np.where(last, trace.amplitude, 0.0)
        neighbours = (trace.amplitude == 0) | (trace.lasting & (speed > up_to))
        reached = np.minimum(speed[last | (neighbours & (np.convolve(last, [1, 1, 1], "same") > 0))], up_to)
        k = int(height.argmax())
        at, largest = speed[k], height[k]
        around = slice(k - 1, k + 2)
        if (
            last[around].sum() == 3 and abs(np.sign(np.diff(speed[around])).sum()) == 2
        ):  # the parabola through three points
            bend, slope, _ = np.polyfit(speed[around] - at, height[around], 2)
            at, largest = at - slope / (2 * bend), largest - slope**2 / (4 * bend)
        followed = trace.followed and trace.amplitude.max() <= height.max()
        ends = float(reached.min()), float(reached.max())
        parts.append(Extent(*ends, float(largest), float(at), bool(followed)))
    if not parts:
        return None
    low, high = min(trace.low for trace in parts), max(trace.high for trace in parts)
    most = max(parts, key=lambda trace: trace.largest)
    return most._replace(low=low, high=high, followed=all(trace.followed for trace in parts))


def motion_at(limit_cycles: LimitCycles, speed: float, mode: str = WOBBLE) -> float:
    """Steer amplitude (degrees) of the largest stable limit cycle of a ``mode`` at a ``speed`` (m/s).

    0 if there is none; NaN if the mode is unstable and none was found, so that it is larger than linear geometry holds.
    """
    cycles = {
        limit_cycles.amplitude(cycle): cycle for branch in branches_of(limit_cycles, mode) for cycle in branch.at(speed)
    }
    largest = next((size for size in sorted(cycles, reverse=True) if lasts(limit_cycles, cycles[size])), None)
    if largest is not None:
        return float(np.degrees(largest))
    return np.nan if _unstable(limit_cycles, speed, mode) else 0.0


def largest_wobble(cycles: LimitCycles) -> float:
    """Largest steer amplitude (degrees) of wobble over the speed, 0 and NaN as of :func:`motion_at`."""
    reached = extent(traces_of(cycles, WOBBLE))
    if reached is None:
        return np.nan if any(_unstable(cycles, onset.critical.speed + 1e-9) for onset in cycles.onsets) else 0.0
    return reached.largest if reached.followed else np.nan


def _unstable(cycles: LimitCycles, speed: float, mode: str = WOBBLE) -> bool:
    """True if a ``mode`` grows at a ``speed`` (m/s), by its critical speeds."""
    edges = [onset.critical for onset in cycles.onsets if mode in onset.critical.mode.split("+")]
    passed = [edge for edge in edges if edge.speed <= speed]
    return passed[-1].destabilising if passed else bool(edges) and not edges[0].destabilising


class Side(NamedTuple):
    """Wobble and weave of a model with one steering damper."""

    damping: float  # N m s/rad beside what the model has
    wobble: tuple[CriticalSpeed, ...]  # its critical speeds
    extent: Extent | None  # of wobbles that last; None: none does
    weave: Onset | None  # at which fast weave becomes unstable
    caught: float | None  # degrees at the bar of the motion within linear geometry that lasts just above that speed


def side_of(cycles: LimitCycles, damping: float = 0.0) -> Side:
    """Wobble and weave of the motions ``cycles`` with this ``damping`` (N m s/rad)."""
    begins = [
        onset for onset in cycles.onsets if onset.critical.destabilising and onset.critical.frequency_hz >= SLOWEST
    ]
    weave = next((onset for onset in begins if WEAVE in onset.critical.mode.split("+")), None)
    cycles_above = [cycle for _, cycle in cycles.at(weave.critical.speed * (1 + 1e-3))] if weave else []
    caught = [
        cycles.amplitude(cycle) for cycle in cycles_above if lasts(cycles, cycle) and cycles.within_geometry(cycle)
    ]
    wobble = _wobbles(onset.critical for onset in cycles.onsets)
    degrees = float(np.degrees(max(caught, default=np.nan)))
    return Side(damping, wobble, extent(traces_of(cycles, WOBBLE)), weave, degrees if caught else None)


def with_damper(model: Model, damping: float) -> Model:
    """The ``model`` with steering ``damping`` (N m s/rad) added to its own."""
    kind = effect_class(DAMPER)
    present = next((getattr(effect, "damping", 0.0) for effect in model.effects if effect.identifier == DAMPER), 0.0)
    return model.with_effect(kind(damping=present + damping))


def least_damper(model: Model, max_speed: float) -> float | None:
    """Smallest steering damping (N m s/rad, to 0.01) with which wobble has no critical speed; None up to 5."""
    most = next(parameter.typical[1] for parameter in effect_class(DAMPER).parameters if parameter.name == "damping")
    damped, key, low, width = with_damper(model, 0.0), f"{DAMPER}.damping", 0.0, most
    for count in (25, 20):  # steps of 0.2, then of 0.01
        steps = low + width * np.arange(1, count + 1) / count
        numbers = {key: damped.parameters[key] + steps}
        crossings, impossible = critical_speeds_of_many(ModelFamily(damped, (key,)), numbers, count, max_speed)
        ends = [float(steps[k]) for k, speeds in enumerate(crossings) if k not in impossible and not _wobbles(speeds)]
        if not ends:
            return None
        low, width = ends[0] - width / count, width / count
    return round(ends[0], 2)


def _wobbles(critical: Iterable[CriticalSpeed]) -> tuple[CriticalSpeed, ...]:
    return tuple(speed for speed in critical if WOBBLE in speed.mode.split("+"))


def sides(cycles: LimitCycles, damping: float | None, tyres: Mapping[str, Any], max_speed: float) -> list[Side]:
    """Both sides of a steering damper: without and with ``damping`` (N m s/rad), by default the smallest that ends
    wobble; one side if there is no wobble to end, or no such damper."""
    first = side_of(cycles)
    if damping is None:
        damping = least_damper(cycles.model, max_speed) if first.wobble else None
    if damping is None:
        return [first]
    damped = find_limit_cycles(with_damper(cycles.model, damping), **tyres, max_speed=max_speed)
    return [first, side_of(damped, damping)]
