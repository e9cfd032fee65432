"""Numbers as a person types them: expected values from the definitions of the units."""

import pytest

from tyre.ground import InputError, typed_number, typed_numbers

PSI = 4.4482216152605 / 0.0254**2  # Pa: the pound-force over the square inch, both exact by definition


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("5.5", "bar", 5.5), ("80psi", "bar", 80 * PSI / 1e5), ("80 PSI", "bar", 80 * PSI / 1e5),
        ("550 kPa", "bar", 5.5), ("5.5bar", "bar", 5.5), ("25km/h", "m/s", 25 / 3.6), ("25 kmh", "m/s", 25 / 3.6),
        ("10mph", "m/s", 4.4704), ("45kg", "N", 45 * 9.80665), ("100 lbf", "N", 444.82216152605),
        ("0.45 kN", "N", 450.0), ("60mm", "m", 0.06), ("40.2 in", "m", 40.2 * 0.0254), ("20lb", "kg", 9.0718474),
        ("9500 g", "kg", 9.5), ("72.5°", "deg", 72.5), ("0.3 rad", "deg", 17.188733853924695),
        ("900 kg cm^2", "kg m^2", 0.09),
        ("500ms", "s", 0.5), ("1e-3", "m", 0.001), ("87 N m/deg", "N m/rad", 4984.7328),
        ("-3 cm", "m", -0.03),
    ],
)  # fmt: skip
def test_a_number_with_its_unit(text, unit, value):
    assert typed_number(text, unit) == pytest.approx(value, rel=1e-7)


def test_a_number_without_a_unit_is_untouched():
    assert typed_numbers(["0.1", "7", "1e300"], "bar") == [0.1, 7.0, 1e300]


def test_one_unit_behind_the_last_is_that_of_all():
    assert typed_numbers(["10", "40", "5km/h"], "m/s") == pytest.approx([10 / 3.6, 40 / 3.6, 5 / 3.6])
    assert typed_numbers(["50psi", "6 bar"], "bar") == pytest.approx([50 * PSI / 1e5, 6.0])
    with pytest.raises(InputError, match="50psi, 6: write the unit behind the last number alone, or behind each"):
        typed_numbers(["50psi", "6"], "bar")


def test_coordinates_have_a_unit_each():
    assert typed_numbers(["42cm", "1.06 m"], "m", alike=False) == pytest.approx([0.42, 1.06])
    with pytest.raises(InputError, match="0.9, -80 cm: write the unit behind each"):
        typed_numbers(["0.9", "-80 cm"], "m", alike=False)


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("80 psu", "bar", "'psu' is not a unit of pressure .*did you mean 'psi'"),
        ("5 kg", "m/s", "'kg' is not a unit of speed"),
        ("5 kg", "m", "'kg' is not a unit of length"),
        ("3 m", "1", "give the number without a unit"),
        ("3 rad", "", "give the number without a unit"),
        ("5 m", "kg m^2", "'m' is no unit of what is given in kg m"),
    ],
)
def test_another_quantity_is_refused(text, unit, message):
    with pytest.raises(InputError, match=message):
        typed_number(text, unit)


@pytest.mark.parametrize("text", ["", "psi", "1,5", "nan", "inf", "5 5", "--5"])
def test_what_is_no_number_is_none(text):
    assert typed_numbers([text, "1"], "bar") == []
    with pytest.raises(ValueError, match=r".*"):
        typed_number(text, "bar")
