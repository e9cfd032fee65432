"""The declared sidecar of a measured tyre table."""

from collections.abc import Iterable
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from tyre.base.checks import flag, list_of, number, text
from tyre.base.errors import InputError
from tyre.base.plausible import LARGEST, SMALLEST
from tyre.base.schema import maybe, needed, read, table
from tyre.base.toml_file import read_toml
from tyre.maps.calibration import CommonCalibration
from tyre.maps.named_columns import comments

POSITIVE = number(
    above=0, least=SMALLEST, most=LARGEST, says=f"must be finite and > 0, from {SMALLEST:g} to {LARGEST:g}"
)
_WORDS, _NAMES = text(), list_of(text(), "must be a list of texts in quotes")
_WHO = "; a tyre table must say its tyre, surface and source"
_RESOLUTION = ("cornering_stiffness_N_per_deg", "relaxation_length_mm")
_GAINS = ("force", "slip", "displacement")


def listed(names: Iterable[str]) -> str:
    """Quote and join names for a message.

    Parameters
    ----------
    names : iterable of str
    """
    return ", ".join(f"'{name}'" for name in names)


SIDECAR = table(
    {needed(key, f"key '{key}' is missing{_WHO}"): text(blank=False) for key in ("tyre", "surface", "source")}
    | {
        maybe("description", ""): _WORDS,
        maybe("synthetic", False): flag,
        maybe("notes", []): _NAMES,
        maybe("width_mm"): POSITIVE,
        maybe("drum_diameter_m"): POSITIVE,
        maybe("relaxation_length_sd_mm"): POSITIVE,
        maybe("lateral_stiffness_shared_over", []): _NAMES,
        maybe("lateral_stiffness_origin", "measured"): _WORDS,
        maybe("resolution"): table(
            {needed(key, f"give both {listed(_RESOLUTION)}"): POSITIVE for key in _RESOLUTION},
            kind="key of resolution:",
        ),
        maybe("calibration"): table(
            {
                needed(key, f"give {listed(_GAINS)}; 0 is a gain known exactly"): number(
                    says="must be a number, 0.003 for 0.3 %"
                )
                for key in _GAINS
            },
            kind="key of calibration:",
        ),
    }
)


def read_sidecar(path: Traversable) -> dict[str, Any]:
    """Check and return the keys of a sidecar.

    Parameters
    ----------
    path : Path

    Returns
    -------
    dict
        By key, in the units of the file; ``calibration`` is a :class:`CommonCalibration`.

    Raises
    ------
    InputError
        No TOML, an unknown or missing key, or a value of another type or out of range.
    """
    keys: dict[str, Any] = read(SIDECAR, read_toml(path, "sidecar", where=path.name), where=path.name, dotted=True)
    try:
        return keys | ({"calibration": CommonCalibration(**keys["calibration"])} if "calibration" in keys else {})
    except InputError as error:
        raise InputError(f"{path.name}: {error}.") from error


def without_sidecar(table: Path) -> dict[str, Any]:
    """The keys of a table that has no sidecar: what its comments say, the rest assumed and noted.

    Parameters
    ----------
    table : Path
        The ``.csv``.
    """
    said = comments(table)
    assumed = [f"{key} = {value!r}" for key, value in (("tyre", table.stem), ("surface", "flat")) if key not in said]
    notes = [f"{table.name} has no sidecar {table.stem}.toml; taken is {' and '.join(assumed)}"] if assumed else []
    given = {"tyre": table.stem, "surface": "flat", "source": "not stated"} | said
    keys: dict[str, Any] = read(SIDECAR, given, where=table.name, dotted=True)
    return keys | {"notes": notes}
