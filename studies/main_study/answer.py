"""The first screen: the question, the answer in sign and size, what it hinges on, and how far to believe it.

Every sentence is put together from the numbers of the study; a sentence whose numbers are missing is not written.
"""

import math
from dataclasses import dataclass

import numpy as np

from studies.main_study.answer_reasons import RIDDEN_WORDS, belief_words, hinge_words, speed, why_words
from studies.main_study.bands import WEAVE, Span
from studies.main_study.cases import GIVEN, TyreCase
from studies.main_study.plausible import FEWEST, Plausible
from studies.main_study.solve import Result
from studies.main_study.study import Study, pressure_ends

CLEAR, LIKELY = 0.95, 0.8  # shares of the random bicycles that make a sign sure, or likely
FEW = 0.1  # of the random bicycles: where fewer wobble, the damping tells the sign
SEEN = 0.005  # of a damping ratio: a smaller change is none


@dataclass(frozen=True)
class Answer:
    """The question and the sentences of the first screen, and why this bicycle wobbles although most do not."""

    question: str
    sentences: tuple[tuple[str, str], ...]
    why: str


@dataclass(frozen=True)
class Tally:
    """Random bicycles whose unstable wobble covers more speeds at the lower pressure, fewer, or as many.

    ``stable`` is whether no bicycle wobbles at either pressure.
    """

    more: int
    fewer: int
    neither: int
    stable: bool = False

    @property
    def count(self) -> int:
        """All that were compared."""
        return self.more + self.fewer + self.neither


def answer(study: Study) -> Answer:
    """Put the first screen together: four sentences with a label each, one more where weave becomes unstable."""
    settings = study.settings
    ends = pressure_ends(list(study.subject))
    results = study.of(settings.reference, study.names[0])
    own = study.result(settings.reference, study.focus)
    sentences: list[tuple[str, str]] = []
    sure = ""
    if (settings.contact is not None or not ends) and own is not None:
        first, sure = single_words(study, own)
        sentences.append(first)
    if ends:
        first, sure = pressure_words(study, *ends[0])
        sentences.append((f"Less air: {first[0].lower()}", first[1]) if sentences else first)
    sentences += [
        ("How sure:", f"{sure} {worlds_words(study, results)}".strip()), ("It hinges on", hinge_words(study)),
        ("How far to believe it:", belief_words(study, results)), ("Beside wobble:", weave_words(study, results)),
    ]  # fmt: skip
    return Answer(question(study), tuple(pair for pair in sentences if pair[1]), why_words(study))


TRACKS = {"flat": "on a flat track", "drum": "on a drum"}


def question(study: Study) -> str:
    """What is asked."""
    case, bicycle = study.focus, study.settings.bicycle.name
    measured = f" (measured {TRACKS[case.surface]})" if case.surface in TRACKS else ""
    if study.settings.contact is None and pressure_ends(list(study.subject)):
        return f"Does less air in {case.tyre}{measured} bring {bicycle} closer to wobble?"
    if case.condition == GIVEN:
        return f"Does {bicycle} wobble on the {case.name}?"
    return f"Does {bicycle} wobble on {case.tyre} at {case.condition}{measured}?"


def pressure_words(study: Study, higher: TyreCase, lower: TyreCase) -> tuple[tuple[str, str], str]:
    """Sign and size of what less air does, hands off and with a flexible front, and how sure they are."""
    reference, limit = study.settings.reference, study.settings.fastest
    high, low = study.result(reference, higher), study.result(reference, lower)
    assert high is not None  # ends are of cases that were computed
    assert low is not None
    tally = tallied(study.outer(high), study.outer(low))
    spans = [one.span(limit) for one in (high, low)]
    instead = (
        f"At {lower.condition} instead of {higher.condition}, hands off the bar and with a flexible front, wobble is"
    )
    if spans[0] and spans[1] and spans[0].words == spans[1].words:
        moved = f"{instead} unstable {spans[1].words}, as before"
    elif spans[0] and spans[1]:
        moved = f"{instead} unstable {spans[1].words} instead of {spans[0].words}"
    elif spans[1]:
        moved = f"{instead} unstable {spans[1].words} instead of stable up to {speed(limit)}"
    elif spans[0]:
        moved = f"{instead} stable up to {speed(limit)} instead of unstable {spans[0].words}"
    else:
        moved = f"{instead} stable up to {speed(limit)}, as before"
    far = far_words(low.case, high.case)
    return (verdict(high, low, tally), f"{moved}{damping_words(high, low)}.{far}"), tally_words(study, tally, low)


