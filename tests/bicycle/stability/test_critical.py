"""Critical speeds: exact on matrices with known crossings, complete on bicycles."""

import numpy as np
import pytest
import wobble_onsets
from built import built, effect
from scipy.linalg import block_diag

from bicycle import load_bicycle
from bicycle.model import ModelFamily
from bicycle.stability import (
    CriticalSpeed,
    CrossingIdentity,
    Rules,
    bialternate_sum,
    by_identity,
    critical,
    critical_speeds,
    critical_speeds_of_many,
    modes,
)
from tests.shared.refusals import refuses
from tyre.ground import InputError

C_110 = 110 * 180 / np.pi  # N/rad, a tyre of 110 N/deg


def rotated(seed, **powers):
    """Blocks of each power of v (keys m1, p0, p1, p2) seen in skew coordinates."""
    order = {"m1": -1, "p0": 0, "p1": 1, "p2": 2}
    n = len(block_diag(*powers["p0"]))
    turn = np.eye(n) + 0.3 * np.random.default_rng(seed).normal(size=(n, n)) / np.sqrt(n)
    return {order[k]: turn @ block_diag(*blocks) @ np.linalg.inv(turn) for k, blocks in powers.items()}


def pair(real, frequency):
    return np.array([[real, -frequency], [frequency, real]])


def listed(model, max_speed=60.0):
    return [(c.speed, c.kind, 2 * np.pi * c.frequency_hz, c.direction) for c in critical_speeds(model, max_speed)]


def test_bialternate_sum_has_the_sums_of_two_eigenvalues():
    matrix = np.random.default_rng(3).normal(size=(5, 5))
    roots = np.linalg.eigvals(matrix)
    sums = [roots[i] + roots[j] for i in range(5) for j in range(i)]
    np.testing.assert_allclose(np.poly(np.linalg.eigvals(bialternate_sum(matrix))), np.poly(sums), rtol=1e-9)


def test_real_and_oscillatory_crossings_of_known_roots(synthetic):
    """Roots (v - 7), -0.5 (v - 3) +- 8 i and -40."""
    model = synthetic(rotated(0, p0=([[-7]], pair(1.5, 8), [[-40]]), p1=([[1]], pair(-0.5, 0), [[0]])))
    first, second = listed(model)
    assert first[:2] == (pytest.approx(3.0, rel=1e-12), "oscillatory")
    assert first[2:] == (pytest.approx(8.0, rel=1e-12), "stabilising")
    assert second == (pytest.approx(7.0, rel=1e-12), "real", 0.0, "destabilising")


def test_two_real_roots_of_opposite_sign_are_no_oscillation(synthetic):
    """+-a for a from 1 to 5: their sum is zero at v = 4 without any imaginary pair."""
    model = synthetic(rotated(1, p0=([[3]], [[-7]], [[-30]]), p1=([[0]], [[1]], [[-1]])), borders=())
    assert [(kind, speed) for speed, kind, _, _ in listed(model)] == [("real", pytest.approx(7.0, rel=1e-12))]


def test_nearly_touching_crossings_are_both_found_and_a_touch_is_none(synthetic):
    """Real part (v - 3)(v - 3 - gap): two crossings however close; (v - 3)^2 only touches the axis."""
    for gap in (1e-1, 1e-3, 1e-4):
        blocks = {"p0": (pair(3 * (3 + gap), 5), [[-20]]), "p1": (pair(-6 - gap, 0), [[0]]), "p2": (pair(1, 0), [[0]])}
        found = listed(synthetic(rotated(2, **blocks)))
        assert [f[0] for f in found] == pytest.approx([3.0, 3.0 + gap], abs=1e-12 / gap + 1e-11)
        assert [f[3] for f in found] == ["stabilising", "destabilising"]
    touching = {"p0": (pair(9 + 1e-7, 5), [[-20]]), "p1": (pair(-6, 0), [[0]]), "p2": (pair(1, 0), [[0]])}
    assert listed(synthetic(rotated(2, **touching))) == []


