"""A motion of the bicycle as a film: side, rear and top view, in slow motion, with the tracks of both wheels."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.model import Model
from bicycle.responses.linear import Response
from studies.animation.bicycle_drawing import BicycleDrawing, Part, bicycle_drawing
from studies.reporting.plotting import STYLE, look, plain_text
from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.files import replacing

FRAMES_PER_SECOND = 20
DPI = 80
TRACK = 1.5  # m of track behind the rear contact, at most
COLOURS = {"rear frame": look(0).colour, "rear wheel": "0.25", "front frame": look(2).colour, "front wheel": "0.25"}


def check_film(target: Path) -> None:
    """Refuse a ``target`` that cannot be written, before any work is done.

    Raises
    ------
    InputError
        Neither .gif nor .mp4, or .mp4 without ffmpeg.
    """
    if target.suffix.lower() not in (".gif", ".mp4"):
        raise InputError(f"{target}: the ending {target.suffix!r} is not known; write .gif or .mp4")
    if target.suffix.lower() == ".mp4" and shutil.which("ffmpeg") is None:
        raise InputError(f"{target}: MP4 needs the program ffmpeg, which is not installed; write a .gif")


def animate(
    model: Model, motion: Response, target: Path, *, title: str, frames_per_second: int = FRAMES_PER_SECOND
) -> Path:
    """Film ``motion``, one frame per sample, as ``target`` (.gif or .mp4).

    ``motion`` holds lean, steer, yaw, further joints (rad) and rear_lateral_displacement (m), of a size that can be
    seen; the tracks show where the contacts of the moving bicycle were.

    Parameters
    ----------
    model : Model
    motion : Response
    target : Path
    title : str
    frames_per_second : int, optional
        Number of samples of the motion shown in a second.

    Raises
    ------
    InputError
        A file name that does not end in .gif or .mp4, or no ffmpeg for .mp4.
    """
    check_film(target)
    drawn = bicycle_drawing(model)
    with film(model, drawn, motion, title) as (canvas, show), _writer(target, frames_per_second, canvas) as writer:
        for k in range(len(motion.time)):
            show(k)
            writer.grab_frame()
    return target


@contextmanager
def film(model: Model, drawn: BicycleDrawing, motion: Response, title: str) -> Iterator[tuple[Any, Any]]:
    """Give the figure, with its ``title``, and a function that poses it at a sample."""
    import matplotlib
    from matplotlib.figure import Figure

    quiet: dict[Any, Any] = {**STYLE, "axes.grid": False}
    with matplotlib.rc_context(quiet):
        canvas = Figure(figsize=(8.8, 6.4), dpi=DPI)
        layout = canvas.add_gridspec(
            2, 2, width_ratios=(1.75, 1), height_ratios=(1.3, 1), left=0.085, right=0.98, top=0.87, bottom=0.08,
            wspace=0.14, hspace=0.26,
        )  # fmt: skip
        side, rear = canvas.add_subplot(layout[0, 0]), canvas.add_subplot(layout[0, 1])
        top = canvas.add_subplot(layout[1, :])
        views = ((side, 0, 2), (rear, 1, 2), (top, 0, 1))
        _frame_views(model, motion, drawn, side, rear, top)
        lines = [
            [
                axes.plot([], [], color=COLOURS.get(part.body, look(4).colour), linewidth=_width(part))[0]
                for part in drawn.parts
            ]
            for axes, _, _ in views
        ]
        tracks = [
            top.plot([], [], color=style.colour, linestyle=style.line, linewidth=1.3, label=label, zorder=1)[0]
            for style, label in ((look(0), "track of the rear wheel"), (look(2), "of the front wheel"))
        ]
        top.legend(loc="upper left", ncols=2)
        canvas.suptitle(title, x=0.02, ha="left")
        clock = canvas.text(0.98, 0.935, "", ha="right", fontsize=9)
        plain_text(canvas)
        contacts = _contacts(model, motion)

        def show(k: int) -> None:
            here = {name: float(values[k]) for name, values in motion.outputs.items()}
            posed = drawn.pose(here, rolled=motion.speed * float(motion.time[k]))
            for (_, across, up), row in zip(views, lines, strict=True):
                for line, points in zip(row, posed, strict=True):
                    line.set_data(points[:, across], points[:, up])
            for line, (x, y) in zip(tracks, contacts, strict=True):
                behind = x[: k + 1] - motion.speed * (motion.time[k] - motion.time[: k + 1])
                line.set_data(behind, y[: k + 1])
            clock.set_text(f"t = {motion.time[k]:.3f} s")

        yield canvas, show


def _width(part: Part) -> float:
    return 1.0 if len(part.points) == 2 else 2.2


def _frame_views(model: Model, motion: Response, drawn: BicycleDrawing, side: Any, rear: Any, top: Any) -> None:
    p = model.bicycle.values
    highest = min(float(part.points[:, 2].min()) for part in drawn.parts) - 0.1
    ahead, behind = p["w"] + p["rF"] + 0.15, -p["rR"] - 0.15
    outputs = motion.outputs
    sway = float(np.abs(outputs["rear_lateral_displacement"]).max() + np.abs(outputs["yaw"]).max() * p["w"])
    reach = max(0.5, sway + 0.3 + 0.8 * float(np.sin(min(np.abs(outputs["lean"]).max(), np.pi / 2))))
    road = max(float(motion.speed * (motion.time[-1] - motion.time[0])), 0.0)
    upright = (0.08, highest)
    _window(side, (behind, ahead), upright, ylabel="z, m", title="Side")
    _window(rear, (-reach, reach), upright, xlabel="y, m", title="Rear")
    _window(
        top,
        (behind - min(road, TRACK), ahead),
        (reach, -reach),
        xlabel="x forward, m",
        ylabel="y right, m",
        title="Top",
    )
    for axes in (side, rear):
        axes.axhline(0.0, color="0.6", linewidth=1.2)


def _window(axes: Any, horizontal: tuple[float, float], vertical: tuple[float, float], **labels: str) -> None:
    """Limits that hold both ranges at one scale and fill the box: sideways both ways, upwards beyond the top."""
    inches = axes.get_position().size * axes.figure.get_size_inches()
    width, height = horizontal[1] - horizontal[0], vertical[1] - vertical[0]
    scale = max(width / inches[0], abs(height) / inches[1])
    spare = scale * inches[0] - width
    top = vertical[0] + np.sign(height) * scale * inches[1]
    extra = (top - vertical[1]) / 2 if labels["title"] == "Top" else 0.0
    axes.set(
        xlim=(horizontal[0] - spare / 2, horizontal[1] + spare / 2), ylim=(vertical[0] - extra, top - extra), **labels
    )  # fmt: skip


def _contacts(model: Model, motion: Response) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Contacts of both wheels (x, y) at every sample; the front one moves with yaw and steer."""
    y, yaw = motion.outputs["rear_lateral_displacement"], motion.outputs["yaw"]
    p = model.bicycle.values
    shift = -p["c"] * np.cos(p["lam"]) * motion.outputs["steer"]  # of the front contact, per Meijaard et al. (2007)
    return (np.zeros_like(y), y), (p["w"] + np.zeros_like(y), y + p["w"] * yaw + shift)


@contextmanager
def _writer(target: Path, frames_per_second: int, canvas: Any) -> Iterator[Any]:
    from matplotlib.animation import FFMpegWriter, PillowWriter

    kind = PillowWriter if target.suffix.lower() == ".gif" else FFMpegWriter
    writer = kind(fps=frames_per_second)
    with replacing(target) as part, writer.saving(canvas, str(part), DPI):
        yield writer