def far_words(*cases: TyreCase) -> str:
    """Whether tyre values are extrapolated, and how far."""
    if any(case.out_of_reach for case in cases):
        return " The wheel loads or pressures are so far outside the tyre tests that its values are a guess."
    return " The tyre's values are extrapolated." if any(case.extrapolated for case in cases) else ""


def verdict(high: Result, low: Result, tally: Tally) -> str:
    """The sign, and how sure it is over the plausible fronts."""
    told = tally.more + tally.fewer
    before, after = (one.least.damping_ratio if one.least else None for one in (high, low))
    closer = None if before is None or after is None or abs(after - before) < SEEN else after < before
    if told > FEW * tally.count:
        share = tally.more / told
        closer_share = max(share, 1 - share)
        sign = share > 0.5
        if closer is not None and closer != sign:
            return "It depends on the front."
        if closer_share >= LIKELY:
            sure = "" if closer_share >= CLEAR else ", probably"
            return f"Yes{sure}: closer." if sign else f"No{sure}: farther away."
        return "It depends on the front."
    if closer is None:
        return "No difference that matters."
    stable = ", but stable" if tally.stable else ""
    return f"Closer{stable}." if closer else "Farther away."


def damping_words(high: Result, low: Result) -> str:
    """How the least damping changes where people ride."""
    if high.least is None or low.least is None:
        return ""
    before, after = high.least.damping_ratio, low.least.damping_ratio
    moves = "hardly moves," if abs(after - before) < SEEN else "falls" if after < before else "rises"
    return f"; its least damping ratio {RIDDEN_WORDS} {moves} from {before:.3f} to {after:.3f}"


def tallied(high: Plausible | None, low: Plausible | None) -> Tally:
    """Compare the same random bicycles at two pressures."""
    if high is None or low is None:
        return Tally(0, 0, 0)
    widths = [np.nan_to_num(one.end - one.onset, nan=0.0) for one in (high, low)]
    kept = high.computed & low.computed
    change = (widths[1] - widths[0])[kept]
    stable = bool(kept.any()) and all(one.without == one.count for one in (high, low))
    return Tally(int((change > 0).sum()), int((change < 0).sum()), int((change == 0).sum()), stable)


def tally_words(study: Study, tally: Tally, low: Result) -> str:
    """How the sign and the place hold over the plausible fronts."""
    outer = study.outer(low)
    if not tally.count or outer is None:
        return ""
    if tally.stable:
        return f"of {tally.count} random bicycles with plausible fronts none wobbles, at either pressure."
    are = "is" if tally.more == 1 else "are"
    words = (
        f"of {tally.count} random bicycles with plausible fronts, {tally.more or 'none'} {are} unstable at more speeds "
        f"with less air, {tally.fewer or 'none'} at fewer, and {tally.neither or 'none'} do not differ."
    )
    onset = outer.likely("onset")
    if onset:
        words += f" The speeds are less sure: at {low.case.condition} {begins(outer, *onset)}"
        if outer.without:
            words += f", and {outer.without} of {outer.count} do not wobble up to {speed(study.settings.fastest)}"
        words += "."
    return words


