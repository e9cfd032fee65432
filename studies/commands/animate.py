"""``velotyre animate``: a mode of the bicycle as a film."""

from pathlib import Path

import click

from studies.model_space.command_options import PATH, Number, speed_option
from studies.model_space.model_argument import ChosenModel, takes_model
from studies.reporting.command_context import example


@click.command(
    help="Film one mode of MODEL. Side, rear and top view.",
    epilog=example("velotyre animate benchmark --mode weave --speed 5 --out weave.gif"),
)
@takes_model
@click.option(
    "--mode", required=True, help="Name of the mode, as velotyre modes shows it: weave, wobble, capsize, castering ..."
)
@speed_option()
@click.option("--out", "target", metavar="FILE", type=PATH, required=True, help="File of the film, .gif.")
@click.option(
    "--amplitude", type=Number(0, 45, above=True), default=12.0, show_default=True, help="Largest angle shown, degrees."
)
@click.option("--seconds", type=Number(0.2, 60, unit="s"), default=3.0, show_default=True, help="Length of the film.")
def command(chosen: ChosenModel, mode: str, speed: float, target: Path, amplitude: float, seconds: float) -> None:
    import math

    import numpy as np

    from bicycle.stability.named_modes import modes
    from bicycle.stability.naming import refuse_impossible_mode
    from studies.motion.animation import FRAMES_PER_SECOND, animate, check_film, describe, modal_motion
    from studies.reporting.output import print_warnings
    from tyre.ground.errors import InputError

    check_film(target)
    model = chosen.model
    refuse_impossible_mode(mode, model.effects, where="--mode")
    linear = model.linear_model()
    named_modes = modes(linear, [speed])
    root = complex(named_modes.branch(mode)[0, 0])
    if np.isnan(root):
        present = [name for name in named_modes.names if not np.isnan(named_modes.branch(name)[0, 0])]
        raise InputError(f"there is no {mode} at {speed:g} m/s; there are {', '.join(present)}")
    frames = max(2, round(seconds * FRAMES_PER_SECOND))
    motion = modal_motion(linear, speed=speed, eigenvalue=root, amplitude=math.radians(amplitude), frames=frames)
    duration = float(motion.time[-1] - motion.time[0]) * frames / (frames - 1)
    pace = f"{seconds / duration:.3g} times slower" if duration < seconds else f"{duration / seconds:.3g} times faster"
    title = f"{mode.replace('_', ' ').capitalize()} of {model.bicycle.name} at {speed:g} m/s: {describe(root)}"
    amplitudes = "amplitude held constant" if root.imag else "growth or decay as it is"
    animate(model, motion, target, title=f"{title}\nlargest angle {amplitude:g}°, {amplitudes}, {pace} than real")
    print_warnings(linear.warnings)
    click.echo(f"film: {target}")
