"""Recordings of a tyre rig compared with a known tyre: lateral force in slip sweeps and lateral stiffness tests.

Base model: the reference's Magic Formula without lag or offset, F = D sin(C atan(B x - E (B x - atan(B x)))), and a
linear stiffness F = K x on a rigid rim. Candidates are the terms of the rig effects in :mod:`tyre.rig.effects`.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from studies.diagnosis.figures import legend_above, models_of, panels
from studies.diagnosis.rig_data import (
    DRIFT,
    PHENOMENOLOGICAL,
    ZERO,
    PullReadings,
    SweepBlocks,
    condition_label,
    reduce_pull,
    reduce_sweep,
    rig_candidates,
    rig_nuisances,
)
from studies.diagnosis.rig_reference import ALIKE, PEAK, Curve, Reference, read_reference
from studies.diagnosis.tyre_tables import WHEEL_RADIUS, TyreKind
from studies.inference.evidence import MOST_FOLDS
from studies.inference.judge import Judgement
from studies.inference.kind import Candidates, Figure, Prediction, Proposal, Rows, Series
from studies.inference.parameter import central_differences, stencil
from studies.reporting.plotting import GREY, drawing, look
from tyre.fits.campaign import recordings_in
from tyre.fits.condition import FitSettings
from tyre.fits.recording_files import read_recording
from tyre.fits.relaxation import is_slip_step
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, refuse_unknown
from tyre.ground.schema import anything, by_name, list_of, maybe, needed, number, read, table, text
from tyre.ground.units import PASCAL_PER_BAR
from tyre.maps.contact_patch import log_curvature
from tyre.measured.properties import Calibration
from tyre.recordings.noise import AR1Noise
from tyre.recordings.recording import SYNTHETIC_NOTES, Condition, LateralStiffnessTest, RigRun
from tyre.recordings.run_checks import LOAD_TOLERANCE, preflight
from tyre.rig.effect import Contribution, PullTerms, Recorded, SweepTerms, Term, rig_terms

EXAMPLE = 'write [rig] with recordings = "FOLDER" and a table [rig.reference]'
FOLDS = 3  # parts of a recording that are held out in turn, of fewer than three recordings
Values = Mapping[str, Array]


@dataclass(frozen=True, eq=False, kw_only=True)
class RigRecordings(TyreKind, kind="rig"):
    """Recordings of one tyre and the reference they are compared with, SI units."""

    thorough = False
    missing: ClassVar[str] = EXAMPLE
    keys: ClassVar[Any] = table(
        {
            needed("recordings", f"recordings is missing; {EXAMPLE}"): anything,
            needed("reference", f"reference is missing; {EXAMPLE}"): anything,
            maybe("includes", []): list_of(text(), 'must be a list of rig effects such as ["sweep_lag"]'),
            maybe("pull_displacement", "tyre"): text(
                'is not allowed; write "tyre" (plate minus rim) or "plate" (rim ignored)', allowed=("tyre", "plate")
            ),
            maybe("wheel_radius_m", WHEEL_RADIUS): number(
                least=0.1, most=0.6, says="must be a radius of wheel and tyre from 0.1 to 0.6 m"
            ),
            maybe("load_tolerance", LOAD_TOLERANCE): number(
                above=0, most=1, says="must be a number above 0, at most 1: a share of the declared load"
            ),
            maybe("calibration", {}): by_name(
                number(says="must be a number: a relative standard deviation"),
                [f.name for f in fields(Calibration)],
                kind="key",
            ),
        }
    )
    reference: Reference  # what was known of the tyre
    sweeps: tuple[tuple[str, RigRun], ...] = ()  # (name, recording); slip steps are not used, which ``notes`` says
    pulls: tuple[tuple[str, LateralStiffnessTest], ...] = ()  # (name, recording)
    includes: tuple[str, ...] = ()  # rig effects that the base model contains
    pull_displacement: str = "tyre"  # ``tyre`` (plate minus rim) or ``plate``
    wheel_radius: float = WHEEL_RADIUS  # m, for the drum's curvature
    # relative sd of the gains of the sensors, and of a stiffness from one recording to the next
    calibration: Calibration = Calibration()  # noqa: RUF009 - frozen
    # The following are filled by :meth:`ready`.
    blocks: tuple[SweepBlocks, ...] = ()  # the sweeps as means of blocks
    readings: tuple[PullReadings, ...] = ()  # the pulls
    terms: tuple[Term, ...] = ()  # all that can act on a recording, phenomenological ones last
    without_cause: Candidates = ()  # phenomenological terms
    curves: Mapping[str, Curve] = field(default_factory=dict)  # the reference by the label of a condition

    def __post_init__(self) -> None:
        if not self.sweeps and not self.pulls:
            raise InputError(
                "no slip sweep and no lateral stiffness test among the recordings; nothing can be compared"
            )
        conditions = [run.condition for _, run in self.sweeps] + [test.condition for _, test in self.pulls]
        tyres = sorted({c.tyre for c in conditions})
        if len(tyres) > 1:
            raise InputError(f"recordings of {len(tyres)} tyres, {', '.join(tyres)}; diagnose one tyre at a time")
        if self.reference.tyre is not None and self.reference.tyre != tyres[0]:
            raise InputError(f"recordings of {tyres[0]!r}, the reference is of {self.reference.tyre!r}; give one tyre")
        for condition in conditions:
            self.reference.curve_at(condition.load, condition.pressure)
        signals: list[tuple[str, Any, Any]] = [(name, run.slip_angle, run.lateral_force) for name, run in self.sweeps]
        signals += [(name, test.lateral_force, test.plate_displacement) for name, test in self.pulls]
        names_by_data: dict[tuple[bytes, bytes], str] = {}
        for name, first, second in signals:
            key = np.asarray(first).tobytes(), np.asarray(second).tobytes()
            if key in names_by_data:
                raise InputError(f"{name}: the same recording as {names_by_data[key]}; keep one, or it counts twice")
            names_by_data[key] = name

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "RigRecordings":
        rig = read(cls.keys, content, section="rig")
        tolerance, source = rig["load_tolerance"], rig["recordings"]
        settings = FitSettings(Calibration(**rig["calibration"]), load_tolerance=tolerance)
        sweeps, pulls, notes = _recordings(_files(source, folder), tolerance, skip_bad=isinstance(source, str))
        return cls(
            reference=read_reference(rig["reference"], folder, settings),
            sweeps=sweeps,
            pulls=pulls,
            includes=tuple(dict.fromkeys(rig["includes"])),
            pull_displacement=rig["pull_displacement"],
            wheel_radius=rig["wheel_radius_m"],
            calibration=settings.calibration,
            notes=notes,
            **common,
        )

    def prepare(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> Self:
        """Reduce the recordings, find their reference and choose candidates."""
        blocks, notes = [], list(self.notes)
        for name, run in self.sweeps:
            sweep, sweep_notes = reduce_sweep(name, run)
            blocks.append(sweep)
            notes += sweep_notes
        plate = self.pull_displacement == "plate"
        readings = tuple(reduce_pull(name, test, plate=plate) for name, test in self.pulls)
        curves = {s.label: self._curve_with("cornering_stiffness", s) for s in blocks}
        curves |= {p.label: self._curve_with("lateral_stiffness", p) for p in readings}
        length = curves[blocks[0].label].length if blocks else None
        bends = [self._bend_beyond(s.condition, curves[s.label]) for s in blocks]
        recorded = Recorded(
            sweeps=bool(blocks),
            pulls=bool(readings),
            both_branches=len({float(way) for s in blocks for way in s.direction}) > 1,
            both_signs=any(s.slip.min() < 0 < s.slip.max() for s in blocks),
            speeds=all(s.speed for s in blocks),
            other_track=max(map(abs, bends), default=0.0) > 1e-9,
            other_loads=any(abs(s.condition.load / curves[s.label].load - 1) > ALIKE for s in blocks),
            known={} if length is None else {"relaxation_length": length},
        )
        all_candidates, reasons = rig_candidates(rig_terms(), recorded)
        can = {c.identifier: c for c in all_candidates}
        for origin, names in (("[rig]: includes", self.includes), ("--without", without), ("--with", also)):
            refuse_unknown("rig effect", names, {*can, *reasons}, where=origin)
        for name in self.includes:
            if name in reasons:
                raise InputError(f"[rig]: includes {name!r}, but: {reasons[name]}; take it out")
        floating = rig_nuisances(blocks, readings, curves, self.calibration)
        return replace(
            self,
            blocks=tuple(blocks),
            readings=readings,
            curves=curves,
            refused=reasons,
            nuisances=(*floating, *(u for name in self.includes for u in can[name].unknowns)),
            candidates=tuple(c for c in all_candidates if c.identifier not in {*self.includes, *without}),
            terms=(*rig_terms(), *PHENOMENOLOGICAL),
            without_cause=rig_candidates(PHENOMENOLOGICAL, recorded)[0],
            notes=(*notes, *self._list_assumptions(blocks, readings, curves, off=recorded.other_loads)),
        )

    def _curve_with(self, needed: str, recording: SweepBlocks | PullReadings) -> Curve:
        """The reference for a recording, with the stiffness that it needs."""
        curve = self.reference.curve_at(recording.condition.load, recording.condition.pressure)
        if getattr(curve, needed) is None:
            raise InputError(
                f"{recording.name}: the reference ({self.reference.origin}) has no {needed.replace('_', ' ')} "
                f"at {curve.load:g} N, {curve.pressure / PASCAL_PER_BAR:g} bar; add it or leave the recording out"
            )
        return curve

    def _bend_beyond(self, condition: Condition, curve: Curve) -> float:
        """ln(1 + R/Rd) of a condition beyond that of the reference."""
        bend, reference_bend = (
            log_curvature(wheel_radius=self.wheel_radius, drum_radius=x.drum_radius) for x in (condition, curve)
        )
        return bend - reference_bend

    def _list_assumptions(
        self, sweeps: Sequence[SweepBlocks], pulls: Sequence[PullReadings], curves: Mapping[str, Curve], *, off: bool
    ) -> list[str]:
        """Assumptions in words, for the report; ``off``: a load is not one of the reference."""
        notes = [f"reference: {self.reference.origin}"]
        if any(run.synthetic for _, run in self.sweeps) or any(test.synthetic for _, test in self.pulls):
            notes.insert(0, "the recordings are synthetic")
        if self.includes:
            notes.append(f"the base model contains {', '.join(self.includes)}")
        if sweeps and not any(c.peak for c in curves.values()):
            notes.append(
                f"no curve in the reference: a peak of {PEAK:g} loads and a shape of 1.4 are assumed, 1 sd 10 %"
            )
        for pull in pulls:
            curve = curves[pull.label]
            if abs(pull.condition.load / curve.load - 1) > ALIKE:
                notes.append(
                    f"{pull.name}: no reference at {pull.condition.load:g} N; that at {curve.load:g} N is taken"
                )
        if off:
            notes.append("loads without a reference are computed with the cornering stiffness of the nearest")
        if sweeps and (length := curves[sweeps[0].label].length) is not None:
            size = f"{1e3 * length[0]:.0f} mm, 1 sd {1e3 * length[1]:.0f} mm"
            notes.append(f"relaxation length at {sweeps[0].label}: {size} before drum and load change it")
        if pulls and self.pull_displacement == "plate":
            notes.append("displacement of the lateral stiffness tests is that of the plate; the rim's is ignored")
        return notes

    # ---- the model ----

    def sweep_terms(self, sweep: SweepBlocks, values: Values, *, turned: bool = False) -> Array:
        """Values of ``SWEEP_TERMS`` (K, 13) for a sweep, at parameters (K,) by name."""
        condition, curve = sweep.condition, self.curve(sweep.condition)
        assert curve.cornering_stiffness is not None
        v, count = _with_zeros(values)
        t = SweepTerms(condition.load, condition.load / curve.load, self._bend_beyond(condition, curve))
        for term in self.terms:
            term.add_to(t, values)
        loaded, factor = 1 + v["load gain"] + t.load_gain, np.exp(t.log_stiffness)
        exponent = self.reference.load_exponent(condition.pressure)
        exponent = 0.7 if exponent is None else exponent  # d(ln C)/d(ln load) of tyres
        true = factor * np.exp(v[f"cornering stiffness, {sweep.label}"] + v[f"repeatability, {sweep.name}"])
        true = true * curve.cornering_stiffness[0] * loaded**exponent
        peak = (curve.peak or PEAK * curve.load) * t.load_ratio * np.exp(v[f"peak, {sweep.label}"]) * loaded
        force, slip = 1 + v["force gain"] + t.force_gain, 1 + v["slip gain"] + t.slip_gain
        lag: Contribution = 0.0
        if t.relaxation_length is not None and sweep.speed:
            length = t.relaxation_length * factor
            first = self.curve(self.blocks[0].condition).length
            if curve.length is not None and first is not None:
                length = length * curve.length[0] / first[0]
            lag = (length + true * t.compliance) / sweep.speed
        side = -1.0 if turned else 1.0
        terms = (
            true * force / slip,
            peak * force,
            curve.shape + v["shape"],
            curve.curvature + v["curvature"],
            t.slip_offset * slip + v["slip zero"],
            lag,
            t.half_gap * slip,
            side * t.lateral_force * force + v[f"zero, {sweep.name}"],
            v[f"drift, {sweep.name}"],
            t.delay,
            t.warming,
            t.asymmetry,
            t.gain_by_sign,
        )
        return np.stack([np.broadcast_to(np.asarray(x, float), count) for x in terms], axis=1)

    def simulate_pull(self, pull: PullReadings, values: Values) -> Array:
        """Force of such a test (K, n), N: F = K x (1 - bend |x|/x_max) in series with the rim, and terms of effects."""
        curve = self.curve(pull.condition)
        assert curve.lateral_stiffness is not None
        v, count = _with_zeros(values)
        t = PullTerms(pull.displacement)
        for term in self.terms:
            term.add_to(t, values)

        def column(x: Contribution) -> Array:
            return np.broadcast_to(np.asarray(x, float), count)[:, None]

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
        prepared = self.curves.get(condition_label(condition))
        return prepared or self.reference.curve_at(condition.load, condition.pressure)

    @property
    def data(self) -> tuple[Array, Array]:
        """Forces and the sd of their white noise, N; residuals are innovations of a coloured one."""
        force = [*(s.force for s in self.blocks), *(p.force for p in self.readings)]
        sd = [np.sqrt(s.noise.covariance(s.time).diagonal()) for s in self.blocks]
        return np.concatenate(force), np.concatenate([*sd, *(np.full(len(p.force), p.sd) for p in self.readings)])

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """One series a recording; innovations in the order of time."""
        places, x, series, fold = [], [], [], []
        split = len(self.blocks) + len(self.readings) < FOLDS
        for k, s in enumerate(self.blocks):
            degrees = np.rad2deg(s.slip)
            for slip, direction in zip(degrees, s.direction, strict=True):
                low = int(np.floor(slip))
                sense = "up" if direction > 0 else "down"
                places.append(f"slip sweep, {s.name}, {sense}, {low} to {low + 1} deg")
            x += degrees.tolist()
            series += [s.name] * len(degrees)
            fold += _segments(s.branch) if split else [k] * len(degrees)
        for k, p in enumerate(self.readings, len(self.blocks)):
            n = len(p.force)
            way = np.gradient(p.displacement)
            places += [
                f"lateral stiffness test, {p.name}, {'rising' if d >= 0 else 'falling'} displacement" for d in way
            ]
            x += (1e3 * p.displacement).tolist()
            series += [p.name] * n
            fold += _segments(np.zeros(n, int)) if split else [k] * n
        displays = {s.name: Series("slip sweep", "lateral force, N", "slip angle, deg") for s in self.blocks}
        displays |= {
            p.name: Series("lateral stiffness test", "lateral force, N", "displacement, mm") for p in self.readings
        }
        return Rows(tuple(places), np.array(x), tuple(series), np.array(fold) % MOST_FOLDS, displays=displays)

    def residual(self, candidates: Candidates, theta: Array, *, slopes: bool = True) -> Prediction:
        """Innovations (n,) and their derivatives (n, p)."""
        batch, steps = self._batch(candidates, theta, slopes=slopes)
        residual, jacobian = [], []
        for s in self.blocks:
            force, slope = self._force(s, batch, steps)
            whitened = s.whiten(np.column_stack([s.force - force, -slope]))
            residual.append(whitened[:, 0])
            jacobian.append(whitened[:, 1:])
        for p in self.readings:
            forces = self.simulate_pull(p, batch)
            residual.append((p.force - forces[0]) / p.sd)
            jacobian.append(-central_differences(forces, steps) / p.sd)
        return np.concatenate(residual), np.concatenate(jacobian)

    def _batch(self, candidates: Candidates, theta: Array, *, slopes: bool) -> tuple[dict[str, Array], Array]:
        """Parameters (K,) by name at ``theta`` (p,) and, with ``slopes``, at steps about it, and the steps."""
        unknowns = self.unknowns(candidates)
        batch, steps = stencil(unknowns, theta) if slopes else (theta[None], theta[:0])
        values: dict[str, Array] = {}
        for column, u in enumerate(unknowns):
            values |= {key: factor * u.value(batch[:, column]) for key, factor in u.sets.items()}
        return values, steps

    def _force(self, s: SweepBlocks, values: Values, steps: Array, *, turned: bool = False) -> Prediction:
        """Force (n,) and its derivatives (n, p), through the terms of the curve."""
        terms = self.sweep_terms(s, values, turned=turned)
        force, by_term = s.lateral_force(terms[0], slopes=bool(len(steps)))
        if not len(steps):
            return force, np.empty((len(force), 0))
        return force, by_term @ central_differences(terms, steps)

    def empirical_terms(self) -> Candidates:
        return self.without_cause

    # ---- what to measure next ----

    def propose_measurements(self) -> tuple[Proposal, ...]:
        """Further sweeps: other branch, rate, speed, track, load, the tyre turned round; a gauge at the rim."""
        proposals = self._propose_sweeps() if self.blocks else []
        if self.readings:
            title = "dial gauge at rim and fixture in the lateral stiffness test"
            proposals.append(Proposal(title, np.full(1, 1e-5), self._rim_gauge))
        return tuple(proposals)

    def _rim_gauge(self, candidates: Candidates, theta: Array) -> Prediction:
        """Movement (1,), m, of rim and fixture at the largest force, and its derivatives."""
        values, steps = self._batch(candidates, theta, slopes=True)
        terms = PullTerms(np.zeros(1))
        for term in self.terms:
            term.add_to(terms, values)
        load = max(float(np.abs(p.force).max()) for p in self.readings)
        movement = load * np.broadcast_to(np.asarray(terms.compliance, float), 1 + 2 * len(steps))[:, None]
        return movement[0], central_differences(movement, steps)

    def _propose_sweeps(self) -> list[Proposal]:
        sweeps, first = self.blocks, self.blocks[0]
        proposals: list[Proposal] = []

        def propose(title: str, *, turned: bool = False, **changes: Any) -> None:
            sweep = _path(first, self.calibration.repeatability, **changes)
            predict = partial(self._swept_again, sweep, turned=turned)
            proposals.append(Proposal(title, np.ones(len(sweep.time)), predict))

        single = len({float(way) for s in sweeps for way in s.direction}) == 1
        if single:
            propose("the other branch of the sweep", branches=(-float(first.direction[0]),))
        if _alike([s.rate for s in sweeps]):
            propose(f"both branches at {np.rad2deg(2 * first.rate):.3g} deg/s", rate=2 * first.rate)
        if first.speed is not None and _alike([s.speed or first.speed for s in sweeps]):
            propose(f"both branches at a rolling speed of {2 * first.speed:.3g} m/s", speed=2 * first.speed)
        if all(s.condition.drum_radius for s in sweeps):
            flat = replace(first.condition, surface="flat", drum_radius=None)
            propose("the same sweep on a flat track with the same sensors", condition=flat)
        if single:
            return proposals  # the other branch first
        if _alike([s.condition.load for s in sweeps]):
            load = 1.25 * first.condition.load
            propose(f"both branches at {load:.0f} N", condition=replace(first.condition, load=load))
        propose("both branches with the tyre turned round on its rim", turned=True)
        return proposals

    def _swept_again(self, sweep: SweepBlocks, candidates: Candidates, theta: Array, *, turned: bool) -> Prediction:
        """Whitened force of a further sweep (m,) and its derivatives (m, p)."""
        force, slope = self._force(sweep, *self._batch(candidates, theta, slopes=True), turned=turned)
        return sweep.whiten(force), sweep.whiten(slope)

    # ---- report ----

    def forces(self, candidates: Candidates, theta: Array) -> dict[str, Array]:
        """Computed force (n,), N, of every recording by name."""
        values, none = self._batch(candidates, theta, slopes=False)
        computed = {s.name: self._force(s, values, none)[0] for s in self.blocks}
        return computed | {p.name: self.simulate_pull(p, values)[0] for p in self.readings}

    def predict(self, candidates: Candidates, theta: Array) -> Array:
        return np.concatenate(list(self.forces(candidates, theta).values()))

    def figures(self) -> dict[str, Figure]:
        return {"before_after": FORCES}


def _with_zeros(values: Values) -> tuple[Values, int]:
    """Parameters (K,) by name, zero if one does not float, and K."""
    count = max(map(len, values.values()), default=1)
    return defaultdict(lambda: np.zeros(count), values), count


def _segments(branch: NDArray[np.int64]) -> list[int]:
    """Held-out fold of each block: whole branches in turn, or sixths of a recording with few."""
    numbers = np.unique(branch)
    if len(numbers) >= FOLDS:
        return [int(k) % FOLDS for k in np.searchsorted(numbers, branch)]
    return [2 * FOLDS * k // len(branch) % FOLDS for k in range(len(branch))]


def _alike(values: Sequence[float]) -> bool:
    """True if rates, speeds or loads are one: within 20 %."""
    return max(values) < 1.2 * min(values)


def _path(
    like: SweepBlocks,
    repeatability: float,
    *,
    rate: float | None = None,
    speed: float | None = None,
    branches: tuple[float, ...] = (1.0, -1.0),
    condition: Condition | None = None,
) -> SweepBlocks:
    """A sweep like another, in blocks of 0.2 deg, with settled blocks only and the noise of the other one."""
    rate, speed = rate or like.rate, speed or like.speed
    reach = float(np.abs(like.slip).max())
    count = max(8, round(2 * reach / np.deg2rad(0.2)))
    line = np.linspace(-reach, reach, count)
    slip = np.concatenate([sign * line for sign in branches])
    step = 2 * reach / count / rate
    time = step * np.arange(len(slip))
    used = np.tile(step * np.arange(count), len(branches)) * (speed or 2.5) > 0.5  # m, until it has settled
    sweep = replace(
        like,
        name="",
        condition=condition or like.condition,
        time=time[used],
        slip=slip[used],
        force=np.zeros(used.sum()),
        direction=np.repeat(branches, count)[used],
        branch=np.repeat(np.arange(len(branches)), count)[used],
        slip_time=time,
        slip_history=slip,
        speed=speed,
        rate=rate,
        noise=AR1Noise(like.noise.white * rate / like.rate / 2, like.noise.correlated, like.noise.memory),
    )
    order = np.argsort(like.slip)
    force = np.interp(sweep.slip, like.slip[order], like.force[order])
    return replace(sweep, common=np.stack([repeatability * force, DRIFT * sweep.clock, np.full_like(force, ZERO)], 1))


# ---- reading ----


def _files(source: Any, folder: Path) -> list[tuple[str, Path]]:
    """All recordings of a folder, or those of a list, with their names."""
    if isinstance(source, str):
        root = folder / source
        return [(str(path.relative_to(root).with_suffix("")), path) for path in recordings_in(root)]
    if not isinstance(source, list) or not source or not all(isinstance(name, str) for name in source):
        raise InputError(f"[rig]: recordings = {source!r} must be a folder in quotes or a list of files")
    stems = [Path(name).stem for name in source]
    for stem, name in zip(stems, source, strict=True):
        if stems.count(stem) > 1:
            raise InputError(f"[rig]: recordings names {name} twice, or two files of that name; keep one")
    return [(stem, folder / name) for stem, name in zip(stems, source, strict=True)]


def _recordings(
    files: list[tuple[str, Path]], load_tolerance: float, *, skip_bad: bool
) -> tuple[tuple[tuple[str, RigRun], ...], tuple[tuple[str, LateralStiffnessTest], ...], tuple[str, ...]]:
    """Read all usable sweeps and stiffness tests by name, and notes; with ``skip_bad`` the others are notes."""
    sweeps: list[tuple[str, RigRun]] = []
    pulls: list[tuple[str, LateralStiffnessTest]] = []
    notes: list[str] = []
    left_out: list[str] = []
    for name, path in files:
        try:
            recording = read_recording(path)
            check = preflight(recording, load_tolerance=load_tolerance)
            if not check.usable:
                raise InputError(f"{path}: not usable: {'; '.join(check.problems)}")
        except InputError as error:
            if not skip_bad or len(files) == 1:
                raise
            left_out.append(f"{name}: left out: {error}")
            continue
        problems = dict.fromkeys((*recording.notes, *check.problems))
        notes += [f"{name}: {problem}" for problem in problems if problem not in SYNTHETIC_NOTES]
        if isinstance(recording, LateralStiffnessTest):
            pulls.append((name, recording))
        elif is_slip_step(recording):
            notes.append(f"{name}: a slip step, not used; only slip sweeps and lateral stiffness tests are")
        else:
            sweeps.append((name, recording))
    if left_out and not sweeps and not pulls:
        raise InputError(f"none of {len(files)} recordings can be used; {'; '.join(left_out)}")
    return tuple(sweeps), tuple(pulls), (*left_out, *notes)


# ---- the gap in newtons ----


def draw_recordings(judgement: Judgement, target: Path) -> bool:
    """Measured minus base model over slip or displacement, branch by branch, one panel for each of eight recordings."""
    kind: Any = judgement.kind
    computed = {title: kind.forces(*model) for title, model in models_of(judgement).items()}
    base, *corrected = computed.values()
    drawn = [(s.name, np.rad2deg(s.slip), s.force, s.direction, "slip angle, deg") for s in kind.blocks]
    for p in kind.readings:
        way = np.sign(np.gradient(p.displacement))
        drawn.append((p.name, 1e3 * p.displacement, p.force, way, "displacement, mm"))
    drawn = drawn[:8]
    with drawing(target, width=8, height=1.2 + 2.6 * -(-len(drawn) // 2)) as figure:
        axes = panels(figure, len(drawn))
        for axis, (name, x, force, way, label) in zip(axes, drawn, strict=False):
            gap, up = force - base[name], way > 0
            style = {"linestyle": "none", "marker": "o", "markersize": 3, "color": GREY}
            axis.plot(x[up], gap[up], **style, label="measured, rising")
            axis.plot(x[~up], gap[~up], **style, markerfacecolor="w", label="measured, falling")
            for k, (title, forces) in enumerate(zip(list(computed)[1:], corrected, strict=True), 1):
                for mask, caption in ((up, title), (way < 0, "_")):
                    _line(axis, x, forces[name] - base[name], mask, k, caption)
            axis.axhline(0, color="k", linewidth=0.8)
            axis.set(title=name, xlabel=label, ylabel="lateral force minus base model, N")
        legend_above(figure, axes[0], columns=2)
    return True


def _line(axis: Any, x: Array, gap: Array, mask: NDArray[np.bool_], k: int, title: str) -> None:
    """Mean of the cycles in bins of x, so that a line stays a line."""
    if not mask.any():
        return
    edges = np.linspace(x.min(), x.max() + 1e-12, 41)
    place = np.digitize(x[mask], edges)
    bins = np.unique(place)
    axis.plot(
        [x[mask][place == b].mean() for b in bins],
        [gap[mask][place == b].mean() for b in bins],
        **{**look(k).plot, "marker": ""},
        label=title,
    )


FORCES: Figure = (
    draw_recordings,
    "Measured lateral force minus that of the base model, N: filled: rising slip or displacement, open: falling. "
    "Lines: what the adjusted parameters and the named effects say the difference should be.",
)
