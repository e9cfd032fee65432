"""Every figure of the result of a sweep, each as PNG and SVG with its numbers as CSV."""

import contextlib
from pathlib import Path

from studies.model_space.outputs import OUTPUTS
from studies.sweep.critical_speed_figures import draw_critical_speeds
from studies.sweep.figure_files import Drawn
from studies.sweep.parameter_figures import draw_over_parameters
from studies.sweep.specification import SPEED
from studies.sweep.speed_figures import draw_modes, draw_stability
from studies.sweep.stored import CRITICAL, read_result
from studies.sweep.varied import stability
from tyre.ground.errors import InputError
from tyre.ground.files import make_folder

ALONG_SPEED = {"stability": ("eigenvalues", draw_stability), "modes": ("modes", draw_modes)}  # what else has it, figure


def figures_folder(result: str | Path) -> Path:
    """Folder of the figures of a ``result`` if none is given: ``NAME_figures`` next to it."""
    return Path(result).with_name(f"{Path(result).stem}_figures")


def draw_result(result: str | Path, folder: Path | None = None, *, at: float | None = None) -> Drawn:
    """Draw all that a result holds."""
    stored = read_result(result)
    drawn = Drawn(stored, folder or figures_folder(result), {}, {})
    if not stored.reduced and not stored.possible.any():
        raise InputError(f"{stored.path.as_posix()}: all its bicycles are impossible; nothing to draw")
    at_speed = None if at is None or stored.reduced else stability(stored, at)  # refused before anything is drawn
    make_folder(drawn.folder)
    if CRITICAL in stored.sweep.outputs:
        draw_critical_speeds(drawn)
    for family, (source, draw) in ALONG_SPEED.items():
        outputs = sorted(name for name in stored.sweep.outputs if OUTPUTS[name].along == family or name == source)
        if outputs and len(stored.speeds) > 1:
            draw(drawn)
        elif outputs and SPEED in stored.data.dims:
            drawn.lacking.setdefault("along", []).append(outputs)
    if not stored.reduced:
        draw_over_parameters(drawn, at_speed)
    if not drawn.figures:
        with contextlib.suppress(OSError):  # others' files are in it
            drawn.folder.rmdir()
        raise InputError(
            f"{stored.path.as_posix()} holds nothing to draw ({', '.join(stored.sweep.outputs)}; "
            f"{'; '.join(drawn.remarks)}); ask the sweep for critical_speeds, or for max_growth_rate, "
            "damping_ratios or modes at several speeds"
        )
    return drawn
