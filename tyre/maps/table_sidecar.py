"""The TOML sidecar of a measured tyre table: its keys, their types, and messages for what is wrong."""

import difflib
import math
import tomllib
from collections.abc import Iterable
from typing import Any

from tyre.base.errors import InputError
from tyre.maps.calibration import CommonCalibration

_KEYS: dict[str, type | tuple[type, ...]] = {
    "tyre": str,
    "surface": str,
    "source": str,
    "description": str,
    "synthetic": bool,
    "notes": list,
    "width_mm": (int, float),
    "drum_diameter_m": (int, float),
    "relaxation_length_sd_mm": (int, float),
    "lateral_stiffness_shared_over": list,
    "lateral_stiffness_origin": str,
    "resolution": dict,
    "calibration": dict,
}
_CALIBRATION_KEYS = ("force", "slip", "displacement")
_RESOLUTION_KEYS = ("cornering_stiffness_N_per_deg", "relaxation_length_mm")


def read_sidecar(name: str, text: str) -> dict[str, Any]:
    """Check and return the keys of a sidecar.

    Parameters
    ----------
    name : str
        Of the file, for messages.
    text : str
        Its content.

    Raises
    ------
    InputError
        No TOML, an unknown or missing key, or a value of another type or out of range.
    """
    try:
        keys = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{name}: not valid TOML ({error}).") from error
    for key, value in keys.items():
        if key not in _KEYS:
            raise InputError(f"{name}: unknown key '{key}'{suggestion(key, _KEYS)}; allowed are {listed(_KEYS)}.")
        if not isinstance(value, _KEYS[key]) or (isinstance(value, bool) and _KEYS[key] is not bool):
            raise InputError(
                f"{name}: {key} = {value!r} has the wrong type; see the columns and keys in tyre/maps/tables.py."
            )
        if isinstance(value, int | float) and not isinstance(value, bool) and not (math.isfinite(value) and value > 0):
            raise InputError(f"{name}: {key} = {value!r}; it must be finite and > 0.")
    for key in ("tyre", "surface", "source"):
        if not keys.get(key, "").strip():
            raise InputError(f"{name}: key '{key}' is missing; a tyre table must say its tyre, surface and source.")
    for key, value in keys.get("resolution", {}).items():
        if key not in _RESOLUTION_KEYS:
            raise InputError(
                f"{name}: unknown key 'resolution.{key}'{suggestion(key, _RESOLUTION_KEYS)}; "
                f"allowed are {listed(_RESOLUTION_KEYS)}."
            )
        if isinstance(value, bool) or not isinstance(value, int | float) or not (math.isfinite(value) and value > 0):
            raise InputError(f"{name}: resolution.{key} = {value!r}; it must be finite and > 0.")
    if "resolution" in keys and set(keys["resolution"]) != set(_RESOLUTION_KEYS):
        raise InputError(f"{name}: [resolution] needs both {listed(_RESOLUTION_KEYS)}.")
    _check_calibration(name, keys)
    for key in ("notes", "lateral_stiffness_shared_over"):
        for value in keys.get(key, []):
            if not isinstance(value, str):
                raise InputError(f"{name}: {key} holds {value!r}; only strings are allowed.")
    return keys


def _check_calibration(name: str, keys: dict[str, Any]) -> None:
    if "calibration" not in keys:
        return
    for key, value in keys["calibration"].items():
        if key not in _CALIBRATION_KEYS:
            raise InputError(
                f"{name}: unknown key 'calibration.{key}'{suggestion(key, _CALIBRATION_KEYS)}; "
                f"allowed are {listed(_CALIBRATION_KEYS)}."
            )
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(f"{name}: calibration.{key} = {value!r} must be a number, 0.003 for 0.3 %.")
    if set(keys["calibration"]) != set(_CALIBRATION_KEYS):
        raise InputError(f"{name}: [calibration] needs {listed(_CALIBRATION_KEYS)}; 0 is a gain known exactly.")
    try:
        CommonCalibration(**keys["calibration"])
    except InputError as error:
        raise InputError(f"{name}: {error}.") from error


def listed(names: Iterable[str]) -> str:
    """Quote and join names for a message.

    Parameters
    ----------
    names : iterable of str
    """
    return ", ".join(f"'{name}'" for name in names)


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return the nearest known name as a question in brackets, or nothing.

    Parameters
    ----------
    name : str
        As it was given.
    known : iterable of str
        What there is.
    """
    near = difflib.get_close_matches(name, list(known), n=1)
    return f" (did you mean '{near[0]}'?)" if near else ""
