"""The engine on raw recordings of a tyre rig: side force of slip sweeps in time, and of static pulls.

Base model: the reference's Magic Formula without lag or offset, F = D sin(C atan(B x - E (B x - atan(B x)))), and a
straight pull F = K x on a rigid rim. Candidates are the rig effects of `rig_candidates`; with sweep_lag the force
follows slip over the relaxation length, (length / v) dF/dt + F = F_steady (Dell'Orto et al., eq. 1).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from studies.inference.forward import Extra, Residual, Rows
from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.rig.candidates import phenomenological
from studies.missing_effect.rig.data import Pull, Sweep, condition_label
from studies.missing_effect.rig.further import GAUGE, Further, further_sweeps
from studies.missing_effect.rig.measurement import RigMeasurement
from studies.missing_effect.rig.reference import PEAK, Curve
from tyre.base.arrays import Array
from tyre.drum import log_curvature
from tyre.recordings.recording import Condition

Values = Mapping[str, Array]
LOAD_EXPONENT = 0.7  # d(ln C)/d(ln load) where the reference has one load only
FOLDS, SEGMENTS = 3, 6  # of a recording held out in turn, where there are fewer than three recordings


@dataclass(frozen=True, eq=False)
class RigRecordingsForward:
    """Forward model of rig recordings (see :class:`studies.inference.forward.Forward`)."""

    measurement: RigMeasurement
    sweeps: tuple[Sweep, ...]
    pulls: tuple[Pull, ...]
    nuisances: tuple[UncertainParameter, ...]
    candidates: tuple[Candidate, ...]
    refused: dict[str, str]
    notes: tuple[str, ...]
    curves: dict[str, Curve] = field(default_factory=dict)
    thorough = False

    # ------------------------------------------------------------------ the model

    def terms(self, sweep: Sweep, values: Values, *, turned: bool = False) -> Array:
        """Values of ``SWEEP_TERMS`` for a sweep, (K, 12); ``turned``: the tyre is mounted the other way round."""
        condition, curve = sweep.condition, self.curve(sweep.condition)
        assert curve.cornering_stiffness is not None
        n = max((len(v) for v in values.values()), default=1)
        zero = np.zeros(n)

        def v(key: str) -> Array:
            return values.get(key, zero)

        ratio, radius = condition.load / curve.load, self.measurement.wheel_radius
        here, there = (log_curvature(wheel_radius=radius, drum_radius=x.drum_radius) for x in (condition, curve))
        off = here - there
        factor = np.exp(v("load_dependence") * np.log(ratio) - v("drum_curvature") * off)
        loaded = 1 + v("load gain") + v("load_scale")
        exponent = self.measurement.reference.load_exponent(condition.pressure)
        true = factor * np.exp(v(f"cornering stiffness, {sweep.label}") + v(f"repeatability, {sweep.name}"))
        true *= curve.cornering_stiffness[0] * loaded ** (LOAD_EXPONENT if exponent is None else exponent)
        peak = (curve.peak or PEAK * curve.load) * ratio * np.exp(v(f"peak, {sweep.label}")) * loaded
        force, slip = 1 + v("force gain") + v("force_scale"), 1 + v("slip gain") + v("slip_scale")
        lag = zero
        if "sweep_lag" in values and sweep.speed:
            length = values["sweep_lag"] * factor
            if curve.length is not None and self._length is not None:
                length = length * curve.length[0] / self._length[0]
            lag = (length + true * v("rim_compliance")) / sweep.speed
        side = -1.0 if turned else 1.0
        return np.stack(
            [
                true * force / slip, peak * force, curve.shape + v("shape"), curve.curvature + v("curvature"),
                v("ply_steer") * slip + v("slip zero"), lag, v("steering_play") * slip,
                side * v("conicity") * force + v(f"zero, {sweep.name}"),
                v(f"drift, {sweep.name}"), v("channel_delay"), v("temperature_drift"),
                v("side force from slip squared"),
            ], axis=1,
        )  # fmt: skip

    def pulled(self, pull: Pull, values: Values) -> Array:
        """Force of a pull (K, n), N: F = K x (1 - bend |x|/x_max) in series with the rim, and friction."""
        curve = self.curve(pull.condition)
        assert curve.lateral_stiffness is not None
        n = max((len(v) for v in values.values()), default=1)

        def v(key: str) -> Array:
            return values.get(key, np.zeros(n))[:, None]

        tyre = curve.lateral_stiffness[0] * np.exp(
            v(f"lateral stiffness, {pull.label}") + v(f"repeatability, {pull.name}")
        )
        x = pull.displacement / (1 + v("displacement gain") + v("displacement_scale"))
        share = v(f"bend, {pull.name}") + v("pull force bends")
        straight = tyre / (1 + tyre * v("rim_compliance")) * x
        force = straight * (1 - share * np.abs(pull.displacement) / np.abs(pull.displacement).max())
        if "rig_friction" in values:
            force = force + v("rig_friction") * pull.friction(values["presliding"])
        gain = 1 + v("force gain") + v("force_scale")
        return np.asarray(gain * force + v(f"zero, {pull.name}") + v(f"drift, {pull.name}") * pull.clock)

    def curve(self, condition: Condition) -> Curve:
        """The reference for a condition."""
        label = condition_label(condition)
        if label not in self.curves:
            self.curves[label] = self.measurement.reference.at(condition.load, condition.pressure)
        return self.curves[label]

    @cached_property
    def _length(self) -> tuple[float, float] | None:
        return self.curve(self.sweeps[0].condition).length if self.sweeps else None

    # ------------------------------------------------------------------ the protocol

    @cached_property
    def rows(self) -> Rows:
        """One series a recording; innovations in the order of time."""
        where, x, series, fold = [], [], [], []
        split = len(self.sweeps) + len(self.pulls) < FOLDS
        for k, s in enumerate(self.sweeps):
            degrees = np.rad2deg(s.slip)
            for slip, direction in zip(degrees, s.direction, strict=True):
                low = int(np.floor(slip))
                sense = "up" if direction > 0 else "down"
                where.append(f"slip sweep, {s.name}, {sense}, {low} to {low + 1} deg")
            x += degrees.tolist()
            series += [s.name] * len(degrees)
            fold += _segments(s.part) if split else [k] * len(degrees)
        for k, p in enumerate(self.pulls, len(self.sweeps)):
            n = len(p.force)
            where += [f"pull test, {p.name}, {'rising' if d >= 0 else 'falling'} displacement" for d in _way(p)]
            x += (1e3 * p.displacement).tolist()
            series += [p.name] * n
            fold += _segments(np.zeros(n, int)) if split else [k] * n
        axes = {s.name: "slip angle, deg" for s in self.sweeps} | {p.name: "displacement, mm" for p in self.pulls}
        return Rows(tuple(where), np.array(x), tuple(series), np.array(fold) % 6, axes=axes)

    def residual(self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """Innovations (measured - computed) / sd (n,) and their derivatives (n, p)."""
        batch, steps = self._stencil(candidates, theta, slopes)
        residual, jacobian = [], []
        for s in self.sweeps:
            force, slope = self._swept(s, batch, steps)
            both = s.whiten(np.column_stack([s.force - force, -slope]))
            residual.append(both[:, 0])
            jacobian.append(both[:, 1:])
        for p in self.pulls:
            every = self.pulled(p, batch)
            residual.append((p.force - every[0]) / p.sd)
            jacobian.append(-_centred(every, steps) / p.sd)
        return np.concatenate(residual), np.concatenate(jacobian)

    def _stencil(self, candidates: tuple[Candidate, ...], theta: Array, slopes: bool) -> tuple[dict[str, Array], Array]:
        unknowns = (*self.nuisances, *(u for c in candidates for u in c.unknowns))
        steps = np.array([u.scale * 1e-3 for u in unknowns]) if slopes else np.empty(0)
        shift = np.diag(steps) if slopes else np.empty((0, len(theta)))
        batch = np.vstack([theta[None], theta + shift, theta - shift])
        values: dict[str, Array] = {}
        for column, u in enumerate(unknowns):
            values |= {key: factor * u.value(batch[:, column]) for key, factor in u.sets.items()}
        return values, steps

    def _swept(self, s: Sweep, values: Values, steps: Array, *, turned: bool = False) -> tuple[Array, Array]:
        """Force (n,) and derivatives with respect to the coordinates (n, p), through the terms of the curve."""
        terms = self.terms(s, values, turned=turned)
        force, by_term = s.computed(terms[0], slopes=bool(len(steps)))
        if not len(steps):
            return force, np.empty((len(force), 0))
        return force, by_term @ _centred(terms, steps)

    def log_determinant(self, candidates: tuple[Candidate, ...], theta: Array) -> float:
        """Zero: nothing is marginalised."""
        return 0.0

    def compatible(self, candidates: tuple[Candidate, ...]) -> bool:
        """Any rig effects go together."""
        return True

    def further(self, candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
        """None."""
        return ()

    def compared(self, residual: Array) -> tuple[Array, Array | None]:
        """Innovations have no place on a curve; see `rig_figures`."""
        return residual, None

    def phenomenological(self) -> tuple[Candidate, ...]:
        """Terms without a cause."""
        return phenomenological(bool(self.sweeps), bool(self.pulls))

    def refined(self, best: Residual) -> "RigRecordingsForward":
        """Itself: the noise does not depend on the base model."""
        return self

    @cached_property
    def _extras(self) -> dict[str, Further]:
        return further_sweeps(self.sweeps, self.measurement.calibration.repeatability) if self.sweeps else {}

    def extras(self) -> tuple[Extra, ...]:
        """Further sweeps: other branch, rate, speed, track, load, the tyre turned round; a gauge at the rim."""
        found = [Extra(what, np.ones(len(f.sweep.time))) for what, f in self._extras.items()]
        if self.pulls:
            found.append(Extra("dial gauge at rim and fixture in the pull test", np.full(1, GAUGE)))
        return tuple(found)

    def predict(self, extra: Extra, candidates: tuple[Candidate, ...], theta: Array) -> tuple[Array, Array]:
        """Whitened prediction (m,) and its derivative (m, p)."""
        values, steps = self._stencil(candidates, theta, True)
        if extra.what not in self._extras:
            load = max(float(np.abs(p.force).max()) for p in self.pulls)
            moved = load * values.get("rim_compliance", np.zeros(1 + 2 * len(steps)))[:, None]
            return moved[0] / extra.sd, _centred(moved, steps) / extra.sd
        f = self._extras[extra.what]
        force, slope = self._swept(f.sweep, values, steps, turned=f.turned)
        return f.sweep.whiten(force), f.sweep.whiten(slope)

    def forces(self, candidates: tuple[Candidate, ...], theta: Array) -> dict[str, Array]:
        """Computed force of every recording, N."""
        values, none = self._stencil(candidates, theta, False)
        found = {s.name: self._swept(s, values, none)[0] for s in self.sweeps}
        return found | {p.name: self.pulled(p, values)[0] for p in self.pulls}


def _centred(every: Array, steps: Array) -> Array:
    """Derivatives (n, p) of a batch [x, x + h_k, x - h_k ...] (2 p + 1, n)."""
    p = len(steps)
    return np.asarray(((every[1 : p + 1] - every[p + 1 :]) / (2 * steps[:, None])).T)


def _segments(part: NDArray[np.int64]) -> list[int]:
    """Held-out fold of each block: whole branches in turn, or sixths of the recording where it has few."""
    numbers = np.unique(part)
    if len(numbers) >= FOLDS:
        return [int(k) % FOLDS for k in np.searchsorted(numbers, part)]
    return [SEGMENTS * k // len(part) % FOLDS for k in range(len(part))]


def _way(pull: Pull) -> Array:
    return np.asarray(np.gradient(pull.displacement))
