"""Tyre property files (.tir) read: what they say of C_Fy, K_y and relaxation length at a load and pressure."""

import difflib
import re
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from tyre.base.errors import InputError
from tyre.magic_formula.tir_coefficients import MF52Lateral, MF61Lateral
from tyre.magic_formula.tir_write import write_tir
from tyre.properties import TyreProperties
from tyre.recordings.units import find_unit

__all__ = ["MF52Lateral", "MF61Lateral", "TirFile", "parse_tir", "read_tir", "write_tir"]

_UNIT_KEYS = {"LENGTH": ("length", "meter"), "FORCE": ("force", "newton"), "PRESSURE": ("pressure", "")}
_SAME_PRESSURE = 0.02  # MF-Tyre 5.2 knows one pressure; a rig sets it within this share
_PLAUSIBLE_PRESSURE = (0.2e5, 25e5)
_MF6_FITTYP, _MF52_FITTYP = (60, 61, 62), (5, 6, 21, 51, 52)
_MF52_FORMATS = ("PAC2002", "MF_05", "MF-TYRE")
_ASSIGNMENT = re.compile(r"^\s*([A-Za-z_]\w*)\s*=\s*(.*)$")
_FIELD_COMMENT = re.compile(r"^!\s*:?\s*(TYRE|SURFACE)\s*:\s*(.+)$")


