"""Pre-flight of a recording: what is there, what is missing, what will spoil the fit, before anything is fitted."""

from dataclasses import dataclass

import numpy as np

from tyre.base.units import PASCAL_PER_BAR
from tyre.recordings.axes import CONVENTIONS, slope_grows
from tyre.recordings.gauge import reading_step
from tyre.recordings.preflight_signal import count_branches, dropouts, slope, stuck, time_faults
from tyre.recordings.recording import Channel, Condition, PullTest, RigRun

_DEGREE = np.pi / 180.0
_SMALLEST_SLIP = 1.0 * _DEGREE  # below it there is no slope worth a number
_GOOD_SLIP = 3.0 * _DEGREE  # below it the curvature, and with it the slope, is biased
_GOOD_BRANCHES = 4  # two full cycles: the least that shows repeatability
LOAD_TOLERANCE = 0.05  # of the declared load: the stiffness would be that of another load
_LOAD_DRIFT = 0.02
_SPEED_OFFSET, _SPEED_SPREAD = 0.10, 0.05
_TEMPERATURE_DRIFT = 10.0
_CORRELATION = 0.5
_STUCK_SLIP = 0.2 * _DEGREE
_SMALLEST_PULL, _GAUGE_STEPS, _PULL_SAMPLES = 0.3e-3, 20, 8
_RIM_SHARE = 0.5

Fault = tuple[str, bool]


@dataclass(frozen=True)
class Preflight:
    """Verdict on one recording.

    Attributes
    ----------
    source : str
        File or kind of the recording.
    present, missing, problems : tuple of str
        What is there; what is not there and what cannot be had without it; what is wrong.
    usable : bool
        False when a problem forbids a fit.
    """

    source: str
    present: tuple[str, ...]
    missing: tuple[str, ...]
    problems: tuple[str, ...]
    usable: bool

    def __str__(self) -> str:
        """Several lines for the terminal."""
        verdict = "usable" if self.usable else "NOT usable"
        parts = [("there", self.present), ("missing", self.missing), ("problem", self.problems)]
        lines = [f"{self.source}: {verdict}", *(f"  {label}: {text}" for label, texts in parts for text in texts)]
        return "\n".join(lines)


def preflight(recording: RigRun | PullTest, *, load_tolerance: float = LOAD_TOLERANCE) -> Preflight:
    """Examine a recording.

    Parameters
    ----------
    recording : RigRun or PullTest
    load_tolerance : float
        Largest distance of the median vertical load from the declared one that allows a fit, relative to the latter.

    Returns
    -------
    Preflight
        Too few sweeps, small or one-sided slip range, drift of load, speed or temperature, dropouts, saturation, wrong
        sign (with the axes that would fit) and a time that runs backward are named in ``problems``.
    """
    present: list[str] = []
    missing: list[str] = []
    empty = [name for name in _needed(recording) if np.isfinite(getattr(recording, name)).sum() < 2]
    if empty:
        faults = [(f"{name} has no valid samples", True) for name in empty]
    elif isinstance(recording, RigRun):
        present, missing, faults = _rolling(recording, load_tolerance)
    else:
        present, missing, faults = _pull(recording)
    kind = recording.kind if isinstance(recording, RigRun) else "pull_test"
    return Preflight(
        source=str(recording.source) if recording.source else kind,
        present=(_describe(recording.condition, recording.axes, synthetic=recording.synthetic), *present),
        missing=tuple(missing),
        problems=tuple(text for text, _ in faults),
        usable=not any(blocking for _, blocking in faults),
    )


def _needed(recording: RigRun | PullTest) -> tuple[str, ...]:
    if isinstance(recording, RigRun):
        return ("time", "slip_angle", "side_force", "vertical_load")
    return ("side_force", "plate_displacement", "rim_displacement")


def _describe(condition: Condition, axes: str, *, synthetic: bool) -> str:
    surface = f"drum of {condition.drum_radius:g} m radius" if condition.drum_radius else "flat track"
    return (
        f"{'SYNTHETIC, ' if synthetic else ''}{condition.tyre}, {condition.load:g} N, "
        f"{condition.pressure / PASCAL_PER_BAR:g} bar, {surface}, {axes} axes"
    )


