"""A seated rider on the saddle's hinges: limits, both hinges, the upper body on top, and the body itself."""

import numpy as np
import pytest
from built import effect

from bicycle import Model, load_bicycle
from bicycle.model import build_model
from bicycle.rider import seated_rider
from tests.validation.independent_derivation import distance, locked
from tyre.ground import InputError

RIDDEN, BARE = load_bicycle("pista_charlie_drops"), load_bicycle("pista")
TYRE = {"cornering_stiffness": 6500.0, "relaxation_length": 0.1}
FRONT = {"stiffness": 5000.0, "damping": 3.0, "joint_x": 0.867, "joint_z": -0.65}
# upper body of the rider, whose numbers are made up
UPPER = {"mass": 40.0, "x": 0.5, "z": -1.15, "Ixx": 1.5, "Izz": 0.8, "joint_z": -0.98, "stiffness": 1500.0}
SPEEDS = (4.0, 9.0, 16.0)


def model(**effects):
    tables = {"relaxation_length": TYRE, "front_compliance": FRONT} | effects
    return Model(RIDDEN, [effect(name, **values) for name, values in tables.items()])


def body():
    return seated_rider(RIDDEN, BARE)


@pytest.mark.parametrize("speed", SPEEDS)
def test_a_locked_hinge_is_the_fixed_rider_and_each_hinge_works_alone(speed):
    """The angle of a hinge that does not move is struck out; roll alone is what rider_lean does with the same body."""
    fixed, yaw = model(), model(rider_saddle=body())
    both = model(rider_saddle=body(), rider_saddle_roll={"joint_z": -0.96, "stiffness": 3000.0, "damping": 57.0})
    roll = model(rider_lean=body() | {"joint_z": -0.96, "stiffness": 3000.0, "damping": 57.0})
    errors = [
        distance(fixed.linear_model().eigenvalues(speed), locked(yaw.linear_model(), "rider_saddle", speed)),
        distance(yaw.linear_model().eigenvalues(speed), locked(both.linear_model(), "rider_saddle_roll", speed)),
        distance(roll.linear_model().eigenvalues(speed), locked(both.linear_model(), "rider_saddle", speed)),
    ]
    assert max(errors) < 1e-10
    assert distance(fixed.linear_model().eigenvalues(speed), yaw.linear_model().eigenvalues(speed)) > 0.01


def test_the_roots_go_to_the_fixed_riders_as_one_over_the_stiffness():
    expected = model().linear_model().eigenvalues(9.0)
    errors = []
    for stiffness in (1e8, 1e9, 1e10):
        stiff = model(rider_saddle=body() | {"stiffness": stiffness}).linear_model().eigenvalues(9.0)
        errors.append(distance(expected, stiff))
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 10, rtol=0.01)
    assert errors[-1] < 1e-5


@pytest.mark.parametrize("hinge", ["rider_saddle", "rider_saddle_roll"])
def test_an_infinite_stiffness_is_refused_with_what_to_do(hinge):
    tables = {"rider_saddle": body(), "rider_saddle_roll": {}}
    tables[hinge] = tables[hinge] | {"stiffness": np.inf}
    with pytest.raises(InputError, match=f"'{hinge}': an infinite stiffness is the rigid bicycle; leave it out"):
        model(**tables)


def test_the_damping_ratio_is_that_of_the_body_on_its_hinge():
    values = effect("rider_saddle", **body(), joint_x=0.21, stiffness=9000.0, damping_ratio=0.3).values(RIDDEN.values)
    inertia = body()["Izz"] + body()["mass"] * (body()["x"] - 0.21) ** 2
    root = np.roots([inertia, values["rider_saddle.damping"], 9000.0])[0]
    assert -root.real / abs(root) == pytest.approx(0.3, rel=1e-12)


def test_the_body_alone_swings_as_its_inertia_says():
    """A frame of 1e6 kg at rest does not move under the rider: the root is that of the hinge."""
    heavy = RIDDEN.replace(mB=1e6, IBxx=1e6, IBzz=1e6, IBxz=0.0, xB=0.4, zB=-0.5, allow_unusual=True)
    numbers = body() | {"joint_x": 0.21, "stiffness": 9000.0, "damping_ratio": 0.3}
    roots = Model(heavy, effect("rider_saddle", **numbers), unusual=True).linear_model().eigenvalues(0.0)
    natural = np.sqrt(9000.0 / (body()["Izz"] + body()["mass"] * (body()["x"] - 0.21) ** 2))
    expected = natural * (-0.3 + 1j * np.sqrt(1 - 0.09))
    assert np.abs(roots - expected).min() / natural < 2e-4


