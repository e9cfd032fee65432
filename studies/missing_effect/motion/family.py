"""The base model with candidates built in: from the coordinates of a fit to parameters and matrices, in batches."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bicycle.derivation.closing import SymbolicModel
from bicycle.descriptor import DescriptorPolynomial, DescriptorStack
from bicycle.model import Model
from bicycle.model_family import ModelFamily
from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.motion.row_settings import Settings
from tyre.base.arrays import Array

SPEED_SCALE = "measurement.speed_scale"  # true speed over recorded speed, minus 1
SPEED_OFFSET = "measurement.speed_offset"  # true speed less what the scale makes of the recorded one, m/s
WRONG = "wrong."  # WRONG + key: what the key's stated value is too small by, whatever floats about it
SEEN = ("lean", "steer", "lean_rate", "steer_rate")
TORQUES = ("steer_torque", "lean_torque")


def feedback_key(seen: str, torque: str) -> str:
    """What the gain of a phenomenological torque called ``torque`` is called, proportional to the output ``seen``."""
    return f"feedback.{torque}_from_{seen}"


FEEDBACK = {feedback_key(seen, torque): (seen, torque) for seen in SEEN for torque in TORQUES}


@dataclass(frozen=True)
class Family:
    """All models that differ in the numbers of the nuisances and of some candidates.

    ``settings`` take the place of numbers of the base model.
    """

    base: Model
    nuisances: tuple[UncertainParameter, ...]
    candidates: tuple[Candidate, ...] = ()
    settings: Settings = ()

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        """What was kept for speed stays behind: compiled functions cannot be pickled."""
        return Family, (self.base, self.nuisances, self.candidates, self.settings)

    @cached_property
    def unknowns(self) -> tuple[UncertainParameter, ...]:
        """Nuisances, then the unknowns of the candidates."""
        return (*self.nuisances, *(u for candidate in self.candidates for u in candidate.unknowns))

    @cached_property
    def models(self) -> ModelFamily:
        """All models with these effects."""
        kinds = (candidate.effect for candidate in self.candidates)
        return ModelFamily(self.base, further=tuple(kind for kind in kinds if kind is not None))

    @property
    def symbolic(self) -> SymbolicModel:
        """Names of states, inputs and outputs."""
        return self.models.evaluate.symbolic

    @cached_property
    def _fixed(self) -> Mapping[str, float]:
        values = dict(self.base.parameters) | dict(self.settings)
        for candidate in self.candidates:
            values |= candidate.fixed
        return values

    @cached_property
    def _columns(self) -> dict[int, dict[str, Array]]:
        """What is fixed as arrays (K, 1), by K: never written to."""
        return {}

    def values(self, theta: Array) -> dict[str, Array]:
        """Every parameter for coordinates ``theta`` (K, unknowns), arrays (K, 1)."""
        count = len(theta)
        if count not in self._columns:
            self._columns[count] = {key: np.full((count, 1), value) for key, value in self._fixed.items()}
        values = dict(self._columns[count])
        for column, u in enumerate(self.unknowns):
            value = u.value(theta[:, column, None])
            values |= {key: factor * value for key, factor in u.sets.items()}
        for key in [key for key in values if key.startswith(WRONG)]:
            stated = key.removeprefix(WRONG)
            values[stated] = values[stated] + values[key]
        for candidate in self.candidates:
            values |= {key: values[source] for key, source in candidate.ties.items()}
        return values

    @staticmethod
    def true_speeds(values: Mapping[str, Array], speeds: Array) -> Array:
        """True speeds (K, S) for recorded ``speeds`` (S,), m/s, with ``values`` as of :meth:`values`."""
        nothing = np.zeros((len(next(iter(values.values()))), 1))
        return np.asarray(speeds * (1.0 + values.get(SPEED_SCALE, nothing)) + values.get(SPEED_OFFSET, nothing))

    def __call__(self, theta: Array, speeds: Array) -> DescriptorStack:
        """Matrices for coordinates ``theta`` (K, unknowns) at recorded ``speeds`` (S,) in m/s."""
        return self.system(self.values(theta), speeds)

    def system(self, values: Mapping[str, Array], speeds: Array) -> DescriptorStack:
        """Matrices for ``values`` as of :meth:`values` at recorded ``speeds`` (S,) in m/s."""
        true = self.true_speeds(values, speeds)
        return self.matrices(values, true)(true)

    def matrices(self, values: Mapping[str, Array], speeds: Array) -> DescriptorPolynomial:
        """Matrices for ``values`` as of :meth:`values` as polynomials, for true ``speeds`` (K, S) in m/s."""
        matrices = self.models.descriptor(values, speeds)
        for key, (seen, torque) in FEEDBACK.items():
            if key in values:
                column, row = self.symbolic.inputs.index(torque), self.symbolic.outputs.index(seen)
                matrices = matrices.with_feedback(input=column, output=row, gain=values[key])
        return matrices

    def stencil(self, theta: Array) -> tuple[Array, Array]:
        """Batch [theta, theta + h_k, theta - h_k ...] (2 p + 1, p) about ``theta`` (p,), and the steps h (p,)."""
        steps = np.array([u.step(x) for u, x in zip(self.unknowns, theta, strict=True)])
        shift = np.diag(steps)
        return np.vstack([theta[None], theta + shift, theta - shift]), steps
