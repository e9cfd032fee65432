"""What a terminal shows of a measured front frame, and its record as JSON."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from bicycle.model.model import Model
from bicycle.standing import (
    ASSUMED_HEIGHT,
    CERTAIN_MOTION,
    FORK,
    FRONT,
    ONE_HINGE,
    RIDER_YAWS,
    SADDLE,
    TWO_JOINTS,
    TYRE,
    FrontFit,
    FrontResult,
)
from studies.reporting.markdown_text import one_line, render_file
from studies.standing.front_model import DampingUse, damping_use, front_covariance, front_effects


@dataclass(frozen=True)
class Number:
    """A value and its standard uncertainty, in the unit that is printed with it."""

    value: float
    sd: float


@dataclass(frozen=True)
class ShownJoint:
    """One joint of the front frame."""

    name: str  # of its effect
    stiffness: Number  # N m/rad
    low: float  # N m/rad, ends of the 95 % interval of the stiffness
    high: float
    height: Number  # m above the hub
    joint_z: float | None  # m; None of the fork
    damping: Number | None  # N m s/rad; None if it was not measured

    @property
    def per_degree(self) -> float:
        """Stiffness in N m/deg, as magazines print it."""
        return math.radians(self.stiffness.value)


@dataclass(frozen=True)
class ShownRider:
    """The hinge of a rider on the saddle."""

    stiffness: Number  # N m/rad
    low: float  # N m/rad, ends of the 95 % interval of the stiffness
    high: float
    damping: Number  # N m s/rad


RIDER_KEYS = (f"{SADDLE}.stiffness", f"{SADDLE}.damping")


@dataclass(frozen=True)
class Report:
    """Everything the templates show of a result."""

    result: FrontResult
    model: Model
    held: str  # what held the frame

    @property
    def outcome(self) -> str:
        return str(self.result.outcome)

    @property
    def fit(self) -> FrontFit | None:
        return self.result.fit

    @cached_property
    def damping(self) -> DampingUse:
        return damping_use(self.result, self.model, self.held)

    @property
    def bicycle(self) -> str:
        return self.model.bicycle.name

    @property
    def readings(self) -> str:
        """Number of readings in words."""
        counts = (
            (len(self.result.readings.deflections), "deflection"),
            (len(self.result.readings.taps), "tap"),
        )
        return ", ".join(f"{count} {noun}{'s' if count > 1 else ''}" for count, noun in counts if count)

    @property
    def joints(self) -> list[ShownJoint]:
        """Joints of a result with numbers, the frame's first."""
        fit = self.fit
        if fit is None:
            return []
        return [_shown_joint(fit, name) for name in (FRONT, FORK) if f"{name}.stiffness" in fit.values]

    @property
    def rider(self) -> "ShownRider | None":
        """Hinge of a seated rider; None if none was measured."""
        fit = self.fit
        if fit is None or f"{SADDLE}.stiffness" not in fit.values:
            return None
        stiffness, damping = (Number(fit.values[key], fit.sd(key)) for key in RIDER_KEYS)
        low, high = fit.value_interval(RIDER_KEYS[0])
        return ShownRider(stiffness, low, high, damping)

    @property
    def tyre(self) -> Number:
        """Stiffness (N/mm) of the rear tyre to the side, which is fitted together with a seated rider."""
        fit = self.result.fits[RIDER_YAWS.name]
        return Number(fit.values[TYRE] / 1000, fit.sd(TYRE) / 1000)

    @property
    def saddle_open(self) -> str:
        """Words for what the readings leave of the saddle as it was assumed; empty if nothing."""
        return " and ".join(self.result.saddle_open)

    @property
    def not_separate(self) -> bool:
        return self.result.damping_not_separate

    @property
    def seated(self) -> bool:
        """True if only a rider holds the frame in the taps."""
        return self.result.readings.seated and bool(self.result.readings.taps)

    @property
    def vibrations(self) -> int:
        """Number of vibrations that a tap leaves."""
        return len({tap.vibration for tap in self.result.readings.taps})

    @property
    def height_assumed(self) -> bool:
        return self.fit is not None and self.fit.height_assumed

    @property
    def assumed_height(self) -> tuple[float, float]:
        return ASSUMED_HEIGHT

    @property
    def ratio(self) -> float:
        """Damping ratio of the first vibration without an added mass, or of the first."""
        taps = [tap for tap in self.result.readings.merge_alike().taps if not math.isnan(tap.damping_ratio)]
        return min(taps, key=lambda tap: tap.added_mass).damping_ratio

    @property
    def goodness(self) -> float | None:
        return None if self.fit is None else _goodness(self.fit)

    @property
    def freedom(self) -> int:
        return 0 if self.fit is None else self.fit.freedom

    @property
    def one_goodness(self) -> float | None:
        return _goodness(self.result.fits.get(ONE_HINGE.name))

    @property
    def two_goodness(self) -> float | None:
        return _goodness(self.result.fits.get(TWO_JOINTS.name))

    @property
    def one_refused(self) -> bool:
        """True if the readings contradict one hinge, false if only its place is odd."""
        return not self.result.fits[ONE_HINGE.name].fits

    @property
    def why_not_one(self) -> str:
        """Figure that speaks against one hinge."""
        one = self.result.fits[ONE_HINGE.name]
        return _probability(one.goodness) if self.one_refused else f"{one.height[0]:.2f} m above the hub"

    @property
    def odd_height(self) -> Number:
        return Number(*next(iter(self.result.fits.values())).height)

    @property
    def answers(self) -> list[ShownJoint]:
        """Hinges that explain the readings alike."""
        best = next(iter(self.result.fits.values()))
        return [_shown_joint(fit, FRONT) for fit in (best, *best.others)]

    @property
    def hold_checked(self) -> str:
        return self.result.hold_checked

    @property
    def frame_share(self) -> float:
        return math.nan if self.result.motion is None else self.result.motion.share

    @property
    def frame_seen(self) -> bool:
        """True if the frame moved by more than its uncertainty, however little."""
        return self.result.motion is not None and self.result.motion.probability < CERTAIN_MOTION

    @property
    def farthest(self) -> str:
        """The reading that the best of all hypotheses misses most."""
        best = min(self.result.fits.values(), key=lambda fit: fit.chi2)
        labels = [label for label, used in zip(*_labels(self.result), strict=True) if used]
        place = int(np.abs(best.residual).argmax())
        return labels[place]


