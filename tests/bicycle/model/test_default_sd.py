"""One table of standard deviations for what nobody states, and where each one comes from."""

import math

import pytest

from bicycle import Model, effect_class, load_bicycle, registry
from bicycle.model import ORIGINS, Deviation, build_model, standard_deviations
from bicycle.parameters import Bicycle
from tyre import TyreMap
from tyre.ground import InputError

RIDER = effect_class("rider_lean")(mass=30.0, x=0.3, z=-1.0, Ixx=1.0, Izz=0.5, joint_z=-0.9)


def test_the_rows_are_absolute_relative_or_of_the_moments_of_inertia():
    """Numbers of the benchmark bicycle (Meijaard et al. 2007) by hand."""
    found = {key: d.sd for key, d in standard_deviations(Model(load_bicycle("benchmark"))).items()}
    assert (found["w"], found["xB"], found["lam"], found["rF"]) == (0.003, 0.01, 0.01, 0.001)
    assert found["mB"] == pytest.approx(0.005 * 85)
    assert found["IBxx"] == pytest.approx(0.05 * 9.2)
    assert found["IFyy"] == pytest.approx(0.02 * 0.28)
    assert found["IBxz"] == pytest.approx(0.05 * math.sqrt(9.2 * 2.8))
    assert found["g"] == 0


def test_what_is_given_or_stated_comes_first_and_zero_is_exact():
    plain = load_bicycle("benchmark")
    bicycle = Bicycle(plain.name, plain.values, {"w": 0.002, "c": 0.0, "zB": 0.02})
    found = standard_deviations(Model(bicycle), {"zB": 0.03, "mB": 0.0})
    assert found["w"] == Deviation(0.002, "bicycle file")
    assert found["c"] == Deviation(0.0, "exact", "stated as 0")
    assert found["zB"] == Deviation(0.03, "given")
    assert found["mB"] == Deviation(0.0, "exact", "given as 0")
    assert found["g"] == Deviation(0.0, "exact", "known")
    assert found["xB"].origin == "assumed"
    bare = standard_deviations(Model(bicycle), {"zB": 0.03}, assume=False)
    assert bare["xB"] == Deviation(0.0, "exact", "not stated")
    assert {key for key, d in bare.items() if d.sd} == {"w", "zB"}


@pytest.mark.parametrize(("tyre", "surface"), [("Tyre1", "drum"), ("Tyre3", "flat")])
def test_a_table_without_a_deviation_of_the_cornering_stiffness_gets_the_default(tyre, surface):
    model = build_model({"bicycle": "benchmark", "effects": {
        "relaxation_length": {"tyre": tyre, "surface": surface, "pressure_bar": 5.5}}})  # fmt: skip
    found = standard_deviations(model)
    known = TyreMap.load(tyre, surface=surface, relative_cornering_stiffness_sd=0.03)
    at = known.at(load=model.bicycle.static_loads[0], pressure=5.5e5)
    stiffness, length = (
        found[f"relaxation_length.{name}.rear"] for name in ("cornering_stiffness", "relaxation_length")
    )
    assert (stiffness.sd, stiffness.origin) == (pytest.approx(at.cornering_stiffness_sd), "assumed")
    assert (length.sd, length.origin) == (pytest.approx(at.relaxation_length_sd), "tyre table")
    assert any("states no uncertainty of the cornering stiffness; assumed: 3 %" in note for note in model.notes)
    assert standard_deviations(model, assume=False)["relaxation_length.cornering_stiffness.rear"].origin == "exact"


def test_effects_at_their_neutral_value_are_exact_and_ties_follow():
    hinge = effect_class("front_compliance")(joint_x=0.8, joint_z=-0.85)
    camber = effect_class("camber_thrust")
    tyre = effect_class("relaxation_length")(cornering_stiffness=6000.0, relaxation_length=0.1)
    model = Model(load_bicycle("benchmark"), (hinge, camber(camber_stiffness={"rear": 0.0, "front": 300.0}), tyre))
    found = standard_deviations(model)
    assert found["camber_thrust.camber_stiffness.rear"] == Deviation(0.0, "exact", "switched off")
    # four standard deviations of the logarithm span what is typical: 150 to 700 N/rad, 1000 to 10000 N m/rad
    assert found["camber_thrust.camber_stiffness.front"].sd == pytest.approx(300.0 * math.log(700 / 150) / 4)
    assert found["front_compliance.stiffness"].sd == pytest.approx(5000.0 * math.log(10) / 4)
    assert "front_compliance.axis_tilt" not in found  # equals lam
    given = standard_deviations(model, {"front_compliance.axis_tilt": 0.02, "camber_thrust.camber_stiffness": 5.0})
    assert given["front_compliance.axis_tilt"] == Deviation(0.02, "given")
    assert {given[f"camber_thrust.camber_stiffness.{wheel}"].sd for wheel in ("rear", "front")} == {5.0}


@pytest.mark.parametrize("identifier", sorted(registry()))
def test_every_effect_has_deviations_with_an_origin(identifier):
    kind = effect_class(identifier)
    middle = {p.name: sum(p.typical) / 2 for p in kind.parameters if not isinstance(p.default, str)}
    others = [effect_class("relaxation_length")(cornering_stiffness=6000.0, relaxation_length=0.1)]
    if identifier in ("relaxation_length", "side_slip", "no_slip"):
        others = []
    commands = {"motor command": "steer_assist", "rider torque": "rider_control", "seated rider": "rider_saddle"}
    others += [effect_class(commands[need])() for need in kind.requires if need in commands]
    effect = kind(**middle) if identifier != "rider_lean" else RIDER
    found = standard_deviations(Model(load_bicycle("benchmark"), (*others, effect)))
    assert {d.origin for d in found.values()} <= set(ORIGINS)
    assert all(math.isfinite(d.sd) and d.sd >= 0 and (d.origin == "exact") == (d.sd == 0) for d in found.values())


@pytest.mark.parametrize(("given", "words"), [
    ({"mb": 1.0}, "standard deviation: unknown parameter 'mb'; did you mean 'mB'"),
    ({"IByy": 1.0}, "unknown parameter 'IByy'"),
    ({"mB": -1.0}, r"the standard deviation of mB is -1.0; it must be finite and >= 0 \(SI units\)"),
    ({"mB": math.inf}, "the standard deviation of mB is inf; it must be finite"),
    ({"c": 1e9}, r"the standard deviation of c = 1e\+09 is more than 0.5 m; is it in mm\?"),
    ({"lam": 2.0}, "the standard deviation of lam = 2 is more than 0.3 rad; is it in degrees"),
    ({"g": 100.0}, "the standard deviation of g = 100 is more than 1 m/s.2; is it in mm/s.2"),
    ({"steer_damper.damping": 60.0}, "steer_damper.damping is 60 N m s/rad, more than the value and more than its"),
])  # fmt: skip
def test_given_deviations_are_checked(given, words):
    model = Model(load_bicycle("benchmark"), effect_class("steer_damper")(damping=50.0))
    with pytest.raises(InputError, match=words):
        standard_deviations(model, given)
