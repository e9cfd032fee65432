"""Expressions that are linear in motion and inputs, read as rows of a matrix."""

from collections.abc import Mapping, Sequence

from bicycle.equations.declarations import Expression
from bicycle.equations.symbolic_polynomial import SymbolicPolynomial
from tyre.ground.errors import InputError


class Rows:
    """Reads expressions: a column for each of ``variables``, motion and inputs, of which all the rest is made."""

    def __init__(
        self,
        variables: Sequence[Expression],
        meaning: Mapping[Expression, Expression],
        loads: Mapping[Expression, Expression],
        speed: Expression,
    ) -> None:
        self.variables, self.ports, self.loads, self.speed = list(variables), list(meaning), dict(loads), speed
        self._meaning = self._resolve_ports(list(meaning.values()))

    def coefficients(self, expressions: Sequence[Expression]) -> SymbolicPolynomial:
        """Rows of expressions."""
        direct, through_ports = self._read(expressions)
        return direct + through_ports @ self._meaning

    def _read(self, expressions: Sequence[Expression]) -> tuple[SymbolicPolynomial, SymbolicPolynomial]:
        rows = SymbolicPolynomial.of_linear(expressions, [*self.variables, *self.ports], self.speed).xreplace(
            self.loads
        )
        return rows.columns(slice(0, len(self.variables))), rows.columns(slice(len(self.variables), None))

    def _resolve_ports(self, expressions: Sequence[Expression]) -> SymbolicPolynomial:
        """p = A x + B p, put into itself until no port is left: p = (A + B A) x + B B p, and so on."""
        direct, through_ports = self._read(expressions)
        for _ in self.ports:
            if not through_ports.coefficients:
                return direct
            direct, through_ports = direct + through_ports @ direct, through_ports @ through_ports
        port = self.ports[next(next(iter(through_ports.coefficients.values())).iter_items())[0][0]]
        raise InputError(f"an effect makes the {port} depend on itself; leave it out of what it is made of")
