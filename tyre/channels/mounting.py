"""How a sensor of three axes is mounted: a rotation of triples of channels, with how well it is known."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tyre.base.arrays import Array
from tyre.base.checks import anything, list_of, number, text
from tyre.base.errors import InputError
from tyre.base.schema import maybe, needed, read, table

ORDERS = tuple(
    "".join(order) for axes in ("xyz", "XYZ")
    for order in {(a, b, c) for a in axes for b in axes for c in axes if a != b != c}
)  # fmt: skip
"""Sequences of three axes, small letters about axes that stand still, capitals about axes that turn along."""

TABLE = table(
    {
        needed("channels", 'channels is missing; name the three channels of the sensor\'s x, y and z axis'): list_of(
            text(blank=False), "must be three names of channels, along the sensor's x, y and z axis", least=3, most=3
        ),
        maybe("matrix"): list_of(
            list_of(number(), "must be rows of three numbers", least=3, most=3), "must be three rows of three numbers",
            least=3, most=3,
        ),
        maybe("angles_deg"): list_of(number(), "must be three angles in degrees", least=3, most=3),
        maybe("order"): text(
            'must be three axes: "zyx" about axes that stand still, "ZYX" about axes that turn along', allowed=ORDERS
        ),
        maybe("sd_deg", 0.0): number(least=0, most=90),
    }
)  # fmt: skip
LIST = list_of(anything, "must be tables: write [[mounting]] with channels for each sensor", least=1)


@dataclass(frozen=True, eq=False)
class Mounting:
    """Rotation from the axes of a sensor to those of the vehicle or rig: v = R v_sensor.

    Attributes
    ----------
    channels : tuple of str
        Names of the three channels along x, y and z.
    rotation : ndarray, shape (3, 3)
        R, without unit.
    sd : float
        1-sd uncertainty of the rotation about each axis, rad.
    """

    channels: tuple[str, str, str]
    rotation: Array
    sd: float = 0.0

    def turned(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """The three channels of ``values``, each of shape (n,) in one SI unit, in the axes of the vehicle."""
        sensor = [values[name] for name in self.channels]
        return {
            name: sum((factor * x for factor, x in zip(row, sensor, strict=True)), np.zeros_like(sensor[0]))
            for name, row in zip(self.channels, self.rotation, strict=True)
        }

    def spread(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """1-sd error of each turned channel that comes from the mounting.

        A small rotation d (rad) about the three axes, each with standard deviation ``sd``, changes v by d x v, so
        that the variance of a component is sd^2 times the sum of squares of the two others.

        Parameters
        ----------
        values : mapping of str to ndarray, shape (n,)
            The turned channels, in one SI unit.
        """
        x, y, z = (values[name] for name in self.channels)
        sides = (np.hypot(y, z), np.hypot(x, z), np.hypot(x, y))
        return {name: self.sd * side for name, side in zip(self.channels, sides, strict=True)}


def read_mountings(content: Any, *, where: str) -> tuple[Mounting, ...]:
    """The list of tables ``[[mounting]]``.

    Parameters
    ----------
    content : object
        What the file holds.
    where : str
        What a message begins with.

    Raises
    ------
    InputError
        An unknown key, no rotation or two, angles without their order, a matrix that is no rotation.
    """
    found = []
    for place, entry in enumerate(read(LIST, content, where=where, section="mounting"), 1):
        here = f"{where}: [[mounting]] number {place}"
        given = read(TABLE, entry, where=here)
        names = tuple(given["channels"])
        if len(set(names)) < 3:
            raise InputError(f"{here}: channels = {list(names)} names a channel twice; give x, y and z")
        found.append(Mounting(names, _rotation(given, here), float(np.deg2rad(given["sd_deg"]))))
    return tuple(found)


def _rotation(given: Mapping[str, Any], where: str) -> Array:
    if ("matrix" in given) == ("angles_deg" in given):
        raise InputError(f"{where}: give the rotation either as matrix or as angles_deg with their order")
    if "angles_deg" in given:
        if "order" not in given:
            raise InputError(f'{where}: angles_deg needs its order, such as order = "ZYX"; see the documentation')
        from scipy.spatial.transform import Rotation

        return np.asarray(Rotation.from_euler(given["order"], given["angles_deg"], degrees=True).as_matrix(), float)
    if "order" in given:
        raise InputError(f"{where}: order belongs to angles_deg; take it out beside a matrix")
    matrix = np.array(given["matrix"], float)
    if np.abs(matrix @ matrix.T - np.eye(3)).max() > 1e-3:
        raise InputError(
            f"{where}: the rows of matrix are not three perpendicular unit vectors (within 0.001); it is no rotation"
        )
    if np.linalg.det(matrix) < 0:
        raise InputError(
            f"{where}: matrix mirrors (its determinant is -1): give a left-handed sensor's axis sign = -1 in [channels]"
        )
    u, _, v = np.linalg.svd(matrix)
    return np.asarray(u @ v, float)  # the nearest rotation: printed matrices are rounded
