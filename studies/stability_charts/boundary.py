"""A boundary of a chart: points at which one root lies on the imaginary axis, in order along the curve."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tyre.base.arrays import Array, Complex

EDGE, CLOSED, DOUBLE_ZERO, LOST = "edge", "closed", "double zero", "lost"
"""How a curve ends: at the edge of the chart, in itself, where the frequency of a pair becomes zero, or unknown."""


@dataclass(frozen=True, eq=False)
class Boundary:
    """A curve on which a root lies on the imaginary axis.

    Attributes
    ----------
    shares : ndarray, shape (m, 2)
        Points in order, 0 to 1 along each axis; of a closed curve the first is not repeated.
    roots : ndarray of complex, shape (m,)
        1/s, on the axis.
    gradients : ndarray of complex, shape (m, 2)
        Derivative of the root with the shares of both axes, 1/s.
    sizes : ndarray, shape (m,)
        Largest root, 1/s.
    real : bool
        Whether a real root is zero, else a pair is imaginary.
    ends : pair of str
        How it begins and how it ends.
    """

    shares: Array
    roots: Complex
    gradients: Complex
    sizes: Array
    real: bool
    ends: tuple[str, str]

    def __len__(self) -> int:
        return len(self.shares)

    @property
    def closed(self) -> bool:
        """Whether it comes back to its beginning."""
        return self.ends[0] == CLOSED

    @property
    def step(self) -> int:
        """By how much the number of unstable roots differs from one side to the other."""
        return 1 if self.real else 2

    @property
    def normals(self) -> Array:
        """Unit vectors (m, 2), in shares of the axes, towards where the root is unstable."""
        uphill = self.gradients.real
        return np.asarray(uphill / np.maximum(np.hypot(*uphill.T), 1e-300)[:, None])

    @property
    def segments(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Begin and end (k, 2) of every piece, and whether the unstable side is to its left (k,)."""
        ahead = np.roll(self.shares, -1, 0) if self.closed else self.shares[1:]
        begin = self.shares[: len(ahead)]
        along = ahead - begin
        normal = self.normals[: len(ahead)] + np.roll(self.normals, -1, 0)[: len(ahead)]
        return begin, ahead, (-along[:, 1] * normal[:, 0] + along[:, 0] * normal[:, 1]) > 0

    def distance(self, point: Array) -> tuple[float, int]:
        """Distance of a ``point`` (2,), in shares of the axes, and the number of the nearest piece."""
        if len(self) == 1:
            return float(np.hypot(*(self.shares[0] - point))), 0
        begin, end, _ = self.segments
        along = end - begin
        length = np.maximum((along**2).sum(1), 1e-300)
        t = np.clip(((point - begin) * along).sum(1) / length, 0.0, 1.0)
        away = np.hypot(*(begin + t[:, None] * along - point).T)
        return float(away.min()), int(away.argmin())

    def passes(self, point: Array, root: complex, normal: Array, within: float) -> bool:
        """Whether a critical point lies on this curve.

        Parameters
        ----------
        point, normal : ndarray, shape (2,)
            Shares of the axes, and the unit vector towards instability there.
        root : complex
            1/s.
        within : float
            Distance in shares of the axes.
        """
        away, k = self.distance(point)
        if away > within:
            return False
        near = [k, min(k + 1, len(self) - 1)]
        omega = np.sort(np.abs(self.roots[near].imag))
        room = 0.05 * (omega[1] + abs(root.imag)) + 1e-6 * self.sizes[k] + (omega[1] - omega[0])
        alike = omega[0] - room <= abs(root.imag) <= omega[1] + room
        return bool(alike and max(self.normals[near] @ normal) > 0)
