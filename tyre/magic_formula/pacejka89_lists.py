"""Lists of Pacejka-89 coefficients as other projects keep them: text, CSV, JSON, YAML and MATLAB files.

A set has 14 numbers of the side force (a0 to a13) and perhaps 18 of the aligning moment (c0 to c17), in the order of
Magic-Formula-89. What such files leave to their name or label is read there, and said.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.errors import InputError, is_number, shown, unknown
from tyre.base.unit_words import factor_to_si
from tyre.magic_formula.pacejka89 import SLIP_UNITS, Pacejka89
from tyre.magic_formula.pacejka89_content import (
    COUNT,
    EITHER,
    KNOWN,
    MOMENT,
    PRESSURES,
    ROLE_OF,
    SIDE,
    STIFFNESS,
    is_float,
    read_content,
)  # fmt: skip
from tyre.magic_formula.pacejka89_file import check_coefficients, doubts_about
from tyre.magic_formula.pacejka89_tyre import Pacejka89Tyre

_SETS = ("set", "sets")
_UNFINISHED = re.compile(r"need\w* (?:\w+ )?refinement|not converged|unfinished|aborted|do not use", re.IGNORECASE)
_IN_LABEL = re.compile(r"(\d+(?:\.\d+)?)\s*(kPa|bar|psi)\b", re.IGNORECASE)
_IN_NAME = re.compile(r"_p(\d{2,4})(?!\d)")  # of the authors' files: OptParameterMF_T03R01_camber0_p300
_LARGEST = re.compile(r"upper limit fz:?\s*(\d+(?:\.\d+)?)\s*N", re.IGNORECASE)


@dataclass
class Listed:
    """One set as it is read: numbers by what they are of, and what is said of it, keys in small letters."""

    numbers: dict[str, list[float]] = field(default_factory=dict)
    said: dict[str, Any] = field(default_factory=dict)


def read_coefficient_lists(path: Path) -> Pacejka89Tyre:
    """Read the sets of a file and check them.

    Parameters
    ----------
    path : Path
        ``.txt``, ``.csv``, ``.json``, ``.yaml``, ``.yml`` or ``.mat``.

    Raises
    ------
    InputError
        No such file or not of its format, another number of coefficients, an unknown key, a set without pressure, one
        that its authors call unfinished, or one that describes no tyre.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file of Pacejka-89 coefficients")
    content, notes = read_content(path)
    listed = _paired(list(_sets(content, {}, str(path))), str(path))
    if not listed:
        raise InputError(
            f"{path}: no coefficients found; give 14 numbers of the side force below a key such as {SIDE}, Fy or "
            f"OptParameterMF_Fy, and perhaps 18 of {MOMENT}, Mz or OptParameterMF_Mz"
        )
    fits = [_fit(one, path, notes) for one in listed]
    for fit in fits:
        same = [one.label for one in fits if one.pressure == fit.pressure]
        if len(same) > 1:
            raise InputError(f"{path}: {same[0]!r} and {same[1]!r} are of one pressure; keep one of them")
    stated = [fit for fit in fits if fit.lateral_stiffness is not None]
    if stated and len(stated) < len(fits):
        raise InputError(f"{path}: lateral_stiffness_N_per_mm is given for some of the sets; give it in every set")
    return Pacejka89Tyre(
        tyre=str(_common(listed, "tyre", path) or path.stem), surface=_surface(listed, path, notes),
        sets=tuple(sorted(fits, key=lambda fit: fit.pressure)),
        source=str(_common(listed, "source", path) or "not stated"),
        notes=tuple(dict.fromkeys(notes)),
    )  # fmt: skip


