"""``velotyre run``: the main study, from measured tyres to figures, tables and a report."""

import click

from studies.model_space.command_options import POSTURE, WORKERS, Number, refuse_next_to
from studies.reporting.command_context import example


@click.command(
    help="Study the effect of tyre pressure on wobble. Measured tyres on a bicycle, hands off and hands "
    "on, with "
    "a rigid and a flexible front frame: a report with figures and tables. MODEL is a bicycle, or a model file whose "
    "tyre is studied.",
    epilog=example("velotyre run --bicycle benchmark --tyre Tyre2 --pressures 4,7 --out out"),
)
@click.argument("model_file", metavar="[MODEL]", required=False)
@click.option("--out", default="out", show_default=True, help="Folder for the results.")
@click.option(
    "--bicycle", help="Bicycle: a packaged name, or a file; default: a measured frame with a rider in the drops."
)
@click.option("--tyre", metavar="TYRE", help="Tyre: a packaged name, a table (.csv), a .tir or Pacejka-89 file.")
@click.option("--surface", metavar="SURFACE", help="Test surface of --tyre: flat (default) or drum.")
@click.option("--pressures", metavar="LIST", help="Pressures, bar: 3.5,5,7; default: the measured pressures.")
@click.option(
    "--common-error",
    type=Number(0, 1),
    default=1.0,
    show_default=True,
    help="Share of the tyre's variance common to all pressures, as of one rig.",
)
@click.option("--rider", help="Rider on --bicycle: a packaged name, or a file of measurements (needs the extra rider).")
@click.option("--rider-saddle", is_flag=True, help="Let the rider turn on the saddle (assumed stiffness).")
@click.option("--posture", type=POSTURE, help="Posture of --rider; default: drops.")
@click.option("--workers", type=WORKERS, help="Processes; default: one per core, up to 4.")
@click.option(
    "--json", "json_file", type=click.Path(allow_dash=True), help="Write the result as JSON; - is standard output."
)
@click.option("--rule", is_flag=True, help="Print the rule by which the answer is graded, and exit.")
def command(
    model_file: str | None, out: str, workers: int | None, json_file: str | None, *, rule: bool, **inputs: object
) -> None:
    import os
    from pathlib import Path

    from studies.main_study import settings_of
    from studies.reporting.manifest import results
    from studies.reporting.output import check_targets, write_json
    from tyre.ground.errors import InputError

    if rule:
        from studies.main_study import on_a_terminal, rule_of_grades

        refuse_next_to("--rule")
        click.echo(on_a_terminal(rule_of_grades()))
        return
    folder = Path(out)
    if not out.strip() or (folder.exists() and not folder.is_dir()):
        why = "is a file" if out.strip() else "is no folder name"
        raise InputError(f"--out {out!r} {why}; give a folder to write into, for example out")
    settings = settings_of(model_file, **inputs)
    with results(folder):
        check_targets(json=json_file)
        from studies.main_study import answer, on_a_terminal, record, run_and_write  # slow: not before it may begin

        study, first, report = run_and_write(settings, folder, workers=workers or min(os.cpu_count() or 1, 4))
        if json_file:
            write_json(record(study, answer(study)), json_file)
    if json_file != "-":
        click.echo(on_a_terminal(first))
    for warning in settings.bicycle.warnings:
        click.echo(f"warning: {warning}", err=True)
    if json_file != "-":
        click.echo(f"\nfigure: {(folder / 'headline.png').as_posix()}\nreport: {report.as_posix()}")
