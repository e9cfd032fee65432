"""From expressions to one function of numpy arrays: straight-line code in which every subexpression is computed once.

>>> import sympy as sp
>>> x, y = sp.symbols("x y")
>>> compiled([x, y], [(x + y) ** 2, 1 - (x + y) / y])(3.0, 1.0)
[16.0, -3.0]
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import sympy as sp

Expression = Any  # sympy.Expr; the library carries no types
Function = Callable[..., Any]


def compiled(arguments: Sequence[Expression], results: Sequence[Expression]) -> Function:
    """A function of numbers or arrays that broadcast, which returns the list of the results.

    ``sympy.lambdify(..., cse=True)`` gives the same and takes ten times as long to look for what is common.

    Parameters
    ----------
    arguments : sequence of symbols
        In the order of the function's arguments.
    results : sequence of expressions
        In terms of the arguments only.
    """
    code = _StraightLine(arguments)
    returned = [code.name(sp.sympify(result)) for result in results]
    lines = [f"def function({', '.join(code.arguments)}):", *code.lines, f"return [{', '.join(returned)}]"]
    exec(compile("\n    ".join(lines), "<equations of motion>", "exec"), code.functions)
    function: Function = code.functions["function"]
    return function


class _StraightLine:
    """Lines such as ``x7 = a3*x2``. Sums, products and whole powers are written out, all else is left to sympy."""

    def __init__(self, arguments: Sequence[Expression]) -> None:
        self.arguments = [f"a{k}" for k in range(len(arguments))]
        self.lines: list[str] = []
        self.functions: dict[str, Any] = {}
        self._names: dict[Expression, str] = dict(zip(arguments, self.arguments, strict=True))

    def name(self, expression: Expression) -> str:
        """What stands for an expression: a number, or the variable of the line that computes it."""
        if expression not in self._names:
            if expression.is_Integer or expression.is_Rational or expression.is_Float:
                self._names[expression] = f"({float(expression)!r})"
            else:
                self._names[expression] = self._line(self._text(expression))
        return self._names[expression]

    def _line(self, text: str) -> str:
        self.lines.append(f"x{len(self.lines)} = {text}")
        return f"x{len(self.lines) - 1}"

    def _text(self, expression: Expression) -> str:
        if expression.is_Add:
            return self._sum(expression)
        if expression.is_Mul:
            return self._product(expression)
        if expression.is_Pow and expression.exp.is_Integer:
            if expression.exp < 0:
                return f"1.0/{self.name(1 / expression)}"
            return "*".join([self.name(expression.base)] * int(expression.exp))
        return self._call(expression)

    def _sum(self, expression: Expression) -> str:
        negative = [term for term in expression.args if term.as_coeff_Mul()[0].is_negative]
        if len(negative) == len(expression.args):
            return f"-{self.name(-expression)}"
        plus = "+".join(self.name(term) for term in expression.args if term not in negative)
        return "-".join([plus, *(self.name(-term) for term in negative)])

    def _product(self, expression: Expression) -> str:
        if expression.args[0] is sp.S.NegativeOne:
            return f"-{self.name(-expression)}"
        over = [factor for factor in expression.args if factor.is_Pow and factor.exp.is_negative]
        above = "*".join(self.name(factor) for factor in expression.args if factor not in over) or "1.0"
        return f"{above}/{self.name(1 / sp.Mul(*over))}" if over else above

    def _call(self, expression: Expression) -> str:
        """A call of the function that sympy makes of anything else, a sine or a case distinction."""
        parts = expression.args if all(isinstance(part, sp.Expr) for part in expression.args) else ()
        inputs = [part for part in parts if not part.is_number] or sorted(expression.free_symbols, key=str)
        places = {part: sp.Symbol(f"x{k}", real=True) for k, part in enumerate(inputs)}
        plain = expression.func(*(places.get(part, part) for part in parts)) if parts else expression.xreplace(places)
        function = f"f{len(self.functions)}"
        self.functions[function] = _by_sympy(tuple(places.values()), plain)
        return f"{function}({', '.join(map(self.name, inputs))})"


@cache
def _by_sympy(arguments: tuple[Expression, ...], expression: Expression) -> Function:
    function: Function = sp.lambdify(arguments, expression, modules="numpy")
    return function
