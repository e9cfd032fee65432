"""A matrix of expressions that is a Laurent polynomial in the forward speed, from v^-1 to v^2.

With numbers it is a :class:`bicycle.speed_polynomial.SpeedPolynomial`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

POWERS = (-1, 0, 1, 2)


@dataclass(frozen=True)
class SymbolicPolynomial:
    """``coefficients[k]`` is the symbolic matrix of v^k; powers that do not occur are absent."""

    coefficients: Mapping[int, Any]

    @classmethod
    def of_linear(cls, rows: Any, variables: Sequence[Any], speed: Any) -> "SymbolicPolynomial":
        """Coefficients of ``rows`` of expressions, linear in ``variables`` and a Laurent polynomial in ``speed``.

        ``rows`` has shape (r,) and ``variables`` (c,), so that each coefficient has shape (r, c); ``speed`` is the
        symbol of v, m/s.

        Parameters
        ----------
        rows : matrix of expressions
        variables : sequence of symbols
            What the rows are linear in.
        speed : symbol
            v, m/s.

        Raises
        ------
        ValueError
            An expression holds another power of the speed: an effect that the model cannot represent.
        """
        matrices = {power: sp.zeros(len(rows), len(variables)) for power in POWERS}
        for i, row in enumerate(rows):
            for j, variable in enumerate(variables):
                slope = sp.diff(row, variable)
                if slope == 0:
                    continue
                for power, coefficient in _powers(slope, speed).items():
                    if power not in matrices:
                        raise ValueError(f"row {i} depends on speed^{power}; the model holds v^-1 to v^2")
                    matrices[power][i, j] = coefficient
        return cls({power: matrix for power, matrix in matrices.items() if not matrix.is_zero_matrix})


def _powers(expression: Any, speed: Any) -> dict[int, Any]:
    if not expression.has(speed):
        return {0: expression}
    expanded = sp.expand(expression)
    found: dict[int, Any] = {}
    for term in sp.Add.make_args(expanded):
        rest, power = term.as_independent(speed)
        exponent = int(sp.degree(power * speed**9, speed)) - 9 if power != 1 else 0
        found[exponent] = found.get(exponent, sp.S.Zero) + rest
    return {power: coefficient for power, coefficient in found.items() if coefficient != 0}
