"""Expressions that are linear in the motion, as rows: what is a port of a wheel or of the motor gets its meaning."""

from collections.abc import Mapping, Sequence
from typing import Any

from bicycle.derivation.symbolic_polynomial import SymbolicPolynomial
from tyre.base.errors import InputError

Expression = Any  # sympy.Expr; the library carries no types


class Rows:
    """Reads expressions: a column for each of ``known``, motion and inputs, of which all the rest is made.

    Parameters
    ----------
    known : sequence of symbols
        Motion and inputs.
    meaning : mapping of symbol to expression
        Slip velocity, camber ... of the wheels and the motor's command, in terms of what is known and of each other.
    loads : mapping of symbol to expression
        Static loads of the wheels, N, in terms of the parameters.
    speed : symbol
        v, m/s.

    Raises
    ------
    InputError
        What they mean goes round in a circle.
    """

    def __init__(
        self, known: Sequence[Expression], meaning: Mapping[Expression, Expression],
        loads: Mapping[Expression, Expression], speed: Expression,
    ) -> None:  # fmt: skip
        self.known, self.ports, self.loads, self.speed = list(known), list(meaning), dict(loads), speed
        self._meaning = self._resolved(list(meaning.values()))

    def of(self, expressions: Sequence[Expression]) -> SymbolicPolynomial:
        """Rows of expressions.

        Parameters
        ----------
        expressions : sequence of expressions
            In terms of what is known and of the ports, in which they are linear, of parameters and speed.
        """
        direct, through_ports = self._read(expressions)
        return direct + through_ports @ self._meaning

    def _read(self, expressions: Sequence[Expression]) -> tuple[SymbolicPolynomial, SymbolicPolynomial]:
        rows = SymbolicPolynomial.of_linear(expressions, [*self.known, *self.ports], self.speed).xreplace(self.loads)
        return rows.columns(slice(0, len(self.known))), rows.columns(slice(len(self.known), None))

    def _resolved(self, expressions: Sequence[Expression]) -> SymbolicPolynomial:
        """p = A x + B p, where no port depends on itself: p = A x + B A x + B B A x + ..."""
        direct, through_ports = self._read(expressions)
        total = term = direct
        for _ in self.ports:
            term = through_ports @ term
            total += term
        if term.coefficients:
            raise InputError("")
        return total
