"""Many bicycles at many speeds as descriptor systems with numbers, and how they answer a harmonic input."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tyre.base.arrays import Array, Complex


@dataclass(frozen=True)
class DescriptorStack:
    """E x' = F x + B u, y = C x of m bicycles at k speeds; the states are those of the model over ``scale``.

    Attributes
    ----------
    mass, dynamics : ndarray, shape (m, k, n, n)
        E and F.
    input : ndarray, shape (m, k, n, inputs)
        B.
    output : ndarray, shape (m, k, outputs, n)
        C.
    """

    mass: Array
    dynamics: Array
    input: Array
    output: Array

    def with_feedback(self, *, input: int, output: int, gain: Array) -> "DescriptorStack":
        """The same with an input that answers an output, u = gain y.

        Parameters
        ----------
        input, output : int
            Column of B, row of C.
        gain : ndarray, shape (m, 1) or (m, k)
            SI unit of the input over that of the output.
        """
        push, seen = self.input[..., :, None, input], self.output[..., None, output, :]
        return replace(self, dynamics=self.dynamics + gain[..., None, None] * push * seen)

    def frequency_response(self, angular_frequency: Array, *, inputs: Sequence[int], outputs: Sequence[int]) -> Complex:
        """Gain C (i omega E - F)^-1 B.

        Parameters
        ----------
        angular_frequency : ndarray, shape (f,)
            omega, rad/s.
        inputs, outputs : sequence of int
            Columns of B, rows of C.

        Returns
        -------
        ndarray of complex, shape (m, k, f, outputs, inputs)
            Without the direct gain that some outputs have.
        """
        pencil = 1j * angular_frequency[:, None, None] * self.mass[:, :, None] - self.dynamics[:, :, None]
        states = np.linalg.solve(pencil, self.input[:, :, None][..., list(inputs)] + 0j)
        return np.asarray(self.output[:, :, None, list(outputs)] @ states)