def _rolling(run: RigRun, load_tolerance: float) -> tuple[list[str], list[str], list[Fault]]:
    faults = time_faults(run.time)
    for name in ("slip_angle", "side_force", "vertical_load"):
        faults += dropouts(name, getattr(run, name))
    if run.aligning_moment is not None:
        faults += [(text, False) for text, _ in dropouts("aligning_moment", run.aligning_moment)]
    faults += stuck("side_force", run.side_force, run.slip_angle, travel=_STUCK_SLIP)
    faults += _load(run, load_tolerance) + _drifts(run)
    span = f"{len(run.time)} samples over {np.nanmax(run.time) - np.nanmin(run.time):.4g} s"
    lowest, highest = float(np.nanmin(run.slip_angle)), float(np.nanmax(run.slip_angle))
    reach = f"slip {lowest / _DEGREE:.3g} to {highest / _DEGREE:.3g} deg"
    if run.kind == "slip_sweep":
        branches = count_branches(run.slip_angle)
        present = [f"{span}, {branches} branches (up or down) of {reach}"]
        faults += _range(lowest, highest) + _branches(branches) + _sign(run)
    else:
        present = [f"{span}, a slip step, {reach}"]
        if highest - lowest < _SMALLEST_SLIP / 2:
            faults.append((f"the slip step is only {(highest - lowest) / _DEGREE:.2g} deg", True))
        faults += _sign(run)
    missing = []
    if run.aligning_moment is None:
        missing.append("aligning moment: no pneumatic trail")
    if run.speed is None and run.condition.speed is None:
        missing.append("speed: the rate lag cannot be removed and no relaxation length be had from rates or steps")
    if run.temperature is None and run.condition.temperature is None:
        missing.append("temperature: its drift cannot be told from wear")
    return present, missing, faults


def _range(lowest: float, highest: float) -> list[Fault]:
    reach = (highest - lowest) / 2
    if reach < _SMALLEST_SLIP:
        text = f"slip range is +-{reach / _DEGREE:.2g} deg, at least +-{_SMALLEST_SLIP / _DEGREE:g} deg are needed"
        text += " (radians under deg?)" * (_SMALLEST_SLIP <= reach / _DEGREE <= 20.0 * _DEGREE)
        return [(text, True)]
    if lowest > -0.25 * highest or highest < -0.25 * lowest:
        return [("slip goes to one side only: offset and slope cannot be told apart", False)]
    if reach < _GOOD_SLIP:
        text = f"slip range is +-{reach / _DEGREE:.2g} deg, curvature shows only beyond +-{_GOOD_SLIP / _DEGREE:g} deg"
        return [(text, False)]
    return []


def _branches(count: int) -> list[Fault]:
    if count < 2:
        return [(f"too few sweeps: {count} branch, an up and a down branch are needed to remove the rate lag", False)]
    if count < _GOOD_BRANCHES:
        return [(f"too few sweeps: {count} branches show no repeatability, {_GOOD_BRANCHES} or more would", False)]
    return []


def _sign(run: RigRun) -> list[Fault]:
    share = 0.5 if run.kind == "slip_sweep" else 1.0  # the slope near zero; a step has only its two ends
    inner = np.abs(run.slip_angle) <= max(share * float(np.nanmax(np.abs(run.slip_angle))), _SMALLEST_SLIP)
    gradient, correlation = slope(run.slip_angle[inner], run.side_force[inner])
    if np.isnan(gradient) or abs(correlation) < _CORRELATION:
        return [(f"side force does not follow the slip (correlation {correlation:.2f})", False)]
    if gradient < 0.0:
        fitting = [name for name in CONVENTIONS if slope_grows(name) != slope_grows(run.axes)]
        text = (
            f"wrong sign: side force falls with slip ({gradient * _DEGREE:.3g} N/deg) under axes = {run.axes!r}; "
            f"axes = {' or '.join(map(repr, fitting))} would fit"
        )
        return [(text, True)]
    if run.aligning_moment is not None and slope(run.slip_angle[inner], run.aligning_moment[inner])[0] > 0.0:
        return [("wrong sign: aligning moment grows with slip, the pneumatic trail would be negative", False)]
    return []


