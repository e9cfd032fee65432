"""What may be wrong with a measurement of a bicycle's motion, or with the file of the bicycle, as candidates.

A candidate of this kind is a mistake, not a thing that the bicycle has. Its prior weight is below that of an ordinary
candidate, for a laboratory looks for such mistakes before it publishes: ``SENSOR`` where calibration is a matter of
percents and easily overlooked, ``FILE`` for a geometry beyond its stated uncertainty, which whoever stated it denies.
The weights are judgements; a factor of two or five is little beside what a few good runs say.

Recorded signals lag: a filter, a bus and a logger delay what they pass on, none shows it before it has happened. Delays
and time constants are therefore zero or positive. A torque counts as an actuator's: it acts when it was commanded, or
later.
"""

from collections.abc import Sequence
from dataclasses import replace

from bicycle.model import Model
from studies.inference.fit import Fit
from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.motion.family import SPEED_OFFSET, SPEED_SCALE, WRONG

GAIN, DELAY, LOWPASS = "measurement.{}_gain", "measurement.{}_delay", "measurement.{}_lowpass"  # of a signal
SENSOR, FILE = 0.5, 0.2  # prior weights
GEOMETRY = {"wrong_tilt": ("lam", "rad", 0.05, 2e-3, "steer axis tilt"), "wrong_trail": ("c", "m", 0.02, 1e-3, "trail")}
"""Candidate: key of the bicycle, unit, prior sd, least size where the file states no uncertainty, and its name."""
STATED = 3.0  # stated sd within which a departure is no mistake


def error(
    name: str, unit: str, key: str, scale: float, *, least: float, lowest: float | None = None
) -> UncertainParameter:
    """The size of a mistake.

    Parameters
    ----------
    name, unit : str
    key : str
        What it is kept under.
    scale : float
        Standard deviation about zero, in ``unit``.
    least : float
        Smallest size worth a name, in the unit of the scale.
    lowest : float, optional
        Bound, in the unit of the scale; ten standard deviations by default.
    """
    low = -10 * scale if lowest is None else lowest
    return UncertainParameter(name, unit, {key: 1.0}, 0.0, scale, low, 10 * scale, size=True, least=least)


def gain_error(sensor: str, signal: str, *, beside: str = "") -> Candidate:
    """A wrong scale of a ``sensor`` whose ``signal`` is multiplied by 1 + scale: 10 %, worth a name from 0.2 %.

    Its coordinate is ln(1 + scale). Where two sensors show no more than their ratio, one that reads 1.4 times too much
    explains as much as the other that reads 1/1.4 times as much, and neither is the more probable. Of a ratio, the
    sensor below the line is ``beside`` it.
    """
    size = replace(error("scale", "1", GAIN.format(signal), 0.1, least=0.002), power=0, relative=True)
    much = "too much or too little" + (f" beside {_words(beside)}" if beside else "")
    return _mistake(f"{sensor}_scale", size, f"{_words(sensor)} reads {much} by a constant factor")


def delay_error(sensor: str, signal: str) -> Candidate:
    """A ``sensor`` whose ``signal`` is late: 10 ms, worth a name from 0.5 ms."""
    size = error("delay", "s", DELAY.format(signal), 0.01, least=5e-4, lowest=0.0)
    return _mistake(f"{sensor}_delay", size, f"{_words(sensor)} is late by a constant time")


def lowpass_error(sensor: str, signal: str) -> Candidate:
    """A ``sensor`` whose ``signal`` went through a first-order low-pass: 20 ms, worth a name from 0.5 ms."""
    size = error("time_constant", "s", LOWPASS.format(signal), 0.02, least=5e-4, lowest=0.0)
    return _mistake(f"{sensor}_lowpass", size, f"{_words(sensor)} is smoothed by a first-order low-pass")


def speed_errors(speeds: Sequence[float]) -> tuple[Candidate, ...]:
    """A wrong scale of the speedometer (2 %, from 0.2 %), and an offset (0.1 m/s, from 0.01 m/s) added to ``speeds``.

    ``speeds`` are in m/s. At a single one an offset is a scale and is left out.
    """
    scale = error("scale", "1", SPEED_SCALE, 0.02, least=0.002)
    found = [_mistake("speed_scale", scale, "the true speed is the recorded one times a constant factor")]
    if len(set(speeds)) > 1:
        offset = error("offset", "m/s", SPEED_OFFSET, 0.1, least=0.01, lowest=-min(1.0, 0.5 * min(speeds)))
        found.append(_mistake("speed_offset", offset, "the true speed is the recorded one and a constant more"))
    return tuple(found)


def one_speed(speeds: Sequence[float]) -> dict[str, str]:
    """Why an offset of the speed is not tried at ``speeds``, m/s; empty where it is."""
    return {} if len(set(speeds)) > 1 else {"speed_offset": "one speed: an offset is a scale there, see speed_scale"}


def constant_errors() -> tuple[Candidate, ...]:
    """A constant, and a constant with a trend, in each channel of each run; both are integrated out."""
    return (
        Candidate("bias", (), signature="each channel of each run has an offset", weight=SENSOR),
        Candidate("drift", (), signature="each channel of each run has an offset that changes in time", weight=SENSOR),
    )


def geometry_errors(
    model: Model, floating: Sequence[UncertainParameter]
) -> tuple[tuple[Candidate, ...], dict[str, str]]:
    """A tilt or trail of the file that is off beyond its stated uncertainty, and why one is not tried.

    It is added to what floats about the stated value, or to the value itself where that is fixed. Its prior sd is that
    of a mistake: 0.05 rad, as between a tube's angle and the steer axis, and 20 mm, as between two ways to measure a
    trail; less than three stated sd (or 2 mrad, 1 mm) is no mistake.

    Parameters
    ----------
    model : Model
        The base model.
    floating : sequence of UncertainParameter
        Its nuisances.
    """
    found: list[Candidate] = []
    refused: dict[str, str] = {}
    followers: dict[str, list[str]] = {}
    for follower, leader in model.tied.items():
        followers.setdefault(leader, []).append(follower)
    for identifier, (key, unit, scale, least, word) in GEOMETRY.items():
        nuisance = next((u for u in floating if key in u.sets), None)
        sd = 0.0 if nuisance is None else nuisance.scale
        if sd >= scale:
            refused[identifier] = f"the stated sd of {key}, {sd:g} {unit}, already allows for it ({scale:g} {unit})"
            continue
        own = {u.name for u in floating if u.name != key}
        moved = [key, *(f for f in followers.get(key, ()) if f not in own)]
        size = UncertainParameter(
            "error", unit, {WRONG + name: 1.0 for name in moved}, 0.0, scale, -6 * scale, 6 * scale, size=True,
            least=max(STATED * sd, least),
        )  # fmt: skip
        found.append(Candidate(identifier, (size,), signature=f"the stated {word} ({key}) is wrong", weight=FILE))
    return tuple(found), refused


def wrong_geometry(final: Fit) -> dict[str, float]:
    """What the values stated in the file are too small by, by parameter (SI), as the fit ``final`` found it."""
    return {
        key.removeprefix(WRONG): factor * float(u.value(x))
        for c in final.candidates
        for u, x in zip(c.unknowns, final.theta[final.columns(c)], strict=True)
        for key, factor in u.sets.items()
        if key.startswith(WRONG)
    }


def _mistake(identifier: str, size: UncertainParameter, words: str) -> Candidate:
    return Candidate(identifier, (size,), signature=words, weight=SENSOR)


def _words(sensor: str) -> str:
    return f"the {sensor.replace('_', ' ')}"
