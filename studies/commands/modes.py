"""``velotyre modes``: eigenvalues and named modes of a model file along speed."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from studies.model_space.command_options import check_memory, max_speed_option, speeds_option
from studies.model_space.model_argument import ChosenModel, takes_model_or_matrices
from studies.reporting.command_context import example
from tyre.ground.errors import InputError

if TYPE_CHECKING:
    from bicycle.stability.named_modes import Modes


@click.command(
    help="Compute eigenvalues, named modes and critical speeds. Of MODEL, or of each bicycle of a table.",
    epilog=example(
        "velotyre modes benchmark",
        "velotyre modes benchmark --tyre Tyre1 --pressure 5.5 --speeds 1:20:0.5 --plot modes.png",
    ),
)
@takes_model_or_matrices
@speeds_option(".", "2:20:2")
@max_speed_option(60.0)
@click.option("--plot", "plot_file", metavar="FILE", help="Draw frequency and real part: .png, .svg or .pdf.")
@click.option("--csv", "csv_file", metavar="FILE", help="Write a row per speed and root as CSV; - is standard output.")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
def command(
    chosen: ChosenModel,
    speeds: str,
    max_speed: float,
    plot_file: str | None,
    csv_file: str | None,
    json_file: str | None,
) -> None:
    from studies.reporting import output
    from studies.reporting.analysis import analyse, record, records
    from studies.reporting.plotting import check_picture, draw_picture

    if plot_file is not None:
        check_picture(plot_file)
        if len(chosen.each) > 1:
            raise InputError(f"--plot draws one bicycle; name one of the table: FILE#{next(iter(chosen.each))}")
    output.check_targets(csv=csv_file, json=json_file)
    grid = output.parse_speeds(speeds)
    models = {name: choice.linear for name, choice in chosen.each.items()}
    check_memory("number of --speeds", len(grid), 64 * max(model.order for model in models.values()) ** 2)
    modes_of, critical = {}, {}
    for name, model in models.items():
        modes_of[name], critical[name] = analyse(model, grid, max_speed=max_speed)
    named = {name: modes for name, modes in modes_of.items() if modes is not None}
    if csv_file is not None:
        tables = [output.named_rows(modes.to_dataframe(), name) for name, modes in named.items()]
        output.write_csv(output.stack_tables(tables), csv_file)
    if plot_file is not None:
        ((name, model),) = models.items()
        title = chosen.each[name].title
        draw_picture(model, grid, plot_file, title=title)
    if json_file is not None:
        contents = {
            name: record(model, modes_of[name], critical[name], max_speed=max_speed) for name, model in models.items()
        }
        output.write_json(records(contents), json_file)
    if "-" not in (csv_file, json_file):
        _print_modes(named)
        click.echo()
        output.print_critical(critical, models, max_speed=max_speed)
        for name, modes in named.items():
            for event in modes.events:
                click.echo(f"{name}: {event}" if name else str(event))
        output.print_named_warnings({name: model.warnings for name, model in models.items()})


def _print_modes(named: "Mapping[str, Modes]") -> None:
    """Print a row per bicycle and speed with the roots (1/s) of each mode; one bicycle alone has no name."""
    from studies.reporting.output import print_table

    roots = {name: modes.to_dict() for name, modes in named.items()}
    columns = list(dict.fromkeys(mode for roots_by_mode in roots.values() for mode in roots_by_mode))
    rows: list[list[Any]] = []
    for name, modes in named.items():
        for place, speed in enumerate(modes.speeds):
            cells = [_numbers(roots[name][mode][place]) if mode in roots[name] else None for mode in columns]
            rows.append([name, speed, *cells] if name else [speed, *cells])
    headers = ["speed m/s", *(f"{mode} 1/s" for mode in columns)]
    if len(rows[0]) > len(headers):
        headers.insert(0, "bicycle")
    print_table(rows, headers)


def _numbers(roots: Sequence[Sequence[float]] | None) -> str | None:
    """Write the ``roots`` of a mode at one speed, real and imaginary part (1/s) each; None without any."""
    return " ".join(_number(*root) for root in roots or []) or None


def _number(real: float, imaginary: float) -> str:
    return f"{real:.4g}" if imaginary == 0 else f"{real:.4g}±{abs(imaginary):.4g}i"
