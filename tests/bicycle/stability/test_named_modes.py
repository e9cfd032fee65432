"""Named modes: complete, the same whatever else is asked, and what the literature calls them."""

import json
import re

import numpy as np
import pytest
from built import built
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from bicycle import Bicycle, Model, available_bicycles, load_bicycle
from bicycle.model import build_model
from bicycle.parameters import UNITS
from bicycle.stability import critical_speeds, mode_events, modes
from tyre.ground import InputError

C_110 = 110 * 180 / np.pi  # N/rad, a tyre of 110 N/deg
RELAXED = {"cornering_stiffness": C_110, "relaxation_length": 0.12}
FLEXIBLE = {"stiffness": 3000.0, "damping": 15.0, "joint_x": 0.8, "joint_z": -0.85}
EFFECTS = [
    {}, {"side_slip": {"cornering_stiffness": C_110}}, {"relaxation_length": RELAXED},
    {"relaxation_length": RELAXED, "camber_thrust": {"camber_stiffness": 400.0}, "pneumatic_trail": {"trail": 0.02}},
    {"relaxation_length": RELAXED, "front_compliance": FLEXIBLE},
]  # fmt: skip


TYRE_NAMES = {"weave", "wobble", "capsize", "castering", "rear_tyre"}


def all_values(found):
    """Every eigenvalue that the branches hold at each speed, pairs as two."""
    rows = []
    for row in np.hstack(list(found.branches.values())):
        shown = row[~np.isnan(row)]
        assert (shown.imag >= 0).all()
        rows.append(np.concatenate([shown, shown[shown.imag > 0].conj()]))
    return rows


def parts(names):
    """Every name, those in doubt one by one."""
    return {part for name in names for part in name.split("+")}


def there(found, mode):
    """Speeds at which a root is called so, or may be."""
    own = [values[:, 0] for name, values in found.branches.items() if mode in name.split("+")]
    return np.any([~np.isnan(values) for values in own], axis=0)


def largest_mismatch(a, b):
    distance = np.abs(np.subtract.outer(a, b))
    return distance[linear_sum_assignment(distance)].max()


@pytest.mark.parametrize("effects", EFFECTS, ids=lambda e: "+".join(e) or "no_slip")
def test_random_bicycles_no_root_lost_or_doubled_and_names_do_not_depend_on_the_grid(tyred, random_bicycles, effects):
    """Five effect sets times 40 bicycles; a ten times finer, shuffled grid gives the same names."""
    rng = np.random.default_rng(1)
    coarse = np.linspace(0.5, 30.0, 30)
    fine = np.linspace(0.5, 30.0, 291)
    for bicycle in random_bicycles(40, len(effects)):
        model = tyred(bicycle, **effects)
        found = modes(model, coarse)
        for values, held in zip(found.eigenvalues, all_values(found), strict=True):
            assert len(held) == model.order, bicycle.name
            assert largest_mismatch(values, held) <= 1e-9 * np.abs(values).max(), bicycle.name
        order = rng.permutation(len(fine))
        again = modes(model, fine[order])
        back = np.argsort(order)[::10]
        assert set(found.branches) <= set(again.branches)
        for name, values in again.branches.items():
            here = values[back]
            if name not in found.branches:
                assert np.isnan(here).all()
            else:
                width = min(here.shape[1], found.branches[name].shape[1])
                np.testing.assert_allclose(here[:, :width], found.branches[name][:, :width], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("effects", "names"), [
    (EFFECTS[0], {"weave", "capsize", "castering"}),
    (EFFECTS[2], TYRE_NAMES), (EFFECTS[4], TYRE_NAMES | {"front_compliance"}),
], ids=["no_slip", "relaxation", "compliance"])  # fmt: skip
def test_names_of_the_benchmark_and_of_a_ridden_track_bicycle(tyred, effects, names):
    for bicycle in ("benchmark", "pista_charlie_drops"):
        found = modes(tyred(bicycle, **effects), [4.0, 8.0, 12.0])
        assert parts(found.names) == names, bicycle


def test_frequencies_are_those_of_the_field(tyred):
    """Weave 1-4 Hz, wobble 4-10 Hz with a compliant front and about 10 Hz with a rigid one."""
    flexible = modes(tyred(**EFFECTS[4]), np.linspace(6, 12, 13))
    assert ((flexible.frequency("wobble") > 4) & (flexible.frequency("wobble") < 10)).all()
    assert ((flexible.frequency("weave") > 0.5) & (flexible.frequency("weave") < 4)).all()
    rigid = modes(tyred(**EFFECTS[2]), [25.0, 30.0])
    np.testing.assert_allclose(rigid.frequency("wobble"), 10.0, atol=1.5)


