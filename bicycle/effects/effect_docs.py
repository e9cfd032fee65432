"""The page of an effect, from its declaration."""

import math
from collections.abc import Mapping
from typing import Any

from bicycle.effects.effect import Effect, Parameter
from bicycle.effects.effect_registry import registry


def describe(effect: type[Effect]) -> str:
    """Markdown page of ``effect``: what it adds, its parameters with units, what it needs, signature and source."""
    lines = [f"# {effect.identifier}", "", effect.description, ""]
    if effect.parameters:
        columns = ("parameter", "unit", "meaning", "typical", "allowed", "default", "vanishes at")
        rows = [columns, ["---"] * len(columns), *map(_cells, effect.parameters)]
        lines += [*("| " + " | ".join(cells) + " |" for cells in rows), ""]
        if any(parameter.per_wheel for parameter in effect.parameters):
            lines += ["r/f: one value per wheel, `{rear = .., front = ..}`, or one number for both.", ""]
    else:
        lines += ["No parameters.", ""]
    facts = {
        "Exclusive as": effect.slot,
        "Needs": ", ".join(effect.requires) + (f" ({effect.why})" if effect.why else "") if effect.requires else None,
        "Provides": ", ".join(effect.provides),
        "Typical ranges": "; ".join(f"`{p.name}` {p.evidence}" for p in effect.parameters if p.evidence),
        "Brings the mode": ", ".join(mode.name for mode in effect.modes),
        "What one sees": effect.signature,
        "Source": effect.source,
    }
    lines += [f"- {name}: {fact}" for name, fact in facts.items() if fact]
    return "\n".join(lines) + "\n"


def record(effect: type[Effect]) -> dict[str, Any]:
    """The declaration of ``effect`` as JSON-ready data; infinite numbers are the strings ``inf`` and ``-inf``."""
    fields: dict[str, Any] = {"identifier": effect.identifier, "description": effect.description}
    fields["parameters"] = [
        {
            "name": p.name,
            "unit": p.unit,
            "description": p.description,
            "per_wheel": p.per_wheel,
            "bounds": [_json_number(bound) for bound in p.bounds],
            "typical": list(p.typical),
            "evidence": p.evidence,
            "default": p.default,
            "neutral": _json_number(p.neutral),
        }
        for p in effect.parameters
    ]
    fields |= {"slot": effect.slot, "requires": list(effect.requires), "provides": list(effect.provides)}
    modes = [mode.name for mode in effect.modes]
    return fields | {"modes": modes, "signature": effect.signature, "source": effect.source}


def records() -> Mapping[str, dict[str, Any]]:
    """Return :func:`record` of every effect, by identifier."""
    return {identifier: record(effect) for identifier, effect in registry().items()}


def _json_number(number: float | None) -> float | str | None:
    return str(number) if number is not None and math.isinf(number) else number


def _cells(p: Parameter) -> list[str]:
    default = "must be given" if p.default is None else p.default if isinstance(p.default, str) else f"{p.default:g}"
    return [
        f"`{p.name}`" + (" r/f" if p.per_wheel else ""),
        p.unit,
        p.description,
        f"{p.typical[0]:g} .. {p.typical[1]:g}",
        f"{p.bounds[0]:g} .. {p.bounds[1]:g}",
        default,
        "-" if p.neutral is None else f"{p.neutral:g}",
    ]
