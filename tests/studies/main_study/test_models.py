"""A case as a model, where its wobble is unstable, and its numbers with their standard deviations."""

import math
from dataclasses import replace

import numpy as np
import pytest
import wobble_onsets
from by_hand import ARMS, FRONT, TENSE, by_hand, growing
from eigenvalue_sets import assert_same_eigenvalues
from small_study import RACING, chosen, exactly_known, small

from bicycle.files import load_bicycle
from bicycle.model import damping_ratio
from bicycle.parameters import Bicycle
from bicycle.stability import CrossingIdentity, critical_speeds
from studies import main_study
from studies.main_study import model

BY_HAND = [6300.0, 0.14, 6000.0, 0.12]


@pytest.mark.parametrize(("length", "speed"), wobble_onsets.RIGID)
def test_rigid_wobble_onset_of_the_benchmark_bicycle(length, speed):
    rear, front = wobble_onsets.RIGID_STIFFNESS.values()
    world = main_study.Setup(None, None, 0.0, 0.0, 0.0, 0.0)
    linear = model(small("benchmark"), world, [rear, length, front, length]).linear_model()
    found = main_study.named_speeds(critical_speeds(linear))
    assert found[CrossingIdentity("wobble", destabilising=True)] == pytest.approx(speed, abs=1e-4)


@pytest.mark.parametrize("number", range(5))
def test_every_world_is_the_model_put_together_by_hand(number):
    settings = small()
    flexible = {"front": FRONT}
    parts = [flexible, flexible | {"arms": ARMS}, flexible | {"arms": TENSE}, {}, {"arms": ARMS}][number]
    expected = by_hand(settings.bicycle, BY_HAND, **parts).eigenvalues(7.0)
    found = model(settings, settings.setups[number], BY_HAND).linear_model().eigenvalues(7.0)
    assert_same_eigenvalues(found, expected, rtol=1e-9, atol=1e-9)


def test_the_damping_of_the_steering_in_a_file_takes_the_place_of_the_assumed_friction():
    settings = small(further={"steer_damper": {"damping": 0.7}})
    for setup, parts in ((settings.reference, {"front": FRONT}), (settings.setups[3], {})):
        expected = by_hand(settings.bicycle, BY_HAND, steer_damper={"damping": 0.7}, **parts).eigenvalues(7.0)
        found = model(settings, setup, BY_HAND).linear_model()
        assert_same_eigenvalues(found.eigenvalues(7.0), expected, rtol=1e-9)


def test_own_hinge_axis_and_effects_are_in_the_model():
    settings = small(
        front=main_study.Front(4000.0, 0.08, 0.7, 0.95, 0.1, from_file=True),
        arms=main_study.Arms(0.2, 12.0, 2.0, from_file=True),
        further={"crown_radius": {"crown_radius": 0.014}, "camber_thrust": {"camber_stiffness": 210.0}},
    )  # fmt: skip
    expected = by_hand(
        settings.bicycle, BY_HAND,
        front_compliance={"stiffness": 4000, "damping_ratio": 0.08, "joint_x": 0.95, "joint_z": -0.7, "axis_tilt": 0.1},
        rider_arms={"inertia": 0.2, "stiffness": 12, "damping": 2}, crown_radius={"crown_radius": 0.014},
        camber_thrust={"camber_stiffness": 210.0},
    ).eigenvalues(7.0)  # fmt: skip
    found = model(settings, settings.setups[1], BY_HAND).linear_model()
    assert_same_eigenvalues(found.eigenvalues(7.0), expected, rtol=1e-9)


def edge(mode, speed, hertz, *, loses=True, kind="oscillatory"):
    direction = "destabilising" if loses else "stabilising"
    return main_study.UncertainCriticalSpeed(speed, kind, mode, hertz, direction, sd=0.1, tyre_sd=0.1)


