"""Derived matrices as numbers, for one bicycle or for many."""

import math
import sys
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.equations.declarations import Expression
from bicycle.equations.lateral import ModelBuilder, SymbolicModel, speed_symbol
from bicycle.equations.speed_polynomial import SpeedPolynomial
from bicycle.equations.symbolic_polynomial import powers
from tyre.ground.arrays import Array
from tyre.ground.door import library
from tyre.ground.errors import InputError

sp = library("sympy")


def line_of(error: BaseException, path: Path) -> str:
    """``, line 8``: the last line of a file that an ``error`` passed; empty if it passed none."""
    calls = traceback.extract_tb(error.__traceback__)
    lines = [call.lineno for call in calls if Path(call.filename) == path.resolve()]
    return f", line {lines[-1]}" if lines else ""


Function = Callable[..., Any]


def compile_expressions(arguments: Sequence[Expression], results: Sequence[Expression]) -> "StraightLine":
    """A function of numbers or arrays that broadcast, which returns the list of the results."""
    expressions = [sp.sympify(result) for result in results]
    foreign = set().union(*(result.free_symbols for result in expressions)) - set(arguments)
    if foreign:
        raise InputError(
            f"an effect puts {min(map(str, foreign))!r} where only parameters of bicycle and effects may stand: "
            "speed, motion and symbols of its own must not"
        )
    return StraightLine(arguments, expressions)


class StraightLine:
    """A function as operations such as ``a3*x2``: sums, products and integer powers; sympy evaluates any other."""

    def __init__(self, arguments: Sequence[Expression], results: Sequence[Expression]) -> None:
        self.arguments = [f"a{k}" for k in range(len(arguments))]
        self.functions: dict[str, Any] = {}
        self._others: dict[str, tuple[list[Any], Any]] = {}  # what is left to sympy: its inputs, what it is of them
        self._names: dict[Expression, str] = dict(zip(arguments, self.arguments, strict=True))
        self._operations: dict[tuple[str, ...], str] = {}  # format and operands -> name of the result
        self._results = [self.name(result) for result in results]
        self._call_it = self._function(self._results)

    def __call__(self, *arguments: Any) -> Any:
        """Compute the results."""
        return self._call_it(*arguments)

    def slopes(self, argument: Expression) -> Function:
        """A function that returns the derivative of each result with respect to an argument, 0 if it does not occur."""
        operations = dict(self._operations)
        derivatives = {self._names[argument]: "1.0"} if argument in self._names else {}
        for (form, *operands), name in operations.items():
            terms = [
                self._product(self._slope(form, k, operands, name), derivatives[operand])
                for k, operand in enumerate(operands)
                if operand in derivatives
            ]
            if terms:
                derivatives[name] = self._combine("{}+{}", terms)
        function = self._function([derivatives.get(name, "0.0") for name in self._results])
        self._operations = operations
        return function

    def _slope(self, form: str, k: int, operands: list[str], name: str) -> str:
        """Name of the derivative of an operation with respect to its operand number ``k``."""
        if form == "{}*{}":
            return operands[1 - k]
        if form == "1.0/{}":
            return self._operation("-{}", self._product(name, name))
        if form in ("{}+{}", "{}-{}", "-{}"):
            return "-1.0" if form == "-{}" or (form, k) == ("{}-{}", 1) else "1.0"
        outer, _, inputs = form.partition("(")
        function = f"{outer}_{k}"
        if function not in self.functions:
            places, plain = self._others[outer]
            self.functions[function] = _numeric(places, sp.diff(plain, places[k]))
        return self._operation(f"{function}({inputs}", *operands)

    def _product(self, left: str, right: str) -> str:
        if "1.0" in (left, right):
            return right if left == "1.0" else left
        return self._operation("-{}", right) if left == "-1.0" else self._combine("{}*{}", [left, right])

    def _function(self, returned: Sequence[str]) -> Function:
        text = "\n    ".join([f"def function({', '.join(self.arguments)}):", *self.body(returned)])
        exec(compile(text, "<equations of motion>", "exec"), self.functions)
        function: Function = self.functions["function"]
        return function

    def name(self, expression: Expression) -> str:
        """Number, or name of the result of an operation, that stands for an expression."""
        if expression not in self._names:
            self._names[expression] = self._new(expression)
        return self._names[expression]

    def body(self, returned: Sequence[str]) -> Iterator[str]:
        """Lines of the function; what is used once is written where it is used, so that no memory is kept for it."""
        uses = Counter(returned)
        for (_, *operands), name in reversed(self._operations.items()):
            uses.update(operands if uses[name] else ())
        short: dict[str, str] = {}
        for (form, *operands), name in self._operations.items():
            if not uses[name]:
                continue
            text = form.format(*(short.get(operand, operand) for operand in operands))
            if uses[name] == 1 and len(text) < 200:
                short[name] = f"({text})"
            else:
                yield f"{name} = {text}"
        yield f"return [{', '.join(short.get(name, name) for name in returned)}]"

    def _new(self, expression: Expression) -> str:
        if expression.is_number:
            return f"float('{float(expression)!r}')" if expression.is_infinite else f"({float(expression)!r})"
        if expression.is_Add:
            subtracted = [self.name(-term) for term in expression.args if _negative(term)]
            added = [self.name(term) for term in expression.args if not _negative(term)]
            if not added:
                return self._operation("-{}", self._combine("{}+{}", subtracted))
            total = self._combine("{}+{}", added)
            return self._operation("{}-{}", total, self._combine("{}+{}", subtracted)) if subtracted else total
        if expression.is_Mul:
            if _negative(expression):
                return self._operation("-{}", self.name(-expression))
            return self._combine("{}*{}", [self.name(factor) for factor in expression.args])
        if expression.is_Pow and expression.exp.is_Integer:
            if expression.exp < 0:
                return self._operation("1.0/{}", self.name(1 / expression))
            return self._combine("{}*{}", [self.name(expression.base)] * int(expression.exp))
        return self._call(expression)

    def _call(self, expression: Expression) -> str:
        """A function that sympy makes of anything else, a sine or a case distinction."""
        parts = expression.args if all(isinstance(part, sp.Expr) for part in expression.args) else ()
        inputs = [part for part in parts if not part.is_number] or sorted(expression.free_symbols, key=str)
        places = {part: sp.Symbol(f"x{k}", real=True) for k, part in enumerate(inputs)}
        plain = expression.func(*(places.get(part, part) for part in parts)) if parts else expression.xreplace(places)
        function = f"f{len(self._others)}"
        self._others[function] = list(places.values()), plain
        self.functions[function] = _numeric(list(places.values()), plain)
        return self._operation(f"{function}({', '.join(['{}'] * len(inputs))})", *map(self.name, inputs))

    def _combine(self, form: str, names: list[str]) -> str:
        """Sum or product, two at a time: first two whose sum or product is there already."""
        while len(names) > 1:
            pairs = [(min(pair), max(pair)) for pair in combinations(names, 2)]
            left, right = next((pair for pair in pairs if (form, *pair) in self._operations), pairs[0])
            names.remove(left)
            names.remove(right)
            names.append(self._operation(form, left, right))
        return names[0]

    def _operation(self, form: str, *operands: str) -> str:
        return self._operations.setdefault((form, *operands), f"x{len(self._operations)}")