def test_wobble_turns_about_the_steer_axis_and_capsize_leans(tyred):
    found = modes(tyred(**EFFECTS[2]), [25.0])
    wobble, capsize = found.shape("wobble").magnitude, found.shape("capsize").magnitude
    assert wobble["steer"][0] == pytest.approx(1.0, abs=4 * np.finfo(float).eps)
    assert wobble["lean"][0] < 0.2
    assert capsize["lean"][0] > 10 * capsize["steer"][0]


def test_shape_satisfies_the_kinematics_of_rolling(tyred):
    """Without slip the rear contact follows its heading: dy/dt = v psi; and the front one too."""
    bicycle = load_bicycle("benchmark")
    found = modes(tyred(), [5.0])
    root = found.branch("weave")[0, 0]
    lean, steer, yaw, lateral = found.shape("weave").phasors[0]
    assert root * lateral == pytest.approx(5.0 * yaw, rel=1e-9)
    tilt = np.cos(bicycle["lam"])
    assert root * yaw == pytest.approx((5.0 * steer + root * bicycle["c"] * steer) * tilt / bicycle["w"], rel=1e-9)
    assert np.angle(lean) == pytest.approx(0.0, abs=1e-12)


def test_frequency_and_damping_follow_from_the_roots(tyred):
    found = modes(tyred(), [0.5, 5.0])
    real, imaginary = -0.77534188219585, 4.46486771378823  # Meijaard et al. (2007), 5 m/s
    assert found.frequency("weave")[1] == pytest.approx(imaginary / (2 * np.pi), rel=1e-12)
    assert found.damping_ratio("weave")[1] == pytest.approx(-real / np.hypot(real, imaginary), rel=1e-11)
    assert found.frequency("weave")[0] == 0.0
    assert found.damping_ratio("weave")[0] < -1.0  # two unstable real roots
    assert np.isnan(found.damping_ratio("capsize")).all()


def test_where_a_mode_has_no_root_its_frequency_is_not_a_number():
    """Where wobble and the rear tyre veer, no root is wobble alone; 0 Hz would be a real root."""
    tyre = {"tyre": "Tyre1", "surface": "flat", "pressure_bar": 5.5}
    model = build_model({"bicycle": "benchmark", "effects": {"relaxation_length": tyre}})
    found = modes(model.linear_model(), [10.0, 10.5])
    with_root = found.frequency("wobble") > 0
    assert with_root.tolist() == [True, False]
    for name in found.names:
        np.testing.assert_array_equal(np.isnan(found.frequency(name)), np.isnan(found.branch(name)[:, 0]))


def test_json_form_has_one_value_of_a_pair_and_two_after_the_split(tyred):
    found = modes(tyred(), [0.0, 5.0]).to_dict()
    assert len(found["weave"][0]) == 2
    assert [len(found["weave"][1]), len(found["capsize"][1])] == [1, 1]
    assert found["weave"][1][0][1] > 0
    assert json.loads(json.dumps(found)) == found


def test_identity_is_lost_only_while_roots_of_two_modes_are_a_pair(tyred):
    """Whipple's capsize and castering of the riderless track bicycle are a pair at 1 m/s, two real roots elsewhere."""
    found = modes(tyred("pista"), [0.3, 1.0, 3.0, 8.0])
    said = found.to_dict()
    assert (said["capsize"][1], said["castering"][1]) == (None, None)
    ((_, imaginary),) = said["capsize+castering"][1]
    assert imaginary > 0
    for k in (0, 2, 3):
        assert said["capsize+castering"][k] is None
        assert said["capsize"][k][0] > said["castering"][k][0]  # the slower one
    merge, split = [event for event in found.events if event.modes == ("capsize", "castering")]
    assert (merge.kind, split.kind) == ("merge", "split")
    told = r"two real roots of capsize and castering meet at -.* and become the pair capsize\+castering"
    assert re.search(told, str(merge))
    assert re.search(r"the pair capsize\+castering splits at -.* into two real roots of capsize and cast", str(split))


def test_after_a_meeting_the_pair_is_weave_and_the_real_root_capsize(tyred):
    """With much trail one root of the split weave meets capsize; below that there is again a pair and a real root."""
    effects = {"relaxation_length": RELAXED, "pneumatic_trail": {"trail": 0.018}}
    found = modes(tyred(**effects), [2.0, 6.0]).to_dict()
    for k in (0, 1):
        assert found["weave"][k][0][1] > 0
        assert found["capsize"][k][0][1] == 0.0


