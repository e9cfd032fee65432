"""Run the main study and write everything: tables, figures, report; progress on standard error."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from studies.main_study.answer import Answer, answer
from studies.main_study.cases import Cases, tyre_cases
from studies.main_study.figure_critical_speeds import draw_critical_speeds
from studies.main_study.figure_damping import draw_damping
from studies.main_study.figure_eigenvalues import draw_eigenvalues
from studies.main_study.figure_headline import draw_headline
from studies.main_study.figure_speed_locus import draw_speed_locus
from studies.main_study.paper_figures import draw_paper_figure, paper_stems
from studies.main_study.parallel import spread
from studies.main_study.report import write_report
from studies.main_study.settings import Settings
from studies.main_study.study import Study, count_steps, run_study
from studies.main_study.tables import write_tables


def run_and_write(
    settings: Settings, folder: Path, *, workers: int = 1, cases: Cases | None = None
) -> tuple[Study, Answer, Path]:
    """Compute the study and write it into ``folder``; returns it with the first screen and the HTML report.

    ``workers`` is the number of processes; ``cases`` are by default all of
    :func:`studies.main_study.cases.tyre_cases`.
    """
    from tyre.base.progress import progress_bar

    folder.mkdir(parents=True, exist_ok=True)
    draws = drawings(settings, folder)
    cases = cases or tyre_cases(settings)
    total = count_steps(settings, cases.found) + 1 + len(draws) + len(paper_stems(folder))
    with progress_bar(total=total, unit="step", desc="velotyre run") as bar:

        def step(what: str) -> None:
            bar.set_postfix_str(what)
            bar.update()

        with spread(workers, step) as each:
            study = run_study(settings, step, each=each, cases=cases)
            write_tables(study, folder)
            step("tables")
            each(drawn, [(draw, study) for draw in draws], lambda draw, study: draw.keywords["target"].name)
            papers = each(draw_paper_figure, [(stem,) for stem in paper_stems(folder)], lambda stem: stem.name)
        first = answer(study)
        return study, first, write_report(study, first, folder, paper_figures=[stem.name for stem in papers])[1]


def drawn(draw: Callable[[Study], Path], study: Study) -> Path:
    """One figure by its function ``draw``, as work for a process."""
    return draw(study)


def drawings(settings: Settings, folder: Path) -> list["partial[Path]"]:
    """Every figure of the study for ``folder``, each to be called with the study."""
    draws = [
        partial(draw_headline, setup=settings.reference, target=folder / "headline"),
        partial(draw_headline, setup=settings.setups[1], target=folder / "wobble_hands_on"),
        partial(draw_damping, target=folder / "damping_ratio"),
        partial(draw_critical_speeds, target=folder / "critical_speeds"),
    ]
    for number, setup in enumerate(settings.setups, 1):
        draws.append(partial(draw_eigenvalues, setup=setup, target=folder / f"eigenvalues_{number}"))
        if setup.front:  # what a rigid front does to the roots is in the eigenvalues
            draws.append(partial(draw_speed_locus, setup=setup, target=folder / f"root_locus_{number}"))
    return draws