def _shown_joint(fit: FrontFit, name: str) -> ShownJoint:
    stiffness = f"{name}.stiffness"
    damping = f"{name}.damping"
    low, high = fit.value_interval(stiffness)
    has_damping = fit.values[damping] > 0
    height = Number(*fit.height) if name == FRONT else Number(fit.values[f"{FORK}.length"], fit.sd(f"{FORK}.length"))
    return ShownJoint(
        name,
        Number(fit.values[stiffness], fit.sd(stiffness)),
        low,
        high,
        height,
        fit.values.get(f"{name}.joint_z"),
        Number(fit.values[damping], fit.sd(damping)) if has_damping else None,
    )


def _goodness(fit: FrontFit | None) -> float | None:
    """Goodness of a fit; None where there is nothing to check it with."""
    return None if fit is None or math.isnan(fit.goodness) else fit.goodness


def _labels(result: FrontResult) -> tuple[list[str], list[bool]]:
    """Words for each number of the merged readings, and whether it was measured."""
    readings = result.readings.merge_alike()
    labels = [
        f"deflection at {d.read.above_hub:g} m under {d.force:g} N at {d.loaded.above_hub:g} m above the hub"
        for d in readings.deflections
    ]
    for tap in readings.taps:
        labels += [f"frequency of {tap.name}", f"damping ratio of {tap.name}"]
        for r in tap.ratios:
            ratio = f"ratio of {r.read.above_hub:g} m to {r.over.above_hub:g} m in {tap.name}"
            labels += [ratio, f"{ratio}, imaginary part"]
    return labels, [bool(x) for x in np.isfinite(readings.numbers()[0])]


# ---- text and record ----


def _shown(value: float, sd: float) -> str:
    """A value to two digits of its standard uncertainty."""
    if not (math.isfinite(sd) and sd > 0):
        return f"{value:.4g}"
    places = 1 - math.floor(math.log10(sd))
    return f"{round(value, places):.{max(places, 0)}f}"


def _two(value: float) -> str:
    """A number to two digits, without an exponent from 0.0001 up to a million."""
    if value == 0 or not math.isfinite(value) or not 1e-4 <= abs(value) < 1e6:
        return f"{value:.2g}"
    places = 1 - math.floor(math.log10(abs(value)))
    return f"{round(value, places):.{max(places, 0)}f}"


def _four(value: float) -> str:
    """A number to four digits, of a thousand or more to the next whole."""
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.4g}"


def _probability(p: float) -> str:
    """``p = 0.94``, or a bound where it is tiny."""
    return f"p = {p:.2g}" if p >= LEAST_P else f"p < {LEAST_P:g}"


LEAST_P = 1e-6
FILTERS: Mapping[str, Any] = {"shown": _shown, "two": _two, "four": _four, "probability": _probability}


def terminal(report: Report) -> str:
    """What a terminal shows."""
    return _render("front.txt.j2", report).strip()


def description(report: Report) -> str:
    """One line on the model file."""
    return str(one_line(_render("description.txt.j2", report)))


def _render(name: str, report: Report) -> str:
    return render_file("studies.standing", name, {"r": report}, escaped=False, filters=FILTERS)


def record(report: Report, notes: Sequence[str]) -> dict[str, Any]:
    """The result as JSON: outcome, numbers with covariance in SI, what was checked."""
    result, fit = report.result, report.fit
    content: dict[str, Any] = {
        "outcome": report.outcome,
        "held": report.held,
        "hold_checked": report.hold_checked or "no",
        "frame_motion_over_hub": None if result.motion is None else result.motion.share,
        "hypotheses": {
            name: {"chi2": one.chi2, "degrees_of_freedom": one.freedom, "p": _goodness(one)}
            for name, one in result.fits.items()
        },
        "notes": list(notes),
    }
    if fit is None:
        return content
    height, sd = fit.height
    covariance = front_covariance(result, report.damping)
    return content | {
        "effects": front_effects(result, report.damping),
        "covariance": {"parameters": list(covariance.names), "matrix": covariance.matrix.tolist()},
        "height_above_hub_m": {"value": height, "sd": sd, "assumed": fit.height_assumed},
        "damping_measured": report.damping.measured,
        "damping_written": report.damping.used,
    }
