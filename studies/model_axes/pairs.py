"""Options of the form NAME=VALUE, given more than once."""

import math
from collections.abc import Sequence

from tyre.base.errors import InputError


def numbers_by_name(texts: Sequence[str], option: str, like: str, what: str = "number") -> dict[str, float]:
    """Numbers >= 0 by name.

    Parameters
    ----------
    texts : sequence of str
        As given, ``NAME=VALUE`` each.
    option, like, what : str
        What the message calls them, an example, and what the number is.

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
            raise InputError(f"{option} {text}: the {what} must be finite and >= 0")
        found[name] = number
    return found


def ranges_by_name(texts: Sequence[str], option: str = "--limits") -> dict[str, tuple[float, float]]:
    """Ranges by name.

    Parameters
    ----------
    texts : sequence of str
        As given, ``NAME=LOW:HIGH`` each.
    option : str
        What the message calls them.

    Raises
    ------
    InputError
        Text of another form, a name given twice, or a range that falls.
    """
    found: dict[str, tuple[float, float]] = {}
    for text in texts:
        name, _, rest = text.partition("=")
        try:
            low, high = (float(part) for part in rest.split(":"))
        except ValueError:
            raise InputError(f"{option} {text}: give NAME=LOW:HIGH, for example {option} c=0.03:0.1") from None
        if name in found:
            raise InputError(f"{option} {name} is given twice; keep one")
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise InputError(f"{option} {text}: the range must be finite and rise")
        found[name] = (low, high)
    return found
