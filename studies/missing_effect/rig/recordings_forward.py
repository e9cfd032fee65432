"""The engine on raw recordings of a tyre rig: side force of slip sweeps in time, and of static pulls.

Base model: the reference's Magic Formula without lag or offset, F = D sin(C atan(B x - E (B x - atan(B x)))), and a
straight pull F = K x on a rigid rim. Candidates are the terms of the rig effects in :mod:`tyre.rig.effects`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from studies.inference.folds import MOST_FOLDS
from studies.inference.forward import ForwardModel, ProposedMeasurement, Rows, Series
from studies.inference.parameter import Candidate, UncertainParameter, central_differences, stencil
from studies.missing_effect.rig.data import PullReadings, SweepBlocks, condition_label
from studies.missing_effect.rig.proposals import GAUGE_SD, FurtherSweep, RimGauge, further_sweeps
from studies.missing_effect.rig.recordings import RigRecordings
from studies.missing_effect.rig.reference import PEAK, Curve
from tyre.base.arrays import Array
from tyre.drum import log_curvature
from tyre.recordings.recording import Condition
from tyre.rig.regression import Contribution, PullTerms, SweepTerms, Term

Values = Mapping[str, Array]
LOAD_EXPONENT = 0.7  # d(ln C)/d(ln load) where the reference has one load only
FOLDS, SEGMENTS = 3, 6  # of a recording held out in turn, where there are fewer than three recordings


@dataclass(frozen=True, eq=False, kw_only=True)
class RigRecordingsForward(ForwardModel):
    """Forward model of rig recordings (see :class:`studies.inference.forward.Forward`).

    Attributes
    ----------
    recordings : RigRecordings
    sweeps, pulls : tuples
        Those reduced.
    nuisances : tuple of UncertainParameter
    candidates, without_cause : tuple of Candidate
        Rig effects, and phenomenological terms.
    refused : dict
    notes : tuple of str
    curves : dict
        The reference by the label of a condition.
    terms : tuple of Term
        What effects add, those of the candidates and of the nuisances among them.
    """

    recordings: RigRecordings
    sweeps: tuple[SweepBlocks, ...]
    pulls: tuple[PullReadings, ...]
    nuisances: tuple[UncertainParameter, ...]
    candidates: tuple[Candidate, ...]
    terms: tuple[Term, ...]
    without_cause: tuple[Candidate, ...] = ()
    refused: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    curves: dict[str, Curve] = field(default_factory=dict)
    thorough = False

    # ------------------------------------------------------------------ the model

    def swept(self, sweep: SweepBlocks, values: Values, *, turned: bool = False) -> Array:
        """Values of ``SWEEP_TERMS`` (K, 13) for a sweep.

        Parameters
        ----------
        sweep : SweepBlocks
        values : mapping of str to ndarray, shape (K,)
            Parameters by name.
        turned : bool
            The tyre is mounted the other way round.
        """
        condition, curve = sweep.condition, self.curve(sweep.condition)
        assert curve.cornering_stiffness is not None
        v = _Values(values)
        radius = self.recordings.wheel_radius
        here, there = (log_curvature(wheel_radius=radius, drum_radius=x.drum_radius) for x in (condition, curve))
        t = SweepTerms(condition.load, condition.load / curve.load, here - there)
        for term in self.terms:
            term.add_to(t, values)
        loaded, factor = 1 + v["load gain"] + t.load_gain, np.exp(t.log_stiffness)
        exponent = self.recordings.reference.load_exponent(condition.pressure)
        true = factor * np.exp(v[f"cornering stiffness, {sweep.label}"] + v[f"repeatability, {sweep.name}"])
        true = true * curve.cornering_stiffness[0] * loaded ** (LOAD_EXPONENT if exponent is None else exponent)
        peak = (curve.peak or PEAK * curve.load) * t.load_ratio * np.exp(v[f"peak, {sweep.label}"]) * loaded
        force, slip = 1 + v["force gain"] + t.force_gain, 1 + v["slip gain"] + t.slip_gain
        lag: Contribution = 0.0
        if t.relaxation_length is not None and sweep.speed:
            length = t.relaxation_length * factor
            if curve.length is not None and self._length is not None:
                length = length * curve.length[0] / self._length[0]
            lag = (length + true * t.compliance) / sweep.speed
        side = -1.0 if turned else 1.0
        each = (
            true * force / slip, peak * force, curve.shape + v["shape"], curve.curvature + v["curvature"],
            t.slip_offset * slip + v["slip zero"], lag, t.half_gap * slip,
            side * t.side_force * force + v[f"zero, {sweep.name}"],
            v[f"drift, {sweep.name}"], t.delay, t.warming, t.asymmetry, t.gain_by_sign,
        )  # fmt: skip
        return np.stack([np.broadcast_to(np.asarray(x, float), v.count) for x in each], axis=1)

    def pulled(self, pull: PullReadings, values: Values) -> Array:
        """Force of a pull (K, n), N: F = K x (1 - bend |x|/x_max) in series with the rim, and what effects add.

        Parameters
        ----------
        pull : PullReadings
        values : mapping of str to ndarray, shape (K,)
            Parameters by name.
        """
        curve = self.curve(pull.condition)
        assert curve.lateral_stiffness is not None
        v, t = _Values(values), PullTerms(pull.displacement)
        for term in self.terms:
            term.add_to(t, values)

        def column(x: Contribution) -> Array:
            return np.broadcast_to(np.asarray(x, float), v.count)[:, None]

        tyre = curve.lateral_stiffness[0] * column(
            np.exp(v[f"lateral stiffness, {pull.label}"] + v[f"repeatability, {pull.name}"])
        )
        x = pull.displacement / column(1 + v["displacement gain"] + t.displacement_gain)
        share = column(v[f"bend, {pull.name}"] + t.bend)
        straight = tyre / (1 + tyre * column(t.compliance)) * x
        force = straight * (1 - share * np.abs(pull.displacement) / np.abs(pull.displacement).max()) + t.force
        gain = column(1 + v["force gain"] + t.force_gain)
        return np.asarray(
            gain * force + column(v[f"zero, {pull.name}"]) + column(v[f"drift, {pull.name}"]) * pull.clock
        )

    def curve(self, condition: Condition) -> Curve:
        """The reference for a ``condition``."""
        label = condition_label(condition)
        if label not in self.curves:
            self.curves[label] = self.recordings.reference.at(condition.load, condition.pressure)
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
            fold += _segments(s.branch) if split else [k] * len(degrees)
        for k, p in enumerate(self.pulls, len(self.sweeps)):
            n = len(p.force)
            where += [f"pull test, {p.name}, {'rising' if d >= 0 else 'falling'} displacement" for d in _way(p)]
            x += (1e3 * p.displacement).tolist()
            series += [p.name] * n
            fold += _segments(np.zeros(n, int)) if split else [k] * n
        shown = {s.name: Series("slip sweep", axis="slip angle, deg") for s in self.sweeps}
        shown |= {p.name: Series("pull test", axis="displacement, mm") for p in self.pulls}
        return Rows(tuple(where), np.array(x), tuple(series), np.array(fold) % MOST_FOLDS, shown=shown)

    def residual(self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """Innovations (n,) at ``theta`` (p,) and, with ``slopes``, slopes (n, p). See :meth:`.Forward.residual`."""
        batch, steps = self._batch(candidates, theta, slopes=slopes)
        residual, jacobian = [], []
        for s in self.sweeps:
            force, slope = self._force(s, batch, steps)
            both = s.whiten(np.column_stack([s.force - force, -slope]))
            residual.append(both[:, 0])
            jacobian.append(both[:, 1:])
        for p in self.pulls:
            every = self.pulled(p, batch)
            residual.append((p.force - every[0]) / p.sd)
            jacobian.append(-central_differences(every, steps) / p.sd)
        return np.concatenate(residual), np.concatenate(jacobian)

    def _batch(
        self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool
    ) -> tuple[dict[str, Array], Array]:
        unknowns = (*self.nuisances, *(u for c in candidates for u in c.unknowns))
        batch, steps = stencil(unknowns, theta) if slopes else (theta[None], theta[:0])
        values: dict[str, Array] = {}
        for column, u in enumerate(unknowns):
            values |= {key: factor * u.value(batch[:, column]) for key, factor in u.sets.items()}
        return values, steps

    def _force(self, s: SweepBlocks, values: Values, steps: Array, *, turned: bool = False) -> tuple[Array, Array]:
        """Force (n,) and derivatives with respect to the coordinates (n, p), through the terms of the curve."""
        terms = self.swept(s, values, turned=turned)
        force, by_term = s.computed(terms[0], slopes=bool(len(steps)))
        if not len(steps):
            return force, np.empty((len(force), 0))
        return force, by_term @ central_differences(terms, steps)

    def phenomenological(self) -> tuple[Candidate, ...]:
        """Terms without a cause."""
        return self.without_cause

    def proposed(self) -> tuple[ProposedMeasurement, ...]:
        """Further sweeps: other branch, rate, speed, track, load, the tyre turned round; a gauge at the rim."""
        proposals: list[ProposedMeasurement] = []
        if self.sweeps:
            proposals += further_sweeps(self.sweeps, self.recordings.calibration.repeatability)
        if self.pulls:
            proposals.append(RimGauge("dial gauge at rim and fixture in the pull test", np.full(1, GAUGE_SD)))
        return tuple(proposals)

    def predict(
        self, proposal: ProposedMeasurement, candidates: tuple[Candidate, ...], theta: Array
    ) -> tuple[Array, Array]:
        """Whitened prediction (m,) at ``theta`` (p,) and its derivative (m, p). See :meth:`.Forward.predict`."""
        values, steps = self._batch(candidates, theta, slopes=True)
        if isinstance(proposal, RimGauge):
            terms = PullTerms(np.zeros(1))
            for term in self.terms:
                term.add_to(terms, values)
            load = max(float(np.abs(p.force).max()) for p in self.pulls)
            moved = load * np.broadcast_to(np.asarray(terms.compliance, float), 1 + 2 * len(steps))[:, None]
            return moved[0] / proposal.sd, central_differences(moved, steps) / proposal.sd
        assert isinstance(proposal, FurtherSweep)
        sweep = proposal.sweep
        force, slope = self._force(sweep, values, steps, turned=proposal.turned)
        return sweep.whiten(force), sweep.whiten(slope)

    def forces(self, candidates: tuple[Candidate, ...], theta: Array) -> dict[str, Array]:
        """Computed force (n,), N, of every recording by name, with ``candidates`` at the coordinates ``theta`` (p,)."""
        values, none = self._batch(candidates, theta, slopes=False)
        found = {s.name: self._force(s, values, none)[0] for s in self.sweeps}
        return found | {p.name: self.pulled(p, values)[0] for p in self.pulls}


class _Values:
    """Parameters (K,) by name, zero where one does not float."""

    def __init__(self, values: Values) -> None:
        self.values = values
        self.count = max((len(value) for value in values.values()), default=1)

    def __getitem__(self, key: str) -> Array:
        return self.values.get(key, np.zeros(self.count))


def _segments(branch: NDArray[np.int64]) -> list[int]:
    """Held-out fold of each block: whole branches in turn, or sixths of the recording where it has few."""
    numbers = np.unique(branch)
    if len(numbers) >= FOLDS:
        return [int(k) % FOLDS for k in np.searchsorted(numbers, branch)]
    return [SEGMENTS * k // len(branch) % FOLDS for k in range(len(branch))]


def _way(pull: PullReadings) -> Array:
    return np.asarray(np.gradient(pull.displacement))