def on_tyre(bicycle, tyre, pressure, law="relaxation_length", **effects):
    """A packaged bicycle on a measured tyre (flat track)."""
    contact = {law: {"tyre": tyre, "pressure_bar": pressure, "extrapolate": True}}  # light bicycles: only names count
    return build_model({"bicycle": bicycle, "effects": contact | effects}).linear_model()


@pytest.mark.parametrize(("law", "tyre", "pressure"), [
    ("relaxation_length", "Tyre1", 5.5),
    ("relaxation_length", "Tyre2", 7.5),
    ("relaxation_length", "Tyre3", 5.5),
    ("relaxation_length", "Tyre3", 7.5),
    ("side_slip", "Tyre2", 5.5),
    ("side_slip", "Tyre3", 7.5),
])  # fmt: skip
def test_the_pair_that_stabilises_next_to_whipples_weave_speed_is_weave(tyred, law, tyre, pressure):
    """Overdamped pairs of this bicycle's tyres split and merge around 6 to 10 m/s and were once taken for weave."""
    whipple = [c for c in critical_speeds(tyred("pista")) if c.kind == "oscillatory"]
    found = critical_speeds(on_tyre("pista", tyre, pressure, law))
    assert [(c.mode, c.direction) for c in whipple] == [("weave", "stabilising")]
    first, *rest = [c for c in found if c.kind == "oscillatory"]
    assert (first.mode, first.direction) == ("weave", "stabilising")
    assert first.speed == pytest.approx(whipple[0].speed, rel=0.25)
    assert all(c.direction == "destabilising" and parts([c.mode]) <= {"weave", "wobble"} for c in rest[:1])


@pytest.mark.parametrize("bicycle", available_bicycles())
@pytest.mark.parametrize("law", ["relaxation_length", "side_slip"])
def test_slow_modes_are_near_whipples_and_every_tyre_mode_has_its_name(tyred, bicycle, law):
    """At 3.5 m/s tyres are stiff: weave, capsize and castering are within 15 % of the largest root of no slip."""
    speeds = np.linspace(0.5, 40.0, 80)
    whipple = modes(tyred(bicycle), [3.5])
    for tyre, pressure in (("Tyre1", 5.5), ("Tyre3", 6.7), ("Tyre2", 7.5)):
        model = on_tyre(bicycle, tyre, pressure, law)
        slow = modes(model, [3.5])
        for name in ("weave", "capsize", "castering"):
            expected = whipple.branch(name)[0, 0]
            assert abs(slow.branch(name)[0, 0] - expected) < 0.15 * abs(whipple.eigenvalues).max(), (tyre, name)
        found = modes(model, speeds)
        assert parts(found.names) == TYRE_NAMES
        fast = speeds >= 15
        for name in ("weave", "wobble", "capsize", "rear_tyre"):
            assert there(found, name)[fast].all(), (tyre, name)
        wobble = found.branch("wobble")[fast, 0]
        assert (wobble[~np.isnan(wobble)].imag > 0).all()
        if law == "relaxation_length":  # at low speed pairs of lightly damped tyres, then the front one is wobble
            for name in ("wobble", "rear_tyre"):
                assert there(found, name)[speeds <= 2].all()
                slow = found.branch(name)[speeds <= 2, 0]
                assert (slow[~np.isnan(slow)].imag > 20).all()


def test_a_strong_damper_does_not_turn_a_fast_pair_into_weave(tyred):
    """Steering damped to a fast real root: weave is still the slow pair, as without tyre and compliance."""
    damper = {"steer_damper": {"damping": 2.5}}
    stiff = {"side_slip": {"cornering_stiffness": 1e5}, "front_compliance": FLEXIBLE | {"stiffness": 6000.0}}
    found, rigid = modes(tyred("pista", **stiff, **damper), [6.0]), modes(tyred("pista", **damper), [6.0])
    assert set(found.names) == TYRE_NAMES | {"front_compliance"}
    for name in ("weave", "capsize", "castering"):
        assert abs(found.branch(name)[0, 0] - rigid.branch(name)[0, 0]) < 0.15 * abs(rigid.eigenvalues).max(), name


