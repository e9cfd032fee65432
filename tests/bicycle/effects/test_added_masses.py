"""Luggage and handlebar bag against the bicycle whose frames contain them by the parallel axis theorem."""

import numpy as np
import pytest
from built import built, effect, linear
from eigenvalue_sets import assert_same_eigenvalues
from point_mass import enlarged

from bicycle import Model, load_bicycle, load_effects
from bicycle.effects import outside_effects
from bicycle.equations import ModelBuilder
from bicycle.parameters import Body
from tyre.ground import InputError

PLACES = {"luggage": ("B", -0.06, -0.8), "handlebar_bag": ("H", 0.95, -0.9)}
TYRE = {"cornering_stiffness": 6000.0, "relaxation_length": 0.1}
OTHERS = {
    "rolling": {},
    "tyres and a soft fork": {
        "relaxation_length": TYRE,
        "front_compliance": {"stiffness": 2e3, "joint_x": 0.8, "joint_z": -0.85, "damping": 5.0},
    },
}


@pytest.mark.parametrize("identifier", PLACES)
@pytest.mark.parametrize("others", OTHERS)
def test_a_point_mass_is_part_of_its_frame(identifier, others):
    part, x, z = PLACES[identifier]
    bicycle = load_bicycle("benchmark")
    added = linear(bicycle, **OTHERS[others], **{identifier: {"mass": 4.0, "x": x, "z": z}})
    inside = linear(enlarged(bicycle, part, 4.0, x, z), **OTHERS[others])
    for speed in (0.0, 3.0, 7.0):
        assert_same_eigenvalues(added.eigenvalues(speed), inside.eigenvalues(speed), atol=1e-7)
    bare = linear(bicycle, **OTHERS[others])
    assert np.abs(np.sort_complex(added.eigenvalues(5.0)) - np.sort_complex(bare.eigenvalues(5.0))).max() > 0.01
    weight = 4.0 * 9.81
    front = bicycle.static_loads[1] + weight * x / bicycle["w"]
    assert added.static_loads == pytest.approx((sum(bicycle.static_loads) + weight - front, front))


def test_a_bag_at_the_bar_is_not_one_on_the_rack():
    """At the same place the two differ by what turns with the steering: the steer inertia and weight."""
    at = {"mass": 4.0, "x": 0.95, "z": -0.9}
    found = [linear(**{name: at}).eigenvalues(5.0) for name in PLACES]
    assert np.abs(np.sort_complex(found[0]) - np.sort_complex(found[1])).max() > 0.1


@pytest.mark.parametrize(("identifier", "at", "words"), [
    ("luggage", {"mass": 60.0, "x": -1.0}, "60 kg at x = -1 m lift the front wheel; give less mass or more x"),
    ("handlebar_bag", {"mass": 90.0, "x": 2.0}, "90 kg at x = 2 m lift the rear wheel; give less mass or less x"),
])  # fmt: skip
def test_a_mass_that_lifts_a_wheel_is_refused(identifier, at, words):
    with pytest.raises(InputError, match=f"effect '{identifier}': {words}"):
        built(**{identifier: at})


def test_a_body_is_fixed_to_one_that_there_is():
    model = ModelBuilder()
    effect("no_slip").symbolic().apply(model)
    model.add_body(Body("lamp", 1, 0, 0, 0, 0, fixed_to="front fram"))
    with pytest.raises(InputError, match="the body 'lamp' is fixed to an unknown body 'front fram'; did you mean 'f"):
        model.close()


def test_what_is_fixed_to_a_fixed_body_comes_along(tmp_path):
    """A mass on a massless bracket at the bar moves as a bag there."""
    path = tmp_path / "bracket.py"
    path.write_text(
        '"""x."""\n'
        "from bicycle import Effect\n"
        "from bicycle.parameters.rigid_bodies import Body\n"
        "class Bracket(Effect):\n"
        '    """A bracket with a mass."""\n'
        '    source = "made up"\n    signature = "as a bag"\n'
        "    def apply(self, model):\n"
        '        model.add_body(Body("bracket", 0, 0.9, -1, 0, 0, fixed_to="front frame"))\n'
        '        model.add_body(Body("lamp", 4, 0.95, -0.9, 0, 0, fixed_to="bracket"))\n'
    )
    with outside_effects(()):
        (bracket,) = load_effects(path)
        found = Model("benchmark", bracket()).linear_model().eigenvalues(5.0)
    bag = linear(handlebar_bag={"mass": 4.0, "x": 0.95, "z": -0.9})
    assert_same_eigenvalues(found, bag.eigenvalues(5.0), atol=1e-9)
