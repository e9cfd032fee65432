"""The answer: what less air does to the wobble of a bicycle in four worlds and on plausible bicycles, by one rule.

Less air moves wobble where the range of its unstable speeds becomes longer, or shorter, by :attr:`Limits.practical`.

- ``yes``: it moves one way in a world that rests on no assumed front, the other way in none, and in at least
  :attr:`Limits.agree` of the plausible bicycles likewise.
- ``no practical difference``: it moves in none of the four worlds, and in at most the rest of the plausible bicycles.
- ``cannot be said``: all else, and whenever a world is not known.

A tyre of one condition has no less air; then the question is if it wobbles at all, over as many speeds, by that rule.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from studies.main_study.compare import Hinge
from studies.main_study.result import Result, Span
from studies.main_study.settings import LIMITS, Setup
from studies.main_study.study import Study, pressure_ends
from tyre.ground.arrays import Array

YES, NO_DIFFERENCE, NO, UNKNOWN = "yes", "no practical difference", "no", "cannot be said"


@dataclass(frozen=True)
class World:
    """Wobble of the tyre in question in one world at both ends of its pressures; ``high`` is None for one condition."""

    setup: Setup  # hands and front
    low: Result  # at the lowest pressure, or at the one condition
    high: Result | None
    longer: float  # m/s of unstable speeds at the low pressure more than at the high one, or at all
    assumed: bool  # rests on a front that nobody measured

    @property
    def moves(self) -> int:
        """1 if less air brings wobble closer, -1 if farther away, 0 if no rider meets the difference."""
        return int(np.sign(self.longer)) if abs(self.longer) >= LIMITS.practical else 0


@dataclass(frozen=True, eq=False)
class Answer:
    """Facts of the first screen on the tyre in question."""

    word: str  # YES, NO_DIFFERENCE, NO or UNKNOWN
    worlds: tuple[World, ...]  # reference first
    longer: int  # plausible bicycles that less air brings closer
    shorter: int  # plausible bicycles from which less air takes wobble farther away
    count: int  # plausible bicycles that are compared
    hinges: tuple[Hinge, ...]  # the largest change of the least damping ratio first

    @property
    def whole(self) -> bool:
        """True if all four worlds are known."""
        return len(self.worlds) == 4

    @property
    def asks_pressure(self) -> bool:
        """True if there are two pressures to compare."""
        return self.worlds[0].high is not None

    @property
    def change(self) -> float | None:
        """Change of the least damping ratio in the reference world by less air; None if one pressure has no wobble."""
        low, high = self.worlds[0].low.least, self.worlds[0].high and self.worlds[0].high.least
        return low.damping_ratio - high.damping_ratio if low and high else None

    @property
    def place(self) -> int | None:
        """Place of the pressure among what it hinges on, from 1; None for one pressure."""
        return next((k for k, hinge in enumerate(self.hinges, 1) if hinge.what == "pressure"), None)


def answer(study: Study) -> Answer:
    """Gather the facts of the first screen."""
    settings, limit = study.settings, study.settings.fastest
    ends = pressure_ends(study.subject)
    high_case, low_case = ends[0] if ends else (None, study.focus)
    worlds = []
    for setup in settings.setups:
        low = study.result(setup, low_case)
        high = study.result(setup, high_case) if high_case else None
        if low and (high or not high_case):
            longer_by = unstable_length(low.span(limit), limit)
            if high:
                longer_by -= unstable_length(high.span(limit), limit)
            worlds.append(World(setup, low, high, longer_by, setup.front is not None and not setup.front.from_file))
    change = _sampled_change(study, worlds[0])
    longer, shorter = (int((sign * change >= LIMITS.practical).sum()) for sign in (1, -1))
    moves = [(world.moves, world.assumed) for world in worlds]
    return Answer(
        word=word_of(moves, longer, shorter, len(change), two=bool(ends)),
        worlds=tuple(worlds),
        longer=longer,
        shorter=shorter,
        count=len(change),
        hinges=tuple(hinge for hinge in study.hinges if np.isfinite(hinge.size)),
    )


def _sampled_change(study: Study, world: World) -> Array:
    """Change of the length of unstable speeds, m/s, by less air, of each plausible bicycle (n,); empty if none drawn.

    Of a tyre of one condition it is the length itself.
    """
    samples = []
    for result in (world.low, world.high):
        if result:
            bicycles = study.samples_around(result)
            if not bicycles:
                return np.zeros(0)
            samples.append(bicycles)
    computed = np.logical_and.reduce([bicycles.computed for bicycles in samples])
    low_length, *high_length = (bicycles.unstable[computed] for bicycles in samples)
    return np.asarray(low_length - sum(high_length))


def unstable_length(span: Span | None, limit: float) -> float:
    """Length (m/s) of the unstable speeds up to ``limit``."""
    return min(span.high, limit) - span.low if span else 0.0


def word_of(worlds: list[tuple[int, bool]], longer: int, shorter: int, count: int, *, two: bool = True) -> str:
    """Choose the word: ``worlds`` holds how each moves and if it rests on an assumed front (see the module).

    ``longer`` and ``shorter`` of ``count`` plausible bicycles move so; ``two`` is False for a tyre of one condition.
    """
    if len(worlds) < 4:
        return UNKNOWN
    directions = {moves for moves, _ in worlds} - {0}
    if not directions:
        return (NO_DIFFERENCE if two else NO) if (longer + shorter <= (1 - LIMITS.agree) * count) else UNKNOWN
    agree = longer if directions == {1} else shorter
    measured = any(moves and not assumed for moves, assumed in worlds)
    return YES if len(directions) == 1 and measured and agree >= LIMITS.agree * count else UNKNOWN


def record(study: Study, answer: Answer) -> dict[str, Any]:
    """Make the answer JSON-ready: the question, the word, the table of worlds, and the numbers of the rule."""
    limit = study.settings.fastest

    def end(result: Result | None) -> dict[str, Any] | None:
        if result is None:
            return None
        span = result.span(limit)
        return {
            "pressure_bar": list(result.case.pressures_bar),
            "relaxation_length_m": result.case.contact[1::2].tolist(),
            "unstable": span is not None,
            "from_m_s": span.low if span else None,
            "to_m_s": span.high if span and span.high <= limit else None,
            "least_damping_ratio": result.least.damping_ratio if result.least else None,
        }

    return {
        "bicycle": study.settings.bicycle.name,
        "tyre": study.focus.tyre,
        "surface": study.focus.surface,
        "word": answer.word,
        "searched_m_s": [0.0, limit],
        "worlds": [
            {
                "hands": world.setup.hands,
                "front": world.setup.front_name,
                "front_assumed": world.assumed,
                "low": end(world.low),
                "high": end(world.high),
                "longer_m_s": world.longer,
                "moves": world.moves,
            }
            for world in answer.worlds
        ],
        "rule": {
            "least_change_m_s": LIMITS.practical,
            "share_that_must_agree": LIMITS.agree,
            "plausible_bicycles": answer.count,
            "longer": answer.longer,
            "shorter": answer.shorter,
        },
        "hinges": [{"what": hinge.what, "change_of_least_damping_ratio": hinge.size} for hinge in answer.hinges],
    }
