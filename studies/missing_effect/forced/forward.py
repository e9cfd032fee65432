"""Predicted frequency responses H = C (i omega E - F)^-1 B of the linear model at the measured speeds, with slopes.

dH = dC X + L (dB - (i omega dE - dF) X) with X = (i omega E - F)^-1 B and L = C (i omega E - F)^-1; the derivatives of
the matrices are those of :mod:`studies.missing_effect.motion.slopes`. The
response is that of the bicycle alone, also at speeds at which it is unstable and something held it (Ljung 1999, System
Identification, ch. 13: the direct approach).

A lateral accelerometer at (x, z) of the rear frame reads dV/dt + v r + x dr/dt - z d2(lean)/dt2 - g lean, V being the
lateral velocity of the rear contact and r the yaw rate.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bicycle.identification.repeats import about_one_speed
from studies.inference.folds import MOST_FOLDS, folds
from studies.inference.forward import ProposedMeasurement, Rows, Series
from studies.inference.parameter import Candidate
from studies.missing_effect.forced.sensors import sense
from studies.missing_effect.forced.table import Accelerometer, ResponsePoint, spoken, unit_of
from studies.missing_effect.motion.bicycle_forward import (
    FORCED_HZ,
    FORCED_OUTPUTS,
    FORCED_SD,
    BicycleForward,
)
from studies.missing_effect.motion.family import Family
from studies.missing_effect.motion.slopes import Slopes
from tyre.base.arrays import Array, Complex

PARTS = ("real", "imaginary")
ACCELERATION = "lateral_acceleration"
FURTHER_INPUTS = ("steer_torque", "lateral_force")
MOST_FURTHER_SPEEDS = 3


@dataclass(frozen=True, eq=False)
class Wanted:
    """n responses: frequencies (Hz) and speeds (m/s), arrays (n,), with the names of inputs and outputs."""

    frequency: Array
    speed: Array
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    @cached_property
    def s(self) -> Complex:
        """i omega (n,), rad/s."""
        return np.asarray(2j * np.pi * self.frequency)


@dataclass(frozen=True, eq=False)
class FurtherResponses(ProposedMeasurement):
    """Responses of further outputs, or to another input."""

    wanted: Wanted


def responses(
    family: Family, wanted: Wanted, theta: Array, accelerometer: Accelerometer | None = None, *, slopes: bool = True
) -> tuple[Complex, Complex]:
    """Gains (n,), SI, and their derivatives (n, p), or (n, 0).

    Parameters
    ----------
    family : Family
        The model with its p unknowns.
    wanted : Wanted
    theta : ndarray, shape (p,)
        Coordinates.
    accelerometer : Accelerometer, optional
    slopes : bool
        Whether derivatives are wanted.
    """
    speeds = np.unique(wanted.speed)
    bicycle = Slopes(family, theta, speeds, slopes)
    system, names = bicycle.system, family.symbolic
    places, at = np.unique(np.stack([wanted.speed, wanted.frequency]), axis=1, return_inverse=True)
    at, of_speed, s = at.ravel(), np.searchsorted(speeds, places[0]), 2j * np.pi * places[1]
    inputs, outputs = list(dict.fromkeys(wanted.inputs)), list(dict.fromkeys(wanted.outputs))
    pushed = np.zeros((len(s), len(names.inputs), len(inputs)))
    pushed[:, [names.inputs.index(name) for name in inputs], range(len(inputs))] = 1.0
    shown = _Shown.of(bicycle, outputs, of_speed, s, accelerometer)
    seen, rows = shown.weights, system.output[0, of_speed][:, shown.rows]
    pencil = s[:, None, None] * system.mass[0, of_speed] - system.dynamics[0, of_speed]
    states = np.linalg.solve(pencil, system.input[0, of_speed] @ pushed + 0j)
    pick = ([outputs.index(name) for name in wanted.outputs], [inputs.index(name) for name in wanted.inputs])
    gains = (seen @ (rows @ states))[at, *pick]
    slope = np.zeros((len(gains), len(bicycle.steps)), complex)
    if slope.size:
        back = np.linalg.solve(pencil.swapaxes(1, 2), (seen @ rows).swapaxes(1, 2)).swapaxes(1, 2)
        force = bicycle.applied("input", of_speed, pushed) + bicycle.force(of_speed, states, s)
        changed = seen[:, None] @ bicycle.applied("output", of_speed, states, shown.rows)
        changed += shown.slopes @ (rows @ states)[:, None] + back[:, None] @ force
        slope = changed[at, :, *pick]
    return gains, slope


@dataclass(frozen=True)
class _Shown:
    """Measured signals as sums of outputs of the model: ``weights`` (m, signals, rows) of its ``rows``.

    ``slopes`` (m, p, signals, rows) are what the coordinates change of the weights.
    """

    rows: list[int]
    weights: Complex
    slopes: Array

    @classmethod
    def of(
        cls, bicycle: Slopes, signals: list[str], at: NDArray[np.intp], s: Complex, place: Accelerometer | None
    ) -> "_Shown":
        """At speeds ``at`` and i omega ``s`` (m,); an accelerometer reads at its ``place``."""
        parts = ("rear_lateral_velocity", "yaw_rate", "lean_rate", "lean")
        used = list(dict.fromkeys([name for name in signals if name != ACCELERATION] + list(parts)))
        weights = np.zeros((len(s), len(signals), len(used)), complex)
        slopes = np.zeros((len(s), len(bicycle.steps), len(signals), len(used)))
        for k, name in enumerate(signals):
            if name != ACCELERATION:
                weights[:, k, used.index(name)] = 1.0
                continue
            assert place is not None
            lateral, yaw, rolling, lean = (used.index(part) for part in parts)
            v, g = bicycle.true_speeds, bicycle.values["g"]
            weights[:, k, lateral], weights[:, k, rolling] = s, -place.z * s
            weights[:, k, yaw], weights[:, k, lean] = place.x * s + v[0, at], -g[0]
            slopes[:, :, k, yaw], slopes[:, :, k, lean] = bicycle.difference(v).T[at], -bicycle.difference(g)[:, 0]
        outputs = bicycle.family.symbolic.outputs
        return cls([outputs.index(name) for name in used], weights, slopes)


@dataclass(frozen=True, kw_only=True)
class FrequencyForward(BicycleForward):
    """The forward model of frequency responses (see :class:`studies.inference.forward.Forward`): ``points``."""

    thorough = True
    points: tuple[ResponsePoint, ...]
    accelerometer: Accelerometer | None = None

    @cached_property
    def wanted(self) -> Wanted:
        """What was measured."""
        return Wanted(
            np.array([p.frequency for p in self.points]), np.array([p.speed for p in self.points]),
            tuple(p.input for p in self.points), tuple(p.output for p in self.points),
        )  # fmt: skip

    @property
    def varied(self) -> bool:
        """Whether the points are of two speeds, or two inputs."""
        return len(about_one_speed(self.wanted.speed.tolist())) > 1 or len(set(self.wanted.inputs)) > 1

    @cached_property
    def measured(self) -> tuple[Array, Array]:
        """Measured real and imaginary parts and their sd, (2 n,)."""
        value = np.array([p.value for p in self.points])
        return np.stack([value.real, value.imag], 1).ravel(), np.repeat([p.sd for p in self.points], 2)

    @cached_property
    def rows(self) -> Rows:
        """Labels of the residuals: a series is a part of one response at one speed, along frequency."""
        where, series, shown = [], [], {}
        for p in self.points:
            channel = f"{spoken(p.input)} to {spoken(p.output)}"
            for part in PARTS:
                name = f"{channel}, {p.speed:g} m/s, {part[:4]}"
                shown[name] = Series(channel, f"{part} part, {unit_of(p)}", f"frequency at {p.speed:g} m/s, Hz")
                where.append(f"{channel}, {p.speed:g} m/s, {p.frequency:.3g} Hz, {part} part")
                series.append(name)
        group = [p.group or f"{p.speed:.6g}" for p in self.points]
        if len(set(group)) == 1 and len(set(self.wanted.inputs)) > 1:
            group = list(self.wanted.inputs)
        fold = folds(group, self.wanted.speed, self._bands)
        return Rows(
            tuple(where), np.repeat(self.wanted.frequency, 2), tuple(series), np.repeat(fold, 2), shown=shown,
            axis="frequency, Hz",
        )  # fmt: skip

    @property
    def _bands(self) -> list[str]:
        """Of each point: bands of frequency are held out where there is one speed and one input."""
        edges = np.quantile(self.wanted.frequency, np.arange(1, MOST_FOLDS) / MOST_FOLDS)
        return [f"{band:02d}" for band in np.searchsorted(edges, self.wanted.frequency)]

    def residual(self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """(measured - computed) / sd (2 n,) and its derivative (2 n, p). Arguments as :meth:`.Forward.residual`."""
        computed, slope = self._parts(self.wanted, candidates, theta, slopes=slopes)
        measured, sd = self.measured
        return (measured - computed) / sd, -slope / sd[:, None]

    def _parts(
        self, wanted: Wanted, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True
    ) -> tuple[Array, Array]:
        """Real and imaginary parts, one after the other, as the sensors show them, and their derivatives."""
        family = self.family(candidates)
        gains, slope = responses(family, wanted, theta, self.accelerometer, slopes=slopes)
        errors = {key: (column, float(theta[column])) for column, u in enumerate(family.unknowns) for key in u.sets}
        for names in (wanted.inputs, wanted.outputs):
            for name in dict.fromkeys(names):
                sense(gains, slope, wanted.s, np.array(names) == name, name, errors)
        parts = np.stack([gains.real, gains.imag], 1).ravel()
        return parts, np.stack([slope.real, slope.imag], 1).reshape(len(parts), slope.shape[1])

    def proposed(self) -> tuple[ProposedMeasurement, ...]:
        """Outputs that were not measured, another input, and higher speeds."""
        speeds = np.unique(self.wanted.speed)
        few = speeds[np.unique(np.linspace(0, len(speeds) - 1, MOST_FURTHER_SPEEDS).astype(int))]
        source, found = self.points[0].input, []
        for output in FORCED_OUTPUTS:
            if output not in self.wanted.outputs:
                what = f"the response of the {spoken(output)} to the {spoken(source)} at the measured speeds"
                found.append(self._further(what, few, source, (output,)))
        for other in FURTHER_INPUTS:
            if other not in self.wanted.inputs:
                seen = tuple(dict.fromkeys(self.wanted.outputs))
                found.append(
                    self._further(f"the response to a {spoken(other)} at the measured speeds", few, other, seen)
                )
        return (*found, *self.forced(float(speeds[-1])))

    def _further(self, what: str, speeds: Array, source: str, outputs: tuple[str, ...]) -> FurtherResponses:
        every = [(f, v, output) for output in outputs for v in speeds for f in FORCED_HZ]
        wanted = Wanted(
            np.array([f for f, _, _ in every]), np.array([v for _, v, _ in every]), (source,) * len(every),
            tuple(output for _, _, output in every),
        )  # fmt: skip
        nominal = np.array([u.centre for u in self.nuisances])
        size = np.abs(responses(self.family(()), wanted, nominal, self.accelerometer, slopes=False)[0])
        peak = np.array([size[[o == output for o in wanted.outputs]].max() for output in wanted.outputs])
        return FurtherResponses(what, np.repeat(FORCED_SD * (size + 0.1 * peak), 2), wanted)

    def predict(
        self, proposal: ProposedMeasurement, candidates: tuple[Candidate, ...], theta: Array
    ) -> tuple[Array, Array]:
        """Whitened prediction of a further measurement at ``theta`` (p,).

        Arguments as :meth:`studies.inference.forward.Forward.predict`.
        """
        if not isinstance(proposal, FurtherResponses):
            return super().predict(proposal, candidates, theta)
        computed, slope = self._parts(proposal.wanted, candidates, theta)
        return computed / proposal.sd, slope / proposal.sd[:, None]
