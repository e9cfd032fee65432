"""Run the main study and write everything: tables, figures, report; progress on standard error."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from studies.main_study.cases import Settings
from studies.main_study.figure_critical_speeds import draw_critical_speeds
from studies.main_study.figure_damping import draw_damping
from studies.main_study.figure_eigenvalues import draw_eigenvalues
from studies.main_study.figure_headline import draw_headline
from studies.main_study.figure_speed_locus import draw_speed_locus
from studies.main_study.paper_figures import FIGURES, draw_paper_figures
from studies.main_study.report import write_report
from studies.main_study.study import Study, count_steps, run_study
from studies.main_study.tables import write_tables


def run_and_write(settings: Settings, folder: Path) -> Path:
    """Compute the study and write it into ``folder``; returns the HTML report."""
    from tqdm import tqdm

    folder.mkdir(parents=True, exist_ok=True)
    draws = drawings(settings, folder)
    with tqdm(total=count_steps(settings) + 1 + len(draws) + 1 + len(FIGURES), unit="step", desc="velotyre run") as bar:

        def step(what: str) -> None:
            bar.set_postfix_str(what)
            bar.update()

        study = run_study(settings, step)
        write_tables(study, folder)
        step("tables")
        for draw in draws:
            step(draw(study).name)
        paper = []
        for stem in draw_paper_figures(folder):
            paper.append(stem.name)
            step(stem.name)
        return write_report(study, folder, paper_figures=paper)[1]


def drawings(settings: Settings, folder: Path) -> list[Callable[[Study], Path]]:
    """Every figure of the study, each to be called with it."""
    flexible = [setup for setup in settings.setups if setup.front]
    draws: list[Callable[[Study], Path]] = [
        partial(draw_headline, setups=flexible[-1:], target=folder / "headline"),
        partial(draw_headline, setups=flexible, target=folder / "wobble_bands"),
        partial(draw_damping, target=folder / "damping_ratio"),
        partial(draw_critical_speeds, target=folder / "critical_speeds"),
    ]
    for number, setup in enumerate(settings.setups, 1):
        draws.append(partial(draw_eigenvalues, setup=setup, target=folder / f"eigenvalues_{number}"))
        draws.append(partial(draw_speed_locus, setup=setup, target=folder / f"root_locus_{number}"))
    return draws
