"""Deflections and vibrations that a model predicts for a standing bicycle, for many bicycles at a time.

A load F at a place deflects the bicycle by q = (K + W)^-1 b F, and a gauge reads b' q, with the rows b of both places.
After a tap it moves by the eigenvectors of M q'' + C q' + (K + W) q = 0. What is held are places and bodies whose
displacement is a row r with r q = 0: those coordinates of the frame follow the others, q = N z, and N' M N is the mass
of what is free. Held is the rear frame, or the rear wheel where the axle is held, or under a seated rider the
contact of the rear tyre, which may have a lateral spring. A frame that is not held is supported by springs at the point
of the hold.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from bicycle.equations.held_frame import FRAME, HeldFrame, HeldMatrices, held_equations
from bicycle.standing.readings import Place, Readings
from tyre.ground.arrays import Array, Complex

SUPPORT = ("support.rotation", "support.lateral", "support.x", "support.z")
"""Keys of a hold: stiffness in roll and yaw (N m/rad), to the side (N/m), its place (m) in the axes of the bicycle."""
STEER = "steer"
TYRE, TYRE_DAMPING = "rear_tyre.stiffness", "rear_tyre.damping"
"""Keys of stiffness (N/m) and damping (N s/m) to the side of the rear tyre on which a frame stands under a rider."""
SERIES = "wheel_compliance.stiffness.front"
"""Key of the lateral stiffness (N/m) of rim and spokes of the front wheel, in series with what is read at the rim."""
RIM_SHARE = 0.8  # of the wheel's radius below the hub, from where on a place is at the rim


def load_error(force: float) -> str:
    """Key of the relative error of a load (N)."""
    return f"load {force:g} N"


def place_error(place: Place) -> str:
    """Key of the error (m) of a place."""
    return f"place {place.above_hub:g} m, {place.on}"


def gain_error(pair: tuple[Place, Place]) -> str:
    """Key of the relative error of a ratio of two sensors."""
    return f"gain {place_error(pair[0])} over {place_error(pair[1])}"


@dataclass(frozen=True)
class Prediction:
    """What the readings would be on bicycles with some effects."""

    readings: Readings
    effects: tuple[type[Any], ...]  # those that add joints, springs or dampers, by identifier
    ridden: bool = False  # the numbers of the bicycle include a rider: one who is seated lets the frame yaw and lean

    @cached_property
    def frame(self) -> HeldFrame:
        """The equations."""
        return held_equations(self.effects)

    def __call__(self, values: Mapping[str, Array]) -> Array:
        """Predict the numbers of :meth:`Readings.numbers`, (k, n).

        Parameters
        ----------
        values : mapping
            Parameters of bicycle and effects (k,), SI; perhaps errors of loads, places and gains, and
            :data:`SUPPORT` of a frame that is not held.
        """
        matrices = self.frame(values)
        supported = SUPPORT[0] in values
        stiffness = matrices.stiffness + (0.0 if self.readings.on_side else matrices.weight)
        if supported:
            stiffness = stiffness + _hold(matrices, values)
        columns = [self._deflections(matrices, stiffness, values, supported=supported)]
        columns += [
            self._tap(number, matrices, stiffness, values, supported=supported)
            for number in range(len(self.readings.taps))
        ]
        return np.concatenate(columns, -1)

    @property
    def frame_free(self) -> bool:
        """True if only a rider holds the frame in the taps."""
        return self.readings.seated and self.ridden

    def _motions(self, matrices: HeldMatrices, *, supported: bool, bar_free: bool, seated: bool = False) -> Array:
        """Columns N (k, n, m): the coordinates per coordinate that is free."""
        names = self.frame.coordinates
        held = np.arange(0 if supported else 1 if seated else len(FRAME))
        free = [k for k, name in enumerate(names) if k not in held and (bar_free or name != STEER)]
        count = len(matrices.mass)
        motions = np.zeros((count, len(names), len(free)))
        motions[:, free, np.arange(len(free))] = 1.0
        if not len(held):
            return motions
        body = "rear wheel" if seated or self.readings.axle_held else "frame"
        rows = matrices.rows[body][:, : len(held)]  # of the point under the rear axle; or also its slopes in x and z
        rows = np.broadcast_to(rows, (count, *rows.shape[1:]))
        motions[:, held] = -np.linalg.solve(rows[:, :, held], rows[:, :, free])
        return motions

    def _row(self, matrices: HeldMatrices, values: Mapping[str, Array], place: Place) -> Array:
        """Displacement (k, n) of a place per coordinate."""
        above = place.above_hub + values.get(place_error(place), np.zeros(1))
        x, z = point_of(values, above, on_wheel=place.on == "wheel")
        return matrices.displacement(place.on, x, z)

    def _deflections(
        self, matrices: HeldMatrices, stiffness: Array, values: Mapping[str, Array], *, supported: bool
    ) -> Array:
        """Deflections (k, number), m; the handlebar is held."""
        motions = self._motions(matrices, supported=supported, bar_free=False)
        compliance = np.linalg.inv(_reduced(stiffness, motions))
        columns = []
        for deflection in self.readings.deflections:
            load = deflection.force * (1 + values.get(load_error(abs(deflection.force)), np.zeros(1)))
            loaded, read = (
                np.einsum("kn,knm->km", self._row(matrices, values, place), motions)
                for place in (deflection.loaded, deflection.read)
            )
            deflected = np.einsum("ki,kij,kj->k", read, compliance, loaded)
            if SERIES in values and all(at_rim(p, values["rF"]) for p in (deflection.loaded, deflection.read)):
                deflected = deflected + 1 / values[SERIES]
            columns.append(load * deflected)
        return np.stack(columns, -1) if columns else np.zeros((len(stiffness), 0))

    def _tap(
        self, number: int, matrices: HeldMatrices, stiffness: Array, values: Mapping[str, Array], *, supported: bool
    ) -> Array:
        """Frequency (Hz), damping ratio, parts of ratios of one tap, (k, 2 + 2 ratios), of the mode nearest to it."""
        tap = self.readings.taps[number]
        mass, damping = matrices.mass, matrices.damping
        on_tyre = self.frame_free and TYRE in values
        if on_tyre:
            row = matrices.rows["rear wheel"][:, 0]
            below = row[:, :, None] * row[:, None, :]
            stiffness = stiffness + values[TYRE][:, None, None] * below
            damping = damping + values[TYRE_DAMPING][:, None, None] * below
        motions = self._motions(
            matrices, supported=supported or on_tyre, bar_free=self.readings.bar_free, seated=self.frame_free
        )
        if tap.added_mass:
            row = self._row(matrices, values, tap.added)
            mass = mass + tap.added_mass * row[:, :, None] * row[:, None, :]
            if not self.readings.on_side:
                lift = _lift(matrices.rows[tap.added.on], row)
                stiffness = stiffness - values["g"][:, None, None] * tap.added_mass * lift
        free_mass, free_damping, free_stiffness = (_reduced(matrix, motions) for matrix in (mass, damping, stiffness))
        # of two vibrations near each other the damping decides; of a frame that is held there is one
        angle = tap.angle if self.frame_free else math.nan
        root, shape = nearest_mode(free_mass, free_damping, free_stiffness, 2 * np.pi * tap.frequency_hz, angle)
        columns = [np.abs(root) / (2 * np.pi), -root.real / np.abs(root)]
        for ratio in tap.ratios:
            read, over = (
                np.einsum("kn,knm->km", self._row(matrices, values, place), motions)
                for place in (ratio.read, ratio.over)
            )
            gain = 1 + values.get(gain_error((ratio.read, ratio.over)), np.zeros(1))
            moved = gain * (read * shape).sum(-1) / (over * shape).sum(-1)
            columns += [moved.real, moved.imag]
        return np.stack(np.broadcast_arrays(*columns), -1)


def point_of(values: Mapping[str, Array], above: Array, *, on_wheel: bool) -> tuple[Array, Array]:
    """Point (x, z), m, ``above`` the hub (m along the steer axis): through the hub, or on the axis itself."""
    sine, cosine = np.sin(values["lam"]), np.cos(values["lam"])
    x, z = values["w"], -values["rF"]
    if not on_wheel:  # the point of the axis that is nearest to the hub
        down = -values["c"] * sine + z * cosine  # m along the axis, from its point on the ground
        x, z = values["w"] + values["c"] + down * sine, down * cosine
    return x - above * sine, z - above * cosine


def _hold(matrices: HeldMatrices, values: Mapping[str, Array]) -> Array:
    """Stiffness (k, n, n) of the springs on which a frame stands that is not held."""
    row = matrices.displacement("frame", values[SUPPORT[2]], values[SUPPORT[3]])
    total = values[SUPPORT[1]][:, None, None] * row[:, :, None] * row[:, None, :]
    for name in FRAME[1:]:
        total[:, FRAME.index(name), FRAME.index(name)] += values[SUPPORT[0]]
    return np.asarray(total)


def _lift(rows: Array, row: Array) -> Array:
    """Second derivatives (k, n, n) of the z coordinate of a point by its displacement ``row`` (k, n).

    As :func:`bicycle.parameters.rigid_bodies.height_hessian`: the forward part of the axis of the outer joint times
    the lever of the inner one; y and yaw have none.
    """
    forward = -rows[:, 2]
    products = forward[:, :, None] * row[:, None, :]
    upper = np.triu(products)
    hessian = upper + np.swapaxes(np.triu(products, 1), 1, 2)
    hessian[:, :2] = 0.0
    hessian[:, :, :2] = 0.0
    return np.asarray(hessian)


def _reduced(matrix: Array, motions: Array) -> Array:
    """Matrix (k, m, m) of what is free, N' A N."""
    return np.asarray(np.swapaxes(motions, 1, 2) @ matrix @ motions)


