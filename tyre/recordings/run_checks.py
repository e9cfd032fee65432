"""Pre-flight of a recording: what is there, what is missing, what will spoil the fit, before anything is fitted."""

from dataclasses import dataclass, field

import numpy as np

from tyre.ground.units import PASCAL_PER_BAR
from tyre.recordings.recording import CONVENTIONS, Channel, LateralStiffnessTest, RigRun, slope_grows
from tyre.recordings.signal_quality import runs

_DEGREE = np.pi / 180.0
LOAD_TOLERANCE = 0.05  # of the declared load: the stiffness would be that of another load


@dataclass(frozen=True)
class Tolerance:
    """Width of one condition in a quantity: ``relative`` of its level or ``absolute`` (SI), whichever is more.

    It is shown in a ``unit`` of ``size`` (SI), and a level that lies within a tenth of the width is a multiple of the
    first fitting one of ``steps`` of that unit.
    """

    channel: str  # name of the channel of a recording that holds the quantity
    relative: float
    absolute: float
    unit: str
    size: float = 1.0
    steps: tuple[float, ...] = ()
    widened: float = 1.25  # widths, beyond which a sample is outside of a condition
    beyond: float = 0.1  # share of a recording that may lie there

    def width(self, level: float) -> float:
        """Distance from ``level`` within which a sample belongs to it, SI."""
        return max(self.relative * abs(level), self.absolute)

    def nominal(self, level: float) -> float:
        """The round value that was meant by a measured ``level``, SI; 0 if it is no wider apart than the width."""
        if abs(level) <= self.absolute:
            return 0.0
        level_in_unit, width = level / self.size, self.width(level) / self.size
        rounded = (step * round(level_in_unit / step) for step in self.steps)
        nearest = next((value for value in rounded if abs(value - level_in_unit) <= 0.1 * width), None)
        return self.size * (float(f"{level_in_unit:.4g}") if nearest is None else nearest) + 0.0

    def outside(self, channel: Channel) -> float:
        """Share of a channel, by the means of its parts, that lies beyond a widened width about its median."""
        median = float(np.nanmedian(channel))
        return float(np.mean(np.abs(part_means(channel) - median) > self.widened * self.width(median)))


TOLERANCES = {
    "load": Tolerance("vertical_load", LOAD_TOLERANCE, 0.0, "N", 1.0, (50.0, 10.0, 5.0, 1.0)),
    "pressure": Tolerance("pressure", 0.03, 0.0, "bar", PASCAL_PER_BAR, (0.5, 0.1, 0.05)),
    "camber": Tolerance("inclination", 0.0, 0.5 * _DEGREE, "deg", _DEGREE, (1.0, 0.5, 0.1)),
}
"""Width of the load, pressure and camber that are treated as one condition."""


@dataclass(frozen=True)
class _Limits:
    """Limits of a sound recording."""

    least_slip: float = 1.0  # deg; below it there is no slope worth a number
    good_slip: float = 3.0  # deg; below it the curvature, and with it the slope, is biased
    good_branches: int = 4  # two full cycles: the least that shows repeatability
    load_drift: float = 0.02  # of the declared load
    speed_offset: float = 0.10  # of the declared speed
    speed_spread: float = 0.05  # of the median speed, 1 sd
    temperature_drift: float = 10.0  # K
    correlation: float = 0.5  # of lateral force and slip or displacement
    stuck_slip: float = 0.2  # deg; travel that cannot leave a live lateral force unchanged
    least_pull: float = 0.3e-3  # m
    gauge_steps: int = 20  # steps of the displacement gauge that a pull covers at least
    pull_samples: int = 8  # complete samples that a pull holds at least
    rim_share: float = 0.5  # of the displacement of the plate
    gap: float = 5.0  # usual steps of time
    missing_share: float = 0.2  # of the samples of a channel
    coarse: float = 0.02  # of a step of a gauge, by which a reading may be off a multiple
    finest: float = 5e-7  # m; no dial gauge is read more finely


_LIMITS = _Limits()