def _sets(node: Any, context: Mapping[str, Any], where: str) -> Iterator[Listed]:
    """Every set below ``node``, which inherits what is said above it."""
    if isinstance(node, np.ndarray):
        node = node.ravel().tolist()
    if isinstance(node, list) and node and all(is_number(one) for one in node):
        yield _listed({"coefficients": node}, context, where)
    elif isinstance(node, list):
        for number, one in enumerate(node, 1):
            yield from _sets(one, context, f"{where}, set {number}")
    elif isinstance(node, Mapping):
        small = {str(key).lower(): value for key, value in node.items()}
        inner = {key: value for key, value in node.items() if isinstance(value, Mapping) or str(key).lower() in _SETS}
        said = {key: value for key, value in small.items() if key in KNOWN}
        lists = {k: v for k, v in small.items() if k not in said and k not in map(str.lower, map(str, inner))}
        for key in lists:
            if key not in ROLE_OF and key not in EITHER:
                raise InputError(f"{where}: {unknown('key', key, [*KNOWN, SIDE, MOMENT])}")
        if lists:
            yield _listed(lists, {**context, **said}, where)
        for key, value in inner.items():
            label = {} if str(key).lower() in _SETS else {"label": str(key)}
            yield from _sets(value, {**context, **label, **said}, f"{where}, {key}")
    else:
        raise InputError(f"{where}: {shown(node)} is no list of coefficients")


def _listed(lists: Mapping[str, Any], said: Mapping[str, Any], where: str) -> Listed:
    found = Listed(said=dict(said))
    for key, value in lists.items():
        numbers = np.asarray(value).ravel().tolist()
        if not all(is_number(one) and np.isfinite(one) for one in numbers):
            raise InputError(f"{where}: {key} must be a list of finite numbers")
        for role, part in _by_role(key, [float(one) for one in numbers], str(said.get("kind", "")), where):
            found.numbers[role] = part
    return found


def _by_role(key: str, numbers: list[float], kind: str, where: str) -> list[tuple[str, list[float]]]:
    role = ROLE_OF.get(key) or ROLE_OF.get(kind.lower())
    if role is None and len(numbers) == sum(COUNT.values()):
        return [(SIDE, numbers[: COUNT[SIDE]]), (MOMENT, numbers[COUNT[SIDE] :])]
    role = role or next((one for one, count in COUNT.items() if count == len(numbers)), None)
    if role is None or len(numbers) != COUNT[role]:
        of = role.replace("_", " ") if role else "list"
        raise InputError(
            f"{where}: the {of} has {len(numbers)} coefficients; a side force has 14 (a0 to a13), an aligning moment "
            "18 (c0 to c17), both in one list 32"
        )
    return [(role, numbers)]


def _paired(listed: Sequence[Listed], where: str) -> list[Listed]:
    """Sets with their moments, which some files keep apart under the same label."""
    found: list[Listed] = []
    for one in listed:
        if SIDE in one.numbers:
            found.append(one)
            continue
        same = [f for f in found if MOMENT not in f.numbers and _identity(f) == _identity(one)]
        if not same:
            raise InputError(
                f"{where}: the aligning moment {_label(one)!r} has no side force of the same label before it"
            )
        same[-1].numbers |= one.numbers
    return found


def _identity(one: Listed) -> tuple[Any, ...]:
    return tuple(one.said.get(key) for key in ("label", "commit", *PRESSURES))


def _label(one: Listed) -> str:
    return str(one.said.get("label", ""))


def _fit(one: Listed, path: Path, notes: list[str]) -> Pacejka89:
    label, where = _label(one), f"{path}{', ' * bool(_label(one))}{_label(one)}"
    stiffness = one.said.get(STIFFNESS)
    _refuse_unfinished(one, where)
    fit = Pacejka89(
        label=label or path.stem, pressure=_pressure(one, path, notes), load_max=_load_max(one, where, notes),
        side_force_coefficients=tuple(one.numbers[SIDE]),
        aligning_moment_coefficients=tuple(one.numbers[MOMENT]) if MOMENT in one.numbers else None,
        slip_unit=_slip_unit(one, where, path.stem, notes),
        lateral_stiffness=None if stiffness is None else _positive(stiffness, where, STIFFNESS) * 1e3,
    )  # fmt: skip
    try:
        check_coefficients(fit)
    except InputError as error:
        raise InputError(f"{path}: {error}{_other_slip_unit(fit)}") from error
    said = one.said.get("note", [])
    notes += [said] if isinstance(said, str) else [str(note) for note in said]
    notes += doubts_about(fit)
    return fit