def test_a_root_that_is_zero_at_all_speeds_neither_crosses_nor_hides_others(synthetic):
    """The pencil is singular then; what it loses the count of unstable roots brings back."""
    model = synthetic(rotated(4, p0=([[0]], [[-7]], pair(2, 9)), p1=([[0]], [[1]], pair(-0.25, 0))))
    found = listed(model)
    assert [f[0] for f in found] == pytest.approx([7.0, 8.0], rel=1e-9)
    assert [f[1] for f in found] == ["real", "oscillatory"]


def test_powers_from_minus_one_to_two(synthetic):
    """Real root -4/v + 1 crosses at 4, pair (v^2 - 36)/10 +- 3 i at 6."""
    powers = {"m1": ([[-4]], pair(0, 0)), "p0": ([[1]], pair(-3.6, 3)), "p2": ([[0]], pair(0.1, 0))}
    assert [f[0] for f in listed(synthetic(rotated(5, **powers)))] == pytest.approx([4.0, 6.0], rel=1e-11)


def test_a_slow_pair_beside_a_root_of_a_hundred_million_stays_a_pair(synthetic):
    """Creeping on stiff tyres: the root -1e4/v beside the pair (1e-4 - v) +- 1.46 i, which crosses at 1e-4 m/s."""
    powers = {"m1": ([[-1e4]], pair(0, 0)), "p0": ([[0]], pair(1e-4, 1.46)), "p1": ([[0]], pair(-1, 0))}
    ((speed, kind, frequency, direction),) = listed(synthetic(rotated(6, **powers)))
    assert (kind, direction) == ("oscillatory", "stabilising")
    assert speed == pytest.approx(1e-4, rel=1e-2)  # rounding of the large root: 1e-8 of 1e-4
    assert frequency == pytest.approx(1.46, abs=1e-6)


def test_fourteen_states(synthetic):
    """Seven pairs, each with one crossing: speeds 2, 5 .. 20, all found although the bialternate pencil has size 91."""
    speeds = np.arange(2.0, 22.0, 3.0)
    p0 = [pair(-v * (k + 1) / 5, 3.0 + 6 * k) for k, v in enumerate(speeds)]
    p1 = [pair((k + 1) / 5, 0) for k in range(7)]
    found = listed(synthetic(rotated(6, p0=p0, p1=p1)))
    assert [f[0] for f in found] == pytest.approx(speeds, rel=1e-10)
    assert [f[2] for f in found] == pytest.approx(3.0 + 6 * np.arange(7), rel=1e-10)


def test_near_crossings_beside_very_fast_roots_are_found(synthetic):
    """Beside roots of a hundred million the pencil has two digits; the root that turns back brings crossings back."""
    fast, none = -1e8 * np.diag([1.0, 2.0, 3.0]), np.zeros((3, 3))
    for seed in range(8):
        powers = {
            "m1": (fast, pair(0, 0), [[0]]), "p0": (none, pair(3.1 * 3.11, 5), [[-7]]),
            "p1": (none, pair(-6.21, 0), [[1]]), "p2": (none, pair(1, 0), [[0]]),
        }  # fmt: skip
        model = synthetic(rotated(seed, **powers))
        found = listed(model)
        assert [f[0] for f in found] == pytest.approx([3.1, 3.11, 7.0], abs=1e-5)
        assert [f[3] for f in found] == ["stabilising", "destabilising", "destabilising"]


def test_a_crossing_that_rounding_hides_is_searched_until_the_unstable_roots_add_up(tyred):
    """With a relaxation length of a micrometre the fastest root is 7e6 1/s and its rounding blurs slow ones by 1e-5:
    copies of a bicycle that differ by 1e-12 once lost the capsize crossing at 7.309 m/s in one case of four."""
    effects = {
        "relaxation_length": {"cornering_stiffness": 15000.0, "relaxation_length": 1e-6},
        "steer_assist": {"gain": 10.0, "fade_speed": 5.0},
    }
    base, rng = load_bicycle("pista_rider"), np.random.default_rng(0)
    for _ in range(12):
        changed = {key: value * (1 + 1e-12 * rng.normal()) for key, value in base.values.items() if key != "g"}
        model = tyred(base.replace(**changed), **effects)
        above = [c for c in critical_speeds(model, 20.0) if c.speed > 5.0]
        assert [(c.mode, c.destabilising) for c in above] == [("capsize", True)]
        growth = [model.eigenvalues(above[0].speed * factor).real.max() for factor in (0.99, 1.01)]
        assert growth[0] < 0 < growth[1]