class Growing:
    """A model with one oscillation: its real part and frequency (Hz) are functions of the speed."""

    def __init__(self, real, hertz):
        self.real, self.hertz = real, hertz

    def eigenvalues(self, speed):
        value = np.atleast_1d(self.real(np.asarray(speed)) + 2j * np.pi * self.hertz(np.asarray(speed)))
        return np.stack([value, value.conjugate()], axis=-1).reshape(*np.shape(speed), 2)


def test_wobble_is_known_by_its_name_and_where_that_is_open_by_its_frequency():
    slow, named, fast = edge("weave", 5, 0.4, loses=False), edge("wobble", 8, 3.8), edge("weave", 20, 6.0, loses=False)
    both, other = edge("weave+wobble", 12, 4.5, loses=False), edge("weave+wobble", 15, 3.5)
    tyres, wheel = edge("rear_tyre", 1, 17.0), edge("wobble", 1.3, 17.0)  # wheels vibrating on their tyres
    real = edge("wobble", 9, 0.0, kind="real")
    assert main_study.wobble_edges([both, fast, real, slow, named, tyres, wheel, other]) == [named, both]


def turns(model, found) -> float:
    """Steer over lean in the oscillation at a critical speed."""
    values, vectors = np.linalg.eig(model.state_matrix(found.speed))
    k = np.abs(values - 2j * np.pi * found.frequency_hz).argmin()
    steer, lean = (abs(vectors[model.states.index(name), k]) for name in ("steer", "lean"))
    return float(steer / lean)


def test_the_handlebar_turns_more_in_what_counts_as_wobble(racing):
    setup = racing.settings.reference
    edges = [(r.modes.model, c) for r in racing.results_of(setup) for c in r.crossings if c.kind == "oscillatory"]
    wobble = [turns(*one) for one in edges if one[1].mode == "wobble"]
    weave = [turns(*one) for one in edges if one[1].mode == "weave" and one[1].frequency_hz > 1]
    assert len(wobble) >= 9
    assert min(wobble) > 8
    assert all(ratio < 3 for ratio in weave)


def span(edges, real, *, hands_on=False, limit=30.0):
    return main_study.wobble_span(Growing(real, lambda v: 7 + 0 * v), edges, hands_on=hands_on, limit=limit)


def test_wobble_that_counts_grows_by_half_a_unit_a_second_and_its_grade_is_that_of_its_fastest_growth():
    """Growth 0.4 (v - 4)(12 - v)/4: 0.5 at 8 -+ sqrt(11), and 1.6 at 8 m/s."""
    edges = [edge("wobble", 4, 7), edge("wobble", 12, 7, loses=False)]
    found = span(edges, lambda v: 0.1 * (v - 4) * (12 - v))
    assert (found.low, found.high) == pytest.approx((8 - math.sqrt(11), 8 + math.sqrt(11)), abs=1e-5)
    assert (found.growth, found.fastest_at, found.frequency_hz) == pytest.approx((1.6, 8.0, 7.0))
    assert found.grade == "slow"
    assert span(edges, lambda v: 0.2 * (v - 4) * (12 - v)).grade == "fast"
    assert span(edges, lambda v: 0.03 * (v - 4) * (12 - v)) is None


def test_a_span_joins_bands_and_is_open_beyond_the_speeds_looked_at():
    """Growth 3 sin(pi v/4 - pi): unstable from 4 to 8 and from 12 to 16 m/s and so on."""

    def real(v):
        return 3 * np.sin(np.pi * v / 4 - np.pi)

    edges = [edge("wobble", v, 7, loses=v % 8 == 4) for v in (4, 8, 12, 16)]
    inside = 4 / np.pi * math.asin(0.5 / 3)
    joined = span(edges, real)
    assert (joined.low, joined.high) == pytest.approx((4 + inside, 16 - inside), abs=1e-5)
    assert span(edges[:2], real).high == pytest.approx(8 - inside, abs=1e-5)
    assert span(edges[:3], real, limit=14.0).high == math.inf
    assert span(edges, real, limit=3.0) is None


