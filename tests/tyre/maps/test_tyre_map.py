"""Tyre maps: values between and beyond conditions, uncertainty, joint covariance, and refusals."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import curve_fit

from tests.shared.refusals import refuses
from tyre import InputError, MeasuredTable, TyreMap, available_tyres
from tyre.laws import cornering_stiffness as kya
from tyre.measured import out_of_reach

LOADS = np.array([300.0, 400.0, 500.0])
PRESSURES = np.array([3e5, 5e5, 7e5])
LOAD, PRESSURE = (grid.ravel() for grid in np.meshgrid(LOADS, PRESSURES, indexing="ij"))
MF = {"PKY1": 17.0, "PKY2": 1.8, "PPY1": 0.2, "PPY2": 0.5, "FNOMIN": 400.0, "NOMPRES": 5e5}

DEPARTS = "it is not linear in load and pressure"

conditions = st.lists(st.tuples(st.floats(250.0, 600.0), st.floats(2.5e5, 9e5)), min_size=1, max_size=5)


def product_law(load: Any, pressure: Any, *, at_nominal: float = 60e3, by_load: float = 0.25, by_pressure: float = 0.6):
    """Lateral stiffness of MF6.1 (Pacejka 2012, eq. A3.9 without the square of the load), N/m."""
    return at_nominal * (1 + by_load * (load / 400 - 1)) * (1 + by_pressure * (pressure / 5e5 - 1))


def fitted_product_law(stiffness: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Its coefficients by scipy's own derivatives, and the sum of squares left."""

    def law(_: object, a: float, b: float, c: float) -> NDArray[np.float64]:
        return product_law(LOAD, PRESSURE, at_nominal=1e4 * a, by_load=b, by_pressure=c)

    found = curve_fit(law, LOAD, stiffness, p0=[6.0, 0.0, 0.0], xtol=1e-14, ftol=1e-14, gtol=1e-14)[0]
    return found, float(((law(None, *found) - stiffness) ** 2).sum())


def synthetic(**changes: object) -> MeasuredTable:
    """A synthetic tyre: MF6.1 cornering stiffness, lateral stiffness linear in load and in pressure."""
    fields: dict[str, object] = {
        "tyre": "synthetic", "surface": "flat", "load": LOAD, "pressure": PRESSURE, "synthetic": True,
        "cornering_stiffness": kya(LOAD, PRESSURE, **MF), "lateral_stiffness": product_law(LOAD, PRESSURE),
        "lateral_stiffness_sd": np.full(9, 1500.0),
    }  # fmt: skip
    return MeasuredTable(**(fields | changes))  # type: ignore[arg-type]


def rough(rng: np.random.Generator) -> MeasuredTable:
    """The synthetic tyre with jumps between conditions, as the paper's second brand has."""
    smooth = synthetic()
    return synthetic(
        cornering_stiffness=smooth.cornering_stiffness * (1 + 0.02 * rng.standard_normal(9)),
        lateral_stiffness=smooth.lateral_stiffness * (1 + 0.15 * rng.standard_normal(9)),
    )


def test_unknown_tyre_and_surface_list_what_there_is() -> None:
    assert available_tyres()["Tyre1"] == ("flat", "drum")
    refuses(r"no tyre 'Tire1' \(did you mean 'Tyre1'\?\); available are .*Tyre1", TyreMap.load, "Tire1")
    refuses("Tyre2 was not measured on surface 'drum', only on: flat", TyreMap.load, "Tyre2", surface="drum")
    refuses("surface 'road', only on: flat, drum", TyreMap.load, "Tyre1", surface="road")


def test_own_folder_of_tables(tmp_path: Path) -> None:
    TyreMap(synthetic()).to_file(tmp_path / "one.csv")
    assert available_tyres(tmp_path) == {"synthetic": ("flat",)}
    there = TyreMap.load("synthetic", folder=tmp_path).at(load=350, pressure=4e5)
    back = TyreMap.from_file(tmp_path / "one.toml").at(load=350, pressure=4e5)
    here = TyreMap(synthetic()).at(load=350, pressure=4e5)
    for other in (there, back):
        assert other.cornering_stiffness == pytest.approx(here.cornering_stiffness, rel=1e-10)
        assert other.relaxation_length_sd == pytest.approx(here.relaxation_length_sd, rel=1e-6)
    assert here.notes[0] == "synthetic: no rig measured this tyre"
    TyreMap(synthetic()).to_file(tmp_path / "two.csv")
    refuses("synthetic on flat is defined by 2 files; keep one", TyreMap.load, "synthetic", folder=tmp_path)


