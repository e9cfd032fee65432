"""The numbers of a .tir file in SI units: lateral coefficients, and those of camber and moments."""

import difflib
from dataclasses import dataclass
from functools import cached_property
from math import inf, isfinite, nan

from tyre.base.errors import InputError, shown
from tyre.base.plausible import LARGEST, SMALLEST
from tyre.magic_formula.tir_coefficients import MF52Lateral, MF61Lateral
from tyre.magic_formula.tir_moments import NAMES, TirMoments
from tyre.magic_formula.tir_text import TirText
from tyre.recordings.units import find_unit

_UNIT_KEYS = {"LENGTH": ("length", "meter"), "FORCE": ("force", "newton"), "PRESSURE": ("pressure", "")}
_PLAUSIBLE_PRESSURE = (0.2e5, 25e5)
_MF6_FITTYP, _MF52_FITTYP = (60, 61, 62), (5, 6, 21, 51, 52)
_MF52_FORMATS = ("PAC2002", "MF_05", "MF-TYRE")


@dataclass(frozen=True)
class TirNumbers:
    """The numbers of one file, ISO signs as they stand there.

    ``text`` is the file; a missing, mistyped or impossible number raises an `InputError` with its name.
    """

    text: TirText

    @cached_property
    def lateral(self) -> MF61Lateral | MF52Lateral:
        """Coefficients of C_Fy and K_y; the model must be MF-Tyre 5.2, 6.1 or 6.2."""
        return self._mf61() if self._is_mf6() else self._mf52()

    @cached_property
    def moments(self) -> TirMoments:
        """Coefficients of camber force and moments."""
        model = self.lateral
        radius = self.number("UNLOADED_RADIUS", nan) * self.length
        return TirMoments(
            coefficients={name: self.number(name) for name in NAMES if self.text.find(name) is not None},
            nominal_load=model.lfzo * model.fnomin,
            nominal_pressure=model.nompres if isinstance(model, MF61Lateral) else None,
            unloaded_radius=radius if radius > 0 else None,
            iso_signs=model.pky1 < 0,
        )

    @cached_property
    def lateral_stiffness(self) -> float:
        """LATERAL_STIFFNESS, N/m; NaN where it is missing or 0."""
        value = self.number("LATERAL_STIFFNESS", 0.0)
        return self.positive("LATERAL_STIFFNESS") * self.force / self.length if value else nan

    def _is_mf6(self) -> bool:
        model = self.text.find("FITTYP", "PROPERTY_FILE_FORMAT")
        if isinstance(model, float) and model in _MF6_FITTYP:
            return True
        if (isinstance(model, float) and model in _MF52_FITTYP) or str(model).upper() in _MF52_FORMATS:
            return False
        raise InputError(
            f"{self.text.source}: tyre model FITTYP or PROPERTY_FILE_FORMAT = {model!r} is neither MF-Tyre 5.2 "
            f"({_MF52_FITTYP}, {_MF52_FORMATS}) nor 6.1 or 6.2 ({_MF6_FITTYP})"
        )

    def _mf61(self) -> MF61Lateral:
        pressure = self.pressure
        return MF61Lateral(
            fnomin=self.positive("FNOMIN") * self.force,
            nompres=self._plausible("NOMPRES", self.positive("NOMPRES") * pressure),
            pky1=self.number("PKY1"),
            pky2=self.positive("PKY2"),
            ppy1=self.number("PPY1", 0.0),
            ppy2=self.number("PPY2", 0.0),
            lateral_stiffness=self.lateral_stiffness,
            pcfy1=self.number("PCFY1", 0.0),
            pcfy2=self.number("PCFY2", 0.0),
            pcfy3=self.number("PCFY3", 0.0),
            load_range=self._range("FZMIN", "FZMAX", self.force),
            pressure_range=self._range("PRESMIN", "PRESMAX", pressure),
            pky4=self.number("PKY4", 2.0),
            lfzo=self.positive("LFZO", 1.0),
            lky=self.positive("LKY", 1.0),
        )

    def _mf52(self) -> MF52Lateral:
        stated = self.text.find("INFLPRES", "NOMPRES")
        pressure = float(stated) * self.pressure if isinstance(stated, float) else nan
        return MF52Lateral(
            fnomin=self.positive("FNOMIN") * self.force,
            pressure=self._plausible("INFLPRES or NOMPRES", pressure) if isfinite(pressure) else pressure,
            unloaded_radius=self.positive("UNLOADED_RADIUS") * self.length,
            pky1=self.number("PKY1"),
            pky2=self.positive("PKY2"),
            pty1=self.number("PTY1", 0.0),
            pty2=self.positive("PTY2", 1.0),
            load_range=self._range("FZMIN", "FZMAX", self.force),
            pky3=self.number("PKY3", 0.0),
            lfzo=self.positive("LFZO", 1.0),
            lky=self.positive("LKY", 1.0),
            lsgal=self.positive("LSGAL", 1.0),
        )

    @cached_property
    def force(self) -> float:
        """Unit of force, N."""
        return self._unit("FORCE")

    @cached_property
    def length(self) -> float:
        """Unit of length, m."""
        return self._unit("LENGTH")

    @cached_property
    def pressure(self) -> float:
        """Unit of pressure, Pa; that of force over length squared where none is stated."""
        if "PRESSURE" in self.text.sections.get("UNITS", {}):
            return self._unit("PRESSURE")
        return self.force / self.length**2

    def _unit(self, key: str) -> float:
        units = self.text.sections.get("UNITS", {})
        angle = str(units.get("ANGLE", "radians")).casefold()
        if angle not in ("radian", "radians", "rad"):
            raise InputError(
                f"{self.text.source}, [UNITS]: ANGLE = {angle!r}; only coefficients in radians are understood"
            )
        quantity, default = _UNIT_KEYS[key]
        text = str(units.get(key, default)).casefold()
        plain = {"pascal": "pa", "kpascal": "kpa", "millimeter": "mm", "centimeter": "cm", "kilonewton": "kn"}
        return find_unit(plain.get(text, text), quantity, where=f"{self.text.source}, [UNITS] {key}").factor

    def number(self, key: str, default: float | None = None) -> float:
        """Return one number in the units of the file.

        Parameters
        ----------
        key : str
            Its name.
        default : float, optional
            Where it is missing, in the same unit; None: it must be there.
        """
        value = self.text.find(key)
        if value is None and default is not None:
            return default
        if not isinstance(value, float) or not isfinite(value):
            known = sorted({name for section in self.text.sections.values() for name in section})
            near = difflib.get_close_matches(key, known, n=1) if value is None else []
            state = "is missing" if value is None else f"is {shown(value)}, not a number"
            raise InputError(f"{self.text.source}: {key} {state}" + (f"; did you mean {near[0]}?" if near else ""))
        if abs(value) > LARGEST:
            raise InputError(f"{self.text.source}: {key} = {value:g} must be a number up to {LARGEST:g} in size")
        return value

    def positive(self, key: str, default: float | None = None) -> float:
        """Return one number that must be positive.

        Parameters
        ----------
        key : str
            Its name.
        default : float, optional
            Where it is missing, in the same unit; None: it must be there.
        """
        value = self.number(key, default)
        if not SMALLEST <= value <= LARGEST:
            raise InputError(f"{self.text.source}: {key} = {value:g} must be positive, {SMALLEST:g} to {LARGEST:g}")
        return value

    def _plausible(self, key: str, pressure: float) -> float:
        lowest, highest = _PLAUSIBLE_PRESSURE
        if not lowest <= pressure <= highest:
            raise InputError(
                f"{self.text.source}: {key} is {pressure:g} Pa, tyres have {lowest:g} to {highest:g} Pa; check [UNITS]"
            )
        return pressure

    def _range(self, low: str, high: str, factor: float) -> tuple[float, float]:
        ends = self.number(low, 0.0) * factor, self.number(high) * factor if self.text.find(high) is not None else inf
        if not ends[0] <= ends[1]:
            raise InputError(f"{self.text.source}: {low} = {ends[0]:g} is above {high} = {ends[1]:g}; exchange them")
        return ends
