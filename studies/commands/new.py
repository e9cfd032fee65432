"""``velotyre new``: a commented file to start from: a model, a measurement, sensors."""

from pathlib import Path
from shlex import quote

import click

from studies.reporting.command_context import example


@click.command(
    help="Write FILE.toml, a model file (or another kind) that runs as it is, with every key explained.",
    epilog=example("velotyre new model.toml", "velotyre modes model.toml"),
)
@click.argument("target", metavar="FILE.toml", type=click.Path(path_type=Path))
@click.option(
    "--kind", type=click.Choice(("model", "measurement", "sensors")), default="model", show_default=True,
    help="model: of every command; measurement, with its table: of diagnose; sensors: of simulate.",
)  # fmt: skip
@click.option("--bicycle", default="benchmark", show_default=True, help="A packaged bicycle to begin with.")
@click.option("--tyre", default="Tyre1", show_default=True, help="A packaged tyre to begin with.")
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
def command(target: Path, kind: str, bicycle: str, tyre: str, *, force: bool) -> None:
    from bicycle.bicycle_files import available_bicycles, load_bicycle
    from bicycle.model_file import build_model
    from studies.model_example import example_model
    from tyre import read_tyre
    from tyre.errors import InputError, unknown
    from tyre.files import tomllib, write_text

    if target.suffix.lower() != ".toml":
        raise InputError(f"{target}: a {kind} file ends in .toml; give for example {target.with_suffix('.toml')}")
    if target.exists() and not force:
        raise InputError(f"{target} exists; give --force to overwrite it or another name")
    unused = {"model": (), "measurement": ("tyre",)}.get(kind, ("bicycle", "tyre"))
    for option in unused:
        if click.get_current_context().get_parameter_source(option) is not click.core.ParameterSource.DEFAULT:
            raise InputError(f"--{option} is of a model file; leave it out with --kind {kind}")
    if kind == "sensors":
        _write_sensors(target)
        return
    if bicycle not in available_bicycles():
        raise InputError(f"--bicycle: {unknown('bicycle', bicycle, available_bicycles())}")
    if kind == "measurement":
        _write_measurement(target, bicycle, force=force)
        return
    text = example_model(load_bicycle(bicycle), read_tyre(tyre), file=target.name)
    build_model(tomllib.loads(text))  # refuses what would not run: a tyre far outside its tests, for example
    write_text(target, text)
    click.echo(f"{target}: {bicycle} on {tyre}; next: velotyre modes {quote(str(target))}")


def _write_sensors(target: Path) -> None:
    from studies.synthetic_sensors import EXAMPLE
    from tyre.files import write_text

    write_text(target, EXAMPLE.format(file=target.name))
    ride = f"simulate benchmark --speed 5 --initial lean=0.02 --sensors {target} --noise --out ride"
    click.echo(f"{target}: sensors; next: velotyre {ride}")


def _write_measurement(target: Path, bicycle: str, *, force: bool) -> None:
    """Write a measurement of a packaged bicycle, and the table that it names."""
    from bicycle.bicycle_files import load_bicycle
    from studies.diagnosis.measurement_file import example_measurement
    from tyre.errors import InputError
    from tyre.files import write_text
    from tyre.table import write_csv

    beside = target.with_suffix(".csv")
    if beside.exists() and not force:
        raise InputError(f"{beside} exists, where the table of {target} would be; give --force to overwrite both")
    text, table = example_measurement(load_bicycle(bicycle), file=target.name, table=beside.name)
    write_csv(beside, table)
    write_text(target, text)
    click.echo(f"{target}: synthetic weave of {bicycle} in {beside}; next: velotyre diagnose {target} --out report")