@dataclass
class Preflight:
    """Verdict on one recording: what is there, what is missing and cannot be had without it, what is wrong."""

    source: str  # file, or kind of recording
    present: list[str] = field(default_factory=list)  # what the recording holds, a phrase each
    missing: list[str] = field(default_factory=list)  # what it lacks, and what cannot be had without, a phrase each
    problems: list[str] = field(default_factory=list)  # what is wrong, a phrase each
    usable: bool = True  # False if a problem forbids a fit

    def forbids(self, text: str) -> None:
        """Note a problem that forbids a fit."""
        self.problems.append(text)
        self.usable = False


def preflight(recording: RigRun | LateralStiffnessTest, *, load_tolerance: float = LOAD_TOLERANCE) -> Preflight:
    """Examine a recording; a median load farther than ``load_tolerance`` from the declared one forbids a fit."""
    condition = recording.condition
    surface = f"drum of {condition.drum_radius:g} m radius" if condition.drum_radius else "flat track"
    rolling = isinstance(recording, RigRun)
    verdict = Preflight(
        str(recording.source or (recording.kind if isinstance(recording, RigRun) else "lateral_stiffness"))
    )
    verdict.present.append(
        f"{'SYNTHETIC, ' if recording.synthetic else ''}{condition.tyre}, {condition.load:g} N, "
        f"{condition.pressure / PASCAL_PER_BAR:g} bar, {surface}, {recording.axes} axes"
    )
    needed = ("time", "slip_angle", "lateral_force", "vertical_load") if rolling else _PULL_CHANNELS
    empty = [name for name in needed if np.isfinite(getattr(recording, name)).sum() < 2]
    for name in empty:
        verdict.forbids(f"{name} has no valid samples")
    if not empty and isinstance(recording, RigRun):
        _check_rolling(verdict, recording, load_tolerance)
    elif not empty and isinstance(recording, LateralStiffnessTest):
        _check_pull(verdict, recording)
    return verdict


_PULL_CHANNELS = ("lateral_force", "plate_displacement", "rim_displacement")


def _check_rolling(verdict: Preflight, run: RigRun, load_tolerance: float) -> None:
    _check_time(verdict, run.time)
    for name in ("slip_angle", "lateral_force", "vertical_load"):
        _check_dropouts(verdict, name, getattr(run, name))
    if run.aligning_moment is not None:
        _check_dropouts(verdict, "aligning_moment", run.aligning_moment, needed=False)
    _check_stuck(verdict, run.lateral_force, run.slip_angle, travel=_LIMITS.stuck_slip * _DEGREE)
    _check_load(verdict, run, load_tolerance)
    _check_condition(verdict, run)
    _check_drifts(verdict, run)
    span = f"{len(run.time)} samples over {np.nanmax(run.time) - np.nanmin(run.time):.4g} s"
    lowest, highest = float(np.nanmin(run.slip_angle)), float(np.nanmax(run.slip_angle))
    reach = f"slip {lowest / _DEGREE:.3g} to {highest / _DEGREE:.3g} deg"
    if run.kind == "steady":
        verdict.present.append(f"{len(run.time)} settled points, {reach}")
        _check_reach(verdict, lowest, highest)
    elif run.kind == "slip_sweep":
        branches = _count_branches(run.slip_angle)
        verdict.present.append(f"{span}, {branches} branches (up or down) of {reach}")
        _check_sweeps(verdict, lowest, highest, branches)
    else:
        verdict.present.append(f"{span}, a slip step, {reach}")
        if highest - lowest < _LIMITS.least_slip * _DEGREE / 2:
            verdict.forbids(f"the slip step is only {(highest - lowest) / _DEGREE:.2g} deg")
    _check_sign(verdict, run)
    if run.aligning_moment is None:
        verdict.missing.append("aligning moment: no pneumatic trail")
    if run.speed is None and run.condition.speed is None and run.kind != "steady":
        verdict.missing.append(
            "speed: without it the rate lag cannot be removed, and rates or steps give no relaxation length"
        )
    if run.temperature is None and run.condition.temperature is None:
        verdict.missing.append("temperature: its drift and wear are not separable")


