"""``velotyre convert``: a bicycle's parameters from one file format to another."""

from pathlib import Path

import click

from studies.model_space.command_options import PATH
from studies.reporting.command_context import example, verbose


@click.command(
    help="Convert BICYCLE to TOML, flat YAML or text. BICYCLE is a packaged name or a file; text is 'key = "
    "value+/-sd'.",
    epilog=example("velotyre convert benchmark --to mine.toml", "velotyre convert pista --to pistaBenchmark.txt"),
)
@verbose
@click.argument("bicycle")
@click.option("--to", "target", required=True, metavar="FILE", type=PATH, help="File to write: .toml, .yml or .txt.")
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
def command(bicycle: str, target: Path, *, force: bool) -> None:
    from bicycle.files.bicycle_files import WRITERS, load_bicycle, lost_in_text
    from studies.reporting.output import print_warnings
    from tyre.ground.errors import InputError
    from tyre.ground.files import write_text

    if target.suffix.lower() not in WRITERS:
        raise InputError(f"{target}: the ending {target.suffix!r} is not known; write {', '.join(WRITERS)}")
    if target.exists() and not force:
        raise InputError(f"{target} exists; give --force to overwrite it or another name")
    parameters = load_bicycle(bicycle)
    write_text(target, WRITERS[target.suffix.lower()](parameters, allow_unusual=parameters.unusual))
    lost = lost_in_text(parameters) if target.suffix.lower() == ".txt" else ()
    print_warnings((*parameters.warnings, *lost))
    uncertain = f", sd of {len(parameters.sd)}" if parameters.sd else ""
    click.echo(f"{target}: {parameters.name}, {len(parameters.values)} parameters{uncertain}")
