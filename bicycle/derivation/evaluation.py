"""From symbols to numbers: one fast function per set of effects, kept in memory, for one bicycle or for many."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, ClassVar, Protocol

import numpy as np
import sympy as sp

from bicycle.derivation.builder import SPEED, ModelBuilder
from bicycle.derivation.closing import SymbolicModel
from bicycle.derivation.declarations import Mode
from bicycle.derivation.mistakes import applying
from bicycle.derivation.straight_line import compiled
from bicycle.speed_polynomial import SpeedPolynomial
from tyre.base.arrays import Array

POLYNOMIALS = {
    "dynamics": ("states", "states"), "input_matrix": ("states", "inputs"), "output_matrix": ("outputs", "states"),
    "feedthrough": ("outputs", "inputs"),
}  # fmt: skip
"""What depends on the speed, with what its rows and columns are."""


@dataclass(frozen=True)
class Matrices:
    """Numbers of E x' = F(v) x + B(v) u, y = C(v) x + D(v) u for parameters of any common shape ``(...)``.

    Attributes
    ----------
    mass : ndarray, shape (..., n, n)
        E.
    dynamics, input_matrix, output_matrix, feedthrough : SpeedPolynomial
        F (..., n, n), B (..., n, inputs), C (..., outputs, n) and D (..., outputs, inputs).
    static_loads : ndarray, shape (..., 2)
        N, rear first.
    """

    mass: Array
    dynamics: SpeedPolynomial
    input_matrix: SpeedPolynomial
    output_matrix: SpeedPolynomial
    feedthrough: SpeedPolynomial
    static_loads: Array


class Evaluator:
    """Evaluates the matrices of one symbolic model; made once per effect set by :func:`evaluator`."""

    def __init__(self, symbolic: SymbolicModel) -> None:
        self.symbolic = symbolic
        self._arguments = [_symbol(name) for name in symbolic.parameters] + list(symbolic.switches)
        self._blocks: list[tuple[str, int, tuple[int, int], list[tuple[int, int]]]] = []
        entries: list[Any] = []
        for kind, power, matrix in self._symbolic_blocks():
            places = [(i, j) for i in range(matrix.rows) for j in range(matrix.cols) if matrix[i, j] != 0]
            self._blocks.append((kind, power, matrix.shape, places))
            entries += [matrix[place] for place in places]
        self._entries = entries
        self._function = compiled(self._arguments, entries)
        self.switch_function = compiled(list(map(_symbol, symbolic.parameters)), list(symbolic.switches.values()))

    def __call__(self, values: Mapping[str, Any], indicators: tuple[Any, ...] = ()) -> Matrices:
        """Evaluate the matrices.

        Parameters
        ----------
        values : mapping of str to array_like
            Every parameter of the model (more do no harm) -> number or array, SI; the shapes broadcast.
        indicators : tuple of array_like
            For each switch of the equations 1 below its speed and 0 above; shapes that broadcast too.
        """
        return self._filled(self._function, values, indicators)

    def switch_speeds(self, values: Mapping[str, float]) -> tuple[float, ...]:
        """Speeds (m/s) at which the equations change, in the order of the indicators.

        Parameters
        ----------
        values : mapping of str to float
            Every parameter of the model, SI.
        """
        return tuple(float(s) for s in self.switch_function(*(values[name] for name in self.symbolic.parameters)))

    def lift_off_speed(self, values: Mapping[str, float]) -> float:
        """Speed (m/s) above which the front contact would have to pull, infinite where no load moves with speed.

        Parameters
        ----------
        values : mapping of str to float
            Every parameter of the model, SI.
        """
        transfer = self.symbolic.load_transfer.subs(SPEED, 1)  # drag-like: proportional to v^2
        if transfer == 0:
            return math.inf
        front, per_speed = (
            float(expression.subs({_symbol(name): value for name, value in values.items()}))
            for expression in (self.symbolic.static_loads[1], transfer)
        )
        return math.sqrt(front / per_speed) if per_speed > 0 else math.inf

    def derivative(self, key: str, values: Mapping[str, Any], indicators: tuple[Any, ...] = ()) -> Matrices:
        """Derivative of every matrix with respect to the parameter ``key`` (SI units per unit of the parameter).

        Parameters
        ----------
        key : str
            Of the parameter.
        values, indicators : mapping, tuple
            As in a call.
        """
        return self._filled(self._derivatives(key), values, indicators)

    @cached_property
    def _derivative_cache(self) -> dict[str, Any]:
        return {}

    @cached_property
    def _symbols_of_entries(self) -> list[set[Any]]:
        return [entry.free_symbols for entry in self._entries]

    def _derivatives(self, key: str) -> Any:
        if key not in self._derivative_cache:
            symbol = _symbol(key)
            slopes = [
                sp.diff(entry, symbol) if symbol in symbols else sp.S.Zero
                for entry, symbols in zip(self._entries, self._symbols_of_entries, strict=True)
            ]
            self._derivative_cache[key] = compiled(self._arguments, slopes)
        return self._derivative_cache[key]

    def _symbolic_blocks(self) -> list[tuple[str, int, Any]]:
        model = self.symbolic
        blocks = [("mass", 0, model.mass), ("static_loads", 0, sp.Matrix([list(model.static_loads)]))]
        for kind in POLYNOMIALS:
            blocks += [(kind, power, matrix) for power, matrix in getattr(model, kind).coefficients.items()]
        return blocks

    def _filled(self, function: Any, values: Mapping[str, Any], indicators: tuple[Any, ...]) -> Matrices:
        arguments = [np.asarray(values[name], float) for name in self.symbolic.parameters]
        arguments += [np.asarray(value, float) for value in indicators]
        shape = np.broadcast_shapes(*{a.shape for a in arguments})
        if all(a.size == 1 for a in arguments):
            arguments = [a[(0,) * a.ndim] for a in arguments]  # arithmetic of single numbers costs a fifth
        return self._fill(function(*arguments), shape)

    def _fill(self, numbers: list[Any], shape: tuple[int, ...]) -> Matrices:
        single: dict[str, Array] = {}
        coefficients: dict[str, dict[int, Array]] = {kind: {} for kind in POLYNOMIALS}
        position = 0
        for kind, power, (rows, columns), places in self._blocks:
            matrix = np.zeros((*shape, rows, columns))
            for i, j in places:
                matrix[..., i, j] = numbers[position]
                position += 1
            if kind in coefficients:
                coefficients[kind][power] = matrix
            else:
                single[kind] = matrix
        sizes = {kind: len(getattr(self.symbolic, kind)) for kind in ("states", "inputs", "outputs")}
        polynomials = {
            kind: SpeedPolynomial(coefficients[kind], shape=(*shape, sizes[rows], sizes[columns]))
            for kind, (rows, columns) in POLYNOMIALS.items()
        }
        return Matrices(single["mass"], **polynomials, static_loads=single["static_loads"][..., 0, :])


def _symbol(name: str) -> Any:
    return sp.Symbol(name, real=True)


class Contribution(Protocol):
    """What a derivation takes: a kind of thing that adds itself, with symbols for its parameters, to a model.

    ``modes`` are those that it brings.
    """

    modes: ClassVar[tuple[Mode, ...]]

    @classmethod
    def symbolic(cls) -> "Contribution":
        """The thing with a symbol for every parameter."""

    def apply(self, model: ModelBuilder) -> None:
        """Add it to the open model.

        Parameters
        ----------
        model : ModelBuilder
        """


def derive(effects: tuple[type[Contribution], ...]) -> SymbolicModel:
    """Derive the model of a set of effects; exactly one of them must be a contact law (checked by the caller).

    Parameters
    ----------
    effects : tuple of type
        Classes of the effects, each once.
    """
    model = ModelBuilder()
    for effect in effects:
        with applying(effect):
            effect.symbolic().apply(model)
        for mode in effect.modes:
            model.add_mode(mode)
    return model.close()


@cache
def evaluator(effects: tuple[type[Contribution], ...]) -> Evaluator:
    """The evaluator of a set of effects: derived at the first call (0.02 to 0.1 s), then kept in memory.

    Parameters
    ----------
    effects : tuple of type
        Classes of the effects, each once.
    """
    return Evaluator(derive(effects))