@dataclass(frozen=True)
class TirFile:
    """A .tir file: its text verbatim and its values.

    Attributes
    ----------
    source : str
        Name for error messages.
    text : str
        The whole file.
    sections : dict of str to dict of str to (float or str)
        Values by section and key, in the units of the file; keys without a value are left out.
    comments : dict of str to str
        ``TYRE`` and ``SURFACE`` from the comment lines, where the file has them.
    """

    source: str
    text: str = field(repr=False)
    sections: dict[str, dict[str, float | str]]
    comments: dict[str, str]

    @cached_property
    def coefficients(self) -> MF61Lateral | MF52Lateral:
        """Lateral coefficients in SI units, ISO signs as in the file.

        Raises
        ------
        InputError
            When the model is neither MF-Tyre 5.2 nor 6.1/6.2, or a needed coefficient is missing or out of range.
        """
        return self._mf61() if self._is_mf6() else self._mf52()

    def properties_at(self, *, load: float, pressure: float) -> TyreProperties:
        """C_Fy, K_y and relaxation length without camber at one load (N) and pressure (Pa).

        Returns
        -------
        TyreProperties
            Its covariance is NaN, as the format holds none; ``origin`` is ``interpolated`` within the load and
            pressure ranges of the file and ``extrapolated`` beyond them.

        Raises
        ------
        InputError
            When load or pressure is not positive, a 5.2 file is asked for another pressure than its own, or the
            coefficients give no positive stiffness there.
        """
        if not (0.0 < load < np.inf and 0.0 < pressure < np.inf):
            raise InputError(f"{self.source}: load {load:g} N and pressure {pressure:g} Pa must be positive and finite")
        model = self.coefficients
        notes = ["from a .tir file: no uncertainty is stored in the format"]
        with np.errstate(all="ignore"):
            if isinstance(model, MF61Lateral):
                slope = float(model.cornering_stiffness(load=load, pressure=pressure))
                stiffness = float(model.lateral_stiffness_at(load=load, pressure=pressure))
                inside = model.pressure_range[0] <= pressure <= model.pressure_range[1]
            else:
                inside = self._check_pressure(model, pressure, notes)
                slope = float(model.cornering_stiffness(load=load))
                stiffness = self._stiffness_52(model, load, slope, notes)
        if slope < 0.0:
            slope = -slope
            notes.append("PKY1 is positive: the file does not keep ISO signs, the size of Kya is used")
        inside = inside and model.load_range[0] <= load <= model.load_range[1]
        if not (0.0 < slope < np.inf and 0.0 < stiffness < np.inf):
            raise InputError(
                f"{self.source}: at {load:g} N and {pressure / 1e5:g} bar the coefficients give C = {slope:g} N/rad, "
                f"K = {stiffness:g} N/m; both must be positive, stay nearer to the range of the file"
            )
        if "SURFACE" not in self.comments:
            notes.append("the file names no surface: taken as flat")
        return TyreProperties(
            tyre=self.comments.get("TYRE", Path(self.source).stem),
            surface=self.comments.get("SURFACE", "flat"),
            load=float(load),
            pressure=float(pressure),
            cornering_stiffness=slope,
            lateral_stiffness=stiffness,
            relaxation_length=slope / stiffness,
            covariance=np.full((3, 3), np.nan),
            origin="interpolated" if inside else "extrapolated",
            notes=tuple(notes),
        )

    def _check_pressure(self, model: MF52Lateral, pressure: float, notes: list[str]) -> bool:
        if np.isnan(model.pressure):
            notes.append("the file states no pressure: its values are taken at the one asked for")
        elif abs(pressure - model.pressure) > _SAME_PRESSURE * model.pressure:
            raise InputError(
                f"{self.source}: an MF-Tyre 5.2 file holds one pressure, here {model.pressure / 1e5:g} bar; "
                f"{pressure / 1e5:g} bar needs a file of its own"
            )
        return True

    def _stiffness_52(self, model: MF52Lateral, load: float, slope: float, notes: list[str]) -> float:
        if model.pty1 > 0.0:
            return abs(slope) / float(model.relaxation_length(load=load))
        stiffness = self._number("LATERAL_STIFFNESS", 0.0) * self._force / self._length
        if stiffness > 0.0:
            notes.append("no relaxation coefficients PTY1, PTY2: LATERAL_STIFFNESS gives the relaxation length")
            return stiffness
        raise InputError(f"{self.source}: has neither PTY1 and PTY2 nor LATERAL_STIFFNESS: no relaxation length")

    def _is_mf6(self) -> bool:
        model = self._find("FITTYP", "PROPERTY_FILE_FORMAT")
        if isinstance(model, float) and model in _MF6_FITTYP:
            return True
        if (isinstance(model, float) and model in _MF52_FITTYP) or str(model).upper() in _MF52_FORMATS:
            return False
        raise InputError(
            f"{self.source}: tyre model FITTYP or PROPERTY_FILE_FORMAT = {model!r} is neither MF-Tyre 5.2 "
            f"({_MF52_FITTYP}, {_MF52_FORMATS}) nor 6.1 or 6.2 ({_MF6_FITTYP})"
        )

    def _mf61(self) -> MF61Lateral:
        pressure = self._pressure_unit
        return MF61Lateral(
            fnomin=self._positive("FNOMIN") * self._force,
            nompres=self._plausible("NOMPRES", self._positive("NOMPRES") * pressure),
            pky1=self._number("PKY1"),
            pky2=self._positive("PKY2"),
            ppy1=self._number("PPY1", 0.0),
            ppy2=self._number("PPY2", 0.0),
            lateral_stiffness=self._positive("LATERAL_STIFFNESS") * self._force / self._length,
            pcfy1=self._number("PCFY1", 0.0),
            pcfy2=self._number("PCFY2", 0.0),
            pcfy3=self._number("PCFY3", 0.0),
            load_range=self._range("FZMIN", "FZMAX", self._force),
            pressure_range=self._range("PRESMIN", "PRESMAX", pressure),
            pky4=self._number("PKY4", 2.0),
            lfzo=self._positive("LFZO", 1.0),
            lky=self._positive("LKY", 1.0),
        )

    def _mf52(self) -> MF52Lateral:
        stated = self._find("INFLPRES", "NOMPRES")
        pressure = float(stated) * self._pressure_unit if isinstance(stated, float) else float("nan")
        return MF52Lateral(
            fnomin=self._positive("FNOMIN") * self._force,
            pressure=pressure if np.isnan(pressure) else self._plausible("INFLPRES or NOMPRES", pressure),
            unloaded_radius=self._positive("UNLOADED_RADIUS") * self._length,
            pky1=self._number("PKY1"),
            pky2=self._positive("PKY2"),
            pty1=self._number("PTY1", 0.0),
            pty2=self._positive("PTY2", 1.0),
            load_range=self._range("FZMIN", "FZMAX", self._force),
            pky3=self._number("PKY3", 0.0),
            lfzo=self._positive("LFZO", 1.0),
            lky=self._positive("LKY", 1.0),
            lsgal=self._positive("LSGAL", 1.0),
        )

    @cached_property
    def _force(self) -> float:
        return self._unit("FORCE")

    @cached_property
    def _length(self) -> float:
        return self._unit("LENGTH")

    @cached_property
    def _pressure_unit(self) -> float:
        if "PRESSURE" in self.sections.get("UNITS", {}):
            return self._unit("PRESSURE")
        return self._force / self._length**2

    def _unit(self, key: str) -> float:
        units = self.sections.get("UNITS", {})
        angle = str(units.get("ANGLE", "radians")).casefold()
        if angle not in ("radian", "radians", "rad"):
            raise InputError(f"{self.source}, [UNITS]: ANGLE = {angle!r}; only coefficients in radians are understood")
        quantity, default = _UNIT_KEYS[key]
        text = str(units.get(key, default)).casefold()
        plain = {"pascal": "pa", "kpascal": "kpa", "millimeter": "mm", "centimeter": "cm", "kilonewton": "kn"}
        return find_unit(plain.get(text, text), quantity, where=f"{self.source}, [UNITS] {key}").factor

    def _find(self, *keys: str) -> float | str | None:
        for key in keys:
            for section in self.sections.values():
                if key in section:
                    return section[key]
        return None

    def _number(self, key: str, default: float | None = None) -> float:
        value = self._find(key)
        if value is None and default is not None:
            return default
        if not isinstance(value, float) or not np.isfinite(value):
            known = sorted({name for section in self.sections.values() for name in section})
            near = difflib.get_close_matches(key, known, n=1) if value is None else []
            state = "is missing" if value is None else f"is {value!r}, not a number"
            raise InputError(f"{self.source}: {key} {state}" + (f"; did you mean {near[0]}?" if near else ""))
        return value

    def _positive(self, key: str, default: float | None = None) -> float:
        value = self._number(key, default)
        if not 0.0 < value < 1e12:
            raise InputError(f"{self.source}: {key} = {value:g} must be positive")
        return value

    def _plausible(self, key: str, pressure: float) -> float:
        lowest, highest = _PLAUSIBLE_PRESSURE
        if not lowest <= pressure <= highest:
            raise InputError(
                f"{self.source}: {key} is {pressure:g} Pa, tyres have {lowest:g} to {highest:g} Pa; check [UNITS]"
            )
        return pressure

    def _range(self, low: str, high: str, factor: float) -> tuple[float, float]:
        return self._number(low, 0.0) * factor, self._number(high, 1e11) * factor