def test_without_numbers_the_body_is_a_share_of_the_rear_frame():
    by_default = model(rider_saddle={})
    same = {"mass": 0.93 * RIDDEN["mB"], "x": RIDDEN["xB"], "z": RIDDEN["zB"]}
    same |= {f"I{axes}": 0.85 * RIDDEN[f"IB{axes}"] for axes in ("xx", "zz", "xz")}
    stated = model(rider_saddle=same)
    assert by_default.parameters["rider_saddle.mass"] == RIDDEN["mB"]
    assert stated.parameters["rider_saddle.mass_share"] == stated.parameters["rider_saddle.inertia_share"] == 1.0
    for speed in SPEEDS:
        roots = by_default.linear_model().eigenvalues(speed)
        assert distance(roots, stated.linear_model().eigenvalues(speed)) < 1e-12


def test_an_upper_body_leans_on_the_seated_one():
    """It yaws with the saddle: a hinge at the saddle that does not move leaves rider_lean on the frame."""
    both = model(rider_saddle=body(), rider_lean=UPPER)
    alone, seated = model(rider_lean=UPPER), model(rider_saddle=body())
    for speed in SPEEDS:
        linear = both.linear_model()
        assert distance(alone.linear_model().eigenvalues(speed), locked(linear, "rider_saddle", speed)) < 1e-10
        assert distance(seated.linear_model().eigenvalues(speed), locked(linear, "rider_lean", speed)) < 1e-10


@pytest.mark.parametrize(("tables", "words"), [
    ({"rider_saddle": {"mass": 90.0}}, "'rider_saddle': mass = 90 kg must be below 83.235 kg, the mass of the rear fr"),
    ({"rider_saddle": {"mass": 78.0, "Ixx": 9.0}}, "what remains of the rear frame has a negative principal inertia"),
    ({"rider_saddle": body(), "rider_lean": UPPER | {"mass": 79.0}},
     "'rider_lean': mass = 79 kg must be below 78.745 kg, the mass of the seated rider that contains the moving body"),
    ({"rider_saddle": body(), "rider_lean": UPPER | {"Ixx": 8.0}}, "what remains of the seated rider has a negative"),
    ({"rider_saddle": body(), "rider_hands": {"mass": 5.0}}, "5 kg must be below 4.49 kg.*rider_saddle takes 78.745"),
    ({"rider_saddle_roll": {}}, "'rider_saddle_roll' needs a seated rider, which no other effect gives: .*rider_lean"),
])  # fmt: skip
def test_bodies_that_do_not_fit_are_refused(tables, words):
    with pytest.raises(InputError, match=words):
        model(**tables)


@pytest.mark.parametrize("posture", ["drops", "hoods", "upright"])
def test_the_seated_rider_and_the_bare_bicycle_are_the_ridden_one(posture):
    """Masses, first and second moments about the ground add up, and the rider's mass is the one that was weighed."""
    ridden = load_bicycle(f"pista_charlie_{posture}")
    rider = seated_rider(ridden, BARE)
    assert rider["mass"] == pytest.approx(78.745, abs=1e-3)

    def moments(m, x, z, Ixx, Izz, Ixz):
        return np.array([m, m * x, m * z, Ixx + m * z * z, Izz + m * x * x, Ixz - m * x * z])

    parts = [[p[key] for key in ("mB", "xB", "zB", "IBxx", "IBzz", "IBxz")] for p in (ridden, BARE)]
    np.testing.assert_allclose(moments(*parts[0]), moments(*parts[1]) + moments(*rider.values()), rtol=1e-12)


@pytest.mark.parametrize(("ridden", "bare", "words"), [
    ("pista_rider", "rigid", "differ in w, 0.989 and 1.06379; give the same bicycle with and without rider"),
    ("pista", "pista_charlie_drops", "'pista' is not heavier than .*mB = 4.49 and 83.235 kg., so it carries no rider"),
    ("rigid_rider", "rigid", "'rigid_rider' minus 'rigid' is no body: Ixx = 2.59, Izz = 0.211, Ixz = -1.89"),
])  # fmt: skip
def test_bicycles_that_make_no_rider_are_refused(ridden, bare, words):
    with pytest.raises(InputError, match=words):
        seated_rider(load_bicycle(ridden), load_bicycle(bare))


def test_a_model_file_names_the_bicycle_without_rider(tmp_path):
    bare = tmp_path / "bare.toml"
    bare.write_text("[values]\n" + "".join(f"{key} = {value!r}\n" for key, value in BARE.values.items()))
    for name in ("pista", "bare.toml"):
        table = {"without_rider": name, "stiffness": 8000.0}
        built = build_model({"bicycle": "pista_charlie_drops", "effects": {"rider_saddle": table}}, folder=tmp_path)
        assert built.effects[1] == effect("rider_saddle", **body(), stiffness=8000.0)


@pytest.mark.parametrize(("table", "words"), [
    ({"without_rider": 3}, "'rider_saddle': without_rider = 3 must be a packaged bicycle or a file of one"),
    ({"without_rider": "pista", "mass": 70.0}, "without_rider gives mass already; remove one of the two"),
    ({"without_rider": "pist"}, "pist"),
])  # fmt: skip
def test_a_wrong_name_of_the_bicycle_without_rider_is_refused(table, words):
    with pytest.raises(InputError, match=words):
        build_model({"bicycle": "pista_charlie_drops", "effects": {"rider_saddle": table}})