def test_smooth_tyre_is_predicted_everywhere_without_added_uncertainty() -> None:
    tyre_map = TyreMap(synthetic())
    for load, pressure in ((333.0, 4.1e5), (470.0, 6.6e5), (600.0, 8e5), (250.0, 2.5e5)):
        here = tyre_map.at(load=load, pressure=pressure)
        expected = kya(np.array([load]), np.array([pressure]), **MF)
        assert here.cornering_stiffness == pytest.approx(expected[0], rel=1e-6)
        assert here.lateral_stiffness == pytest.approx(product_law(load, pressure), rel=1e-9)
        assert here.covariance[0, 0] < 1e-6


@settings(max_examples=15)
@given(st.integers(0, 2**32 - 1), st.floats(300.0, 500.0), st.floats(3e5, 7e5))
def test_lateral_stiffness_is_bilinear_in_the_measured_values(seed: int, load: float, pressure: float) -> None:
    table = rough(np.random.default_rng(seed))
    values = table.lateral_stiffness.reshape(3, 3)
    along_load = np.array([np.interp(load, LOADS, values[:, column]) for column in range(3)])
    expected = np.interp(pressure, PRESSURES, along_load)
    here = TyreMap(table).at(load=load, pressure=pressure)
    assert here.lateral_stiffness == pytest.approx(expected, rel=1e-10)
    assert here.relaxation_length == pytest.approx(here.cornering_stiffness / here.lateral_stiffness, rel=1e-14)


def test_jumps_are_reported_and_widen_the_interval_between_conditions_only() -> None:
    tyre_map = TyreMap(rough(np.random.default_rng(1)))
    node, middle = tyre_map.at(load=400, pressure=5e5), tyre_map.at(load=350, pressure=5e5)
    assert node.lateral_stiffness_sd == pytest.approx(1500.0, rel=1e-9)
    assert node.covariance[0, 0] == pytest.approx(0.0, abs=1e-12)
    # halfway: two independent measured values averaged, and half the misfit variance (a Brownian bridge's 2 t (1 - t))
    misfit = tyre_map.lateral_stiffness_trend.misfit
    assert middle.lateral_stiffness_sd == pytest.approx(np.sqrt(1500.0**2 / 2 + misfit**2 / 2), rel=1e-9)
    assert any(DEPARTS in note for note in middle.notes)
    assert not any(DEPARTS in note for note in node.notes)
    assert not any(DEPARTS in note for note in TyreMap(synthetic()).at(load=350, pressure=5e5).notes)


def plane_table(errors: Any = 0.0) -> MeasuredTable:
    """Three loads and two pressures, K = 45 + 4 (load / N - 420) / 80 + 9 (pressure / bar - 5) N/mm plus errors."""
    load, pressure = (grid.ravel() for grid in np.meshgrid([340.0, 420.0, 500.0], [4e5, 6e5]))
    plane = 45e3 + 50.0 * (load - 420.0) + 0.09 * (pressure - 5e5)
    return synthetic(
        load=load, pressure=pressure, cornering_stiffness=kya(load, pressure, **MF),
        lateral_stiffness=plane + errors, lateral_stiffness_sd=np.full(6, 500.0),
    )  # fmt: skip


