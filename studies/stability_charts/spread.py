"""How well a boundary is known: its shift by the uncertain numbers of the model, to first order.

With Re lambda(u, p) = 0 along the boundary, numbers p with covariance S move it along its unit normal n by
-dp . dRe/dp / |dRe/du|, so that its standard deviation there is sqrt(g' S g) / |dRe/du| with g = dRe/dp. Along an axis
it is sqrt(g' S g) / |dRe/du_i|. The numbers of the two axes themselves are where they stand, without error.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bicycle.sensitivity.model_covariance import model_covariance
from bicycle.sensitivity.propagation import standard_deviation
from studies.stability_charts.boundary import Boundary
from studies.stability_charts.plane import Plane
from tyre.base.arrays import Array

STEP = 1e-5  # of a number, or of its standard deviation where that is larger


@dataclass(frozen=True)
class Uncertain:
    """Numbers that are uncertain, p of them: ``names``, ``covariance`` (p, p) in SI units, ``values`` (p,)."""

    names: tuple[str, ...]
    covariance: Array
    values: Array

    @classmethod
    def of(cls, plane: Plane, given: Mapping[str, float] | None = None, *, assume: bool = False) -> "Uncertain":
        """What the model states, and what is given, without the numbers of the axes.

        Parameters
        ----------
        plane : Plane
        given : mapping of str to float, optional
            Standard deviations by parameter, SI.
        assume : bool
            Whether what nobody states has a default.
        """
        names, covariance = model_covariance(plane.space.model, given, assume=assume)
        own = {entry for entries in plane.space.entries for entry in entries}
        kept = [i for i, name in enumerate(names) if name not in own]
        values = plane.space.model.parameters
        chosen = tuple(names[i] for i in kept)
        return cls(chosen, covariance[np.ix_(kept, kept)], np.array([values[name] for name in chosen]))

    def __bool__(self) -> bool:
        return bool(self.names)


def spread(plane: Plane, boundary: Boundary, uncertain: Uncertain) -> Array:
    """Standard deviation (m,) of the real part of the crossing root along a boundary, 1/s.

    What a tyre gives moves by the same share wherever it stands: its relative uncertainty is that of the model.

    Parameters
    ----------
    plane : Plane
    boundary : Boundary
    uncertain : Uncertain
    """
    space, points = plane.space, plane.x(boundary.shares)
    values, right = np.linalg.eig(space.matrices(points, plane.speed))
    left = np.linalg.inv(right)
    own, row = np.abs(values - boundary.roots[:, None]).argmin(1), np.arange(len(points))
    u, x = left[row, own], right[row, :, own]
    here, slopes = space.values(points), []
    for name, value, variance in zip(uncertain.names, uncertain.values, np.diag(uncertain.covariance), strict=True):
        at = np.broadcast_to(np.asarray(here[name], float), len(points))
        share = at / value if value else np.ones(len(at))  # of a tyre that is softer here than in the model
        step = STEP * np.maximum(np.abs(at), np.sqrt(variance) * np.abs(share))
        ends = [space.matrices(points, plane.speed, {name: at + sign * step}) for sign in (1, -1)]
        change = (ends[0] - ends[1]) / (2 * step)[:, None, None]
        slopes.append(np.einsum("mi,mij,mj->m", u, change, x).real * share)
    return np.asarray(standard_deviation(np.stack(slopes, -1), uncertain.covariance))


def along_axes(boundary: Boundary, growth: Array) -> Array:
    """Standard deviations (m, 3) of a boundary in shares of the axes: along the first, the second, and its normal.

    Parameters
    ----------
    boundary : Boundary
    growth : ndarray, shape (m,)
        Standard deviation of the real part, 1/s.
    """
    uphill = np.abs(boundary.gradients.real)
    with np.errstate(divide="ignore"):
        return np.stack([growth / uphill[:, 0], growth / uphill[:, 1], growth / np.hypot(*uphill.T)], -1)
