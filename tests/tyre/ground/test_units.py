"""Units in words."""

from fractions import Fraction

import pytest
import scipy.constants as c

from tyre.ground import (
    GRAVITY,
    PASCAL_PER_BAR,
    SPELLINGS,
    SYMBOLS,
    InputError,
    factor_to_si,
    find_unit,
    is_si,
    is_unit,
    quantity_of,
)


@pytest.mark.parametrize(("unit", "si", "factor"), [
    ("mm", "m", Fraction(1, 1000)), ("kN/rad", "N/rad", 1000), ("N/mm", "N/m", 1000), ("N_per_mm", "N/m", 1000),
    ("kg cm^2", "kg m^2", Fraction(1, 10**4)), ("kg*m²", "kg m^2", 1), ("kPa", "bar", Fraction(1, 100)),
    ("MPa", "N/m^2", 10**6), ("m/s**2", "m/s^2", 1), ("in", "mm", Fraction(254, 10)),
])  # fmt: skip
def test_factors_are_exact(unit, si, factor):
    assert factor_to_si(unit, si, where="f") == factor


@pytest.mark.parametrize("text", ["", "furlong", "N//m", "5", "N/m/", "N^", "kg m^x"])
def test_what_is_no_unit(text):
    assert not is_unit(text)
    with pytest.raises(InputError, match="f: .* is not a unit that is known; write for example N/m, N/mm, kN/m"):
        factor_to_si(text, "N/mm", where="f")


@pytest.mark.parametrize("text", ["1", "kg m^2", "N m s/rad", "1/s", "N/m", "rad/s"])
def test_si_units(text):
    assert is_si(text)


@pytest.mark.parametrize("text", ["furlong", "mm", "N/deg", "1/ms", "g", "", "1/", "2"])
def test_what_is_no_si_unit(text):
    assert not is_si(text)


def test_a_unit_of_another_quantity_is_told_with_those_that_fit():
    with pytest.raises(
        InputError, match=r"'N/mm' is no unit of what is given in N/deg; write for example N/rad, N/deg"
    ):
        factor_to_si("N/mm", "N/deg", where="f")


# every unit that a file may print, in SI, by scipy.constants (CODATA, NIST SP 811), a second source
SECOND = {
    "angle": {"rad": 1, "radian": 1, "radians": 1, "mrad": c.milli, "deg": c.degree, "degree": c.degree,
              "degrees": c.degree},
    "angular rate": {"rad/s": 1, "mrad/s": c.milli, "deg/s": c.degree, "dps": c.degree,
                     "rpm": 2 * c.pi / c.minute, "1/min": 2 * c.pi / c.minute, "rev/min": 2 * c.pi / c.minute,
                     "rev/s": 2 * c.pi},
    "angular acceleration": {"rad/s^2": 1, "deg/s^2": c.degree},
    "acceleration": {"m/s^2": 1, "cm/s^2": c.centi, "mm/s^2": c.milli, "g": c.g, "mg": c.milli * c.g,
                     "ft/s^2": c.foot},
    "force": {"N": 1, "newton": 1, "kN": c.kilo, "daN": c.deka, "kgf": c.kgf, "kp": c.kgf, "lbf": c.lbf,
              "pound_force": c.lbf},
    "moment": {"N m": 1, "N-m": 1, "kN m": c.kilo, "N cm": c.centi, "N mm": c.milli, "lbf ft": c.lbf * c.foot,
               "lbf in": c.lbf * c.inch, "kgf m": c.kgf, "kgf cm": c.kgf * c.centi, "kgf mm": c.kgf * c.milli,
               "kp m": c.kgf, "kp cm": c.kgf * c.centi},
    "length": {"m": 1, "meter": 1, "metre": 1, "mm": c.milli, "cm": c.centi, "km": c.kilo, "um": c.micro,
               "inch": c.inch, "in": c.inch, "ft": c.foot},
    "pressure": {"Pa": 1, "hPa": c.hecto, "kPa": c.kilo, "MPa": c.mega, "mbar": c.milli * c.bar, "bar": c.bar,
                 "psi": c.psi, "atm": c.atm, "kgf/cm^2": c.kgf / c.centi**2, "kp/cm^2": c.kgf / c.centi**2},
    "speed": {"m/s": 1, "km/h": c.kmh, "kmh": c.kmh, "kph": c.kmh, "mph": c.mph, "mm/s": c.milli, "cm/s": c.centi,
              "ft/s": c.foot},
    "time": {"s": 1, "sec": 1, "second": 1, "seconds": 1, "ms": c.milli, "msec": c.milli, "us": c.micro,
             "ns": c.nano, "min": c.minute, "h": c.hour, "d": c.day, "day": c.day, "days": c.day},
}  # fmt: skip
# of a table or key of ours, with the SI unit of its quantity
IN_KEYS = {
    "kg": {"kg": 1, "g": c.gram, "lb": c.lb},
    "m": {"m": 1, "cm": c.centi, "mm": c.milli, "in": c.inch, "inch": c.inch, "ft": c.foot, "metre": 1, "meter": 1,
          "metres": 1, "meters": 1, "millimetre": c.milli, "millimeter": c.milli},
    "s": {"s": 1, "ms": c.milli},
    "rad": {"rad": 1, "mrad": c.milli, "deg": c.degree, "°": c.degree, "degree": c.degree, "degrees": c.degree,
            "radian": 1, "radians": 1},
    "N": {"N": 1, "kN": c.kilo, "lbf": c.lbf, "newton": 1},
    "Pa": {"Pa": 1, "hPa": c.hecto, "kPa": c.kilo, "MPa": c.mega, "bar": c.bar, "psi": c.psi, "kpa": c.kilo,
           "PSI": c.psi, "Bar": c.bar},
}  # fmt: skip


@pytest.mark.parametrize("quantity", [*SECOND, "temperature"])
def test_every_printed_unit_against_a_second_source(quantity):
    with pytest.raises(InputError) as told:
        find_unit("furlong", quantity, where="f")
    known = str(told.value).partition("(known: ")[2].partition(")")[0].split(", ")
    if quantity == "temperature":  # 20 degrees Celsius in each
        values = {"C": 20.0, "degC": 20.0, "K": 293.15, "degF": 68.0, "F": 68.0}
        for text, value in values.items():
            unit = find_unit(text, quantity, where="f")
            assert unit.factor * value + unit.offset == pytest.approx(20.0, rel=1e-14)
    else:
        values = SECOND[quantity]
        for text, factor in values.items():
            unit = find_unit(text, quantity, where="f")
            assert (unit.factor, unit.offset) == (pytest.approx(factor, rel=1e-15), 0.0), text
            assert quantity_of(text) == quantity
    assert len(known) == len(values)  # none is without its second source
    assert quantity_of("furlong") == quantity_of("mN") == ""


@pytest.mark.parametrize("si", IN_KEYS)
def test_every_unit_of_a_key_against_a_second_source(si):
    for text, factor in IN_KEYS[si].items():
        assert float(factor_to_si(text, si, where="f")) == pytest.approx(factor, rel=1e-15), text


def test_every_symbol_of_a_key_has_its_second_source():
    tested = {text for units in IN_KEYS.values() for text in units}
    assert {*SYMBOLS, *SPELLINGS} == tested


@pytest.mark.parametrize("unit", ["km/h", "kp", "rev/min", "gn", "atm", "daN"])
def test_symbols_of_laboratories_are_none_in_keys_of_ours(unit):
    assert not is_unit(unit)


def test_constants():
    assert (c.g, c.bar) == (GRAVITY, PASCAL_PER_BAR)