def test_a_plane_is_linear_and_interpolated_without_added_uncertainty() -> None:
    """Residuals up to 0.06 N/mm as in a fitted rig campaign; the product of MF6.1 would leave 1 N/mm."""
    errors = np.array([-35.0, -23.0, 58.0, 42.0, 9.0, -51.0])
    tyre_map = TyreMap(plane_table(errors))
    design = np.column_stack([np.ones(6), tyre_map.measured.load, tyre_map.measured.pressure])
    squares = np.linalg.lstsq(design, errors, rcond=None)[1][0]
    assert tyre_map.lateral_stiffness_trend.misfit == pytest.approx(np.sqrt(squares / 3), rel=1e-6)
    middle = tyre_map.at(load=420, pressure=5e5)
    assert middle.lateral_stiffness_sd == pytest.approx(np.sqrt(500.0**2 / 2 + squares / 3 / 2), rel=1e-6)
    assert not any(DEPARTS in note for note in middle.notes)
    beyond = TyreMap(plane_table()).at(load=580, pressure=8e5)
    assert beyond.lateral_stiffness == pytest.approx(45e3 + 8e3 + 27e3, rel=1e-9)


def test_a_departure_is_reported_only_where_it_is_more_than_measurement_errors() -> None:
    """Of linear tyres with errors of their sd at most 1 % are reported, of tyres with a jump of 5 N/mm nearly all."""
    rng = np.random.default_rng(7)
    reported = np.zeros(2)
    for _ in range(200):
        errors = 500.0 * rng.standard_normal(6)
        jump = 5e3 * (np.arange(6) == rng.integers(6))
        for place, table in enumerate((plane_table(errors), plane_table(errors + jump))):
            reported[place] += any(DEPARTS in note for note in TyreMap(table).at(load=380, pressure=5e5).notes)
    assert reported[0] <= 6
    assert reported[1] >= 180


def test_interpolation_error_covers_left_out_conditions() -> None:
    """Over rough synthetic tyres, the middle condition left out lies within the stated spread as often as it should."""
    rng = np.random.default_rng(3)
    kept = np.arange(9) != 4
    scores = []
    for _ in range(200):
        full = rough(rng)
        names = ("load", "pressure", "cornering_stiffness", "lateral_stiffness")
        exact = {"cornering_stiffness_sd": np.zeros(8), "lateral_stiffness_sd": np.zeros(8)}
        part = synthetic(**{name: getattr(full, name)[kept] for name in names}, **exact)
        here = TyreMap(part).at(load=400, pressure=5e5)
        both = ("cornering_stiffness", "lateral_stiffness")
        scores.append([(getattr(full, x)[4] - getattr(here, x)) / getattr(here, f"{x}_sd") for x in both])
    # Student's t with 4 and 5 degrees of freedom: |t| < 2.776 and |t| < 2.571 in 95 % of cases
    covered = np.mean(np.abs(np.array(scores)) < [2.776, 2.571], axis=0)
    assert np.all((covered > 0.91) & (covered < 0.985))


@pytest.mark.parametrize(("load", "pressure", "origin"), [
    (340, 3.5e5, "measured"), (490, 7.5e5, "measured"), (400 * (1 + 1e-12), 5.5e5, "measured"),
    (341, 3.5e5, "interpolated"), (339, 5.5e5, "extrapolated"), (400, 7.6e5, "extrapolated"),
])  # fmt: skip
def test_origin(load: float, pressure: float, origin: str) -> None:
    here = TyreMap.load("Tyre1").at(load=load, pressure=pressure)
    assert here.origin == origin
    assert here.inside == (origin != "extrapolated")
    beyond = "extrapolated beyond the measured 340-490 N and 3.5-7.5 bar"
    assert any(beyond in note for note in here.notes) == (origin == "extrapolated")


@settings(max_examples=20)
@given(conditions, st.sampled_from(["Tyre1", "Tyre2", "Tyre3"]), st.floats(0.0, 0.05))
def test_joint_covariance_is_a_covariance(asked: list[tuple[float, float]], tyre: str, assumed: float) -> None:
    tyre_map = TyreMap.load(tyre, relative_cornering_stiffness_sd=assumed)
    properties, covariance = tyre_map.joint(asked)
    assert covariance.shape == (3 * len(asked), 3 * len(asked))
    np.testing.assert_array_equal(covariance, covariance.T)
    scale = np.concatenate([[p.cornering_stiffness, p.lateral_stiffness, p.relaxation_length] for p in properties])
    eigenvalues = np.linalg.eigvalsh(covariance / np.outer(scale, scale))
    assert eigenvalues.min() > -1e-12 * max(1.0, eigenvalues.max())
    for row, (one, condition) in enumerate(zip(properties, asked, strict=True)):
        alone = tyre_map.at(load=condition[0], pressure=condition[1])
        np.testing.assert_allclose(alone.covariance, one.covariance, rtol=1e-9, atol=1e-9 * covariance.max())
        np.testing.assert_array_equal(one.covariance, covariance[3 * row : 3 * row + 3, 3 * row : 3 * row + 3])