def test_castering_and_a_tyre_root_of_the_static_tyre_become_wobble():
    """Without relaxation wobble begins as one real root: its pair with castering is the oscillation about steer."""
    found = modes(on_tyre("pista", "Tyre3", 7.5, "side_slip"), [4.0, 10.0]).to_dict()
    assert [len(found[name][0]) for name in ("wobble", "castering", "rear_tyre")] == [1, 1, 1]
    assert found["wobble"][1][0][1] > 0
    assert found["castering"][1] is None


def test_a_pair_that_castering_and_half_of_a_split_tyre_form_is_told_as_the_tyre(tyred):
    """A soft front: what is alone again is castering."""
    soft = {"cornering_stiffness": 6300.0, "relaxation_length": 0.1}
    model = tyred(relaxation_length=soft, front_compliance=FLEXIBLE)
    split, merge = modes(model, np.linspace(1.0, 30.0, 30)).events
    assert (split.kind, split.modes, split.pair) == ("split", ("rear_tyre",), ("rear_tyre",))
    assert (merge.kind, merge.modes, merge.pair) == ("merge", ("castering", "rear_tyre"), ("rear_tyre",))
    for event in (split, merge):
        assert np.sort(np.abs(model.eigenvalues(event.speed) - event.eigenvalue))[:2].max() < 1e-3


def test_two_pairs_swap_their_names_where_they_exchange_character(tyred):
    """At low speed the mostly lateral pair of the rear tyre is the one that becomes wobble at high speed."""
    model = tyred(**EFFECTS[2])
    (exchange,) = [event for event in modes(model, [1.0, 25.0]).events if event.kind == "exchange"]
    assert exchange.modes == ("rear_tyre", "wobble")
    assert "veer; their labels swap" in str(exchange)
    at = exchange.speed
    found = modes(model, [at - 0.01, at + 0.01])
    assert [event.modes for event in found.events if event.kind == "exchange"] == [exchange.modes]
    branches = [(name.split("+")[0], rows) for name, rows in found.branches.items()]
    best = [{name: rows[k, 0] for name, rows in branches if rows[k, 0].imag > 0} for k in (0, 1)]
    for one, other in (("wobble", "rear_tyre"), ("rear_tyre", "wobble")):
        assert best[0][one] == pytest.approx(best[1][other], rel=0.01)


def test_switching_controller_keeps_names_and_continuity(tyred):
    """Steer assist fades to nothing at its fade speed, so roots are continuous there and equal Whipple's above."""
    assisted = modes(tyred(steer_assist={"gain": 8.0, "fade_speed": 5.0}), [4.999999, 5.000001, 8.0])
    plain = modes(tyred(), [4.999999, 5.000001, 8.0])
    for name in ("weave", "capsize", "castering"):
        np.testing.assert_allclose(assisted.branch(name)[1:, 0], plain.branch(name)[1:, 0], rtol=1e-12)
        assert abs(assisted.branch(name)[0, 0] - assisted.branch(name)[1, 0]) < 1e-4
    assert [event for event in assisted.events if event.kind == "switch"] == []


def test_extra_states_get_other_names(tyred):
    aligned = {"aligning_moment": {"aligning_stiffness": 60.0, "relaxation_length": 0.12}}
    found = modes(tyred(relaxation_length=RELAXED, **aligned), [8.0])
    assert {"other_1", "other_2"} <= set(found.branches)


def test_errors_name_the_problem(tyred):
    model = tyred()
    with pytest.raises(InputError, match="unknown mode 'wobble'; this model has weave, capsize, castering"):
        modes(model, [5.0]).frequency("wobble")
    with pytest.raises(InputError, match=r"speeds have shape \(0,\); give one or more speeds"):
        modes(model, [])
    with pytest.raises(InputError, match="speed -1 m/s is not allowed"):
        modes(model, [-1.0])


def test_speeds_too_high_or_too_low_to_be_tracked_are_refused(tyred):
    slipping = tyred(side_slip={"cornering_stiffness": C_110})
    high = r"speed = 1e\+09 m/s is not allowed: modes are tracked from .* to 1012 m/s \(320 sqrt\(g w\)\)"
    for model in (tyred(), tyred(relaxation_length=RELAXED), slipping):
        with pytest.raises(InputError, match=high):
            modes(model, [5.0, 1e9])
    low = "speed = 1e-300 m/s is not allowed; slip without relaxation is singular at rest: .* tracked from 0.000316"
    with pytest.raises(InputError, match=low):
        modes(slipping, [1e-300])
    assert modes(tyred(), [0.0, 1e-300, 1000.0]).names
    assert modes(slipping, [4e-4, 1000.0]).names


