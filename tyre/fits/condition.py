"""Recordings of one condition as one result, with their repeatability and consistency."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from tyre.fits.relaxation import (
    Agreement,
    agreement,
    mean_of_steps,
    relaxation_from_stiffness,
    relaxation_from_two_rates,
)
from tyre.ground.errors import InputError
from tyre.ground.units import PASCAL_PER_BAR
from tyre.measured.plausible import BANDS, doubts, suspicion
from tyre.measured.properties import REPEATABILITY_DOF, Calibration, Estimate, combine_uncertainties, weighed_scatter
from tyre.recordings.recording import SYNTHETIC_NOTES, Condition
from tyre.recordings.run_checks import LOAD_TOLERANCE, TOLERANCES


@dataclass(frozen=True)
class FitSettings:
    """Settings of a fit."""

    calibration: Calibration = field(default_factory=Calibration)  # of the rig
    lag_correction: bool = True  # take the lag out
    load_tolerance: float = LOAD_TOLERANCE  # largest distance of the measured load from the declared one, relative

    def __post_init__(self) -> None:
        if not 0.0 < self.load_tolerance <= 1.0:
            raise InputError(f"load tolerance = {self.load_tolerance:g} must be above 0 and at most 1 (relative)")


@dataclass(frozen=True)
class RecordingSummary:
    """One fitted recording, SI units; ``kind`` is ``slip_sweep``, ``slip_step`` or ``lateral_stiffness``."""

    file: str  # name of the recording, ``name#event`` for one of several events of a file
    kind: str  # ``slip_sweep``, ``slip_step`` or ``lateral_stiffness``
    condition: Condition  # load, pressure and camber, as stated or as the channels show them
    synthetic: bool  # True if a program computed the recording
    value: float  # cornering stiffness N/rad of a sweep, relaxation length m of a step, lateral stiffness N/m of a pull
    fit_sd: float  # of ``value``, in its unit, from the residuals of this recording alone
    r_squared: float  # of the samples that were fitted
    rate: float = 0.0  # rad/s, mean absolute d(slip)/dt of a sweep; 0 of the other kinds
    speed: float | None = None  # m/s, mean rolling speed of a sweep; None if not recorded, and of the other kinds
    half_gap: float = 0.0  # rad, half the slip distance between up and down branch of a sweep; 0 of the other kinds
    half_gap_sd: float = 0.0  # rad; 0 of the other kinds
    # further fitted numbers by name; each name ends with its unit
    details: dict[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()  # what a reader of the value must know
    cache: Path | None = None  # file that keeps the fit and its points; None without
    event: str = ""  # of several in one file


@dataclass(frozen=True)
class Repeatability:
    """Relative standard deviation of one recording about its condition's mean, pooled over a campaign."""

    sd: float  # relative to the mean, of one recording
    dof: float  # effective degrees of freedom behind ``sd``
    measured: bool  # a condition has repeats; without, ``sd`` is the stated floor
    conditions: int  # conditions with repeats
    repeats: float = 0.0  # degrees of freedom that the repeats bring
    scatter: float = np.nan  # standard deviation of the repeats alone; nan without
    refuted: bool = False  # they scatter significantly more than the floor (p < 0.05), which then does not count


def pooled_repeatability(groups: Sequence[Sequence[RecordingSummary]], *, floor: float) -> Repeatability:
    """Pool the relative scatter of repeats over conditions (``groups``), and weigh it against the stated ``floor``."""
    repeated = [np.array([item.value for item in group]) for group in groups if len(group) > 1]
    dof = float(sum(len(values) - 1 for values in repeated))
    if dof == 0.0:
        return Repeatability(floor, REPEATABILITY_DOF, measured=False, conditions=0)
    squares = sum(float(np.sum((values / values.mean() - 1.0) ** 2)) for values in repeated)
    fitted = [(item.fit_sd / item.value) ** 2 for group in groups for item in group]
    sd, weighed = weighed_scatter(float(np.sqrt(floor**2 + np.median(fitted))), squares, dof)
    scatter = float(np.sqrt(squares / dof))
    return Repeatability(sd, weighed, True, len(repeated), repeats=dof, scatter=scatter, refuted=weighed == dof)


