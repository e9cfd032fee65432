"""Speeds at which a mode may be critical: where the band of its real part holds zero.

The standard deviation of a critical speed is that of the real part at the model's own crossing over its slope there. It
does not know that the band widens away from the data, nor of crossings that the model misses by less than its own
uncertainty. Inverting the band along speed does: every speed is listed at which zero lies within it.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bicycle.critical.critical_speed import OSCILLATORY, REAL
from bicycle.critical.critical_speeds import critical_speeds
from bicycle.modal.named_modes import modes
from bicycle.model import Model
from bicycle.sensitivity.eigenvalue_derivatives import sensitivities
from bicycle.sensitivity.model_covariance import model_covariance
from bicycle.sensitivity.propagation import slope_of, standard_deviation
from tyre.base.arrays import Array, Complex
from tyre.base.errors import InputError

WIDTH = 1.96  # sd, for 95 %


@dataclass(frozen=True)
class CriticalInterval:
    """Speeds at which a mode may change its stability.

    Attributes
    ----------
    mode : str
        Name as in :func:`bicycle.modal.named_modes.modes`.
    kind : str
        ``oscillatory`` (a pair) or ``real``.
    low, high : float
        m/s; minus or plus infinity where the band still holds zero at the last speed of that side at which there is
        such a root.
    """

    mode: str
    kind: str
    low: float
    high: float

    @property
    def told(self) -> bool:
        """Whether there is a limit on either side."""
        return bool(np.isfinite(self.low) or np.isfinite(self.high))

    def holds(self, speed: float) -> bool:
        """Whether a ``speed`` (m/s) lies within."""
        return self.low <= speed <= self.high


def critical_intervals(
    model: Model,
    speeds: ArrayLike,
    given: Mapping[str, float] | None = None,
    *,
    assume: bool = False,
    width: float = WIDTH,
) -> tuple[CriticalInterval, ...]:
    """Where the real part of a mode is zero within its uncertainty, mode by mode and from slow to fast.

    The limits are interpolated between ``speeds`` and the crossings of the model itself. A real root has an infinite
    slope where it meets another, so of real roots only intervals are listed in which the model itself has a crossing.

    Parameters
    ----------
    model : Model
        Its ``covariance`` is that of what was measured together.
    speeds : array_like, shape (m,)
        That are looked at, rising, m/s.
    given, assume
        As in :func:`bicycle.sensitivity.model_covariance.model_covariance`.
    width : float
        Half width of the band in standard deviations, no unit.

    Returns
    -------
    tuple of CriticalInterval
        None where nothing is uncertain.

    Raises
    ------
    InputError
        Speeds that do not rise or that the model does not allow, or as ``model_covariance``.
    """
    v = np.asarray(speeds, float)
    if v.ndim != 1 or len(v) < 2 or not (np.diff(v) > 0).all():
        raise InputError("give two or more speeds, each above the last")
    names, covariance = model_covariance(model, given, assume=assume)
    if not names:
        return ()
    own = [c.speed for c in critical_speeds(model, float(v[-1])) if c.speed > v[0]]
    v = np.union1d(v, own)  # so each lies within an interval, however narrow that is
    every = sensitivities(model, v)
    slopes = np.stack([slope_of(name, every.parameters, every.of).real for name in names], -1)
    spread = standard_deviation(slopes, covariance)
    found = []
    for mode, branch in modes(model, v).branches.items():
        for root in branch.T:
            sd = np.take_along_axis(spread, _nearest(every.eigenvalues, root)[:, None], 1)[:, 0]
            real = (root.imag == 0) & ~np.isnan(root.real)  # a mode may be absent at some speeds
            for kind, there in ((OSCILLATORY, root.imag > 0), (REAL, real)):
                for part in _runs(there):
                    crosses = kind == OSCILLATORY or np.ptp(np.sign(root.real[part])) > 0
                    if crosses:
                        band = root.real[part] - width * sd[part], root.real[part] + width * sd[part]
                        found += [CriticalInterval(mode, kind, *ends) for ends in zero_within(v[part], *band)]
    return tuple(found)


def zero_within(at: Array, lower: Array, upper: Array) -> list[tuple[float, float]]:
    """Intervals in which zero lies between two lines, straight between the places where they are given.

    Parameters
    ----------
    at : ndarray, shape (m,)
        Rising.
    lower, upper : ndarray, shape (m,)

    Returns
    -------
    list of (float, float)
        An end at the first or the last place is infinite.
    """
    places = np.unique(np.concatenate([at, _zeros(at, lower), _zeros(at, upper)]))
    middle = (places[:-1] + places[1:]) / 2
    inside = (np.interp(middle, at, lower) <= 0) & (np.interp(middle, at, upper) >= 0)
    ends = np.concatenate([[-np.inf], places[1:-1], [np.inf]])
    return [(float(ends[part.start]), float(ends[part.stop])) for part in _runs(inside)]


def _zeros(at: Array, line: Array) -> Array:
    k = np.flatnonzero(np.sign(line[:-1]) * np.sign(line[1:]) < 0)
    return np.asarray(at[k] + (at[k + 1] - at[k]) * line[k] / (line[k] - line[k + 1]))


def _nearest(eigenvalues: Complex, root: Complex) -> NDArray[np.intp]:
    """Which of the ``eigenvalues`` (m, n) each ``root`` (m,) is; the first where there is none."""
    return np.asarray(np.abs(eigenvalues - np.where(np.isnan(root), np.inf, root)[:, None]).argmin(1))


def _runs(there: NDArray[np.bool_]) -> Iterator[slice]:
    """Stretches of places that are ``there`` (m,)."""
    change = np.flatnonzero(np.diff(np.concatenate([[0], there.astype(int), [0]])))
    for first, last in zip(change[::2].tolist(), change[1::2].tolist(), strict=True):
        yield slice(first, last)
