"""``velotyre new``: a commented file to start from: a model, a measurement, sensors."""

from pathlib import Path
from shlex import quote
from typing import Any

import click

from studies.front_frame.figure_options import FIGURES, stated_figures, takes_published_figures
from studies.model_space.command_options import (
    ANGLE,
    INERTIA,
    INERTIAS,
    LENGTH,
    LENGTH_ABOVE_0,
    MASS,
    PATH,
    PLACE,
    POSTURE,
    stated,
)
from studies.reporting.command_context import example

NEEDED = ("wheelbase", "head_angle", "wheel", "mass")


@click.command(
    help="Write a commented file to start from. FILE.toml is a model file (or another --kind) that runs as it is, with "
    "every key explained; or, from the sizes you measured, your own bicycle and its model file.",
    epilog=example(
        "velotyre new model.toml",
        "velotyre new mine.toml --wheelbase 1.02 --trail 0.06 --head-angle 72.5 --wheel 28-622 --mass 9 "
        "--rider-height 1.80 --rider-mass 75 --posture hoods",
        "velotyre new front.toml --bicycle pista_charlie_drops --head-tube 95 --fork 45",
    ),
)
@click.argument("target", metavar="FILE.toml", type=PATH)
@click.option(
    "--kind",
    type=click.Choice(("model", "measurement", "sensors")),
    default="model",
    show_default=True,
    help="Kind of file: model, of every command; measurement with its table, of diagnose; sensors, of simulate.",
)
@click.option(
    "--bicycle", default="benchmark", show_default=True, help="Bicycle of the model: a packaged name or a bicycle file."
)
@click.option("--tyre", default="Tyre1", show_default=True, help="Tyre of the model: a packaged name.")
@click.option("--wheelbase", type=LENGTH_ABOVE_0, help="Wheelbase, m; with the options below: your own bicycle.")
@click.option("--trail", type=LENGTH, help="Trail, m; or give --fork-offset.")
@click.option(
    "--fork-offset", type=LENGTH, help="Distance of the hub before the steer axis (rake), m; instead of --trail."
)
@click.option("--head-angle", type=ANGLE, help="Angle of the steer axis from the horizontal, degrees.")
@click.option("--wheel", metavar="SIZE", help="Tyre size as printed on the tyre: 28-622, 700x28C, '26 x 1.75'.")
@click.option("--mass", type=MASS, help="Mass of the bicycle without rider, kg.")
@click.option(
    "--rider-height", type=LENGTH_ABOVE_0, help="Height of the rider, m (needs the extra rider); default: no rider."
)
@click.option("--rider-mass", type=MASS, help="Mass of the rider, kg.")
@click.option(
    "--rider-place", type=PLACE, metavar="X,HEIGHT", help="Mass centre of the rider, m; instead of --rider-height."
)
@click.option(
    "--rider-inertia",
    type=INERTIAS,
    metavar="XX,YY,ZZ[,XZ]",
    help="Inertia with --rider-place, kg m^2, z down; default: point mass.",
)
@click.option("--posture", type=POSTURE, default="hoods", help="Posture of the rider. [default: hoods]")
@click.option("--front-wheel-mass", type=MASS, help="Mass of the front wheel, kg; narrows the speeds.")
@click.option("--fork-mass", type=MASS, help="Mass of fork, stem and handlebar, kg; narrows the speeds.")
@click.option(
    "--front-wheel-inertia", type=INERTIA, help="Inertia of the front wheel about its axle, kg m^2; narrows the speeds."
)
@takes_published_figures
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
def command(target: Path, kind: str, bicycle: str, tyre: str, *, force: bool, **data: Any) -> None:
    from bicycle.files.bicycle_files import available_bicycles, load_bicycle
    from bicycle.model.model_file import build_model
    from studies.front_frame.hinge_report import hinge_tables
    from studies.front_frame.published import map_figures, read_map
    from studies.model_space.model_example import example_model
    from studies.model_space.toml_target import near_to
    from tyre import read_tyre
    from tyre.ground.errors import InputError, unknown
    from tyre.ground.files import tomllib, write_text

    if target.suffix.lower() != ".toml":
        named = (target if target.name else target / kind).with_suffix(".toml")
        raise InputError(f"{target}: a {kind} file ends in .toml; give for example {named}")
    if target.exists() and not force:
        raise InputError(f"{target} exists; give --force to overwrite it or another name")
    published = {name: data.pop(name) for name in FIGURES}
    figures = stated_figures(published)
    stated_options = [key for key in click.get_current_context().params if stated(key)]
    describes_bicycle = bool(set(stated_options) & set(data))
    unused: tuple[str, ...] = {"model": (), "measurement": ("tyre", *FIGURES)}.get(kind, ("bicycle", "tyre", *FIGURES))
    why = dict.fromkeys(unused, f"is of a model file; leave it out with --kind {kind}")
    if describes_bicycle:
        why = dict.fromkeys(("kind", "bicycle", "tyre"), "is not used for your own bicycle; leave it out")
        why["tyre"] += f", and change the tyre in {_model_beside(target).name}, which is written too"
    for option, reason in why.items():
        if option in stated_options:
            raise InputError(f"--{option.replace('_', '-')} {reason}")
    if describes_bicycle:
        _write_own_bicycle(target, data, published, force=force)
        return
    if kind == "sensors":
        _write_sensors(target)
        return
    packaged = bicycle in available_bicycles()
    if not packaged and (kind == "measurement" or not Path(bicycle).suffix):
        raise InputError(f"--bicycle: {unknown('bicycle', bicycle, available_bicycles())}")
    if kind == "measurement":
        _write_measurement(target, bicycle, force=force)
        return
    place = bicycle if packaged else near_to(bicycle, target)
    frame, tables = load_bicycle(bicycle), ""
    if figures is not None:
        tables = hinge_tables(map_figures(figures, read_map()), figures, frame)
    text = example_model(frame, read_tyre(tyre), file=target.name, place=place, front_frame=tables)
    # refuses what does not run: a tyre far outside its tests, for example
    build_model(tomllib.loads(text), folder=target.parent)
    write_text(target, text)
    click.echo(f"{target}: {bicycle} on {tyre}; next: velotyre modes {quote(str(target))}")


