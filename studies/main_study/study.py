"""The main study: measured tyres at their pressures in four cases -> modes, critical speeds, and their causes."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from studies.main_study import compare
from studies.main_study.cases import Cases, TyreCase, tyre_cases
from studies.main_study.result import Result, solve
from studies.main_study.samples import Samples, sample_bicycles
from studies.main_study.settings import LIMITS, Settings, Setup
from tyre.ground.errors import InputError

Distribute = Callable[..., list[Any]]  # (work, items, label) -> results of work(*item), in the order of the items


@dataclass(frozen=True, eq=False)
class Study:
    """Results of the main study; ``left_out`` holds what could not be computed, with the reason."""

    settings: Settings  # bicycle, tyre, cases, speeds
    cases: tuple[TyreCase, ...]  # by tyre and surface, then rising pressure
    focus: TyreCase  # case of the tyre in question that is nearest to the typical pressure
    left_out: tuple[str, ...]  # tyre, condition, case and reason, a sentence each
    results: tuple[Result, ...]  # of every condition in the reference case, of the tyre in question in all cases
    # of each tyre and surface measured at two pressures, in each case
    decompositions: tuple[compare.Decomposition, ...]
    # lowest and highest pressure of the tyre in question; reference case, then the same with hands on
    samples: tuple[Samples, ...]
    hinges: tuple[compare.Hinge, ...]  # the largest change first
    contact_models: tuple[compare.ContactModels, ...]  # reference case, lowest and highest pressure of that tyre
    sources: compare.Sources  # of the case in focus
    checks: tuple[compare.Check, ...]  # lowest and highest pressure of the tyre in question, reference case
    amplitudes: tuple[compare.Amplitude, ...]  # likewise

    @property
    def names(self) -> list[str]:
        """Tyres with their surfaces, in order; the question is about the first."""
        return list(dict.fromkeys(case.name for case in self.cases))

    @property
    def subject(self) -> tuple[TyreCase, ...]:
        """Cases of the tyre in question, by rising pressure."""
        return tuple(case for case in self.cases if case.name == self.names[0])

    @property
    def assumed_of_tyre(self) -> tuple[str, ...]:
        """What neither the model file nor the file of the tyre in focus states: trail, twisting, camber_share."""
        return compare.assumed_of_tyre(self.settings, self.focus.apply_to(self.settings.reference))

    @property
    def packaged_tyres(self) -> list[str]:
        """Names of the tyres that come with velotyre."""
        return list(dict.fromkeys(case.name for case in self.cases if case.packaged))

    @property
    def contact_example(self) -> compare.ContactModels | None:
        """First comparison of contact models; None unless wobble oscillates in all models of it and of the last."""
        if not self.contact_models or not self.contact_models[-1].oscillate:
            return None
        return self.contact_models[0] if self.contact_models[0].oscillate else None

    @property
    def has_cycles(self) -> bool:
        """True if there are periodic motions of wobble, stable or not."""
        return any(amplitude.jumps for amplitude in self.amplitudes)

    @property
    def refusals(self) -> list[str]:
        """Reasons why amplitudes are not known, each once."""
        return list(dict.fromkeys(amplitude.refused for amplitude in self.amplitudes if amplitude.refused))

    @property
    def peak_factor(self) -> float | None:
        """Peak factor of the tyres that is assumed for the amplitudes; None where their files hold full curves."""
        return next((amplitude.peak_factor for amplitude in self.amplitudes if amplitude.peak_factor), None)

    def results_of(self, setup: Setup, name: str | None = None) -> list[Result]:
        """List the results of one setup, of the tyre and surface ``name`` if given, in the order of the cases."""
        results = (self.result(setup, case) for case in self.cases if name in (None, case.name))
        return [result for result in results if result]

    def result(self, setup: Setup, case: TyreCase) -> Result | None:
        """Find the result of one case; None if it could not be computed."""
        return _find(self.results, case, setup)

    def samples_around(self, result: Result | None) -> Samples | None:
        """Find the samples around one result; None if there are none."""
        return _find(self.samples, result.case, result.setup) if result else None

    def decomposition(self, setup: Setup, name: str) -> compare.Decomposition | None:
        """Find the decomposition of the tyre and surface ``name``; None if it was measured at one pressure only."""
        return next((d for d in self.decompositions if d.setup == setup and d.higher.name == name), None)


@contextmanager
def spread(workers: int) -> Iterator[Distribute]:
    """Give ``distribute(work, items, label)``: results of ``work(*item)`` in order, over processes."""
    from bicycle.effects.effect_registry import model_workers
    from tyre.ground.progress import progress_bar

    if workers < 2:
        yield run_here
        return
    with model_workers(workers) as pool:

        def distribute(work: Callable[..., Any], items: Iterable[tuple[Any, ...]], label: str) -> list[Any]:
            jobs = [pool.submit(work, *item) for item in items]
            return [job.result() for job in progress_bar(jobs, desc=label, unit="step")]

        yield distribute


def run_here(work: Callable[..., Any], items: Iterable[tuple[Any, ...]], label: str) -> list[Any]:
    """Give the results of ``work(*item)`` in order, computed by this process alone, showing progress as ``label``."""
    from tyre.ground.progress import progress_bar

    return [work(*item) for item in progress_bar(list(items), desc=label, unit="step")]


def run_study(settings: Settings, *, distribute: Distribute = run_here, cases: Cases | None = None) -> Study:
    """Compute the study; ``distribute`` spreads the work (see :func:`spread`), by default over this process alone."""
    cases = cases or tyre_cases(settings)

    # Modes and critical speeds of every case; the tyre in question has them in all cases.
    results, left_out = _solve_cases(settings, cases, distribute)
    subject = [r.case for r in results if r.setup == settings.reference and r.case.name == cases.studied[0].name]
    if not subject:
        raise InputError("no case can be computed: " + "; ".join(left_out))
    subject.sort(key=lambda case: case.order)
    focus = min(subject, key=lambda case: abs(case.order - LIMITS.typical_bar))

    # What causes the change from the highest to the lowest pressure.
    decompositions = distribute(compare.decompose, _pressure_changes(settings, results), "causes of the changes")

    # The reference case at the lowest and highest pressure: samples, Monte Carlo check, amplitude.
    end_cases = tuple(dict.fromkeys((subject[0], subject[-1])))
    end_results = [_find(results, case, settings.reference) for case in end_cases]
    ends = [(settings, r.case, r.setup) for r in end_results]
    sampled = [(settings, case, setup) for setup in settings.setups for case in end_cases]
    samples = distribute(sample_bicycles, sampled, "parameter samples")
    checks = distribute(compare.check, [(settings, r) for r in end_results], "Monte Carlo")
    amplitudes = distribute(compare.amplitude, ends, "amplitude of wobble")

    return Study(
        settings=settings,
        cases=_order_cases(results),
        focus=focus,
        left_out=tuple(left_out),
        results=tuple(results),
        decompositions=tuple(decompositions),
        samples=tuple(samples),
        hinges=compare.hinges(settings, subject, focus),
        contact_models=compare.contact_models(settings, end_cases),
        sources=compare.sources(settings, focus),
        checks=tuple(checks),
        amplitudes=tuple(amplitudes),
    )


def _solve_cases(settings: Settings, cases: Cases, distribute: Distribute) -> tuple[list[Result], list[str]]:
    """Solve every condition in the reference case and the first tyre in all; also list what is left out and why."""
    first = cases.studied[0].name
    items = []
    for setup in settings.setups:
        items += [
            (settings, case, setup) for case in cases.studied if case.name == first or setup == settings.reference
        ]
    results = []
    left_out = list(cases.left_out)
    for (_, case, setup), outcome in zip(items, distribute(_solve, items, "modes and critical speeds"), strict=True):
        if isinstance(outcome, Result):
            results.append(outcome)
        else:
            left_out.append(f"{case.name}, {case.condition}, {setup.label}: {outcome}")
    return results, left_out


def _pressure_changes(settings: Settings, results: Sequence[Result]) -> list[tuple[Settings, Result, Result]]:
    """Pair the results at highest and lowest pressure of each tyre and surface, in each case."""
    changes = []
    for setup in settings.setups:
        for higher, lower in pressure_ends([r.case for r in results if r.setup == setup]):
            changes.append((settings, _find(results, higher, setup), _find(results, lower, setup)))
    return changes


def _order_cases(results: Sequence[Result]) -> tuple[TyreCase, ...]:
    """List the cases that have a result: tyres in the order of the results, each by rising pressure."""
    cases = list({(r.case.name, r.case.condition): r.case for r in results}.values())
    names = list(dict.fromkeys(case.name for case in cases))
    return tuple(sorted(cases, key=lambda case: (names.index(case.name), case.order)))


def pressure_ends(cases: Sequence[TyreCase]) -> list[tuple[TyreCase, TyreCase]]:
    """Pair the cases of highest and of lowest pressure of each tyre and surface."""
    rising = sorted((case for case in cases if case.pressures_bar), key=lambda case: case.order)
    ends = []
    for name in dict.fromkeys(case.name for case in cases):
        of_tyre = [case for case in rising if case.name == name]
        if len(of_tyre) > 1:
            ends.append((of_tyre[-1], of_tyre[0]))
    return ends


def _solve(settings: Settings, case: TyreCase, setup: Setup) -> Result | str:
    """Solve one case, or give the reason why it cannot be."""
    try:
        return solve(settings, case, setup)
    except InputError as error:
        return str(error)


def _find(entries: Sequence[Any], case: TyreCase, setup: Setup) -> Any:
    """Find the entry of a case and setup; cases of other processes are identified by name and condition."""
    key = (setup, case.name, case.condition)
    return next((entry for entry in entries if (entry.setup, entry.case.name, entry.case.condition) == key), None)
