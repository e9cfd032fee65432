"""``velotyre chart``: where a model becomes unstable, as exact curves over two of its numbers."""

from pathlib import Path

import click

from studies.model_space.command_options import FOLDER, assume_option, sd_option, speed_option
from studies.model_space.model_argument import ChosenModel, takes_model
from studies.reporting.command_context import example

AXIS = "NAME[=LOW:HIGH[:log]]"


@click.command(
    help="Draw a stability chart over two parameters. Exact stability boundaries of MODEL by mode, figure and CSV.",
    epilog=example("velotyre chart benchmark --x speed=1:10 --y c=0.02:0.12 --out chart"),
)
@takes_model
@click.option(
    "--x", "x_text", required=True, metavar=AXIS, help="Horizontal axis: speed, or as --parameter of root-locus."
)
@click.option("--y", "y_text", required=True, metavar=AXIS, help="Vertical axis; default range: the usual one.")
@speed_option("Forward speed, m/s, unless it is an axis.", required=False)
@click.option("--out", type=FOLDER, required=True, help="Folder for the results.")
@click.option(
    "--contours", metavar="OUTPUT", help="Draw contour lines of an output of sweeps, such as max_growth_rate."
)
@sd_option
@assume_option
@click.option("--json", "json_file", metavar="FILE", help="Write the boundaries as JSON; - is standard output.")
def command(
    chosen: ChosenModel,
    x_text: str,
    y_text: str,
    speed: float | None,
    out: Path,
    contours: str | None,
    sds: tuple[str, ...],
    json_file: str | None,
    *,
    assume: bool,
) -> None:
    from studies.chart import Plane
    from studies.model_space.axes import numbers_by_name
    from studies.model_space.outputs import scalar_output
    from studies.reporting.manifest import results
    from studies.reporting.output import check_targets, print_table, print_warnings, write_csv, write_json

    check_targets(json=json_file)
    chosen.model  # noqa: B018 (a mistake in the file is reported with its name)
    output = scalar_output(contours) if contours else None
    plane = Plane.of(chosen.content, x_text, y_text, speed=speed)
    sd = numbers_by_name(sds, "--sd", "c=0.005", "standard deviation")

    # Tables and figures take a second to load: what was asked for is checked before.
    from studies.chart import describe_check, draw_chart, headers, record, rows, stability_chart, title

    chart = stability_chart(plane, sd=sd, assume=assume)
    with results(out):
        write_csv(chart.frame(), out / "stability_chart.csv")
        draw_chart(chart, out / "stability_chart", title=title(chart), contours=output)
    if json_file:
        write_json(record(chart), json_file)
    if json_file != "-":
        if chart.boundaries:
            print_table(rows(chart), headers(chart))
        for line in describe_check(chart):
            click.echo(line)
    print_warnings([*plane.space.linear.warnings, *chart.doubts])
