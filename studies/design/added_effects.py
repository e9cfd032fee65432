"""Effects that a design varies and the model does not have yet: added where they vanish."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from bicycle.effect import registry
from bicycle.parameter_key import ParameterKey


def with_effects(content: Mapping[str, Any], keys: Sequence[str]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The content of a model file with the effects that keys name, without any influence yet, and which were added.

    Only effects of which every number has a default, or a finite value at which the effect vanishes, can be added so.

    Parameters
    ----------
    content : mapping
        Of a model file.
    keys : sequence of str
        Numbers that are varied.
    """
    known = registry()
    tables = dict(content.get("effects", {}))
    added = []
    for key in keys:
        name = ParameterKey.parse(key).effect
        if not name or name in tables or name not in known or known[name].slot is not None:
            continue
        values = {
            p.name: p.neutral for p in known[name].parameters
            if p.neutral is not None and math.isfinite(p.neutral)
        }  # fmt: skip
        if values and all(p.name in values or p.default is not None for p in known[name].parameters):
            tables[name] = values
            added.append(name)
    return (dict(content) | {"effects": tables} if added else dict(content)), tuple(added)
