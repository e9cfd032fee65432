"""``velotyre simulate``: time histories of a model at one speed, linear and with Magic Formula tyres, as recorded."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from studies.model_space.channel_options import chosen_map, takes_channels
from studies.model_space.command_options import DURATION, FINITE, FOLDER, PATH, SEED, speed_option, stated
from studies.model_space.model_argument import ChosenModel, takes_model
from studies.reporting.command_context import example

if TYPE_CHECKING:
    from bicycle.motion.responses import FrequencyResponse, Response
    from studies.motion.synthetic_sensors import Sensors
    from tyre.ground.arrays import Array

RECORDING = "recording.csv"
UNRECORDED = "{}: the input {} is not recorded; readers of the file must know of it"
TYRE = ("peak_factor", "shape_factor", "curvature_factor")  # options of the Magic Formula
NOTHING_MOVES = "nothing moves the bicycle; give --initial or --input, such as --initial lean=0.02"


@click.command(
    help="Simulate MODEL from initial states and inputs. The time history is written as CSV and figures.",
    epilog=example("velotyre simulate benchmark --speed 5 --initial lean=0.02 --out history"),
)
@takes_model
@speed_option()
@click.option("--duration", type=DURATION, default=5.0, show_default=True, help="Length of the time history, s.")
@click.option("--step", type=DURATION, default=0.005, show_default=True, help="Time between samples, s.")
@click.option("--initial", default="", help="Initial states, SI: lean=0.02,steer_rate=0.1.")
@click.option(
    "--input",
    "inputs",
    multiple=True,
    metavar="SPEC",
    help="Input, SI: steer_torque:step:0.5@1, lateral_push:pulse:50@1+0.2, rear_slip:doublet:0.02@1+0.5, "
    "steer_torque:file:T.csv (linear between samples), steer_torque:steps:T.csv (constant between samples); with "
    "aerodynamic_drag side_wind:step:3@1 (m/s).",
)
@takes_channels
@click.option("--frequency-response", metavar="INPUT", help="Also write gain and phase from this input, 0.05 to 20 Hz.")
@click.option("--nonlinear", is_flag=True, help="Also simulate with Magic Formula tyres, limited by the wheel loads.")
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
    "--offset",
    type=FINITE,
    default=0.0,
    show_default=True,
    help="Vertical shift Sv: lateral force over load without slip.",
)
@click.option(
    "--sensors",
    "sensors_file",
    metavar="FILE.toml",
    type=PATH,
    help="Also write recording.csv with the channels, sample rate and sensor errors of this file.",
)
@click.option("--noise", is_flag=True, help="With --sensors: add their random noise.")
@click.option(
    "--seed",
    type=SEED,
    help="With --noise: seed of the noise, written into the recording; give each repeat its own.",
)
@click.option("--out", type=FOLDER, required=True, help="Folder for the results.")
def command(
    chosen: ChosenModel,
    speed: float,
    duration: float,
    step: float,
    initial: str,
    inputs: tuple[str, ...],
    channels_file: Path | None,
    channel_texts: tuple[str, ...],
    frequency_response: str | None,
    *,
    nonlinear: bool,
    peak_factor: float,
    shape_factor: float,
    curvature_factor: float,
    offset: float,
    sensors_file: Path | None,
    noise: bool,
    seed: int | None,
    out: Path,
) -> None:
    import math
    import secrets

    import numpy as np

    from bicycle.model.wheel_tyres import wheel_curves
    from bicycle.motion.nonlinear import CurveTyre, MagicTyre, magic_formula_model
    from bicycle.motion.responses import frequency_response as compute_frequency_response
    from bicycle.motion.responses import respond
    from studies.motion.simulation import check_within, parse_initial, parse_inputs
    from studies.motion.synthetic_sensors import write_recording
    from studies.reporting.manifest import results
    from studies.reporting.output import print_warnings
    from tyre.ground.errors import InputError

    # Read the options.
    for name, value in (("duration", duration), ("step", step)):
        if value <= 0:
            raise InputError(f"{name} = {value:g} s must be positive")
    sensors, step = _read_sensors(sensors_file, step, noise=noise, seed=seed)
    _check_options(duration, step, nonlinear=nonlinear)
    model = chosen.model
    linear = model.linear_model()
    time = np.arange(math.floor(duration / step * (1 + 1e-12)) + 1) * step
    input_units = {name: linear.declared.units[name] for name in linear.inputs}
    channel_map = chosen_map(channels_file, channel_texts)
    start = parse_initial(initial, linear.declared.units)
    histories = parse_inputs(inputs, allowed=input_units, channel_map=channel_map)
    check_within(histories, float(time[-1]))
    if not (start or histories or frequency_response or (nonlinear and offset)):
        raise InputError(NOTHING_MOVES)

    # Compute: the linear response, the one on saturating tyres, gains, and what sensors would record.
    responses = {}
    if start or histories or offset:
        responses["linear"] = respond(linear, speed=speed, time=time, initial=start, inputs=histories)
    curves = {}
    if nonlinear:
        if not any(map(stated, TYRE)):
            curves = wheel_curves(chosen.content.get("effects", {}))
        tyres = {wheel: CurveTyre(*curve, offset) for wheel, curve in curves.items()}
        tyre = MagicTyre(peak_factor, shape_factor, curvature_factor, offset)
        system = magic_formula_model(model, speed=speed, rear=tyres.get("rear", tyre), front=tyres.get("front", tyre))
        responses["Magic Formula"] = system.simulate(time=time, initial=start, inputs=histories)
    spectrum = None
    if frequency_response:
        frequencies = np.geomspace(0.05, 20.0, 400)
        spectrum = compute_frequency_response(linear, speed=speed, input=frequency_response, frequency_hz=frequencies)
    title = f"{model.bicycle.name} at {speed:g} m/s"
    columns = None
    if sensors is not None:
        description = f"{model.bicycle.name} {list(responses)[-1] if responses else ''} at {speed:g} m/s"
        description += f" with {sensors_file}"
        if noise:
            seed = secrets.randbelow(2**32 - 1) if seed is None else seed  # one that nobody has had
            description += f" and noise seed {seed}"
        else:
            seed = None
            description += " and no noise"
        columns, unrecorded = _record(responses, sensors, seed)

    # Show.
    with results(out):
        written, notes = _write_responses(responses, out, title=title)
        if columns is not None:
            written.append(RECORDING)
            write_recording(out / RECORDING, columns, description)
            notes += [UNRECORDED.format(RECORDING, name) for name in unrecorded]
        if spectrum is not None:
            written += _write_spectrum(spectrum, out, title=title)
            if linear.eigenvalues(speed).real.max() > 0:
                notes.append("unstable at this speed: the frequency response only shows if something holds the bicycle")
    labels = dict.fromkeys(source.label for source, _ in curves.values())
    notes += [f"{label}: lateral force and moment follow its curves, without its shifts" for label in labels]
    print_warnings([*linear.warnings, *notes])
    click.echo(f"{out}: {', '.join(sorted(written))}")


def _check_options(duration: float, step: float, *, nonlinear: bool) -> None:
    """Refuse more than a million samples, a step (s) beyond the duration (s), and tyre options without their tyre."""
    from tyre.ground.errors import InputError

    if step > duration:
        raise InputError(f"step = {step:g} s is longer than duration = {duration:g} s; take a smaller step")
    for name in (*TYRE, "offset"):
        if not nonlinear and stated(name):
            option = "--" + name.replace("_", "-")
            raise InputError(f"{option} is an option of the Magic Formula tyre; add --nonlinear or omit {option}")
    if duration / step > 1e6:
        raise InputError(f"{duration / step:.0f} samples are more than a million; take a larger step")


def _read_sensors(file: Path | None, step: float, *, noise: bool, seed: int | None) -> tuple["Sensors | None", float]:
    """Read the sensors of a file, None without one; also return the step of simulation (s) that their rate needs."""
    from studies.motion.synthetic_sensors import fine_step, read_sensors
    from tyre.ground.errors import InputError

    if seed is not None and not noise:
        raise InputError(f"--seed {seed} is of the noise; add --noise or leave --seed out")
    if file is None:
        if noise:
            raise InputError("--noise is of sensors; add --sensors FILE.toml (velotyre new FILE.toml --kind sensors)")
        return None, step
    sensors = read_sensors(file)
    if not stated("step"):
        return sensors, fine_step(sensors, step)
    if step > 1 / sensors.rate_hz * (1 + 1e-9):
        raise InputError(
            f"step = {step:g} s is longer than the {1 / sensors.rate_hz:g} s between samples of {file}; take a smaller "
            "step, or leave --step out"
        )
    return sensors, step


def _record(
    responses: Mapping[str, "Response"], sensors: "Sensors", seed: int | None
) -> tuple["dict[str, Array]", list[str]]:
    """Record the last response: its columns, with noise if there is a seed, and the inputs that no column holds."""
    from bicycle.identification.recording import INPUTS
    from studies.motion.synthetic_sensors import record_motion
    from tyre.ground.errors import InputError

    if not responses:
        raise InputError(f"--sensors: {NOTHING_MOVES}")
    response = list(responses.values())[-1].until_fall()
    columns_of_inputs = {name: column for column, name in INPUTS.items()}
    unrecorded = [name for name in response.inputs if columns_of_inputs.get(name) not in sensors.channels]
    return record_motion(response, sensors, seed), unrecorded


def _write_responses(responses: Mapping[str, "Response"], folder: Path, *, title: str) -> tuple[list[str], list[str]]:
    """Write each response until it falls as CSV, and a figure of all; return the names of the files, and notes."""
    from studies.motion.simulation import draw_responses
    from studies.reporting.output import write_csv

    written, notes = list[str](), list[str]()
    for label, response in responses.items():
        upright = response.until_fall()
        name = f"response_{label.lower().replace(' ', '_')}.csv"
        write_csv(upright.frame(), folder / name)
        written.append(name)
        notes += [f"{label}: {text}" for text in upright.warnings]
        if upright.fall is not None:
            notes.append(f"{name} ends with the fall at {upright.time[-1]:.2f} s: what follows means nothing")
    if responses:
        draw_responses(responses, folder / "response", title=title)
        written += ["response.png", "response.svg"]
    return written, notes


def _write_spectrum(spectrum: "FrequencyResponse", folder: Path, *, title: str) -> list[str]:
    """Write a frequency response as CSV and figure; return the names of the files."""
    from studies.motion.simulation import draw_frequency_response
    from studies.reporting.output import write_csv

    write_csv(spectrum.frame(), folder / "frequency_response.csv")
    title = f"{title}: {spectrum.input.replace('_', ' ')}"
    draw_frequency_response(spectrum, folder / "frequency_response", title=title)
    return [f"frequency_response.{ending}" for ending in ("csv", "png", "svg")]
