"""A racing frame with its fork as a beam model: what every static test of a front frame, and a tap, would read.

Nothing is shared with the package. Tubes are Euler-Bernoulli beams in space (12 x 12 element matrices), the wheel is
rigid on the middle of its axle, the two bearings of the headset tie steerer and head tube, and the steering is locked.

Coordinates: x forward, y to one side, z up, metres; the origin is the foot, the point of the steer axis nearest to the
hub. Heights run up the steer axis from there. The hinge axis is perpendicular to the steer axis, in the plane of the
bicycle. A tilt is positive if what lies below the pivot moves to +y: y(height) = tilt (pivot - height).

``draw_front(rng)`` draws a plausible front, the stiffness of frame and fork scaled to drawn figures. Then

- ``hub_compliance(front)``: a, b, c at the foot, rider holding saddle and bottom bracket:
  y = a F + b M, tilt = b F + c M; ``Compliance`` gives stiffness 1/c and pivot b/c of the couple hinge, the sway
  1 - b^2/(a c), and ``two_joints(length)``, the two hinges with the same a, b, c;
- ``head_tube_figure``, ``fork_figure``, ``ground_figure``: what TOUR and RoadBIKE would publish;
- ``deflections(front, loads, readings, held)``: static readings (m) at places (part, height), part one of ``wheel``,
  ``fork`` (the upper steerer, with stem and handlebar) and ``frame`` (the head tube), or ``saddle`` and
  ``bottom_bracket`` with height 0; ``held`` is RIDER, DROPOUTS, or a ``Stand`` of finite stiffness;
- ``beam_modes(front, p, readings, held)``: frequencies (Hz) and shapes of the front with the masses of a bicycle ``p``
  (keys of Meijaard et al.), its front frame a rigid body on the crown, its wheel one on the axle, and that of the rear
  frame one on the seat tube on a ``Stand``;
- ``two_joint_modes(p, joints)``: the same of the two-joint front in the plane of the hinges, two degrees of freedom:
  the wheel on a fork hinge, the front frame with both on a frame hinge.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Array = NDArray[Any]

RIDER, DROPOUTS, CLAMPED_HEAD = "saddle and bottom bracket", "rear dropouts", "head tube"
RIGID = 1e10  # N/m and N m/rad, of ties and clamps
STEEL = 2.0e11  # Pa, before frame and fork are scaled to their figures
ALUMINIUM = 0.7e11  # Pa, of the seat post, which no published figure holds
STEERER, POST = (0.0286, 0.002), (0.0272, 0.002)  # m, outer diameter and wall
SHEAR = 0.385  # of the modulus
HEAD_TUBE_RANGE = (61.0, 143.0)  # N m/deg, figures of the drawn frames
FORK_RANGE = (29.0, 83.0)  # N/mm, of the drawn forks
WHEEL_RANGE = (0.330, 0.345)  # m, radius of their front wheels


@dataclass(frozen=True)
class Front:
    """A frame and fork: lengths in m, angles in rad, tubes as (outer diameter, wall) in m."""

    head_angle: float  # rad, of the steer axis above the horizontal
    seat_angle: float  # rad, likewise of the seat tube
    head_tube: float  # m, its length
    crown: float  # m, height of the crown race above the foot
    rake: float  # m, hub before the steer axis
    front_centre: float  # m, bottom bracket to hub, horizontally
    drop: float  # m, bottom bracket below the hubs
    chain_stay: float  # m
    seat_tube: float  # m
    seat_post: float  # m, seat tube to saddle
    wheel: float  # m, radius of the front wheel
    tubes: Mapping[str, tuple[float, float]]  # name -> outer diameter and wall, m
    blade_ends: tuple[float, float]  # m, outer diameter at the crown and at the axle
    blade_wall: float  # m
    # N m^2, in bending: 1230 of 28.6 x 2.5 mm aluminium, 1700 of 25.4 x 1.6 mm steel, 2300 of tapered carbon
    steerer: float
    axle: float  # m, diameter of a solid steel axle as stiff as axle and hub: 10 mm bare, more with a hub
    frame_factor: float = 1.0  # on the modulus of the frame
    fork_factor: float = 1.0  # on that of the fork


@dataclass(frozen=True)
class Stand:
    """A workstand that holds the seat tube softly; all other directions are held."""

    roll: float  # N m/rad, about the longitudinal axis
    yaw: float  # N m/rad, about the vertical
    lateral: float  # N/m


Hold = str | Stand
Place = tuple[str, float]  # part and height above the hub, m


@dataclass(frozen=True)
class Compliance:
    """Tilt and lateral displacement of the hub under a lateral force and a couple there."""

    a: float  # m/N
    b: float  # 1/N
    c: float  # rad/(N m)

    @property
    def stiffness(self) -> float:
        """Stiffness of the couple hinge, N m/rad."""
        return 1 / self.c

    @property
    def pivot(self) -> float:
        """Height of the couple hinge above the hub, m."""
        return self.b / self.c

    @property
    def sway(self) -> float:
        """Share of the side compliance that no tilt explains."""
        return 1 - self.b**2 / (self.a * self.c)

    def at_ground(self, radius: float) -> tuple[float, float]:
        """Stiffness (N m/rad) and height (m) of the hinge about which a side force on the rim at ``radius`` tilts."""
        tilt, shift = self.b + radius * self.c, self.a + radius * self.b
        pivot = shift / tilt
        return (pivot + radius) / tilt, pivot

    def two_joints(self, length: float) -> tuple[float, float, float]:
        """Stiffness and height of the frame's hinge, and stiffness of a fork's hinge ``length`` (m) above the hub."""
        fork = (self.a * self.c - self.b**2) / (self.a - 2 * self.b * length + self.c * length**2)
        frame = self.c - fork
        return 1 / frame, (self.b - fork * length) / frame, 1 / fork


def draw_front(rng: np.random.Generator) -> Front:
    """Draw a plausible racing frame and fork."""

    def between(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    walls = between(0.7e-3, 1.5e-3)
    size = between(0.9, 1.35)  # steel tubes are slim, carbon ones wide

    def tube(diameter: float) -> tuple[float, float]:
        return diameter * size * between(0.93, 1.07), walls * between(0.8, 1.25)

    front = Front(
        head_angle=math.radians(between(71.5, 74.0)),
        seat_angle=math.radians(between(72.5, 74.5)),
        head_tube=between(0.10, 0.20),
        crown=between(0.360, 0.385),
        rake=between(0.040, 0.050),
        front_centre=between(0.570, 0.620),
        drop=between(0.065, 0.080),
        chain_stay=between(0.400, 0.425),
        seat_tube=between(0.46, 0.58),
        seat_post=between(0.05, 0.22),
        wheel=between(*WHEEL_RANGE),
        tubes={
            "head": tube(0.036),
            "top": tube(0.028),
            "down": tube(0.034),
            "seat": tube(0.029),
            "chain stay": tube(0.018),
            "seat stay": tube(0.014),
            "crown": (between(0.034, 0.050), between(3e-3, 7e-3)),
        },
        blade_ends=(between(0.022, 0.036), between(0.011, 0.020)),
        blade_wall=between(0.9e-3, 1.6e-3),
        steerer=_log_uniform(rng, (1100.0, 2600.0)),
        axle=_log_uniform(rng, (0.010, 0.020)),
    )
    return scaled(front, _log_uniform(rng, HEAD_TUBE_RANGE), _log_uniform(rng, FORK_RANGE))


def scaled(front: Front, head_tube: float, fork: float) -> Front:
    """Scale the moduli of frame and fork to published figures, N m/deg and N/mm."""

    def missed(log_factor: float) -> float:
        return fork_figure(replace(front, fork_factor=math.exp(log_factor))) - fork

    return replace(
        front,
        frame_factor=front.frame_factor * head_tube / head_tube_figure(front),
        fork_factor=math.exp(brentq(missed, -6.0, 6.0, xtol=1e-6)),
    )


def _log_uniform(rng: np.random.Generator, ends: tuple[float, float]) -> float:
    return float(ends[0] * (ends[1] / ends[0]) ** rng.random())


class Beams:
    """Nodes of six degrees of freedom each (three displacements, three rotations) and the stiffness between them."""

    def __init__(self) -> None:
        self.names: dict[str, int] = {}
        self.places: list[Array] = []
        self.blocks: list[tuple[Array, Array]] = []  # degrees of freedom, stiffness

    def node(self, name: str, place: Array) -> None:
        self.names[name] = len(self.places)
        self.places.append(np.asarray(place, float))

    def freedoms(self, name: str) -> Array:
        return 6 * self.names[name] + np.arange(6)

    def beam(self, one: str, other: str, diameter: float, wall: float, modulus: float) -> None:
        """Join two nodes by a round tube."""
        along = self.places[self.names[other]] - self.places[self.names[one]]
        length = float(np.linalg.norm(along))
        inner = max(diameter - 2 * wall, 0.0)
        area = math.pi / 4 * (diameter**2 - inner**2)
        second = _second_moment(diameter, wall)
        local = _element(length, modulus * area, modulus * second, SHEAR * modulus * 2 * second)
        turn = np.kron(np.eye(4), _triad(along / length))
        freedoms = np.concatenate([self.freedoms(one), self.freedoms(other)])
        self.blocks.append((freedoms, turn.T @ local @ turn))

    def tie(self, one: str, other: str, directions: Array, *, turns: bool = False) -> None:
        """Tie the displacements, or the rotations, of two nodes at one place along ``directions`` (m, 3)."""
        shift = 3 if turns else 0
        freedoms = np.concatenate([self.freedoms(name)[shift : shift + 3] for name in (one, other)])
        rows = np.hstack([directions, -directions])
        self.blocks.append((freedoms, RIGID * rows.T @ rows))

    def hold(self, name: str, stiffness: Sequence[float]) -> None:
        """Hold a node to the ground by springs on its six degrees of freedom."""
        self.blocks.append((self.freedoms(name), np.diag(stiffness)))

    def matrix(self) -> Array:
        size = 6 * len(self.places)
        whole = np.zeros((size, size))
        for freedoms, block in self.blocks:
            whole[np.ix_(freedoms, freedoms)] += block
        return whole


def _second_moment(diameter: float, wall: float) -> float:
    """Second moment of area (m^4) of a round tube."""
    return math.pi / 64 * (diameter**4 - max(diameter - 2 * wall, 0.0) ** 4)


def _element(length: float, axial: float, bending: float, torsion: float) -> Array:
    """Stiffness (12, 12) of a beam along its own first axis: E A, E I and G J."""
    k = np.zeros((12, 12))
    for i, stiffness in ((0, axial / length), (3, torsion / length)):
        k[np.ix_([i, i + 6], [i, i + 6])] = stiffness * np.array([[1, -1], [-1, 1]])
    plane = np.array(
        [
            [12, 6 * length, -12, 6 * length],
            [6 * length, 4 * length**2, -6 * length, 2 * length**2],
            [-12, -6 * length, 12, -6 * length],
            [6 * length, 2 * length**2, -6 * length, 4 * length**2],
        ]
    )
    plane = plane * bending / length**3
    sign = np.diag([1.0, -1.0, 1.0, -1.0])  # a rotation about the second axis moves the end against the third
    k[np.ix_([1, 5, 7, 11], [1, 5, 7, 11])] = plane
    k[np.ix_([2, 4, 8, 10], [2, 4, 8, 10])] = sign @ plane @ sign
    return k


def _triad(along: Array) -> Array:
    """Rows: the axis of a tube and two directions across it."""
    helper = np.eye(3)[int(np.argmin(np.abs(along)))]
    across = np.cross(along, helper)
    across = across / np.linalg.norm(across)
    return np.array([along, across, np.cross(along, across)])


SIDE = np.array([0.0, 1.0, 0.0])
SIDES = {"left": -1.0, "right": 1.0}
LOWER_STACK = 0.012  # m, crown race to head tube
STEM = 0.04  # m, upper bearing to the middle of the stem
BLADES = 6  # elements of a blade


def axes_of(front: Front) -> tuple[Array, Array]:
    """Unit vectors up the steer axis and along the hinge axis, forward."""
    cosine, sine = math.cos(front.head_angle), math.sin(front.head_angle)
    return np.array([-cosine, 0.0, sine]), np.array([sine, 0.0, cosine])


def _heights(front: Front) -> dict[str, float]:
    """Heights (m) of the nodes on the steer axis."""
    bottom = front.crown + LOWER_STACK
    return {
        "bottom": bottom,
        "down joint": bottom + 0.25 * front.head_tube,
        "middle": bottom + 0.5 * front.head_tube,
        "top joint": bottom + 0.8 * front.head_tube,
        "top": bottom + front.head_tube,
    }


def add_frame(beams: Beams, front: Front) -> None:
    """Add the frame with seat post and rear axle."""
    up, forward = axes_of(front)
    modulus, tubes = STEEL * front.frame_factor, front.tubes
    hub = front.rake * forward
    bracket = hub + np.array([-front.front_centre, 0, -front.drop])
    rear = bracket + np.array([-math.sqrt(front.chain_stay**2 - front.drop**2), 0, front.drop])
    seat = np.array([-math.cos(front.seat_angle), 0, math.sin(front.seat_angle)])
    heights = _heights(front)
    for name, height in heights.items():
        beams.node(name, height * up)
    beams.node("bracket", bracket)
    beams.node("seat cluster", bracket + 0.94 * front.seat_tube * seat)
    beams.node("stand", bracket + 0.6 * front.seat_tube * seat)
    beams.node("saddle", bracket + (front.seat_tube + front.seat_post) * seat)
    for one, other in pairwise(heights):
        beams.beam(one, other, *tubes["head"], modulus)
    beams.beam("seat cluster", "top joint", *tubes["top"], modulus)
    beams.beam("bracket", "down joint", *tubes["down"], modulus)
    beams.beam("bracket", "stand", *tubes["seat"], modulus)
    beams.beam("stand", "seat cluster", *tubes["seat"], modulus)
    beams.beam("seat cluster", "saddle", *POST, ALUMINIUM)
    beams.node("rear axle", rear)
    for side, sign in SIDES.items():
        beams.node(f"shell {side}", bracket + sign * 0.034 * SIDE)
        beams.node(f"dropout {side}", rear + sign * 0.065 * SIDE)
        beams.node(f"cluster {side}", beams.places[beams.names["seat cluster"]] + sign * 0.018 * SIDE)
        beams.beam("bracket", f"shell {side}", 0.040, 0.003, modulus)
        beams.beam("seat cluster", f"cluster {side}", 0.030, 0.003, modulus)
        beams.beam(f"shell {side}", f"dropout {side}", *tubes["chain stay"], modulus)
        beams.beam(f"cluster {side}", f"dropout {side}", *tubes["seat stay"], modulus)
        beams.beam("rear axle", f"dropout {side}", 0.015, 0.0075, STEEL)


def add_fork(beams: Beams, front: Front) -> None:
    """Add steerer, crown, blades and the front axle, on whose middle the wheel sits."""
    up, forward = axes_of(front)
    modulus, heights = STEEL * front.fork_factor, _heights(front)
    places = {"crown": front.crown, "lower": heights["bottom"], "upper": heights["top"], "stem": heights["top"] + STEM}
    for name, height in places.items():
        beams.node(name, height * up)
    for one, other in pairwise(places):
        beams.beam(one, other, *STEERER, front.steerer / _second_moment(*STEERER))
    hub = front.rake * forward
    beams.node("hub", hub)
    thick, thin = front.blade_ends
    for side, sign in SIDES.items():
        top = (front.crown - 0.025) * up + sign * 0.034 * SIDE
        end = hub + sign * 0.050 * SIDE
        for k in range(BLADES + 1):
            beams.node(f"blade {side} {k}", top + k / BLADES * (end - top))
        beams.beam("crown", f"blade {side} 0", *front.tubes["crown"], modulus)
        for k in range(BLADES):
            diameter = thick + (k + 0.5) / BLADES * (thin - thick)
            beams.beam(f"blade {side} {k}", f"blade {side} {k + 1}", diameter, front.blade_wall, modulus)
        beams.beam("hub", f"blade {side} {BLADES}", front.axle, front.axle / 2, STEEL)


def tie_headset(beams: Beams, front: Front) -> None:
    """Tie the steerer to the head tube: the lower bearing in all directions, the upper one across; no steering."""
    up, forward = axes_of(front)
    beams.tie("bottom", "lower", np.eye(3))
    beams.tie("top", "upper", np.array([SIDE, forward]))
    beams.tie("top", "upper", up[None], turns=True)


def hold_frame(beams: Beams, held: Hold) -> None:
    """Hold the frame to the ground."""
    clamp = [RIGID] * 6
    if isinstance(held, Stand):
        beams.hold("stand", [RIGID, held.lateral, RIGID, held.roll, RIGID, held.yaw])
        return
    nodes = {
        RIDER: ("saddle", "bracket"),
        DROPOUTS: ("dropout left", "dropout right"),
        CLAMPED_HEAD: ("bottom", "top", "saddle", "bracket"),
    }
    for name in nodes[held]:
        beams.hold(name, clamp)


def whole_bicycle(front: Front, held: Hold) -> Beams:
    """Assemble frame and fork, held to the ground."""
    beams = Beams()
    add_frame(beams, front)
    add_fork(beams, front)
    tie_headset(beams, front)
    hold_frame(beams, held)
    return beams


def _on_node(beams: Beams, name: str, point: Array) -> Array:
    """Work row (n,): lateral displacement of a ``point`` that is rigid with a node."""
    row = np.zeros(6 * len(beams.places))
    arm = point - beams.places[beams.names[name]]
    freedoms = beams.freedoms(name)
    row[freedoms[:3]] = SIDE
    row[freedoms[3:]] = np.cross(arm, SIDE)
    return row


def _row(beams: Beams, front: Front, place: Place) -> Array:
    """Work row (n,) of a lateral reading at a place."""
    part, height = place
    point = height * axes_of(front)[0]
    if part in ("saddle", "bottom_bracket"):
        name = {"bottom_bracket": "bracket"}.get(part, part)
        return _on_node(beams, name, beams.places[beams.names[name]])
    return _on_node(beams, {"wheel": "hub", "fork": "stem", "frame": "middle"}[part], point)


def _tilt_row(beams: Beams, front: Front, name: str) -> Array:
    row = np.zeros(6 * len(beams.places))
    row[beams.freedoms(name)[3:]] = axes_of(front)[1]
    return row


def _compliance_of(beams: Beams, front: Front, name: str) -> Compliance:
    rows = np.array([_on_node(beams, name, np.zeros(3)), _tilt_row(beams, front, name)])
    matrix = rows @ np.linalg.solve(beams.matrix(), rows.T)
    return Compliance(float(matrix[0, 0]), float(matrix[0, 1]), float(matrix[1, 1]))


def hub_compliance(front: Front, held: Hold = RIDER) -> Compliance:
    """Compliance of the hub against the held frame."""
    return _compliance_of(whole_bicycle(front, held), front, "hub")


def fork_compliance(front: Front) -> Compliance:
    """Compliance of the hub with the head tube clamped."""
    return hub_compliance(front, CLAMPED_HEAD)


def _frame_with_bar(front: Front, held: Hold) -> Beams:
    """Assemble the frame with a rigid bar through the head tube, which reaches down to the foot."""
    beams = Beams()
    add_frame(beams, front)
    up, _ = axes_of(front)
    heights = _heights(front)
    for name, height in {"foot": 0.0, "lower": heights["bottom"], "upper": heights["top"]}.items():
        beams.node(name, height * up)
    for one, other in (("foot", "lower"), ("lower", "upper")):
        beams.beam(one, other, 0.05, 0.025, 1e3 * STEEL)
    tie_headset(beams, front)
    hold_frame(beams, held)
    return beams


def frame_compliance(front: Front, held: Hold = RIDER) -> Compliance:
    """Compliance at the foot of the frame alone, with a rigid bar in place of the fork."""
    return _compliance_of(_frame_with_bar(front, held), front, "foot")


def _support_head_tube(beams: Beams) -> None:
    beams.hold("middle", [0.0, RIGID, 0.0, 0.0, 0.0, 0.0])


def head_tube_figure(front: Front) -> float:
    """TOUR's stiffness of the head tube, N m/deg.

    Rear dropouts clamped, middle of the head tube supported, a weight on a bar 1 m from the support, a gauge at 0.4 m.
    """
    beams = _frame_with_bar(front, DROPOUTS)
    _support_head_tube(beams)
    middle = _heights(front)["middle"] * axes_of(front)[0]
    up = axes_of(front)[0]
    load, gauge = (_on_node(beams, "foot", middle - reach * up) for reach in (1.0, 0.4))
    reading = float(gauge @ np.linalg.solve(beams.matrix(), load))  # m per N
    return math.radians(0.4 / reading)


def fork_figure(front: Front) -> float:
    """Lateral stiffness of the fork at the dropouts with the steerer held in its bearings, N/mm."""
    beams = whole_bicycle(front, CLAMPED_HEAD)
    row = _on_node(beams, "hub", beams.places[beams.names["hub"]])
    return 1e-3 / float(row @ np.linalg.solve(beams.matrix(), row))


def clamped_fork_figure(front: Front) -> float:
    """The same with the steerer clamped from the lower bearing up, so that it does not bend, N/mm."""
    beams = whole_bicycle(front, CLAMPED_HEAD)
    beams.hold("lower", [RIGID] * 6)
    row = _on_node(beams, "hub", beams.places[beams.names["hub"]])
    return 1e-3 / float(row @ np.linalg.solve(beams.matrix(), row))


def ground_figure(front: Front) -> float:
    """RoadBIKE's stiffness (N/mm) of frame and fork at the point where the wheel touches the ground.

    Rear dropouts clamped, middle of the head tube supported, steering locked, the wheel rigid.
    """
    beams = whole_bicycle(front, DROPOUTS)
    _support_head_tube(beams)
    contact = beams.places[beams.names["hub"]] - np.array([0, 0, front.wheel])
    row = _on_node(beams, "hub", contact)
    return 1e-3 / float(row @ np.linalg.solve(beams.matrix(), row))


def deflections(front: Front, loads: Mapping[Place, float], readings: Sequence[Place], held: Hold = RIDER) -> Array:
    """Lateral readings (m,), m, under lateral ``loads`` (N) at places; the sag under its own weight is the zero."""
    beams = whole_bicycle(front, held)
    force = sum(newton * _row(beams, front, place) for place, newton in loads.items())
    moved = np.linalg.solve(beams.matrix(), force)
    return np.array([_row(beams, front, place) @ moved for place in readings])


def beam_modes(
    front: Front, p: Mapping[str, float], readings: Sequence[Place], held: Hold = RIDER
) -> tuple[Array, Array]:
    """Frequencies (k,), Hz, rising, and shapes (m, k) at the ``readings``; gravity is left out.

    The masses are those of the bicycle ``p``, placed by their height above the hub and their distance before the axis.
    """
    beams = whole_bicycle(front, held)
    up, forward = axes_of(front)
    bodies = {"hub": (p["mF"], np.diag([p["IFxx"], p["IFyy"], p["IFxx"]]), front.rake * forward)}
    height, ahead = _place_of_front_frame(p)
    bodies["crown"] = (p["mH"], _tensor(p, "IH"), height * up + ahead * forward)
    if isinstance(held, Stand):
        rear = beams.places[beams.names["rear axle"]]
        place = rear + np.array([p["xB"], 0, -p["zB"] - p["rR"]])
        bodies["stand"] = (p["mB"], _tensor(p, "IB"), place)
        bodies["rear axle"] = (p["mR"], np.diag([p["IRxx"], p["IRyy"], p["IRxx"]]), rear)
    kept = np.concatenate([beams.freedoms(name) for name in bodies])
    mass = np.zeros((len(kept), len(kept)))
    for k, (name, (kilogram, inertia, place)) in enumerate(bodies.items()):
        arm = place - beams.places[beams.names[name]]
        shift = np.hstack([np.eye(3), _cross_matrix(arm).T])  # displacement of the mass centre
        block = kilogram * shift.T @ shift
        block[3:, 3:] += inertia
        mass[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = block
    flexibility = np.linalg.inv(beams.matrix())
    root = np.linalg.cholesky(mass)
    values, vectors = np.linalg.eigh(root.T @ flexibility[np.ix_(kept, kept)] @ root)
    order = np.argsort(values)[::-1]
    forces = root @ vectors[:, order]
    rows = np.array([_row(beams, front, place) for place in readings])
    shapes = rows @ flexibility[:, kept] @ forces
    lateral = np.abs(shapes).max(axis=0) > 1e-9 * np.abs(shapes).max()
    return 1 / (2 * np.pi * np.sqrt(values[order][lateral])), shapes[:, lateral]


def _place_of_front_frame(p: Mapping[str, float]) -> tuple[float, float]:
    """Height (m) of the front frame's mass centre above the hub, up the axis, and its distance (m) before the axis."""
    sine, cosine = math.sin(p["lam"]), math.cos(p["lam"])
    x, z = p["xH"] - p["w"], -p["zH"] - p["rF"]  # from the hub
    offset = p["rF"] * sine - p["c"] * cosine  # of the hub before the axis
    return z * cosine - x * sine, x * cosine + z * sine + offset


