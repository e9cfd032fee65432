"""Where in what was read there is something that is no finite number."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

_MOST = 20_000  # things that are looked at in one result


def not_finite(found: Any) -> set[str]:
    """Where in what was read there is a NaN or an infinity, by names of attributes and keys without numbers of places.

    Parameters
    ----------
    found : object
        What a reader gave.
    """
    places: set[str] = set()
    stack: list[tuple[str, Any]] = [("", found)]
    seen: set[int] = set()
    while stack and len(seen) < _MOST:
        place, thing = stack.pop()
        if isinstance(thing, float | complex | np.floating | np.complexfloating):
            if not np.isfinite(thing):
                places.add(place)
            continue
        if isinstance(thing, str | bytes | int | type(None) | type) or id(thing) in seen:
            continue
        seen.add(id(thing))
        if isinstance(thing, np.ndarray):
            if thing.dtype.kind in "fc" and not np.isfinite(thing).all():
                places.add(place)
        elif is_dataclass(thing):
            stack += [(f"{place}.{f.name}", getattr(thing, f.name, None)) for f in fields(thing)]
        elif isinstance(thing, Mapping):
            stack += [(f"{place}[{key}]", value) for key, value in thing.items()]
        elif isinstance(thing, list | tuple | set | frozenset):
            stack += [(place, value) for value in thing]
    return places
