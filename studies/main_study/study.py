"""The main study: measured tyres at their pressures in four worlds -> modes, critical speeds, and what decides them."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any

from studies.main_study import compare
from studies.main_study.cases import Cases, TyreCase, tyre_cases
from studies.main_study.result import Result, solve
from studies.main_study.settings import LIMITS, Settings, Setup
from tyre.ground.errors import InputError

Each = Callable[..., list[Any]]


@dataclass(frozen=True, eq=False)
class Study:
    """Everything the main study found; ``left_out`` holds what could not be computed, and why."""

    settings: Settings
    cases: tuple[TyreCase, ...]  # by tyre and surface, then rising pressure
    focus: TyreCase  # case of the tyre in question that is nearest to the typical pressure
    left_out: tuple[str, ...]  # tyre, condition, world and reason, a sentence each
    results: tuple[Result, ...]  # of every case in the reference world, of the tyre in question in all
    # of each tyre and surface measured at two pressures, in each world
    decompositions: tuple[compare.Decomposition, ...]
    plausible: tuple[compare.Plausible, ...]  # lowest and highest pressure of the tyre in question, reference world
    hinges: tuple[compare.Hinge, ...]  # the largest change first
    contact_models: tuple[compare.ContactModels, ...]
    sources: compare.Sources  # of the case in focus
    checks: tuple[compare.Check, ...]  # lowest and highest pressure of the tyre in question, reference world
    amplitudes: tuple[compare.Amplitude, ...]  # likewise

    @property
    def names(self) -> list[str]:
        """Tyres with their surfaces, in order; the question is about the first."""
        return list(dict.fromkeys(case.name for case in self.cases))

    @property
    def subject(self) -> tuple[TyreCase, ...]:
        """Cases of the tyre in question, by rising pressure."""
        return tuple(case for case in self.cases if case.name == self.names[0])

    def of(self, setup: Setup, name: str | None = None) -> list[Result]:
        """Results of one setup, of the tyre and surface ``name`` if given, in the order of the cases."""
        found = (self.result(setup, case) for case in self.cases if name in (None, case.name))
        return [result for result in found if result]

    def result(self, setup: Setup, case: TyreCase) -> Result | None:
        """Result of one case; None if it could not be computed."""
        return _find(self.results, case, setup)

    def outer(self, result: Result | None) -> compare.Plausible | None:
        """Random bicycles around one result."""
        return _find(self.plausible, result.case, result.setup) if result else None

    def decomposition(self, setup: Setup, name: str) -> compare.Decomposition | None:
        """Decomposition of the tyre and surface ``name``; None if it was measured at one pressure only."""
        return next((d for d in self.decompositions if d.setup == setup and d.higher.name == name), None)


@contextmanager
def spread(workers: int) -> Iterator[Each]:
    """Give ``each(work, items, what)``: results of ``work(*item)`` in order, over processes, with a bar ``what``."""
    from bicycle.effects.effect_registry import model_workers
    from tyre.ground.progress import progress_bar

    with model_workers(workers) if workers > 1 else nullcontext() as pool:

        def each(work: Callable[..., Any], items: Iterable[tuple[Any, ...]], what: str) -> list[Any]:
            waits = [pool.submit(work, *item).result if pool else partial(work, *item) for item in items]
            return [wait() for wait in progress_bar(waits, desc=what, unit="step")]

        yield each


def run_study(settings: Settings, *, each: Each | None = None, cases: Cases | None = None) -> Study:
    """Compute the study; ``each`` spreads the work (see :func:`spread`), by default over this process alone."""
    if each is None:
        with spread(1) as here:
            return run_study(settings, each=here, cases=cases)
    cases = cases or tyre_cases(settings)
    first = cases.found[0].name
    pairs = [
        (settings, case, setup)
        for setup in settings.setups
        for case in cases.found
        if case.name == first or setup == settings.reference
    ]
    solved = each(_solve_or_reason, pairs, "modes and critical speeds")
    results = [one for one in solved if isinstance(one, Result)]
    left_out = [
        *cases.left_out,
        *(
            f"{case.name}, {case.condition}, {setup.label}: {one}"
            for (_, case, setup), one in zip(pairs, solved, strict=True)
            if isinstance(one, str)
        ),
    ]
    subject = [r.case for r in results if r.setup == settings.reference and r.case.name == first]
    if not subject:
        raise InputError("no case can be computed: " + "; ".join(left_out))
    subject.sort(key=lambda case: case.order)
    focus = min(subject, key=lambda case: abs(case.order - LIMITS.typical_bar))
    todo = [
        (settings, *(_find(results, case, setup) for case in ends))
        for setup in settings.setups
        for ends in pressure_ends([r.case for r in results if r.setup == setup])
    ]
    decompositions = each(compare.decompose, todo, "causes of the changes")
    asked = [_find(results, case, settings.reference) for case in dict.fromkeys((subject[0], subject[-1]))]
    outer = each(compare.plausible, [(settings, r.case, r.setup) for r in asked], "plausible bicycles")
    checks = each(compare.check, [(settings, r) for r in asked], "Monte Carlo")
    sizes = each(compare.amplitude, [(settings, r.case, r.setup) for r in asked], "amplitude of wobble")
    done = list({(r.case.name, r.case.condition): r.case for r in results}.values())
    order = list(dict.fromkeys(case.name for case in done))
    return Study(
        settings,
        tuple(sorted(done, key=lambda case: (order.index(case.name), case.order))),
        focus,
        tuple(left_out),
        tuple(results),
        tuple(decompositions),
        tuple(outer),
        compare.hinges(settings, subject, focus),
        compare.contact_models(settings, dict.fromkeys((subject[0], subject[-1]))),
        compare.sources(settings, focus),
        tuple(checks),
        tuple(sizes),
    )


def pressure_ends(cases: Sequence[TyreCase]) -> list[tuple[TyreCase, TyreCase]]:
    """Pair the cases of highest and of lowest pressure of each tyre and surface."""
    rising = sorted((case for case in cases if case.pressures_bar), key=lambda case: case.order)
    by_tyre = ([case for case in rising if case.name == name] for name in dict.fromkeys(case.name for case in cases))
    return [(mine[-1], mine[0]) for mine in by_tyre if len(mine) > 1]


def _solve_or_reason(settings: Settings, case: TyreCase, setup: Setup) -> Result | str:
    try:
        return solve(settings, case, setup)
    except InputError as error:
        return str(error)


def _find(found: Sequence[Any], case: TyreCase, setup: Setup) -> Any:
    """Find the entry of a case and setup; cases of other processes are told apart by name and condition."""
    key = (setup, case.name, case.condition)
    return next((one for one in found if (one.setup, one.case.name, one.case.condition) == key), None)
