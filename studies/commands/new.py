"""``velotyre new``: a commented file to start from: a model, sensors, costs."""

from pathlib import Path

import click

from studies.reporting.examples import example

KINDS = ("model", "sensors", "costs")


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
    help="model: of every command; sensors: of simulate --sensors; costs: of plan.",
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
    if kind != "model":
        _example(target, kind)
        return
    if bicycle not in available_bicycles():
        raise InputError(f"--bicycle: {unknown('bicycle', bicycle, available_bicycles())}")
    text = example_model(load_bicycle(bicycle), read_tyre(tyre), file=target.name)
    build_model(tomllib.loads(text))  # refuses what would not run: a tyre far outside its tests, for example
    write_text(target, text)
    click.echo(f"{target}: {bicycle} on {tyre}; next: velotyre modes {target}")


def _example(target: Path, kind: str) -> None:
    """Write a file that is no model."""
    import click.core

    from studies.missing_effect.plan.example import EXAMPLE as COSTS
    from studies.synthetic_sensors.example import EXAMPLE as SENSORS
    from tyre.base.errors import InputError
    from tyre.base.files import write_text

    context = click.get_current_context()
    for option in ("bicycle", "tyre"):
        if context.get_parameter_source(option) is not click.core.ParameterSource.DEFAULT:
            raise InputError(f"--{option} is of a model file; leave it out with --kind {kind}")
    write_text(target, {"sensors": SENSORS, "costs": COSTS}[kind].format(file=target.name))
    following = {
        "sensors": f"velotyre simulate benchmark --speed 5 --initial lean=0.02 --sensors {target} --noise --out ride",
        "costs": f"velotyre plan kooijman2008 --costs {target} --out plan",
    }  # fmt: skip
    click.echo(f"{target}: {kind}; next: {following[kind]}")