def test_wobble_slower_than_anyone_rides_does_not_count():
    edges = [edge("wobble", 20, 7, loses=False)]
    assert span(edges, lambda v: 20 - v).low == 4.0
    assert span(edges, lambda v: 20 - v, hands_on=True).low == 3.0
    weave = edge("weave", 6.3, 1.0, loses=False)
    assert span([weave, *edges], lambda v: 20 - v).low == pytest.approx(6.3, abs=0.25)
    assert span([weave, *edges], lambda v: 20 - v, hands_on=True).low == 3.0


@pytest.mark.parametrize(("stiffness", "endless"), [(2500.0, True), (5000.0, False)])
def test_an_undamped_front_wobbles_from_rest_on(stiffness, endless):
    """At rest it is neutral, and at walking speed it grows: no critical speed says where it begins."""
    settings = small(front=main_study.Front(stiffness, 0.0), trail=0.0, twisting=0.0)
    setup = replace(settings.reference, friction=0.0)
    linear = model(settings, setup, [6300.0, 0.14, 6000.0, 0.12]).linear_model()
    edges = critical_speeds(linear, max_speed=settings.fastest)
    assert not any(one.direction == "destabilising" and one.kind == "oscillatory" for one in edges)
    span = main_study.wobble_span(linear, edges, hands_on=True, limit=settings.fastest)
    assert span.low == 3.0  # nobody rides slower
    assert span.endless == endless
    if not endless:
        assert [growing(linear, span.high + step, rate=0.5) for step in (-0.01, 0.01)] == [1, 0]
    assert all(growing(linear, speed) == 1 for speed in (0.01, 1.0, 10.0, 25.0))


def test_band_edges_are_where_the_eigenvalues_lose_and_regain_stability(racing):
    setup, limit = racing.settings.reference, racing.settings.fastest
    for result in racing.results_of(setup):
        linear = model(racing.settings, setup, result.case.contact).linear_model()
        (band,) = result.bands(limit)
        edges = [(band.start, 0.01)] + ([(band.end, -0.01)] if band.end else [])
        for found, inside in edges:
            assert growing(linear, found.speed + inside) == 1
            assert growing(linear, found.speed - inside) == 0
        span = result.wobble
        weave = min(c.speed for c in result.crossings if c.mode == "weave" and not c.destabilising)
        assert span.low >= weave
        if span.low == weave:
            assert growing(linear, weave, rate=0.5) == 1
        for edge_of_span, inside in ((span.low, 0.01), (span.high, -0.01)):
            if math.isfinite(edge_of_span) and edge_of_span != weave:
                assert growing(linear, edge_of_span + inside, rate=0.5) == 1
                assert growing(linear, edge_of_span - inside, rate=0.5) == 0
        assert growing(linear, limit, rate=0.5) == (span.high > limit)


@pytest.mark.parametrize("number", [1, 3, 4])
def test_stable_worlds_have_no_growing_fast_oscillation(racing, number):
    setup = racing.settings.setups[number]
    speeds = np.linspace(0.1, racing.settings.fastest, 60)
    for result in racing.results_of(setup):
        assert result.wobble is None
        assert result.bands(racing.settings.fastest) == []
        assert not any(growing(result.modes.model, speed) for speed in speeds)


