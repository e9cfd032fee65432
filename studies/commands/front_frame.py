"""``velotyre front-frame``: stiffness and hinge of the front frame, from measurements or from published figures."""

from pathlib import Path

import click

from studies.model_space.command_options import PATH
from studies.reporting.command_context import example, verbose


@click.command(
    help="Find stiffness and hinge of a front frame. FILE is a measurement file of kind standing: weights, gauges and "
    "taps on a bicycle that stands still.",
    epilog=example("velotyre front-frame standing.toml --out mine.toml"),
)
@verbose
@click.argument("file", metavar="FILE", type=PATH)
@click.option("--bicycle", help="Bicycle: a packaged name or a file. [default: that of FILE]")
@click.option("--out", metavar="FILE.toml", type=PATH, help="Model file to write, .toml.")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
@click.option("--force", is_flag=True, help="Overwrite existing files.")
def command(file: Path, bicycle: str | None, out: Path | None, json_file: str | None, *, force: bool) -> None:
    from studies.standing.front_file import report_front_file

    report_front_file(file, bicycle=bicycle, out=out, json_file=json_file, force=force)
