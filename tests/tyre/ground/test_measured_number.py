"""Numbers with their standard deviation and unit, in the notations in which measurements are written."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tyre.ground import InputError, MeasuredNumber, measured_number, number_text, read_key_values


def read(text, si="", unit=""):
    return measured_number(text, where="b.txt, line 3", key="c", si=si, unit=unit)


@pytest.mark.parametrize(("text", "value", "sd"), [
    ("0.375", 0.375, None), (" -.5e1 ", -5.0, None), ("0.375+/-0.026", 0.375, 0.026), ("0.375 ± 2.6e-2", 0.375, 0.026),
    ("0.375 +- 0.026", 0.375, 0.026), ("0.375(26)", 0.375, 0.026), ("0.375(0.026)", 0.375, 0.026),
    ("12.3(1.1)", 12.3, 1.1), ("375(26)", 375.0, 26.0), ("3.75(26)e-1", 0.375, 0.026),
    ("(3.75 +/- 0.26)e-1", 0.375, 0.026), ("-0.5 ± 10 %", -0.5, 0.05), ("−0.5", -0.5, None), ("1.0+/-0.0", 1.0, 0.0),
    ("6.67430(15)e-11", 6.67430e-11, 0.00015e-11),  # CODATA 2018 as NIST prints it
    ("0.09", 0.09, None),
])  # fmt: skip
def test_notations(text, value, sd):
    assert read(text) == MeasuredNumber(value, sd)


@pytest.mark.parametrize(("text", "si", "value", "sd"), [
    ("1020 mm", "m", 1.020, None), ("102.0(3) cm", "m", 1.020, 0.003), ("(102.0 ± 0.3) cm", "m", 1.020, 0.003),
    ("18 deg", "rad", math.pi / 10, None), ("18.0(5)°", "rad", math.pi / 10, math.pi / 360),
    ("922 ± 1 % kg cm^2", "kg m^2", 0.0922, 0.000922),
    ("60 psi", "Pa", 413685.437590, None),  # 6894.757293168 Pa (NIST SP 811, appendix B.8)
    ("100 N/deg", "N/rad", 5729.577951308232, None),  # 180/pi
])  # fmt: skip
def test_units_behind_the_number(text, si, value, sd):
    found = read(text, si)
    assert found.value == pytest.approx(value, rel=1e-12)
    assert found.sd == (None if sd is None else pytest.approx(sd, rel=1e-12))


@pytest.mark.parametrize(("text", "si", "words"), [
    ("", "", "c = '' is not a finite number; write for example 0.375, 0.375+/-0.026, 0.375(26) or 0.375 +/- 7 %"),
    ("0,375", "", "c = '0,375' has a decimal comma; write a point"),
    ("0,375(26)", "", "c = '0,375(26)' has a decimal comma; write a point"),
    ("0.1+/-0.01, 0.12+/-0.02", "", "holds several numbers; give their mean"),
    ("3.75e-1(26)", "", "has its exponent before the brackets; write 3.75(26)e-1"),
    ("1_0", "", "is not a finite number"), ("inf", "", "is not a finite number"),
    ("1e400", "", "c is not a finite number"),
    ("1e999999999", "", "c = '1e999999999' is not a finite number"),
    ("0.3+/--0.1", "", "the standard deviation of c is -0.1; it must be >= 0"),
    ("5 mm", "", "c = '5 mm': give the number without a unit"),
    ("5 kg", "m", "b.txt, line 3, c: 'kg' is no unit of what is given in m; write for example m, cm, mm, in"),
    ("5 mn", "m", "b.txt, line 3, c: 'mn' is not a unit that is known; write for example m, cm, mm, in"),
])  # fmt: skip
def test_what_is_refused(text, si, words):
    with pytest.raises(InputError) as refusal:
        read(text, si)
    assert str(refusal.value).startswith("b.txt, line 3")
    assert words in str(refusal.value)


FINITE = st.floats(allow_nan=False, allow_infinity=False)


@given(value=FINITE, sd=st.none() | FINITE.map(abs))
def test_what_is_written_is_read_to_the_last_bit(value, sd):
    found = read(number_text(value, sd))
    assert (found.value.hex(), found.sd) == (float(value).hex(), sd)


def test_both_separators_comments_and_standard_deviations(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("# of a person\na : 1.5 # cm\nb = 2+/-0.1\nc=3±0.2\n\nfirst try\n", encoding="utf-8")
    values, sd = read_key_values(path, ("a", "b", "c"), kind="measurement", others=True)
    assert (values, sd) == ({"a": 1.5, "b": 2.0, "c": 3.0}, {"b": 0.1, "c": 0.2})


@pytest.mark.parametrize(("text", "words"), [
    ("a : 1\nfirst try\n", "a.txt, line 2: 'first try' is no 'key : value'"),
    ("aa : 1\n", "a.txt, line 1: unknown measurement 'aa'; did you mean 'a'? known: a, b"),
    ("a : 1\na : 2\n", "a.txt, line 2: a is given twice; keep one"),
    ("a : x\n", "a.txt, line 1: a = 'x' is not a finite number; write for example "
     "0.375, 0.375+/-0.026, 0.375(26) or 0.375 +/- 7 %"),
    ("a : 1+/-inf\n", "a.txt, line 1: a = '1+/-inf' is not a finite number; write for example "
     "0.375, 0.375+/-0.026, 0.375(26) or 0.375 +/- 7 %"),
    ("a : 2 mm\n", "a.txt, line 1: a = '2 mm': give the number without a unit"),
])  # fmt: skip
def test_lines_that_are_refused(tmp_path, text, words):
    (tmp_path / "a.txt").write_text(text)
    with pytest.raises(InputError) as refusal:
        read_key_values(tmp_path / "a.txt", ("a", "b"), kind="measurement")
    assert str(refusal.value).endswith(words)
