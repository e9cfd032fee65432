"""Charts of matrices that are written down: their boundaries are known curves."""

from types import SimpleNamespace

import numpy as np

from bicycle.model import eigensystem
from studies.chart import Look, Plane

STEP = 1e-6


class Toy(Plane):
    """A plane over the unit square with given matrices (m, n, n) as a function of points (m, 2)."""

    def __init__(self, matrices):
        self.given = matrices
        self.space = SimpleNamespace(linear=SimpleNamespace(parameters={"g": 9.81, "w": 1.0}))

    def look(self, shares):
        steps = STEP * np.eye(2)
        slopes = np.stack([(self.given(shares + h) - self.given(shares - h)) / (2 * STEP) for h in steps], 1)
        matrices = self.given(shares)
        values, right, left = eigensystem(matrices)
        gradients = np.stack([((left @ slopes[:, i]).swapaxes(1, 2) * right).sum(1) for i in (0, 1)], -1)
        return Look(values, gradients, matrices, slopes)

    def unstable(self, shares):
        return (np.linalg.eigvals(self.given(shares)).real > 1e-9).sum(1)


def blocks(*parts):
    """Matrices with given square blocks (m, k, k) on the diagonal, in coordinates that mix them."""
    size = sum(part.shape[-1] for part in parts)
    total, at = np.zeros((len(parts[0]), size, size)), 0
    for part in parts:
        k = part.shape[-1]
        total[:, at : at + k, at : at + k] = part
        at += k
    mix = np.eye(size) + np.tril(np.full((size, size), 0.3), -1)
    return mix @ total @ np.linalg.inv(mix)


def pair(real, frequency):
    """Blocks (m, 2, 2) with the roots real +- i frequency."""
    real, frequency = np.broadcast_arrays(real, np.asarray(frequency, float))
    return np.stack([np.stack([real, frequency], -1), np.stack([-frequency, real], -1)], -2)


def single(root):
    """Blocks (m, 1, 1) with a real root."""
    return np.asarray(root, float)[:, None, None]


def oscillator(damping, stiffness):
    """Blocks (m, 2, 2) of x'' + damping x' + stiffness x = 0."""
    damping, stiffness = np.broadcast_arrays(damping, np.asarray(stiffness, float))
    nothing = np.zeros_like(damping)
    return np.stack([np.stack([nothing, nothing + 1], -1), np.stack([-stiffness, -damping], -1)], -2)
