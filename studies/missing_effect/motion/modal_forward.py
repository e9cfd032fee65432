"""Predicted eigenvalues and shape ratios of the measured modes, with derivatives.

d(lambda) = u (dF - lambda dE) x with left and right eigenvectors, u E x = 1, and dx from the other modes; what the
coordinates change of the matrices is of :mod:`studies.missing_effect.motion.slopes`.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.decomposition import eigensystem
from bicycle.identification.repeats import about_one_speed
from studies.inference.folds import folds
from studies.inference.forward import ProposedMeasurement, Rows, Series
from studies.inference.parameter import Candidate
from studies.missing_effect.motion.bicycle_forward import SPEED_AXIS, BicycleForward
from studies.missing_effect.motion.family import Family
from studies.missing_effect.motion.modal_table import ModalPoint
from studies.missing_effect.motion.ratio_sensors import LEAN, apply_sensor, errors_of
from studies.missing_effect.motion.row_settings import Settings
from studies.missing_effect.motion.slopes import Slopes
from studies.missing_effect.motion.wanted_modes import Wanted, root_of
from tyre.base.arrays import Array, Complex

RATIO_OUTPUT = {"steer_over_lean": "steer_rate", "yaw_over_lean": "yaw_rate"}
FURTHER_SPEEDS = (0.8, 1.25, 1.5, 2.0)  # of the slowest or fastest measured speed
FURTHER_RATIO_SD = 0.05
FURTHER_RUNS = 6  # at a further speed
MOST_DAMPED = 0.7  # damping ratio of a mode that a free decay shows
PARTS = {"real": ("real part", "1/s"), "imaginary": ("imaginary part", "rad/s")}  # of an eigenvalue, with its unit


@dataclass(frozen=True, eq=False)
class MissingRatio(ProposedMeasurement):
    """A shape ratio at the measured speeds; ``number``: its place after the eigenvalue."""

    number: int


@dataclass(frozen=True, eq=False)
class ModeAtSpeed(ProposedMeasurement):
    """A mode at another speed (m/s), with settings that were measured; ``ratios``: those of steer and yaw too."""

    mode: str
    speed: float
    settings: Settings = ()
    ratios: tuple[bool, bool] = (False, False)


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # two roots that meet, a mode without lean: not finite
def predict(family: Family, wanted: Wanted, theta: Array, *, slopes: bool = True) -> tuple[Complex, Complex]:
    """Eigenvalue and both ratios of each wanted mode, (m, 3), and their derivatives (m, 3, p), or (m, 3, 0).

    Parameters
    ----------
    family : Family
        The model with its p unknowns.
    wanted : Wanted
        m modes.
    theta : ndarray, shape (p,)
        Coordinates.
    slopes : bool
        Whether derivatives are wanted.
    """
    speeds = np.unique(wanted.speed)
    bicycle = Slopes(family, theta, speeds, slopes)
    system, names = bicycle.system, family.symbolic.outputs
    values, right, left = eigensystem(system.dynamics[0], mass=system.mass[0])
    chosen, at = root_of(wanted, speeds, values), np.searchsorted(speeds, wanted.speed)
    rows = [names.index(name) for name in ("lean_rate", *RATIO_OUTPUT.values())]
    root, x = values[at, chosen], right[at, :, chosen]
    c = system.output[0, at][:, rows]
    seen = np.einsum("mri,mi->mr", c, x)
    ratio = seen[:, 1:] / seen[:, :1]
    number = np.concatenate([root[:, None], ratio], axis=1)
    slope = np.zeros((*number.shape, len(bicycle.steps)), complex)
    if slope.size:
        force = bicycle.force(at, x[..., None], root)[..., 0].swapaxes(1, 2)
        turned = left[at] @ force  # u_i (dF - lambda dE) x / (u_i E x_i)
        gap = root[:, None] - values[at]
        point = np.arange(len(at))
        gap[point, chosen] = np.inf
        dx = right[at] @ (turned / gap[:, :, None])
        dseen = c @ dx + bicycle.applied("output", at, x[..., None], rows)[..., 0].swapaxes(1, 2)
        slope[:, 0] = turned[point, chosen]
        slope[:, 1:] = (dseen[:, 1:] - ratio[:, :, None] * dseen[:, :1]) / seen[:, :1, None]
    errors = _coordinates(family, theta)
    for r, name in enumerate(RATIO_OUTPUT, 1):
        apply_sensor(number, slope, r, errors_of(errors, name))
        apply_sensor(number, slope, r, errors_of(errors, LEAN), power=-1)
    return number, slope


def _coordinates(family: Family, theta: Array) -> dict[str, tuple[int, float]]:
    """Column and value of the coordinate that sets a parameter."""
    return {key: (column, float(theta[column])) for column, u in enumerate(family.unknowns) for key in u.sets}


@dataclass(frozen=True, kw_only=True)
class ModalForward(BicycleForward):
    """The forward model of modal data (see :class:`studies.inference.forward.Forward`): ``points`` as measured."""

    thorough = True
    points: tuple[ModalPoint, ...]

    @cached_property
    def wanted(self) -> tuple[tuple[Settings, NDArray[np.intp], Wanted], ...]:
        """The measured modes, those of one setting together: settings, indices of the points, what is wanted there."""
        found = []
        for settings in dict.fromkeys(p.settings for p in self.points):
            here = [i for i, p in enumerate(self.points) if p.settings == settings]
            points = [self.points[i] for i in here]
            wanted = Wanted(
                np.array([p.speed for p in points]), tuple(p.mode for p in points),
                np.array([p.eigenvalue for p in points]),
            )  # fmt: skip
            found.append((settings, np.array(here), wanted))
        return tuple(found)

    def _at(self, settings: Settings, candidates: tuple[Candidate, ...]) -> Family:
        """Made once for the many points at which a fit looks at the same ``candidates``."""
        key = (settings, tuple(map(id, candidates)))
        if key not in self._families:
            if len(self._families) > len(self.wanted):
                self._families.clear()
            self._families[key] = candidates, replace(self.family(candidates), settings=settings)
        return self._families[key][1]

    @cached_property
    def _families(self) -> dict[Any, tuple[tuple[Candidate, ...], Family]]:
        """By settings and identity of the candidates, which are kept so that no other can take it."""
        return {}

    def _measured_modes(
        self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True
    ) -> tuple[Complex, Complex]:
        """:func:`predict` of all points, in their order."""
        parts = [predict(self._at(settings, candidates), wanted, theta, slopes=slopes)
                 for settings, _, wanted in self.wanted]  # fmt: skip
        order = np.argsort(np.concatenate([here for _, here, _ in self.wanted]))
        number, slope = (np.concatenate(part)[order] for part in zip(*parts, strict=True))
        return number, slope

    @property
    def varied(self) -> bool:
        """Whether the points are of two speeds."""
        return len(about_one_speed([p.speed for p in self.points])) > 1

    @cached_property
    def measured(self) -> tuple[Array, Array]:
        """Measured values and their sd, (n,)."""
        numbers: list[float] = []
        sd: list[float] = []
        for p in self.points:
            numbers += [p.eigenvalue.real, p.eigenvalue.imag]
            sd += p.sd
            for value, s in (p.ratios[name] for name in RATIO_OUTPUT if name in p.ratios):
                numbers += [value.real, value.imag]
                sd += [s, s]
        return np.array(numbers), np.array(sd)

    @cached_property
    def rows(self) -> Rows:
        """Labels of the residuals."""
        where, series, speed, group, repeat = [], [], [], [], []
        shown: dict[str, Series] = {}
        for k, p in enumerate(self.points):
            for name in ("", *(name for name in RATIO_OUTPUT if name in p.ratios)):
                what = f"{p.called} {name.replace('_', ' ')}".strip()
                for part, (quantity, unit) in PARTS.items():
                    shown[f"{what}, {part}"] = Series(what, quantity if name else f"{quantity}, {unit}")
                    where.append(f"{what}, {p.speed:g} m/s, {part}")
                    series.append(f"{what}, {part}")
                    speed.append(p.speed)
                    group.append(p.group or f"{p.speed:.6g}")
                    repeat.append(f"{k:06d}")
        fold = folds(group, speed, repeat)
        return Rows(tuple(where), np.array(speed), tuple(series), fold, shown=shown, axis=SPEED_AXIS)

    @cached_property
    def _kept(self) -> NDArray[np.bool_]:
        """Which of eigenvalue and ratios (m, 3) are measured."""
        return np.array([[True, *(name in p.ratios for name in RATIO_OUTPUT)] for p in self.points])

    def residual(self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """(measured - computed) / sd (n,) and its derivative (n, p). Arguments as :meth:`.Forward.residual`."""
        measured, sd = self.measured
        computed, slope = _flat(*self._measured_modes(candidates, theta, slopes=slopes), self._kept)
        return (measured - computed) / sd, -slope / sd[:, None]

    def proposed(self) -> tuple[ProposedMeasurement, ...]:
        """Further modal measurements: missing ratios, other speeds, a forced response."""
        sd = float(np.median([s for p in self.points for s in p.sd]))
        speeds = [p.speed for p in self.points]
        have = {name for p in self.points for name in p.ratios}
        proposals: list[ProposedMeasurement] = []
        for number, ratio in enumerate(RATIO_OUTPUT, 1):
            if ratio not in have:
                what = f"{ratio.replace('_', ' ')} ratio at the measured speeds"
                proposals.append(MissingRatio(what, np.full(2 * len(self.points), FURTHER_RATIO_SD), number))
        for factor in FURTHER_SPEEDS:
            speed = factor * (max(speeds) if factor > 1 else min(speeds))
            last = self.points[-1]
            what = f"{last.called} at {speed:.3g} m/s, {FURTHER_RUNS} runs"
            further_sd = np.full(2, sd / np.sqrt(FURTHER_RUNS))
            proposals.append(ModeAtSpeed(what, further_sd, last.mode, speed, last.settings))
        return (*proposals, *self.forced(max(speeds)))

    def predict(
        self, proposal: ProposedMeasurement, candidates: tuple[Candidate, ...], theta: Array
    ) -> tuple[Array, Array]:
        """Whitened prediction of a further measurement at ``theta`` (p,), NaN where it cannot be made.

        Arguments as :meth:`studies.inference.forward.Forward.predict`.
        """
        if isinstance(proposal, MissingRatio):
            kept = np.zeros((len(self.points), 3), bool)
            kept[:, proposal.number] = True
            number, slopes = self._measured_modes(candidates, theta)
        elif isinstance(proposal, ModeAtSpeed):
            kept, family = np.array([[True, *proposal.ratios]]), self._at(proposal.settings, candidates)
            near = self._followed(family, theta, proposal)
            number, slopes = predict(family, Wanted(np.array([proposal.speed]), (proposal.mode,), near), theta)
        else:
            return super().predict(proposal, candidates, theta)
        if (np.abs(number[:, 0].real) > MOST_DAMPED * np.abs(number[:, 0])).any():
            number[:] = np.nan  # too damped to be seen in a free decay
        computed, slope = _flat(number, slopes, kept)
        return computed / proposal.sd, slope / proposal.sd[:, None]

    def _followed(self, family: Family, theta: Array, there: ModeAtSpeed) -> Complex:
        """Where a mode goes from its nearest measured speed, in small steps."""
        measured = (p for p in self.points if (p.mode, p.settings) == (there.mode, there.settings))
        nearest = min(measured, key=lambda p: abs(p.speed - there.speed))
        near = nearest.eigenvalue
        for v in np.linspace(nearest.speed, there.speed, 12):
            system = family(theta[None], np.array([v]))
            values = eigensystem(system.dynamics[0], mass=system.mass[0]).values[0]
            cost = np.where(values.imag >= 0, np.abs(values - near), np.inf)
            near = values[int(cost.argmin())]
        return np.array([near])


def _flat(number: Complex, slope: Complex, kept: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Real and imaginary parts, one after the other, of the kept numbers."""
    y, dy = number[kept], slope[kept]
    return np.stack([y.real, y.imag], 1).ravel(), np.stack([dy.real, dy.imag], 1).reshape(2 * len(dy), dy.shape[1])