def _numeric(arguments: Sequence[Expression], result: Expression) -> Function:
    numpy_function = {sp.sin: np.sin, sp.cos: np.cos}.get(result.func)  # of every steer axis: lambdify takes its time
    return numpy_function or sp.lambdify(tuple(arguments), result, modules="numpy")


def _negative(term: Expression) -> bool:
    return bool(term.as_coeff_Mul()[0].is_negative)


POLYNOMIALS = {
    "dynamics": ("states", "states"), "input_matrix": ("states", "inputs"), "output_matrix": ("outputs", "states"),
    "feedthrough": ("outputs", "inputs"),
}  # fmt: skip
"""Matrices that depend on the speed, with what their rows and columns are."""


@dataclass(frozen=True)
class Matrices:
    """Numbers of E x' = F(v) x + B(v) u, y = C(v) x + D(v) u for parameters of any common shape ``(...)``."""

    mass: Array  # E (..., n, n)
    dynamics: SpeedPolynomial  # F (..., n, n)
    input_matrix: SpeedPolynomial  # B (..., n, inputs)
    output_matrix: SpeedPolynomial  # C (..., outputs, n)
    feedthrough: SpeedPolynomial  # D (..., outputs, inputs)
    static_loads: Array  # (..., 2), N, rear first


class Evaluator:
    """Evaluates the matrices of one symbolic model; made once per effect set by :func:`evaluator`."""

    def __init__(self, symbolic: SymbolicModel) -> None:
        self.symbolic = symbolic
        self._parameters = [_symbol(name) for name in symbolic.parameters]
        self._blocks: list[tuple[str, int, tuple[int, int], list[tuple[int, int]]]] = []
        entries: list[Any] = []
        blocks = [("mass", 0, symbolic.mass), ("static_loads", 0, sp.Matrix([list(symbolic.static_loads)]))]
        for kind in POLYNOMIALS:
            blocks += [(kind, power, matrix) for power, matrix in getattr(symbolic, kind).coefficients.items()]
        for kind, power, matrix in blocks:
            places = [(i, j) for i in range(matrix.rows) for j in range(matrix.cols) if matrix[i, j] != 0]
            self._blocks.append((kind, power, matrix.shape, places))
            entries += [matrix[place] for place in places]
        self._matrices = compile_expressions([*self._parameters, *symbolic.switches], entries)
        self._functions: dict[str, Function] = {}  # parameter -> its slopes
        self.switch_function = compile_expressions(self._parameters, list(symbolic.switches.values()))

    def __call__(self, values: Mapping[str, Any], indicators: tuple[Any, ...] = ()) -> Matrices:
        """Evaluate the matrices."""
        return self._fill(self._matrices, values, indicators)

    def switch_speeds(self, values: Mapping[str, float]) -> tuple[float, ...]:
        """Speeds (m/s) at which the equations change, in the order of the indicators."""
        return tuple(float(s) for s in self.switch_function(*(values[name] for name in self.symbolic.parameters)))

    @cached_property
    def _loads(self) -> Function:
        transfer = powers(sp.sympify(self.symbolic.load_transfer), speed_symbol())
        return compile_expressions(
            self._parameters, [*self.symbolic.static_loads, transfer.get(0, 0.0), transfer.get(2, 0.0)]
        )

    def wheel_loads(self, values: Mapping[str, Any]) -> tuple[Any, Any, Any]:
        """Loads of rear and front wheel at rest (N), and what moves to the rear per speed squared (kg/m)."""
        rear, front, transfer, per_speed = self._loads(*(values[name] for name in self.symbolic.parameters))
        return rear + transfer, front - transfer, per_speed

    def check_loads(self, values: Mapping[str, float]) -> None:
        """Refuse forces that lift a wheel at rest."""
        for wheel, load in zip(("rear", "front"), self.wheel_loads(values), strict=False):
            if not load > 0:
                raise InputError(
                    f"forces along the road lift the {wheel} wheel, whose load becomes {load:.4g} N; give smaller "
                    "forces of drive and brakes"
                )

    def lift_off_speed(self, values: Mapping[str, float]) -> float:
        """Speed (m/s) above which the front contact would have to pull, infinite if no load moves with speed."""
        _, front, per_speed = self.wheel_loads(values)
        return math.sqrt(front / per_speed) if per_speed > 0 else math.inf

    def derivative(self, key: str, values: Mapping[str, Any], indicators: tuple[Any, ...] = ()) -> Matrices:
        """Derivative of every matrix with respect to the parameter ``key`` (SI units per unit of the parameter)."""
        if key not in self._functions:
            self._functions[key] = self._matrices.slopes(_symbol(key))
        return self._fill(self._functions[key], values, indicators)

    def _fill(self, function: Any, values: Mapping[str, Any], indicators: tuple[Any, ...]) -> Matrices:
        arguments = [np.asarray(values[name], float) for name in self.symbolic.parameters]
        arguments += [np.asarray(value, float) for value in indicators]
        shape = np.broadcast_shapes(*{a.shape for a in arguments})
        if all(a.size == 1 for a in arguments):
            arguments = [a[(0,) * a.ndim] for a in arguments]  # arithmetic of single numbers costs a fifth
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):  # refused where it is used
            numbers = iter(function(*arguments))
        coefficients: dict[str, dict[int, Array]] = {kind: {} for kind in ("mass", "static_loads", *POLYNOMIALS)}
        for kind, power, (rows, columns), places in self._blocks:
            coefficients[kind][power] = matrix = np.zeros((*shape, rows, columns))
            for i, j in places:
                matrix[..., i, j] = next(numbers)
        sizes = {kind: len(getattr(self.symbolic, kind)) for kind in ("states", "inputs", "outputs")}
        polynomials = {
            kind: SpeedPolynomial(coefficients[kind], shape=(*shape, sizes[rows], sizes[columns]))
            for kind, (rows, columns) in POLYNOMIALS.items()
        }
        return Matrices(coefficients["mass"][0], **polynomials, static_loads=coefficients["static_loads"][0][..., 0, :])


def _symbol(name: str) -> Any:
    return sp.Symbol(name, real=True)


def derive(effects: tuple[type[Any], ...]) -> SymbolicModel:
    """Derive the model of a set of effects; exactly one of them must be a contact law (checked by the caller)."""
    model = ModelBuilder()
    for effect in sorted(effects, key=lambda kind: kind.rank):
        try:
            effect.symbolic().apply(model)
        except InputError:
            raise
        except Exception as error:
            file = getattr(sys.modules.get(effect.__module__), "__file__", None)
            if file is None or effect.__module__.startswith("bicycle."):  # a fault of velotyre keeps its traceback
                raise
            raise InputError(
                f"{file}{line_of(error, Path(file))}: effect {effect.identifier!r} cannot be added to the equations: "
                f"{type(error).__name__}: {error}; correct its apply (docs/effects.md shows one)"
            ) from error
        for mode in effect.modes:
            model.add_mode(mode)
    return model.close()


@cache
def evaluator(effects: tuple[type[Any], ...]) -> Evaluator:
    """The evaluator of a set of effects: derived at the first call (0.02 to 0.1 s), then kept in memory."""
    return Evaluator(derive(effects))
