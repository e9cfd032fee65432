"""``velotyre critical``: the speeds at which a mode gains or loses stability."""

import click

from studies.model_space.command_options import max_speed_option
from studies.model_space.model_argument import ChosenModel, takes_model_or_matrices
from studies.reporting.command_context import example


@click.command(
    help="Compute the critical speeds of MODEL. The exact speeds at which a mode becomes stable or unstable, also "
    "of each bicycle of a table.",
    epilog=example("velotyre critical benchmark --tyre Tyre1 --pressure 5.5 --csv critical.csv"),
)
@takes_model_or_matrices
@max_speed_option(60.0)
@click.option("--csv", "csv_file", metavar="FILE", help="Write the critical speeds as CSV; - is standard output.")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
def command(chosen: ChosenModel, max_speed: float, csv_file: str | None, json_file: str | None) -> None:
    from studies.model_space.lasting_motions import with_onsets
    from studies.reporting import output
    from studies.reporting.analysis import analyse, record, records

    output.check_targets(csv=csv_file, json=json_file)
    models = {name: choice.linear for name, choice in chosen.each.items()}
    critical_speeds = {name: analyse(model, [], max_speed=max_speed)[1] for name, model in models.items()}
    if not chosen.of_matrices:
        critical_speeds = {
            name: with_onsets(choice.model, choice.content, critical_speeds[name])
            for name, choice in chosen.each.items()
        }
    if csv_file is not None:
        tables = [output.named_rows(output.critical_table(speeds), name) for name, speeds in critical_speeds.items()]
        output.write_csv(output.stack_tables(tables), csv_file)
    if json_file is not None:
        contents = {
            name: record(models[name], None, speeds, max_speed=max_speed) for name, speeds in critical_speeds.items()
        }
        output.write_json(records(contents), json_file)
    if "-" not in (csv_file, json_file):
        output.print_critical(critical_speeds, models, max_speed=max_speed)
        for name, speeds in critical_speeds.items():
            if speeds:
                output.print_exchanges({name: models[name]}, max(critical.speed for critical in speeds))
        output.print_named_warnings({name: model.warnings for name, model in models.items()})
    chosen.note_rigid_front()