def read_tir(path: str | Path) -> TirFile:
    """Read a tyre property file of MF-Tyre 5.2 (PAC2002), 6.1 or 6.2.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    TirFile

    Raises
    ------
    InputError
        When the file cannot be read, a line is no section, assignment, table or comment, or a key stands twice.
    """
    try:
        raw = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return parse_tir(text, source=str(path))


def parse_tir(text: str, *, source: str) -> TirFile:
    """Interpret the text of a .tir file; ``read_tir`` says what is refused."""
    sections: dict[str, dict[str, float | str]] = {}
    comments: dict[str, str] = {}
    current: dict[str, float | str] | None = None
    for number, line in enumerate(re.split(r"\r\n|\r|\n", text), start=1):
        where = f"{source}, line {number}"
        stripped = line.strip()
        if not stripped or stripped[0] in "$!#":
            if found := _FIELD_COMMENT.match(stripped):
                comments.setdefault(found.group(1), found.group(2).strip())
            continue
        if stripped[0] == "[":
            name = stripped.partition("]")[0][1:].strip().upper()
            current = sections.setdefault(name, {})
            continue
        assignment = _ASSIGNMENT.match(line)
        if assignment is None:
            if stripped[0] == "{" or re.fullmatch(r"[-+.\deE\s]+", re.split(r"[$!]", stripped)[0]):
                continue  # a table such as [SHAPE], of no use here and kept in the text
            raise InputError(f"{where}: {stripped[:60]!r} is no section, assignment, table row or comment")
        if current is None:
            raise InputError(f"{where}: {stripped[:60]!r} stands before the first [SECTION]; is this a .tir file?")
        key, value = assignment.group(1).upper(), _value(assignment.group(2))
        if value is None:
            continue
        if key in current:
            raise InputError(f"{where}: {key} is given twice in its section; keep one")
        current[key] = value
    if not sections:
        raise InputError(f"{source}: has no [SECTION]; is this a .tir file?")
    return TirFile(source, text, sections, comments)


def _value(text: str) -> float | str | None:
    text = text.strip()
    if text[:1] in ("'", '"'):
        return text[1:].partition(text[0])[0].strip()
    text = re.split(r"[$!]", text)[0].strip()
    if not text:
        return None
    try:
        return float(text)
    except ValueError:
        return text
