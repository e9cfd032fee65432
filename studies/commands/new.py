"""``velotyre new``: a commented file to start from: a model, a measurement, sensors, costs."""

from pathlib import Path
from shlex import quote

import click

from studies.reporting.examples import example

KINDS = ("model", "measurement", "sensors", "costs")


@click.command(
    help="Write FILE.toml, a model file (or another kind) that runs as it is, with every key explained.",
    epilog=example("velotyre new model.toml", "velotyre modes model.toml"),
)
@click.argument("target", metavar="FILE.toml", type=click.Path(path_type=Path))
@click.option(
    "--kind",
    type=click.Choice(KINDS),
    default=KINDS[0],
    show_default=True,
    help="model: of every command; measurement, with its table: of diagnose; sensors: of simulate; costs: of plan.",
)
@click.option("--bicycle", default="benchmark", show_default=True, help="A packaged bicycle to begin with.")
@click.option("--tyre", default="Tyre1", show_default=True, help="A packaged tyre to begin with.")
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
def command(target: Path, kind: str, bicycle: str, tyre: str, *, force: bool) -> None:
    from bicycle.files.bicycle_file import available_bicycles, load_bicycle
    from bicycle.files.model_file import build_model
    from studies.model_example import example_model
    from tyre import read_tyre
    from tyre.base.errors import InputError, unknown
    from tyre.base.files import write_text
    from tyre.base.toml_file import tomllib

    if target.suffix.lower() != ".toml":
        raise InputError(f"{target}: a {kind} file ends in .toml; give for example {target.with_suffix('.toml')}")
    if target.exists() and not force:
        raise InputError(f"{target} exists; give --force to overwrite it or another name")
    if kind in ("sensors", "costs"):
        _example(target, kind)
        return
    if bicycle not in available_bicycles():
        raise InputError(f"--bicycle: {unknown('bicycle', bicycle, available_bicycles())}")
    if kind == "measurement":
        _measurement(target, bicycle, force=force)
        return
    text = example_model(load_bicycle(bicycle), read_tyre(tyre), file=target.name)
    build_model(tomllib.loads(text))  # refuses what would not run: a tyre far outside its tests, for example
    write_text(target, text)
    click.echo(f"{target}: {bicycle} on {tyre}; next: velotyre modes {quote(str(target))}")


def _example(target: Path, kind: str) -> None:
    """Write a file that hangs on no bicycle."""
    from studies.missing_effect.plan.example import EXAMPLE as COSTS
    from studies.synthetic_sensors.example import EXAMPLE as SENSORS
    from tyre.base.files import write_text

    _refuse_options(kind, "bicycle", "tyre")
    write_text(target, {"sensors": SENSORS, "costs": COSTS}[kind].format(file=target.name))
    following = {
        "sensors": f"velotyre simulate benchmark --speed 5 --initial lean=0.02 --sensors {target} --noise --out ride",
        "costs": f"velotyre plan kooijman2008 --costs {target} --out plan",
    }  # fmt: skip
    click.echo(f"{target}: {kind}; next: {following[kind]}")


def _measurement(target: Path, bicycle: str, *, force: bool) -> None:
    """Write a measurement of a packaged bicycle, and the table that it names."""
    from bicycle.files.bicycle_file import load_bicycle
    from studies.missing_effect.example import example_measurement
    from tyre.base.csv_text import write_csv
    from tyre.base.errors import InputError
    from tyre.base.files import write_text

    _refuse_options("measurement", "tyre")
    beside = target.with_suffix(".csv")
    if beside.exists() and not force:
        raise InputError(f"{beside} exists, where the table of {target} would be; give --force to overwrite both")
    text, table = example_measurement(load_bicycle(bicycle), file=target.name, table=beside.name)
    write_csv(beside, table)
    write_text(target, text)
    click.echo(f"{target}: synthetic weave of {bicycle} in {beside}; next: velotyre diagnose {target} --out report")


def _refuse_options(kind: str, *options: str) -> None:
    import click.core

    from tyre.base.errors import InputError

    context = click.get_current_context()
    for option in options:
        if context.get_parameter_source(option) is not click.core.ParameterSource.DEFAULT:
            raise InputError(f"--{option} is of a model file; leave it out with --kind {kind}")
