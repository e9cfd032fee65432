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
    from bicycle.motion.responses import Response
    from studies.motion.synthetic_sensors import Sensors
    from tyre.ground.arrays import Array

RECORDING = "recording.csv"
HIDDEN = "{}: {} pushes the bicycle and is not recorded: whoever reads the file takes the motion for one without it"
TYRE = ("friction", "shape_factor", "curvature_factor")  # options of the Magic Formula


@click.command(
    help="Time history of MODEL from initial states and inputs: CSV and figures.",
    epilog=example("velotyre simulate benchmark --speed 5 --initial lean=0.02 --out history"),
)
@takes_model
@speed_option()
@click.option("--duration", type=DURATION, default=5.0, show_default=True, help="s.")
@click.option("--step", "sample", type=DURATION, default=0.005, show_default=True, help="Time between samples, s.")
@click.option("--initial", default="", help="States at the start, SI: lean=0.02,steer_rate=0.1")
@click.option(
    "--input",
    "inputs",
    multiple=True,
    metavar="SPEC",
    help="steer_torque:step:0.5@1, lateral_force:pulse:50@1+0.2, rear_slip:doublet:0.02@1+0.5, steer_torque:file:T.csv "
    "(samples, joined by straight lines), steer_torque:steps:T.csv (each value holds to the next); with "
    "aerodynamic_drag side_wind:step:3@1 (m/s).",
)
@takes_channels
@click.option("--frequency-response", metavar="INPUT", help="Also gain and phase from this input, 0.05 to 20 Hz.")
@click.option("--nonlinear", is_flag=True, help="Also with Magic Formula tyres, limited by the wheel loads.")
@click.option("--friction", type=FINITE, default=0.8, show_default=True, help="Peak side force over load, D.")
@click.option("--shape-factor", type=FINITE, default=1.3, show_default=True, help="C of the Magic Formula.")
@click.option("--curvature-factor", type=FINITE, default=0.0, show_default=True, help="E of the Magic Formula.")
@click.option("--offset", type=FINITE, default=0.0, show_default=True, help="Side force over load without slip, Sv.")
@click.option(
    "--sensors",
    "sensors_file",
    metavar="FILE.toml",
    type=PATH,
    help="Also write recording.csv: the channels, sample rate and sensor errors of this file.",
)
@click.option("--noise", is_flag=True, help="With --sensors: with their random noise.")
@click.option(
    "--seed",
    type=SEED,
    help="With --noise: of the noise, to have the same again; it is written into the recording. Repeats need others.",
)
@click.option("--out", type=FOLDER, required=True, help="Folder for the results.")
def command(
    chosen: ChosenModel,
    speed: float,
    duration: float,
    sample: float,
    initial: str,
    inputs: tuple[str, ...],
    channels_file: Path | None,
    channel_texts: tuple[str, ...],
    frequency_response: str | None,
    *,
    nonlinear: bool,
    friction: float,
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
    from bicycle.motion.responses import frequency_response as gains
    from bicycle.motion.responses import respond
    from studies.motion.simulation import (
        check_within,
        draw_frequency_response,
        draw_responses,
        parse_initial,
        parse_inputs,
    )
    from studies.motion.synthetic_sensors import write_recording
    from studies.reporting.manifest import results
    from studies.reporting.output import print_warnings, write_csv
    from tyre.ground.errors import InputError

    for name, value in (("duration", duration), ("step", sample)):
        if value <= 0:
            raise InputError(f"{name} = {value:g} s must be positive")
    sensors, sample = _sensors(sensors_file, sample, noise=noise, seed=seed)
    if sample > duration:
        raise InputError(f"step = {sample:g} s is longer than duration = {duration:g} s; take a smaller step")
    for name in (*TYRE, "offset"):
        if not nonlinear and stated(name):
            option = "--" + name.replace("_", "-")
            raise InputError(f"{option} is of the Magic Formula tyre; add --nonlinear or leave {option} out")
    if duration / sample > 1e6:
        raise InputError(f"{duration / sample:.0f} samples are more than a million; take a larger step")
    model = chosen.model
    linear = model.linear_model()
    time = np.arange(math.floor(duration / sample * (1 + 1e-12)) + 1) * sample
    taken = {name: linear.declared.units[name] for name in linear.inputs}
    channel_map = chosen_map(channels_file, channel_texts)
    start = parse_initial(initial, linear.declared.units)
    histories = parse_inputs(inputs, allowed=taken, channel_map=channel_map)
    check_within(histories, float(time[-1]))
    if not (start or histories or frequency_response or (nonlinear and offset)):
        raise InputError("nothing moves the bicycle; give --initial or --input, such as --initial lean=0.02")

    responses = {}
    if start or histories or offset:
        responses["linear"] = respond(linear, speed=speed, time=time, initial=start, inputs=histories)
    if nonlinear:
        curves = {} if any(map(stated, TYRE)) else wheel_curves(chosen.content.get("effects", {}))
        tyres = {wheel: CurveTyre(*curve, offset) for wheel, curve in curves.items()}
        tyre = MagicTyre(friction, shape_factor, curvature_factor, offset)
        system = magic_formula_model(model, speed=speed, rear=tyres.get("rear", tyre), front=tyres.get("front", tyre))
        responses["Magic Formula"] = system.simulate(time=time, initial=start, inputs=histories)
    spectrum = None
    if frequency_response:
        frequencies = np.geomspace(0.05, 20.0, 400)
        spectrum = gains(linear, speed=speed, input=frequency_response, frequency_hz=frequencies)

    title, written, notes = f"{model.bicycle.name} at {speed:g} m/s", [], []
    columns = None
    if sensors is not None:
        words = f"{model.bicycle.name} {list(responses)[-1] if responses else ''} at {speed:g} m/s with {sensors_file}"
        seed = (secrets.randbelow(2**32 - 1) if seed is None else seed) if noise else None  # one that nobody has had
        words += f" and noise seed {seed}" if noise else " and no noise"
        columns, hidden = _recording(responses, sensors, seed)
    with results(out):
        for label, response in responses.items():
            upright, name = response.until_fall(), f"response_{label.lower().replace(' ', '_')}.csv"
            write_csv(upright.frame(), out / name)
            written.append(name)
            notes += [f"{label}: {text}" for text in upright.warnings]
            if upright.fall is not None:
                notes.append(f"{name} ends with the fall at {upright.time[-1]:.2f} s: what follows means nothing")
        if columns is not None:
            written.append(RECORDING)
            write_recording(out / RECORDING, columns, words)
            notes += [HIDDEN.format(RECORDING, name) for name in hidden]
        if responses:
            draw_responses(responses, out / "response", title=title)
            written += ["response.png", "response.svg"]
        if spectrum is not None:
            write_csv(spectrum.frame(), out / "frequency_response.csv")
            title = f"{title}: {spectrum.input.replace('_', ' ')}"
            draw_frequency_response(spectrum, out / "frequency_response", title=title)
            written += [f"frequency_response.{ending}" for ending in ("csv", "png", "svg")]
            if linear.eigenvalues(speed).real.max() > 0:
                notes.append("unstable at this speed: the frequency response only shows if something holds the bicycle")
    if nonlinear:
        labels = dict.fromkeys(source.label for source, _ in curves.values())
        notes += [f"{label}: side force and moment follow its curves, without its shifts" for label in labels]
    print_warnings([*linear.warnings, *notes])
    click.echo(f"{out}: {', '.join(sorted(written))}")


def _sensors(file: Path | None, step: float, *, noise: bool, seed: int | None) -> tuple["Sensors | None", float]:
    """The sensors of a file, and a time between samples (s) that goes with them."""
    from studies.motion.synthetic_sensors import fine_step, read_sensors
    from tyre.ground.errors import InputError

    if seed is not None and not noise:
        raise InputError(f"--seed {seed} is of the noise; add --noise or leave --seed out")
    if file is None:
        if noise:
            raise InputError("--noise is of sensors; add --sensors FILE.toml (velotyre new FILE.toml --kind sensors)")
        return None, step
    sensors, given = read_sensors(file), stated("sample")
    if given and step > 1 / sensors.rate_hz * (1 + 1e-9):
        raise InputError(
            f"step = {step:g} s is longer than the {1 / sensors.rate_hz:g} s between samples of {file}; take a smaller "
            "step, or leave --step out"
        )
    return sensors, step if given else fine_step(sensors, step)


def _recording(
    responses: Mapping[str, "Response"], sensors: "Sensors", seed: int | None
) -> tuple["dict[str, Array]", list[str]]:
    """Columns of the recording of the last response, and what pushes the bicycle and is not among them."""
    from bicycle.identification.recording import INPUTS
    from studies.motion.synthetic_sensors import recorded
    from tyre.ground.errors import InputError

    if not responses:
        raise InputError("--sensors: nothing moves the bicycle; give --initial or --input, such as --initial lean=0.02")
    response = list(responses.values())[-1].until_fall()
    names = {name: column for column, name in INPUTS.items()}
    hidden = [name for name in response.inputs if names.get(name) not in sensors.channels]
    return recorded(response, sensors, seed), hidden
