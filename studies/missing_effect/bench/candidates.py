"""What may be wrong with a bench test, what else it shows, and what it cannot see."""

from collections.abc import Sequence

from bicycle.effect import Effect, registry
from bicycle.model import Model
from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.bench.steering import (
    ARM_ERROR,
    FORCE_GAIN,
    FORCE_ZERO,
    SCRUB,
    STEER_ZERO,
    TORQUE_GAIN,
    TORQUE_ZERO,
    turning,
)
from studies.missing_effect.bench.table import Reading
from studies.missing_effect.motion.friction import friction_candidate
from studies.missing_effect.motion.sensor_errors import SENSOR, error

ROLLING = "acts through a rolling tyre: one at rest has no slip, and no force that comes from rolling"
NO_RIDER = "nobody holds the bar or sits on the bicycle in a bench test"
MOTOR = "motors are off in a bench test"
UNSEEN = "does not change the torque at the bar in these tests"
OF_ROLLING = ("twisting_torque",)  # without a force in its declaration
ARM = 0.005  # m
SPREAD = 0.01  # relative: two lever arms that differ by less are one


def unseen(effect: type[Effect]) -> str:
    """Why an ``effect`` cannot act on the steering of a bicycle that stands; empty where it may."""
    if effect.powered or "motor command" in effect.requires:
        return MOTOR
    if effect.needs_rider:
        return NO_RIDER
    rolling = effect.slot is not None or effect.requires or effect.identifier in OF_ROLLING
    return ROLLING if rolling else ""


def at_rest(model: Model) -> Model:
    """A ``model`` that rolls without slip, with those of its effects that may act at rest."""
    kept = [effect for effect in model.effects if not unseen(type(effect))]
    return Model(model.bicycle, tuple(kept))


def out_of_sight() -> dict[str, str]:
    """Effects that no bench test can show, and why."""
    return {name: why for name, effect in registry().items() if (why := unseen(effect))}


def bench_candidates(readings: Sequence[Reading]) -> tuple[Candidate, ...]:
    """What may be wrong with ``readings``, and friction that they can show.

    Scale and zero of the balance, by torque or by force, the lever arm where there are two, the zero of the angle; dry
    friction of the steering and of the contact patch, which are no mistakes.
    """
    found = []
    for name, word, gain, zero, unit, size, least in (
        ("steer_torque", "torque sensor", TORQUE_GAIN, TORQUE_ZERO, "N m", 0.1, 0.02),
        ("force", "spring balance", FORCE_GAIN, FORCE_ZERO, "N", 0.5, 0.1),
    ):
        if not any((reading.arm > 0) == (name == "force") for reading in readings):
            continue
        scale = error("scale", "1", gain, 0.1, least=0.002)
        offset = error("offset", unit, zero, size, least=least)
        found += [
            _mistake(f"{name}_scale", scale, f"the {word} reads too much or too little by a constant factor"),
            _mistake(f"{name}_zero", offset, f"the {word} does not read zero without load"),
        ]
    arms = _arms(readings)
    if len(arms) > 1:
        longer = error("error", "m", ARM_ERROR, ARM, least=1e-3, lowest=-0.5 * min(arms))
        found.append(_mistake("lever_arm_error", longer, "every lever arm is longer than stated by the same length"))
    straight = error("offset", "rad", STEER_ZERO, 0.02, least=2e-3)
    found.append(_mistake("steer_zero", straight, "the steering is not straight where the angle reads zero"))
    if turning(readings):
        found.append(friction_candidate())
    if _scrubs(readings):
        moment = error("moment", "N m", SCRUB, 3.0, least=0.05, lowest=0.0)
        found.append(Candidate("contact_scrub", (moment,), signature="the standing tyre rubs in its contact patch"))
    return tuple(found)


def bench_refused(readings: Sequence[Reading]) -> dict[str, str]:
    """What cannot be tried on ``readings``, and why."""
    refused = out_of_sight()
    if len(_arms(readings)) == 1:
        refused["lever_arm_error"] = "one lever arm: an error of it looks like a scale of the balance, see force_scale"
    if not turning(readings):
        refused["steer_friction"] = "needs readings with a direction: a sweep up and down, or a damper test"
    if any(r.condition == "floor" for r in readings) and not _scrubs(readings):
        refused["contact_scrub"] = "needs readings with a direction: a sweep up and down"
    return refused


def _arms(readings: Sequence[Reading]) -> list[float]:
    """Lever arms that differ."""
    found: list[float] = []
    for arm in sorted({r.arm for r in readings if r.arm > 0}):
        if not found or arm > found[-1] * (1 + SPREAD):
            found.append(arm)
    return found


def _scrubs(readings: Sequence[Reading]) -> bool:
    return any(r.condition == "floor" and r.direction for r in readings)


def _mistake(identifier: str, size: UncertainParameter, words: str) -> Candidate:
    return Candidate(identifier, (size,), signature=words, weight=SENSOR)
