"""Measurement files, scaled bodies, and what is refused."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicycle.rider import GROUPS, KEYS, available_riders, read_rider, scaled_rider
from tests.shared.refusals import refuses
from tyre.ground import InputError


@pytest.fixture
def lines():
    rider = read_rider("charlie")
    return ["measurementconversionfactor : 0.01", "totalmass: 78.745 # kg"] + [
        f"{key}: {100 * rider.lengths[key]:.6g}" for key in KEYS
    ]


def write(tmp_path, lines):
    file = tmp_path / "me.txt"
    file.write_text("# my body\n\n" + "\n".join(lines))
    return file


def test_the_packaged_riders():
    assert available_riders() == ("charlie", "jason")
    jason = read_rider("jason")
    assert jason.mass == 83.5
    assert jason.lengths["La2L"] == pytest.approx((0.296 + 0.303) / 2)  # left and right
    assert jason.lengths["Lj3L"] == jason.lengths["Lk3L"] == pytest.approx((0.441 + 0.457) / 2)
    assert jason.height == pytest.approx(0.545 + 0.308 + 0.878 + 0.05)
    assert len(KEYS) == 95
    assert sorted(key for group in GROUPS.values() for key in group) == sorted(KEYS)


def test_a_file_reads_as_the_packaged_rider_it_was_written_from(tmp_path, lines):
    found = read_rider(write(tmp_path, lines))
    assert found.lengths == pytest.approx(read_rider("charlie").lengths)
    assert (found.name, found.mass) == ("me", 78.745)


def test_millimetres_and_equal_signs(tmp_path, lines):
    numbers = [line.split(":") for line in lines[2:]]
    other = ["measurementconversionfactor = 0.001"] + [f"{key} = {10 * float(value)}" for key, value in numbers]
    found = read_rider(write(tmp_path, other))
    assert found.lengths == pytest.approx(read_rider("charlie").lengths)
    assert found.mass is None
    assert "was not weighed" in found.notes[0]


@pytest.mark.parametrize(("change", "message"), [
    (lambda x: [*x, "Ls9L: 3"], r"me.txt, line 100: unknown measurement 'Ls9L'; did you mean '"),
    (lambda x: [*x, "Ls1L: 3"], "line 100: Ls1L is given twice"),
    (lambda x: x[:-2], "2 of 95 measurements missing: Lk9w, Lk6d"),
    (lambda x: [*x[:-1], "Lk6d: -3"], "Lk6d = -3 must be a positive length"),
    (lambda x: [*x[:-1], "Lk6d: 5e-324"], "Lk6d = 4.94066e-324 is 0 m; give 0.001 m or more"),
    (lambda x: [*x[:-1], "Lk6d: 0.05"], "Lk6d = 0.05 is 0.0005 m; give 0.001 m or more"),
    (lambda x: [*x[:-1], "Lk6d: three"], "Lk6d = 'three' is not a finite number"),
    (lambda x: [*x, "hello"], "'hello' is no 'key : value'"),
    (lambda x: x[1:], "measurementconversionfactor is missing or not positive; give metres per unit, 0.01 for cm"),
    (lambda x: ["measurementconversionfactor: 1", *x[1:]], r"would be 171 m, allowed 0.5 to 2.6; is .* = 1 right"),
    (lambda x: [x[0], "totalmass: 787", *x[2:]], "totalmass = 787 must lie between 8 and 300 kg"),
    (
        lambda x: [line if not line.startswith("Ls0w") else "Ls0w: 60" for line in x],
        r"perimeter Ls0p and width Ls0w have the ratio 1.633 .*; it must lie between 2 \(flat\) and 3.14 \(round\)",
    ),
    (lambda x: [line if not line.startswith("Ls4d") else "Ls4d: 60" for line in x], "Ls4d must be smaller than"),
])  # fmt: skip
def test_what_is_refused(tmp_path, lines, change, message):
    with pytest.raises(InputError, match=message):
        read_rider(write(tmp_path, change(lines)))


def test_a_rider_that_is_none():
    refuses("unknown rider 'jasn'; did you mean 'jason'?.*or give a measurement file", read_rider, "jasn")
    refuses("me.txt: no such rider file; packaged riders: charlie, jason", read_rider, "me.txt")


@given(st.floats(1.4, 2.1), st.floats(40, 140))
def test_a_scaled_body_has_the_height_and_keeps_the_density(height, mass):
    """Volume goes with length times girth squared."""
    body, reference = scaled_rider(height=height, mass=mass), read_rider("jason")
    assert body.height == pytest.approx(height)
    assert body.mass == mass
    tall = body.lengths["La4L"] / reference.lengths["La4L"]
    thick = body.lengths["Ls1p"] / reference.lengths["Ls1p"]
    assert tall * thick**2 == pytest.approx(mass / reference.mass)
    assert body.relative_sd > reference.relative_sd
    assert "is scaled from another person" in body.notes[0]


def test_centimetres_for_metres_and_a_mass_that_is_none():
    with pytest.raises(InputError, match=r"height = 180 must lie between 0.5 and 2.6 m \(metres, not centimetres\)"):
        scaled_rider(height=180, mass=75)
    refuses("mass = nan must lie between 8 and 300 kg", scaled_rider, height=1.8, mass=math.nan)
    with pytest.raises(InputError, match="mass = 3 must lie"):
        read_rider("jason").weighing(3)
