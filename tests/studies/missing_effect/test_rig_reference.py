"""What a reference of a tyre serves: its own loads, loads between them, and loads near them."""

import pytest

from studies.missing_effect.rig.reference import Curve, Reference
from tyre.base.errors import InputError


def reference(*loads):
    return Reference(tuple(Curve(f, 5e5, (15.0 * f, 0.3 * f), (1e5, 1e3)) for f in loads), "values in the file")


@pytest.mark.parametrize(
    ("loads", "load"), [((400.0,), 0.4), ((0.4,), 400.0), ((100.0, 120.0), 400.0), ((400.0,), 130.0)]
)
def test_a_load_far_from_every_one_of_the_reference_is_refused(loads, load):
    words = rf"the reference \(values in the file\) at .* N says nothing of a recording at {load:g} N, .* \(at most 3\)"
    with pytest.raises(InputError, match=words):
        reference(*loads).at(load, 5e5)


@pytest.mark.parametrize(("loads", "load", "serves"), [((400.0,), 900.0, 400.0), ((400.0,), 140.0, 400.0)])
def test_the_nearest_load_serves_up_to_three_times_away(loads, load, serves):
    assert reference(*loads).at(load, 5e5).load == serves


def test_between_two_loads_a_reference_serves_however_far_they_are_apart():
    """C is 15 times the load at both, and a power of the load between: 15 times it there too."""
    curve = reference(50.0, 5000.0).at(500.0, 5e5)
    assert curve.load == 500.0
    assert curve.cornering_stiffness[0] == pytest.approx(7500.0)