# values that a tyre of any vehicle may have, SI; usual ones of a bicycle's: `tyre.measured.plausible`
POSSIBLE = {
    "cornering_stiffness_per_load": (2.0, 60.0), "lateral_stiffness": (5e3, 1e6), "relaxation_length": (3e-3, 3.0),
}  # fmt: skip


@dataclass(frozen=True)
class RepeatLimits:
    """Limits beyond which repeats are refused or reported, relative but for the trail."""

    copy: float = 1e-9  # two fits closer than this come from the same numbers
    reprint: float = 1e-4  # closer than this, perhaps the same recording printed twice
    spread: float = 0.05  # range of repeats that is told
    friction: float = 0.25  # of the largest force
    near: float = 0.02  # conditions closer than this were perhaps meant to be one
    trail_sd: float = 0.02  # m; a trail known worse is not judged
    # exponent n of lateral stiffness over load, K ~ load^n: the contact grows with the load, at most in proportion, and
    # the casing, in series with it, loses some stiffness as it is pressed flat
    by_load: tuple[float, float] = (-0.5, 1.0)


LIMITS = RepeatLimits()


def refuse_infinite(summary: RecordingSummary, path: Path) -> None:
    """Refuse a ``summary`` of the recording ``path`` with a number that is infinite."""
    numbers = {"value": summary.value, "sd": summary.fit_sd, "R^2": summary.r_squared, **summary.details}
    for name, number in numbers.items():
        if isinstance(number, float) and math.isinf(number):
            raise InputError(f"{path}: {name} came out as {number:g}; numbers are too large or too small: see units")


def check_plausible(summary: RecordingSummary, path: Path) -> tuple[str, ...]:
    """Return notes on unusual values of a fitted recording; refuse a stiffness that no tyre has."""
    load = summary.condition.load
    names = {"slip_sweep": "cornering_stiffness_per_load", "lateral_stiffness": "lateral_stiffness"}
    name = names.get(summary.kind, "relaxation_length")
    values: dict[str, float | None] = {name: summary.value}
    if summary.kind == "slip_sweep":
        values[name] = summary.value / load
        values["largest_force_per_load"] = summary.details.get("largest_force_N", np.nan) / load
        values["pneumatic_trail"] = summary.details.get("pneumatic_trail_m")
        if summary.details.get("pneumatic_trail_sd_m", 0.0) > LIMITS.trail_sd:
            values["pneumatic_trail"] = None
    unusual = doubts(values)
    (low, high), value, band = POSSIBLE[name], values[name], BANDS[name]
    if value is not None and not low <= value <= high:
        why = suspicion(value, unit=band.unit, typical=band.typical, further=band.slips)
        raise InputError(
            f"{path}: {band.words} is {value:.3g} {band.unit}; a tyre has {low:g} to {high:g}, so a column is in "
            f"another unit than its name states{why}"
        )
    return tuple(doubt.text for doubt in unusual)


def check_repeats(recordings: Sequence[RecordingSummary], label: str) -> None:
    """Refuse to average recordings made on another rim, at another camber or drum, and copies of one recording."""
    for first, second in combinations(recordings, 2):
        for name in ("rim", "drum_radius"):
            values = [getattr(item.condition, name) for item in (first, second)]
            if values[0] != values[1] and None not in values:
                raise InputError(
                    f"{label}: {first.file} and {second.file} differ in {name} ({values[0]} and {values[1]}); "
                    "they are not repeats, so fit them in folders of their own"
                )
        if first.kind == second.kind and _distance(first, second) < LIMITS.copy:
            raise InputError(f"{label}: {first.file} and {second.file} hold the same recording; keep one of them")


