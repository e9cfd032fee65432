"""Uncertainty of frequencies, damping ratios and critical speeds that follows from a covariance of parameters.

With z = a + i b, f = b / (2 pi) and the damping ratio -a / abs(z):
df = db / (2 pi), d(ratio) = b (a db - b da) / abs(z)^3. The standard deviation of a critical speed knows neither that
the band of the real part widens away from the data, nor crossings that the model misses by less than its own
uncertainty; :func:`critical_intervals` inverts the band along speed.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bicycle.model.default_sd import GIVEN, standard_deviations
from bicycle.model.eigen import frequency_hz
from bicycle.model.model import Model
from bicycle.parameters.parameter_covariance import checked_covariance, entries_of
from bicycle.stability.critical import OSCILLATORY, REAL, CriticalSpeed, critical_speeds
from bicycle.stability.named_modes import modes
from bicycle.stability.sensitivity import critical_speed_sensitivities, sensitivities
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError, unknown
from tyre.measured.properties import Estimate


def damping_ratio_gradient(eigenvalue: ArrayLike, slope: ArrayLike) -> Array:
    """Derivatives of the damping ratio from eigenvalues and their derivatives, 1/s; shapes broadcast."""
    root: Any = np.asarray(eigenvalue, complex)
    change: Any = np.asarray(slope, complex)
    return np.asarray(root.imag * (root.real * change.imag - root.imag * change.real) / abs(root) ** 3)


def standard_deviation(gradient: ArrayLike, covariance: ArrayLike) -> Array:
    """First-order sd sqrt(g' S g), shape (...), for gradients (..., p) and a covariance (p, p)."""
    g = np.asarray(gradient, float)
    return np.sqrt(np.maximum(np.einsum("...i,ij,...j->...", g, np.asarray(covariance, float), g), 0.0))


def mode_gradients(model: Model, speed: ArrayLike, eigenvalue: ArrayLike, names: Sequence[str]) -> tuple[Array, Array]:
    """Derivatives of frequency (Hz) and damping ratio of oscillations, shape of ``eigenvalue`` and (p,)."""
    v = np.atleast_1d(np.asarray(speed, float))
    target = np.asarray(eigenvalue, complex)
    if np.ndim(speed) and target.shape[:1] != v.shape:
        raise InputError(f"{len(v)} speeds, but eigenvalues of shape {target.shape}; give a row for each speed")
    rows = target.reshape(len(v), -1)
    derivatives = sensitivities(model, v)
    slopes = np.stack([slope_of(name, derivatives.parameters, derivatives.of) for name in names], -1)  # (m, n, p)
    distance = np.abs(derivatives.eigenvalues[:, None, :] - rows[:, :, None])
    at = np.where(np.isnan(distance), np.inf, distance).argmin(-1)
    root: Any = np.take_along_axis(derivatives.eigenvalues, at, 1)
    root = np.where(np.isnan(rows) | (root.imag == 0), np.nan, root)
    change = np.take_along_axis(slopes, at[..., None], 1)
    frequency = frequency_hz(np.where(np.isnan(root)[..., None], np.nan * 1j, change))
    damping = damping_ratio_gradient(root[..., None], change)
    shape = (*target.shape, len(names))
    return frequency.reshape(shape), damping.reshape(shape)


def mode_sd(
    model: Model, speed: ArrayLike, eigenvalue: ArrayLike, names: Sequence[str], covariance: ArrayLike
) -> tuple[Array, Array]:
    """Sd of frequency (Hz) and damping ratio of oscillations at one speed or along speeds."""
    spread = checked_covariance(names, covariance)
    frequency, damping = mode_gradients(model, speed, eigenvalue, names)
    return standard_deviation(frequency, spread), standard_deviation(damping, spread)


def critical_speed_gradients(model: Model, critical: Sequence[CriticalSpeed], names: Sequence[str]) -> Array:
    """Derivatives (k, p) of k critical speeds of the model, m/s per SI unit of the parameters ``names``."""
    if not critical:
        return np.empty((0, len(names)))
    slopes = critical_speed_sensitivities(model, critical)
    return np.stack([slope_of(name, slopes, slopes.__getitem__) for name in names], -1)


def slope_of(name: str, known_names: Collection[str], slope: Callable[[str], Any]) -> Any:
    """Derivative with respect to a parameter, or the sum over both wheels where the name stands for both."""
    entries = entries_of(name, known_names)
    if not entries:
        raise InputError(unknown("parameter", name, known_names))
    return slope(entries[0]) if len(entries) == 1 else sum(slope(key) for key in entries)


def model_covariance(
    model: Model, given: Mapping[str, float] | None = None, *, assume: bool = False
) -> tuple[tuple[str, ...], Array]:
    """Parameters that are uncertain and their covariance: what was measured together is correlated."""
    deviations = standard_deviations(model, given, assume=assume)
    entering = model.evaluator.symbolic.parameters
    names = tuple(key for key, d in deviations.items() if d.sd > 0 and ("." in key or key in entering))
    covariance = np.diag([deviations[key].sd ** 2 for key in names])
    tied = np.array([key in model.covariance.names and deviations[key].origin != GIVEN for key in names], dtype=bool)
    shared = np.outer(tied, tied)
    covariance[shared] = model.covariance.among(names)[shared]
    return names, covariance


def critical_speed_estimates(
    model: Model, critical: Sequence[CriticalSpeed], given: Mapping[str, float] | None = None, *, assume: bool = False
) -> tuple[Estimate, ...]:
    """Critical speeds with the standard deviation that the model's own data leave, to first order."""
    names, covariance = model_covariance(model, given, assume=assume)
    gradients = critical_speed_gradients(model, critical, names)
    return tuple(
        Estimate(
            c.speed, float(standard_deviation(g, covariance)), model.covariance.degrees_of_freedom(names, g, covariance)
        )
        for c, g in zip(critical, gradients, strict=True)
    )


WIDTH = 1.96  # sd, for 95 %


@dataclass(frozen=True)
class CriticalInterval:
    """Speeds at which a mode may change its stability."""

    mode: str  # name as in :func:`bicycle.stability.named_modes.modes`
    kind: str  # ``oscillatory`` (a pair) or ``real``
    low: float  # m/s; minus or plus infinity if the band holds zero at the last speed on that side with such a root
    high: float  # m/s

    @property
    def told(self) -> bool:
        """True if there is a limit on either side."""
        return bool(np.isfinite(self.low) or np.isfinite(self.high))

    def holds(self, speed: float) -> bool:
        """True if a ``speed`` (m/s) lies within."""
        return self.low <= speed <= self.high


def critical_intervals(
    model: Model,
    speeds: ArrayLike,
    given: Mapping[str, float] | None = None,
    *,
    assume: bool = False,
    width: float = WIDTH,
) -> tuple[CriticalInterval, ...]:
    """Find the speeds at which the real part of a mode is zero within its uncertainty, by mode, from slow to fast."""
    v = np.asarray(speeds, float)
    if v.ndim != 1 or len(v) < 2 or not (np.diff(v) > 0).all():
        raise InputError("give two or more speeds, each above the last")
    names, covariance = model_covariance(model, given, assume=assume)
    if not names:
        return ()
    crossing_speeds = [c.speed for c in critical_speeds(model, float(v[-1])) if c.speed > v[0]]
    v = np.union1d(v, crossing_speeds)  # so each lies within an interval, however narrow that is
    derivatives = sensitivities(model, v)
    slopes = np.stack([slope_of(name, derivatives.parameters, derivatives.of).real for name in names], -1)
    spread = standard_deviation(slopes, covariance)
    intervals = []
    for mode, branch in modes(model, v).branches.items():
        for root in branch.T:
            sd = np.take_along_axis(spread, _find_nearest(derivatives.eigenvalues, root)[:, None], 1)[:, 0]
            real = (root.imag == 0) & ~np.isnan(root.real)  # a mode may be absent at some speeds
            for kind, of_kind in ((OSCILLATORY, root.imag > 0), (REAL, real)):
                for part in _runs(of_kind):
                    crosses = kind == OSCILLATORY or np.ptp(np.sign(root.real[part])) > 0
                    if crosses:
                        band = root.real[part] - width * sd[part], root.real[part] + width * sd[part]
                        intervals += [CriticalInterval(mode, kind, *ends) for ends in zero_within(v[part], *band)]
    return tuple(intervals)


def zero_within(at: Array, lower: Array, upper: Array) -> list[tuple[float, float]]:
    """Intervals in which zero lies between two lines (m,), straight between rising places; infinite at either end."""
    places = np.unique(np.concatenate([at, _zeros(at, lower), _zeros(at, upper)]))
    middle = (places[:-1] + places[1:]) / 2
    in_band = (np.interp(middle, at, lower) <= 0) & (np.interp(middle, at, upper) >= 0)
    ends = np.concatenate([[-np.inf], places[1:-1], [np.inf]])
    return [(float(ends[part.start]), float(ends[part.stop])) for part in _runs(in_band)]


def _zeros(at: Array, line: Array) -> Array:
    k = np.flatnonzero(np.sign(line[:-1]) * np.sign(line[1:]) < 0)
    return np.asarray(at[k] + (at[k + 1] - at[k]) * line[k] / (line[k] - line[k + 1]))


def _find_nearest(eigenvalues: Complex, root: Complex) -> NDArray[np.intp]:
    """Which of the ``eigenvalues`` (m, n) each ``root`` (m,) is; the first where there is none."""
    return np.asarray(np.abs(eigenvalues - np.where(np.isnan(root), np.inf, root)[:, None]).argmin(1))


def _runs(mask: NDArray[np.bool_]) -> Iterator[slice]:
    """Stretches of places at which a ``mask`` (m,) is true."""
    change = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    for first, last in zip(change[::2].tolist(), change[1::2].tolist(), strict=True):
        yield slice(first, last)
