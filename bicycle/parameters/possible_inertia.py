"""Coordinates of inertias that never leave those of rigid bodies, for fits that adjust a bicycle.

A body exists if the second moments of its mass about its mass centre form a positive semidefinite matrix (the
pseudo-inertia, Wensing, Kim & Slotine 2018, IEEE Robotics and Automation Letters 3(1), 60-67; its smooth coordinates:
Rucker & Wensing 2022, the same 7(2), 2771-2778). For the bodies of a bicycle, symmetric about its plane, it asks

- of a frame that ((Ixx, Ixz), (Ixz, Izz)) is positive semidefinite: some Iyy then fulfils the triangle inequalities;
- of a wheel, symmetric about its axle too, that 0 <= Iyy <= 2 Ixx.

The log-Cholesky coordinates of Rucker & Wensing would change numbers that are known exactly, and they do not reach the
flat wheels, Iyy = 2 Ixx, of many published bicycles. Here the way from the stated body is shortened instead, where it
leads towards the boundary: by (1 + sum of mu^4)^(-1/4), where 1/mu is how often the way fits in before a principal
moment vanishes. Thickness Ixx - Iyy/2 of a wheel is a coordinate of its own with a plain bound.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from bicycle.parameters.bicycle import BOUNDS
from tyre.ground.arrays import Array

FRAMES = (("IBxx", "IBzz", "IBxz"), ("IHxx", "IHzz", "IHxz"))
WHEELS = (("IRxx", "IRyy"), ("IFxx", "IFyy"))
UNSEEN = {"IByy": ("IBxx", "IBzz", "IBxz"), "IHyy": ("IHxx", "IHzz", "IHxz")}
"""Moments that have no part in lateral motion, and those of the same body."""
FLAT = 1e-9  # smallest over largest principal moment in the plane, below which a frame is a rod


@dataclass(frozen=True, eq=False)
class InertiaCoordinates:
    """Coordinates of the inertias of a bicycle that float, equal to their values at the stated bicycle.

    There the derivatives of the values along the coordinates, both in standard deviations, are a rotation: independent
    normal priors of the coordinates are those of the values to first order.
    """

    keys: tuple[str, ...]  # of the m inertias that float
    origin: Array  # (m, 1), values from which the way is shortened: as stated, or the nearest flat wheel, kg m^2
    begin: Array  # (m, 1), coordinates of the origin, kg m^2
    body: NDArray[np.intp]  # (m,), number of the body of each
    turn: Array  # (m, m), deviations of the values per deviation of the coordinates
    # (3, b, m), per kg m^2 of a deviation: relative change of each body's moments in the plane, two on the diagonal and
    # one beside it
    relative: Array
    lowest: Array  # (m,), bounds of the coordinates, kg m^2

    def values(self, coordinates: Array) -> Array:
        """Inertias (m, K), kg m^2, at ``coordinates`` (m, K)."""
        way = self.turn @ (coordinates - self.begin)
        return np.asarray(self.origin + way * _shortening(self.relative @ way)[self.body])


def _shortening(change: Array) -> Array:
    """Factor (...) on ways along which symmetric 2 x 2 matrices 1 + ``change`` (3, ...) must stay positive definite."""
    first, second, off_diagonal = change
    middle, half = (first + second) / 2, (first - second) / 2
    radius = np.sqrt(half * half + off_diagonal * off_diagonal)
    # squares of the eigenvalues that shrink the body
    smaller, larger = np.minimum(middle - radius, 0.0) ** 2, np.minimum(middle + radius, 0.0) ** 2
    return np.asarray(1 / np.sqrt(np.sqrt(1 + smaller * smaller + larger * larger)))


def inertia_coordinates(values: Mapping[str, float], sd: Mapping[str, float]) -> InertiaCoordinates | None:
    """Coordinates of the inertias of a bicycle of ``values`` that have an ``sd``, kg m^2; None if there are none."""
    bodies = []
    for frame in FRAMES:
        floating = tuple(key for key in frame if sd.get(key))
        if floating and not is_rod(values, frame):
            bodies.append(_frame(values, frame, floating))
    for wheel in WHEELS:
        if all(sd.get(key) for key in wheel):
            bodies.append(_wheel(values, sd, wheel))
    if not bodies:
        return None
    keys = tuple(key for body in bodies for key in body.keys)
    return InertiaCoordinates(
        keys=keys,
        origin=np.concatenate([body.origin for body in bodies])[:, None],
        begin=np.concatenate([body.begin for body in bodies])[:, None],
        body=np.repeat(np.arange(len(bodies)), [len(body.keys) for body in bodies]),
        turn=block_diag(*(body.turn for body in bodies)),
        relative=np.stack([block_diag(*(body.relative[row] for body in bodies)) for row in range(3)]),
        lowest=np.concatenate([body.lowest for body in bodies]),
    )


@dataclass(frozen=True, eq=False)
class _Body:
    """Part of :class:`InertiaCoordinates` of one body."""

    keys: tuple[str, ...]  # of its m inertias that float
    origin: Array  # (m,), kg m^2
    begin: Array  # (m,), kg m^2
    turn: Array  # (m, m)
    relative: Array  # (3, m)
    lowest: Array  # (m,)


def is_rod(values: Mapping[str, float], keys: tuple[str, ...]) -> bool:
    """True if one principal moment of a frame vanishes: it has no room to change in."""
    smallest, largest = np.linalg.eigvalsh(_in_plane(*(values[key] for key in keys)))
    return bool(smallest <= FLAT * largest)


def _in_plane(xx: float, zz: float, xz: float) -> Array:
    return np.array([[xx, xz], [xz, zz]])


def _frame(values: Mapping[str, float], keys: tuple[str, ...], floating: tuple[str, ...]) -> _Body:
    """Coordinates of a frame: the change C of its moments S is relative to a root of them, S^(-1/2) C S^(-1/2)."""
    size, axes = np.linalg.eigh(_in_plane(*(values[key] for key in keys)))
    root = axes / np.sqrt(size) @ axes.T
    columns = []
    for key in floating:
        change = root @ _in_plane(*(float(key == name) for name in keys)) @ root
        columns.append([change[0, 0], change[1, 1], change[0, 1]])
    free = np.full(len(floating), -math.inf)
    inertias = np.array([values[key] for key in floating])
    return _Body(floating, inertias, inertias, np.eye(len(floating)), np.array(columns).T, free)


def _wheel(values: Mapping[str, float], sd: Mapping[str, float], keys: tuple[str, ...]) -> _Body:
    """Coordinates of a wheel, turned in standard deviations so that its thickness is the first of them.

    A wheel that is stated flatter than flat, Iyy > 2 Ixx, may lie no nearer to that than the flat wheel next to it. The
    way begins there: shortened from elsewhere, it would end beyond the bound of the thickness.
    """
    inertias, size = (np.array([of[key] for key in keys]) for of in (values, sd))
    per_sd = np.array([1.0, -0.5]) * size  # of the thickness Ixx - Iyy/2, per sd of either
    thickness, spread = float(inertias[0] - inertias[1] / 2), float(np.hypot(*per_sd))
    cosine, sine = per_sd[0] / spread, -per_sd[1] / spread
    turn = np.array([[cosine, sine], [-sine, cosine]]) * size[:, None] / size
    missing = max(-thickness, 0.0) / spread  # thickness that the nearest flat wheel has more than the stated one, sd
    origin = inertias + size * per_sd / spread * missing
    begin = inertias + size * [missing, 0.0]
    relative = np.zeros((3, 2))
    if origin[1] > 0:
        relative[0, 1] = 1 / origin[1]
    lowest = np.array([inertias[0] - size[0] * thickness / spread, -math.inf])
    return _Body(keys, origin, begin, turn, relative, lowest)


def bounds_beside(key: str, values: Mapping[str, float]) -> tuple[float, float]:
    """Lowest and highest value of a parameter ``key`` that alone of its body floats, the others being ``values``.

    A wheel whose mass was added to the frame, as those of motorcycles in the literature, only spins: no bound.
    """
    low, high = BOUNDS[key]
    for across, spin in WHEELS:
        if values[spin] > 2 * values[across]:
            continue
        if key == across:
            low = values[spin] / 2
        elif key == spin:
            high = 2 * values[across]
    return low, high


def fitting_moments(values: Mapping[str, float]) -> dict[str, float]:
    """Moments IByy and IHyy (kg m^2) among ``values`` that the others of their body forbid, moved to the nearest."""
    moments = {}
    for key, keys in UNSEEN.items():
        if key not in values:
            continue
        smallest, largest = np.linalg.eigvalsh(_in_plane(*(values[axis_key] for axis_key in keys)))
        nearest = min(max(values[key], largest - smallest), largest + smallest)
        if abs(nearest - values[key]) > FLAT * largest:
            moments[key] = float(nearest)
    return moments
