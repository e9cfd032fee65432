"""``velotyre modes``: eigenvalues and named modes of a model file along speed."""

import click

from studies.model_argument import ChosenModel, takes_model
from studies.reporting.examples import example


@click.command(
    help="Eigenvalues, named modes and critical speeds of MODEL.",
    epilog=example(
        "velotyre modes benchmark",
        "velotyre modes benchmark --tyre Tyre1 --pressure 5.5 --speeds 1:20:0.5 --plot modes.png",
    ),
)
@takes_model
@click.option(
    "--speeds", default="2:20:2", show_default=True, help="m/s: start:stop:step with both ends, or a list 2,5,8."
)
@click.option("--max-speed", default=60.0, show_default=True, help="Search critical speeds up to this speed, m/s.")
@click.option("--plot", "plot_file", metavar="FILE", help="Draw frequency and real part: .png, .svg or .pdf.")
@click.option("--csv", "csv_file", metavar="FILE", help="Write a row per speed and root as CSV; - is standard output.")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
def command(
    chosen: ChosenModel, speeds: str, max_speed: float, plot_file: str | None, csv_file: str | None,
    json_file: str | None,
) -> None:  # fmt: skip
    from studies.reporting.analysis import analyse, record
    from studies.reporting.modes_picture import check_picture, draw_picture
    from studies.reporting.output import (
        parse_speeds,
        print_critical,
        print_table,
        print_warnings,
        write_csv,
        write_json,
    )

    if plot_file is not None:
        check_picture(plot_file)
    model = chosen.model.linear_model()
    found, critical = analyse(model, parse_speeds(speeds), max_speed=max_speed)
    assert found is not None  # parse_speeds gives at least one speed
    if csv_file is not None:
        write_csv(found.to_dataframe(), csv_file)
    if plot_file is not None:
        draw_picture(model, found.speeds, plot_file, title=_title(chosen))
    if json_file is not None:
        write_json(record(model, found, critical), json_file)
    if "-" not in (csv_file, json_file):
        rows = []
        for speed, *values in zip(found.speeds, *found.to_dict().values(), strict=True):
            rows.append([speed, *(" ".join(_number(*z) for z in value or []) or None for value in values)])
        print_table(rows, ["speed m/s", *(f"{name} 1/s" for name in found.to_dict())])
        click.echo()
        print_critical(critical)
        for event in found.events:
            click.echo(str(event))
        print_warnings(model.warnings)


def _title(chosen: ChosenModel) -> str:
    effects = [effect.identifier.replace("_", " ") for effect in chosen.model.effects]
    return f"{chosen.model.bicycle.name}: {', '.join(effects)}"


def _number(real: float, imaginary: float) -> str:
    return f"{real:.4g}" if imaginary == 0 else f"{real:.4g}±{abs(imaginary):.4g}i"