def begins(outer: Plausible, low: float, high: float) -> str:
    """Where those that wobble begin to: between ``low`` and ``high`` (m/s) of :meth:`Plausible.likely`."""
    count = outer.count - outer.without
    if count == 1:
        return f"the only one that wobbles begins at {speed(low)}"
    who = f"the {count} that wobble" if count < FEWEST else "nine of ten of those that wobble"
    if f"{low:.1f}" == f"{high:.1f}":
        return f"{who} begin at {speed(low)}"
    return f"{who} begin between {low:.1f} and {speed(high)}"


def single_words(study: Study, result: Result) -> tuple[tuple[str, str], str]:
    """Where wobble is unstable on a tyre of one condition, and how it stands among the others."""
    span = result.span(study.settings.fastest)
    state = f"wobble is unstable {span.words}" if span else f"wobble is stable up to {speed(study.settings.fastest)}"
    far = far_words(result.case)
    first = ("Yes." if span else "No.", f"With hands off the bar and a flexible front, {state}{_least(result)}.{far}")
    sure = fronts_words(study, result)
    others = [r for r in study.of(result.setup) if r.case.name != result.case.name and r.least]
    if not others or result.least is None:
        return first, sure
    worse = sum(r.least.damping_ratio < result.least.damping_ratio for r in others if r.least)
    return first, (
        f"{sure} Of {len(others)} conditions of other tyres, wobble is less damped {RIDDEN_WORDS} on {worse or 'none'} "
        f"and more on {len(others) - worse or 'none'}."
    )


def fronts_words(study: Study, result: Result) -> str:
    """How many of the random bicycles wobble, and where they begin to."""
    outer = study.outer(result)
    if outer is None or not outer.count:
        return ""
    onset = outer.likely("onset")
    if onset is None:
        return f"none of {outer.count} random bicycles with plausible fronts wobbles."
    return (
        f"{outer.count - outer.without} of {outer.count} random bicycles with plausible fronts wobble; "
        f"{begins(outer, *onset)}."
    )


def worlds_words(study: Study, results: list[Result]) -> str:
    """The other three worlds, at the pressures of the tyre in question."""
    limit = study.settings.fastest
    stable, others = [], []
    for setup in study.settings.setups[1:]:
        spans = [r.span(limit) for r in study.of(setup, results[0].case.name)]
        there = [span for span in spans if span]
        if there:
            of = "" if len(there) == len(spans) else f" at {len(there)} of {len(spans)} pressures"
            others.append(f"with {setup.words} it is unstable{of} {joined(there).words}")
        elif spans:
            stable.append(setup.words)
    words = [f"with {', '.join(stable)} wobble is stable up to {speed(limit)}"] if stable else []
    text = "; ".join(words + others)
    return f"{text[0].upper()}{text[1:]}." if text else ""


def weave_words(study: Study, results: list[Result]) -> str:
    """Where weave grows at a speed that is looked at, hands off and with a flexible front; empty where it does not."""
    limit = study.settings.fastest
    first = [
        min((c.speed for c in r.crossings if c.mode == WEAVE and c.destabilising), default=math.inf) for r in results
    ]
    onsets = [v for v in first if v <= limit]
    if not onsets:
        return ""
    low, high = min(onsets), max(onsets)
    where = f"from {speed(low)} on" if f"{low:.1f}" == f"{high:.1f}" else f"from between {low:.1f} and {speed(high)} on"
    of = f", at {len(onsets)} of {len(results)} pressures" if len(results) > 1 else ""
    return f"weave becomes unstable {where}{of}."


def joined(spans: list[Span]) -> Span:
    """From the lowest onset to the highest end."""
    return Span(min(span.low for span in spans), max(span.high for span in spans), spans[0].limit)


def _least(result: Result) -> str:
    if result.least is None:
        return ""
    return (
        f"; its least damping ratio {RIDDEN_WORDS} is {result.least.damping_ratio:.3f}, at {speed(result.least.speed)}"
    )
