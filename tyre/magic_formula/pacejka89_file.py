"""Files of Pacejka-89 coefficients, and what they must be to describe a tyre."""

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.errors import InputError, is_number, shown
from tyre.base.paths import data_root
from tyre.magic_formula.pacejka89 import DEGREE, SLIP_UNITS, Pacejka89
from tyre.magic_formula.pacejka89_tyre import LOADS, Pacejka89Tyre

KIND = "pacejka89"
_LATERAL, _ALIGNING = 14, 18
_KEYS = {"kind", "tyre", "surface", "load_max_N", "slip_unit", "source", "licence", "note", "set"}
_SET_KEYS = {"pressure_kPa", "label", "side_force", "aligning_moment", "lateral_stiffness_N_per_mm"}
_MAY_MISS = {"aligning_moment", "lateral_stiffness_N_per_mm"}
# limits of check_coefficients, far beyond what is measured: C/Fz is 0.2 to 0.3 per degree in Dell'Orto et al.
_STIFFNESS_PER_LOAD = (0.03, 1.0)
_LARGEST_FRICTION = 1.5
_TRAIL = (0.0, 0.1)
_SHAPE, _PEAK = (0.5, 4.0), (0.3, 2.0)  # of doubts_about; Pacejka (2012), 4.3: C 1.3, D 1 of the load for a car tyre
_CHECK_SLIPS = np.array([-10.0, -4.0, 4.0, 10.0]) * DEGREE


def check_coefficients(fit: Pacejka89) -> None:
    """Refuse a set that describes no tyre, such as a fit broken off half way.

    Looks at loads of 200 to 1000 N (as far as the set goes): cornering stiffness over load, sign of the side force at
    4 degrees, side force over load up to 10 degrees, and the pneumatic trail.

    Parameters
    ----------
    fit : Pacejka89

    Raises
    ------
    InputError
        Naming the load, the value and the allowed range.
    """
    for load in (force for force in LOADS if force <= fit.load_max):
        stiffness = float(fit.cornering_stiffness(load=load)) * DEGREE
        lowest, highest = (limit * load for limit in _STIFFNESS_PER_LOAD)
        if not lowest <= stiffness <= highest:
            raise InputError(
                f"{fit.label}: cornering stiffness at {load:g} N is {stiffness:.4g} N/deg, a tyre has {lowest:g} to "
                f"{highest:g} N/deg; the fit is not usable"
            )
        forces = fit.side_force(slip_angle=_CHECK_SLIPS, load=load)
        if not (forces[1] < 0.0 < forces[2]):
            raise InputError(
                f"{fit.label}: side force at {load:g} N is {forces[1]:.4g} N at -4 deg, {forces[2]:.4g} N at +4 deg; "
                "its sign must follow the slip"
            )
        friction = float(np.abs(forces).max()) / load
        if not friction <= _LARGEST_FRICTION:
            raise InputError(
                f"{fit.label}: side force at {load:g} N reaches {friction:.3g} times the load, allowed is "
                f"{_LARGEST_FRICTION:g}"
            )
        if fit.aligning_moment_coefficients is not None:
            trail = float(fit.pneumatic_trail(load=load))
            if not _TRAIL[0] < trail < _TRAIL[1]:
                raise InputError(
                    f"{fit.label}: pneumatic trail at {load:g} N is {trail * 1e3:.3g} mm, allowed are "
                    f"{_TRAIL[0] * 1e3:g} to {_TRAIL[1] * 1e3:g} mm"
                )


def doubts_about(fit: Pacejka89) -> list[str]:
    """What is odd about coefficients that describe a tyre: shape and peak that the data did not settle.

    Parameters
    ----------
    fit : Pacejka89
    """
    shape, load = fit.side_force_coefficients[0], 0.4  # kN, of a bicycle's wheel
    peak = (fit.side_force_coefficients[1] * load + fit.side_force_coefficients[2]) / 1e3
    found = []
    if not _SHAPE[0] <= shape <= _SHAPE[1]:
        found.append(f"C = {shape:.4g} (usual {_SHAPE[0]:g} to {_SHAPE[1]:g})")
    if not _PEAK[0] <= peak <= _PEAK[1]:
        found.append(f"D = {peak:.4g} times the load at 400 N (usual {_PEAK[0]:g} to {_PEAK[1]:g})")
    if not found:
        return []
    return [f"{fit.label}: {', '.join(found)}: the data did not settle C, D and E one by one; its slope is what holds"]


