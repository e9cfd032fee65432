"""What floats in every fit of rig recordings, and which rig effects may be missing from the base model."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.rig.data import Pull, Sweep
from studies.missing_effect.rig.reference import Curve
from tyre.base.errors import InputError, unknown
from tyre.fits.estimate import Calibration

PEAK_SD, SHAPE_SD, CURVATURE_SD = 0.1, 0.15, 0.5  # of the curve: 4 deg of slip do not tell them one by one
DRIFT = 3.0  # N over a recording
ZERO, SLIP_ZERO = 1.0, 1e-4  # N and rad, of the force cell and of the slip-angle sensor
BEND = 0.02  # relative departure of a pull from a straight line at its largest displacement
LOAD = 0.005  # relative error of the load
PRESLIDING = (5e-5, 0.7)  # m over which friction builds up, and the sd of its logarithm
UNKNOWN_LENGTH = 0.1  # m, of a tyre of which nothing is known
EXPLAINED = {
    "drum_curvature": "cornering stiffness on a drum of radius Rd is that of a flat track over (1 + R / Rd)^exponent",
    "rim_compliance": "rim and fixture move by compliance times force, in series with the tyre",
    "sweep_lag": "the side force of a rolling tyre follows slip over the relaxation length",
    "ply_steer": "the side force vanishes at another slip angle than zero (or the zero of the angle is off)",
    "conicity": "a side force at zero slip (or the zero of the force cell is off)",
    "steering_play": "the slip of the wheel stays behind that of the sensor by the same angle at any rate",
    "channel_delay": "the force is recorded later than the slip angle",
    "rig_friction": "friction of the rig adds to the force of a pull, against the motion",
    "temperature_drift": "the side force grows or falls along the recording as the tyre warms",
    "load_dependence": "cornering stiffness grows with load as load^exponent from the reference's load",
    "force_scale": "gain of the force cell", "slip_scale": "gain of the slip-angle sensor",
    "displacement_scale": "gain of the displacement gauges", "load_scale": "gain of the load cell",
}  # fmt: skip


@dataclass(frozen=True)
class Setting:
    """What the candidates depend on: the reduced recordings, their curves by label, and lengths (m, sd) by label."""

    sweeps: tuple[Sweep, ...]
    pulls: tuple[Pull, ...]
    curves: dict[str, Curve]
    calibration: Calibration
    length: tuple[float, float] | None  # at the first sweep


def rig_nuisances(setting: Setting) -> tuple[UncertainParameter, ...]:
    """Tyre parameters with the reference's uncertainty, scatter of one recording, drifts, certified calibration."""
    c, found = setting.calibration, []

    def add(key: str, scale: float, unit: str = "1") -> None:
        if scale > 0:
            found.append(UncertainParameter(key, unit, {key: 1.0}, 0.0, scale))

    for label in dict.fromkeys(s.label for s in setting.sweeps):
        value, sd = setting.curves[label].cornering_stiffness or (1.0, 0.0)
        add(f"cornering stiffness, {label}", sd / value)
        add(f"peak, {label}", PEAK_SD)
    for label in dict.fromkeys(p.label for p in setting.pulls):
        value, sd = setting.curves[label].lateral_stiffness or (1.0, 0.0)
        add(f"lateral stiffness, {label}", sd / value)
    if setting.sweeps:
        add("shape", SHAPE_SD)
        add("curvature", CURVATURE_SD)
        add("load gain", LOAD)
        add("slip gain", c.slip)
        add("slip zero", SLIP_ZERO, "rad")
    add("force gain", c.force)
    for s in setting.sweeps:
        add(f"repeatability, {s.name}", c.repeatability)
        add(f"drift, {s.name}", DRIFT, "N")
        add(f"zero, {s.name}", ZERO, "N")
    for p in setting.pulls:
        add(f"repeatability, {p.name}", c.repeatability)
        add(f"drift, {p.name}", DRIFT, "N")
        add(f"zero, {p.name}", ZERO, "N")
        add(f"bend, {p.name}", BEND)
    if setting.pulls:
        add("displacement gain", c.displacement)
    return tuple(found)


