"""Symbolic expressions as polynomials in the speed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import product
from typing import Any, ClassVar

from tyre.ground.door import library
from tyre.ground.errors import InputError

sp = library("sympy")

Expression = Any  # sympy.Expr; the library carries no types
Matrix = Any  # sympy.Matrix


@dataclass(frozen=True)
class SymbolicPolynomial:
    """``coefficients[k]`` is the symbolic matrix of v^k, of ``shape`` (rows, columns); zero ones are absent."""

    coefficients: Mapping[int, Matrix]  # power of v -> matrix of ``shape``
    shape: tuple[int, int]  # rows, columns
    _op_priority: ClassVar[float] = 100.0  # sympy leaves the product of a matrix and a polynomial to this class

    @classmethod
    def of_matrix(cls, matrix: Matrix) -> "SymbolicPolynomial":
        """A matrix that does not depend on v, as a polynomial."""
        return cls({0: matrix}, matrix.shape)

    @classmethod
    def of_entries(cls, matrix: Matrix, speed: Expression) -> "SymbolicPolynomial":
        """A matrix whose entries depend on v."""
        coefficients: dict[int, Matrix] = {}
        for place, entry in matrix.iter_items():
            for power, coefficient in powers(entry, speed).items():
                coefficients.setdefault(power, sp.zeros(*matrix.shape))[place] = coefficient
        return _without_zeros(coefficients, matrix.shape)

    @classmethod
    def of_linear(
        cls, rows: Sequence[Expression], variables: Sequence[Expression], speed: Expression
    ) -> "SymbolicPolynomial":
        """Coefficients of ``rows`` of expressions, linear in ``variables`` and a Laurent polynomial in ``speed``."""
        moving = set(variables)
        slopes = sp.zeros(len(rows), len(variables))
        for i, row in enumerate(map(sp.sympify, rows)):
            occurring = row.free_symbols & moving
            for j, variable in enumerate(variables):
                if variable not in occurring:
                    continue
                slopes[i, j] = slope = sp.S.One if row == variable else sp.diff(row, variable)
                if slope.free_symbols & moving:
                    raise InputError(
                        f"an effect adds {row}, which is not linear in {str(variable)!r}; give its linearisation for "
                        "small motions"
                    )
        return cls.of_entries(slopes, speed)

    @property
    def constant(self) -> Matrix:
        """The matrix of v^0."""
        return self.coefficients.get(0, sp.zeros(*self.shape))

    def __add__(self, other: "SymbolicPolynomial") -> "SymbolicPolynomial":
        total = dict(self.coefficients)
        for power, matrix in other.coefficients.items():
            total[power] = total[power] + matrix if power in total else matrix
        return _without_zeros(total, self.shape)

    def __neg__(self) -> "SymbolicPolynomial":
        return SymbolicPolynomial({power: -matrix for power, matrix in self.coefficients.items()}, self.shape)

    def __sub__(self, other: "SymbolicPolynomial") -> "SymbolicPolynomial":
        return self + -other

    def __matmul__(self, other: "SymbolicPolynomial | Matrix") -> "SymbolicPolynomial":
        right = other if isinstance(other, SymbolicPolynomial) else SymbolicPolynomial.of_matrix(other)
        total = SymbolicPolynomial({}, (self.shape[0], right.shape[1]))
        for (k, first), (m, second) in product(self.coefficients.items(), right.coefficients.items()):
            total += SymbolicPolynomial({k + m: _times(first, second)}, total.shape)
        return total

    def __rmatmul__(self, matrix: Matrix) -> "SymbolicPolynomial":
        """A matrix that does not depend on v times this polynomial."""
        return SymbolicPolynomial.of_matrix(matrix) @ self

    def times_speed(self) -> "SymbolicPolynomial":
        """Times v."""
        return SymbolicPolynomial({power + 1: matrix for power, matrix in self.coefficients.items()}, self.shape)

    def slope(self) -> "SymbolicPolynomial":
        """Derivative with respect to v."""
        parts = {power - 1: power * matrix for power, matrix in self.coefficients.items() if power != 0}
        return SymbolicPolynomial(parts, self.shape)

    def xreplace(self, meaning: Mapping[Expression, Expression]) -> "SymbolicPolynomial":
        """With other expressions for some symbols."""
        return SymbolicPolynomial({k: matrix.xreplace(meaning) for k, matrix in self.coefficients.items()}, self.shape)

    def columns(self, chosen: slice) -> "SymbolicPolynomial":
        """Some of the columns."""
        width = len(range(*chosen.indices(self.shape[1])))
        parts = {power: matrix[:, chosen] for power, matrix in self.coefficients.items()}
        return _without_zeros(parts, (self.shape[0], width))

    def place_columns(self, start: int, width: int) -> "SymbolicPolynomial":
        """Columns put among zero ones, of ``width`` in all."""
        rows, columns = self.shape
        before, behind = sp.zeros(rows, start), sp.zeros(rows, width - start - columns)
        wide = {power: sp.Matrix.hstack(before, matrix, behind) for power, matrix in self.coefficients.items()}
        return SymbolicPolynomial(wide, (rows, width))

    def stack_above(self, lower: "SymbolicPolynomial") -> "SymbolicPolynomial":
        """Own rows, then those of another polynomial."""
        exponents = sorted({*self.coefficients, *lower.coefficients})
        parts = {k: [of.coefficients.get(k, sp.zeros(*of.shape)) for of in (self, lower)] for k in exponents}
        stacked = {power: sp.Matrix.vstack(*pair) for power, pair in parts.items()}
        return SymbolicPolynomial(stacked, (self.shape[0] + lower.shape[0], self.shape[1]))


def powers(expression: Expression, speed: Expression) -> dict[int, Expression]:
    """Coefficients of a Laurent polynomial in the speed: power -> expression without it, zero ones left out."""
    if speed not in expression.free_symbols:
        return {0: expression} if expression != 0 else {}
    base, exponent = expression.as_base_exp()
    if expression.is_Add:
        terms = [powers(term, speed) for term in expression.args]
        return _nonzero({k: sp.Add(*(term[k] for term in terms if k in term)) for k in sorted(set().union(*terms))})
    if expression.is_Mul or (base.is_Add and exponent.is_Integer and exponent > 0):
        factors = expression.args if expression.is_Mul else (base,) * int(exponent)
        return reduce(_product, (powers(factor, speed) for factor in factors))
    if base == speed and exponent.is_Integer:
        return {int(exponent): sp.S.One}
    expanded = sp.expand(expression)
    if expanded == expression:
        raise InputError(f"an effect depends on the speed as {expression} does; equations hold whole powers of it only")
    return powers(expanded, speed)


def _product(left: dict[int, Expression], right: dict[int, Expression]) -> dict[int, Expression]:
    terms: dict[int, list[Expression]] = {}
    for (k, a), (m, b) in product(left.items(), right.items()):
        terms.setdefault(k + m, []).append(a * b)
    return _nonzero({k: sp.Add(*terms[k]) for k in sorted(terms)})


def _nonzero(coefficients: dict[int, Expression]) -> dict[int, Expression]:
    """Without terms that vanish; above v^1, also without those that vanish when multiplied out."""
    return {k: c for k, c in coefficients.items() if c != 0 and (k in (0, 1) or sp.expand(c) != 0)}


def _times(left: Matrix, right: Matrix) -> Matrix:
    """The product of sparse matrices; sympy's own looks for infinite entries, which takes most of its time."""
    rows: dict[int, list[tuple[int, Expression]]] = {}
    for (k, j), entry in right.iter_items():
        rows.setdefault(k, []).append((j, entry))
    terms: dict[tuple[int, int], list[Expression]] = {}
    for (i, k), factor in left.iter_items():
        for j, entry in rows.get(k, []):
            terms.setdefault((i, j), []).append(factor * entry)
    result = sp.zeros(left.rows, right.cols)
    for place, addends in terms.items():
        result[place] = sp.Add(*addends)
    return result


def _without_zeros(coefficients: Mapping[int, Matrix], shape: tuple[int, int]) -> SymbolicPolynomial:
    nonzero = {
        power: coefficients[power]
        for power in sorted(coefficients)
        if any(True for _ in coefficients[power].iter_items())
    }
    return SymbolicPolynomial(nonzero, shape)
