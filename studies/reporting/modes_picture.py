"""The picture of ``velotyre modes --plot``: the modes' own drawing in the house style, in one file."""

from pathlib import Path
from typing import Any

import numpy as np

from bicycle.linear_model import LinearModel
from bicycle.mode_figure import draw_modes
from bicycle.named_modes import modes
from studies.reporting.plotting import STYLE, settle
from tyre.arrays import Array
from tyre.errors import InputError
from tyre.files import replacing

ENDINGS = (".png", ".svg", ".pdf")
POINTS = 241  # along the speed


def check_picture(target: str) -> None:
    """Refuse a ``target`` that is no picture before anything is computed."""
    if Path(target).suffix.lower() not in ENDINGS:
        raise InputError(f"--plot {target}: the ending must be one of {', '.join(ENDINGS)}")


def draw_picture(model: LinearModel, speeds: Array, target: str, *, title: str) -> None:
    """Draw the modes of a model over the range of ``speeds`` (m/s) into ``target``, finely enough for smooth lines."""
    import matplotlib
    from matplotlib.figure import Figure

    style: Any = dict(STYLE)
    with matplotlib.rc_context(style):
        figure = Figure(figsize=(7.5, 6.5), layout="constrained")
        frequency, _ = draw_modes(modes(model, _finely(speeds)), figure.subplots(2, 1, sharex=True))
        frequency.set_title(title)
        settle(figure)
        try:
            with replacing(target) as part:
                figure.savefig(part)
        except OSError as error:
            raise InputError(f"{target}: cannot write the picture: {error.strerror}") from error


def _finely(speeds: Array) -> Array:
    return np.union1d(speeds, np.linspace(speeds.min(), speeds.max(), POINTS)) if np.ptp(speeds) > 0 else speeds
