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
        A port depends on itself.
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
        """p = A x + B p, put into itself until no port is left: p = (A + B A) x + B B p, and so on."""
        direct, through_ports = self._read(expressions)
        for _ in self.ports:
            if not through_ports.coefficients:
                return direct
            direct, through_ports = direct + through_ports @ direct, through_ports @ through_ports
        port = self.ports[next(next(iter(through_ports.coefficients.values())).iter_items())[0][0]]
        raise InputError(f"an effect makes the {port} depend on itself; leave it out of what it is made of")
