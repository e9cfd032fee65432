"""Units in words."""

from fractions import Fraction

import pytest

from tyre.errors import InputError
from tyre.units import factor_to_si, is_si, is_unit


@pytest.mark.parametrize(
    ("unit", "si", "factor"),
    [
        ("mm", "m", Fraction(1, 1000)),
        ("kN/rad", "N/rad", 1000),
        ("N/mm", "N/m", 1000),
        ("N_per_mm", "N/m", 1000),
        ("kg cm^2", "kg m^2", Fraction(1, 10**4)),
        ("kg*m²", "kg m^2", 1),
        ("kPa", "bar", Fraction(1, 100)),
        ("MPa", "N/m^2", 10**6),
        ("m/s**2", "m/s^2", 1),
        ("in", "mm", Fraction(254, 10)),
    ],
)
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
