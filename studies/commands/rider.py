"""``velotyre rider``: a measured bicycle and a measured or scaled person become a bicycle with rider."""

from collections.abc import Mapping
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
    help="Add a rider to BICYCLE. The rider is rigidly joined to the rear frame; BICYCLE is a packaged name or a "
    "file, without rider.",
    epilog=example(
        "velotyre rider pista --rider charlie --posture drops --out pista_charlie_drops.toml",
        "velotyre rider browser --height 1.80 --mass 75 --posture upright --out browser_rider.toml",
        "velotyre rider pista --mass 75 --place 0.35,1.05 --inertia 8,9,2.5,1.2 --out pista_rider.toml",
    ),
)
@verbose
@click.argument("bicycle")
@click.option("--rider", "rider_name", help="Rider: a packaged name, or a file of 95 measurements (package yeadon).")
@click.option(
    "--height", type=LENGTH, help="Height of the rider, m; with --mass instead of --rider: scaled from a measured body."
)
@click.option("--mass", type=MASS, help="Total mass of the rider, kg.")
@click.option(
    "--place",
    type=PLACE,
    metavar="X,HEIGHT",
    help="Mass centre of the rider or of a load, m; with --mass, without --height.",
)
@click.option(
    "--inertia",
    type=INERTIAS,
    metavar="XX,YY,ZZ[,XZ]",
    help="Inertia with --place, kg m^2, z down; default: point mass.",
)
@click.option("--posture", type=POSTURE, help="Posture of the rider; not with --place.")
@click.option("--torso-lean", type=ANGLE, metavar="DEG", help="Angle from hip to shoulder, forward of the vertical.")
@click.option(
    "--back-rounding", type=ANGLE, default=0.0, metavar="DEG", help="Angle of the chest beyond the pelvis. [default: 0]"
)
@click.option(
    "--elbows-out",
    type=ANGLE,
    default=0.0,
    metavar="DEG",
    help="Elbow angle outwards; 0: below shoulder and hand. [default: 0]",
)
@click.option("--geometry", type=PATH, help="Geometry of seat and handlebar: .toml, or a raw *Measured.txt.")
@click.option(
    "--out", required=True, metavar="FILE", type=PATH, help="File to write, .toml; a picture is written next to it."
)
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

    from bicycle.files.bicycle_files import load_bicycle
    from bicycle.rider.rider_frame import rider_on_bicycle
    from bicycle.rider.rider_posture import SeatGeometry, packaged_geometry, read_geometry
    from studies.model_space.toml_target import check_toml_target
    from studies.reporting import rider_report
    from studies.reporting.output import print_table, print_warnings
    from tyre.ground.errors import InputError
    from tyre.ground.files import write_text

    # Read the options.
    check_toml_target(out, force=force, companions=(".png", ".svg"))
    frame = load_bicycle(bicycle)
    if place is not None or inertia is not None:
        _write_with_mass(frame, mass, place, inertia, out)
        return
    if posture is None:
        raise InputError("give --posture (upright, hoods or drops), or --mass and --place of a rider or load")
    rider = _choose_rider(rider_name, height, mass)
    geometry_file = geometry or packaged_geometry(bicycle)

    # Compute.
    cyclist = rider_on_bicycle(
        frame,
        rider,
        posture=posture,
        geometry=read_geometry(geometry_file, posture) if geometry_file else SeatGeometry(),
        torso_lean=None if torso_lean is None else math.radians(torso_lean),
        back_rounding=math.radians(back_rounding),
        elbows_out=math.radians(elbows_out),
    )
    joined = rider_report.with_provenance(cyclist, out.stem)

    # Show.
    options = {
        "rider": rider_name,
        "height": height,
        "mass": mass,
        "posture": posture,
        "torso-lean": torso_lean,
        "back-rounding": back_rounding or None,
        "elbows-out": elbows_out or None,
        "geometry": geometry.name if geometry else None,
    }
    write_text(out, rider_report.file_text(cyclist, joined, _command_line(bicycle, options)))
    rider_report.save_figure(cyclist, out.with_suffix(""))
    print_table(rider_report.table(cyclist), rider_report.HEADERS)
    lean, knees, elbows = (
        math.degrees(angle)
        for angle in (cyclist.angles.torso_lean, cyclist.seated.knee_flexion, cyclist.seated.elbow_flexion)
    )
    click.echo(f"torso {lean:.0f} deg forward of the vertical, knees bent {knees:.0f}, elbows {elbows:.0f} deg")
    for wheel, load, sd in rider_report.loads(cyclist, joined):
        click.echo(f"{wheel} wheel {load:.0f} +- {sd:.0f} N")
    for note in rider_report.notes(cyclist):
        click.echo(f"note: {note}")
    print_warnings(joined.warnings)
    click.echo(f"{out.as_posix()}, {out.with_suffix('.png').as_posix()}")


