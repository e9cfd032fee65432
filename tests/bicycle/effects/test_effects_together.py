"""Effects together: an independent derivation, the order in which they are given, and neutral values beside others.

``python -m tests.validation independent-derivation`` does the same with all pairs on every contact law, and triples.
"""

from itertools import combinations

import numpy as np
import pytest
from built import built, effect, linear
from eigenvalue_sets import assert_same_eigenvalues

from bicycle import Model, critical_speeds, load_bicycle
from bicycle.equations import ModelBuilder
from bicycle.model import build_model
from bicycle.motion import magic_formula_model
from bicycle.parameters import Body
from tests.validation.independent_derivation import (
    HINGES,
    OTHERS,
    TARGETS,
    distance,
    draw,
    largest_error,
    laws_of,
    neutral_error,
    order_error,
    refusal,
)
from tests.validation.kane_bicycle import KaneBicycle
from tyre.ground import InputError

TYRE = {"cornering_stiffness": {"rear": 6617.0, "front": 6389.0}, "relaxation_length": 0.1}
FORK = {"stiffness": 6000.0, "damping": 5.0, "length": 0.38}
HANDS = {"mass": 4.5, "half_width": 0.21, "x": 0.85, "z": -0.95, "stiffness": 10.0, "damping": 1.0,
         "grip_stiffness": 200.0, "grip_damping": 1.0}  # fmt: skip


def drawn_pairs(seed: int) -> list[tuple[str, tuple[str, str]]]:
    """Pairs that hold every effect once at least, and those that once went wrong, with a contact law each."""
    rng = np.random.default_rng(seed)
    names = rng.permutation(OTHERS).tolist()
    pairs = [*zip(names[::2], names[1::2], strict=True)]
    pairs += [("fork_bending", "rider_hands"), ("fork_bending", "rider_path"), ("crown_radius", "rider_path")]
    pairs = [pair for pair in pairs if not refusal(pair)]
    return [(str(rng.choice(laws_of(pair))), pair) for pair in pairs]


@pytest.mark.parametrize(("law", "pair"), drawn_pairs(20261128))
def test_a_pair_has_the_roots_of_an_independent_derivation_whatever_its_order(law, pair):
    rng = np.random.default_rng(71)
    model, speed = draw(rng, [law, *pair]), float(rng.uniform(2.0, 25.0))
    assert largest_error(model, speed) < TARGETS["pairs"]
    assert order_error(model, speed) < TARGETS["order"]
    for name in pair:
        if name in HINGES:
            assert neutral_error(model, name, speed) < TARGETS["neutral"]


@pytest.mark.parametrize(("law", "speed"), [("relaxation_length", 3.0), ("no_slip", 11.0)])
def test_many_effects_at_once(law, speed):
    """All four hinges, hands, masses, drag, brakes, a rotor and a round tyre."""
    every = [*HINGES, "rider_hands", "luggage", "handlebar_bag", "aerodynamic_drag", "longitudinal", "rotating_mass"]
    model = draw(np.random.default_rng(5), [law, *every, "crown_radius", "overturning_moment", "steer_assist"])
    assert largest_error(model, speed) < TARGETS["pairs"]
    assert order_error(model, speed) < TARGETS["order"]


def test_hands_hang_on_the_steer_axis_of_a_fork_that_bends():
    """Figures of the linearised Kane equations, roots by bisection; a real root is unstable at every speed."""
    model = build_model({
        "bicycle": "pista_charlie_drops",
        "effects": {"relaxation_length": TYRE, "fork_bending": FORK, "rider_hands": HANDS},
    })  # fmt: skip

    names = [one.identifier for one in model.effects]

    def roots(speed: float) -> np.ndarray:
        return np.linalg.eigvals(KaneBicycle(model.parameters, names, speed).state_matrix()[1])

    wobble = [one.speed for one in critical_speeds(model) if one.mode == "wobble"]
    assert wobble == pytest.approx([8.5807, 15.9684], abs=5e-4)
    for speed in wobble:
        fast = roots(speed)[np.abs(roots(speed).imag) > 40]
        assert np.abs(fast.real).min() < 1e-8
    for speed in (1.0, 5.0, 10.0, 20.0, 30.0):
        found = model.linear_model().eigenvalues(speed)
        assert_same_eigenvalues(found, roots(speed), rtol=1e-9)
        assert sum((found.real > 0) & (found.imag == 0)) == 1


def test_a_stiff_fork_leaves_the_hands_as_they_are():
    tables, errors = {"relaxation_length": TYRE, "rider_hands": HANDS}, []
    without = linear("pista_charlie_drops", **tables).eigenvalues(9.0)
    for stiffness in (1e7, 1e8):
        stiff = linear("pista_charlie_drops", **tables, fork_bending=FORK | {"stiffness": stiffness}).eigenvalues(9.0)
        errors.append(distance(without, stiff))
    assert errors[1] < 3e-4
    assert errors[0] / errors[1] == pytest.approx(10, rel=0.02)


