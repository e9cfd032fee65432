"""``velotyre rider``: a measured bicycle and a measured or scaled person become a bicycle with rider."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from studies.model_space.command_options import ANGLE, INERTIAS, LENGTH, MASS, PATH, PLACE, POSTURE
from studies.reporting.command_context import example, verbose

if TYPE_CHECKING:
    from bicycle.parameters.bicycle import Bicycle
    from bicycle.rider.rider_body import RiderMeasurements


OF_A_BODY = ("rider_name", "height", "posture", "torso_lean", "back_rounding", "elbows_out", "geometry")
"""Options of a rider whose body is modelled."""


@click.command(
    help="Put a rider on BICYCLE (packaged or a file, without rider) as one rigid body with its rear frame.",
    epilog=example(
        "velotyre rider pista --rider charlie --posture drops --out pista_charlie_drops.toml",
        "velotyre rider browser --height 1.80 --mass 75 --posture upright --out browser_rider.toml",
        "velotyre rider pista --mass 75 --place 0.35,1.05 --inertia 8,9,2.5,1.2 --out pista_rider.toml",
    ),
)
@verbose
@click.argument("bicycle")
@click.option("--rider", "rider_name", help="A packaged rider, or a file of 95 measurements (package yeadon).")
@click.option("--height", type=LENGTH, help="m; with --mass instead of --rider: a body scaled from a measured one.")
@click.option("--mass", type=MASS, help="Total mass of the rider, kg.")
@click.option("--place", type=PLACE, metavar="X,HEIGHT", help="With --mass alone: its centre, m; also of a load.")
@click.option("--inertia", type=INERTIAS, metavar="XX,YY,ZZ[,XZ]", help="With --place, kg m^2, z down; else a point.")
@click.option("--posture", type=POSTURE, help="How the rider sits; not with --place.")
@click.option("--torso-lean", type=ANGLE, metavar="DEG", help="Hip to shoulder, forward of the vertical.")
@click.option("--back-rounding", type=ANGLE, default=0.0, metavar="DEG", help="Chest beyond the pelvis. [default: 0]")
@click.option("--elbows-out", type=ANGLE, default=0.0, metavar="DEG", help="0: below shoulder and hand. [default: 0]")
@click.option("--geometry", type=PATH, help="Seat and bar: .toml, or a raw *Measured.txt.")
@click.option("--out", required=True, metavar="FILE", type=PATH, help=".toml; a picture beside.")
@click.option("--force", is_flag=True, help="Overwrite existing files.")
def command(
    bicycle: str,
    rider_name: str | None,
    height: float | None,
    mass: float | None,
    place: tuple[float, float] | None,
    inertia: tuple[float, ...] | None,
    posture: str | None,
    torso_lean: float | None,
    back_rounding: float,
    elbows_out: float,
    geometry: Path | None,
    out: Path,
    *,
    force: bool,
) -> None:
    import math
    import shlex

    from bicycle.files.bicycle_files import load_bicycle
    from bicycle.rider.rider_frame import rider_on_bicycle
    from bicycle.rider.rider_posture import SeatGeometry, packaged_geometry, read_geometry
    from studies.reporting import rider_report as rider_words
    from studies.reporting.output import print_table, print_warnings
    from tyre.ground.errors import InputError
    from tyre.ground.files import write_text

    _check_target(out, force=force)
    frame = load_bicycle(bicycle)
    if place is not None or inertia is not None:
        _write_placed(frame, mass, place, inertia, out)
        return
    if posture is None:
        raise InputError("give --posture (upright, hoods or drops), or --mass and --place of a rider or load")
    person = _rider(rider_name, height, mass)
    known = geometry or packaged_geometry(bicycle)
    found = rider_on_bicycle(
        frame,
        person,
        posture=posture,
        geometry=read_geometry(known, posture) if known else SeatGeometry(),
        torso_lean=None if torso_lean is None else math.radians(torso_lean),
        back_rounding=math.radians(back_rounding),
        elbows_out=math.radians(elbows_out),
    )
    made = rider_words.with_provenance(found, out.stem)
    asked = click.get_current_context().params
    options = {"rider": rider_name, "height": height, "mass": mass, "posture": posture, "torso-lean": torso_lean}
    options |= {k.replace("_", "-"): asked[k] or None for k in ("back_rounding", "elbows_out")}
    options["geometry"] = geometry.name if geometry else None
    words = [
        f"--{name} {shlex.quote(f'{v:g}' if isinstance(v, float) else str(v))}"
        for name, v in options.items()
        if v is not None
    ]
    write_text(out, rider_words.file_text(found, made, f"velotyre rider {Path(bicycle).name} {' '.join(words)}"))
    rider_words.save_figure(found, out.with_suffix(""))
    print_table(rider_words.table(found), rider_words.HEADERS)
    lean = math.degrees(found.angles.torso_lean)
    click.echo(
        f"torso {lean:.0f} deg forward of the vertical, knees bent {math.degrees(found.seated.knee_flexion):.0f}, "
        f"elbows {math.degrees(found.seated.elbow_flexion):.0f} deg"
    )
    for wheel, load, sd in rider_words.loads(found, made):
        click.echo(f"{wheel} wheel {load:.0f} +- {sd:.0f} N")
    for note in rider_words.notes(found):
        click.echo(f"note: {note}")
    print_warnings(made.warnings)
    click.echo(f"{out.as_posix()}, {out.with_suffix('.png').as_posix()}")


def _write_placed(
    frame: "Bicycle",
    mass: float | None,
    place: tuple[float, float] | None,
    inertia: tuple[float, ...] | None,
    out: Path,
) -> None:
    """Write a bicycle that carries a mass at a place, as an entry of its ``[[bodies]]``."""
    from dataclasses import replace
    from typing import Any

    from bicycle.files.bicycle_files import load_bicycle, to_toml
    from bicycle.files.bicycle_numbers import read_body
    from studies.model_space.command_options import stated
    from studies.reporting.output import print_warnings
    from tyre.ground.errors import InputError
    from tyre.ground.files import write_text

    given = [f"--{key.removesuffix('_name').replace('_', '-')}" for key in OF_A_BODY if stated(key)]
    if mass is None or place is None:
        raise InputError("--place X,HEIGHT goes with --mass, and --inertia with both")
    if given:
        raise InputError(f"--place needs no body model: leave out {', '.join(given)}")
    body: dict[str, Any] = {"name": "rider", "mass": mass, "place": list(place)}
    body |= {} if inertia is None else {"inertia": list(inertia)}
    read_body(body)
    x, height = place
    words = f"{frame.name} with {mass:g} kg at {x:g} m, {height:g} m up{'' if inertia else ' (a point)'}"
    described = replace(frame, description=words, source=frame.source or "a file")
    write_text(out, to_toml(described, allow_unusual=frame.unusual, bodies=[body]))
    made = load_bicycle(out)
    rear, front = made.static_loads
    click.echo(f"{words}; wheel loads {rear:.0f} N rear, {front:.0f} N front; mass, place and inertia count as exact")
    print_warnings(made.warnings)
    click.echo(out.as_posix())


def _check_target(out: Path, *, force: bool) -> None:
    from tyre.ground.errors import InputError

    if out.suffix.lower() != ".toml":
        raise InputError(f"--out {out}: the ending {out.suffix!r} is not known; write a .toml file")
    if not out.parent.is_dir():
        raise InputError(f"--out {out}: there is no folder {out.parent}")
    taken = [file for file in (out, out.with_suffix(".png"), out.with_suffix(".svg")) if file.exists()]
    if taken and not force:
        raise InputError(f"{taken[0]} exists; give --force to overwrite it or another name")


def _rider(name: str | None, height: float | None, mass: float | None) -> "RiderMeasurements":
    from bicycle.rider.rider_body import available_riders, read_rider, scaled_rider
    from tyre.ground.errors import InputError

    if name is not None and height is not None:
        raise InputError("give either --rider (a measured body) or --height and --mass (a scaled one), not both")
    if name is not None:
        person = read_rider(name)
        return person if mass is None else person.weighing(mass)
    if height is None or mass is None:
        known = ", ".join(available_riders())
        raise InputError(f"give --rider (packaged: {known}; or a file), or --height and --mass of a body")
    return scaled_rider(height=height, mass=mass)