def correlation(covariance: NDArray[np.float64], one: int, other: int) -> float:
    return float(covariance[one, other] / np.sqrt(covariance[one, one] * covariance[other, other]))


def test_shared_lateral_stiffness_is_fully_correlated() -> None:
    _, covariance = TyreMap.load("Tyre1").joint([(340, 5.5e5), (490, 5.5e5), (340, 7.5e5)])
    assert (correlation(covariance, 1, 4), correlation(covariance, 2, 5)) == pytest.approx((1.0, 1.0), abs=1e-9)
    assert (correlation(covariance, 1, 7), correlation(covariance, 1, 2)) == pytest.approx((0.0, -1.0), abs=1e-9)
    _, separate = TyreMap.load("Tyre2").joint([(340, 5.5e5), (490, 5.5e5)])
    assert correlation(separate, 1, 4) == pytest.approx(0.0, abs=1e-9)


def test_propagation_agrees_with_moved_measurements() -> None:
    """Each measured value moved by its stated error, up and down: half the differences make up the stated covariance.

    The lateral stiffness of one pressure moves as one, as its table says.
    """
    table = synthetic(
        cornering_stiffness_sd=0.01 * kya(LOAD, PRESSURE, **MF),
        lateral_stiffness_sd=0.02 * synthetic().lateral_stiffness,
        lateral_stiffness_shared_over=("load",),
    )
    asked = [(350.0, 4e5), (450.0, 4e5), (550.0, 6e5)]
    _, stated = TyreMap(table).joint(asked)
    assert table.cornering_stiffness_sd is not None

    def values(cornering: np.ndarray, lateral: np.ndarray) -> np.ndarray:
        moved = synthetic(
            cornering_stiffness=table.cornering_stiffness + table.cornering_stiffness_sd * cornering,
            lateral_stiffness=table.lateral_stiffness + table.lateral_stiffness_sd * lateral,
        )
        properties, _ = TyreMap(moved).joint(asked)
        return np.array([[p.cornering_stiffness, p.lateral_stiffness, p.relaxation_length] for p in properties]).ravel()

    still = np.zeros(9)
    ways = [(one, still) for one in np.eye(9)] + [(still, 1.0 * (pressure == PRESSURE)) for pressure in PRESSURES]
    halves = np.array([values(*way) - values(*(-moves for moves in way)) for way in ways]) / 2
    sd = np.sqrt(np.diag(stated))
    np.testing.assert_allclose((halves.T @ halves - stated) / np.outer(sd, sd), 0.0, atol=0.005)


def test_assumed_cornering_stiffness_uncertainty_adds_to_the_relaxation_length() -> None:
    plain, assumed = (
        TyreMap.load("Tyre1", relative_cornering_stiffness_sd=sd).at(load=400, pressure=5.5e5) for sd in (0.0, 0.02)
    )
    assert assumed.cornering_stiffness_sd == pytest.approx(0.02 * assumed.cornering_stiffness, rel=1e-9)
    assert assumed.lateral_stiffness_sd == pytest.approx(plain.lateral_stiffness_sd, rel=1e-9)
    # 3 mm and 2 % of 106.0 mm
    assert 1e3 * assumed.relaxation_length_sd == pytest.approx(np.hypot(3.0, 2.12), rel=1e-6)
    assert any("assumed: 2 %" in note for note in assumed.notes)


@pytest.mark.parametrize(("load", "pressure", "message"), [
    (0, 5e5, "Tyre3 on flat: load is 0 N; it must be finite and > 0"),
    (400, -1, "pressure is -1 Pa; it must be finite and > 0"),
    (float("nan"), 5e5, "load is nan N; it must be finite and > 0"),
])  # fmt: skip
def test_impossible_conditions_are_refused(load: float, pressure: float, message: str) -> None:
    refuses(message, TyreMap.load("Tyre3").at, load=load, pressure=pressure)


