"""What a reference of a tyre serves: its own loads, loads between them, and loads near them."""

import pytest

from studies.diagnosis import Curve, Reference
from tyre.ground import InputError


def reference(*loads):
    return Reference(tuple(Curve(f, 5e5, (15.0 * f, 0.3 * f), (1e5, 1e3)) for f in loads), "values in the file")


@pytest.mark.parametrize(
    ("loads", "load"), [((400.0,), 0.4), ((0.4,), 400.0), ((100.0, 120.0), 400.0), ((400.0,), 130.0)]
)
def test_a_load_far_from_every_one_of_the_reference_is_refused(loads, load):
    words = rf"the reference \(values in the file\) at .* N says nothing of a recording at {load:g} N, .* \(at most 3\)"
    with pytest.raises(InputError, match=words):
        reference(*loads).curve_at(load, 5e5)


@pytest.mark.parametrize(("loads", "load", "serves"), [((400.0,), 900.0, 400.0), ((400.0,), 140.0, 400.0)])
def test_the_nearest_load_serves_up_to_three_times_away(loads, load, serves):
    assert reference(*loads).curve_at(load, 5e5).load == serves


def test_between_two_loads_a_reference_serves_however_far_they_are_apart():
    """C is 15 times the load at both, and a power of the load between: 15 times it there too."""
    curve = reference(50.0, 5000.0).curve_at(500.0, 5e5)
    assert curve.load == 500.0
    assert curve.cornering_stiffness[0] == pytest.approx(7500.0)


def test_a_reference_is_interpolated_over_load_and_never_over_pressure():
    """A power law of the load goes through both ends; beyond them the nearest load stands, and says which."""
    stiffness = {400.0: 7600.0, 900.0: 7600.0 * (900 / 400) ** 0.5}
    two = Reference(tuple(Curve(f, 5.5e5, (c, 100.0), (75e3, 750.0)) for f, c in stiffness.items()), "two loads")
    value, _ = two.curve_at(600.0, 5.5e5).cornering_stiffness
    assert value == pytest.approx(7600 * (600 / 400) ** 0.5)
    assert two.curve_at(600.0, 5.5e5).load == 600.0
    assert two.curve_at(1200.0, 5.5e5).load == 900.0
    assert two.load_exponent(5.5e5) == pytest.approx(0.5)
    with pytest.raises(InputError, match="has nothing at 6 bar .it has 5.5 bar.; stiffness is not extrapolated"):
        two.curve_at(600.0, 6e5)