def _tensor(p: Mapping[str, float], name: str) -> Array:
    """Inertia with z up."""
    xx, zz, xz = p[f"{name}xx"], p[f"{name}zz"], -p[f"{name}xz"]
    return np.array([[xx, 0, xz], [0, p.get(f"{name}yy", xx), 0], [xz, 0, zz]])


def _cross_matrix(arm: Array) -> Array:
    """Matrix with which a rotation becomes a displacement: arm x is its transpose."""
    x, y, z = arm
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


@dataclass(frozen=True)
class TwoJoints:
    """Hinge of the whole front and hinge of the wheel on the fork: stiffness N m/rad, height above the hub m."""

    frame: tuple[float, float]
    fork: tuple[float, float]


def two_joint_modes(p: Mapping[str, float], joints: TwoJoints, heights: Sequence[float]) -> tuple[Array, Array]:
    """Frequencies (2,), Hz, and signed ratios (m, 2) to the hub's motion, wheel up, steering locked, gravity included.

    ``heights`` (m,) are metres above the hub: at or below the fork's hinge on the wheel, above it on the front frame.
    """
    (stiff, upper), (soft, lower) = joints.frame, joints.fork
    height, _ = _place_of_front_frame(p)
    _, forward = axes_of_bicycle(p)
    inertia = float(forward @ _tensor(p, "IH") @ forward)
    wheel = p["mF"] * np.outer([upper, lower], [upper, lower]) + p["IFxx"]
    mass = wheel + np.diag([p["mH"] * (upper - height) ** 2 + inertia, 0.0])
    weight = p.get("g", 9.81) * math.cos(p["lam"])
    # a mass that hangs below its hinge is lifted by a tilt: m g ell / 2 tilt^2
    hanging = weight * (p["mH"] * (upper - height) + p["mF"] * (upper - lower))
    pull = weight * p["mF"] * lower
    stiffness = np.array([[stiff + hanging + pull, pull], [pull, soft + pull]])
    values, vectors = np.linalg.eig(np.linalg.solve(mass, stiffness))
    order = np.argsort(values)
    vectors = vectors[:, order]
    places = np.array([[upper - h, lower - h if h <= lower else 0.0] for h in heights])
    hub = np.array([upper, lower]) @ vectors
    return np.sqrt(values[order]) / (2 * np.pi), places @ vectors / hub


def axes_of_bicycle(p: Mapping[str, float]) -> tuple[Array, Array]:
    """Unit vectors up the steer axis and along the hinge axis of a bicycle, z up."""
    sine, cosine = math.sin(p["lam"]), math.cos(p["lam"])
    return np.array([-sine, 0.0, cosine]), np.array([cosine, 0.0, sine])
