"""Periodic motions of variants of a model: over any of its numbers, and over plausible tyres and fronts."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bicycle import limit_cycles
from bicycle.continuation import Balance, Branch, Rest, follow_both_ways, same
from bicycle.critical import critical_speeds
from bicycle.limit_cycles import BAND, COLUMNS, SLOWEST, Cycle, LimitCycles, Onset, find_limit_cycles
from bicycle.model import Model
from bicycle.nonlinear import MagicTyre
from bicycle.slip_system import SlipSystem, Tyre
from tyre.errors import InputError

__all__ = ["NumberCycles", "amplitude_band", "cycles_over", "onset_band"]

PLAUSIBLE_PEAK = (0.6, 1.0)  # D of dry roads, assumed
GRID = 41  # values of a number at which roots are counted
SMALL = 1e-3  # rad at the bar: below, a motion is the one that begins at the critical speed


@dataclass(frozen=True)
class NumberCycles:
    """Periodic motions at one speed (m/s) over a number of a model."""

    speed: float
    at_value: Callable[[float], LimitCycles] = field(repr=False)  # measures motions of the model with that value
    begins: tuple[float, ...]  # values at which a mode becomes or ceases to be unstable, where motions begin
    branches: tuple[Branch, ...]

    def at(self, value: float) -> list[tuple[str, Cycle]]:
        """Cycles at a ``value`` of the number with the name of their mode."""
        return [(branch.mode, cycle) for branch in self.branches for cycle in branch.at(value)]

    def folds(self) -> list[tuple[float, str, Cycle]]:
        """Value, mode and cycle of each fold."""
        return [
            (point.number, branch.mode, point.cycle)
            for branch in self.branches
            for point in branch.points
            if any(point.cycle is fold for fold in branch.folds)
        ]

    def frame(self, values: ArrayLike, point: tuple[float, float] | None = None) -> Any:
        """Tabulate the cycles at ``values``, a row each: the ``number`` and the columns of `LimitCycles.frame`."""
        import pandas as pd

        rows = [
            {"number": value, **self.at_value(value).row(mode, cycle, point)}
            for value in np.atleast_1d(np.asarray(values, float)).tolist()
            for mode, cycle in self.at(value)
        ]
        return pd.DataFrame(rows, columns=["number", *COLUMNS])


def cycles_over(
    make: Callable[[float], Model], values: tuple[float, float], *, speed: float, rear: Tyre | None = None,
    front: Tyre | None = None, dry_friction: float = 0.0,
) -> NumberCycles:  # fmt: skip
    """Follow the periodic motions at one speed over a number of a model, of its tyres, damper, masses and so on.

    They are followed from the values at which a mode loses its stability at this speed, and from the motions at the
    least, the middle and the largest value.

    Parameters
    ----------
    make : callable
        Value of the number (SI) -> `Model`, as ``lambda x: family.with_values({"steer_damper.damping": x})`` of a
        `ModelFamily` is.
    values : (float, float)
        Least and largest value.
    speed : float
        m/s.
    rear, front : MagicTyre or CurveTyre
        Curves of the tyres, by default the Magic Formula with D = 0.8, C = 1.3, E = 0.
    dry_friction : float
        Of the steering, N m.

    Raises
    ------
    InputError
        Values that do not rise, or a model that has no such motions (see :func:`find_limit_cycles`).
    """
    low, high = values
    if not (np.isfinite(values).all() and low < high):
        raise InputError(f"values {low:g} to {high:g}: give the least and then the largest, both finite")

    @lru_cache(maxsize=256)
    def measured(value: float) -> LimitCycles:
        model = make(value)
        system = SlipSystem.at(model, speed, rear=rear, front=front)
        system = system.with_friction(dry_friction) if dry_friction else system
        return LimitCycles(model, system, rear=rear, front=front)

    def balance_at(value: float, omega: float) -> Balance:
        return Balance(
            measured(value).system, omega, (high - low) / 10, (low, high), lambda x: (measured(x).system, speed)
        )

    rests = [] if dry_friction else _rests(measured, values, speed)
    balances = [balance_at(rest.number, rest.critical.angular_frequency) for rest in rests]
    branches = limit_cycles.branches_from(rests, balances)
    for value in (low, (low + high) / 2, high):
        found = find_limit_cycles(make(value), rear=rear, front=front)
        for own, cycle in [(branch, cycle) for branch in found.branches for cycle in branch.at(speed)]:
            rubs = limit_cycles.under_friction(found.system, cycle, dry_friction, own) if dry_friction else cycle
            if rubs is None or any(same(rubs, other) for branch in branches for other in branch.at(value)):
                continue
            balance = balance_at(value, rubs.angular_frequency)
            start = balance.start(rubs, value)
            if start is not None:
                leaves = limit_cycles.leaver(balance.system)
                branches.append(follow_both_ways(balance, start, leaves, own.mode, own.begin, rests))
    return NumberCycles(speed, measured, tuple(rest.number for rest in rests), tuple(branches))


def _rests(measured: Callable[[float], LimitCycles], values: tuple[float, float], speed: float) -> list[Rest]:
    """Values at which the number of growing modes that swing changes at a ``speed``."""

    def growing(value: float) -> int:
        roots = np.linalg.eigvals(measured(value).system.linear(speed))
        return int(((roots.real > 0) & (roots.imag > 2 * np.pi * SLOWEST)).sum())

    grid = np.linspace(*values, GRID).tolist()
    counts = [growing(value) for value in grid]
    found = []
    for (one, other), (before, after) in zip(pairwise(grid), pairwise(counts), strict=True):
        if before == after:
            continue
        for _ in range(40):
            middle = (one + other) / 2
            one, other = (middle, other) if growing(middle) == before else (one, middle)
        crossings = [near for near in critical_speeds(measured(one).model, 2 * speed) if near.oscillatory]
        nearest = min(crossings, key=lambda near: abs(near.speed - speed), default=None)
        if nearest is not None and abs(nearest.speed - speed) < 1e-4 * speed:  # else a root only became slow
            found.append(Rest(one, nearest))
    return found


def onset_band(found: LimitCycles, added: Sequence[float] = (BAND[0], 0.0, BAND[1])) -> Any:
    """Tabulate how motions begin with other curves: a row for each critical speed and each number ``added`` to E.

    Columns: speed_m_s, mode, added_curvature, begins, lyapunov_1_s_rad2, fold_speed_m_s, fold_amplitude_deg and
    jump_amplitude_deg, the motion that a small one jumps to at the critical speed. They are missing if there is none
    within linear geometry.
    """
    import pandas as pd

    rows = []
    for by in added:
        other = _again(found, added=by) if by else found
        for onset in other.onsets:
            v = onset.critical.speed
            kind = Onset(onset.critical, onset.bend, (onset.bend, onset.bend)).kind
            ends = [one for one in other.branches if onset.critical in (one.begin, one.end)]
            folds = [fold for one in ends for fold in one.folds]
            fold = min(folds, key=lambda cycle: abs(cycle.speed - v), default=None)
            sizes = [other.amplitude(cycle) for one in ends for cycle in one.at(v)] if kind == "jumps" else []
            rows.append((
                v, onset.critical.mode, by, kind, onset.bend, fold.speed if fold else np.nan,
                np.degrees(other.amplitude(fold)) if fold else np.nan,
                np.degrees(min((size for size in sizes if size > SMALL), default=np.nan)),
            ))  # fmt: skip
    columns = [
        "speed_m_s", "mode", "added_curvature", "begins", "lyapunov_1_s_rad2", "fold_speed_m_s", "fold_amplitude_deg",
        "jump_amplitude_deg",
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=columns).sort_values(["speed_m_s", "added_curvature"], ignore_index=True)


def amplitude_band(
    found: LimitCycles, speeds: ArrayLike, *, peak: tuple[float, float] = PLAUSIBLE_PEAK,
    added: Sequence[float] = BAND, models: Iterable[Model] = (),
) -> Any:  # fmt: skip
    """Tabulate the largest motion of each mode at ``speeds`` (m/s) with its band over plausible tyres and fronts.

    Amplitudes are proportional to D, so that its band takes no new solution. E is followed with each of ``added``,
    and each of ``models``, such as the bicycle with other fronts, for itself. The whole band is that of D times that
    of all others. An amplitude is 0 if a variant has no such motion, inf if its motion is beyond linear geometry.

    Raises
    ------
    InputError
        Dry friction, which breaks the proportion, or tyres whose D is not one number.
    """
    import pandas as pd

    factors = {float(getattr(tyre or MagicTyre(), "friction", np.nan)) for tyre in (found.rear, found.front)}
    if len(factors) > 1 or np.isnan(min(factors)):
        raise InputError("peak: the band over D needs Magic Formula tyres of one D; give rear and front the same")
    if found.dry_friction:
        raise InputError("dry_friction: with it amplitudes are not proportional to D; take the band without")
    low, high = (factor / min(factors) for factor in sorted(peak))
    every = [found, *(_again(found, added=by) for by in added), *(_again(found, model=model) for model in models)]
    rows = []
    for speed in np.atleast_1d(np.asarray(speeds, float)).tolist():
        for mode in sorted({mode for each in every for mode, _ in each.at(speed)}):
            sizes, hertz = np.transpose([_largest(each, mode, speed) for each in every])
            parts = sizes[: len(added) + 1], np.append(sizes[:1], sizes[len(added) + 1 :]), sizes
            bent, others, whole = [(part.min(), part.max()) for part in parts]
            own = (sizes[0], low * sizes[0], high * sizes[0])
            combined = (low * whole[0], high * whole[1], np.nanmin(hertz), np.nanmax(hertz))
            rows.append((speed, mode, *own, *bent, *others, *combined))
    names = ("peak_low", "peak_high", "curvature_low", "curvature_high", "model_low", "model_high", "low", "high")
    columns = ["speed_m_s", "mode", "steer_amplitude_deg", *(f"{name}_deg" for name in names)]
    return pd.DataFrame(rows, columns=[*columns, "frequency_low_Hz", "frequency_high_Hz"])


def _again(found: LimitCycles, *, added: float = 0.0, model: Model | None = None) -> LimitCycles:
    """Motions of another ``model``, or with a number ``added`` to E."""
    rear, front = (limit_cycles.with_curvature(tyre, added) for tyre in (found.rear, found.front))
    return find_limit_cycles(model or found.model, rear=rear, front=front, max_speed=found.max_speed)


def _largest(found: LimitCycles, mode: str, speed: float) -> tuple[float, float]:
    """Amplitude in degrees and frequency in Hz of the largest motion of a ``mode``; 0 or inf, and nan, if none is."""
    cycles = [cycle for name, cycle in found.at(speed) if name == mode]
    if cycles:
        return max((float(np.degrees(found.amplitude(cycle))), cycle.frequency_hz) for cycle in cycles)
    below = [one.critical for one in found.onsets if one.critical.mode == mode and one.critical.speed < speed]
    return (np.inf if below and below[-1].destabilising else 0.0), np.nan
