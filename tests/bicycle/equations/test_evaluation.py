"""The code that is written for expressions: the same numbers as sympy's own evaluation, nothing computed twice."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from bicycle.equations import compile_expressions
from tyre.ground import InputError

X, Y, Z = SYMBOLS = sp.symbols("x y z", real=True)
LEAVES = st.sampled_from([*SYMBOLS, sp.Integer(-2), sp.Rational(1, 3), sp.Float(0.7), sp.pi])


def larger(parts):
    """Sums, products, powers and functions of smaller expressions, none of which is singular near 1."""
    return st.one_of(
        st.lists(parts, min_size=2, max_size=5).map(lambda terms: sp.Add(*terms)),
        st.lists(parts, min_size=2, max_size=5).map(lambda factors: sp.Mul(*factors)),
        st.tuples(parts, st.sampled_from([1, 2, 3])).map(lambda pair: pair[0] ** pair[1]),
        parts.map(lambda part: 1 / (part**2 + 1)), parts.map(lambda part: sp.sqrt(part**2 + 2)), parts.map(sp.sin),
        st.tuples(parts, parts).map(lambda pair: sp.Max(*pair)),
    )  # fmt: skip


@given(
    results=st.lists(st.recursive(LEAVES, larger, max_leaves=12), max_size=4),
    values=st.tuples(*[st.floats(0.5, 1.5)] * 3),
)
def test_numbers_are_those_of_sympy(results, values):
    found = compile_expressions(SYMBOLS, results)(*values)
    expected = [float(sp.sympify(result).evalf(30, subs=dict(zip(SYMBOLS, values, strict=True)))) for result in results]
    size = [float(bound(result, values)) for result in results]
    assert all(abs(one - other) <= 1e-13 * of for one, other, of in zip(found, expected, size, strict=True))


def bound(expression, values):
    """The same with every term taken positive: what rounding is relative to."""
    if expression.is_Add:
        return sum(bound(term, values) for term in expression.args)
    if expression.is_Mul:
        return math.prod(bound(factor, values) for factor in expression.args)
    if expression.is_Pow and expression.exp.is_Integer and expression.exp > 0:
        return bound(expression.base, values) ** int(expression.exp)
    inner = sum(
        bound(part, values) for part in expression.args if part.free_symbols
    )  # slopes of the others are below 1
    return inner + abs(float(expression.evalf(subs=dict(zip(SYMBOLS, values, strict=True)))))


@pytest.mark.parametrize(("expression", "value"), [
    (sp.Piecewise((X, X > 2), (Y, True)), 3.0),
    (sp.Piecewise((X, X * Y > 7), (Y * Z, True)), 15.0),
    (abs(Y - Z), 2.0),
    (X**-2, 0.25),
    (-X - Y, -5.0),
    (-X * Y / Z, -1.2),
    (1 / (X - Y), -1.0),
    (sp.sqrt(X + sp.Integer(7)), 3.0),
    (Z ** sp.Rational(-1, 2), 5**-0.5),
    (sp.atan2(X - 1, Y - 2), math.pi / 4),
    (sp.sin(1), math.sin(1)),
    (sp.oo, math.inf),
    (-sp.oo, -math.inf),
    (sp.S.Zero, 0.0),
    (sp.sqrt(2) * X, 2 * math.sqrt(2)),
])  # fmt: skip
def test_other_expressions(expression, value):
    (found,) = compile_expressions(SYMBOLS, [expression])(2.0, 3.0, 5.0)
    assert found == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("expression", "slopes"),  # along x, y and z at 2, 3 and 5, by hand
    [
        (sp.Piecewise((X**2, X * Y > 7), (Y * Z, True)), (0.0, 5.0, 3.0)),
        (X**3 * Y - Z, (36.0, 8.0, -1.0)),
        (-X * Y / Z, (-0.6, -0.4, 0.24)),
        (1 / (X - Y), (-1.0, 1.0, 0.0)),
        (sp.sqrt(X + 7) * sp.cos(Y), (math.cos(3) / 6, -3 * math.sin(3), 0.0)),
        (sp.atan2(X - 1, Y - 2) + sp.sin(X * Z), (0.5 + 5 * math.cos(10), -0.5, 2 * math.cos(10))),
        (sp.Integer(4), (0.0, 0.0, 0.0)),
    ],
)
def test_slopes(expression, slopes):
    function = compile_expressions(SYMBOLS, [expression, X])
    found = [function.slopes(symbol)(2.0, 3.0, 5.0) for symbol in SYMBOLS]
    assert [one for one, _ in found] == pytest.approx(slopes, rel=1e-14)
    assert [one for _, one in found] == [1.0, 0.0, 0.0]
    assert function(2.0, 3.0, 5.0)[1] == 2.0  # and it stays the function


def test_arrays_broadcast_and_no_results_are_an_empty_list():
    rows, columns = np.array([[1.0], [2.0]]), np.array([3.0, 4.0, 5.0])
    (found,) = compile_expressions([X, Y], [X * Y + sp.cos(X - X * 1.0)])(rows, columns)
    np.testing.assert_allclose(found, rows * columns + 1)
    assert compile_expressions([X], [])(1.0) == []


def test_a_symbol_that_is_no_argument_is_refused():
    with pytest.raises(InputError, match="an effect puts 'z' where only parameters of bicycle and effects may stand"):
        compile_expressions([X, Y], [X * Y + Z])
