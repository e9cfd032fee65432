"""First screen of the main study: what lower pressure does to wobble, case by case and over parameter samples.

A change counts if the unstable range widens or narrows by at least :attr:`Limits.practical`. The grade of the answer
follows from the samples of the reference case by the rules of :mod:`studies.main_study.grades`. A tyre of one
condition has no lower pressure; then the question is if the bicycle wobbles over at least that range.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from bicycle.parameters.bicycle import LIGHTEST_RIDDEN
from studies.main_study.compare import Amplitude, Hinge, Samples, front_draws
from studies.main_study.grades import GRADE_RULES, GradedAnswer, grade_samples
from studies.main_study.result import Result, Span
from studies.main_study.settings import ASSUMED, LIMITS, OF_FRONT, SADDLE, Settings, Setup
from studies.main_study.study import Study, pressure_ends
from tyre.ground.arrays import Array

# Steer amplitude of wobble: it lasts; not known; none without an impulse; none
LASTS, NOT_KNOWN, KICKED, NONE = "lasts", "not known", "kicked", "none"
OF_TYRE = {"trail": "pneumatic trail", "twisting": "twisting torque", "camber_share": "camber stiffness"}


class Cell(NamedTuple):
    """Wobble of one case at one pressure."""

    span: Span | None  # None: no wobble
    share: float | None  # of its samples that wobble; None: none were drawn


@dataclass(frozen=True)
class CaseComparison:
    """Wobble of the tyre in question in one case at both ends of its pressures; ``high`` is None for one condition."""

    setup: Setup  # hands and front frame
    low: Result  # at the lowest pressure, or at the one condition
    high: Result | None
    limit: float  # m/s, highest speed that is looked at
    # share of the samples of the case that wobble, as ``results``; empty: none were drawn
    wobbling: tuple[float, ...]

    @property
    def results(self) -> tuple[Result, ...]:
        """At the lowest and, if there are two, at the highest pressure."""
        return (self.low, self.high) if self.high else (self.low,)

    @property
    def spans(self) -> list[Span | None]:
        """Speeds of wobble of each of the ``results``; None where there is none."""
        return [result.wobble for result in self.results]

    @property
    def cells(self) -> list[Cell]:
        """Cells of its row, as ``results``."""
        shares = self.wobbling or (None, None)
        return [Cell(span, share) for span, share in zip(self.spans, shares, strict=False)]

    @property
    def longer(self) -> float:
        """Speeds of wobble, m/s, at the low pressure more than at the high one, or at all."""
        low, *high = (wobble_length(span, self.limit) for span in self.spans)
        return low - sum(high)

    @property
    def alike(self) -> bool:
        """True if the change of the speeds of wobble prints as 0.0 m/s."""
        return abs(self.longer) < 0.05

    @property
    def assumed(self) -> bool:
        """True if the case rests on a front frame that was not measured."""
        return self.setup.assumed

    @property
    def extrapolated(self) -> bool:
        """True if a wheel load or a pressure is outside the measured range."""
        return any(result.case.extrapolated for result in self.results)

    @property
    def out_of_reach(self) -> bool:
        """True if a wheel load or a pressure lies more than one range width outside what was measured."""
        return any(result.case.out_of_reach for result in self.results)


@dataclass(frozen=True, eq=False)
class SteerAmplitude:
    """Steer amplitude of wobble in one case."""

    amplitude: Amplitude  # motions of the reference case
    state: str  # LASTS, NOT_KNOWN, KICKED or NONE


@dataclass(frozen=True, eq=False)
class Answer:
    """Facts of the first screen on the tyre in question."""

    graded: GradedAnswer  # for it: samples whose unstable range widens; of one condition: samples that wobble
    front_known: bool  # False: no front frame is known, and none is assumed
    cases: tuple[CaseComparison, ...]  # reference first
    case_count: int  # cases that were asked for
    hinges: tuple[Hinge, ...]  # the largest change of the minimum damping ratio first
    steer_amplitudes: tuple[SteerAmplitude, ...]  # at the lowest and, if there are two, at the highest pressure
    assumed: tuple[str, ...]  # names of what is assumed and not measured
    contradicts_reports: bool  # the front frame's damping is that of a bare frame, and the rider is fixed to it

    @property
    def complete(self) -> bool:
        """True if all cases of hands and front frame could be computed."""
        return len(self.cases) == self.case_count

    @property
    def reference(self) -> CaseComparison:
        """Case in which wobble is worst: hands off, flexible front frame if one is known."""
        return self.cases[0]

    @property
    def least_bump(self) -> float | None:
        """Least steer amplitude (rad) that starts wobble at the lowest pressure; None if none is needed or it dies."""
        return self.steer_amplitudes[0].amplitude.least_bump if self.steer_amplitudes else None

    @property
    def asks_pressure(self) -> bool:
        """True if there are two pressures to compare."""
        return self.reference.high is not None

    @property
    def tells_size(self) -> bool:
        """True if the steer amplitudes are not all none and not all unknown."""
        states = {amplitude.state for amplitude in self.steer_amplitudes}
        return bool(states) and states not in ({NONE}, {NOT_KNOWN})

    @property
    def change(self) -> float | None:
        """Change of the minimum damping ratio by the lower pressure, reference case; None without wobble at one."""
        low, high = self.reference.low.least, self.reference.high and self.reference.high.least
        return low.damping_ratio - high.damping_ratio if low and high else None

    @property
    def place(self) -> int | None:
        """Rank of the pressure among the one-at-a-time effects, from 1; None for one pressure."""
        return next((k for k, hinge in enumerate(self.hinges, 1) if hinge.what == "pressure"), None)

    @property
    def pressure(self) -> Hinge | None:
        """Pressure as a one-at-a-time effect; None for one pressure."""
        return self.hinges[self.place - 1] if self.place else None

    @property
    def foremost(self) -> tuple[Hinge, ...]:
        """What matters more than the pressure, three at most; of one pressure, what matters most."""
        return self.hinges[: min(self.place - 1, 3) if self.place else 3]


def answer(study: Study) -> Answer:
    """Gather the facts of the first screen."""
    settings, limit = study.settings, study.settings.fastest
    ends = pressure_ends(study.subject)
    high_case, low_case = ends[0] if ends else (None, study.focus)
    cases = []
    for setup in settings.setups:
        low = study.result(setup, low_case)
        high = study.result(setup, high_case) if high_case else None
        if low and (high or not high_case):
            samples = [study.samples_around(result) for result in (low, high) if result]
            wobbling = tuple(sample.wobbling_share for sample in samples if sample and sample.count)
            cases.append(CaseComparison(setup, low, high, limit, wobbling))
    reference = cases[0]
    return Answer(
        graded=grade(settings, study.assumed_of_tyre, *map(study.samples_around, reference.results)),
        front_known=settings.front is not None,
        cases=tuple(cases),
        case_count=len(settings.setups),
        hinges=tuple(hinge for hinge in study.hinges if hinge.comparable),
        steer_amplitudes=tuple(_judge_size(study, amplitude) for amplitude in study.amplitudes),
        assumed=_name_assumed(study),
        contradicts_reports=_contradicts_reports(settings),
    )


def grade(settings: Settings, assumed_of_tyre: tuple[str, ...], *samples: Samples | None) -> GradedAnswer:
    """Grade the answer by the ``samples`` at the lowest and, if there are two, at the highest pressure.

    Without a front frame wobble cannot be judged, so the grade is inconclusive.
    """
    drawn = [sample for sample in samples if sample]
    if not settings.front or not drawn or len(drawn) < len(samples):
        return grade_samples(np.zeros(0), {})
    computed = np.logical_and.reduce([sample.computed for sample in drawn])
    lengths = [sample.unstable[computed] for sample in drawn]
    numbers = {name: values[computed] for name, values in unmeasured(settings, assumed_of_tyre).items()}
    if len(lengths) == 1:
        return grade_samples(np.where(lengths[0] >= LIMITS.practical, 1, -1), numbers, either=True)
    change = lengths[0] - lengths[1]
    return grade_samples(np.sign(change) * (np.abs(change) >= LIMITS.practical), numbers)


def unmeasured(settings: Settings, assumed_of_tyre: tuple[str, ...]) -> Mapping[str, Array]:
    """Numbers (samples,) of each assumption of the reference case that was not measured, in the units of its range."""
    drawn, front = front_draws(settings), settings.front
    names = list(assumed_of_tyre)
    if front:
        names += [*OF_FRONT, "hinge"] if not front.from_file else front.defaults
    if settings.ranges.friction[1] > 0:
        names.append("friction")
    return {name: drawn[name] for name in names}


def _contradicts_reports(settings: Settings) -> bool:
    """True if the front frame has the damping of a bare frame, although a rider is fixed to it."""
    lowest, _ = ASSUMED["damping_ratio"].ends
    ridden = settings.bicycle["mB"] >= LIGHTEST_RIDDEN
    return bool(settings.front and settings.front.damping_ratio < lowest and ridden and SADDLE not in settings.further)


def _judge_size(study: Study, amplitude: Amplitude) -> SteerAmplitude:
    """Say whether the wobble of a case persists, needs an impulse, does not occur, or is not known."""
    result = study.result(study.settings.reference, amplitude.case)
    wobbles = result is not None and result.wobble is not None
    if amplitude.wobble:
        state = LASTS
    elif amplitude.refused or wobbles:
        state = NOT_KNOWN
    else:
        state = KICKED if amplitude.jumps else NONE
    return SteerAmplitude(amplitude, state)


def _name_assumed(study: Study) -> tuple[str, ...]:
    """Name what is assumed of bicycle, hands and tyre; the star marks the cases in which it is."""
    settings = study.settings
    names = []
    if settings.front and not settings.front.from_file:
        names.append("front frame")
    if not settings.arms.from_file:
        names.append("arms")
    names += settings.left_out
    if of_tyre := study.assumed_of_tyre:
        names.append(", ".join(OF_TYRE[name] for name in of_tyre) + " of the tyre")
    return tuple(names)


def wobble_length(span: Span | None, limit: float) -> float:
    """Length (m/s) of the speeds of wobble up to ``limit``."""
    return min(span.high, limit) - span.low if span else 0.0


def record(study: Study, answer: Answer) -> dict[str, Any]:
    """Make the answer JSON-ready: question, grade, table of cases, samples, and the numbers of the rule."""
    limit = study.settings.fastest

    def end(result: Result | None) -> dict[str, Any] | None:
        if result is None:
            return None
        span = result.wobble
        return {
            "pressure_bar": list(result.case.pressures_bar),
            "relaxation_length_m": result.case.contact[1::2].tolist(),
            "wobbles": span is not None,
            "from_m_s": span.low if span else None,
            "to_m_s": span.high if span and span.high <= limit else None,
            "growth": span.grade if span else "none",
            "growth_1_s": span.growth if span else None,
            "frequency_Hz": span.frequency_hz if span else None,
            "min_damping_ratio": result.least.damping_ratio if result.least else None,
        }

    graded = answer.graded
    split = graded.split
    return {
        "bicycle": study.settings.bicycle.name,
        "tyre": study.focus.tyre,
        "surface": study.focus.surface,
        "question": "widens" if answer.asks_pressure else "wobbles",
        "answer": graded.grade.value,
        "depends_on": split and {"assumption": split.name, "share_below": split.below, "share_above": split.above},
        "searched_m_s": [0.0, limit],
        "cases": [
            {
                "hands": case.setup.hands,
                "hands_assumed": case.setup.hands_assumed,
                "front_frame": case.setup.front_name,
                "front_frame_assumed": case.assumed,
                "low": end(case.low),
                "high": end(case.high),
                "longer_m_s": case.longer,
                "share_of_samples_that_wobble": list(case.wobbling),
            }
            for case in answer.cases
        ],
        "samples": {
            "count": graded.count,
            "for": graded.for_it,
            "against": graded.against,
            "neither": graded.neither,
        },
        "rule": rule_record(),
        "one_at_a_time": [{"what": hinge.what, "change_of_min_damping_ratio": hinge.size} for hinge in answer.hinges],
    }


def rule_record() -> dict[str, Any]:
    """Make the rule of the grades JSON-ready."""
    return {
        "least_change_m_s": LIMITS.practical,
        "agreement": [
            {
                "grades": [rule.grade.value, rule.opposite.value],
                "lowest_share_one_way": rule.agree,
                "highest_share_other_way": rule.oppose,
            }
            for rule in GRADE_RULES.agreement
        ],
        "highest_share_of_little_difference": GRADE_RULES.little,
        "lowest_difference_between_halves": GRADE_RULES.split,
    }
