"""Frequencies, damping ratios, critical speeds and their standard deviations, by independent paths."""

import numpy as np
import pytest
from small_study import RACING, chosen, exactly_known, small

from bicycle.critical.critical_speed import CrossingIdentity
from bicycle.critical.critical_speeds import critical_speeds
from bicycle.eigenvalues.oscillation import damping_ratio
from bicycle.files.bicycle_file import load_bicycle
from bicycle.parameters import Bicycle
from studies.main_study.assemble import build
from studies.main_study.cases import CONTACT, tyre_cases
from studies.main_study.decompose import named_speeds
from studies.main_study.solve import least_damped, nearest, solve
from studies.main_study.spread import uncertainty


def wobble_root(result) -> complex:
    """Wobble at the report speed, 1/s."""
    return complex(result.modes.branch("wobble")[-1, 0])


def test_least_damping_is_that_of_a_direct_scan_of_the_eigenvalues(racing):
    """Of the pairs of 4 to 15 Hz the least damped one over the speeds that are ridden is the flexing front's."""
    for setup in racing.settings.setups[:2]:
        for result in racing.of(setup):
            ratios = {}
            for speed in racing.settings.speeds[(racing.settings.speeds >= 3) & (racing.settings.speeds <= 20)]:
                values = build(racing.settings, setup, result.case.contact).eigenvalues(float(speed))
                hertz = values.imag / (2 * np.pi)
                fast = values[(hertz >= 4) & (hertz < 15)]
                ratios[float(speed)] = float((-fast.real / np.abs(fast)).min())
            speed = min(ratios, key=ratios.get)
            assert result.least.damping_ratio == pytest.approx(ratios[speed], rel=1e-9)
            assert result.least.speed == speed


def test_least_damping_ignores_speeds_that_are_not_ridden(racing):
    result = racing.of(racing.settings.setups[1])[0]
    assert least_damped(result.modes).speed in (5.0, 7.5, 10.0, 12.5, 15.0, 17.5, 20.0)


def test_frequency_and_damping_ratio_are_those_of_an_eigenvalue_at_the_report_speed(racing):
    for result in racing.results:
        values = result.modes.model.eigenvalues(15.0)
        for mode, hertz in result.frequency.items():
            ratio = result.damping[mode].value
            size = 2 * np.pi * hertz.value / np.sqrt(1 - ratio**2)
            assert np.abs(values - complex(-ratio * size, 2 * np.pi * hertz.value)).min() < 1e-6


@pytest.mark.parametrize("tyre", ["Tyre1 flat", "Tyre3 flat"])
def test_standard_deviations_against_monte_carlo(racing, tyre):
    setup = racing.settings.reference
    result = racing.of(setup, tyre)[-1]
    case, speed = result.case, racing.settings.report_speed
    end = result.bands(30.0)[0].end
    random = np.random.default_rng(7)
    samples = random.multivariate_normal(case.contact, case.covariance, 400)
    around = end.speed + np.linspace(-4, 4, 17) * end.sd
    damping, ends = [], []
    for contact in samples:
        model = build(racing.settings, setup, contact)
        damping.append(damping_ratio(nearest(model, speed, wobble_root(result))))
        values = model.eigenvalues(around)
        at = np.argmin(np.abs(values - 2j * np.pi * end.frequency_hz), axis=1)
        ends.append(np.interp(0.0, -np.take_along_axis(values, at[:, None], 1).real[:, 0], around))
    assert result.damping["wobble"].sd == pytest.approx(np.std(damping), rel=0.12)
    assert end.sd == pytest.approx(np.std(ends), rel=0.12)
    assert end.speed == pytest.approx(np.mean(ends), abs=0.3 * end.sd)


def test_sd_of_the_bicycle_moves_loads_tyre_camber_thrust_and_hinge_with_it():
    """Central differences over everything built anew: another bicycle, its loads, its tyre, its camber thrust."""
    sd = {"w": 0.002, "c": 0.0016, "mB": 2.0, "xB": 0.01, "lam": 0.003, "IFyy": 0.001}
    plain = load_bicycle(RACING)
    settings = small(
        Bicycle("with sd", plain.values, dict.fromkeys(plain.values, 0.0) | sd), speeds=np.linspace(0, 30, 3)
    )
    setup = settings.reference

    def chosen_case(bicycle):
        return next(c for c in tyre_cases(small(bicycle)).found if (c.name, c.pressure_bar) == ("Tyre1 drum", 5.5))

    def quantities(bicycle, contact):
        found = build(small(bicycle), setup, contact)
        eigenvalue = nearest(found, 15.0, start)
        speeds = named_speeds(critical_speeds(found))
        ends = [speeds[CrossingIdentity(mode, destabilising=False)] for mode in ("wobble", "weave")]
        return np.array([*ends, damping_ratio(eigenvalue), eigenvalue.imag / (2 * np.pi)])

    case = chosen_case(settings.bicycle)
    result = solve(settings, case, setup)
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
        names, covariance = uncertainty(racing.settings, case, setup).covariance()
        order = [names.index(name) for name in CONTACT]
        scale = np.sqrt(np.diag(case.covariance))
        np.testing.assert_allclose(
            covariance[np.ix_(order, order)] / np.outer(scale, scale), case.covariance / np.outer(scale, scale),
            atol=1e-6,
        )  # fmt: skip
        others = [k for k in range(len(names)) if k not in order]
        assert not covariance[others].any()
    for result in racing.of(setup):
        assert all(c.sd == pytest.approx(c.tyre_sd, rel=1e-6) for c in result.crossings)


def test_what_no_file_states_has_a_standard_deviation_too():
    """A bicycle of which only the values are known is no better known than its tyres."""
    settings = small(Bicycle("unstated", exactly_known(RACING).values, {}), speeds=np.linspace(0, 30, 3))
    (case,) = chosen(settings, {"Tyre1 flat": (5.5,)}).found
    (start,) = [b.start for b in solve(settings, case, settings.reference).bands(30.0)]
    assert start.sd > 1.05 * start.tyre_sd > 0
