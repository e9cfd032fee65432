"""Values of a TOML file, each checked and refused by its full name."""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Any

from tyre.base.errors import InputError, is_number, shown, unknown

LEAF_KEYS = {"from", "to", "count", "mean", "sd", "low", "high"}


def leaves(table: Any, prefix: str, allowed: Collection[str], start: str = "") -> Iterator[tuple[str, Any]]:
    """Parameters by full name; ``[grid.relaxation_length]`` and a quoted ``"relaxation_length.x"`` are the same."""
    if not isinstance(table, Mapping):
        raise InputError(f"{prefix} is a table: write [{prefix}] and the parameters below it")
    for key, value in table.items():
        name = start + key
        inner = isinstance(value, Mapping) and value and not set(value) & LEAF_KEYS
        if inner and any(other.startswith(f"{name}.") for other in allowed):
            yield from leaves(value, prefix, allowed, f"{name}.")
        else:
            yield name, value


def known(names: Iterable[Any], allowed: Collection[str], kind: str) -> None:
    """Refuse a name that is not allowed."""
    for name in names:
        if not isinstance(name, str) or name not in allowed:
            raise InputError(unknown(kind, name, allowed))


def finite(name: str, value: Any) -> float:
    """Return a finite number."""
    if not is_number(value) or not math.isfinite(value):
        raise InputError(f"{name} = {shown(value)} must be a finite number")
    return float(value)


def flag(name: str, value: Any) -> bool:
    """Return true or false."""
    if not isinstance(value, bool):
        raise InputError(f"{name} = {shown(value)} must be true or false")
    return value


def whole(table: Mapping[str, Any], key: str, default: Any, *, least: int, most: int = 2**63 - 1) -> int:
    """Return a whole number of a table."""
    value = table.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise InputError(f"{key} = {shown(value)} must be a whole number from {least} to {most}")
    return value