def test_the_roots_of_saturating_tyres_at_rest_are_those_of_the_linear_model():
    tables = {"relaxation_length": TYRE, "fork_bending": FORK, "rider_hands": HANDS, "pneumatic_trail": {},
              "overturning_moment": {"arm": 0.004}, "crown_radius": {}, "wheel_compliance": {},
              "camber_thrust": {"camber_stiffness": 300.0, "lag_share": 0.6}}  # fmt: skip
    model = built("pista_charlie_drops", **tables)
    curved = magic_formula_model(model, speed=7.0)
    rest = np.zeros(len(curved.states)), np.zeros(len(curved.inputs))
    assert_same_eigenvalues(np.linalg.eigvals(curved.jacobian(*rest)), model.linear_model().eigenvalues(7.0), rtol=1e-6)


@pytest.mark.parametrize(("pair", "words"), [
    (("aligning_moment", "pneumatic_trail"), "'aligning_moment' and 'pneumatic_trail' exclude each other: both are"),
    (("aligning_moment", "contact_length"), "'aligning_moment' and 'contact_length' exclude each other"),
    (("contact_length", "pneumatic_trail"), "'contact_length' and 'pneumatic_trail' exclude each other"),
    (("rider_path", "rider_steer_memory"), "'rider_path' and 'rider_steer_memory' exclude each other"),
])  # fmt: skip
def test_pairs_that_cannot_be_combined_are_refused_by_name(pair, words):
    assert words in refusal(pair)


def test_only_these_pairs_cannot_be_combined():
    refused = [pair for pair in combinations(OTHERS, 2) if refusal(pair)]
    assert len(refused) == 4


def test_arms_and_a_body_that_the_frame_does_not_hold_together_are_refused():
    bicycle = load_bicycle("benchmark").replace(mB=50.0, IBxx=30.0, IBzz=30.0, allow_unusual=True)
    body = effect("rider_lean", mass=44.0, x=0.35, z=-1.0, Ixx=1.0, Izz=1.0, joint_z=-0.8)
    arms = effect("rider_hands", **HANDS | {"mass": 7.0})
    Model(bicycle, [body])
    Model(bicycle, [arms])
    with pytest.raises(InputError, match="7 kg must be below 6 kg.*mB = 50 kg, of which rider_lean takes 44 kg"):
        Model(bicycle, [body, arms])
    with pytest.raises(
        InputError, match="'rider_hands': mass = 4.5 kg must be below 4.49 kg, the mass of the rear frame"
    ):
        built("pista", rider_hands=HANDS)


def test_masses_that_lift_a_wheel_together_are_refused():
    heavy = {"mass": 60.0, "x": -0.45, "z": -0.8}
    bag = {"mass": 35.0, "x": -0.6, "z": -0.9}
    built("benchmark", luggage=heavy)
    built("benchmark", handlebar_bag=bag).linear_model()
    with pytest.raises(InputError, match="handlebar_bag, luggage, no_slip: the load of the front wheel is -"):
        built("benchmark", luggage=heavy, handlebar_bag=bag).linear_model()


def hung(*joints: tuple[str, str, str]) -> list[tuple[str, set[str]]]:
    """Names of a builder's joints from the ground outward, and what else than the bicycle's own bodies they carry."""
    model = ModelBuilder()
    effect("no_slip").symbolic().apply(model)
    for name, hangs_on, body in joints:
        model.add_joint(name, axis=(1, 0), point=(0, -1), carries={body}, hangs_on=hangs_on)
        if body not in [other.name for other in model.bodies]:
            model.add_body(Body(body, 1, 0.5, -1, 1, 1))
    model.close()
    own = {"rear frame", "rear wheel", "front frame", "front wheel"}
    return [(joint.name, set(joint.carries) - own) for joint in model.joints()]


@pytest.mark.parametrize("turn", [1, -1])
def test_a_joint_finds_its_place_by_the_name_it_hangs_on(turn):
    joints = [("neck", "torso", "head"), ("torso", "lean", "chest"), ("phone", "steer", "telephone")]
    found = hung(*joints[::turn])
    assert [name for name, _ in found] == ["lean", "torso", "neck", "steer", "phone"]
    assert dict(found)["torso"] == {"chest", "head"}
    assert dict(found)["steer"] == {"telephone"}


def test_what_hangs_on_the_steering_moves_with_a_joint_that_carries_the_front_frame():
    found = dict(hung(("phone", "steer", "telephone"), ("twist", "lean", "front frame")))
    assert list(found) == ["lean", "twist", "steer", "phone"]
    assert found["twist"] == {"telephone"}


@pytest.mark.parametrize(("joints", "words"), [
    ([("one", "lean", "front wheel")], "the joints 'steer' and 'one' both carry the front wheel, and neither carries"),
    ([("one", "steer", "front wheel"), ("other", "steer", "front wheel")],
     "the joints 'one' and 'other' both carry the front wheel, and neither carries the other"),
    ([("one", "steer", "front wheel"), ("other", "one", "front wheel")], None),
    ([("one", "torso", "box")], "the joint 'one': hangs_on names an unknown joint 'torso'"),
    ([("one", "other", "box"), ("other", "one", "case")], "'other' and 'one' carry each other"),
])  # fmt: skip
def test_joints_without_a_place_are_refused(joints, words):
    if words is None:
        assert len(hung(*joints)) == 4
    else:
        with pytest.raises(InputError, match=words):
            hung(*joints)