def _load(run: RigRun, tolerance: float) -> list[Fault]:
    faults = []
    median = float(np.nanmedian(run.vertical_load))
    offset = median / run.condition.load - 1.0
    if abs(offset) > min(tolerance, LOAD_TOLERANCE):
        text = f"median vertical load is {median:.4g} N, {offset:+.1%} off the declared {run.condition.load:g} N"
        refused = abs(offset) > tolerance
        more = f"; at most {tolerance:.0%} is allowed: declare the load that acted, or raise the load tolerance"
        faults.append((text + more * refused, refused))
    drift = _drift(run.vertical_load) / run.condition.load
    if abs(drift) > _LOAD_DRIFT:
        faults.append((f"vertical load drifts by {drift:+.1%} over the recording", False))
    return faults


def _drifts(run: RigRun) -> list[Fault]:
    faults = []
    if run.temperature is not None and abs(_drift(run.temperature)) > _TEMPERATURE_DRIFT:
        faults.append((f"temperature drifts by {_drift(run.temperature):+.3g} K over the recording", False))
    if run.speed is not None:
        middle, spread = float(np.nanmedian(run.speed)), float(np.nanstd(run.speed))
        if middle <= 0.0:
            faults.append((f"speed is {middle:.3g} m/s: the tyre does not roll forward", True))
        elif spread > _SPEED_SPREAD * middle:
            faults.append((f"speed varies by {spread / middle:.1%} (one standard deviation)", False))
        declared = run.condition.speed
        if declared and abs(middle / declared - 1.0) > _SPEED_OFFSET:
            faults.append((f"speed is {middle * 3.6:.3g} km/h, declared are {declared * 3.6:.3g} km/h", False))
    return faults


def _drift(channel: Channel) -> float:
    """Change of a channel from its first to its last sixth, by medians."""
    sixth = max(len(channel) // 6, 1)
    ends = channel[:sixth], channel[-sixth:]
    if any(np.isnan(end).all() for end in ends):
        return 0.0
    return float(np.nanmedian(ends[1]) - np.nanmedian(ends[0]))


def _pull(test: PullTest) -> tuple[list[str], list[str], list[Fault]]:
    deflection = test.tyre_deflection
    faults = time_faults(test.time) if test.time is not None else []
    for name in ("side_force", "plate_displacement", "rim_displacement"):
        faults += dropouts(name, getattr(test, name))
    both = np.isfinite(deflection) & np.isfinite(test.side_force)
    if both.sum() < _PULL_SAMPLES:
        return [], [], [*faults, (f"only {both.sum()} complete samples, {_PULL_SAMPLES} are needed", True)]
    plate, rim = float(np.ptp(test.plate_displacement[both])), float(np.ptp(test.rim_displacement[both]))
    if plate == 0.0:
        stays = 1e3 * test.plate_displacement[both][0]
        return [], [], [*faults, (f"plate_displacement stays at {stays:.4g} mm: its gauge is dead", True)]
    travel = float(np.ptp(deflection[both]))
    if travel < _SMALLEST_PULL:
        faults.append((f"tyre deflection covers {travel * 1e3:.2g} mm, {_SMALLEST_PULL * 1e3:g} mm are needed", True))
    elif travel < _GAUGE_STEPS * reading_step(test.plate_displacement[both]):
        faults.append((f"tyre deflection covers fewer than {_GAUGE_STEPS} steps of the gauge", False))
    faults += stuck("side_force", test.side_force, deflection, travel=0.1 * travel)
    gradient, correlation = slope(deflection, test.side_force)
    if gradient < 0.0:
        faults.append(("wrong sign: side force falls with displacement; turn the sign of one of the two", True))
    elif abs(correlation) < _CORRELATION:
        faults.append((f"side force does not follow the displacement (correlation {correlation:.2f})", False))
    if rim > _RIM_SHARE * plate:
        faults.append(
            (f"the rim takes {rim / plate:.0%} of the plate's displacement: the tyre is hardly deflected", False)
        )
    present = [f"{len(test.side_force)} samples, tyre deflection over {travel * 1e3:.3g} mm"]
    stays = 1e3 * test.rim_displacement[both][0]
    missing = [] if rim else [f"rim displacement: {stays:.4g} mm throughout, the rim is taken as rigid"]
    peak = int(np.nanargmax(np.abs(deflection)))
    back = np.abs(deflection[peak:])
    if float(np.nanmin(back)) > 0.8 * float(np.nanmax(back)):
        missing.append("unloading: friction cannot be told from stiffness")
    return present, missing, faults
