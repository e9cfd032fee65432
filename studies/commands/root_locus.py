"""``velotyre root-locus``: eigenvalues of a model as any one of its parameters runs through a range."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from studies.model_space.command_options import FOLDER, POSITIVE, speed_option
from studies.model_space.model_argument import ChosenModel, takes_model
from studies.reporting.command_context import example

if TYPE_CHECKING:
    from studies.motion.locus import ParameterPath, RootLocus
    from tyre.ground.arrays import Array


@click.command(
    help="Draw the root locus of MODEL in one parameter. Figure, CSV, and the values at which a mode becomes "
    "stable or unstable.",
    epilog=example("velotyre root-locus benchmark --parameter IFyy --range 0.1:0.6 --speed 5 --out locus"),
)
@takes_model
@click.option(
    "--parameter",
    required=True,
    metavar="KEY",
    help="Parameter: speed, a bicycle key (IFyy), effect.parameter[.rear|.front], or pressure_bar, load_N of a "
    "measured tyre.",
)
@click.option("--range", "span", required=True, metavar="START:STOP[:STEP]", help="Values of the parameter, SI or bar.")
@speed_option("Forward speed, m/s, unless it is the parameter.", required=False)
@click.option("--out", type=FOLDER, required=True, help="Folder for the results.")
@click.option("--max-frequency", type=POSITIVE, help="Highest frequency shown, Hz.")
@click.option("--json", "json_file", metavar="FILE", help="Write the crossings as JSON; - is standard output.")
def command(
    chosen: ChosenModel,
    parameter: str,
    span: str,
    speed: float | None,
    out: Path,
    max_frequency: float | None,
    json_file: str | None,
) -> None:
    from bicycle.model.eigen import angular_frequency
    from bicycle.parameters.bicycle import canonical
    from studies.model_space.axes import unit_of
    from studies.motion.locus import draw_root_locus, parameter_path, parse_range, root_locus
    from studies.reporting.manifest import results
    from studies.reporting.output import check_targets, print_warnings, write_csv, write_json
    from tyre.ground.errors import InputError

    check_targets(json=json_file)
    if parameter == "speed" and speed is not None:
        raise InputError(f"--speed {speed:g} is given, but the speed is the parameter; leave --speed out")
    values = parse_range(span, unit_of(canonical(parameter)))
    model = chosen.model
    path = parameter_path(chosen.content, parameter, speed=speed)
    locus = root_locus(path, values)
    title = f"{model.bicycle.name}, {parameter} {values[0]:g} to {values[-1]:g} {path.axis.unit}"
    if speed is not None:
        title += f", at {speed:g} m/s"
    with results(out):
        write_csv(locus.frame(), out / "root_locus.csv")
        draw_root_locus(locus, out / "root_locus", title=title, max_frequency_hz=max_frequency)
    if json_file:
        crossings = [
            {
                "value": c.value,
                "mode": c.mode,
                "frequency_Hz": c.frequency_hz,
                "frequency_rad_s": float(angular_frequency(c.frequency_hz)),
                "destabilising": c.destabilising,
                "extrapolated": c.extrapolated,
            }
            for c in locus.crossings
        ]
        record = {"parameter": parameter, "unit": path.axis.unit, "speed_m_s": speed, "crossings": crossings}
        write_json(record | {"unstable_throughout": list(locus.unstable_throughout)}, json_file)
    if json_file != "-":
        _print_crossings(locus, values, path, parameter)
        notes = []
        if not locus.measured.all():
            share = "part" if locus.measured.any() else "all"
            notes.append(f"{share} of the range lies beyond the measured loads or pressures")
        print_warnings([*model.linear_model().warnings, *notes])


def _print_crossings(locus: "RootLocus", values: "Array", path: "ParameterPath", parameter: str) -> None:
    """Print where a mode becomes stable or unstable over ``values`` of a path, and modes unstable at all of them."""
    from bicycle.parameters.front_hinge import front_words
    from studies.reporting.output import print_table

    unit = path.axis.unit
    rows = []
    for crossing in locus.crossings:
        effect = "destabilising" if crossing.destabilising else "stabilising"
        reliability = "extrapolated" if crossing.extrapolated else ""
        words = front_words(path.model_and_speed(crossing.value)[0].parameters).get(parameter)
        value = f"{crossing.value:.6g}"
        if words:
            value += f" ({words})"
        rows.append([value, crossing.mode, crossing.frequency_hz, effect, reliability])
    if rows:
        print_table(rows, [f"{parameter} {unit}", "mode", "frequency Hz", "with increasing value", "tyre values"])
    else:
        click.echo(f"no mode becomes stable or unstable from {values[0]:g} to {values[-1]:g} {unit}")
    always = ", ".join(locus.unstable_throughout).replace("_", " ")
    if always or not rows:
        click.echo(f"unstable over the full range: {always or 'no mode'}")