def at_rim(place: Place, radius: Array | float) -> bool:
    """True of a place near the lowest point of the front wheel, whose ``radius`` is in m."""
    return place.on == "wheel" and place.above_hub < -RIM_SHARE * float(np.min(radius))


def nearest_mode(
    mass: Array, damping: Array, stiffness: Array, omega: float, angle: float = math.nan
) -> tuple[Complex, Complex]:
    """Eigenvalue (k,), 1/s, and shape (k, n) of the oscillation whose frequency is nearest to ``omega`` (rad/s).

    With an ``angle`` (rad) beyond the imaginary axis: whose logarithm is nearest.
    """
    n = mass.shape[-1]
    upper = np.concatenate([np.zeros_like(mass), np.broadcast_to(np.eye(n), mass.shape)], -1)
    lower = -np.linalg.solve(mass, np.concatenate([stiffness, damping], -1))
    roots, vectors = np.linalg.eig(np.concatenate([upper, lower], -2))
    distance = np.abs(np.log(np.maximum(np.abs(roots), 1e-6) / omega)) + np.where(roots.imag > 0, 0.0, 1e3)
    if not math.isnan(angle):
        distance = np.hypot(distance, np.angle(roots) - np.pi / 2 - angle)
    chosen = distance.argmin(-1)
    every = np.arange(len(roots))
    return np.asarray(roots[every, chosen], complex), np.asarray(vectors[every, :n, chosen], complex)


def measured_places(readings: Readings) -> Sequence[str]:
    """Keys of the errors of ``readings``: loads, places, gains."""
    keys = [load_error(force) for force in readings.loads]
    keys += [place_error(place) for place in readings.places]
    return [*keys, *(gain_error(pair) for pair in readings.pairs)]