def test_a_jump_of_stability_where_the_equations_switch(synthetic):
    """-1 +- 6 i becomes +1 +- 6 i at v = 4: listed at the switch."""
    model = synthetic({0: block_diag(pair(-1, 6), -9)}, {0: block_diag(pair(1, 6), -9)}, borders=(4.0,))
    assert listed(model) == [(4.0, "oscillatory", pytest.approx(6.0), "destabilising")]


SETS = [
    {},
    {"side_slip": {"cornering_stiffness": C_110}},
    {"relaxation_length": {"cornering_stiffness": 5000.0, "relaxation_length": 0.2}},
    {
        "relaxation_length": {"cornering_stiffness": C_110, "relaxation_length": 0.14},
        "front_compliance": {"stiffness": 2500.0, "damping": 12.0, "joint_x": 0.8, "joint_z": -0.85},
    },
]


@pytest.mark.parametrize("effects", SETS, ids=lambda e: "+".join(e) or "no_slip")
def test_the_count_of_unstable_roots_changes_at_critical_speeds_only(tyred, random_bicycles, effects):
    """Random bicycles against eigenvalues at 1500 speeds; and the names are those of modes()."""
    speeds = np.linspace(0.05, 60.0, 1500)
    for bicycle in random_bicycles(10, 100 + len(effects)):
        model = tyred(bicycle, **effects)
        found = critical_speeds(model)
        unstable = (model.eigenvalues(speeds).real > 0).sum(1)
        steps = {"destabilising": 1, "stabilising": -1}
        change = np.array([steps[c.direction] * (1 if c.kind == "real" else 2) for c in found])
        at = np.array([c.speed for c in found])
        expected = unstable[0] + np.array([change[(at > speeds[0]) & (at < v)].sum() if len(at) else 0 for v in speeds])
        np.testing.assert_array_equal(unstable, expected, bicycle.name)
        for c in found:
            (value,) = np.abs(modes(model, [c.speed]).branch(c.mode) - 2j * np.pi * c.frequency_hz)
            assert np.nanmin(value) < 1e-8


@pytest.mark.parametrize(("length", "onset"), wobble_onsets.RIGID)
def test_wobble_of_the_rigid_front_sets_in_earlier_the_longer_the_relaxation_length(tyred, length, onset):
    tyre = {"cornering_stiffness": wobble_onsets.RIGID_STIFFNESS, "relaxation_length": length}
    found = critical_speeds(tyred(relaxation_length=tyre))
    assert [c.speed for c in found if c.mode == "wobble"] == [pytest.approx(onset, abs=1e-4)]


@pytest.mark.parametrize(("length", "begin", "end", "weave"), wobble_onsets.FLEXIBLE)
def test_wobble_bands_of_the_compliant_front(tyred, length, begin, end, weave):
    tyre = {"cornering_stiffness": wobble_onsets.FLEXIBLE_STIFFNESS, "relaxation_length": length}
    model = tyred(relaxation_length=tyre, front_compliance=wobble_onsets.COMPLIANCE)
    found = critical_speeds(model, 40.0)
    band = [(c.speed, c.direction) for c in found if c.mode == "wobble"]
    ends = pytest.approx(begin, abs=1e-4), pytest.approx(end, abs=1e-4)
    assert band == list(zip(ends, ("destabilising", "stabilising"), strict=True))
    assert [c.speed for c in found if c.mode == "weave" and c.speed > 10] == [pytest.approx(weave, abs=1e-4)]
    middle = (begin + end) / 2  # 5-8 Hz as Plöchl et al. (2012), Vehicle System Dynamics 50, compute
    wobble = modes(model, [middle]).branch("wobble")[0, 0]
    assert wobble.real > 0
    assert 5 < wobble.imag / (2 * np.pi) < 8
    rigid = tyred(relaxation_length=tyre).eigenvalues(middle)
    assert rigid[rigid.imag > 28].real.max() < 0


