"""``velotyre closed-loop``: a rider who steers, on one bicycle and several tyres."""

from itertools import product
from pathlib import Path

import click

from studies.model_space.command_options import FOLDER, speeds_option
from studies.reporting.command_context import example, verbose


@click.command(
    help="Assess MODEL with a rider who steers. Stabilised speeds, stability margins, limiting motion, and the "
    "softest tyre that the rider stabilises.",
    epilog=example("velotyre closed-loop rigid_rider_joined --rider-control schwab2013 --out ride"),
)
@click.argument("models", metavar="MODEL...", nargs=-1, required=True)
@click.option(
    "--rider-control", required=True, metavar="NAME", help="Rider: a packaged name (davis_j), or a file (.toml)."
)
@click.option(
    "--tyre",
    "tyres",
    multiple=True,
    metavar="TYRE",
    help="Tyre on both wheels, as in other commands; repeat to compare.",
)
@click.option(
    "--pressure", "pressures", multiple=True, metavar="BAR", help="Pressure of each --tyre, bar; repeat to compare."
)
@click.option("--surface", metavar="SURFACE", help="Test surface of --tyre: flat (default) or drum.")
@click.option(
    "--extrapolate", is_flag=True, help="Allow tyre data more than one range width outside the measured range."
)
@speeds_option("; default: the speeds of the rider's measured runs.")
@click.option("--out", type=FOLDER, help="Folder for page, figure and table.")
@verbose
def command(
    models: tuple[str, ...],
    rider_control: str,
    tyres: tuple[str, ...],
    pressures: tuple[str, ...],
    surface: str | None,
    speeds: str | None,
    out: Path | None,
    *,
    extrapolate: bool,
) -> None:
    from studies.model_space.model_argument import choose
    from studies.motion.ride import read_rider_control, render_rides, rides, table, write_ride
    from studies.reporting.manifest import results
    from studies.reporting.output import parse_speeds, print_named_warnings, print_table, write_csv

    rider = read_rider_control(rider_control)
    cases = {}
    for text, tyre, pressure in product(models, tyres or (None,), pressures or (None,)):
        chosen = choose(text, tyre=tyre, pressure=pressure, surface=surface, extrapolate=extrapolate)
        label = [text] if len(models) > 1 or tyre is None else []
        label += [tyre or "", _condition(pressure)]
        cases[" ".join(filter(None, label))] = chosen.model
    comparison = rides(rider, cases, None if speeds is None else parse_speeds(speeds, 10_000))
    rows = table(comparison)
    if out is not None:
        import pandas as pd

        with results(out):
            write_csv(pd.concat([ride.runs for ride in comparison]), out / "runs.csv")
            write_ride(comparison, out)
    print_table([list(row.values()) for row in rows], list(rows[0]))
    click.echo(render_rides(comparison, "ride.txt.j2").strip())
    print_named_warnings({label: model.linear_model().warnings for label, model in cases.items()})


def _condition(pressure: str | None) -> str:
    """A pressure as it was typed, with its unit."""
    if not pressure:
        return ""
    return pressure if any(letter.isalpha() for letter in pressure) else f"{pressure} bar"
