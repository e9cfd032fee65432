"""``velotyre amplitude``: how large wobble and weave get on tyres that saturate."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from studies.model_space.command_options import FINITE, PATH, Number, max_speed_option, speeds_option, stated
from studies.model_space.model_argument import ChosenModel, takes_model
from studies.reporting.command_context import example

if TYPE_CHECKING:
    import pandas as pd

    from bicycle.motion.kicks import Kick

CSV = ("speed_m_s", "mode", "stable", "steer_amplitude_deg", "frequency_Hz", "acceleration_m_s2")
UNITS = {"steer_torque": "N m s", "lateral_push": "N s", "steer": "rad"}  # by what --impulse disturbs


@click.command(
    help="Compute periodic motions on tyres that saturate. Amplitude, frequency and stability of each limit cycle "
    "of MODEL.",
    epilog=example("velotyre amplitude pista_charlie_drops --tyre Tyre1 --pressure 5.5 --csv amplitude.csv"),
)
@takes_model
@speeds_option(".", "1:60:1")
@max_speed_option(60.0)
@click.option(
    "--peak-factor", type=FINITE, default=0.8, show_default=True, help="Peak factor D: peak lateral force over load."
)
@click.option(
    "--shape-factor", type=FINITE, default=1.3, show_default=True, help="Shape factor C of the Magic Formula."
)
@click.option(
    "--curvature-factor", type=FINITE, default=0.0, show_default=True, help="Curvature factor E of the Magic Formula."
)
@click.option(
    "--impulse", type=click.Choice(list(UNITS)), help="Also find the smallest impulse that starts a limit cycle."
)
@click.option(
    "--damper",
    type=Number(0, 100, above=True, unit="N m s/rad"),
    help="Added steering damping, N m s/rad; default: the minimum that removes wobble.",
)
@click.option(
    "--point", metavar="X,Z", help="Point of the acceleration, m, z down; default: 0.8 m up on the steer axis."
)
@click.option("--plot", "plot_file", metavar="FILE", help="Draw amplitude and frequency: .png, .svg or .pdf.")
@click.option("--film", type=PATH, help="Film the largest stable limit cycle: .gif.")
@click.option("--csv", "csv_file", metavar="FILE", help="Write a row per speed and mode as CSV; - is standard output.")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
def command(
    chosen: ChosenModel,
    speeds: str,
    max_speed: float,
    peak_factor: float,
    shape_factor: float,
    curvature_factor: float,
    impulse: str | None,
    damper: float | None,
    point: str | None,
    plot_file: str | None,
    film: Path | None,
    csv_file: str | None,
    json_file: str | None,
) -> None:
    from bicycle.motion.kicks import kick_thresholds
    from bicycle.motion.limit_cycles import find_limit_cycles
    from bicycle.motion.nonlinear import MagicTyre
    from studies.model_space.lasting_motions import curves_of, sides
    from studies.motion.amplitude import draw_amplitude, film_cycle, lines, record
    from studies.motion.animation import check_film
    from studies.reporting.output import check_targets, parse_speeds, print_warnings, write_csv, write_json
    from studies.reporting.plotting import check_picture

    # Read the options.
    if plot_file is not None:
        check_picture(plot_file)
    if film is not None:
        check_film(film)
    check_targets(csv=csv_file, json=json_file)
    grid = parse_speeds(speeds, 10_000)
    accelerometer = _parse_point(point)
    model = chosen.model
    curves = {}
    if not any(map(stated, ("peak_factor", "shape_factor", "curvature_factor"))):
        curves = curves_of(chosen.content)
    tyre = MagicTyre(peak_factor, shape_factor, curvature_factor)
    tyres: dict[str, Any] = {"rear": tyre, "front": tyre} | curves
    grip = None if curves else peak_factor

    # Compute.
    cycles = find_limit_cycles(model, max_speed=max_speed, **tyres)
    frame = cycles.frame(grid[grid > 0], accelerometer)
    kicks = kick_thresholds(cycles, grid[grid > 0], impulse) if impulse is not None else []
    if film is not None:
        film_cycle(cycles, frame["speed_m_s"].unique().tolist(), film)
    to_screen = "-" not in (csv_file, json_file)
    damper_sides = sides(cycles, damper, tyres, max_speed) if to_screen or json_file is not None else []

    # Show.
    if csv_file is not None:
        write_csv(frame[list(CSV)], csv_file)
    if plot_file is not None:
        draw_amplitude(cycles, plot_file, title=f"Limit cycles of {model.bicycle.name}", peak_factor=grip)
    if json_file is not None:
        write_json(record(cycles, frame, kicks, UNITS.get(str(impulse), ""), damper_sides), json_file)
    if to_screen:
        if len(frame):
            _print_cycles(frame)
        if kicks:
            _print_kicks(kicks, UNITS[str(impulse)])
        summary = lines(
            cycles,
            frame,
            peak_factor=grip,
            without_kick=impulse is not None and not kicks,
            sides=damper_sides,
            max_speed=max_speed,
        )
        click.echo("\n".join(summary))
        print_warnings(model.linear_model().warnings)


def _print_cycles(frame: "pd.DataFrame") -> None:
    """Print the first seven columns of the periodic motions, a row per speed and mode."""
    from studies.reporting.output import print_table

    headers = ["speed m/s", "mode", "stable", "steer °", "frequency Hz", "acceleration m/s2", "lean °"]
    print_table(frame.iloc[:, :7].astype(object).to_numpy().tolist(), headers)
    click.echo()


def _print_kicks(kicks: "Sequence[Kick]", unit: str) -> None:
    """Print the smallest impulse, in ``unit``, that starts another motion at each speed."""
    from studies.reporting.output import print_table

    rows = [[f"{kick.speed:g}", *kick[1:6], "yes" if kick.within_geometry else "no"] for kick in kicks]
    headers = [
        "speed m/s",
        "mode",
        f"estimate {unit}",
        f"minimum {unit}",
        "result",
        f"fall from {unit}",
        "linear geometry",
    ]
    print_table(rows, headers)
    click.echo()


def _parse_point(text: str | None) -> tuple[float, float] | None:
    """Read X,Z in m (z down) of the accelerometer; None by default."""
    from tyre.ground.errors import InputError
    from tyre.ground.number_with_unit import typed_numbers

    if text is None:
        return None
    point = typed_numbers(text.split(","), "m", alike=False)
    if len(point) != 2 or max(map(abs, point)) > 10:
        raise InputError(f"--point {text}: give X,Z in m, up to 10, z down, such as 0.9,-0.8")
    return point[0], point[1]