def repeat_warnings(recordings: Sequence[RecordingSummary]) -> list[str]:
    """Return warnings of repeats that disagree, of likely copies and of doubtful lateral stiffness tests."""
    warnings = []
    for first, second in combinations(recordings, 2):
        if first.kind != second.kind:
            continue
        if _distance(first, second) < LIMITS.reprint:
            warnings.append(f"{first.file} and {second.file} agree to {LIMITS.reprint:g}: the same recording twice?")
        if first.kind != "slip_step" and abs(first.value / second.value - 1) > LIMITS.spread:
            warnings.append(
                f"{first.file} and {second.file} differ by {100 * abs(first.value / second.value - 1):.1f} %"
            )
    for item in (item for item in recordings if item.kind == "lateral_stiffness"):
        if item.r_squared < 0.98:
            warnings.append(f"{item.file}: the friction loop fits badly (R^2 {item.r_squared:.3f}); did a gauge slip?")
        share = item.details.get("friction_N", 0.0) / item.details.get("largest_force_N", np.inf)
        if share > LIMITS.friction:
            warnings.append(f"{item.file}: friction is {100 * share:.0f} % of the largest force")
    return warnings


class Key(NamedTuple):
    """Tyre, surface, load (N), pressure (Pa) and camber (rad): recordings with one key are repeats."""

    tyre: str  # name
    surface: str  # ``flat`` or ``drum``
    load: float  # N
    pressure: float  # Pa
    camber: float = 0.0  # rad, positive to the right

    def __str__(self) -> str:
        """Write it in the units of the field, camber only if there is one."""
        camber = f", camber {np.rad2deg(self.camber):.4g} deg" if self.camber else ""
        return f"{self.tyre}, {self.load:g} N, {self.pressure / PASCAL_PER_BAR:g} bar{camber}"


def near_conditions(keys: Iterable[Key]) -> dict[Key, str]:
    """Return a warning for every condition so close to another that they were perhaps meant to be one."""
    warnings = {}
    for first, second in combinations(sorted(Key(*key) for key in keys), 2):
        if (first.tyre.casefold(), first.surface, first.camber) == (
            second.tyre.casefold(),
            second.surface,
            second.camber,
        ) and (all(abs(a / b - 1) < LIMITS.near for a, b in zip(first[2:4], second[2:4], strict=True))):
            warnings[first] = warnings[second] = (
                f"nearly the same condition is taken as two: {first} and {second}; if it is one, declare the same load "
                "and pressure in their sidecars"
            )
    return warnings


def _distance(first: RecordingSummary, second: RecordingSummary) -> float:
    """Largest relative difference, 0 to 1, of value, its sd, R^2 and the sd of the residuals of two fits."""
    pairs = [(first.value, second.value), (first.fit_sd, second.fit_sd), (first.r_squared, second.r_squared)]
    if "residual_sd_N" in first.details:
        pairs.append((first.details["residual_sd_N"], second.details["residual_sd_N"]))
    return max(abs(a - b) / max(abs(a), abs(b), 1e-300) for a, b in pairs)


