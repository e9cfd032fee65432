"""``velotyre amplitude``: how large wobble and weave get on tyres that saturate."""

from pathlib import Path
from typing import Any

import click

from studies.model_space.command_options import FINITE, PATH, Number, max_speed_option, speeds_option, stated
from studies.model_space.model_argument import ChosenModel, takes_model
from studies.reporting.command_context import example

CSV = ("speed_m_s", "mode", "stable", "steer_amplitude_deg", "frequency_Hz", "acceleration_m_s2")
UNITS = {"steer_torque": "N m s", "lateral_force": "N s", "steer": "rad"}  # of --kick


@click.command(
    help="Amplitude and frequency of the periodic motions of MODEL on tyres that saturate, stable or not.",
    epilog=example("velotyre amplitude pista_charlie_drops --tyre Tyre1 --pressure 5.5 --csv amplitude.csv"),
)
@takes_model
@speeds_option(".", "1:60:1")
@max_speed_option(60.0)
@click.option("--friction", type=FINITE, default=0.8, show_default=True, help="Peak side force over load, D.")
@click.option("--shape-factor", type=FINITE, default=1.3, show_default=True, help="C of the Magic Formula.")
@click.option("--curvature-factor", type=FINITE, default=0.0, show_default=True, help="E of the Magic Formula.")
@click.option("--kick", type=click.Choice(list(UNITS)), help="Also the least kick that starts another motion.")
@click.option(
    "--damper",
    type=Number(0, 100, above=True, unit="N m s/rad"),
    help="N m s/rad; default: the least that ends wobble.",
)
@click.option("--point", metavar="X,Z", help="Of the acceleration, m, z down; by default 0.8 m up on the steer axis.")
@click.option("--plot", "plot_file", metavar="FILE", help="Draw amplitude and frequency: .png, .svg or .pdf.")
@click.option("--film", type=PATH, help="Film the largest motion that lasts: .gif or .mp4.")
@click.option("--csv", "csv_file", metavar="FILE", help="Write a row per speed and mode as CSV; - is standard output.")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
def command(
    chosen: ChosenModel,
    speeds: str,
    max_speed: float,
    friction: float,
    shape_factor: float,
    curvature_factor: float,
    kick: str | None,
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
    from studies.reporting.output import check_targets, parse_speeds, print_table, print_warnings, write_csv, write_json
    from studies.reporting.plotting import check_picture

    if plot_file is not None:
        check_picture(plot_file)
    if film is not None:
        check_film(film)
    check_targets(csv=csv_file, json=json_file)
    asked = parse_speeds(speeds, 10_000)
    place, model = _point(point), chosen.model
    curves = {} if any(map(stated, ("friction", "shape_factor", "curvature_factor"))) else curves_of(chosen.content)
    tyre = MagicTyre(friction, shape_factor, curvature_factor)
    tyres: dict[str, Any] = {"rear": tyre, "front": tyre} | curves
    found, peak = find_limit_cycles(model, max_speed=max_speed, **tyres), None if curves else friction
    frame = found.frame(asked[asked > 0], place)
    kicks = kick_thresholds(found, asked[asked > 0], kick) if kick is not None else []
    if film is not None:
        film_cycle(found, frame["speed_m_s"].unique().tolist(), film)
    told = "-" not in (csv_file, json_file)
    both = sides(found, damper, tyres, max_speed) if told or json_file is not None else []
    if csv_file is not None:
        write_csv(frame[list(CSV)], csv_file)
    if plot_file is not None:
        draw_amplitude(found, plot_file, title=model.bicycle.name, peak_factor=peak)
    if json_file is not None:
        write_json(record(found, frame, kicks, UNITS.get(str(kick), ""), both), json_file)
    if told:
        if len(frame):
            heads = ["speed m/s", "mode", "stable", "bar °", "frequency Hz", "acceleration m/s2", "lean °"]
            print_table(frame.iloc[:, :7].astype(object).to_numpy().tolist(), heads)
            click.echo()
        if kicks:
            unit = UNITS[str(kick)]
            rows = [[f"{one.speed:g}", *one[1:6], "yes" if one.within_geometry else "no"] for one in kicks]
            print_table(
                rows,
                [
                    "speed m/s",
                    "mode",
                    f"estimate {unit}",
                    f"least {unit}",
                    "what follows",
                    f"falls from {unit}",
                    "linear geometry",
                ],
            )
            click.echo()
        without = kick is not None and not kicks
        told_of: dict[str, Any] = {"peak_factor": peak, "without_kick": without, "sides": both, "max_speed": max_speed}
        click.echo("\n".join(lines(found, frame, **told_of)))
        print_warnings(model.linear_model().warnings)


def _point(text: str | None) -> tuple[float, float] | None:
    from tyre.ground.errors import InputError
    from tyre.ground.number_with_unit import typed_numbers

    if text is None:
        return None
    place = typed_numbers(text.split(","), "m", alike=False)
    if len(place) != 2 or max(map(abs, place)) > 10:
        raise InputError(f"--point {text}: give X,Z in m, up to 10, z down, such as 0.9,-0.8")
    return place[0], place[1]
