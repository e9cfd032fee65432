"""The segments of a body in a posture: mass, centre and inertia of each, and its outline.

The package ``yeadon`` gives the sections of the body, its densities and where its joint angles put them. The masses are
added up here, because three sums of ``yeadon`` (2.0.1) do not bear a check against thin slices:

* a segment's inertia is turned by R' I R where R maps the segment's axes to those of the body; it must be R I R'
  (since its pull request 80): products of inertia get the wrong sign;
* a cone (upper arm, thigh, shank, neck) has its mass centre where that of the same cone upside down would be, 3 cm too
  low in the calf;
* the inertia of a slice about its long side has r t^3 for r^3 t.
"""

import contextlib
import io
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from bicycle.rider.joining import RigidBody, join
from bicycle.rider.measurements import RiderMeasurements
from bicycle.rider.solids import half_ellipsoid, stadium_solid
from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.optional import not_installed

DENSITY_SETS = ("Dempster", "Chandler", "Clauser")
"""Densities of the segments from three sources (Yeadon 1990); the first is used, the spread is an uncertainty."""

TO_BICYCLE = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Axes of ``yeadon`` (x left, y back, z up) to x forward, y right, z down."""


@dataclass(frozen=True)
class Segment:
    """A rigid part of the body on the bicycle, and sections along it for a drawing.

    ``sections`` (k, 3) are centres of cross sections in m, ``wide`` and ``deep`` (k, 3) the half axes across and
    through the body.
    """

    name: str
    body: RigidBody
    sections: Array
    wide: Array
    deep: Array


def segments(
    rider: RiderMeasurements, configuration: Mapping[str, float], hip: Array, *, densities: str = DENSITY_SETS[0]
) -> tuple[Segment, ...]:
    """The eleven segments of a rider with joint angles (rad) and the hip joint centre at (x, z) on the bicycle.

    With a known total mass all densities are scaled by one factor to give it.

    Parameters
    ----------
    rider : RiderMeasurements
    configuration : mapping of str to float
        The 21 joint angles of ``yeadon``, rad.
    hip : ndarray, shape (2,)
        Hip joint centre (x, z) on the bicycle, m.
    densities : str, optional
        A set of :data:`DENSITY_SETS`.

    Raises
    ------
    InputError
        The package ``yeadon`` is not installed.
    """
    with _quiet():
        human = _yeadon().Human(dict(rider.lengths), density_set=densities)
        human.set_CFG_dict(dict(configuration))
    factor = 1.0 if rider.mass is None else rider.mass / sum(s.mass for s in human.segments)
    origin = np.array([hip[0], 0.0, hip[1]])
    return tuple(_segment(part, factor, origin) for part in human.segments)


def yeadon_version() -> str:
    """Version of the installed ``yeadon``."""
    return str(_yeadon().__version__)


def _segment(part: Any, factor: float, origin: Array) -> Segment:
    turn = TO_BICYCLE @ np.asarray(part.rot_mat, dtype=float)
    sections, wide, deep = [], [], []
    bodies = []
    for solid in part.solids:
        start, end = (origin + TO_BICYCLE @ np.ravel(place) for place in (solid.pos, solid.end_pos))
        bodies.append(_body(solid, factor, start, end, turn))
        for place, (half_width, half_depth) in zip((start, end), _sections(solid), strict=True):
            sections.append(place)
            wide.append(half_width * turn[:, 0])
            deep.append(half_depth * turn[:, 1])
    return Segment(str(part.label).partition(": ")[2], join(bodies), np.array(sections), np.array(wide), np.array(deep))


def _body(solid: Any, factor: float, start: Array, end: Array, turn: Array) -> RigidBody:
    """A solid on the bicycle, its density times ``factor``."""
    density = factor * float(solid.density)
    if not hasattr(solid, "stads"):
        return half_ellipsoid(radius=float(solid.radius), start=start, end=end, turn=turn, density=density)
    first, last = solid.stads
    return stadium_solid(
        thickness=(float(first.thickness), float(last.thickness)), radius=(float(first.radius), float(last.radius)),
        start=start, end=end, turn=turn, density=density, long_side_forward=solid.alignment == "AP",
    )  # fmt: skip


def _sections(solid: Any) -> list[tuple[float, float]]:
    """Half width and half depth at both ends of a solid."""
    if not hasattr(solid, "stads"):
        return [(solid.radius, solid.radius), (0.0, 0.0)]  # the vault of the head
    halves = [(s.thickness + s.radius, s.radius) for s in solid.stads]
    return [half[::-1] if s.alignment == "AP" else half for half, s in zip(halves, solid.stads, strict=True)]


def _yeadon() -> ModuleType:
    try:
        with _quiet():
            import yeadon
    except ImportError as error:
        raise InputError(f"a rider's body needs yeadon: {not_installed('yeadon', extra='rider')}") from error
    return yeadon


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep what ``yeadon`` prints and warns from the user; what matters is checked on reading."""
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
