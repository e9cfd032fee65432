"""Options of the form NAME=VALUE, given more than once."""

import math
from collections.abc import Sequence

from tyre.base.errors import InputError


def numbers_by_name(texts: Sequence[str], option: str, like: str) -> dict[str, float]:
    """Numbers >= 0 by name.

    Parameters
    ----------
    texts : sequence of str
        As given, ``NAME=VALUE`` each.
    option, like : str
        What the message calls them, and an example.

    Raises
    ------
    InputError
        Text of another form, a name given twice, or a number that is not finite and >= 0.
    """
    found: dict[str, float] = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            number = float(value)
        except ValueError:
            raise InputError(f"{option} {text}: give NAME=VALUE, for example {option} {like} (SI units)") from None
        if name in found:
            raise InputError(f"{option} {name} is given twice; keep one")
        if not 0 <= number < math.inf:
            raise InputError(f"{option} {text}: the number must be finite and >= 0")
        found[name] = number
    return found
