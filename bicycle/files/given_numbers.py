"""The numbers of a bicycle as a file holds them: text or numbers, in SI or with their units, each with its place."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from bicycle.parameters import UNITS, UNUSED
from tyre.base.errors import InputError, is_number, refuse_unknown, shown, unknown
from tyre.base.measured_number import MeasuredNumber, measured_number
from tyre.base.unit_words import factor_to_si

LEFT_OUT = {"v": "", "yB": "", "yH": "", "IRzz": "IRxx", "IFzz": "IFxx"}  # key -> the key whose value it must have
INERTIA = "kg m^2"
GROUPS = {"length": "m", "angle": "rad", "mass": "kg", "inertia": INERTIA}
"""Names under which a file states the unit of all parameters of one sort."""


def si_unit(key: str) -> str:
    """The SI unit of a ``key`` of a bicycle file, also of one that is left out."""
    return "m/s" if key == "v" else "m" if key in ("yB", "yH") else UNITS.get(key, INERTIA)


@dataclass
class GivenNumbers:
    """Numbers gathered from a file, one :meth:`add` each, in the order of the file.

    Attributes
    ----------
    units : mapping of str to str
        Unit of what is written without one, by key or by a name of :data:`GROUPS`; else SI.
    values, sd : dict
        SI, lam in rad.
    notes : list of str
        What was left out and differs from what is taken.
    """

    units: Mapping[str, str] = field(default_factory=dict)
    values: dict[str, Any] = field(default_factory=dict)
    sd: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    _left_out: dict[str, tuple[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        refuse_unknown("key of units:", self.units, [*UNITS, *UNUSED, *GROUPS])
        for key, unit in self.units.items():
            if not isinstance(unit, str):
                raise InputError(f'units: {key} = {shown(unit)} must be a unit in quotes, such as "mm"')
            factor_to_si(unit, GROUPS.get(key) or si_unit(key), where=f"units: {key}")

    def add(self, key: str, value: Any, *, where: str, unit: str = "") -> None:
        """Add the value of a parameter.

        Parameters
        ----------
        key : str
        value : str or float
            Text as of :func:`tyre.base.measured_number.measured_number`, or a number, in the unit stated.
        where : str
            File and line, for the message.
        unit : str
            Of a value without one; by default as stated for the file.

        Raises
        ------
        InputError
            An unknown or repeated key, or a value that is no number.
        """
        if key in self.values or key in self._left_out:
            raise InputError(f"{where}: {key} is given twice; keep one")
        if key not in UNITS and key not in UNUSED and key not in LEFT_OUT:
            raise InputError(f"{where}: {unknown('key', key, [*UNITS, *UNUSED])}")
        number = self._number(key, value, where, unit)
        if key in LEFT_OUT:
            self._left_out[key] = (where, number.value)
            return
        self.values[key] = number.value
        if number.sd is not None:
            self.sd[key] = number.sd

    def add_sd(self, key: str, value: Any, *, where: str, unit: str = "") -> None:
        """Add a standard deviation that stands by itself.

        Parameters
        ----------
        key : str
        value : str or float
            In the unit stated.
        where : str
            File and line, for the message.
        unit : str
            Of a value without one; by default as stated for the file.
        """
        if key in self.sd:
            raise InputError(f"{where}: the standard deviation of {key} is given twice; keep one")
        if key in LEFT_OUT:
            return
        refuse_unknown("key", [key], [*UNITS, *UNUSED], where=f"{where}: standard deviation")
        number = self._number(key, value, where, unit)
        if number.sd is not None:
            raise InputError(
                f"{where}: the standard deviation of {key} = {value!r} has one of its own; give one number"
            )
        self.sd[key] = number.value

    def finish(self) -> None:
        """Note what was left out and is not what symmetry gives."""
        found = (_left_out(where, key, value, self.values) for key, (where, value) in self._left_out.items())
        self.notes += [note for note in found if note]

    def _number(self, key: str, value: Any, where: str, unit: str) -> MeasuredNumber:
        si = si_unit(key)
        unit = unit or self.units.get(key) or next((u for n, u in self.units.items() if GROUPS.get(n) == si), si)
        if isinstance(value, str):
            return measured_number(value, where=where, key=key, si=si, unit=unit)
        if unit == si or not is_number(value) or value - value != 0:
            return MeasuredNumber(value)  # the bicycle itself refuses what is no finite number
        return MeasuredNumber(float(Fraction(float(value)) * factor_to_si(unit, si, where=where)))


def _left_out(where: str, key: str, number: float, values: Mapping[str, float]) -> str:
    """What to tell of a key that is not used; nothing where the symmetry of bicycle and wheels gives its value."""
    if key == "v":
        return f"{where}: the speed v = {number:g} m/s is not a property of the bicycle and is not used"
    twin = LEFT_OUT[key]
    if number == values.get(twin, 0.0):
        return ""
    why = f"a wheel is symmetric about its axle, so {twin} is taken" if twin else "the bicycle is taken as symmetric"
    return f"{where}: {key} = {number:g} is not used: {why}"
