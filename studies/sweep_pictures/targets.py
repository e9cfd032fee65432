"""The outputs whose dependence on the parameters is drawn: critical speeds, and growth and damping at one speed."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.sweep_pictures.quantities import CRITICAL, growth_rates, limits, mode_rows, smallest_damping
from studies.sweep_pictures.stored import Stored, speeds_of
from studies.sweep_pictures.varied import growth_rates_at
from tyre.base.arrays import Array
from tyre.base.errors import InputError

LEAST_SHARE = 0.1  # of the bicycles that have a critical speed worth a row
OCCURRENCE = ("", ", second", ", third", ", fourth")


@dataclass(frozen=True, eq=False)
class Target:
    """An output: ``label`` with its unit, ``values`` (cells, samples), NaN where a bicycle does not have it."""

    label: str
    values: Array


@dataclass(frozen=True, eq=False)
class Stability:
    """Which bicycles are unstable at a speed.

    Attributes
    ----------
    speed : float or None
        m/s; None where each bicycle has a speed of its own.
    unstable : ndarray of bool, shape (cells, samples)
    growth : ndarray, shape (cells, samples)
        Largest growth rate, 1/s.
    anew : bool
        Computed for the figure, as the result does not hold it.
    """

    speed: float | None
    unstable: NDArray[np.bool_]
    growth: Array
    anew: bool

    @property
    def words(self) -> str:
        """Where, in words."""
        return "at its own speed" if self.speed is None else f"at {self.speed:.4g} m/s"


def stability(stored: Stored, at: float | None) -> Stability | None:
    """Which bicycles are unstable; None where nothing tells.

    Without a speed asked for, it is the one in the result at which the share of unstable bicycles is nearest to a half,
    or, where at none of them some are stable and some not, the median of the critical speeds,
    or else the middle speed of the result.

    Parameters
    ----------
    stored : Stored
    at : float or None
        Speed asked for, m/s.

    Raises
    ------
    InputError
        The result does not tell of this speed.
    """
    growth, speeds, asked = growth_rates(stored), speeds_of(stored), at is not None
    held: Stability | None = None
    if growth is not None and not speeds.size:
        return Stability(None, growth[..., 0] > 0, growth[..., 0], False)
    if growth is not None:
        share = (growth > 0).sum((0, 1)) / np.maximum(np.isfinite(growth).sum((0, 1)), 1)
        k = int(np.abs(share - 0.5).argmin()) if at is None else int(np.abs(speeds - at).argmin())
        held = Stability(float(speeds[k]), growth[..., k] > 0, growth[..., k], False)
        if (at is None and 0 < share[k] < 1) or (at is not None and abs(speeds[k] - at) < 1e-9 * max(at, 1)):
            return held
    if at is None and CRITICAL in stored.data:
        found = [one.speeds[np.isfinite(one.speeds)] for one in limits(stored)]
        at = float(f"{np.median(np.concatenate(found)):.3g}") if found else None
    if at is None and held is None and speeds.size:
        at = float(speeds[len(speeds) // 2])
    anew = None if at is None else growth_rates_at(stored, at)
    if at is not None and anew is not None:
        return Stability(at, anew > 0, anew, True)
    if asked:
        near = ", ".join(f"{speed:g}" for speed in speeds[np.argsort(np.abs(speeds - (at or 0)))[:2]])
        how = f"give one that it holds, the nearest are {near} m/s" if near else "leave --at out"
        raise InputError(
            f"--at {at:g}: {stored.path.name} does not tell of this speed, and what makes it has changed since, so it "
            f"cannot be computed anew; {how}"
        )
    return held


def targets(stored: Stored, stable: Stability | None) -> Iterator[Target]:
    """The outputs, the main ones first."""
    if CRITICAL in stored.data:
        for one in limits(stored):
            for k in range(one.speeds.shape[-1]):
                values = one.speeds[..., k]
                if np.isfinite(values[one.possible]).mean() >= LEAST_SHARE:
                    words = f"{one.words}{OCCURRENCE[k]}, m/s"
                    yield Target(words, values)
    if stable is None:
        return
    yield Target(f"largest growth rate {stable.words}, 1/s", stable.growth)
    if stable.anew or stable.speed is None:
        return
    k = int(np.abs(speeds_of(stored) - stable.speed).argmin())
    damping = smallest_damping(stored)
    if damping is not None:
        yield Target(f"smallest damping ratio {stable.words}", damping[..., k])


def mode_targets(stored: Stored, at: float | None) -> Iterator[Target]:
    """Damping ratios (or else frequencies) of the named modes at one of the speeds of the result.

    Parameters
    ----------
    stored : Stored
    at : float or None
        Speed asked for, m/s; the middle one of the result without.
    """
    speeds = speeds_of(stored)
    if not speeds.size:
        return
    k = len(speeds) // 2 if at is None else int(np.abs(speeds - at).argmin())
    for one in mode_rows(stored):
        kind, unit = ("damping ratio", "") if one.damping is not None else ("frequency", ", Hz")
        values = one.damping if one.damping is not None else one.frequency
        assert values is not None
        here = values[..., k]
        if np.isfinite(here).mean() >= LEAST_SHARE and np.nanmax(np.abs(here)) > 0:
            name = one.mode.replace("_", " ")
            yield Target(f"{name}: {kind} at {speeds[k]:.4g} m/s{unit}", here)