@pytest.mark.parametrize("number", [0, 1, 3, 4])
def test_without_a_rider_weave_and_wobble_exchange_character(number):
    """One fast oscillation of the empty Pista grows below 30 m/s; it is wobble only behind an exchange of character."""
    settings = small("pista", trail=0.0, twisting=0.0)
    (case,) = chosen(settings, {"Tyre1 flat": (3.5,)}).studied
    result = main_study.solve(settings, case, settings.setups[number])
    assert growing(result.modes.model, 25.0, above=4.0) == 1
    (fast,) = (c for c in result.crossings if c.kind == "oscillatory" and c.destabilising and c.speed < 30)
    assert turns(result.modes.model, fast) < 3.3
    exchanged = [e.speed for e in result.modes.events if e.kind == "exchange" and set(e.modes) == {"weave", "wobble"}]
    if any(speed < fast.speed for speed in exchanged):
        assert fast.mode == "wobble"
        assert fast.speed < result.wobble.low < fast.speed + 2.0  # where it grows by 0.5 1/s
    else:
        assert result.wobble is None
        assert result.bands(30.0) == []
        assert result.least.damping_ratio > 0.1


@pytest.mark.parametrize(("world", "never"), [(3, False), (4, True)])
def test_stiff_arms_leave_no_speed_that_is_stable(world, never):
    """Self-stable between weave and capsize, until arms of 10 N m/rad end that (Doria & Tognazzo 2014, abstract)."""
    settings = small(RACING, arms=main_study.Arms(inertia=0.0, stiffness=10.0, damping=0.0))
    (case,) = chosen(settings, {"Tyre1 flat": (5.5,)}).studied
    result = main_study.solve(settings, case, settings.setups[world])
    assert main_study.never_stable(result, settings.fastest) is never
    by_kind = {(c.mode, c.direction): c.speed for c in result.crossings}
    if not never:  # between the two critical speeds that bound it
        middle = (by_kind["weave", "stabilising"] + by_kind["capsize", "destabilising"]) / 2
        assert (result.modes.model.eigenvalues(middle).real < 0).all()


def wobble_root(result) -> complex:
    """Wobble at the report speed, 1/s."""
    return complex(result.modes.branch("wobble")[-1, 0])


def test_least_damping_is_that_of_a_direct_scan_of_the_eigenvalues(racing):
    """Of the pairs of 4 to 15 Hz the least damped one over the speeds that are ridden is the flexing front's."""
    for setup in racing.settings.setups[:2]:
        for result in racing.results_of(setup):
            ratios = {}
            for speed in racing.settings.speeds[(racing.settings.speeds >= 3) & (racing.settings.speeds <= 20)]:
                values = model(racing.settings, setup, result.case.contact).linear_model().eigenvalues(float(speed))
                hertz = values.imag / (2 * np.pi)
                fast = values[(hertz >= 4) & (hertz < 15)]
                ratios[float(speed)] = float((-fast.real / np.abs(fast)).min())
            speed = min(ratios, key=ratios.get)
            assert result.least.damping_ratio == pytest.approx(ratios[speed], rel=1e-9)
            assert result.least.speed == speed


@pytest.mark.parametrize("tyre", ["Tyre1 flat", "Tyre3 flat"])
def test_standard_deviations_against_monte_carlo(racing, tyre):
    setup = racing.settings.reference
    result = racing.results_of(setup, tyre)[-1]
    case, speed = result.case, racing.settings.report_speed
    end = result.bands(30.0)[0].end
    random = np.random.default_rng(7)
    samples = random.multivariate_normal(case.contact, case.covariance, 400)
    around = end.speed + np.linspace(-4, 4, 17) * end.sd
    damping, ends = [], []
    for contact in samples:
        linear = model(racing.settings, setup, contact).linear_model()
        damping.append(damping_ratio(main_study.nearest_root(linear, speed, wobble_root(result))))
        values = linear.eigenvalues(around)
        at = np.argmin(np.abs(values - 2j * np.pi * end.frequency_hz), axis=1)
        ends.append(np.interp(0.0, -np.take_along_axis(values, at[:, None], 1).real[:, 0], around))
    assert result.damping["wobble"].sd == pytest.approx(np.std(damping), rel=0.12)
    assert end.sd == pytest.approx(np.std(ends), rel=0.12)
    assert end.speed == pytest.approx(np.mean(ends), abs=0.3 * end.sd)


