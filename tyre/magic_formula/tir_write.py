"""Tyre property files (.tir) written from measured stiffnesses, in SI units and ISO signs."""

from collections.abc import Mapping
from math import isfinite
from pathlib import Path

from tyre.base.errors import InputError
from tyre.base.files import write_text
from tyre.magic_formula.tir_coefficients import MF52Lateral, MF61Lateral


def write_tir(
    coefficients: MF61Lateral | MF52Lateral,
    path: str | Path,
    *,
    tyre: str,
    surface: str,
    unloaded_radius: float | None = None,
    version: int = 61,
    further: Mapping[str, float] | None = None,
    notes: tuple[str, ...] = (),
) -> None:
    """Write lateral stiffnesses as a tyre property file, SI units, ISO signs.

    Parameters
    ----------
    coefficients : MF61Lateral or MF52Lateral
        A 5.2 file holds one pressure: write one file per pressure.
    path : str or Path
        Ends in ``.tir``.
    tyre, surface : str
        Kept in comment lines, which ``read_tir`` understands.
    unloaded_radius : float, optional
        Of the tyre, m; needed for an ``MF61Lateral``, an ``MF52Lateral`` has its own.
    version : {61, 62}
        FITTYP of an ``MF61Lateral``; both have the same lateral stiffnesses.
    further : mapping of str to float, optional
        More lateral coefficients (SI) such as PCY1 and PDY1, which a slip sweep of a few degrees does not identify.
    notes : tuple of str
        More comment lines, for example that the data are synthetic.

    Raises
    ------
    InputError
        When the path, the version or PKY1 (ISO: negative) is wrong, or the radius is missing.
    """
    path = Path(path)
    if path.suffix.casefold() != ".tir":
        raise InputError(f"{path}: a tyre property file must end in .tir")
    if version not in (61, 62):
        raise InputError(f"{path}: version {version} is neither 61 nor 62")
    if not coefficients.pky1 < 0.0:
        raise InputError(f"{path}: PKY1 = {coefficients.pky1:g} must be negative in the ISO signs of a .tir file")
    radius = coefficients.unloaded_radius if isinstance(coefficients, MF52Lateral) else unloaded_radius
    if radius is None or not radius > 0.0:
        raise InputError(f"{path}: the unloaded radius (m) of the tyre is needed in a .tir file, got {radius}")
    sections = _sections(coefficients, radius, version)
    sections["LATERAL_COEFFICIENTS"] |= dict(further or {})
    comments = (f": TYRE : {tyre}", f": SURFACE : {surface}", *notes, "lateral stiffness and relaxation length only")
    lines = ["[MDI_HEADER]", "FILE_TYPE = 'tir'", "FILE_VERSION = 3.0", "FILE_FORMAT = 'ASCII'"]
    lines += [f"! {' '.join(comment.split())}" for comment in comments]
    for section, values in sections.items():
        lines += [f"$ {'-' * (69 - len(section))} {section.lower()}", f"[{section}]"]
        lines += [f"{key:<28} = {_printed(value)}" for key, value in values.items()]
    write_text(path, "\n".join(lines) + "\n")


def _printed(value: float | str) -> str:
    if isinstance(value, str):
        return f"'{value}'"
    return str(value) if isinstance(value, int) else repr(float(value))


def _sections(
    model: MF61Lateral | MF52Lateral, unloaded_radius: float, version: int
) -> dict[str, dict[str, float | str]]:
    units: dict[str, float | str] = {
        "LENGTH": "meter",
        "FORCE": "newton",
        "ANGLE": "radians",
        "MASS": "kg",
        "TIME": "second",
    }
    sections: dict[str, dict[str, float | str]] = {
        "UNITS": units,
        "MODEL": {"FITTYP": version},
        "DIMENSION": {"UNLOADED_RADIUS": float(unloaded_radius)},
        "OPERATING_CONDITIONS": {},
        "VERTICAL": {"FNOMIN": model.fnomin},
        "VERTICAL_FORCE_RANGE": {"FZMIN": model.load_range[0], "FZMAX": model.load_range[1]},
        "SCALING_COEFFICIENTS": {"LFZO": model.lfzo, "LKY": model.lky},
        "LATERAL_COEFFICIENTS": {"PKY1": model.pky1, "PKY2": model.pky2},
    }
    if isinstance(model, MF61Lateral):
        sections["OPERATING_CONDITIONS"] = {"INFLPRES": model.nompres, "NOMPRES": model.nompres}
        sections["INFLATION_PRESSURE_RANGE"] = {
            "PRESMIN": model.pressure_range[0],
            "PRESMAX": model.pressure_range[1],
        }
        sections["STRUCTURAL"] = {
            **({"LATERAL_STIFFNESS": model.lateral_stiffness} if isfinite(model.lateral_stiffness) else {}),
            "PCFY1": model.pcfy1,
            "PCFY2": model.pcfy2,
            "PCFY3": model.pcfy3,
        }
        sections["LATERAL_COEFFICIENTS"] |= {"PKY4": model.pky4, "PPY1": model.ppy1, "PPY2": model.ppy2}
    else:
        sections["MODEL"] = {"FITTYP": 52, "PROPERTY_FILE_FORMAT": "PAC2002"}
        sections["OPERATING_CONDITIONS"] = {"INFLPRES": model.pressure}
        sections["SCALING_COEFFICIENTS"]["LSGAL"] = model.lsgal
        sections["LATERAL_COEFFICIENTS"] |= {"PKY3": model.pky3, "PTY1": model.pty1, "PTY2": model.pty2}
    return sections
