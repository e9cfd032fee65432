"""First screen of the main study: what lower pressure does to wobble, case by case and over parameter samples.

Wobble is worse if its range widens by at least :attr:`Limits.practical`, or grows faster by at least
:attr:`Limits.practical_growth`. The grade of the answer follows from the samples of the reference case by the rules of
:mod:`studies.main_study.grades`. A tyre of one condition has no lower pressure; then the question is if the bicycle
wobbles over at least that range. Each case has an answer of its own: does it wobble at ridden speeds, and what does the
lower pressure do to onset and growth?
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from bicycle.parameters.bicycle import LIGHTEST_RIDDEN
from studies.main_study.compare import Amplitude, Hinge
from studies.main_study.grades import GRADE_RULES, GradedAnswer, grade_samples
from studies.main_study.next_measurement import Gain, rank_measurements
from studies.main_study.result import Result, Span
from studies.main_study.samples import Samples, front_draws
from studies.main_study.settings import ASSUMED, LIMITS, OF_ARMS, OF_FRONT, SADDLE, Settings, Setup
from studies.main_study.study import Study, pressure_ends
from tyre.ground.arrays import Array

# Steer amplitude of wobble: it lasts; not known; none without an impulse; none
LASTS, NOT_KNOWN, KICKED, NONE = "lasts", "not known", "kicked", "none"
OF_TYRE = {"trail": "pneumatic trail", "twisting": "twisting torque", "camber_share": "camber stiffness"}


class Cell(NamedTuple):
    """Wobble of one case at one pressure."""

    span: Span | None  # None: no wobble
    graded: GradedAnswer | None  # does it wobble at ridden speeds? None: no samples were drawn


class PressureChange(NamedTuple):
    """Change from the high to the low pressure in the samples of one case: median and interval of 90 %."""

    onset: tuple[float, float, float] | None  # m/s: median, low, high; None: too few samples wobble at both pressures
    growth: tuple[float, float, float]  # 1/s, of the fastest growth at ridden speeds, likewise
    some_wobble: bool  # at ridden speeds, at either pressure


@dataclass(frozen=True)
class CaseComparison:
    """Wobble of the tyre in question in one case at both ends of its pressures; ``high`` is None for one condition."""

    setup: Setup  # hands and front frame
    low: Result  # at the lowest pressure, or at the one condition
    high: Result | None
    limit: float  # m/s, highest speed that is looked at
    graded: tuple[GradedAnswer, ...]  # does it wobble at ridden speeds? as ``results``; empty: no samples were drawn
    change: PressureChange | None  # None: one condition, or no samples

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
        answers = self.graded or (None, None)
        return [Cell(span, answer) for span, answer in zip(self.spans, answers, strict=False)]

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

    graded: GradedAnswer  # for it: samples whose wobble is worse; of one condition: samples that wobble
    front_known: bool  # False: no front frame is known, and none is assumed
    cases: tuple[CaseComparison, ...]  # reference first
    case_count: int  # cases that were asked for
    hinges: tuple[Hinge, ...]  # the largest change of the minimum damping ratio first
    steer_amplitudes: tuple[SteerAmplitude, ...]  # at the lowest and, if there are two, at the highest pressure
    assumed: tuple[str, ...]  # names of what is assumed and not measured
    gains: tuple[Gain, ...]  # what to measure next, the greatest gain first; the first is as it is
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
    def useful_gains(self) -> list[Gain]:
        """Measurements, at most three, that are expected to make another answer definite."""
        return [gain for gain in self.gains[1:4] if round(gain.definite) > round(self.gains[0].definite)]

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
            around = [study.samples_around(result) for result in (low, high) if result]
            drawn = [sample for sample in around if sample and sample.count]
            graded: tuple[GradedAnswer, ...] = ()
            if settings.front:  # without a front frame wobble cannot be judged
                graded = tuple(_grade_wobble(settings, study.assumed_of_tyre, sample) for sample in drawn)
            change = compare_pressures(drawn[0], drawn[1]) if len(drawn) == 2 else None
            cases.append(CaseComparison(setup, low, high, limit, graded, change))
    reference = cases[0]
    definite = sum(graded.grade.definite for case in cases for graded in case.graded)
    every_assumption = unmeasured(settings, study.assumed_of_tyre, hands_on=True)
    return Answer(
        graded=grade(settings, study.assumed_of_tyre, *map(study.samples_around, reference.results)),
        front_known=settings.front is not None,
        cases=tuple(cases),
        case_count=len(settings.setups),
        hinges=tuple(hinge for hinge in study.hinges if hinge.comparable),
        steer_amplitudes=tuple(_judge_size(study, amplitude) for amplitude in study.amplitudes),
        assumed=_name_assumed(study),
        gains=tuple(rank_measurements(settings, study.samples, every_assumption, definite)),
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
    numbers = {name: values[computed] for name, values in unmeasured(settings, assumed_of_tyre).items()}
    if len(drawn) == 1:
        return grade_samples(np.where(drawn[0].range[computed] >= LIMITS.practical, 1, -1), numbers, either=True)
    return grade_samples(votes_for_worse(drawn[0], drawn[1])[computed], numbers)


def _grade_wobble(settings: Settings, assumed_of_tyre: tuple[str, ...], sample: Samples) -> GradedAnswer:
    """Grade by the samples of a case whether it wobbles at ridden speeds."""
    numbers = unmeasured(settings, assumed_of_tyre, hands_on=sample.setup.arms is not None)
    votes = np.where(sample.wobbles_ridden[sample.computed], 1, -1)
    return grade_samples(votes, {name: values[sample.computed] for name, values in numbers.items()}, either=True)


def compare_pressures(low: Samples, high: Samples) -> PressureChange:
    """Compare onset and fastest growth of the same samples at both pressures."""
    computed = low.computed & high.computed
    onset = (low.onset - high.onset)[computed]
    onset = onset[np.isfinite(onset)]
    growth = np.array([np.maximum(sample.peak, LIMITS.slowest) for sample in (low, high)])[:, computed]
    quantiles = (0.5, *LIMITS.likely)

    def spread(changes: Array) -> tuple[float, float, float]:
        middle, smallest, largest = np.quantile(changes, quantiles)
        return float(middle), float(smallest), float(largest)

    some_wobble = bool((low.wobbles_ridden | high.wobbles_ridden)[computed].any())
    onset_change = spread(onset) if len(onset) >= LIMITS.fewest else None
    return PressureChange(onset_change, spread(growth[0] - growth[1]), some_wobble)


def votes_for_worse(low: Samples, high: Samples) -> Array:
    """Vote (n,) of each sample: 1 if wobble is worse at the ``low`` pressure than at the ``high`` one, -1 better, 0.

    It is worse if its range is wider by :attr:`Limits.practical`, or its fastest growth greater by
    :attr:`Limits.practical_growth`; range and growth that contradict each other give 0.
    """
    change = low.range - high.range
    growths = [np.maximum(sample.peak, LIMITS.growth) for sample in (low, high)]  # slower growth is no wobble
    growth_change = growths[0] - growths[1]
    by_range = np.sign(change) * (np.abs(change) >= LIMITS.practical)
    by_growth = np.sign(growth_change) * (np.abs(growth_change) >= LIMITS.practical_growth)
    return np.asarray(np.sign(by_range + by_growth))


def unmeasured(settings: Settings, assumed_of_tyre: tuple[str, ...], *, hands_on: bool = False) -> Mapping[str, Array]:
    """Numbers (samples,) of each assumption of a case that was not measured, in the units of its range."""
    drawn, front = front_draws(settings), settings.front
    names = list(assumed_of_tyre)
    if front:
        names += [*OF_FRONT, "hinge"] if not front.from_file else front.defaults
    if settings.ranges.friction[1] > 0:
        names.append("friction")
    names += [name for name in ("saddle_stiffness", "saddle_damping_ratio") if name in drawn]
    if hands_on:
        names += [f"arm_{name}" for name in (settings.arms.defaults if settings.arms.from_file else OF_ARMS)]
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
        "question": "worse" if answer.asks_pressure else "wobbles",
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
                "wobbles_at_ridden_speeds": [
                    {
                        "grade": graded.grade.value,
                        "share": graded.for_it / graded.count,
                        "depends_on": graded.split and graded.split.name,
                    }
                    for graded in case.graded
                ],
                "change_by_lower_pressure": case.change
                and {
                    "onset_m_s": _spread_record(case.change.onset),
                    "growth_1_s": _spread_record(case.change.growth),
                },
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
        "measure_next": [
            {"measure": gain.group or None, "expected_definite": gain.definite, "of": gain.count}
            for gain in answer.gains
        ],
        "one_at_a_time": [{"what": hinge.what, "change_of_min_damping_ratio": hinge.size} for hinge in answer.hinges],
    }


def _spread_record(change: tuple[float, float, float] | None) -> dict[str, float] | None:
    """Make a median with its interval JSON-ready."""
    return None if change is None else dict(zip(("median", "low", "high"), change, strict=True))


def rule_record() -> dict[str, Any]:
    """Make the rule of the grades JSON-ready."""
    return {
        "least_change_m_s": LIMITS.practical,
        "least_change_of_growth_1_s": LIMITS.practical_growth,
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
