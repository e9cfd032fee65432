"""The main study: measured tyres at their pressures in four worlds -> modes, critical speeds, and what decides them.

No physics lives here: cases are made in ``cases``, solved in ``solve``.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from studies.main_study.cases import Cases, TyreCase, tyre_cases
from studies.main_study.checks import Check, chosen, safe_check
from studies.main_study.contact_length import ContactLength, contact_lengths
from studies.main_study.decompose import Decomposition, decompose
from studies.main_study.hinges import Hinge, hinges
from studies.main_study.parallel import Each, spread
from studies.main_study.plausible import Plausible, plausible
from studies.main_study.postures import Posture, postures
from studies.main_study.settings import Settings, Setup
from studies.main_study.solve import Result, solve
from tyre.base.errors import InputError

Step = Callable[[str], None]
TYPICAL_BAR = 5.5


@dataclass(frozen=True, eq=False)
class Study:
    """Everything the main study found; ``left_out`` says what could not be computed, and why.

    ``cases`` come tyre by tyre, by rising pressure; ``focus`` is the one that is looked at in detail.
    """

    settings: Settings
    cases: tuple[TyreCase, ...]
    focus: TyreCase
    left_out: tuple[str, ...]
    results: tuple[Result, ...]
    decompositions: tuple[Decomposition, ...]
    plausible: tuple[Plausible, ...]
    hinges: tuple[Hinge, ...]
    contact_lengths: tuple[ContactLength, ...]
    postures: tuple[Posture, ...]
    checks: tuple[Check, ...]

    @property
    def names(self) -> list[str]:
        """Tyres with their surfaces, in order; the question is about the first."""
        return list(dict.fromkeys(case.name for case in self.cases))

    @property
    def conditions(self) -> list[str]:
        """All pressures in words, by rising pressure."""
        return list(dict.fromkeys(case.condition for case in sorted(self.cases, key=by_pressure)))

    @property
    def subject(self) -> tuple[TyreCase, ...]:
        """The cases of the tyre in question, by rising pressure."""
        return tuple(case for case in self.cases if case.name == self.names[0])

    def of(self, setup: Setup, name: str | None = None) -> list[Result]:
        """Results of one setup, of the tyre and surface ``name`` if given, in the order of the cases."""
        found = (self.result(setup, case) for case in self.cases if name in (None, case.name))
        return [result for result in found if result]

    def result(self, setup: Setup, case: TyreCase) -> Result | None:
        """The result of one case; None where it could not be computed."""
        return _of(self.results, case, setup)

    def outer(self, result: Result) -> Plausible | None:
        """The random bicycles around one result."""
        return next((p for p in self.plausible if p.setup == result.setup and same(p.case, result.case)), None)

    def decomposition(self, setup: Setup, name: str) -> Decomposition | None:
        """The decomposition of the tyre and surface ``name``; None where it was measured at one pressure only."""
        return next((d for d in self.decompositions if d.setup == setup and d.higher.name == name), None)


def run_study(
    settings: Settings, step: Step = lambda what: None, *, each: Each | None = None, cases: Cases | None = None
) -> Study:
    """Compute the study; ``step`` is told of every piece of work done (see :func:`count_steps`).

    ``each`` spreads the work (see :func:`studies.main_study.parallel.spread`), by default over this process alone;
    ``cases`` are by default all of :func:`studies.main_study.cases.tyre_cases`.

    Raises
    ------
    InputError
        No tyre at all can be put on this bicycle.
    """
    if each is None:
        with spread(1, step) as here:
            return run_study(settings, step, each=here, cases=cases)
    cases = cases or tyre_cases(settings)
    pairs = [(settings, case, setup) for setup in settings.setups for case in cases.found]
    solved = each(_solved, pairs, _words)
    results = tuple(one for one in solved if isinstance(one, Result))
    left_out = list(cases.left_out)
    left_out += [
        f"{_words(*pair)}, {pair[2].label}: {one}"
        for pair, one in zip(pairs, solved, strict=True)
        if isinstance(one, str)
    ]
    if not results:
        raise InputError("no case can be computed: " + "; ".join(left_out))
    ends = pressure_ends([case for case in cases.found if all(_of(results, case, s) for s in settings.setups)])
    todo = [
        (settings, _of(results, higher, setup), _of(results, lower, setup))
        for setup in settings.setups for higher, lower in ends
    ]  # fmt: skip
    decompositions = each(decompose, todo, _cause)
    asked = [r for r in results if r.setup.front and (r.setup.arms is None or r.case.name == results[0].case.name)]
    outer = each(plausible, [(settings, r.case, r.setup) for r in asked], _fronts)
    subject = [r.case for r in results if r.setup == settings.reference and r.case.name == results[0].case.name]
    focus = subject[0] if settings.contact is not None else typical(subject)
    subject.sort(key=by_pressure)
    decides = hinges(settings, subject, focus)
    step("what it hinges on")
    lengths = contact_lengths(settings, subject)
    step("finite contact length")
    seated = postures(settings, focus)
    step("postures")
    checks = each(safe_check, [(settings, r) for r in chosen(results)], _check_words)
    done = {(r.case.name, r.case.condition): r.case for r in results}.values()
    order = list(dict.fromkeys(case.name for case in done))
    return Study(
        settings, tuple(sorted(done, key=lambda case: (order.index(case.name), by_pressure(case)))), focus,
        tuple(left_out), results, tuple(decompositions), tuple(outer), decides, lengths, seated, tuple(checks),
    )  # fmt: skip


def count_steps(settings: Settings, cases: Sequence[TyreCase]) -> int:
    """How often :func:`run_study` reports a step, where every case can be computed."""
    worlds = len(settings.setups)
    subject = sum(case.name == cases[0].name for case in cases)
    checks = worlds + (subject < len(cases))
    return worlds * (len(cases) + len(pressure_ends(cases))) + len(cases) + subject + 3 + checks


def pressure_ends(cases: Sequence[TyreCase]) -> list[tuple[TyreCase, TyreCase]]:
    """For each tyre and surface its case of highest and of lowest pressure."""
    ends = []
    for name in dict.fromkeys(case.name for case in cases):
        mine = sorted((case for case in cases if case.name == name and case.pressures_bar), key=by_pressure)
        if len(mine) > 1:
            ends.append((mine[-1], mine[0]))
    return ends


def typical(cases: Sequence[TyreCase]) -> TyreCase:
    """The case that is looked at in detail: the only one, or the pressure nearest to an ordinary one."""
    return min(cases, key=lambda case: abs(case.pressure_bar - TYPICAL_BAR) if case.pressures_bar else 0.0)


def by_pressure(case: TyreCase) -> float:
    """To sort by; a case without a pressure comes first."""
    return case.pressure_bar if case.pressures_bar else 0.0


def same(one: TyreCase, other: TyreCase) -> bool:
    """Whether two cases are the same tyre and condition (they may come from different processes)."""
    return (one.name, one.condition) == (other.name, other.condition)


def _solved(settings: Settings, case: TyreCase, setup: Setup) -> Result | str:
    try:
        return solve(settings, case, setup)
    except InputError as error:
        return str(error)


def _of(results: Sequence[Result], case: TyreCase, setup: Setup) -> Result | None:
    return next((r for r in results if r.setup == setup and same(r.case, case)), None)


def _words(settings: Settings, case: TyreCase, setup: Setup) -> str:
    return f"{case.name}, {case.condition}"


def _cause(settings: Settings, higher: Result, lower: Result) -> str:
    return f"{higher.case.name}: what causes the change"


def _fronts(settings: Settings, case: TyreCase, setup: Setup) -> str:
    return f"{case.name}, {case.condition}: plausible fronts"


def _check_words(settings: Settings, result: Result) -> str:
    return "Monte Carlo"
