"""From expressions to one function of numpy arrays: straight-line code in which every subexpression is computed once.

>>> import sympy as sp
>>> x, y = sp.symbols("x y")
>>> compiled([x, y], [(x + y) ** 2, 1 - (x + y) / y])(3.0, 1.0)
[16.0, -3.0]
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from itertools import combinations
from typing import Any

import numpy as np
import sympy as sp

from tyre.base.errors import InputError

Expression = Any  # sympy.Expr; the library carries no types
Function = Callable[..., Any]
PLAIN = {sp.sin: np.sin, sp.cos: np.cos}  # of every steer axis
LONG = 200  # characters of an operation that gets a line of its own


def compiled(arguments: Sequence[Expression], results: Sequence[Expression]) -> Function:
    """A function of numbers or arrays that broadcast, which returns the list of the results.

    ``sympy.lambdify`` with ``cse`` gives the same function and takes ten times as long to look for what is common.

    Parameters
    ----------
    arguments : sequence of symbols
        In the order of the function's arguments.
    results : sequence of expressions
        In terms of the arguments only.

    Raises
    ------
    InputError
        A result holds another symbol.
    """
    code = _StraightLine(arguments)
    returned = [code.name(sp.sympify(result)) for result in results]
    text = "\n    ".join([f"def function({', '.join(code.arguments)}):", *code.body(returned)])
    exec(compile(text, "<equations of motion>", "exec"), code.functions)
    function: Function = code.functions["function"]
    return function


class _StraightLine:
    """Operations such as ``a3*x2``: sums, products and whole powers; all else is left to sympy."""

    def __init__(self, arguments: Sequence[Expression]) -> None:
        self.arguments = [f"a{k}" for k in range(len(arguments))]
        self.functions: dict[str, Any] = {}
        self._names: dict[Expression, str] = dict(zip(arguments, self.arguments, strict=True))
        self._operations: dict[tuple[str, ...], str] = {}  # format and operands -> name of the result

    def name(self, expression: Expression) -> str:
        """What stands for an expression: a number, or the name of the result of an operation."""
        if expression not in self._names:
            self._names[expression] = self._new(expression)
        return self._names[expression]

    def body(self, returned: Sequence[str]) -> Iterator[str]:
        """Lines of the function; what is used once stands where it is used, so that no memory is kept for it."""
        uses = Counter(operand for _, *operands in self._operations for operand in operands) + Counter(returned)
        short: dict[str, str] = {}
        for (form, *operands), name in self._operations.items():
            text = form.format(*(short.get(operand, operand) for operand in operands))
            if uses[name] == 1 and len(text) < LONG:
                short[name] = f"({text})"
            else:
                yield f"{name} = {text}"
        yield f"return [{', '.join(short.get(name, name) for name in returned)}]"

    def _new(self, expression: Expression) -> str:
        if expression.is_number:
            return f"float('{float(expression)!r}')" if expression.is_infinite else f"({float(expression)!r})"
        if expression.is_Symbol:
            raise InputError(
                f"an effect puts {str(expression)!r} where only parameters of bicycle and effects may stand: "
                "speed, motion and symbols of its own must not"
            )
        if expression.is_Add:
            return self._sum(expression)
        if expression.is_Mul:
            return self._product(expression)
        if expression.is_Pow and expression.exp.is_Integer:
            if expression.exp < 0:
                return self._operation("1.0/{}", self.name(1 / expression))
            return self._combined("{}*{}", [self.name(expression.base)] * int(expression.exp))
        return self._call(expression)

    def _sum(self, expression: Expression) -> str:
        taken = [self.name(-term) for term in expression.args if _negative(term)]
        given = [self.name(term) for term in expression.args if not _negative(term)]
        if not given:
            return self._operation("-{}", self._combined("{}+{}", taken))
        total = self._combined("{}+{}", given)
        return self._operation("{}-{}", total, self._combined("{}+{}", taken)) if taken else total

    def _product(self, expression: Expression) -> str:
        if _negative(expression):
            return self._operation("-{}", self.name(-expression))
        return self._combined("{}*{}", [self.name(factor) for factor in expression.args])

    def _call(self, expression: Expression) -> str:
        """A function that sympy makes of anything else, a sine or a case distinction."""
        parts = expression.args if all(isinstance(part, sp.Expr) for part in expression.args) else ()
        inputs = [part for part in parts if not part.is_number] or sorted(expression.free_symbols, key=str)
        places = {part: sp.Symbol(f"x{k}", real=True) for k, part in enumerate(inputs)}
        plain = expression.func(*(places.get(part, part) for part in parts)) if parts else expression.xreplace(places)
        function = f"f{len(self.functions)}"
        self.functions[function] = PLAIN.get(plain.func) or _by_sympy(tuple(places.values()), plain)
        return self._operation(f"{function}({', '.join(['{}'] * len(inputs))})", *map(self.name, inputs))

    def _combined(self, form: str, names: list[str]) -> str:
        """Sum or product, two at a time: first two whose sum or product is there already."""
        while len(names) > 1:
            pairs = [(min(pair), max(pair)) for pair in combinations(names, 2)]
            one, other = next((pair for pair in pairs if (form, *pair) in self._operations), pairs[0])
            names.remove(one)
            names.remove(other)
            names.append(self._operation(form, one, other))
        return names[0]

    def _operation(self, form: str, *operands: str) -> str:
        return self._operations.setdefault((form, *operands), f"x{len(self._operations)}")


@cache
def _by_sympy(arguments: tuple[Expression, ...], expression: Expression) -> Function:
    function: Function = sp.lambdify(arguments, expression, modules="numpy")
    return function


def _negative(term: Expression) -> bool:
    return bool(term.as_coeff_Mul()[0].is_negative)