def _refuse_unfinished(one: Listed, where: str) -> None:
    said = _UNFINISHED.search(_label(one))
    if said is None:
        return
    why = ""
    try:
        check_coefficients(Pacejka89("it", 1.0, float("inf"), tuple(one.numbers[SIDE])))
    except InputError as error:
        why = f": {error}"
    raise InputError(f"{where}: its authors say {said[0]!r} of this fit{why}; take a finished one")


def _other_slip_unit(fit: Pacejka89) -> str:
    from dataclasses import replace

    other = "rad" if fit.slip_unit == "deg" else "deg"
    try:
        check_coefficients(replace(fit, slip_unit=other))
    except InputError:
        return ""
    return f"; with slip in {other} it would be one: write slip_unit = {other}"


def _pressure(one: Listed, path: Path, notes: list[str]) -> float:
    """Pa."""
    for key, unit in PRESSURES.items():
        if key in one.said:
            number = _positive(one.said[key], str(path), key)
            return float(Fraction(number) * factor_to_si(unit, "Pa", where=f"{path}, {key}"))
    if match := _IN_LABEL.search(_label(one)):
        unit = {"kpa": "kPa", "bar": "bar", "psi": "psi"}[match[2].lower()]
        return float(Fraction(match[1]) * factor_to_si(unit, "Pa", where=str(path)))
    for name in (_label(one), path.stem):
        if match := _IN_NAME.search(name):
            notes.append(f"its pressure of {match[1]} kPa is read from the name {name}")
            return float(match[1]) * 1e3
    raise InputError(
        f"{path}{', ' * bool(_label(one))}{_label(one)}: no pressure is stated; write pressure_kPa = 300, or name it "
        "in the label ('300 kPa') or in the name of the file (NAME_p300)"
    )


def _load_max(one: Listed, where: str, notes: list[str]) -> float:
    """N."""
    if "load_max_n" in one.said:
        return _positive(one.said["load_max_n"], where, "load_max_N")
    if match := _LARGEST.search(_label(one)):
        return float(match[1])
    notes.append("the file states no largest load (load_max_N)")
    return float("inf")


def _slip_unit(one: Listed, where: str, stem: str, notes: list[str]) -> str:
    if "slip_unit" in one.said:
        if one.said["slip_unit"] not in SLIP_UNITS:
            raise InputError(f"{where}: slip_unit = {one.said['slip_unit']!r} is neither 'deg' nor 'rad'")
        return str(one.said["slip_unit"])
    for name in (_label(one), stem):
        named = [unit for unit in SLIP_UNITS if re.search(rf"(?<![a-z]){unit}(?![a-z])", name, re.IGNORECASE)]
        if len(named) == 1:
            return named[0]
    notes.append("the file states no unit of slip (slip_unit); degrees are taken, as Magic-Formula-89 has them")
    return "deg"


def _surface(listed: Sequence[Listed], path: Path, notes: list[str]) -> str:
    stated = _common(listed, "surface", path)
    if stated is None:
        notes.append("the file states no surface; flat is taken")
        return "flat"
    if stated not in ("flat", "drum"):
        raise InputError(f"{path}: surface = {stated!r} must be 'flat' or 'drum'")
    return str(stated)


def _common(listed: Sequence[Listed], key: str, path: Path) -> Any:
    found = list(dict.fromkeys(one.said[key] for one in listed if key in one.said))
    if len(found) > 1:
        raise InputError(f"{path}: the sets have several values of {key} ({shown(found)}); a file is one tyre")
    return found[0] if found else None


def _positive(value: Any, where: str, key: str) -> float:
    if isinstance(value, np.generic):
        value = value.item()
    number = float(value) if is_number(value) or (isinstance(value, str) and is_float(value)) else float("nan")
    if not 0 < number < 1e7:
        raise InputError(f"{where}: {key} = {shown(value)} must be a positive number")
    return number