def test_sd_of_the_bicycle_moves_loads_tyre_camber_thrust_and_hinge_with_it():
    """Central differences over everything built anew: another bicycle, its loads, its tyre, its camber thrust."""
    sd = {"w": 0.002, "c": 0.0016, "mB": 2.0, "xB": 0.01, "lam": 0.003, "IFyy": 0.001}
    plain = load_bicycle(RACING)
    bicycle = Bicycle("with sd", plain.values, dict.fromkeys(plain.values, 0.0) | sd)
    settings = small(bicycle, speeds=np.linspace(0, 30, 3))
    setup = settings.reference

    def chosen_case(bicycle):
        cases = main_study.tyre_cases(small(bicycle)).studied
        return next(c for c in cases if (c.name, c.pressure_bar) == ("Tyre1 drum", 5.5))

    def quantities(bicycle, contact):
        found = model(small(bicycle), setup, contact).linear_model()
        eigenvalue = main_study.nearest_root(found, 15.0, start)
        speeds = main_study.named_speeds(critical_speeds(found))
        ends = [speeds[CrossingIdentity(mode, destabilising=False)] for mode in ("wobble", "weave")]
        return np.array([*ends, damping_ratio(eigenvalue), eigenvalue.imag / (2 * np.pi)])

    case = chosen_case(settings.bicycle)
    result = main_study.solve(settings, case, setup)
    start = wobble_root(result)
    variance = np.zeros(4)
    for key, one in sd.items():
        moved = [plain.replace(**{key: plain[key] + sign * 0.05 * one}) for sign in (1, -1)]
        ends = [quantities(bicycle, chosen_case(bicycle).contact) for bicycle in moved]
        variance += ((ends[0] - ends[1]) / 0.1) ** 2
    steps = np.diag(1e-4 * case.contact)
    slopes = np.array(
        [(quantities(plain, case.contact + h) - quantities(plain, case.contact - h)) / (2 * h.sum()) for h in steps]
    )
    tyre = np.diag(slopes.T @ case.covariance @ slopes)
    crossing = {c.mode + c.direction: c for c in result.crossings}
    found = (crossing["wobblestabilising"], crossing["weavestabilising"], result.damping["wobble"],
             result.frequency["wobble"])  # fmt: skip
    assert [one.tyre_sd for one in found] == pytest.approx(np.sqrt(tyre), rel=1e-5)
    assert [one.sd for one in found] == pytest.approx(np.sqrt(tyre + variance), rel=1e-4)
    assert all(one.sd > 1.02 * one.tyre_sd for one in found)


def test_an_exactly_known_bicycle_leaves_the_uncertainty_of_the_tyre(racing):
    setup = racing.settings.reference
    for case in racing.cases[::2]:
        names, covariance = main_study.uncertainty(racing.settings, case, setup).covariance()
        order = [names.index(name) for name in main_study.CONTACT]
        scale = np.sqrt(np.diag(case.covariance))
        np.testing.assert_allclose(
            covariance[np.ix_(order, order)] / np.outer(scale, scale), case.covariance / np.outer(scale, scale),
            atol=1e-6,
        )  # fmt: skip
        others = [k for k in range(len(names)) if k not in order]
        assert not covariance[others].any()
    for result in racing.results_of(setup):
        assert all(c.sd == pytest.approx(c.tyre_sd, rel=1e-6) for c in result.crossings)


def test_what_no_file_states_has_a_standard_deviation_too():
    """A bicycle of which only the values are known is no better known than its tyres."""
    settings = small(Bicycle("unstated", exactly_known(RACING).values, {}), speeds=np.linspace(0, 30, 3))
    (case,) = chosen(settings, {"Tyre1 flat": (5.5,)}).studied
    (start,) = [b.start for b in main_study.solve(settings, case, settings.reference).bands(30.0)]
    assert start.sd > 1.05 * start.tyre_sd > 0
