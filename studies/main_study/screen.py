"""Facts of the first screen: sign and size of what less air does, how sure, what it hinges on, how far to believe it.

Numbers and objects only; the template ``answer.md.j2`` makes the words, for terminal and report.
"""

import math
from dataclasses import dataclass

import numpy as np

from studies.main_study.cases import TyreCase
from studies.main_study.compare import ContactLength, Hinge, Plausible
from studies.main_study.result import WEAVE, Result, Span
from studies.main_study.settings import CONTACT_LENGTH, LIMITS, Setup
from studies.main_study.study import Study, pressure_ends


@dataclass(frozen=True)
class Tally:
    """Random bicycles whose unstable wobble covers more speeds at the lower pressure, fewer, or as many."""

    more: int
    fewer: int
    neither: int
    stable: bool = False

    @property
    def count(self) -> int:
        """Number of bicycles that were compared."""
        return self.more + self.fewer + self.neither


@dataclass(frozen=True)
class World:
    """Unstable wobble of the tyre in question in another world: at ``unstable`` of ``count`` pressures, or nowhere."""

    setup: Setup
    span: Span | None
    unstable: int
    count: int


@dataclass(frozen=True)
class Why:
    """Reasons for the wobble of this bicycle: what alone takes it away, or makes it begin ``later`` (onset, m/s)."""

    result: Result
    span: Span
    gone: tuple[tuple[str, str], ...]
    later: tuple[tuple[str, str, float], ...]

    @property
    def doubling(self) -> float | None:
        """Time (s) in which the least damped amplitude doubles; None if it does not grow."""
        least = self.result.least
        return math.log(2) / least.eigenvalue.real if least and least.eigenvalue.real > 0 else None


@dataclass(frozen=True, eq=False)
class Answer:
    """Everything that the first screen tells of the tyre in question, in the reference world."""

    asks_pressure: bool
    own: Result | None
    others: int
    worse: int
    high: Result | None
    low: Result | None
    tally: Tally
    verdict: str
    worlds: tuple[World, ...]
    hinges: tuple[Hinge, ...]
    onset: tuple[TyreCase, float] | None
    strings: tuple[ContactLength, ...]
    weave: tuple[float, ...]
    why: Why | None

    @property
    def named(self) -> list[tuple[int, Hinge]]:
        """The first four things it hinges on and pressure, each with its rank."""
        return [(k, one) for k, one in enumerate(self.hinges, 1) if k <= 4 or one.what == "pressure"]


def answer(study: Study) -> Answer:
    """Gather the facts of the first screen."""
    settings, ends = study.settings, pressure_ends(list(study.subject))
    results = study.of(settings.reference, study.names[0])
    focus = study.result(settings.reference, study.focus)
    high, low = (study.result(settings.reference, case) for case in ends[0]) if ends else (None, None)
    tally = tallied(study.outer(high), study.outer(low))
    own = focus if settings.contact is not None or not ends else None
    others = [r.least.damping_ratio for r in study.of(settings.reference) if r.case.name != study.names[0] and r.least]
    if own is None or own.least is None:
        others = []
    strings = [one for one in study.contact_lengths if not one.estimated]
    weave = [[c.speed for c in r.crossings if c.mode == WEAVE and c.destabilising] for r in results]
    return Answer(
        settings.contact is None and bool(ends), own, len(others),
        sum(own is not None and own.least is not None and ratio < own.least.damping_ratio for ratio in others),
        high, low, tally, verdict(high, low, tally) if high and low else "", tuple(_worlds(study)),
        tuple(one for one in study.hinges if one.low.least and one.high.least), _onset(study, results),
        tuple(dict.fromkeys((strings[0], strings[-1]))) if strings else (),
        tuple(min(speeds) for speeds in weave if speeds and min(speeds) <= settings.fastest), _why(study, focus),
    )  # fmt: skip


def verdict(high: Result, low: Result, tally: Tally) -> str:
    """Name the sign, and how sure it is over the plausible fronts; if few of them wobble, by the damping."""
    told = tally.more + tally.fewer
    before, after = (one.least.damping_ratio if one.least else None for one in (high, low))
    closer = None if before is None or after is None or abs(after - before) < LIMITS.seen else after < before
    if told > LIMITS.few * tally.count:
        share = tally.more / told
        sign, sure = share > 0.5, max(share, 1 - share)
        if sure < LIMITS.probable or (closer is not None and closer != sign):
            return "It depends on the front."
        probably = "" if sure >= LIMITS.clear else ", probably"
        return f"Yes{probably}: closer." if sign else f"No{probably}: farther away."
    if closer is None:
        return "No difference that matters."
    if not closer:
        return "Farther away."
    return "Closer, but stable." if tally.stable else "Closer."


def tallied(high: Plausible | None, low: Plausible | None) -> Tally:
    """Compare the same random bicycles at two pressures."""
    if high is None or low is None:
        return Tally(0, 0, 0)
    widths = [np.nan_to_num(one.end - one.onset, nan=0.0) for one in (high, low)]
    kept = high.computed & low.computed
    change = (widths[1] - widths[0])[kept]
    stable = bool(kept.any()) and all(one.without == one.count for one in (high, low))
    return Tally(int((change > 0).sum()), int((change < 0).sum()), int((change == 0).sum()), stable)


def _worlds(study: Study) -> list[World]:
    limit, found = study.settings.fastest, []
    for setup in study.settings.setups[1:]:
        spans = [r.span(limit) for r in study.of(setup, study.names[0])]
        there = [span for span in spans if span]
        joined = Span(min(s.low for s in there), max(s.high for s in there), limit) if there else None
        if spans:
            found.append(World(setup, joined, len(there), len(spans)))
    return found


def _onset(study: Study, results: list[Result]) -> tuple[TyreCase, float] | None:
    """Take the first case of the tyre in question whose wobble has an onset; none if its tyre is no single lag."""
    if CONTACT_LENGTH in study.settings.further:
        return None
    for r in results:
        bands = r.bands(study.settings.fastest)
        if bands and bands[0].start:
            return r.case, bands[0].start.speed / bands[0].start.frequency_hz
    return None


def _why(study: Study, own: Result | None) -> Why | None:
    """Look for what removes a wobble that begins at ridden speeds; real bicycles seldom have one."""
    span = own.span(study.settings.fastest) if own else None
    if own is None or span is None or span.low > LIMITS.ridden[1]:
        return None
    ends = [(hinge.what, end) for hinge in study.hinges for end in (hinge.low, hinge.high)]
    gone = tuple((what, end.what) for what, end in ends if end.span is None and what != "pressure")
    later = [
        (what, end.what, end.span.low) for what, end in ends if end.span and end.span.low > LIMITS.later * span.low
    ]
    return Why(own, span, gone, tuple(sorted(later, key=lambda one: one[2], reverse=True)[:4]))
