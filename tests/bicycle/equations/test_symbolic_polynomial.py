"""Polynomials in the speed: split without expanding, multiplied as their values are."""

import pytest
import sympy as sp

from bicycle.equations import SymbolicPolynomial, powers
from tyre.ground import InputError

V, A, B, X, Y = sp.symbols("v a b x y", real=True)


@pytest.mark.parametrize("expression", [
    A, V, A / V, (V - A) ** 2, (V - A) * (V + A) / V, A * V**2 / 2 + B * V - 3, ((V + 1) * A + V * B) * (B - V),
    (A + B) * V**2 - A * (V**2 + 1), (V * (A + 1)) ** 3 / V**2, sp.sqrt(A) * V, (2 * A) ** 2 / (V * B),
])  # fmt: skip
def test_the_powers_add_up_to_the_expression(expression):
    found = powers(expression, V)
    assert sp.expand(sum(coefficient * V**power for power, coefficient in found.items()) - expression) == 0
    assert all(V not in coefficient.free_symbols and coefficient != 0 for coefficient in found.values())


def test_powers_that_cancel_are_not_there():
    """The rest of v^-1 would make a model singular at rest, that of v^3 refuse it."""
    assert powers((A + B) / V - A / V - B / V + V, V) == {1: 1}
    assert powers((V - A) * V**2 - V**3 + B * A * V**2 + V**2 * (A - A * B), V) == {}
    assert powers(sp.S.Zero, V) == {}


@pytest.mark.parametrize("expression", [sp.sqrt(V), sp.sin(V), 1 / (V + A), abs(V), V**A])
def test_other_functions_of_the_speed_are_refused(expression):
    with pytest.raises(InputError, match="an effect depends on the speed as .*v.* does; equations hold whole powers"):
        powers(expression, V)


def test_what_is_not_linear_is_refused():
    assert SymbolicPolynomial.of_linear([A * X * V + Y], [X, Y], V).coefficients == {
        0: sp.Matrix([[0, 1]]),
        1: sp.Matrix([[A, 0]]),
    }
    for row in (X * Y, A * X**2, sp.sin(X)):
        with pytest.raises(InputError, match=r"an effect adds .*, which is not linear in 'x'; give its linearisation"):
            SymbolicPolynomial.of_linear([row], [X, Y], V)


def value(polynomial):
    """The matrix in terms of v."""
    return sum((matrix * V**power for power, matrix in polynomial.coefficients.items()), sp.zeros(*polynomial.shape))


def test_operations_are_those_of_the_values():
    one = SymbolicPolynomial.of_entries(sp.Matrix([[A * V, 0, 1 / V], [B, V**2, 0]]), V)
    other = SymbolicPolynomial.of_entries(sp.Matrix([[1, A], [B * V, 0], [0, V]]), V)
    constant = sp.Matrix([[A, B], [0, 1]])
    for found, expected in (
        (one @ other, value(one) * value(other)),
        (constant @ one, constant * value(one)),
        (other @ constant, value(other) * constant),
        (other.stack_above(one.columns(slice(1, None))), sp.Matrix.vstack(value(other), value(one)[:, 1:])),
        (one - one, sp.zeros(2, 3)),
        (-one + one.times_speed(), (V - 1) * value(one)),
        (one.place_columns(1, 5), sp.Matrix.hstack(sp.zeros(2, 1), value(one), sp.zeros(2, 1))),
        (one.xreplace({A: B**2}), value(one).xreplace({A: B**2})),
    ):
        assert found.shape == expected.shape
        assert (value(found) - expected).expand() == sp.zeros(*expected.shape)
    assert (one - one).coefficients == {}
    assert list((one @ other).coefficients) == [0, 1, 3]
    assert one.constant == sp.Matrix([[0, 0, 0], [B, 0, 0]])
