"""What a mode looks like: lean, steer, yaw, lateral motion and further joints as phasors."""

from dataclasses import dataclass

import numpy as np

from bicycle.eigenvalues.decomposition import eigensystem
from bicycle.linear_model import LinearModel
from tyre.base.arrays import Array, Complex

COMPONENTS = ("lean", "steer", "yaw", "lateral")


@dataclass(frozen=True)
class ModeShape:
    """Phasors (m, n) of ``components`` at m speeds: lean, steer, yaw (rad), lateral displacement of the rear contact
    (m) and the model's further joint angles (rad).

    The largest angle has magnitude 1, lean has phase 0; NaN where the mode is not there.
    """

    phasors: Complex
    components: tuple[str, ...] = COMPONENTS

    @property
    def magnitude(self) -> dict[str, Array]:
        """Component -> (m,), rad or m for 1 rad of the largest angle."""
        sizes = np.abs(self.phasors)
        largest = np.delete(sizes, 3, axis=1).max(1, keepdims=True)  # 1 but for the rounding of the phasors
        return dict(zip(self.components, (sizes / largest).T, strict=True))

    @property
    def phase(self) -> dict[str, Array]:
        """Component -> (m,), rad, ahead of lean."""
        return dict(zip(self.components, np.angle(self.phasors).T, strict=True))


def mode_shape(model: LinearModel, speeds: Array, eigenvalues: Complex) -> ModeShape:
    """Shapes of the modes with ``eigenvalues`` (m,) at ``speeds`` (m,).

    Yaw and lateral displacement are integrals of the model's yaw rate r and lateral velocity V of the rear contact:
    psi = r / lambda and y = (V + v psi) / lambda.

    Parameters
    ----------
    model : LinearModel
    speeds : ndarray, shape (m,)
        m/s.
    eigenvalues : complex ndarray, shape (m,)
        1/s, NaN where there is no such mode.
    """
    joints = tuple(s for s in model.states if f"{s}_rate" in model.states and s not in ("lean", "steer"))
    phasors = np.full((len(speeds), 4 + len(joints)), np.nan, complex)
    rows = [model.outputs.index(name) for name in ("lean", "steer", "yaw_rate", "rear_lateral_velocity", *joints)]
    there = np.flatnonzero(~np.isnan(eigenvalues))
    for number, places in model.by_range(speeds[there]):
        k = there[places]
        v, root = speeds[k], eigenvalues[k, None]
        values, vectors, _ = eigensystem(model.state_matrix(v))
        nearest = np.abs(values - root).argmin(1)
        states = model.scale * np.take_along_axis(vectors, nearest[:, None, None], 2)[..., 0]
        outputs = (model.ranges[number].matrices.output_matrix(v)[:, rows] @ states[..., None])[..., 0]
        lean, steer, yaw_rate, lateral, *further = outputs.T[..., None]
        with np.errstate(divide="ignore", invalid="ignore"):  # a root at exactly zero: a steady turn without end
            shape = np.hstack(
                [lean * root**2, steer * root**2, yaw_rate * root, lateral * root + v[:, None] * yaw_rate]
                + [angle * root**2 for angle in further]
            )
            angles = np.abs(np.delete(shape, 3, axis=1)).max(1, keepdims=True)
            phase = np.where(shape[:, :1] == 0, 1, shape[:, :1] / np.abs(shape[:, :1]))
            phasors[k] = shape / (angles * phase)
    return ModeShape(phasors, (*COMPONENTS, *joints))
