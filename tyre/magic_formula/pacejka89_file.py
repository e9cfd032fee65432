"""Files of Pacejka-89 coefficients, and what they must be to describe a tyre."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.checks import Check, list_of, number, text
from tyre.base.errors import InputError
from tyre.base.paths import data_root
from tyre.base.plausible import LARGEST, SMALLEST
from tyre.base.schema import maybe, needed, read, table
from tyre.base.toml_file import read_toml
from tyre.magic_formula.pacejka89 import DEGREE, SLIP_UNITS, Pacejka89
from tyre.magic_formula.pacejka89_tyre import LOADS, Pacejka89Tyre

KIND = "pacejka89"
_LATERAL, _ALIGNING = 14, 18
_NOTES = "must be text in quotes, or a list of texts"


def _notes(value: Any) -> Any:
    return value if isinstance(value, str) else list_of(text(), _NOTES)(value)


def _coefficients(count: int) -> Check:
    return list_of(number(least=-LARGEST, most=LARGEST), f"must be a list of {count} numbers", least=count, most=count)


SET = table(
    {
        needed("label"): text(), needed("pressure_kPa"): number(above=0, least=SMALLEST, most=1e5),
        needed("side_force"): _coefficients(_LATERAL), maybe("aligning_moment"): _coefficients(_ALIGNING),
        maybe("lateral_stiffness_N_per_mm"): number(above=1, most=1000, says="must be a number of 1 to 1000 N/mm"),
    }
)  # fmt: skip
FILE = table(
    {
        needed("kind"): text(f"must be {KIND!r}", allowed=(KIND,)),
        needed("tyre"): text(blank=False), needed("surface"): text(blank=False), needed("source"): text(),
        needed("licence"): text(), needed("load_max_N"): number(above=0, least=SMALLEST, most=1e5),
        maybe("slip_unit", "deg"): text("is neither 'deg' nor 'rad'", allowed=tuple(SLIP_UNITS)),
        maybe("note", []): _notes,
        needed("set", "a set is missing; write [[set]] and its coefficients below it"): list_of(
            SET, "must be tables: write [[set]] and its coefficients below it", least=1, strict=False
        ),
    }
)  # fmt: skip
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
    with np.errstate(all="ignore"):  # what is not finite is refused
        _check_at(fit, [load for load in LOADS if load <= fit.load_max])


def _check_at(fit: Pacejka89, loads: Sequence[float]) -> None:
    for load in loads:
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
    return _interpret(read_toml(file, "file of Pacejka-89 coefficients"), str(source))


def _interpret(content: Mapping[str, Any], where: str) -> Pacejka89Tyre:
    given = read(FILE, content, where=where)
    sets: list[Pacejka89] = []
    for entry in given["set"]:
        stiffness = entry.get("lateral_stiffness_N_per_mm")
        fit = Pacejka89(
            label=f"{given['tyre']}, {entry['label']}",
            pressure=entry["pressure_kPa"] * 1e3,
            load_max=given["load_max_N"],
            side_force_coefficients=tuple(entry["side_force"]),
            aligning_moment_coefficients=tuple(entry["aligning_moment"]) if "aligning_moment" in entry else None,
            slip_unit=given["slip_unit"],
            lateral_stiffness=None if stiffness is None else stiffness * 1e3,
        )
        check_coefficients(fit)
        sets.append(fit)
    without = [fit for fit in sets if fit.lateral_stiffness is None]
    if without and len(without) < len(sets):
        raise InputError(f"{where}: lateral_stiffness_N_per_mm is missing in {without[0].label}; give it in every set")
    if len({fit.pressure for fit in sets}) < len(sets):
        raise InputError(f"{where}: two sets have one pressure_kPa; keep one of them")
    note = given["note"]
    tyre = Pacejka89Tyre(
        tyre=given["tyre"],
        surface=given["surface"],
        sets=tuple(sorted(sets, key=lambda fit: fit.pressure)),
        source=given["source"],
        notes=(note,) if isinstance(note, str) else tuple(note),
    )
    return replace(tyre, notes=(*tyre.notes, *tyre.doubts))