def _model_beside(target: Path) -> Path:
    """The model file that is written with the bicycle file ``target``."""
    return target.with_name(f"{target.stem}_model.toml")


def _write_own_bicycle(target: Path, data: dict[str, Any], published: dict[str, float | None], *, force: bool) -> None:
    """Write a bicycle and its model; its owner gives ``data``, option -> value (SI, angles in degrees) or None.

    ``published`` holds the figures of its front frame, option -> value as published or None.
    """
    from studies.bicycles.own_bicycle import Asked, file_text, model_text, own_bicycle
    from tyre.ground.errors import InputError
    from tyre.ground.files import write_text

    missing = [f"--{key.replace('_', '-')}" for key in NEEDED if data[key] is None]
    if data["trail"] is None and data["fork_offset"] is None:
        missing.append("--trail or --fork-offset")
    if missing:
        raise InputError(f"your own bicycle needs {', '.join(missing)}")
    model_target = _model_beside(target)
    if model_target.exists() and not force:
        raise InputError(
            f"{model_target} exists, where the model of {target} is written; give --force to overwrite both or another "
            "name"
        )
    description = Asked(**data, published=stated_figures(published))
    bicycle = own_bicycle(description, target.stem)
    options = []
    for key, value in (data | published).items():
        if value is not None:
            text = ",".join(f"{number:g}" for number in value) if isinstance(value, tuple) else str(value)
            options.append(f"--{key.replace('_', '-')} {quote(text)}")
    text = file_text(bicycle, description, f"velotyre new {target.name} {' '.join(options)}", model_target.name)
    write_text(target, text)
    write_text(model_target, model_text(bicycle, description, target.name, model_target.name))
    head = text.partition("\ndescription = ")[0].rstrip().splitlines()[3:]
    click.echo("\n".join(line.removeprefix("#").removeprefix(" ") for line in head))
    click.echo(f"{target} and {model_target}: next: velotyre critical {quote(str(model_target))}")


def _write_sensors(target: Path) -> None:
    """Write an example of sensors, and say how a simulation uses it."""
    from studies.motion.synthetic_sensors import EXAMPLE
    from tyre.ground.files import write_text

    write_text(target, EXAMPLE.format(file=target.name))
    ride = f"simulate benchmark --speed 5 --initial lean=0.02 --sensors {target} --noise --out ride"
    click.echo(f"{target}: sensors; next: velotyre {ride}")


def _write_measurement(target: Path, bicycle: str, *, force: bool) -> None:
    """Write a measurement of a packaged bicycle, and the table that it names."""
    from bicycle.files.bicycle_files import load_bicycle
    from studies.diagnosis.measurement_file import example_measurement
    from tyre.ground.errors import InputError
    from tyre.ground.files import write_text
    from tyre.ground.text_table import write_csv

    table_file = target.with_suffix(".csv")
    if table_file.exists() and not force:
        raise InputError(f"{table_file} exists, where the table of {target} is written; give --force to overwrite both")
    text, table = example_measurement(load_bicycle(bicycle), file=target.name, table=table_file.name)
    write_csv(table_file, table)
    write_text(target, text)
    click.echo(f"{target}: synthetic weave of {bicycle} in {table_file}; next: velotyre diagnose {target} --out report")