def read_pacejka89(source: str | Path | Traversable) -> Pacejka89Tyre:
    """Read a tyre of kind ``pacejka89`` and check its coefficients.

    Parameters
    ----------
    source : str, Path or Traversable
        A TOML file, or the stem of one in ``data/tyres``.

    Returns
    -------
    Pacejka89Tyre

    Raises
    ------
    InputError
        When the file is missing, has unknown or missing keys, or a set fails ``check_coefficients``.
    """
    if isinstance(source, str) and not source.endswith(".toml"):
        source = data_root() / "tyres" / f"{source}.toml"
    file = Path(source) if isinstance(source, str) else source
    try:
        table = tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{source}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{source}: is not valid TOML: {error}") from None
    return _interpret(table, str(source))


def _interpret(table: Mapping[str, Any], where: str) -> Pacejka89Tyre:
    if table.get("kind") != KIND:
        raise InputError(f"{where}: kind = {table.get('kind')!r}, expected {KIND!r}")
    _refuse_keys(table, _KEYS, _KEYS - {"note", "slip_unit"}, where)
    if table.get("slip_unit", "deg") not in SLIP_UNITS:
        raise InputError(f"{where}: slip_unit = {table['slip_unit']!r} is neither 'deg' nor 'rad'")
    sets: list[Pacejka89] = []
    if not isinstance(table["set"], list) or not table["set"]:
        raise InputError(f"{where}: a set is missing; write [[set]] and its coefficients below it")
    for entry in table["set"]:
        _refuse_keys(entry, _SET_KEYS, _SET_KEYS - _MAY_MISS, f"{where}, set")
        aligning = entry.get("aligning_moment")
        fit = Pacejka89(
            label=f"{table['tyre']}, {entry['label']}",
            pressure=_positive(entry, "pressure_kPa", f"{where}, set") * 1e3,
            load_max=_positive(table, "load_max_N", where),
            side_force_coefficients=_numbers(entry["side_force"], _LATERAL, f"{where}, side_force"),
            aligning_moment_coefficients=(
                None if aligning is None else _numbers(aligning, _ALIGNING, f"{where}, aligning_moment")
            ),
            slip_unit=table.get("slip_unit", "deg"),
            lateral_stiffness=_stiffness(entry, where),
        )
        check_coefficients(fit)
        sets.append(fit)
    without = [fit for fit in sets if fit.lateral_stiffness is None]
    if without and len(without) < len(sets):
        raise InputError(f"{where}: lateral_stiffness_N_per_mm is missing in {without[0].label}; give it in every set")
    if len({fit.pressure for fit in sets}) < len(sets):
        raise InputError(f"{where}: two sets have one pressure_kPa; keep one of them")
    note = table.get("note", [])
    tyre = Pacejka89Tyre(
        tyre=table["tyre"],
        surface=table["surface"],
        sets=tuple(sorted(sets, key=lambda fit: fit.pressure)),
        source=table["source"],
        notes=(note,) if isinstance(note, str) else tuple(note),
    )
    return replace(tyre, notes=(*tyre.notes, *tyre.doubts))


def _refuse_keys(table: Mapping[str, Any], known: set[str], required: set[str], where: str) -> None:
    for key in sorted(set(table) - known):
        raise InputError(f"{where}: key {key!r} is unknown (known: {', '.join(sorted(known))})")
    for key in sorted(required - set(table)):
        raise InputError(f"{where}: key {key!r} is missing")


def _numbers(values: Any, count: int, where: str) -> tuple[float, ...]:
    if not isinstance(values, list) or len(values) != count or not all(isinstance(v, int | float) for v in values):
        raise InputError(f"{where}: must be a list of {count} numbers")
    return tuple(float(value) for value in values)


def _positive(table: Mapping[str, Any], key: str, where: str) -> float:
    value = table[key]
    if not is_number(value) or not 0 < value < 1e5:
        raise InputError(f"{where}: {key} = {shown(value)} must be a positive number")
    return float(value)


def _stiffness(entry: Mapping[str, Any], where: str) -> float | None:
    value = entry.get("lateral_stiffness_N_per_mm")
    if value is None:
        return None
    if not is_number(value) or not 1 < value < 1000:
        raise InputError(
            f"{where}, set: lateral_stiffness_N_per_mm = {shown(value)} must be a number of 1 to 1000 N/mm"
        )
    return float(value) * 1e3