@dataclass(frozen=True)
class ConditionResult:
    """One tyre at one load (N), pressure (Pa), camber (rad) and surface; None where it was not measured."""

    tyre: str  # name
    surface: str  # ``flat`` or ``drum``
    load: float  # N, rounded as :func:`condition_key` does
    pressure: float  # Pa, likewise
    camber: float  # rad, positive to the right, likewise
    drum_radius: float | None  # m; None on a flat track
    cornering_stiffness: Estimate | None  # C_alpha, N/rad
    lateral_stiffness: Estimate | None  # K_y, N/m
    relaxation_length: Estimate | None  # C_alpha / K_y, m
    covariance: NDArray[np.float64] | None  # (3, 3), of (C_alpha, K_y, C_alpha / K_y) in N/rad, N/m and m
    r_squared: float | None  # mean of the sweeps'
    pneumatic_trail: Estimate | None  # m, at zero slip; the lateral force acts behind the contact centre
    routes: (
        Agreement | None
    )  # test of C_alpha/K_y and the ``direct`` routes against each other; None with fewer than two
    direct: dict[str, Estimate]  # relaxation length, m, by its route: ``two sweep rates``, ``slip step``
    borrowed_stiffness: bool  # True: K_y is that of the flat track, or of the upright wheel
    scatter: dict[str, float]  # relative standard deviation of the repeats, by the kind of recording that has any
    synthetic: bool  # True if a program computed one of the recordings
    sweeps: tuple[RecordingSummary, ...]  # sorted by file, as ``pulls`` and ``steps``
    pulls: tuple[RecordingSummary, ...]  # those that K_y is from, borrowed or not
    steps: tuple[RecordingSummary, ...]  # of this condition
    warnings: tuple[str, ...]  # sentences, in the order in which they arose
    # dFy/d(camber) at zero slip, N/rad, from the sweeps at all cambers of this load and pressure
    camber_stiffness: Estimate | None = None
    # N m/rad, likewise: dMz/d(camber) less -t dFy/d(camber), t the pneumatic trail
    twisting_stiffness: Estimate | None = None

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the recordings behind it, sorted."""
        return tuple(sorted(item.file for item in (*self.sweeps, *self.pulls, *self.steps)))

    @property
    def label(self) -> str:
        """Tyre, surface, load, pressure and camber in the units of the field."""
        key = Key(f"{self.tyre}, {self.surface}", "", self.load, self.pressure, self.camber)
        return str(key)


def condition_key(summary: RecordingSummary) -> Key:
    """Round a condition to 0.1 N, 0.001 bar and 0.1 deg: recordings with one key are repeats."""
    condition = summary.condition
    camber = float(np.deg2rad(round(np.rad2deg(condition.camber), 1))) + 0.0
    pressure = round(condition.pressure / 100.0) * 100.0
    return Key(condition.tyre, condition.surface, round(condition.load, 1), pressure, camber)


def combine(
    key: Key,
    recordings: Sequence[RecordingSummary],
    *,
    borrowed: Sequence[RecordingSummary],
    sweep_repeatability: Repeatability,
    pull_repeatability: Repeatability,
    calibration: Calibration,
    further_warnings: Sequence[str] = (),
) -> ConditionResult:
    """Combine the recordings of one condition into its stiffnesses, relaxation lengths by every route, and warnings.

    ``borrowed`` are the lateral stiffness tests of the flat track for a drum without its own.
    """
    sweeps, pulls, steps = (
        tuple(sorted((item for item in recordings if item.kind == kind), key=lambda item: item.file))
        for kind in ("slip_sweep", "lateral_stiffness", "slip_step")
    )
    warnings = [*further_warnings, *repeat_warnings(recordings)]
    for item in (*sweeps, *pulls, *steps):
        warnings += [f"{item.file}: {note}" for note in item.notes if note not in SYNTHETIC_NOTES]
    is_borrowed = not pulls and bool(borrowed)
    if is_borrowed:
        pulls = tuple(sorted(borrowed, key=lambda item: item.file))
        others = {"drum": "flat track (no lateral stiffness test on the drum)"}
        where = others.get(key.surface, "upright wheel (no lateral stiffness test at camber)")
        warnings.append(f"lateral stiffness is that of the {where}")
    c = _mean(sweeps, sweep_repeatability, "cornering stiffness", warnings)
    k = _mean(pulls, pull_repeatability, "lateral stiffness", warnings)
    if c is None:
        warnings.append("no slip sweep: cornering stiffness unknown")
    if k is None:
        warnings.append("no lateral stiffness test: lateral stiffness and relaxation length unknown")
    length, covariance = None, None
    if c is not None and k is not None:
        length, covariance = relaxation_from_stiffness(
            cornering_stiffness=c, lateral_stiffness=k, calibration=calibration
        )
    stepped = mean_of_steps(steps, sweeps, repeatability=calibration.repeatability)
    ways = {"two sweep rates": relaxation_from_two_rates(sweeps), "slip step": stepped}
    direct = {way: length for way, length in ways.items() if length is not None}
    routes = agreement(({"C_α/K_y": length} if length is not None else {}) | direct)
    scatter = {
        repeats[0].kind: _relative_scatter([item.value for item in repeats])
        for repeats in (sweeps, pulls, steps)
        if len(repeats) > 1
    }
    return ConditionResult(
        **key._asdict(),
        drum_radius=next((item.condition.drum_radius for item in recordings), None),
        cornering_stiffness=_with_calibration(c, calibration.force, calibration.slip),
        lateral_stiffness=_with_calibration(k, calibration.force, calibration.displacement),
        relaxation_length=length,
        covariance=covariance,
        r_squared=float(np.mean([item.r_squared for item in sweeps])) if sweeps else None,
        pneumatic_trail=_trail(sweeps),
        routes=routes,
        direct=direct,
        borrowed_stiffness=is_borrowed,
        scatter=scatter,
        synthetic=any(item.synthetic for item in (*sweeps, *pulls, *steps)),
        sweeps=sweeps,
        pulls=pulls,
        steps=steps,
        warnings=tuple(warnings),
    )


def _relative_scatter(values: Sequence[float]) -> float:
    """Standard deviation of two or more ``values`` over their mean, no unit."""
    return float(np.std(values, ddof=1) / np.mean(values))


def _mean(
    items: Sequence[RecordingSummary], repeatability: Repeatability, name: str, warnings: list[str]
) -> Estimate | None:
    """Mean of the repeats' values, in their unit, with its sd from fits and scatter, without calibration; None of none.

    What a reader must know of the scatter is added to ``warnings``.
    """
    if not items:
        return None
    values = np.array([item.value for item in items])
    mean, count = float(values.mean()), values.size
    sd, dof = repeatability.sd, repeatability.dof
    fit_sd = float(np.sqrt(np.mean([(item.fit_sd / item.value) ** 2 for item in items])))
    if not repeatability.measured:
        warnings.append(f"{name}: no repeats in this campaign; {100 * sd:.1f} % per recording is assumed, not measured")
        sd, dof = combine_uncertainties([(sd, dof), (fit_sd, np.inf)])
        return Estimate(mean, mean * sd / np.sqrt(count), dof)
    if repeatability.refuted:
        warnings.append(
            f"{name}: the campaign's repeats scatter by {100 * repeatability.scatter:.2f} %, more than the stated "
            "repeatability allows; their scatter alone is used"
        )
    sd = max(sd, fit_sd)  # of a recording noisier than the campaign's others
    if count > 2:
        scatter = float(np.std(values, ddof=1)) / mean
        if fdtrc(count - 1, dof, (scatter / sd) ** 2) < 0.01:
            warnings.append(
                f"{name}: repeats scatter by {100 * scatter:.2f} %, more than the campaign's {100 * sd:.2f} %; "
                "their own scatter is used"
            )
            sd, dof = scatter, float(count - 1)
    return Estimate(mean, mean * sd / np.sqrt(count), dof)


def _with_calibration(estimate: Estimate | None, force: float, sensor: float) -> Estimate | None:
    """Widen the sd of a stiffness by the relative sd of the gains of the load cell and of the other ``sensor``."""
    if estimate is None:
        return None
    certificate = float(np.hypot(force, sensor)) * estimate.value
    sd, dof = combine_uncertainties([(estimate.sd, estimate.dof), (certificate, np.inf)])
    return replace(estimate, sd=sd, dof=dof)


def _trail(sweeps: Sequence[RecordingSummary]) -> Estimate | None:
    """Mean pneumatic trail (m) over the sweeps that have one: the sd of their fits weighed against their scatter."""
    details = [item.details for item in sweeps if "pneumatic_trail_m" in item.details]
    if not details:
        return None
    values = np.array([fit["pneumatic_trail_m"] for fit in details])
    fit_sd = float(np.sqrt(np.mean([fit["pneumatic_trail_sd_m"] ** 2 for fit in details])))
    count = len(values)
    if count == 1:
        return Estimate(float(values[0]), fit_sd)
    sd, dof = weighed_scatter(fit_sd, float(np.sum((values - values.mean()) ** 2)), count - 1.0)
    # two or three fits agree by chance more closely than each is known
    return Estimate(float(values.mean()), max(sd, fit_sd) / np.sqrt(count), dof)


def with_agreement(conditions: Sequence[ConditionResult]) -> list[ConditionResult]:
    """Judge the routes to the relaxation length of all ``conditions`` together, and warn of those that disagree."""
    tests, judged = sum(c.routes is not None for c in conditions), []
    for c in conditions:
        routes = c.routes and replace(c.routes, tests=tests)
        disagree = "" if routes is None or routes.agree else routes.sentence
        further = [f"routes to the relaxation length disagree: {disagree}"] if disagree else []
        judged.append(replace(c, routes=routes, warnings=(*c.warnings, *further)))
    return judged


def with_load_trend(conditions: Sequence[ConditionResult]) -> list[ConditionResult]:
    """Warn of lateral stiffnesses that change with the load more than those of tyres do, by two standard deviations."""
    warnings: dict[str, list[str]] = {}
    for lighter, heavier in combinations(sorted(conditions, key=lambda c: c.load), 2):
        alike = all(
            getattr(lighter, name) == getattr(heavier, name) for name in ("tyre", "surface", "pressure", "camber")
        )
        first, second = lighter.lateral_stiffness, heavier.lateral_stiffness
        if not alike or lighter.borrowed_stiffness or first is None or second is None or heavier.load <= lighter.load:
            continue
        loads = math.log(heavier.load / lighter.load)
        exponent = math.log(second.value / first.value) / loads
        doubt = 2.0 * math.hypot(first.sd / first.value, second.sd / second.value) / loads
        low, high = LIMITS.by_load
        if not low - doubt <= exponent <= high + doubt:
            text = (
                f"lateral stiffness changes from {1e-3 * first.value:.1f} N/mm at {lighter.load:g} N to "
                f"{1e-3 * second.value:.1f} N/mm at {heavier.load:g} N, as load^{exponent:.1f}; usual are "
                f"load^{low:g} to load^{high:g}: check the lateral stiffness tests at both loads"
            )
            for condition in (lighter, heavier):
                warnings.setdefault(condition.label, []).append(text)
    return [replace(c, warnings=(*c.warnings, *warnings.get(c.label, []))) for c in conditions]


def keep_upright(conditions: Sequence[ConditionResult]) -> list[ConditionResult]:
    """Keep the conditions at the smallest camber that a tyre was run at on its surface: the others are of no map."""
    least: dict[tuple[str, str], float] = {}
    for c in conditions:
        least[c.tyre, c.surface] = min(abs(c.camber), least.get((c.tyre, c.surface), np.inf))
    return [c for c in conditions if np.isclose(abs(c.camber), least[c.tyre, c.surface], atol=1e-9)]


def with_camber(conditions: Sequence[ConditionResult], calibration: Calibration) -> list[ConditionResult]:
    """Give each condition the slopes over camber of those that differ from it in nothing else, if there are several.

    The scatter about the straight lines of all conditions is pooled, and weighed against the sd of the single fits.
    """
    groups: dict[Key, list[ConditionResult]] = {}
    for c in conditions:
        groups.setdefault(Key(c.tyre, c.surface, c.load, c.pressure), []).append(c)
    rows = {  # by the measured camber, as the nominal one is rounded
        key: [(item.details.get("camber_rad", c.camber), item.details) for c in alike for item in c.sweeps]
        for key, alike in groups.items()
        if len({c.camber for c in alike if c.sweeps}) > 1
    }
    forces = _slopes(rows, "force_at_zero{}_N", calibration.force)
    moments = _slopes(rows, "moment_at_zero{}_N_m", 0.0)
    twisting: dict[Key, Estimate] = {}
    for key in forces.keys() & moments.keys():
        upright_first = sorted(groups[key], key=lambda c: abs(c.camber))
        trail = next((c.pneumatic_trail for c in upright_first if c.pneumatic_trail), None)
        if trail is not None:
            force, moment = forces[key], moments[key]
            parts = [
                (moment.sd, moment.dof),
                (abs(trail.value) * force.sd, force.dof),
                (abs(force.value) * trail.sd, trail.dof),
            ]
            twisting[key] = Estimate(moment.value + trail.value * force.value, *combine_uncertainties(parts))
    keys = [Key(c.tyre, c.surface, c.load, c.pressure) for c in conditions]
    return [
        replace(c, camber_stiffness=forces.get(key), twisting_stiffness=twisting.get(key))
        for c, key in zip(conditions, keys, strict=True)
    ]


def combine_campaign(
    summaries: Sequence[RecordingSummary], settings: FitSettings, *, where: str
) -> tuple[list[ConditionResult], Repeatability, Repeatability]:
    """Combine the recordings of a campaign by condition, with the repeatability of either test."""
    groups: dict[Key, list[RecordingSummary]] = {}
    for summary in summaries:
        groups.setdefault(condition_key(summary), []).append(summary)
    for key, group in groups.items():
        check_repeats(group, f"{where}: {key}, {key.surface}")
    near_warnings, floor = near_conditions(groups), settings.calibration.repeatability
    sweeps, pulls = (
        pooled_repeatability([[item for item in group if item.kind == kind] for group in groups.values()], floor=floor)
        for kind in ("slip_sweep", "lateral_stiffness")
    )
    conditions = []
    for key in sorted(groups, key=lambda k: (k.tyre, k.surface != "flat", k.surface, k.pressure, k.load, k.camber)):
        flat = groups.get(key._replace(surface="flat"), []) if key.surface == "drum" else []
        conditions.append(
            combine(
                key,
                groups[key],
                borrowed=[item for item in flat if item.kind == "lateral_stiffness"],
                sweep_repeatability=sweeps,
                pull_repeatability=pulls,
                calibration=settings.calibration,
                further_warnings=[near_warnings[key]] if key in near_warnings else [],
            )
        )
    return with_load_trend(with_agreement(with_camber(conditions, settings.calibration))), sweeps, pulls


def _slopes(
    groups: Mapping[Key, Sequence[tuple[float, dict[str, float]]]], name: str, gain: float
) -> dict[Key, Estimate]:
    """Weighted straight lines over camber of what the fits call ``name``, with a relative uncertainty ``gain``."""
    lines: dict[Key, tuple[float, float]] = {}
    squares, spare = 0.0, 0.0
    for key, rows in groups.items():
        points = [(camber, d[name.format("")], d[name.format("_sd")]) for camber, d in rows if name.format("") in d]
        camber, value, sd = np.array(points or np.zeros((1, 3))).T
        if np.ptp(camber) < TOLERANCES["camber"].absolute:  # some have no moment
            continue
        sd = np.maximum(np.nan_to_num(sd), 1e-9 * np.ptp(value) + 1e-300)
        design = np.column_stack([np.ones_like(camber), camber]) / sd[:, None]
        line, *_ = np.linalg.lstsq(design, value / sd, rcond=None)
        squares += float(np.sum((design @ line - value / sd) ** 2))
        spare += len(points) - 2.0
        lines[key] = float(line[1]), float(np.sqrt(np.linalg.inv(design.T @ design)[1, 1]))
    factor, dof = weighed_scatter(1.0, squares, spare) if spare else (1.0, REPEATABILITY_DOF)
    return {
        key: Estimate(slope, *combine_uncertainties([(factor * sd, dof), (gain * abs(slope), np.inf)]))
        for key, (slope, sd) in lines.items()
    }
