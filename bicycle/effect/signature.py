"""Signature and docstring of an effect from its declared parameters: what ``help()`` and editors show."""

import inspect
import math
from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import Any

from bicycle.effect.parameter import Parameter


@dataclass(frozen=True)
class Tied:
    """Default of a parameter that equals one of the bicycle, as a signature shows it."""

    key: str

    def __repr__(self) -> str:
        return f"<{self.key} of the bicycle>"


def signature(parameters: Sequence[Parameter], per_wheel: Any) -> inspect.Signature:
    """Keyword-only signature; ``per_wheel`` is the type of a parameter with a value for each wheel.

    Parameters
    ----------
    parameters : sequence of Parameter
    per_wheel : type
        Of a parameter with a value for each wheel.
    """
    ordered = sorted(parameters, key=lambda p: p.default is not None)  # what must be given stands first
    kinds = [per_wheel if p.per_wheel else float for p in ordered]
    arguments = [
        inspect.Parameter(p.name, inspect.Parameter.KEYWORD_ONLY, default=_default(p), annotation=kind)
        for p, kind in zip(ordered, kinds, strict=True)
    ]
    return inspect.Signature(arguments)


def docstring(description: str, parameters: Sequence[Parameter], source: str) -> str:
    """The effect in words, then every parameter with unit, default, typical and allowed values (numpydoc).

    Parameters
    ----------
    description : str
        The effect in words.
    parameters : sequence of Parameter
    source : str
        Literature.
    """
    lines = [description]
    if parameters:
        lines += ["", "Parameters", "----------"]
    for p in parameters:
        shape = "float or {rear, front}" if p.per_wheel else "float"
        lines += [f"{p.name} : {shape}, {unit(p)}{_said_default(p)}"]
        lines += [fill(sentence(p), 112, initial_indent="    ", subsequent_indent="    ")]
    if source and source not in " ".join(description.split()):
        lines += ["", "Notes", "-----", fill(f"Source: {source}.", 112)]
    return "\n".join(lines)


def unit(parameter: Parameter) -> str:
    """Unit in words.

    Parameters
    ----------
    parameter : Parameter
    """
    return "dimensionless" if parameter.unit == "1" else parameter.unit


def sentence(p: Parameter) -> str:
    """Meaning, typical and allowed range of a parameter, where it makes the effect vanish and where it does not matter.

    Parameters
    ----------
    p : Parameter
    """
    text = f"{p.description[:1].upper()}{p.description[1:]}; typical {_range(p.typical)}, allowed {_range(p.bounds)}"
    vanishes = "" if p.neutral is None else f"; the effect vanishes at {p.neutral:g}"
    side = "above" if p.neutral == math.inf else "below"
    least = f"; negligible {side} {p.least:g}" if p.least and p.neutral is not None else ""
    return f"{text}{vanishes}{least}."


def _default(p: Parameter) -> Any:
    if p.default is None:
        return inspect.Parameter.empty
    return Tied(p.default) if isinstance(p.default, str) else p.default


def _said_default(p: Parameter) -> str:
    if p.default is None:
        return ""
    return f", default {p.default} of the bicycle" if isinstance(p.default, str) else f", default {p.default:g}"


def _range(bounds: tuple[float, float]) -> str:
    low, high = bounds
    if math.isinf(low) and math.isinf(high):
        return "any"
    return f"{low:g} .. {high:g}"
