"""``velotyre run``: the main study, from measured tyres to figures, tables and a report."""

from typing import TYPE_CHECKING

import click

from studies.reporting.examples import example

if TYPE_CHECKING:
    from pathlib import Path

    from studies.main_study.cases import Cases
    from studies.main_study.settings import Settings

WIDTH = 110


@click.command(
    help="Does this tyre, at this pressure, bring my bicycle closer to wobble? Measured tyres on a bicycle, hands off "
    "and on the bar, with a rigid and a flexible front: a report with figures and tables. MODEL is a model file, whose "
    "tyre the question is then about, or a bicycle.",
    epilog=example("velotyre run --bicycle benchmark --pressures 4,5.5,7 --out out"),
)
@click.argument("model_file", metavar="[MODEL]", required=False)
@click.option("--out", default="out", show_default=True, help="Folder to write into.")
@click.option("--bicycle", help="A packaged bicycle, or a file; default: a measured frame with a rider in the drops.")
@click.option(
    "--tyre",
    "tyres",
    multiple=True,
    help="File of a tyre to study too: a table of tyre fit, .tir or Pacejka-89; may be repeated.",
)
@click.option(
    "--pressures", metavar="LIST", help="Pressures to study, bar, such as 3.5,5,7; default: the measured ones."
)
@click.option("--rider", help="A packaged rider, or a file of measurements, put on --bicycle (needs the extra rider).")
@click.option(
    "--posture", type=click.Choice(["upright", "hoods", "drops"]), help="How the --rider sits; default: drops."
)
@click.option("--workers", type=click.IntRange(1), help="Processes; default: one for each core, up to 4.")
def command(
    model_file: str | None, out: str, bicycle: str | None, tyres: tuple[str, ...], pressures: str | None,
    rider: str | None, posture: str | None, workers: int | None,
) -> None:  # fmt: skip
    import os
    from pathlib import Path

    from studies.main_study.model_input import settings_of
    from tyre.base.errors import InputError

    if not out.strip() or "\0" in out:
        raise InputError(f"--out {out!r} is no folder name; give a folder to write into, for example out")
    folder = Path(out)
    if folder.exists() and not folder.is_dir():
        raise InputError(f"--out {out!r} is a file; give a folder to write into, for example out")
    settings = settings_of(model_file, bicycle=bicycle, tyres=tyres, pressures=pressures, rider=rider, posture=posture)
    run_and_show(settings, folder, workers=workers or min(os.cpu_count() or 1, 4))


def run_and_show(settings: "Settings", folder: "Path", *, workers: int, cases: "Cases | None" = None) -> None:
    """Run the study into ``folder`` and print question, answer and where the report is.

    ``workers`` is the number of processes; ``cases`` are by default all that can be studied.
    """
    from textwrap import fill

    from studies.main_study.output import run_and_write
    from studies.main_study.report_checks import uncertainty_lines
    from studies.reporting.manifest import results

    with results(folder):
        study, first, report = run_and_write(settings, folder, workers=workers, cases=cases)
    click.echo(first.question + "\n")
    for label, text in first.sentences:
        click.echo(fill(f"{label} {text}", WIDTH, subsequent_indent="  "))
    if first.why:
        click.echo("\n" + fill(first.why, WIDTH))
    click.echo()
    for line in uncertainty_lines(study):
        click.echo(fill(line, WIDTH, subsequent_indent="  "))
    for warning in settings.bicycle.warnings:
        click.echo(f"warning: {warning}", err=True)
    click.echo(f"\nreport: {report.as_posix()}")
