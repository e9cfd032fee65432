"""``velotyre critical``: the speeds at which a mode gains or loses stability."""

import click

from studies.model_argument import ChosenModel, takes_model
from studies.reporting.examples import example


@click.command(
    help="Exact critical speeds of MODEL: where a mode becomes stable or unstable.",
    epilog=example("velotyre critical benchmark --tyre Tyre1 --pressure 5.5 --csv critical.csv"),
)
@takes_model
@click.option("--max-speed", default=60.0, show_default=True, help="Search up to this speed, m/s.")
@click.option("--csv", "csv_file", metavar="FILE", help="Write the critical speeds as CSV; - is standard output.")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
def command(chosen: ChosenModel, max_speed: float, csv_file: str | None, json_file: str | None) -> None:
    from studies.reporting.analysis import analyse, record
    from studies.reporting.output import critical_table, print_critical, print_warnings, write_csv, write_json

    model = chosen.model.linear_model()
    _, critical = analyse(model, [], max_speed=max_speed)
    if csv_file is not None:
        write_csv(critical_table(critical), csv_file)
    if json_file is not None:
        write_json(record(model, None, critical), json_file)
    if "-" not in (csv_file, json_file):
        print_critical(critical)
        print_warnings(model.warnings)