def _command_line(bicycle: str, options: Mapping[str, str | float | None]) -> str:
    """Write the command that makes the file again, with the options that are not None."""
    import shlex

    texts = {
        name: f"{value:g}" if isinstance(value, float) else str(value)
        for name, value in options.items()
        if value is not None
    }
    words = " ".join(f"--{name} {shlex.quote(text)}" for name, text in texts.items())
    return f"velotyre rider {Path(bicycle).name} {words}"


def _write_with_mass(
    frame: "Bicycle",
    mass: float | None,
    place: tuple[float, float] | None,
    inertia: tuple[float, ...] | None,
    out: Path,
) -> None:
    """Write a bicycle that carries ``mass`` (kg) at ``place`` (x, height; m), as an entry of its ``[[bodies]]``.

    Its ``inertia`` is xx, yy, zz, perhaps xz (kg m^2, z down) about its centre; None for a point.
    """
    from dataclasses import replace
    from typing import Any

    from bicycle.files.bicycle_files import load_bicycle, to_toml
    from bicycle.files.bicycle_numbers import read_body
    from studies.model_space.command_options import stated
    from studies.reporting.output import print_warnings
    from tyre.ground.errors import InputError
    from tyre.ground.files import write_text

    body_options = [f"--{key.removesuffix('_name').replace('_', '-')}" for key in OF_A_BODY if stated(key)]
    if mass is None or place is None:
        raise InputError("--place X,HEIGHT needs --mass, and --inertia needs both")
    if body_options:
        raise InputError(f"--place needs no body model: leave out {', '.join(body_options)}")
    body: dict[str, Any] = {"name": "rider", "mass": mass, "place": list(place)}
    if inertia is not None:
        body["inertia"] = list(inertia)
    read_body(body)
    x, height = place
    description = f"{frame.name} with {mass:g} kg at {x:g} m, {height:g} m up{'' if inertia else ' (a point)'}"
    carrier = replace(frame, description=description, source=frame.source or "a file")
    write_text(out, to_toml(carrier, allow_unusual=frame.unusual, bodies=[body]))
    loaded = load_bicycle(out)
    rear, front = loaded.static_loads
    click.echo(
        f"{description}; wheel loads {rear:.0f} N rear, {front:.0f} N front; mass, place and inertia are treated as "
        f"exact"
    )
    print_warnings(loaded.warnings)
    click.echo(out.as_posix())


def _choose_rider(name: str | None, height: float | None, mass: float | None) -> "RiderMeasurements":
    """Read a measured rider, with another ``mass`` (kg) if there is one, or scale one to ``height`` (m) and mass."""
    from bicycle.rider.rider_body import available_riders, read_rider, scaled_rider
    from tyre.ground.errors import InputError

    if name is not None and height is not None:
        raise InputError("give either --rider (a measured body) or --height and --mass (a scaled one), not both")
    if name is not None:
        rider = read_rider(name)
        return rider if mass is None else rider.weighing(mass)
    if height is None or mass is None:
        packaged = ", ".join(available_riders())
        raise InputError(f"give --rider (packaged: {packaged}; or a file), or --height and --mass of a body")
    return scaled_rider(height=height, mass=mass)
