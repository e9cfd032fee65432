"""One model with many numbers: arrays of parameters become stacked matrices, and flat numbers become a model again.

>>> from bicycle import Model, load_bicycle
>>> family = ModelFamily(Model(load_bicycle("benchmark")), ("c", "mB"))
>>> family.state_matrices({"c": [0.06, 0.08, 0.1]}, [[4.0, 5.0]]).shape
(3, 2, 4, 4)
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bicycle.effects.effect import Effect, effect_of
from bicycle.equations.evaluation import Evaluator, Matrices, evaluator
from bicycle.equations.speed_polynomial import SpeedPolynomial
from bicycle.model.descriptor import DescriptorPolynomial
from bicycle.model.eigen import positive_definite
from bicycle.model.model import Model, linear_model, state_scale
from bicycle.model.state_space import LinearModel
from bicycle.parameters.bicycle import UNITS
from bicycle.parameters.parameter_covariance import entries_of
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, unknown


@dataclass(frozen=True, eq=False)
class ModelFamily:
    """All models that differ from one in numbers.

    Attributes
    ----------
    model : Model
        What does not vary.
    keys : tuple of str
        What does: keys of the bicycle, ``effect.name`` for both wheels, or ``effect.name.wheel``. Functions here take
        numbers for any of them; empty: for every parameter.
    further : tuple of effect classes
        Effects added to those of the model, without numbers: these must come with every call. One in a slot (the
        contact law) takes the place of the model's.

    Raises
    ------
    InputError
        A key is no parameter of these models.
    """

    model: Model
    keys: tuple[str, ...] = ()
    further: tuple[type[Effect], ...] = ()

    def __post_init__(self) -> None:
        for key in self.keys:
            self.entries(key)

    @cached_property
    def kinds(self) -> tuple[type[Effect], ...]:
        """Classes of the effects, by identifier."""
        slots = {kind.slot for kind in self.further if kind.slot is not None}
        own_kinds = (type(effect) for effect in self.model.effects if effect.slot not in slots)
        return tuple(sorted((*own_kinds, *self.further), key=lambda kind: kind.identifier))

    @cached_property
    def evaluate(self) -> Evaluator:
        """The function that turns parameters into matrices."""
        return evaluator(self.kinds)

    @cached_property
    def base(self) -> dict[str, float]:
        """Every parameter of the model, SI."""
        return self.model.parameters

    @cached_property
    def scale(self) -> Array:
        """Fixed powers of two (n,), as of a :class:`bicycle.model.state_space.LinearModel`."""
        return np.asarray(state_scale(self.evaluate.symbolic.declared.states, sum(self.model.bicycle.static_loads)))

    @cached_property
    def _known(self) -> frozenset[str]:
        further_names = (
            f"{kind.identifier}.{entry}" for kind in self.further for p in kind.parameters for entry in p.entries()
        )
        return frozenset({*self.base, *further_names})

    @cached_property
    def _tied(self) -> dict[str, str]:
        return self.model.tied

    def entries(self, key: str) -> tuple[str, ...]:
        """Parameters that ``key`` stands for: itself, or rear and front of a parameter per wheel."""
        entries = entries_of(key, self._known)
        if not entries:
            names = self._known | {f"{kind.identifier}.{p.name}" for kind in self.kinds for p in kind.parameters}
            raise InputError(unknown("parameter", key, names))
        return entries

    def values(self, numbers: Mapping[str, Any]) -> dict[str, Any]:
        """Every parameter, with what follows another parameter of its own accord.

        Parameters
        ----------
        numbers : mapping of str to array_like
            Key -> number or array, SI; all other parameters are those of the model. An effect's parameter that equals
            a bicycle parameter because none was given still equals it, unless it is among the numbers.
        """
        by_entry = {entry: number for key, number in numbers.items() for entry in self.entries(key)}
        tied = {
            entry: by_entry[leader]
            for entry, leader in self._tied.items()
            if entry not in by_entry and leader in by_entry
        }
        return {**self.base, **by_entry, **tied}

    def with_values(self, numbers: Mapping[str, float]) -> Model:
        """The model with these numbers, checked like any other.

        Parameters
        ----------
        numbers : mapping of str to float
            Key -> number, SI; all other parameters keep theirs.

        Raises
        ------
        InputError
            A number that bicycle or effect does not allow.
        """
        values = self.values(numbers)
        bicycle = self.model.bicycle
        changed = {key: values[key] for key in UNITS if values[key] != self.base[key]}
        if changed:
            bicycle = bicycle.replace(**changed, allow_unusual=True)
        effects = tuple(self.effect_with(effect, values) for effect in self.model.effects)
        return replace(self.model, bicycle=bicycle, effects=effects)

    def effect_with(self, effect: Effect, values: Mapping[str, float]) -> Effect:
        """The ``effect`` with numbers ``values`` (SI); what it takes from the bicycle stays so where both are equal."""
        tied = {follower for follower, leader in self._tied.items() if values[follower] == values[leader]}
        free = [p.name for p in effect.parameters if not all(f"{effect.identifier}.{e}" in tied for e in p.entries())]
        return effect_of(type(effect), values, free)

    def linear_model(self, values: Mapping[str, float]) -> LinearModel:
        """The linear model of the parameters ``values`` (SI), without the checks of bicycle and effects."""
        return linear_model(self.evaluate, values, self.model)

    def polynomials(self, numbers: Mapping[str, Any], count: int) -> tuple[SpeedPolynomial, NDArray[np.bool_]]:
        """Scaled state matrices of ``count`` bicycles as a polynomial in v, and which of them are impossible.

        The ``numbers``, shape () or (count,), are as in :meth:`values`; the equations must not switch at a speed.
        """
        matrices = self.evaluate(self.values(numbers))
        n = len(self.scale)
        mass = np.broadcast_to(matrices.mass, (count, n, n))
        parts = tuple(np.broadcast_to(matrix, (count, n, n)) for matrix in matrices.dynamics.values())
        impossible = ~positive_definite(mass)
        mass = np.where(impossible[:, None, None], np.eye(n), mass)
        right = np.concatenate([part * self.scale for part in parts], -1)
        solved = np.stack(np.split(np.linalg.solve(mass, right) / self.scale[:, None], len(parts), axis=-1))
        return SpeedPolynomial(dict(zip(matrices.dynamics, solved, strict=True)), shape=(count, n, n)), impossible

    def state_matrices(self, numbers: Mapping[str, Any], speeds: ArrayLike) -> Array:
        """Scaled state matrices of bicycles at speeds, whether or not the equations switch in between.

        Parameters
        ----------
        numbers : mapping of str to array_like, shape () or (m,)
            As in :meth:`values`.
        speeds : array_like, shape (m, k) or (1, k)
            m/s.

        Returns
        -------
        ndarray, shape (m, k, n, n)

        Raises
        ------
        InputError
            A mass matrix that is not positive definite, naming one of the numbers.
        """
        v = np.asarray(speeds, float)
        count = int(np.broadcast_shapes(v.shape[:1], *(np.shape(number) for number in numbers.values()))[0])
        if not self.evaluate.symbolic.switches:
            polynomial, impossible = self.polynomials(numbers, count)
            self._refuse(numbers, impossible)
            return np.array(np.broadcast_to(polynomial(v), (count, v.shape[1], *polynomial.shape[1:])))
        self._refuse(numbers, self.without_mass(numbers, count))
        columns = {key: np.reshape(np.broadcast_to(number, count), (count, 1)) for key, number in numbers.items()}
        v = np.broadcast_to(v, (count, v.shape[1]))
        system = self.descriptor(self.values(columns), v)(v)
        return np.asarray(np.linalg.solve(system.mass, system.dynamics))

    def _refuse(self, numbers: Mapping[str, Any], impossible: NDArray[np.bool_]) -> None:
        if impossible.any():
            key, values = next(iter(numbers.items()))
            first = np.broadcast_to(values, impossible.shape)[impossible][0]
            raise InputError(f"{key} = {first:g}: the mass matrix is not positive definite; take another range")

    def without_mass(self, numbers: Mapping[str, Any], count: int) -> NDArray[np.bool_]:
        """Bicycles (``count``,) with ``numbers`` as in :meth:`values` whose mass matrix is not positive definite."""
        with np.errstate(all="ignore"):
            mass = self.evaluate(self.values(numbers), (0.0,) * len(self.evaluate.symbolic.switches)).mass
        mass = np.broadcast_to(mass, (count, *mass.shape[-2:]))
        finite = np.asarray(np.isfinite(mass).all((-2, -1)))
        return ~positive_definite(np.where(finite[:, None, None], mass, np.eye(mass.shape[-1]))) | ~finite

    def descriptor(self, values: Mapping[str, Any], speeds: Array) -> DescriptorPolynomial:
        """Matrices of bicycles as polynomials in v, where equations switch those that hold at ``speeds`` (m, k).

        The ``values``, shape () or (m, 1), are those of every parameter that enters the equations.
        """
        symbolic = self.evaluate.symbolic
        switches = self.evaluate.switch_function(*(values[name] for name in symbolic.parameters))
        matrices: Matrices = self.evaluate(values, tuple((speeds <= switch).astype(float) for switch in switches))
        return DescriptorPolynomial(
            matrices.mass * self.scale,
            matrices.dynamics * self.scale,
            matrices.input_matrix,
            matrices.output_matrix * self.scale,
        )