def test_unphysical_extrapolation_is_refused() -> None:
    falling = synthetic(lateral_stiffness=product_law(LOAD, PRESSURE, by_pressure=-2 / 3))
    with pytest.raises(
        InputError, match=r"to 400 N, 15 bar gives a lateral stiffness of -20000 N/m, which is not physical"
    ):
        TyreMap(falling).at(load=400, pressure=15e5)
    softening = synthetic(cornering_stiffness=kya(LOAD, PRESSURE, **(MF | {"PPY1": -0.5})))
    refuses(r"the fitted 1 \+ PPY1 dpi is not positive", TyreMap(softening).at, load=400, pressure=15.1e5)


def test_one_measured_pressure_says_nothing_about_another() -> None:
    at_five = PRESSURE == 5e5
    part = {
        name: getattr(synthetic(), name)[at_five]
        for name in ("load", "pressure", "cornering_stiffness", "lateral_stiffness", "lateral_stiffness_sd")
    }
    tyre_map = TyreMap(synthetic(**part))
    assert tyre_map.at(load=350, pressure=5e5).origin == "interpolated"
    refuses("pressure is 4 bar, but it was measured at 5 bar only", tyre_map.at, load=350, pressure=4e5)
    gauge = tyre_map.at(load=350, pressure=73 * 6894.757293168)  # 73 psi, 5.03 bar: the same to a rig
    assert gauge.relaxation_length == tyre_map.at(load=350, pressure=5e5).relaxation_length
    assert gauge.origin == "interpolated"
    two = TyreMap(synthetic(**{name: values[:2] for name, values in part.items()}))
    assert any("too few conditions to estimate the misfit" in note for note in two.at(load=350, pressure=5e5).notes)
    refuses("no condition asked for", tyre_map.joint, [])


def test_far_outside_the_uncertainty_is_that_of_a_regression_forecast() -> None:
    """sd^2 = s^2 (1 + g' (J' J)^-1 g) of a law with slopes g, beyond the grid, with exact measurements."""
    table = rough(np.random.default_rng(5))
    exact = synthetic(lateral_stiffness=table.lateral_stiffness, lateral_stiffness_sd=np.zeros(9))
    coefficients, squares = fitted_product_law(table.lateral_stiffness)

    def law(load: Any, pressure: Any, values: Any) -> Any:
        return product_law(load, pressure, at_nominal=1e4 * values[0], by_load=values[1], by_pressure=values[2])

    def slopes(load: Any, pressure: Any) -> Any:
        step = 1e-5 * np.eye(3)
        return np.array(
            [(law(load, pressure, coefficients + h) - law(load, pressure, coefficients - h)) / 2e-5 for h in step]
        ).T

    at, design = slopes(700.0, 6e5), slopes(LOAD, PRESSURE)
    variance = squares / 6 * (1 + at @ np.linalg.inv(design.T @ design) @ at)
    here = TyreMap(exact).at(load=700.0, pressure=6e5)
    # a least sum of squares fixes its coefficients to the root of the last digit
    assert here.lateral_stiffness == pytest.approx(law(700.0, 6e5, coefficients), rel=1e-6)
    assert here.lateral_stiffness_sd == pytest.approx(np.sqrt(variance), rel=1e-6)


def test_continuous_across_the_edge_of_the_grid() -> None:
    tyre_map = TyreMap.load("Tyre2")
    for edge, step in (((340.0, 5e5), (1e-4, 0.0)), ((400.0, 7.5e5), (0.0, 0.1))):
        inside, outside = (
            tyre_map.at(load=edge[0] + sign * step[0], pressure=edge[1] + sign * step[1]) for sign in (1, -1)
        )
        assert inside.cornering_stiffness == pytest.approx(outside.cornering_stiffness, rel=1e-5)
        assert inside.lateral_stiffness == pytest.approx(outside.lateral_stiffness, rel=1e-5)


