"""Result of readings of a standing bicycle: which hypothesis of its front frame holds, and what was not checked."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from scipy.special import chdtrc

from bicycle.model.model import Model
from bicycle.parameters.bicycle import LIGHTEST_RIDDEN
from bicycle.standing.front_fit import (
    FRONT,
    NOT_HELD,
    ONE_HINGE,
    RIDER_YAWS,
    SADDLE,
    SADDLE_RATIO,
    SADDLE_STIFFNESS,
    STIFFNESS,
    TWO_JOINTS,
    FrontFit,
    Hypothesis,
    fit_front,
)
from bicycle.standing.readings import Place, Readings
from tyre.ground.errors import InputError

PLAUSIBLE_HEIGHT = (0.05, 0.8)
"""Heights (m above the hub) that a single hinge can have.

The hinge of a couple lies at 0.31 m in beam models of frame and fork, that of a force at the ground at 0.58 m.
"""
LEAST_MOTION = 0.01
"""Motion of the frame over that of the hub below which it is treated as held."""
CERTAIN_MOTION = 1e-3
"""Probability of the readings of a held frame below which it was not held."""

FAR_BETTER = 0.1
"""Chi^2 over that of a held frame, below which a compliant hold is named though it is not quite as assumed."""


HARDLY_BETTER = 0.5
"""Share of the sd that is assumed of a saddle, above which the readings leave it open."""
POOR_DAMPING = 0.4
"""Relative standard uncertainty of the damping of a front frame under a rider, above which it is not measured."""
POOR_STIFFNESS = 0.25
"""Relative standard uncertainty of the stiffness of a front frame under a rider, above which it is not measured."""


class Outcome(StrEnum):
    """What the readings say."""

    ONE_HINGE = "one_hinge"
    TWO_JOINTS = "two_joints"
    TWO_ANSWERS = "two_answers"  # two hinges fit alike
    NOT_HELD = "not_held"  # the frame moved
    RIDER_YAWS = "rider_yaws"  # one hinge, and the frame yaws under a seated rider
    NOT_SEPARATE = "not_separate"  # front frame and seated rider cannot be distinguished
    ODD_HINGE = "odd_hinge"  # one hinge fits where no front frame has it, and a second joint is not determined
    UNEXPLAINED = "unexplained"


NUMBERS = {
    Outcome.ONE_HINGE: ONE_HINGE.name,
    Outcome.TWO_JOINTS: TWO_JOINTS.name,
    Outcome.RIDER_YAWS: RIDER_YAWS.name,
}
"""Outcomes whose numbers may be used, and the hypothesis that has them."""


@dataclass(frozen=True)
class FrameMotion:
    """Motion of the rear frame, where it was read."""

    share: float  # largest over the motion of the hub, without sign
    probability: float  # of readings that far from zero if the frame is held

    @property
    def moved(self) -> bool:
        """True if the frame was not held."""
        return self.share > LEAST_MOTION and self.probability < CERTAIN_MOTION


@dataclass(frozen=True, eq=False)
class FrontResult:
    """The outcome, and every hypothesis that was tried."""

    readings: Readings
    outcome: Outcome
    fits: Mapping[str, FrontFit] = field(default_factory=dict)  # by name of the hypothesis
    motion: FrameMotion | None = None  # None: the frame was not read

    @property
    def fit(self) -> FrontFit | None:
        """The fit whose numbers may be used; None if there is none."""
        if self.outcome not in NUMBERS:
            return None
        return self.fits[NUMBERS[self.outcome]]

    @property
    def saddle_open(self) -> tuple[str, ...]:
        """Which of stiffness and damping of the saddle the readings leave nearly as it was assumed."""
        fit = self.fit if self.outcome == Outcome.RIDER_YAWS else None
        if fit is None:
            return ()
        stiffness_sd, ratio_sd = SADDLE_STIFFNESS.prior[1], SADDLE_RATIO.prior[1]
        assumed = {"stiffness": stiffness_sd, "damping": math.hypot(ratio_sd, stiffness_sd / 2)}  # c = 2 zeta sqrt(k I)
        relative = {name: fit.sd(f"{SADDLE}.{name}") / fit.values[f"{SADDLE}.{name}"] for name in assumed}
        return tuple(name for name, sd in assumed.items() if relative[name] > HARDLY_BETTER * sd)

    @property
    def damping_not_separate(self) -> bool:
        """True if the damping of the front frame cannot be separated from that of a seated rider."""
        fit = self.fit if self.outcome == Outcome.RIDER_YAWS else None
        key = f"{FRONT}.damping"
        return fit is not None and self.readings.damped and fit.sd(key) > POOR_DAMPING * fit.values[key]

    @property
    def hold_checked(self) -> str:
        """How the hold was checked: ``frame`` by a reading, ``both`` by deflections with taps, empty if not."""
        if self.motion is not None:
            return "frame"
        fit = self.fit
        both = bool(self.readings.deflections and self.readings.taps)
        return "both" if both and fit is not None and fit.freedom > 0 else ""


def measure_front(readings: Readings, model: Model, stated_sd: Mapping[str, float] | None = None) -> FrontResult:
    """Find the front frame of the bicycle of a ``model`` from readings on the standing bicycle.

    One hinge is taken unless the readings contradict it or put it where no front frame has one; then two joints, or a
    frame that was not held. A reading of the frame decides between these.

    Raises
    ------
    InputError
        Too few readings, or none.
    """
    if not readings.deflections and not readings.taps:
        raise InputError("nothing was read: give deflections under a load, or taps")
    motion = frame_motion(readings)
    fits: dict[str, FrontFit] = {}

    def attempt(hypothesis: Hypothesis) -> FrontFit | None:
        try:
            fits[hypothesis.name] = fit_front(readings, model, hypothesis, stated_sd)
        except InputError:
            if hypothesis is ONE_HINGE:
                raise
            return None
        return fits[hypothesis.name]

    if readings.seated and readings.taps:
        require_rider(readings, model)
        return _measure_seated(readings, model, motion, stated_sd)
    one = attempt(ONE_HINGE)
    if motion is not None and motion.moved:
        return FrontResult(readings, Outcome.NOT_HELD, fits, motion)
    if one is not None and one.fits and is_plausible(one):
        two_answers = bool(one.others)
        outcome = Outcome.TWO_ANSWERS if two_answers else Outcome.ONE_HINGE
        return FrontResult(readings, outcome, fits, motion)
    two = attempt(TWO_JOINTS)
    if two is not None and two.fits and not two.height_open:
        return FrontResult(readings, Outcome.TWO_JOINTS, fits, motion)
    if one is not None and one.fits:
        return FrontResult(readings, Outcome.ODD_HINGE, fits, motion)
    loose = attempt(NOT_HELD) if motion is None else None
    held = min(fit.chi2 for fit in (one, two) if fit is not None)
    explains = loose is not None and (loose.fits or loose.chi2 < FAR_BETTER * held)
    outcome = Outcome.NOT_HELD if explains else Outcome.UNEXPLAINED
    return FrontResult(readings, outcome, fits, motion)


def require_rider(readings: Readings, model: Model) -> None:
    """Refuse taps under a seated rider on a bicycle without one."""
    mass = model.bicycle["mB"]
    if readings.seated and readings.taps and mass < LIGHTEST_RIDDEN:
        raise InputError(
            f"a rider sat on the saddle, and the bicycle has none: mB = {mass:g} kg is below "
            f"{LIGHTEST_RIDDEN:g} kg; give the bicycle with its rider"
        )


def _measure_seated(
    readings: Readings, model: Model, motion: FrameMotion | None, stated_sd: Mapping[str, float] | None
) -> FrontResult:
    """Find front frame and saddle of a bicycle on whose saddle a rider sits; the frame is not held in the taps."""
    fit = fit_front(readings, model, RIDER_YAWS, stated_sd)
    fits = {RIDER_YAWS.name: fit}
    if motion is not None and motion.moved:
        outcome = Outcome.NOT_HELD
    elif not fit.fits:
        outcome = Outcome.UNEXPLAINED
    elif fit.others:
        outcome = Outcome.TWO_ANSWERS
    elif not is_plausible(fit):
        outcome = Outcome.ODD_HINGE
    elif fit.height_assumed or fit.coordinate(STIFFNESS)[1] > POOR_STIFFNESS:
        outcome = Outcome.NOT_SEPARATE
    else:
        outcome = Outcome.RIDER_YAWS
    return FrontResult(readings, outcome, fits, motion)


def is_plausible(fit: FrontFit) -> bool:
    """True if the 95 % interval of the hinge's height reaches into :data:`PLAUSIBLE_HEIGHT`."""
    height, sd = fit.height
    return PLAUSIBLE_HEIGHT[0] - 1.96 * sd <= height <= PLAUSIBLE_HEIGHT[1] + 1.96 * sd


def frame_motion(readings: Readings) -> FrameMotion | None:
    """Find how far the rear frame moved; None if it was not read.

    Under a seated rider it may move in the taps; this is not checked here.
    """
    shares, squares = [], []
    for deflection in readings.deflections:
        if deflection.read.on == "frame":
            shares.append(abs(deflection.value) / _hub_deflection(readings, deflection.force, deflection.loaded))
            squares.append((deflection.value / deflection.sd) ** 2)
    for tap in () if readings.seated else readings.merge_alike().taps:
        for ratio in tap.ratios:
            if ratio.read.on == "frame":
                shares.append(abs(ratio.value))
                squares.append((ratio.value / ratio.sd) ** 2)
    return FrameMotion(max(shares), float(chdtrc(len(squares), sum(squares)))) if shares else None


def _hub_deflection(readings: Readings, force: float, loaded: Place) -> float:
    """Deflection (m) under a load, without sign: at the hub, else the largest on the front; infinite without any."""
    alike = [d for d in readings.deflections if d.force == force and d.loaded == loaded and d.read.on != "frame"]
    at_hub = [abs(d.value) for d in alike if d.read.is_axle]
    return max(at_hub or [abs(d.value) for d in alike] or [math.inf])