def capsize_speed(model):
    (speed,) = [c.speed for c in critical_speeds(model) if c.mode == "capsize"]
    return speed


def test_capsize_speed_is_whipples_for_equal_stiffness_over_load_and_any_relaxation_length(tyred):
    bicycle = load_bicycle("benchmark")
    rear, front = bicycle.static_loads
    stiffness = {"rear": 9.0 * rear, "front": 9.0 * front}
    whipple = capsize_speed(tyred(bicycle))
    tyres = [{"side_slip": {"cornering_stiffness": stiffness}}]
    tyres += [{"relaxation_length": tyres[0]["side_slip"] | {"relaxation_length": x}} for x in (0.03, 0.1, 0.25)]
    found = [capsize_speed(tyred(bicycle, **tyre)) for tyre in tyres]
    assert found == pytest.approx([whipple] * 4, rel=1e-9)


def test_the_error_of_the_no_slip_limit_falls_as_one_over_the_stiffness(tyred):
    exact = -0.77534188219585 + 4.46486771378823j  # Meijaard et al. (2007), weave at 5 m/s
    error = []
    for stiffness in (1e6, 1e7, 1e8):
        tyre = {"cornering_stiffness": stiffness, "relaxation_length": 1e-3}
        error.append(abs(modes(tyred(relaxation_length=tyre), [5.0]).branch("weave")[0, 0] - exact))
    assert error[0] / error[1] == pytest.approx(10, rel=0.01)
    assert error[1] / error[2] == pytest.approx(10, rel=0.01)


@pytest.mark.parametrize("speed", [0.0, -3.0, np.inf, np.nan])
def test_max_speed_must_be_positive(tyred, speed):
    with pytest.raises(InputError, match=r"max_speed = .* m/s is not allowed; give a finite speed > 0 m/s"):
        critical_speeds(tyred(), speed)


def test_max_speed_must_be_trackable(tyred):
    slipping = tyred(side_slip={"cornering_stiffness": C_110})
    for model in (tyred(), slipping):
        refuses(r"max_speed = 1e\+06 m/s is not allowed: modes are tracked .* to 1012 m/s", critical_speeds, model, 1e6)
    with pytest.raises(InputError, match="max_speed = 1e-300 m/s is not allowed; slip without relaxation is singular"):
        critical_speeds(slipping, 1e-300)
    assert [c.mode for c in critical_speeds(tyred(), 1000.0)] == ["weave", "capsize"]


MODEL = built(relaxation_length={"cornering_stiffness": 6000.0, "relaxation_length": 0.1})


def test_crossings_are_reached_in_their_direction_only():
    model = MODEL
    polynomial, _ = ModelFamily(model).polynomials({}, 1)
    for crossing in critical_speeds(model):
        start, omega = np.array([1.05 * crossing.speed]), np.array([crossing.angular_frequency])
        for direction in (True, False):
            speed, frequency, there = critical.follow_crossing(polynomial, start, omega, destabilising=direction)
            assert there[0] == (direction == crossing.destabilising)
            if there[0]:
                assert speed[0] == pytest.approx(crossing.speed, rel=1e-9)
                assert frequency[0] == pytest.approx(omega[0], abs=1e-6)


def test_crossings_of_many_bicycles_are_those_of_each_alone():
    family, trails = ModelFamily(built(), ("c",)), np.linspace(0.07, 0.09, 4)
    weave = critical_speeds(family.model)[0]
    polynomial, _ = family.polynomials({"c": trails}, 4)
    omega = np.full(4, weave.angular_frequency)
    speeds, _, there = critical.follow_crossing(polynomial, np.full(4, weave.speed), omega, destabilising=False)
    assert there.all()
    for speed, trail in zip(speeds, trails, strict=True):
        alone = by_identity(critical_speeds(family.with_values({"c": trail})))
        assert speed == pytest.approx(alone[CrossingIdentity("weave", destabilising=False)].speed, rel=1e-9)


