"""Small lateral motion of a chain of rigid bodies: displacement rows, mass matrix and second-order heights.

Axes: x forward, y right, z down, origin at the rear contact. Every hinge axis and mass centre lies in the plane
of symmetry, so to first order a body moves laterally and turns about x and z only, linearly in the coordinates
``[y, psi, lean, frame joints..., steer]`` (physics after Meijaard et al. 2007, appendix B, generalised to more
joints). The functions use plain arithmetic, so that they serve sympy expressions and floats alike.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Scalar = Any  # a float or a sympy expression
Row = NDArray[Any]  # shape (2 + number of joints,), dtype object or float


@dataclass(frozen=True)
class Body:
    """A rigid body: mass, mass centre (x, z) and inertia-tensor entries about it (Ixz as Meijaard tabulates it)."""

    name: str  # by which joints carry it
    mass: Scalar  # kg
    x: Scalar  # m, of the mass centre, positive forward of the rear contact
    z: Scalar  # m, of the mass centre, positive down
    Ixx: Scalar  # kg m^2, about the mass centre
    Izz: Scalar  # kg m^2, about the mass centre
    Ixz: Scalar = 0  # kg m^2, tensor entry -sum m x z
    spin_inertia: Scalar = 0  # kg m^2 about the axle; 0: it does not roll
    radius: Scalar = 1  # m, of a wheel that rolls
    # name of the body that it moves with; empty: the rear frame, unless a joint carries it
    fixed_to: str = field(default="", kw_only=True)


@dataclass(frozen=True)
class Joint:
    """A hinge with axis (axis_x, 0, axis_z) through (x, 0, z) that carries the named bodies; its parent is a joint."""

    name: str  # of its angle, rad
    axis_x: Scalar  # forward component of its unit vector
    axis_z: Scalar  # downward component of its unit vector
    x: Scalar  # m, of a point on the axis, positive forward of the rear contact
    z: Scalar  # m, of a point on the axis, positive down
    carries: frozenset[str]  # names of the bodies that turn with it
    hangs_on: str = field(default="", kw_only=True)  # name of a joint; empty: on the ground

    def lever(self, x: Scalar, z: Scalar) -> Scalar:
        """Lateral displacement of the carried point (``x``, ``z``), m, per radian: (axis x arm) . y, m/rad."""
        return self.axis_z * (x - self.x) - self.axis_x * (z - self.z)


def displacement_row(joints: Sequence[Joint], body: str, x: Scalar, z: Scalar) -> Row:
    """Lateral displacement of a point of a body per coordinate ``[y, psi, joints...]``, m/m and m/rad."""
    return np.array([1, x] + [joint.lever(x, z) if body in joint.carries else 0 for joint in joints])


def lean_row(joints: Sequence[Joint], body: str) -> Row:
    """Small rotation about x of the body named ``body`` per coordinate ``[y, psi, joints...]`` of ``joints``."""
    return np.array([0, 0] + [joint.axis_x if body in joint.carries else 0 for joint in joints])


def yaw_row(joints: Sequence[Joint], body: str) -> Row:
    """Small rotation about z of the body named ``body`` per coordinate ``[y, psi, joints...]`` of ``joints``."""
    return np.array([0, 1] + [joint.axis_z if body in joint.carries else 0 for joint in joints])


def inertia_terms(bodies: Iterable[Body], joints: Sequence[Joint]) -> Iterator[tuple[Scalar, Row, Row]]:
    """Terms of :func:`mass_matrix`: an inertia (kg or kg m^2) and the two rows whose outer product it multiplies."""
    for body in bodies:
        y = displacement_row(joints, body.name, body.x, body.z)
        tx, tz = lean_row(joints, body.name), yaw_row(joints, body.name)
        yield body.mass, y, y
        yield body.Ixx, tx, tx
        yield body.Izz, tz, tz
        yield body.Ixz, tx, tz
        yield body.Ixz, tz, tx


def mass_matrix(bodies: Iterable[Body], joints: Sequence[Joint]) -> NDArray[Any]:
    """Kinetic-energy form in the rates of ``[y, psi, joints...]``: sum m yy' + Ixx xx' + Izz zz' + Ixz (xz' + zx')."""
    terms = (inertia * np.outer(left_row, right_row) for inertia, left_row, right_row in inertia_terms(bodies, joints))
    return np.asarray(sum(terms))


def height_hessian(joints: Sequence[Joint], body: str, x: Scalar, z: Scalar) -> NDArray[Any]:
    """Second derivatives (m/rad^2) of the z coordinate (down) of a point of a body in the joint angles."""
    n = len(joints)
    hessian = np.array([[0] * n] * n, dtype=object)
    for k, outer in enumerate(joints):
        if body not in outer.carries:
            continue
        lever = outer.lever(x, z)
        for j in range(k + 1):
            if body in joints[j].carries:
                hessian[j, k] = hessian[k, j] = joints[j].axis_x * lever
    return hessian


def forward_hessian(joints: Sequence[Joint], body: str, x: Scalar, z: Scalar) -> NDArray[Any]:
    """Slope in the joint angles of the way forward (m/rad^2) of a point of a body per ``[y, psi, joints...]``."""
    rows = np.array([[0] * len(joints)] * (2 + len(joints)), dtype=object)
    turns = yaw_row(joints, body)
    for k, inner in enumerate(joints):
        if body in inner.carries:
            rows[1, k] = -inner.lever(x, z)
            for j in range(k + 1):
                rows[2 + j, k] = rows[2 + k, j] = -turns[2 + j] * inner.lever(x, z)
    return rows
