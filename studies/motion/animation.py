"""Films of a moving bicycle: its bodies as lines, and the motion of a mode."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bicycle.equations.lateral import ModelBuilder
from bicycle.model.eigen import damping_ratio, frequency_hz
from bicycle.model.model import Model
from bicycle.model.state_space import LinearModel
from bicycle.motion.responses import Response, modal_response
from bicycle.parameters.rigid_bodies import Body, Joint
from studies.reporting.plotting import STYLE, look, plain_text
from tyre.ground.arrays import Array
from tyre.ground.door import library
from tyre.ground.errors import InputError
from tyre.ground.files import replacing

sp = library("sympy")


def describe(root: complex) -> str:
    """Frequency and damping ratio of a pair, time constant of a real ``root`` (1/s)."""
    if root.imag:
        return f"{abs(frequency_hz(root)):.2f} Hz, damping ratio {damping_ratio(root):.3f}"
    if root.real == 0:
        return "neutral"
    return f"{'grows' if root.real > 0 else 'decays'} by e in {1 / abs(root.real):.2g} s"


def modal_motion(model: LinearModel, *, speed: float, eigenvalue: complex, amplitude: float, frames: int) -> Response:
    """One period of a pair, without growth so that a film can repeat it, or one time constant of a real root."""
    if eigenvalue.imag:
        time = np.arange(frames) / frames / abs(frequency_hz(eigenvalue))
        envelope = amplitude * np.exp(-eigenvalue.real * time)
    else:
        time = np.arange(frames) / frames / max(abs(eigenvalue.real), 1e-3)  # 1/s: slower ones are shown as that slow
        envelope = np.full(frames, amplitude * (np.exp(-1.0) if eigenvalue.real > 0 else 1.0))
    motion = modal_response(model, speed=speed, eigenvalue=eigenvalue, time=time)
    outputs = {name: values * envelope for name, values in motion.outputs.items()}
    return Response(time, motion.speed, outputs, units=motion.units)


@dataclass(frozen=True)
class Part:
    """A polyline (k, 3) in m, axes x forward, y right, z down, fixed to a body; ``wheel_radius`` of parts that roll."""

    body: str  # name of the body it moves with
    points: Array  # (k, 3), m
    wheel_radius: float = 0.0  # m; 0: does not roll


@dataclass(frozen=True)
class BicycleDrawing:
    """Parts in the upright position and the hinges, from the ground outward, that move them."""

    parts: tuple[Part, ...]  # in the upright position
    joints: tuple[Joint, ...]  # from the ground outward

    def pose(self, coordinates: Mapping[str, float], *, rolled: float = 0.0) -> list[Array]:
        """Points (k, 3) of every part in a posture, m."""
        posed = []
        for part in self.parts:
            points = part.points
            if part.wheel_radius:
                hub = points.mean(axis=0)
                points = hub + Rotation.from_rotvec([0.0, -rolled / part.wheel_radius, 0.0]).apply(points - hub)
            for joint in reversed(self.joints):
                if part.body in joint.carries:
                    foot = np.array([joint.x, 0.0, joint.z])
                    turn = coordinates[joint.name] * np.array([joint.axis_x, 0.0, joint.axis_z])
                    points = foot + Rotation.from_rotvec(turn).apply(points - foot)
            turned = Rotation.from_rotvec([0.0, 0.0, coordinates["yaw"]]).apply(points)
            posed.append(turned + np.array([0.0, coordinates["rear_lateral_displacement"], 0.0]))
        return posed


def bicycle_drawing(model: Model) -> BicycleDrawing:
    """Draw the bodies of a model: wheels, rear frame, front frame, and a stick for every further body on a joint."""
    bodies, joints = _numbers(model)
    p = model.bicycle.values
    top, tilt = -2 * max(p["rF"], p["rR"]), np.sin(p["lam"]) / np.cos(p["lam"])
    crown, head = ((p["w"] + p["c"] + tilt * z, z) for z in (-2 * p["rF"] - 0.03, min(top - 0.22, -2 * p["rF"] - 0.12)))
    rear_hub, front_hub = (0.0, -p["rR"]), (p["w"], -p["rF"])
    bottom, saddle = (0.42 * p["w"], -0.85 * p["rR"]), (0.22 * p["w"], top - 0.30)
    seat, stem = (0.25 * p["w"], saddle[1] + 0.22), (head[0] + 0.08, head[1])
    frame = [
        [rear_hub, bottom, seat, rear_hub],
        [seat, crown, bottom],
        [seat, saddle],
        [(saddle[0] - 0.12, saddle[1]), (saddle[0] + 0.14, saddle[1])],
    ]
    parts = [Part("rear frame", _flat(line)) for line in frame]
    parts += [Part("front frame", _flat(line)) for line in ([front_hub, crown, head], [head, stem, head])]
    parts.append(Part("front frame", np.array([[stem[0], y, stem[1]] for y in (-0.22, 0.0, 0.22)])))
    for name, hub, radius in (("rear wheel", rear_hub, p["rR"]), ("front wheel", front_hub, p["rF"])):
        parts.append(Part(name, _circle(hub, radius), radius))
        for angle in np.pi * np.arange(3) / 3:  # spokes
            reach = 0.94 * radius * np.array([np.cos(angle), np.sin(angle)])
            parts.append(Part(name, _flat([tuple(hub - reach), tuple(hub + reach)]), radius))
    drawn = {part.body for part in parts}
    of_effects = [joint for joint in joints if joint.name not in ("lean", "steer")]
    for body in bodies:
        carriers = [joint for joint in of_effects if body.name in joint.carries and body.name not in drawn]
        if carriers:
            hinge = carriers[-1]  # the one next to the body: joints stand from the ground outward
            parts.append(Part(body.name, _flat([(body.x, hinge.z), (body.x, body.z)])))
            parts.append(Part(body.name, _circle((body.x, body.z - 0.12), 0.12)))
    return BicycleDrawing(tuple(parts), joints)


def _numbers(model: Model) -> tuple[tuple[Body, ...], tuple[Joint, ...]]:
    """Bodies and joints of the model with its parameter values."""
    builder = ModelBuilder()
    for effect in model.effects:
        type(effect).symbolic().apply(builder)
    values = {sp.Symbol(key, real=True): number for key, number in model.parameters.items()}

    def number(expression: object) -> float:
        return float(sp.sympify(expression).subs(values))

    joints = tuple(
        Joint(j.name, number(j.axis_x), number(j.axis_z), number(j.x), number(j.z), j.carries) for j in builder.joints()
    )
    bodies = tuple(Body(b.name, *(number(e) for e in (b.mass, b.x, b.z, b.Ixx, b.Izz))) for b in builder.bodies)
    return bodies, joints


def _flat(points: list[tuple[float, float]]) -> Array:
    return np.array([[x, 0.0, z] for x, z in points])


def _circle(centre: tuple[float, float], radius: float) -> Array:
    angle = np.linspace(0, 2 * np.pi, 61)
    return _flat([(centre[0] + radius * np.cos(a), centre[1] + radius * np.sin(a)) for a in angle])


FRAMES_PER_SECOND = 20


def check_film(target: Path) -> None:
    """Refuse a ``target`` that is no GIF, before any work is done."""
    if target.suffix.lower() != ".gif":
        raise InputError(f"{target}: the ending {target.suffix!r} is not known; a film is a .gif")


def animate(model: Model, motion: Response, target: Path, *, title: str) -> None:
    """Film ``motion``, one frame per sample, as ``target`` (.gif)."""
    from matplotlib.animation import PillowWriter

    check_film(target)
    writer = PillowWriter(fps=FRAMES_PER_SECOND)
    with (
        film(model, bicycle_drawing(model), motion, title) as (canvas, show),
        replacing(target) as part,
        writer.saving(canvas, str(part), canvas.dpi),
    ):
        for k in range(len(motion.time)):
            show(k)
            writer.grab_frame()


@contextmanager
def film(model: Model, drawn: BicycleDrawing, motion: Response, title: str) -> Iterator[tuple[Any, Any]]:
    """Give the figure, with its ``title``, and a function that poses it at a sample."""
    import matplotlib
    from matplotlib.figure import Figure

    colours = {"rear frame": look(0).colour, "front frame": look(2).colour}
    colours |= {"rear wheel": "0.25", "front wheel": "0.25"}
    quiet: dict[Any, Any] = {**STYLE, "axes.grid": False}
    with matplotlib.rc_context(quiet):
        canvas = Figure(figsize=(8.8, 6.4), dpi=80)
        layout = canvas.add_gridspec(
            2,
            2,
            width_ratios=(1.75, 1),
            height_ratios=(1.3, 1),
            left=0.085,
            right=0.98,
            top=0.87,
            bottom=0.08,
            wspace=0.14,
            hspace=0.26,
        )
        side, rear = canvas.add_subplot(layout[0, 0]), canvas.add_subplot(layout[0, 1])
        top = canvas.add_subplot(layout[1, :])
        _frame_views(model, motion, drawn, side, rear, top)
        views = []
        for axes, across, up in ((side, 0, 2), (rear, 1, 2), (top, 0, 1)):
            for part in drawn.parts:
                width = 1.0 if len(part.points) == 2 else 2.2
                line = axes.plot([], [], color=colours.get(part.body, look(4).colour), linewidth=width)[0]
                views.append((line, across, up))
        tracks = [
            top.plot([], [], color=style.colour, linestyle=style.line, linewidth=1.3, label=label, zorder=1)[0]
            for style, label in ((look(0), "track of the rear wheel"), (look(2), "of the front wheel"))
        ]
        top.legend(loc="upper left", ncols=2)
        canvas.suptitle(title, x=0.02, ha="left")
        clock = canvas.text(0.98, 0.935, "", ha="right", fontsize=9)
        plain_text(canvas)
        p, y = model.bicycle.values, motion.outputs["rear_lateral_displacement"]
        # the front contact moves with yaw and steer (Meijaard et al. 2007)
        front = y + p["w"] * motion.outputs["yaw"] - p["c"] * np.cos(p["lam"]) * motion.outputs["steer"]

        def show(k: int) -> None:
            outputs = {name: float(values[k]) for name, values in motion.outputs.items()}
            posed = drawn.pose(outputs, rolled=motion.speed * float(motion.time[k]))
            for (line, across, up), points in zip(views, posed * 3, strict=True):
                line.set_data(points[:, across], points[:, up])
            behind = motion.speed * (motion.time[k] - motion.time[: k + 1])
            for line, x, track in zip(tracks, (0.0, p["w"]), (y, front), strict=True):
                line.set_data(x - behind, track[: k + 1])
            clock.set_text(f"t = {motion.time[k]:.3f} s")

        yield canvas, show


def _widen_to_one_scale(axes: Any) -> None:
    """Widen the limits across or along, about their middle, until a metre is as long both ways."""
    box = axes.get_window_extent()  # pixels
    x, y = np.array(axes.get_xlim()), np.array(axes.get_ylim())  # m
    metres_per_pixel = max(abs(x[1] - x[0]) / box.width, abs(y[1] - y[0]) / box.height)
    half = 0.5 * metres_per_pixel * np.array([-1.0, 1.0])
    axes.set_xlim(x.mean() + half * box.width * np.sign(x[1] - x[0]))
    axes.set_ylim(y.mean() + half * box.height * np.sign(y[1] - y[0]))


def _frame_views(model: Model, motion: Response, drawn: BicycleDrawing, side: Any, rear: Any, top: Any) -> None:
    """Limits at one scale both ways that hold the bicycle, its motion and some of its track."""
    p, outputs = model.bicycle.values, motion.outputs
    highest = min(float(part.points[:, 2].min()) for part in drawn.parts) - 0.1
    front, behind = p["w"] + p["rF"] + 0.15, -p["rR"] - 0.15
    sway = float(np.abs(outputs["rear_lateral_displacement"]).max() + np.abs(outputs["yaw"]).max() * p["w"])
    reach = max(0.5, sway + 0.3 + 0.8 * float(np.sin(min(np.abs(outputs["lean"]).max(), np.pi / 2))))
    road = max(float(motion.speed * (motion.time[-1] - motion.time[0])), 0.0)
    side.set(xlim=(behind, front), ylim=(0.08, highest), ylabel="z, m", title="Side")
    rear.set(xlim=(-reach, reach), ylim=(0.08, highest), xlabel="y, m", title="Rear")
    top.set(
        xlim=(behind - min(road, 1.5), front),
        ylim=(reach, -reach),
        xlabel="x forward, m",
        ylabel="y right, m",
        title="Top",
    )
    for axes in (side, rear, top):
        _widen_to_one_scale(axes)
    for axes in (side, rear):
        axes.axhline(0.0, color="0.6", linewidth=1.2)
