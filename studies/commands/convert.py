"""``velotyre convert``: a bicycle's parameters from one file format to another."""

from pathlib import Path

import click

from studies.reporting.examples import example
from studies.reporting.output import verbose


@click.command(
    help="Write BICYCLE (packaged name, .toml, .yml, .yaml or .txt) as TOML or flat YAML.",
    epilog=example("velotyre convert benchmark --to mine.toml"),
)
@verbose
@click.argument("bicycle")
@click.option("--to", "target", required=True, metavar="FILE", type=click.Path(path_type=Path), help=".toml or .yml")
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
def command(bicycle: str, target: Path, *, force: bool) -> None:
    from bicycle.files.bicycle_file import load_bicycle, to_toml, to_yaml
    from studies.reporting.output import print_warnings
    from tyre.base.errors import InputError
    from tyre.base.files import write_text

    writers = {".toml": to_toml, ".yml": to_yaml, ".yaml": to_yaml}
    if target.suffix.lower() not in writers:
        raise InputError(f"{target}: the ending {target.suffix!r} is not known; write {', '.join(writers)}")
    if target.exists() and not force:
        raise InputError(f"{target} exists; give --force to overwrite it or another name")
    found = load_bicycle(bicycle)
    write_text(target, writers[target.suffix.lower()](found))
    lost = found.sd and target.suffix.lower() != ".toml"
    notes = ["flat YAML holds no standard deviations; write .toml to keep them"] if lost else []
    print_warnings([*found.warnings, *notes])
    click.echo(f"{target}: {found.name}, {len(found.values)} parameters")