def _check_sweeps(verdict: Preflight, lowest: float, highest: float, branches: int) -> None:
    """Check the range of slip (rad), and the number of branches."""
    _check_reach(verdict, lowest, highest)
    if branches < 2:
        verdict.problems.append(
            f"too few sweeps: {branches} branch, an up and a down branch are needed to remove the rate lag"
        )
    elif branches < _LIMITS.good_branches:
        more = f"{_LIMITS.good_branches} or more would"
        verdict.problems.append(f"too few sweeps: {branches} branches show no repeatability, {more}")


def _check_reach(verdict: Preflight, lowest: float, highest: float) -> None:
    """Check the range of slip, rad."""
    least, good, half = _LIMITS.least_slip, _LIMITS.good_slip, (highest - lowest) / 2
    reach = half / _DEGREE
    if half < least * _DEGREE:
        radians = " (radians under deg?)" if least * _DEGREE <= reach <= 20.0 * _DEGREE else ""
        verdict.forbids(f"slip range is +-{reach:.2g} deg, at least +-{least:g} deg are needed{radians}")
    elif lowest > -0.25 * highest or highest < -0.25 * lowest:
        verdict.problems.append("slip to one side only: offset and slope are not separable")
    elif half < good * _DEGREE:
        verdict.problems.append(f"slip range is +-{reach:.2g} deg, curvature shows only beyond +-{good:g} deg")


def _check_sign(verdict: Preflight, run: RigRun) -> None:
    share = 1.0 if run.kind == "slip_step" else 0.5  # the slope near zero; a step has only its two ends
    widest = float(np.nanmax(np.abs(run.slip_angle)))
    inner = np.abs(run.slip_angle) <= max(share * widest, _LIMITS.least_slip * _DEGREE)
    gradient, correlation = _slope(run.slip_angle[inner], run.lateral_force[inner])
    if np.isnan(gradient) or abs(correlation) < _LIMITS.correlation:
        verdict.problems.append(f"lateral force does not follow the slip (correlation {correlation:.2f})")
    elif gradient < 0.0:
        fitting = [name for name in CONVENTIONS if slope_grows(name) != slope_grows(run.axes)]
        verdict.forbids(
            f"wrong sign: lateral force falls with slip ({gradient * _DEGREE:.3g} N/deg) under axes = {run.axes!r}; "
            f"axes = {' or '.join(map(repr, fitting))} fits"
        )
    elif run.aligning_moment is not None and _slope(run.slip_angle[inner], run.aligning_moment[inner])[0] > 0.0:
        verdict.problems.append("wrong sign: aligning moment grows with slip, the pneumatic trail is negative")


def _check_load(verdict: Preflight, run: RigRun, tolerance: float) -> None:
    declared, median = run.condition.load, float(np.nanmedian(run.vertical_load))
    offset = median / declared - 1.0
    text = f"median vertical load is {median:.4g} N, {offset:+.1%} off the declared {declared:g} N"
    if abs(offset) > tolerance:
        remedy = "declare the load that acted, or raise the load tolerance"
        verdict.forbids(f"{text}; at most {tolerance:.0%} is allowed: {remedy}")
    elif abs(offset) > LOAD_TOLERANCE:
        verdict.problems.append(text)
    drift = _drift(run.vertical_load) / declared
    if abs(drift) > _LIMITS.load_drift:
        verdict.problems.append(f"vertical load drifts by {drift:+.1%} over the recording")


def _check_condition(verdict: Preflight, run: RigRun) -> None:
    """Hold the measured pressure and camber against the declared ones, and forbid what scatters over conditions."""
    for name, tolerance in TOLERANCES.items():
        channel: Channel | None = getattr(run, tolerance.channel)
        if channel is None or not np.isfinite(channel).any():
            continue
        declared, median = getattr(run.condition, name) / tolerance.size, float(np.nanmedian(channel)) / tolerance.size
        width = tolerance.width(tolerance.size * median) / tolerance.size
        if name != "load" and abs(median - declared) > width:
            verdict.forbids(
                f"median {name} is {median:.4g} {tolerance.unit}, declared are {declared:.4g} {tolerance.unit}, off by "
                f"more than {width:.2g}: declare what acted, or leave it to the channel"
            )
        if (share := tolerance.outside(channel)) > tolerance.beyond:
            wide, unit = tolerance.widened * width, tolerance.unit
            verdict.forbids(
                f"{name} scatters: {share:.0%} of the recording lies more than {wide:.3g} {unit} from its median "
                f"{median:.4g} {unit}, which is more than one condition; cut the recording with [[windows]]"
            )


