"""The keys of a model file with dots, one value each: how an address holds a model."""

import json
import math
from collections.abc import Mapping
from typing import Any

from bicycle.effect import WHEELS, registry
from bicycle.files.tyre_values import FROM_TYRE
from bicycle.files.wheel_tyres import TYRE_KEYS
from tyre.base.errors import InputError, is_number, shown, unknown

FILE_KEYS = ("bicycle", "effects", "allow_unusual", "covariance", "description")
MODEL_KEYS = (*FILE_KEYS, "load")
TEXT_KEYS = ("tyre", "surface")  # of an effect's table; all else is a number, a switch or the word "tyre"
ON = "on"
"""Value of ``effects.NAME`` for an effect that is there without numbers of its own."""

Value = float | bool | str


def nested(flat: Mapping[str, Value]) -> dict[str, Any]:
    """Tables from dotted keys.

    Parameters
    ----------
    flat : mapping
        Key of a model file (unit by its name) -> value.

    Raises
    ------
    InputError
        A key that is a value and a table at once.
    """
    content: dict[str, Any] = {}
    for key, value in flat.items():
        *outer, last = key.split(".")
        place = content
        for part in outer:
            place = place.setdefault(part, {})
            if not isinstance(place, dict):
                raise InputError(f"address: {key} is given beside {part} as a whole; keep one")
        if last in place:
            raise InputError(f"address: {key} is given as a value and as a table; keep one")
        if len(outer) == 1 and outer[0] == "effects":
            place[last] = {}
        else:
            place[last] = json.loads(str(value)) if key == "covariance" else value
    return content


def flattened(content: Mapping[str, Any]) -> tuple[tuple[str, Value], ...]:
    """Dotted keys from the content of a model file, for :class:`State`.

    Parameters
    ----------
    content : mapping
        As read from TOML, in its units.

    Raises
    ------
    InputError
        What an address cannot hold, such as a list.
    """
    flat: dict[str, Value] = {}

    def add(key: str, value: Any) -> None:
        if key == "covariance":
            flat[key] = json.dumps(value)
        elif isinstance(value, Mapping) and (value or key == "effects"):
            for name, inner in value.items():
                add(f"{key}.{name}", inner)
        elif isinstance(value, Mapping):
            flat[key] = ON
        elif isinstance(value, bool | str):
            flat[key] = value
        elif is_number(value):
            flat[key] = float(value)
        else:
            raise InputError(f"{key} = {shown(value)} must be a number, a text or true or false")

    for name, value in content.items():
        if name not in FILE_KEYS:
            raise InputError(unknown("key", name, FILE_KEYS))
        add(name, value)
    return tuple(sorted(flat.items()))


def written(value: Value) -> str:
    """A value as the address has it, every digit of a number.

    Parameters
    ----------
    value : float, bool or str
        In the unit of its key.
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value).removesuffix(".0") if isinstance(value, float) else value


def finite(key: str, value: str) -> float:
    """The number that a text of an address is.

    Parameters
    ----------
    key : str
        For the message.
    value : str
        In the unit of the key.

    Raises
    ------
    InputError
        No finite number, or one of too many letters.
    """
    try:
        found = float(value)
    except ValueError:
        found = math.nan
    if not math.isfinite(found) or len(value) > 40:
        raise InputError(f"address: {key} = {shown(value)} must be a finite number")
    return found


def model_value(key: str, value: str) -> Value:
    """The value of a dotted key of a model file.

    Parameters
    ----------
    key : str
    value : str
        In the unit of the key.

    Raises
    ------
    InputError
        A key with too many or too few dots, or a value that is not allowed there.
    """
    parts = key.split(".")
    if key in ("bicycle", "description") or (parts[0] == "effects" and len(parts) > 2 and parts[2] in TEXT_KEYS):
        return value
    if key == "covariance":
        return _covariance(value)
    if value in ("true", "false") and parts[-1] in ("allow_unusual", "extrapolate"):
        return value == "true"
    if parts[0] == "effects" and (value, len(parts)) == (ON, 2):
        return ON
    if parts[0] == "effects" and value == "tyre" and len(parts) in (3, 4):
        return value
    if parts[0] == "bicycle" and not _is_number(value):
        return value  # such as 0.3 +/- 0.01, which the reader of bicycles checks
    if len(parts) == 1 or len(parts) > 4 or (parts[0] == "effects" and len(parts) == 2):
        raise InputError(f"address: {key} = {shown(value)} is no key and value of a model file")
    return finite(key, value)


def _covariance(value: str) -> str:
    try:
        found = json.loads(value)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise InputError(f"address: covariance = {shown(value)} must be a table as JSON")
    return json.dumps(found)


def _is_number(value: str) -> bool:
    try:
        return math.isfinite(float(value))
    except ValueError:
        return False


def each_wheel(model: Mapping[str, Value]) -> dict[str, Value]:
    """One number for both wheels as two, so that each has its own control.

    Parameters
    ----------
    model : mapping
        Dotted key (unit by its name) -> value.
    """
    found: dict[str, Value] = {}
    for key, value in model.items():
        parts = key.split(".")
        kind = registry().get(parts[1]) if parts[0] == "effects" and len(parts) == 3 else None
        twice = kind is not None and (
            parts[2] in TYRE_KEYS or any(p.per_wheel for p in kind.parameters if p.name == parts[2])
        )
        if twice and value != FROM_TYRE and not any(f"{key}.{wheel}" in model for wheel in WHEELS):
            found |= {f"{key}.{wheel}": value for wheel in WHEELS}
        else:
            found[key] = value
    return found
