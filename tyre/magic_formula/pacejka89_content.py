"""Files with lists of Pacejka-89 coefficients, read into mappings, lists and numbers."""

import json
import re
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.errors import InputError, plain_digits, unknown
from tyre.base.optional import optional_module
from tyre.base.sheet import read_sheet

SIDE, MOMENT = "side_force", "aligning_moment"
COUNT = {SIDE: 14, MOMENT: 18}
_ROLES = {
    SIDE: ("side_force", "fy", "fy_coef", "opt_pac_fy", "optparametermf_fy", "lateral"),
    MOMENT: ("aligning_moment", "mz", "mz_coef", "opt_pac_mz", "optparametermf_mz", "aligning"),
}
ROLE_OF = {word: role for role, words in _ROLES.items() for word in words}
EITHER = ("coef", "coefficients", "coeff", "parameters")
PRESSURES = {"pressure_kpa": "kPa", "pressure_bar": "bar", "pressure_psi": "psi", "pressure_pa": "Pa"}
STIFFNESS = "lateral_stiffness_n_per_mm"
_WORDS = ("tyre", "surface", "label", "slip_unit", "source", "licence", "note", "kind", "commit")
_NUMBERS = ("load_max_n", STIFFNESS, *PRESSURES, "n")
KNOWN = (*_WORDS, *_NUMBERS)


def is_coefficient_list(path: Path) -> bool:
    """Whether a ``.csv`` holds coefficients, not a table of conditions: its first line has numbers, a0 or Fy.

    Parameters
    ----------
    path : Path
    """
    for line in path.read_bytes().decode("utf-8-sig", errors="replace").splitlines() if path.is_file() else ():
        cells = [cell.strip().lower() for cell in re.split(r"[,;\t ]+", line.strip()) if cell.strip()]
        if cells and not line.lstrip().startswith(("#", "%")):
            return "a0" in cells or cells[0] in ROLE_OF or all(is_float(cell) for cell in cells)
    return False


def read_content(path: Path) -> tuple[Any, list[str]]:
    """What a file holds, as mappings, lists and numbers, and notes on what of it is not used.

    Parameters
    ----------
    path : Path

    Raises
    ------
    InputError
        Not a file of its format, or a word where a number must be.
    """
    ending = path.suffix.lower()
    if ending == ".mat":
        return _matlab(path)
    text = path.read_bytes().decode("utf-8-sig", errors="replace")
    if ending == ".json":
        try:
            return json.loads(text), []
        except (ValueError, RecursionError) as error:
            raise InputError(f"{path}: not a JSON file: {error}") from error
    if ending in (".yaml", ".yml"):
        import yaml

        try:
            return yaml.safe_load(text), []
        except (yaml.YAMLError, RecursionError) as error:
            raise InputError(f"{path}: not a YAML file: {' '.join(str(error).split())}") from error
    if ending == ".csv" and re.search(r"(^|[,;\t])\s*a0\s*([,;\t]|$)", text, re.MULTILINE):
        return _rows(path), []
    return _text(text, path), []


def _rows(path: Path) -> list[dict[str, Any]]:
    """One set a row, columns a0 to a13 and perhaps c0 to c17."""
    found, sheet = [], read_sheet(path, kind="coefficients")
    for place, cells in sheet.rows:
        row: dict[str, Any] = {}
        for name, cell in zip((name.lower() for name in sheet.header), cells, strict=True):
            match = re.fullmatch(r"([ac])(\d+)", name)
            if match is None:
                row |= {name: cell} if cell != "" else {}
                continue
            if not is_float(cell):
                raise InputError(f"{path}, {place}, column {name!r}: {cell!r} is not a number")
            role = SIDE if match[1] == "a" else MOMENT
            values = row.setdefault(role, [])
            if int(match[2]) != len(values):
                raise InputError(f"{path}: the column {match[1]}{len(values)} is missing before {name}")
            values.append(float(cell))
        found.append(row)
    return found


def _text(text: str, path: Path) -> Any:
    """Numbers apart by blanks, commas or lines; ``key = value`` lines, also behind ``#`` or ``%``; names of lists."""
    content: dict[str, Any] = {}
    role = ""
    for number, line in enumerate(text.splitlines(), 1):
        body, _, comment = re.split(r"([#%])", line, maxsplit=1) if re.search("[#%]", line) else (line, "", "")
        for part, behind in ((body, False), (comment, True)):
            match = re.fullmatch(r"\s*([A-Za-z_]\w*)\s*(?:[:=]\s*(.*?)|\s*)", part.strip().rstrip(","))
            key = match[1].lower() if match else ""
            rest = match[2] or "" if match else part
            if key in KNOWN:
                content[key] = rest.strip().strip("'\"")
                continue
            if behind:
                continue
            if key in ROLE_OF:
                role = ROLE_OF[key]
            elif key and not is_float(part):
                raise InputError(
                    f"{path}, line {number}: {unknown('key', match[1] if match else '', [*KNOWN, SIDE, MOMENT])}"
                )
            for word in re.split(r"[\s,;\[\](){}]+", rest if key in ROLE_OF else part):
                if word and not is_float(word):
                    raise InputError(f"{path}, line {number}: {word!r} is not a number")
                if word:
                    content.setdefault(role or "coefficients", []).append(float(word))
    return content


def _matlab(path: Path) -> tuple[Any, list[str]]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        content = loadmat(path, simplify_cells=True)
    except NotImplementedError:  # version 7.3 is HDF5
        try:
            h5py = optional_module("h5py", extra="formats")
        except ImportError as error:
            raise InputError(f"{path}: saved as version 7.3; {error}, or save it with -v7") from error
        with h5py.File(path, "r") as file:
            content = _of_hdf5(file)
    except (MatReadError, ValueError, OSError, TypeError, LookupError, zlib.error) as error:
        raise InputError(f"{path}: not a MATLAB file ({' '.join(str(error).split())[:80]})") from error
    content = {key: value for key, value in content.items() if not key.startswith("__")}

    def used(key: str, value: Any) -> bool:
        inner = isinstance(value, Mapping) and any(used(k, v) for k, v in value.items())
        return key.lower() in ROLE_OF or key.lower() in (*KNOWN, *EITHER) or inner

    others = [key for key, value in content.items() if not used(key, value)]
    notes = [f"not used of {path.name}: {', '.join(sorted(others))}"] if others else []
    return {key: value for key, value in content.items() if key not in others}, notes


def _of_hdf5(group: Any) -> dict[str, Any]:
    """Structs, numbers and words of a MATLAB 7.3 file; what else it holds (below ``#``) is left out."""
    found: dict[str, Any] = {}
    for key, item in group.items():
        if hasattr(item, "items"):
            found |= {} if key.startswith("#") else {key: _of_hdf5(item)}
        elif item.attrs.get("MATLAB_class") == b"char":
            found[key] = "".join(map(chr, np.ravel(item[()])))
        elif item.dtype.kind in "fiu":
            found[key] = item[()].item() if item.size == 1 else np.ravel(item[()])
    return found


def is_float(text: Any) -> bool:
    """Whether ``text`` is a finite number, or reads as one."""
    try:
        return plain_digits(text) and bool(np.isfinite(float(text)))
    except (TypeError, ValueError):
        return False