@pytest.mark.parametrize("law", ["relaxation_length", "side_slip"])
@pytest.mark.parametrize("stiffness", [1e25, 1e100, 1e300])
def test_a_model_too_stiff_to_be_computed_is_refused(tyred, law, stiffness):
    length = {"relaxation_length": 0.12} if law == "relaxation_length" else {}
    model = tyred(**{law: {"cornering_stiffness": stiffness} | length})
    words = rf"too stiff to be computed: its fastest root is .* parameter is {law}.cornering_stiffness.rear = 1e\+"
    with pytest.raises(InputError, match=words):
        modes(model, [5.0])
    with pytest.raises(InputError, match=words):
        critical_speeds(model)


def test_extreme_numbers_overflow_without_a_warning(tyred):
    stiff = tyred(unmodelled_torque={"steer_from_steer_curve": -1e308, "middle_speed": 0.0})
    with pytest.raises(InputError, match=r"fastest root is inf 1/s .*[.]steer_from_steer_curve = -1e\+308: give"):
        modes(stiff, [5.0])
    slack = tyred(relaxation_length={"cornering_stiffness": 0.0, "relaxation_length": 0.15})
    assert mode_events(slack, 0.0, 21.01164)[0].kind == "merge"  # eigenvectors there are parallel but for rounding


POWERS = {  # of length, mass and time
    "m": (1, 0, 0), "kg": (0, 1, 0), "kg m^2": (2, 1, 0), "rad": (0, 0, 0), "m/s^2": (1, 0, -2), "N/rad": (1, 1, -2),
    "N m s/rad": (2, 1, -1),
}  # fmt: skip


@settings(max_examples=15)
@given(length=st.floats(0.2, 5.0), mass=st.floats(0.1, 10.0), time=st.floats(0.2, 5.0), damping=st.floats(0.0, 3.0))
def test_other_units_of_length_mass_and_time_change_nothing_physical(length, mass, time, damping):
    def build(unit):
        values = load_bicycle("benchmark").values
        return built(
            Bicycle("scaled", {key: values[key] * unit[UNITS[key]] for key in UNITS}),
            relaxation_length={"cornering_stiffness": C_110 * unit["N/rad"], "relaxation_length": 0.12 * unit["m"]},
            camber_thrust={"camber_stiffness": 300.0 * unit["N/rad"], "lag_share": 0.7},
            pneumatic_trail={"trail": 0.02 * unit["m"]}, steer_damper={"damping": damping * unit["N m s/rad"]},
        )  # fmt: skip

    v = np.array([1.0, 5.0, 12.0, 25.0])
    scaled = {name: length**a * mass**b * time**c for name, (a, b, c) in POWERS.items()}
    found, other = modes(build(dict.fromkeys(POWERS, 1.0)), v), modes(build(scaled), v * length / time)
    assert found.branches.keys() == other.branches.keys()
    for name, roots in found.branches.items():
        np.testing.assert_allclose(other.branches[name] * time, roots, rtol=5e-8, atol=5e-8)


def test_a_bicycle_a_hundred_times_as_long_has_the_same_modes_ten_times_as_slow():
    """Lengths by 100 and inertias by 100^2 at the same g: speeds go with sqrt(g w), times with sqrt(w / g)."""
    plain = load_bicycle("benchmark")
    powers = dict.fromkeys(("w", "c", "rR", "rF", "xB", "zB", "xH", "zH"), 1)
    powers |= {key: 2 for key in plain.values if key.startswith("I")}
    giant = plain.replace(allow_unusual=True, **{key: plain[key] * 100.0**power for key, power in powers.items()})
    speeds = np.linspace(1.0, 10.0, 10)  # at 5 m/s the roots of Meijaard et al. (2007), table 2
    long = modes(Model(giant).linear_model(), 10.0 * speeds)
    expected = {"weave": -0.77534188219585 + 4.46486771378823j, "capsize": -0.32286642900409}
    assert long.names == ("weave", "capsize", "castering")
    assert {name: 10.0 * long.branch(name)[4, 0] for name in expected} == pytest.approx(expected, rel=1e-9)
    found = critical_speeds(Model(giant).linear_model(), 600.0)
    assert [(c.mode, c.speed / 10.0) for c in found] == [
        ("weave", pytest.approx(4.29238253634111, rel=1e-9)),
        ("capsize", pytest.approx(6.02426201538837, rel=1e-9)),
    ]
