"""``velotyre new``: a commented model file to start from."""

from pathlib import Path

import click

from studies.reporting.examples import example


@click.command(
    help="Write MODEL.toml, a model file that runs as it is, with every key explained.",
    epilog=example("velotyre new model.toml", "velotyre modes model.toml"),
)
@click.argument("target", metavar="MODEL.toml", type=click.Path(path_type=Path))
@click.option("--bicycle", default="benchmark", show_default=True, help="A packaged bicycle to begin with.")
@click.option("--tyre", default="Tyre1", show_default=True, help="A packaged tyre to begin with.")
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
def command(target: Path, bicycle: str, tyre: str, *, force: bool) -> None:
    from bicycle.files.bicycle_file import available_bicycles, load_bicycle
    from bicycle.files.model_file import build_model
    from studies.model_example import example_model
    from tyre import read_tyre
    from tyre.base.errors import InputError, unknown
    from tyre.base.files import write_text
    from tyre.base.toml_file import tomllib

    if target.suffix.lower() != ".toml":
        raise InputError(f"{target}: a model file ends in .toml; give for example {target.with_suffix('.toml')}")
    if target.exists() and not force:
        raise InputError(f"{target} exists; give --force to overwrite it or another name")
    if bicycle not in available_bicycles():
        raise InputError(f"--bicycle: {unknown('bicycle', bicycle, available_bicycles())}")
    text = example_model(load_bicycle(bicycle), read_tyre(tyre), file=target.name)
    build_model(tomllib.loads(text))  # refuses what would not run: a tyre far outside its tests, for example
    write_text(target, text)
    click.echo(f"{target}: {bicycle} on {tyre}; next: velotyre modes {target}")
