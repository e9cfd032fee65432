"""``velotyre forces``: lateral forces, slip angles and share of the grip along recorded rides."""

from pathlib import Path
from typing import Any

import click

from studies.model_space.channel_options import chosen_map, takes_channels
from studies.model_space.command_options import PATH, Number
from studies.reporting.command_context import example, verbose


@click.command(
    help="Estimate tyre forces and slip angles of a ride. Each recording is given with its speed, m/s, "
    "RIDE.csv@4.8, or alone where it has a column of the speed.",
    epilog=example("velotyre forces ride.csv@5 --model pista_charlie_drops --tyre Tyre1 --pressure 5.5 --out forces"),
)
@verbose
@click.argument("rides", nargs=-1, required=True, metavar="RIDE.csv@SPEED...")
@click.option("--model", "model_text", required=True, metavar="MODEL", help="Model: a packaged name or a file.")
@click.option("--tyre", metavar="TYRE", help="Tyre on both wheels: a packaged name or a file.")
@click.option("--pressure", metavar="BAR", help="Inflation pressure of --tyre, bar: one number, or REAR,FRONT.")
@click.option("--surface", metavar="SURFACE", help="Test surface of --tyre: flat (default) or drum.")
@click.option(
    "--extrapolate", is_flag=True, help="Allow tyre data more than one range width outside the measured range."
)
@takes_channels
@click.option("--grip", type=Number(0, 2, above=True), help="Largest lateral force over load. [default: 0.8, assumed]")
@click.option(
    "--steering",
    type=click.Choice(("rider", "controller", "nobody")),
    help="Who steers; default: as the recorded torque and the model show.",
)
@click.option("--turns", is_flag=True, help="Keep turns, in which a linear model is less accurate.")
@click.option("--out", type=PATH, metavar="DIR|FILE.csv", help="Folder for table and figure, or the table alone.")
@click.option("--force", is_flag=True, help="Overwrite existing files.")
def command(
    rides: tuple[str, ...],
    model_text: str,
    tyre: str | None,
    pressure: str | None,
    surface: str | None,
    channels_file: Path | None,
    channel_texts: tuple[str, ...],
    grip: float | None,
    steering: str | None,
    out: Path | None,
    *,
    extrapolate: bool,
    turns: bool,
    force: bool,
) -> None:
    from bicycle.identification.ride_recording import read_ride
    from studies.model_space.model_argument import choose
    from studies.model_space.run_argument import ride_file_and_speed
    from studies.rides.estimate import forces_of_rides
    from tyre.recordings.draft import looking

    # Read the options.
    targets = _targets(out, force=force)
    chosen = choose(model_text, tyre=tyre, pressure=pressure, surface=surface, extrapolate=extrapolate)
    channel_map = chosen_map(channels_file, channel_texts)
    read = []
    for text in rides:
        file, speed = ride_file_and_speed(text)
        with looking(file):
            read.append(read_ride(file, speed, channel_map=channel_map, keep_turns=turns))

    # Compute.
    forces = forces_of_rides(chosen.model, read, grip=grip, steering=steering or "")

    # Show.
    _print(forces)
    if out is not None:
        synthetic = any(_is_synthetic(ride_file_and_speed(text)[0]) for text in rides)
        _write(forces, out, synthetic=synthetic)
        click.echo(", ".join(file.as_posix() for file in targets))


def _targets(out: Path | None, *, force: bool) -> list[Path]:
    """Files that will be written; an existing one is refused without ``force``."""
    from studies.reporting.output import check_targets
    from tyre.ground.errors import InputError

    if out is None:
        return []
    if out.suffix:
        check_targets(out=str(out))
        files = [out]
    else:
        files = [out / "forces.csv", out / "forces.png"]
    existing = [file for file in files if file.exists()]
    if existing and not force:
        raise InputError(f"{existing[0]} exists; give --force to overwrite it or another name")
    return files


def _print(forces: Any) -> None:
    from studies.reporting.output import print_few, print_table
    from studies.rides import report

    for note in forces.notes:
        click.echo(f"note: {note}", err=True)
    print_few("used", report.segment_lines(forces))
    print_few("left out", forces.left_out)
    click.echo("\nLargest lateral forces (± one standard uncertainty)")
    print_table(report.largest_rows(forces), report.HEADERS)
    click.echo()
    for line in report.sentences(forces):
        click.echo(line)
    narrowed = report.narrowed_rows(forces)
    if narrowed:
        click.echo("\nParameters that the ride has narrowed")
        print_table(narrowed, ("parameter", "unit", "stated", "after the ride"))


def _write(forces: Any, out: Path, *, synthetic: bool) -> None:
    """Write the table to a file, or table and figure into a folder."""
    from studies.reporting.manifest import results
    from studies.rides.report import figure_of_forces
    from tyre.ground.text_table import write_csv

    table = forces.table()
    if out.suffix:
        write_csv(out, table, number_format="%.6g")
        return
    with results(out):
        write_csv(out / "forces.csv", table, number_format="%.6g")
        figure_of_forces(forces, out / "forces", synthetic=synthetic)


def _is_synthetic(file: Path) -> bool:
    """True if the first lines of a recording state that it is synthetic."""
    with file.open("rb") as stream:
        return b"SYNTHETIC" in stream.read(2000)
