"""Many bicycles at many speeds as descriptor systems with numbers, and how they answer a harmonic input."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bicycle.equations.speed_polynomial import SpeedPolynomial
from tyre.ground.arrays import Array, Complex


@dataclass(frozen=True)
class DescriptorPolynomial:
    """E x' = F(v) x + B(v) u, y = C(v) x of m bicycles; the states are those of the model over ``scale``."""

    mass: Array  # (m, 1, n, n), E; (m, k, n, n) if the equations switch: each of k speeds has its own coefficients
    dynamics: SpeedPolynomial  # F (m, 1 or k, n, n)
    input: SpeedPolynomial  # B (m, 1 or k, n, inputs)
    output: SpeedPolynomial  # C (m, 1 or k, outputs, n)

    def __call__(self, speeds: Array) -> "DescriptorStack":
        """The matrices at ``speeds`` (m, k), m/s; where equations switch, those for which the coefficients are."""
        dynamics = self.dynamics(speeds)
        return DescriptorStack(
            np.broadcast_to(self.mass, dynamics.shape), dynamics, self.input(speeds), self.output(speeds)
        )

    def with_feedback(self, *, input: int, output: int, gain: Array) -> "DescriptorPolynomial":
        """Close the loop: an input (column of B) that answers an output (row of C), u = gain y; gain (m, 1) in SI."""
        dynamics = dict(self.dynamics)
        for pushed, b in self.input.items():
            for output_power, c in self.output.items():
                more = gain[..., None, None] * b[..., :, None, input] * c[..., None, output, :]
                dynamics[pushed + output_power] = dynamics.get(pushed + output_power, 0.0) + more
        return replace(self, dynamics=SpeedPolynomial(dynamics, shape=self.dynamics.shape))

    def take(self, bicycles: slice) -> "DescriptorPolynomial":
        """Take the ``bicycles`` of a slice of their numbers."""
        parts = (part.take(bicycles) for part in (self.dynamics, self.input, self.output))
        return DescriptorPolynomial(self.mass[bicycles], *parts)


@dataclass(frozen=True)
class DescriptorStack:
    """E x' = F x + B u, y = C x of m bicycles at k speeds; the states are those of the model over ``scale``."""

    mass: Array  # (m, k, n, n), E
    dynamics: Array  # (m, k, n, n), F
    input: Array  # (m, k, n, inputs), B
    output: Array  # (m, k, outputs, n), C

    def frequency_response(self, angular_frequency: Array, *, inputs: Sequence[int], outputs: Sequence[int]) -> Complex:
        """Gain C (i omega E - F)^-1 B (m, k, f, outputs, inputs), SI, at ``angular_frequency`` (f,), rad/s."""
        pencil = 1j * angular_frequency[:, None, None] * self.mass[:, :, None] - self.dynamics[:, :, None]
        states = np.linalg.solve(pencil, self.input[:, :, None][..., list(inputs)] + 0j)
        return np.asarray(self.output[:, :, None, list(outputs)] @ states)

    def responses_about_the_first(
        self, angular_frequency: Array, *, inputs: Sequence[int], outputs: Sequence[int]
    ) -> Complex:
        """:meth:`frequency_response` of bicycles that hardly differ from the first, to first order in what differs.

        With the pencil P = i omega E - F and H = C P^-1 B, dH = dC P^-1 B + C P^-1 (dB + (dF - i omega dE) P^-1 B): one
        system is solved where all would be.
        """
        if len(self.mass) == 1:
            return self.frequency_response(angular_frequency, inputs=inputs, outputs=outputs)
        c, b = self.output[:, :, list(outputs)], self.input[..., list(inputs)]
        w = 1j * angular_frequency[:, None, None]
        pencil = w * self.mass[0, :, None] - self.dynamics[0, :, None]  # (k, f, n, n)
        right = np.linalg.solve(pencil, b[0, :, None] + 0j)
        left = np.linalg.solve(pencil.swapaxes(-1, -2), c[0, :, None].swapaxes(-1, -2) + 0j).swapaxes(-1, -2)
        responses = np.repeat((c[0, :, None] @ right)[None], len(self.mass), 0)
        # left (dF - i omega dE) right: the changes of all bicycles times what stands about each of their entries
        about = left.transpose(0, 3, 1, 2)[:, :, None, ..., None] * right.transpose(0, 2, 1, 3)[:, None, ..., None, :]
        speeds, n, _, *answers = about.shape  # (k, n, n, f, outputs, inputs)
        for part, entries in ((self.dynamics, about), (self.mass, -w * about)):
            change = (part[1:] - part[0]).swapaxes(0, 1).reshape(speeds, -1, n * n)
            more = change @ entries.reshape(speeds, n * n, -1)
            responses[1:] += more.reshape(speeds, -1, *answers).swapaxes(0, 1)
        if (change := c[1:] - c[0]).any():
            responses[1:] += change[:, :, None] @ right
        if (change := b[1:] - b[0]).any():
            responses[1:] += left @ change[:, :, None]
        return responses
