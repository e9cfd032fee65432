"""The base model with candidates built in: state matrices for a whole batch of parameter vectors at once."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bicycle.derivation.evaluation import Evaluator, evaluator
from bicycle.model import Model, state_scale
from studies.inference.parameter import Candidate, UncertainParameter
from tyre.base.arrays import Array

SPEED_SCALE = "measurement.speed_scale"  # true speed over recorded speed, minus 1
FEEDBACK = "feedback."  # feedback.OUTPUT.INPUT: a phenomenological torque proportional to an output


@dataclass(frozen=True)
class Descriptor:
    """E x' = F x + B u, y = C x for K parameter vectors and S speeds; forces in the fixed unit of the model."""

    mass: Array  # (K, S, n, n)
    dynamics: Array  # (K, S, n, n)
    input: Array  # (K, S, n, inputs)
    output: Array  # (K, S, outputs, n)

    def slope(self, steps: Array) -> "Descriptor":
        """Derivatives (p, S, ...) of a batch made by :meth:`Family.stencil`."""
        p, h = len(steps), 2 * steps[:, None, None, None]
        return Descriptor(*((part[1 : p + 1] - part[p + 1 :]) / h for part in vars(self).values()))


@dataclass(frozen=True)
class Family:
    """All models that differ in the numbers of the nuisances and of some candidates."""

    base: Model
    nuisances: tuple[UncertainParameter, ...]
    candidates: tuple[Candidate, ...] = ()

    @cached_property
    def unknowns(self) -> tuple[UncertainParameter, ...]:
        """Nuisances, then the unknowns of the candidates."""
        return (*self.nuisances, *(u for candidate in self.candidates for u in candidate.unknowns))

    @cached_property
    def evaluate(self) -> Evaluator:
        """The evaluator of this set of effects."""
        gone = {candidate.replaces for candidate in self.candidates}
        kinds = [type(effect) for effect in self.base.effects if effect.identifier not in gone]
        kinds += [candidate.effect for candidate in self.candidates if candidate.effect is not None]
        return evaluator(tuple(sorted(kinds, key=lambda effect: effect.identifier)))

    @cached_property
    def _fixed(self) -> Mapping[str, float]:
        values = dict(self.base.parameters)
        for candidate in self.candidates:
            values |= candidate.fixed
        return values

    @cached_property
    def state_scale(self) -> Array:
        return state_scale(self.evaluate.symbolic.declared.states, sum(self.base.bicycle.static_loads))

    def values(self, theta: Array) -> dict[str, Array]:
        """Every parameter for coordinates (K, unknowns), arrays (K, 1)."""
        values = {key: np.full((len(theta), 1), value) for key, value in self._fixed.items()}
        for column, u in enumerate(self.unknowns):
            value = u.value(theta[:, column, None])
            values |= {key: factor * value for key, factor in u.sets.items()}
        for candidate in self.candidates:
            values |= {key: values[source] for key, source in candidate.ties.items()}
        return values

    def __call__(self, theta: Array, speeds: Array) -> Descriptor:
        """Matrices for coordinates (K, unknowns) at recorded speeds (S,) in m/s."""
        values = self.values(theta)
        v = speeds * (1.0 + values.get(SPEED_SCALE, np.zeros((len(theta), 1))))
        names = self.evaluate.symbolic.parameters
        switch = self.evaluate.switch_function(*(values[name] for name in names))
        matrices = self.evaluate(values, tuple((v <= speed).astype(float) for speed in switch))

        def at(polynomial: Mapping[int, Array]) -> Array:
            total: Array = np.zeros(1)
            for power, matrix in polynomial.items():
                total = total + (np.power(v, float(power))[..., None, None] * matrix if power else matrix)
            return np.broadcast_to(total, (*v.shape, *total.shape[2:]))

        mass, dynamics = matrices.mass * self.state_scale, at(matrices.dynamics) * self.state_scale
        inputs, outputs = at(matrices.input_matrix), at(matrices.output_matrix) * self.state_scale
        for key in values:
            if key.startswith(FEEDBACK):
                seen, torque = key.removeprefix(FEEDBACK).split(".")
                b = inputs[..., self.evaluate.symbolic.inputs.index(torque)]
                c = outputs[..., self.evaluate.symbolic.outputs.index(seen), :]
                dynamics = dynamics + values[key][..., None, None] * b[..., :, None] * c[..., None, :]
        return Descriptor(np.broadcast_to(mass, dynamics.shape), dynamics, inputs, outputs)

    def stencil(self, theta: Array) -> tuple[Array, Array]:
        """Batch [theta, theta + h_k, theta - h_k ...] (2 p + 1, p) and the steps h (p,)."""
        steps = np.array([u.step(x) for u, x in zip(self.unknowns, theta, strict=True)])
        shift = np.diag(steps)
        return np.vstack([theta[None], theta + shift, theta - shift]), steps
