"""``velotyre front-frame``: stiffness and hinge of the front frame, from measurements or from published figures."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from studies.front_frame.figure_options import stated_figures, takes_published_figures
from studies.model_space.command_options import PATH, refuse_next_to
from studies.reporting.command_context import example, verbose

if TYPE_CHECKING:
    from studies.front_frame.published import FrontHinge, PublishedFigures


@click.command(
    help="Find stiffness and hinge of a front frame. Published figures of head tube and fork, or a deflection at the "
    "ground, are enough; FILE is a measurement file of kind standing: weights, gauges and taps on a bicycle that "
    "stands still.",
    epilog=example(
        "velotyre front-frame --head-tube 95 --fork 45",
        "velotyre front-frame --head-tube 95 --fork 45 --bicycle pista --out pista_front.toml",
        "velotyre front-frame --ground-mm 32.7 --ground-kg 20 --bicycle pista",
        "velotyre front-frame --plan",
    ),
)
@verbose
@click.argument("file", metavar="[FILE]", type=PATH, required=False)
@takes_published_figures
@click.option("--plan", "show_plan", is_flag=True, help="Print what to hold, hang and tap in half an hour; exit.")
@click.option("--bicycle", help="Bicycle: a packaged name or a file; needed for --out. [default: that of FILE]")
@click.option("--out", metavar="FILE.toml", type=PATH, help="Model file to write, .toml.")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
@click.option("--force", is_flag=True, help="Overwrite existing files.")
def command(
    file: Path | None,
    bicycle: str | None,
    out: Path | None,
    json_file: str | None,
    *,
    show_plan: bool,
    force: bool,
    **published: Any,
) -> None:
    from studies.front_frame.published import map_figures, read_map
    from tyre.ground.errors import InputError

    if show_plan:
        from studies.standing.plan import plan

        refuse_next_to("--plan", "bicycle")
        click.echo(plan(bicycle or "mine.toml"))
        return
    if file is not None:
        from studies.standing.front_file import report_front_file

        options = [f"--{name.replace('_', '-')}" for name, value in published.items() if value is not None]
        if options:
            raise InputError(f"{file} holds the measurements; leave out {', '.join(options)}")
        report_front_file(file, bicycle=bicycle, out=out, json_file=json_file, force=force)
        return
    figures = stated_figures(published)
    if figures is None:
        raise InputError(
            "give published figures, --head-tube and --fork or --ground-mm and --ground-kg, or a FILE of measurements; "
            "--plan says how to measure"
        )
    _report_published(map_figures(figures, read_map()), figures, bicycle, out, json_file, force=force)


def _report_published(
    hinge: "FrontHinge",
    figures: "PublishedFigures",
    bicycle: str | None,
    out: Path | None,
    json_file: str | None,
    *,
    force: bool,
) -> None:
    """Print the ``hinge`` of published ``figures``, with the tables of a model file for a ``bicycle``; write them."""
    from shlex import quote

    from bicycle.files.bicycle_files import available_bicycles, load_bicycle
    from studies.front_frame import hinge_report
    from studies.model_space.toml_target import check_toml_target, near_to
    from studies.reporting.output import write_json
    from tyre.ground.errors import InputError
    from tyre.ground.files import write_text

    if out is not None:
        if bicycle is None:
            raise InputError(f"--out {out}: the hinge has its place on a bicycle; give --bicycle, for example pista")
        check_toml_target(out, force=force)
    frame = None if bicycle is None else load_bicycle(bicycle)
    if json_file is not None:
        write_json(hinge_report.hinge_record(hinge, figures, frame), json_file)
    if out is not None and frame is not None and bicycle is not None:
        name = bicycle if bicycle in available_bicycles() else near_to(bicycle, out)
        write_text(out, hinge_report.model_text(hinge, figures, frame, {"bicycle": name, "file": out.name}))
    if json_file == "-":
        return
    click.echo(hinge_report.hinge_text(hinge, figures, frame))
    if out is not None:
        click.echo(f"\n{out}: next: velotyre run {quote(str(out))}")
    elif frame is not None:
        click.echo(
            "\nTables of a model file (--out writes one):\n\n" + hinge_report.hinge_tables(hinge, figures, frame)
        )
    else:
        click.echo("\nWith --bicycle the tables of a model file are printed too.")
