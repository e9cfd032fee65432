"""Initial states of runs, which nobody recorded: they enter linearly, have a wide normal prior and are integrated out.

With the whitened free responses Phi S = U s V', the residual is multiplied by
(I + Phi S^2 Phi')^-1/2 = I + U (1/sqrt(1 + s^2) - 1) U', which is exact.
"""

from typing import NamedTuple

import numpy as np

from studies.missing_effect.motion.family import Family
from studies.missing_effect.motion.history_noise import LARGEST_SIGNAL
from tyre.base.arrays import Array

START = {"rad/s": 3.0, "m/s": 2.0, "N": 0.3, "N m": 0.1, "rad": 0.5}
"""Prior sd of an initial state by its unit, of forces and moments in weights and weights times m; of others 1."""

JOINT_START = {"rad/s": 0.5, "rad": 0.05}
"""The same of an elastic joint, which gives way by a fraction of the lean (rad/s, rad); wider would veil a new mode."""


class Marginal(NamedTuple):
    """R runs with their initial states integrated out, rows of zeros where a run is shorter than the longest.

    Whitened residual (R, C T), left vectors U (R, C T, k), gains 1/sqrt(1 + s^2) - 1 (R, k), the most probable
    initial states (R, n + ...), right vectors V (R, m, k) and singular values s (R, k).
    """

    residual: Array
    left: Array
    gain: Array
    start: Array
    right: Array
    singular: Array

    def without(self, white: Array) -> Array:
        """What marginalising leaves of ``white`` columns (R, C T, columns)."""
        rest = self.left @ (self.gain[:, :, None] * (self.left.swapaxes(-1, -2) @ white))
        rest += white
        return rest

    def follows(self, white: Array) -> Array:
        """How the most probable starts (R, m, columns), in prior sd, move with ``white`` columns (R, C T, columns)."""
        share = (self.singular / (1 + self.singular**2))[..., None]
        return self.right @ (share * (self.left.swapaxes(-1, -2) @ white))

    @property
    def spread(self) -> Array:
        """Root of the covariance of the starts after the data, in prior sd (R, m, m)."""
        return np.eye(self.right.shape[1]) + (self.right * self.gain[:, None, :]) @ self.right.swapaxes(-1, -2)


def integrated_out(phi: Array, white: Array) -> Marginal:
    """The runs without what their initial states explain.

    Parameters
    ----------
    phi : ndarray, shape (R, C T, m)
        Whitened free responses to starts of one prior sd.
    white : ndarray, shape (R, C T, 1)
        Whitened residual.

    Returns
    -------
    Marginal
        Its starts (R, m) in prior sd; nothing but NaN where a trial bicycle has fallen.
    """
    if not (np.abs(phi).max() < LARGEST_SIGNAL and np.abs(white).max() < LARGEST_SIGNAL):  # or not a number
        nothing = np.full((*phi.shape[:2], 1), np.nan)
        wide, one = np.zeros((len(phi), phi.shape[-1])), np.zeros((len(phi), 1))
        return Marginal(nothing[..., 0], nothing, one, wide, wide[..., None], one)
    u, s, vt = np.linalg.svd(phi, full_matrices=False)
    found = Marginal(white[..., 0], u, 1 / np.sqrt(1 + s**2) - 1, white[:, 0], vt.swapaxes(-1, -2), s)
    return found._replace(residual=found.without(white)[..., 0], start=found.follows(white)[..., 0])


def start_sd(family: Family) -> Array:
    """Prior sd (n,) of the initial states of a ``family`` of models, in the units of their states."""
    weight = sum(family.base.bicycle.static_loads)
    found = []
    for state, unit in zip(family.symbolic.declared.states, family.models.scale, strict=True):
        sd = (JOINT_START if state.joint else START).get(state.unit, 1.0)
        found.append(sd * (weight if state.forcelike else 1.0) / unit)
    return np.array(found)