def test_assumption_is_checked() -> None:
    for value in (-0.1, float("nan")):
        with pytest.raises(InputError, match="relative_cornering_stiffness_sd is .*; it must be finite and >= 0"):
            TyreMap.load("Tyre1", relative_cornering_stiffness_sd=value)
    stated = synthetic(cornering_stiffness_sd=np.full(9, 50.0))
    with pytest.raises(InputError, match="states its own standard deviations; leave the assumption out"):
        TyreMap(stated, relative_cornering_stiffness_sd=0.01)


def test_what_a_table_does_not_state_is_assumed_mostly_common_to_all_conditions() -> None:
    """4/5 of the variance is a common gain: sd is 3 % where it was measured, and the mean of two has 3 % sqrt(0.9)."""
    plain = TyreMap(synthetic(lateral_stiffness_sd=None))
    assert not plain.at(load=400, pressure=5e5).covariance.any()
    names = ("cornering_stiffness_sd", "lateral_stiffness_sd", "relaxation_length_sd")
    assert [np.isnan(getattr(plain.at(load=350, pressure=5e5), name)) for name in names] == [True, True, True]
    assert plain.table.filter(like="_sd_").isna().to_numpy().all()
    tyre_map = plain.assuming(0.03)
    (one, other, between), covariance = tyre_map.joint([(300.0, 5e5), (400.0, 5e5), (350.0, 5e5)])
    for place, name in enumerate(("cornering_stiffness", "lateral_stiffness")):
        values = [getattr(p, name) for p in (one, other, between)]
        relative = covariance[place::3, place::3] / np.outer(values, values)
        np.testing.assert_allclose(np.diag(relative), [9e-4, 9e-4, 8.1e-4], rtol=0.01)
        assert relative[0, 1] == pytest.approx(7.2e-4, rel=1e-6)
    assert not one.cornering_stiffness_sd_stated
    assert not one.lateral_stiffness_sd_stated
    assert one.cornering_stiffness_sd == pytest.approx(0.03 * one.cornering_stiffness)
    for stiffness in ("cornering", "lateral"):
        assert any(f"no uncertainty of the {stiffness} stiffness; assumed: 3 %" in note for note in one.notes)
    stated = TyreMap(synthetic()).assuming(0.03).at(load=300, pressure=5e5)
    assert stated.lateral_stiffness_sd == pytest.approx(1500.0)
    assert stated.lateral_stiffness_sd_stated


@pytest.mark.parametrize(("load", "pressure", "words"), [
    (400, 5.5, "a pressure of 5.5 Pa is no tyre's; is the pressure in bar[?] give 550000 Pa; extrapolate=True"),
    (400, 80.0, r"is the pressure in psi[?] give 551581 Pa"),
    (400, 550.0, r"is the pressure in kPa[?] give 550000 Pa"),
    (40.8, 5.5e5, r"40\.8 N is more than one range width outside .*is the load in kg[?] give 400\.1\d* N"),
    (3000, 5.5e5, r"3000 N is more than one range width outside .*; extrapolate=True takes it as it is"),
])  # fmt: skip
def test_a_condition_far_outside_is_refused_with_the_unit_that_may_be_meant(
    load: float, pressure: float, words: str
) -> None:
    tyre_map = TyreMap.load("Tyre1")
    refuses(words, tyre_map.at, load=load, pressure=pressure)
    if pressure > 1e5 and load < 1e3:
        assert tyre_map.at(load=load, pressure=pressure, extrapolate=True).origin == "extrapolated"


@pytest.mark.parametrize(("load", "bar", "words"), [
    (340.0, 5.5, None),
    (190.0, 5.5, None),  # 340 - (490 - 340)
    (189.0, 5.5, "189 N is more than one range width outside the 340-490 N at which Tyre1 on flat was measured"),
    (640.0, 11.5, None), (641.0, 5.5, "641 N"),
    (400.0, 11.6, "11.6 bar is more than one range width outside the 3.5-7.5 bar"),
    (400.0, 0.1, None),  # 3.4 bar below, within 4 bar
])  # fmt: skip
def test_out_of_reach_is_farther_outside_than_the_range_is_wide(load, bar, words):
    said = out_of_reach(TyreMap.load("Tyre1"), load=load, pressure=bar * 1e5)
    assert (said is None) == (words is None)
    assert words is None or words in str(said)