def rig_candidates(
    setting: Setting, bends: Sequence[float], loads_off: bool, speeds: bool
) -> tuple[tuple[Candidate, ...], dict[str, str]]:
    """Rig effects that may be missing, and why others cannot be tried.

    Parameters
    ----------
    setting : Setting
    bends : sequence of float
        ln(1 + R/Rd) of each sweep minus that of its reference.
    loads_off : bool
        Whether a recording's load lies outside those of the reference.
    speeds : bool
        Whether every sweep has its rolling speed.
    """
    sweeps, pulls = bool(setting.sweeps), bool(setting.pulls)
    both = len({float(way) for s in setting.sweeps for way in s.direction}) > 1
    refused: dict[str, str] = {}

    def needs(condition: bool, name: str, why: str) -> bool:
        if not condition:
            refused[name] = why
        return condition

    found = [_one("force_scale", "scale", "1", 0.025)]
    if needs(sweeps, "slip_scale, ply_steer, conicity, channel_delay, temperature_drift", "no slip sweep"):
        found += [
            _one("slip_scale", "scale", "1", 0.025), _one("load_scale", "scale", "1", 0.025),
            _one("ply_steer", "slip", "rad", 1.5e-3), _one("conicity", "force", "N", 12.0),
            _one("channel_delay", "delay", "s", 0.005), _one("temperature_drift", "change", "1", 0.01),
        ]  # fmt: skip
        bent = max(map(abs, bends), default=0.0) > 1e-9
        if needs(bent, "drum_curvature", "recordings and reference are of the same curvature of track"):
            found.append(_one("drum_curvature", "exponent", "1", 0.6, 0.0, 3.0))
        if needs(loads_off, "load_dependence", "the reference covers the loads of the recordings"):
            found.append(_one("load_dependence", "exponent", "1", 0.5, -1.0, 3.0))
        if needs(both, "steering_play", "one branch alone: the same as ply_steer"):
            found.append(_one("steering_play", "half_gap", "rad", 5e-4, 0.0, 0.02))
        if needs(speeds, "sweep_lag", "the rolling speed is not recorded; give speed_km_h in the sidecar"):
            found.append(_lag(setting.length))
    if needs(pulls, "rim_compliance, rig_friction, displacement_scale", "no pull test"):
        begins = UncertainParameter(
            "presliding", "m", {"presliding": 1.0}, float(np.log(PRESLIDING[0])), PRESLIDING[1], power=0
        )
        found += [
            _one("rim_compliance", "compliance", "m/N", 1e-5, 0.0, 2e-4),
            _one("displacement_scale", "scale", "1", 0.025),
            Candidate("rig_friction", (_size("friction", "N", "rig_friction", 1.5, 0.0, 30.0), begins)),
        ]  # fmt: skip
    return tuple(found), refused


def chosen(
    candidates: tuple[Candidate, ...], refused: dict[str, str], includes: Sequence[str], without: Sequence[str]
) -> tuple[tuple[Candidate, ...], tuple[UncertainParameter, ...]]:
    """Candidates that are tried, and the unknowns of those that the base model includes.

    Raises
    ------
    InputError
        An effect that does not exist or that these recordings cannot show.
    """
    known = {c.identifier: c for c in candidates}
    for what, names in (("[rig]: includes", includes), ("--without", without)):
        for name in names:
            if name not in EXPLAINED:
                raise InputError(f"{what}: {unknown('rig effect', name, EXPLAINED)}")
    for name in includes:
        if name not in known:
            why = next(
                (reason for names, reason in refused.items() if name in names), "these recordings cannot show it"
            )
            raise InputError(f"[rig]: includes {name!r}, but: {why}; take it out")
    gone = {*includes, *without}
    unknowns = tuple(u for name in includes for u in known[name].unknowns)
    return tuple(c for c in candidates if c.identifier not in gone), unknowns


def phenomenological(sweeps: bool, pulls: bool) -> tuple[Candidate, ...]:
    """Terms without a cause: side force that grows with slip squared, pull force with the square of displacement."""
    found = [_one("side force from slip squared", "gain", "N/rad^2", 2000.0)] if sweeps else []
    return (*found, *([_one("pull force bends", "share at the end", "1", 0.1)] if pulls else []))


def _size(
    name: str, unit: str, key: str, scale: float, low: float = -np.inf, high: float = np.inf
) -> UncertainParameter:
    return UncertainParameter(name, unit, {key: 1.0}, 0.0, scale, low, high, size=True)


def _one(identifier: str, name: str, unit: str, scale: float, low: float = -np.inf, high: float = np.inf) -> Candidate:
    return Candidate(identifier, (_size(name, unit, identifier, scale, low, high),))


def _lag(length: tuple[float, float] | None) -> Candidate:
    """Its length is known where the reference has it: then the effect is there or not, and its size is no question."""
    if length is None:
        unknown_length: Callable[..., UncertainParameter] = _size
        return Candidate(
            "sweep_lag", (unknown_length("relaxation_length", "m", "sweep_lag", UNKNOWN_LENGTH, 0.0, 2.0),)
        )
    value, sd = length
    return Candidate("sweep_lag", (UncertainParameter("relaxation_length", "m", {"sweep_lag": 1.0}, value, sd, 0.0),))
