"""Numbers as the report prints them."""

import math
from collections.abc import Sequence
from typing import Any, Protocol

from markupsafe import Markup

from studies.reporting.markdown_text import cell


class Measured(Protocol):
    """A number with its standard deviation, and that of the tyre data alone."""

    @property
    def value(self) -> float:
        """The number."""

    @property
    def sd(self) -> float:
        """Of all that is uncertain."""

    @property
    def tyre_sd(self) -> float:
        """Of the tyre data."""


def with_sd(number: Measured) -> str:
    """``24.8 ± 0.9``; where more than the tyre is uncertain, ``24.8 ± 1.2 (tyre 0.9)``, to the digits of the whole."""
    value, sd = shown_like(number.value, number.sd), shown_like(number.sd, number.sd)
    if number.tyre_sd == number.sd:
        return f"{value} ± {sd}"
    alone = shown_like(number.tyre_sd, number.sd)
    return f"{value} ± {sd} (tyre {alone if float(alone) else f'below {sd}'})"


def shown_like(value: float, sd: float) -> str:
    """A ``value`` with as many places as its ``sd`` deserves: one digit of it, two where that is a 1."""
    if not (math.isfinite(sd) and sd > 0):
        return f"{value:.4g}"
    power = math.floor(math.log10(sd))
    leading = round(sd / 10.0**power)
    if leading == 10:
        power, leading = power + 1, 1
    return f"{value:.{max(0, 1 - power if leading == 1 else -power)}f}"


def plain_range(values: Sequence[float], digits: str) -> str:
    """``low to high`` of ``values``, or one number where they print alike; ``digits`` is a format such as ``.2f``."""
    return _range([f"{value:{digits}}" for value in (min(values), max(values))])


def signed_range(values: Sequence[float], digits: str = ".3f") -> str:
    """``low to high`` of ``values`` with signs, or one number where they print alike; ``digits`` is a format."""
    return _range([signed(value, digits) for value in (min(values), max(values))])


def signed(value: Any, digits: str = "") -> str:
    """A ``value`` with its sign, and without one where it prints as zero; ``digits`` is a format such as ``.2f``."""
    text = f"{value:+{digits}}"
    return text if float(text) else text[1:]


def _range(ends: list[str]) -> str:
    return " to ".join(dict.fromkeys(ends))


def table(rows: list[list[str]], headers: list[str]) -> Markup:
    """A Markdown table of ``rows`` under ``headers``, what names say escaped."""
    from tabulate import tabulate

    escaped = [[cell(text) for text in row] for row in rows]
    return Markup(tabulate(escaped, headers=list(map(cell, headers)), tablefmt="github", disable_numparse=True))