def part_means(channel: Channel) -> Channel:
    """Means of about a hundred equal parts of a channel, without those that have no sample."""
    edges = np.arange(0, channel.size, max(channel.size // 100, 5))
    is_sample = np.isfinite(channel)
    number = np.add.reduceat(is_sample.astype(float), edges)
    total = np.add.reduceat(np.where(is_sample, channel, 0.0), edges)
    return np.asarray(total[number > 0] / number[number > 0])


def _check_drifts(verdict: Preflight, run: RigRun) -> None:
    if run.temperature is not None and abs(_drift(run.temperature)) > _LIMITS.temperature_drift:
        verdict.problems.append(f"temperature drifts by {_drift(run.temperature):+.3g} K over the recording")
    if run.speed is None:
        return
    middle, spread, declared = float(np.nanmedian(run.speed)), float(np.nanstd(run.speed)), run.condition.speed
    if middle <= 0.0:
        verdict.forbids(f"speed is {middle:.3g} m/s: the tyre does not roll forward")
    elif spread > _LIMITS.speed_spread * middle:
        verdict.problems.append(f"speed varies by {spread / middle:.1%} (one standard deviation)")
    if declared and abs(middle / declared - 1.0) > _LIMITS.speed_offset:
        verdict.problems.append(f"speed is {middle * 3.6:.3g} km/h, declared are {declared * 3.6:.3g} km/h")


def _drift(channel: Channel) -> float:
    """Change of a channel from its first to its last sixth, by medians."""
    sixth = max(len(channel) // 6, 1)
    ends = channel[:sixth], channel[-sixth:]
    if any(np.isnan(end).all() for end in ends):
        return 0.0
    return float(np.nanmedian(ends[1]) - np.nanmedian(ends[0]))


def _check_pull(verdict: Preflight, test: LateralStiffnessTest) -> None:
    if test.time is not None:
        _check_time(verdict, test.time)
    for name in _PULL_CHANNELS:
        _check_dropouts(verdict, name, getattr(test, name))
    complete = test.complete
    if complete.sum() < _LIMITS.pull_samples:
        verdict.forbids(f"only {complete.sum()} complete samples, {_LIMITS.pull_samples} are needed")
        return
    deflection = test.tyre_deflection
    plate, rim, travel = (
        float(np.ptp(x[complete])) for x in (test.plate_displacement, test.rim_displacement, deflection)
    )
    if plate == 0.0:
        verdict.forbids(
            f"plate_displacement stays at {1e3 * test.plate_displacement[complete][0]:.4g} mm: its gauge is dead"
        )
        return
    if travel < _LIMITS.least_pull:
        verdict.forbids(f"tyre deflection covers {travel * 1e3:.2g} mm, {_LIMITS.least_pull * 1e3:g} mm are needed")
    elif travel < _LIMITS.gauge_steps * reading_step(test.plate_displacement[complete]):
        verdict.problems.append(f"tyre deflection covers fewer than {_LIMITS.gauge_steps} steps of the gauge")
    _check_stuck(verdict, test.lateral_force, deflection, travel=0.1 * travel)
    gradient, correlation = _slope(deflection, test.lateral_force)
    if gradient < 0.0:
        verdict.forbids("wrong sign: lateral force falls with displacement; turn the sign of one of the two")
    elif abs(correlation) < _LIMITS.correlation:
        verdict.problems.append(f"lateral force does not follow the displacement (correlation {correlation:.2f})")
    if rim > _LIMITS.rim_share * plate:
        verdict.problems.append(
            f"the rim takes {rim / plate:.0%} of the plate's displacement: the tyre is hardly deflected"
        )
    verdict.present.append(f"{len(test.lateral_force)} samples, tyre deflection over {travel * 1e3:.3g} mm")
    if not rim:
        stays = 1e3 * test.rim_displacement[complete][0]
        verdict.missing.append(f"rim displacement: {stays:.4g} mm throughout, the rim is taken as rigid")
    back = np.abs(deflection[int(np.nanargmax(np.abs(deflection))) :])
    if float(np.nanmin(back)) > 0.8 * float(np.nanmax(back)):
        verdict.missing.append("unloading: friction and stiffness are not separable")


def reading_step(displacement: Channel) -> float:
    """Find the resolution of a gauge: the step (m) that all its readings are multiples of; 0 if none is visible."""
    values = np.unique(np.round(displacement, 9))
    if values.size < 2:
        return 0.0
    step = float(np.min(np.diff(values)))
    count = values / step
    if step < _LIMITS.finest or np.max(np.abs(count - np.round(count))) > _LIMITS.coarse:
        return 0.0
    pulled = np.abs(np.diff(displacement)) / step
    return 0.0 if np.all(np.abs(pulled - 1.0) <= _LIMITS.coarse) else step


def _check_time(verdict: Preflight, time: Channel) -> None:
    if np.isnan(time).any():
        verdict.forbids(f"time is missing in {np.count_nonzero(np.isnan(time))} samples; remove these rows")
        return
    steps = np.diff(time)
    backward, gaps = np.flatnonzero(steps <= 0.0), np.flatnonzero(steps > _LIMITS.gap * np.median(steps))
    if backward.size:
        first = int(backward[0])
        verdict.forbids(
            f"time does not increase at {backward.size} samples, first at sample {first + 2} "
            f"({time[first]:g} s, then {time[first + 1]:g} s); sort or cut the recording"
        )
    elif gaps.size:
        noun = "gap" if gaps.size == 1 else "gaps"
        verdict.problems.append(
            f"{gaps.size} {noun} in time, the first of {steps[gaps[0]]:.3g} s after {time[gaps[0]]:g} s"
        )


def _check_dropouts(verdict: Preflight, name: str, channel: Channel, *, needed: bool = True) -> None:
    missing = np.isnan(channel)
    if missing.any():
        starts, lengths = runs(missing)
        say = verdict.forbids if needed and missing.mean() > _LIMITS.missing_share else verdict.problems.append
        say(
            f"{name} has {np.count_nonzero(missing)} missing samples ({missing.mean():.1%}), the longest run of "
            f"{lengths.max()} from sample {starts[lengths.argmax()] + 1}"
        )


def _check_stuck(verdict: Preflight, force: Channel, mover: Channel, *, travel: float) -> None:
    """Forbid stretches where the lateral force repeats one value while ``mover`` travels: saturated, else frozen."""
    ends, stuck = (np.nanmin(force), np.nanmax(force)), {True: 0, False: 0}
    for start, length in zip(*runs(np.diff(force) == 0.0), strict=True):
        stretch = mover[start : start + length + 1]
        if length >= 4 and np.isfinite(stretch).any() and np.nanmax(stretch) - np.nanmin(stretch) >= travel:
            stuck[force[start] in ends] += int(length) + 1
    if stuck[True]:
        verdict.forbids(f"lateral_force is saturated: {stuck[True]} samples stay at its extreme values")
    if stuck[False]:
        verdict.forbids(f"lateral_force is frozen: {stuck[False]} samples repeat one value while the rig moves")


def _count_branches(channel: Channel) -> int:
    """Count the runs of a channel through its whole range; half runs (middle to an end) add up."""
    finite = channel[np.isfinite(channel)]
    if finite.size == 0 or finite.min() == finite.max():
        return 0
    middle, half = (finite.max() + finite.min()) / 2, (finite.max() - finite.min()) / 2
    place = (finite - middle) / half
    zone = np.select([place > 0.5, place < -0.5, np.abs(place) < 0.25], [1, -1, 0], default=9)  # 9: between zones
    zone = zone[zone != 9]
    return int(np.count_nonzero(np.diff(zone))) // 2


def _slope(x: Channel, y: Channel) -> tuple[float, float]:
    """Least-squares slope of ``y`` over ``x`` (n,) and their correlation where both are there; NaN if x is constant."""
    valid = np.isfinite(x) & np.isfinite(y)
    if valid.sum() < 2 or not np.ptp(x[valid]):
        return float("nan"), float("nan")
    (xx, xy), (_, yy) = np.cov(x[valid], y[valid])
    return float(xy / xx), float(xy / np.sqrt(xx * yy)) if yy else 0.0
