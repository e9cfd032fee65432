"""The answer: what less air does to the wobble of a bicycle in four worlds and on plausible bicycles, by one rule.

Less air moves wobble where the range of its unstable speeds becomes longer, or shorter, by :attr:`Limits.practical`.

- ``yes``: it moves one way in a world that rests on no assumed front, the other way in none, and in at least
  :attr:`Limits.agree` of the plausible bicycles likewise.
- ``no practical difference``: it moves in none of the four worlds, and in at most the rest of the plausible bicycles.
- ``inconclusive``: all else, and whenever a world is not known.

A tyre of one condition has no less air; then the question is if it wobbles at all, over as many speeds, by that rule.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from studies.main_study.compare import Amplitude, Hinge
from studies.main_study.result import Result, Span
from studies.main_study.settings import LIMITS, Setup
from studies.main_study.study import Study, pressure_ends
from tyre.ground.arrays import Array

YES, NO_DIFFERENCE, NO, UNKNOWN = "yes", "no practical difference", "no", "inconclusive"

# Why it inconclusive: no front is known or assumed; a world could not be computed; no world moves, but plausible
# bicycles do; worlds move both ways; the plausible bicycles do not agree; only worlds of an assumed front move.
NO_FRONT, WORLD_MISSING, BICYCLES_MOVE = "no front", "world missing", "bicycles move"
WORLDS_DIFFER, BICYCLES_DIFFER, FRONT_ASSUMED = "worlds differ", "bicycles differ", "front assumed"

# Size of the wobble at the bar: it lasts; not known; none without a kick; none
LASTS, NOT_KNOWN, KICKED, NONE = "lasts", "not known", "kicked", "none"
OF_TYRE = {"trail": "trail", "twisting": "twisting torque", "camber_share": "camber thrust"}


@dataclass(frozen=True)
class World:
    """Wobble of the tyre in question in one world at both ends of its pressures; ``high`` is None for one condition."""

    setup: Setup  # hands and front
    low: Result  # at the lowest pressure, or at the one condition
    high: Result | None
    limit: float  # m/s, up to which speeds are looked at

    @property
    def results(self) -> tuple[Result, ...]:
        """At the lowest and, if there are two, at the highest pressure."""
        return (self.low, self.high) if self.high else (self.low,)

    @property
    def spans(self) -> list[Span | None]:
        """Unstable wobble of each of the ``results``; None where there is none."""
        return [result.span(self.limit) for result in self.results]

    @property
    def longer(self) -> float:
        """Unstable speeds, m/s, at the low pressure more than at the high one, or at all."""
        low, *high = (unstable_length(span, self.limit) for span in self.spans)
        return low - sum(high)

    @property
    def alike(self) -> bool:
        """True if the change of the unstable speeds prints as 0.0 m/s."""
        return abs(self.longer) < 0.05

    @property
    def assumed(self) -> bool:
        """True if the world rests on a front that nobody measured."""
        return self.setup.assumed

    @property
    def extrapolated(self) -> bool:
        """True if a wheel load or a pressure is outside the measured range."""
        return any(result.case.extrapolated for result in self.results)

    @property
    def out_of_reach(self) -> bool:
        """True if a wheel load or a pressure is far outside of what was measured."""
        return any(result.case.out_of_reach for result in self.results)

    @property
    def moves(self) -> int:
        """1 if less air brings wobble closer, -1 if farther away, 0 if no rider meets the difference."""
        return int(np.sign(self.longer)) if abs(self.longer) >= LIMITS.practical else 0


@dataclass(frozen=True, eq=False)
class BarWobble:
    """How large wobble gets at the bar in one case."""

    amplitude: Amplitude  # motions of the case in the reference world
    state: str  # LASTS, NOT_KNOWN, KICKED or NONE


@dataclass(frozen=True, eq=False)
class Answer:
    """Facts of the first screen on the tyre in question."""

    word: str  # YES, NO_DIFFERENCE, NO or UNKNOWN
    doubt: str  # NO_FRONT ... FRONT_ASSUMED: why it inconclusive; empty if it can
    worlds: tuple[World, ...]  # reference first
    longer: int  # plausible bicycles that less air brings closer
    shorter: int  # plausible bicycles from which less air takes wobble farther away
    count: int  # plausible bicycles that are compared
    hinges: tuple[Hinge, ...]  # the largest change of the least damping ratio first
    at_bar: tuple[BarWobble, ...]  # at the lowest and, if there are two, at the highest pressure
    assumed: tuple[str, ...]  # names of what is assumed and not measured

    @property
    def reference(self) -> World:
        """World in which wobble is worst."""
        return self.worlds[0]

    @property
    def asks_pressure(self) -> bool:
        """True if there are two pressures to compare."""
        return self.reference.high is not None

    @property
    def farther(self) -> bool:
        """True if the answer is yes because less air takes wobble farther away."""
        return self.word == YES and self.asks_pressure and any(world.moves < 0 for world in self.worlds)

    @property
    def unmoved(self) -> int:
        """Number of plausible bicycles that less air brings neither closer nor farther away."""
        return self.count - self.longer - self.shorter

    @property
    def tells_size(self) -> bool:
        """True if the sizes of the wobble at the bar say more than none everywhere, or not known everywhere."""
        states = {bar.state for bar in self.at_bar}
        return bool(states) and states not in ({NONE}, {NOT_KNOWN})

    @property
    def change(self) -> float | None:
        """Change of the least damping ratio in the reference world by less air; None if one pressure has no wobble."""
        low, high = self.reference.low.least, self.reference.high and self.reference.high.least
        return low.damping_ratio - high.damping_ratio if low and high else None

    @property
    def place(self) -> int | None:
        """Place of the pressure among what it hinges on, from 1; None for one pressure."""
        return next((k for k, hinge in enumerate(self.hinges, 1) if hinge.what == "pressure"), None)

    @property
    def pressure(self) -> Hinge | None:
        """Pressure as one of what it hinges on; None for one pressure."""
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
    worlds = []
    for setup in settings.setups:
        low = study.result(setup, low_case)
        high = study.result(setup, high_case) if high_case else None
        if low and (high or not high_case):
            worlds.append(World(setup, low, high, limit))
    change = _sampled_change(study, worlds[0])
    longer, shorter = (int((sign * change >= LIMITS.practical).sum()) for sign in (1, -1))
    moves = [(world.moves, world.assumed) for world in worlds]
    word = word_of(moves, longer, shorter, len(change), two=bool(ends))
    return Answer(
        word=word,
        doubt=_doubt_of(moves, front_known=settings.front is not None) if word == UNKNOWN else "",
        worlds=tuple(worlds),
        longer=longer,
        shorter=shorter,
        count=len(change),
        hinges=tuple(hinge for hinge in study.hinges if hinge.comparable),
        at_bar=tuple(_judge_size(study, amplitude) for amplitude in study.amplitudes),
        assumed=_name_assumed(study),
    )


def _judge_size(study: Study, amplitude: Amplitude) -> BarWobble:
    """Say whether the wobble of a case lasts, needs a kick, does not occur, or is not known."""
    result = study.result(study.settings.reference, amplitude.case)
    unstable = result is not None and result.span(study.settings.fastest) is not None
    if amplitude.wobble:
        state = LASTS
    elif amplitude.refused or unstable:
        state = NOT_KNOWN
    else:
        state = KICKED if amplitude.jumps else NONE
    return BarWobble(amplitude, state)


def _name_assumed(study: Study) -> tuple[str, ...]:
    """Name what is assumed of bicycle, hands and tyre; the star marks the worlds of an assumed front."""
    settings = study.settings
    names = []
    if settings.front and not settings.front.from_file:
        names.append("flexible front*")
    if not settings.arms.from_file:
        names.append("arms")
    names += settings.left_out
    if of_tyre := study.assumed_of_tyre:
        names.append(", ".join(OF_TYRE[name] for name in of_tyre) + " of the tyre")
    return tuple(names)


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
        return (NO_DIFFERENCE if two else NO) if (longer + shorter <= LIMITS.disagree * count) else UNKNOWN
    agree = longer if directions == {1} else shorter
    measured = any(moves and not assumed for moves, assumed in worlds)
    return YES if len(directions) == 1 and measured and agree >= LIMITS.agree * count else UNKNOWN


def _doubt_of(worlds: list[tuple[int, bool]], *, front_known: bool) -> str:
    """Say why it inconclusive; ``worlds`` as in :func:`word_of`."""
    moving = [(moves, assumed) for moves, assumed in worlds if moves]
    if not front_known:
        return NO_FRONT
    if len(worlds) < 4:
        return WORLD_MISSING
    if not moving:
        return BICYCLES_MOVE
    if len({moves for moves, _ in moving}) > 1:
        return WORLDS_DIFFER
    return FRONT_ASSUMED if all(assumed for _, assumed in moving) else BICYCLES_DIFFER


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
            "min_damping_ratio": result.least.damping_ratio if result.least else None,
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
        "hinges": [{"what": hinge.what, "change_of_min_damping_ratio": hinge.size} for hinge in answer.hinges],
    }