def test_crossings_of_one_mode_and_direction_are_counted_from_slow_to_fast():
    def crossing(speed, mode, *, up):
        return CriticalSpeed.of_root(speed=speed, root=20j, destabilising=up, mode=mode)

    every = [crossing(3, "wobble", up=True), crossing(5, "weave", up=False), crossing(8, "wobble", up=False),
             crossing(12, "wobble", up=True), crossing(14, "weave+wobble", up=True)]  # fmt: skip
    which = by_identity(every)
    assert list(which.values()) == every
    assert [str(one) for one in which] == [
        "wobble unstable above", "weave stable above", "wobble stable above", "wobble unstable above (2)",
        "weave+wobble unstable above",
    ]  # fmt: skip
    assert which[CrossingIdentity("wobble", destabilising=True, occurrence=2)].speed == 12


def test_roots_gained_and_frequency_follow_from_the_root():
    pair = CriticalSpeed.of_root(speed=4.0, root=-4j * np.pi, destabilising=True)
    real = CriticalSpeed.of_root(speed=4.0, root=0j, destabilising=False)
    assert (pair.kind, pair.frequency_hz, pair.unstable_roots) == ("oscillatory", pytest.approx(2.0), 2)
    assert (real.kind, real.frequency_hz, real.unstable_roots) == ("real", 0.0, -1)
    assert pair.rename("wobble").mode == "wobble"


def test_a_stack_has_the_crossings_of_each_bicycle_alone():
    masses = np.linspace(60.0, 110.0, 6)
    family = ModelFamily(MODEL, ("mB",))
    polynomial, _ = family.polynomials({"mB": masses}, 6)
    unit = np.full(6, np.sqrt(9.81 * 1.02))
    rules = Rules.of(family.model.linear_model())
    found = critical.crossings_of(rules, polynomial, unit, 9.81, np.array([[0.0, 40.0]] * 6))
    for mass, together in zip(masses, found, strict=True):
        alone = critical_speeds(family.with_values({"mB": mass}), 40.0)
        assert [(c.mode, c.direction) for c in together] == [(c.mode, c.direction) for c in alone]
        np.testing.assert_allclose([c.speed for c in together], [c.speed for c in alone], rtol=1e-9)


@pytest.mark.parametrize("switches", [False, True])
def test_critical_speeds_of_many_are_those_of_each_and_what_is_refused_says_why(switches):
    model = MODEL.with_effect(effect("steer_assist", gain=8.0, fade_speed=5.0)) if switches else MODEL
    family = ModelFamily(model, ("mB", "IBxx", "w"))
    key = "relaxation_length.cornering_stiffness.front"
    numbers = {
        "mB": np.linspace(60.0, 110.0, 5), "IBxx": np.array([-200.0, 9.2, 9.2, 9.2, 9.2]), "w": 1.05,
        key: np.array([6000.0, 6000.0, 6000.0, 1e25, 7000.0]),
    }  # fmt: skip
    found, refused = critical_speeds_of_many(family, numbers, 5, 40.0)
    assert sorted(refused) == [0, 3]
    assert "the mass matrix is not positive definite" in refused[0]
    assert "too stiff to be computed" in refused[3]
    for one in (1, 2, 4):
        own = {name: float(np.broadcast_to(values, 5)[one]) for name, values in numbers.items()}
        alone = critical_speeds(family.with_values(own), 40.0)
        assert alone
        assert [(c.mode, c.direction) for c in found[one]] == [(c.mode, c.direction) for c in alone]
        np.testing.assert_allclose([c.speed for c in found[one]], [c.speed for c in alone], rtol=1e-9)
    reasons = critical_speeds_of_many(family, {}, 2, 1e6)[1].values()
    assert all("m/s is not allowed: modes are tracked" in why for why in reasons)
    refuses("max_speed = -1.0 m/s is not allowed", critical_speeds_of_many, family, {}, 2, -1.0)
