"""The tyres of a study: at the bicycle's wheel loads, from tables and from model files, and what is left out."""

from pathlib import Path

import numpy as np
import pytest
from small_study import RACING, exactly_known, own_table, small

from bicycle.parameters import Bicycle
from studies.main_study import Settings, front_draws, front_values, model, run_study, tyre_cases
from tyre import TyreMap, read_tyre
from tyre.ground import InputError

DEGREE = np.pi / 180


def at_measured_loads(rear: float, front: float) -> Bicycle:
    """A bicycle with mass and place of the rear frame chosen for these static loads (N)."""
    v = dict(exactly_known(RACING).values)
    total = (rear + front) / v["g"]
    others = v["mR"] + v["mH"] + v["mF"]
    v["xB"] = (front / v["g"] * v["w"] - v["mH"] * v["xH"] - v["mF"] * v["w"]) / (total - others)
    v["mB"] = total - others
    return Bicycle("at measured loads", v)


def test_tyre_values_at_measured_conditions_are_the_papers():
    found = tyre_cases(small(at_measured_loads(490.0, 340.0)))
    assert found.left_out == ()
    cases = {(c.name, c.pressure_bar): c for c in found.studied}
    printed = {  # Dell'Orto et al., Tables 2-9: N/deg and mm, rear at 490 N, front at 340 N
        ("Tyre1 flat", 3.5): (110.7, 140.9, 105.3, 134.0),
        ("Tyre1 drum", 7.5): (100.8, 76.8, 80.5, 61.3),
        ("Tyre2 flat", 5.5): (107.9, 82.1, 88.8, 121.1),
        ("Tyre3 flat", 3.5): (120.0, 198.5, 103.6, 187.3),
    }
    for key, numbers in printed.items():
        case = cases[key]
        rear_c, rear_length, front_c, front_length = case.contact
        values = (rear_c * DEGREE, rear_length * 1e3, front_c * DEGREE, front_length * 1e3)
        assert values == pytest.approx(numbers, abs=0.051)
        assert [p.origin for p in case.properties] == ["measured", "measured"]
        sds = np.sqrt(np.diag(case.covariance))
        assert (sds[1::2] > 2.9e-3).all()  # the paper's 3 mm
        assert sds[::2] == pytest.approx(0.03 * case.contact[::2], rel=0.01)  # no source states it
        assert not case.extrapolated
        assert not case.out_of_reach


def test_without_pressures_each_tyre_is_studied_where_it_was_measured():
    found = tyre_cases(small()).studied
    assert [(c.name, c.condition) for c in found[:4]] == [
        ("Tyre1 flat", "3.5 bar"), ("Tyre1 flat", "5.5 bar"), ("Tyre1 flat", "7.5 bar"), ("Tyre1 drum", "3.5 bar")
    ]  # fmt: skip
    assert len(found) == 12
    assert all(case.packaged for case in found)
    assert {c.condition for c in tyre_cases(small(pressures=(4.0, 6.25))).studied} == {"4 bar", "6.25 bar"}


def test_heavy_bicycle_is_extrapolated_and_a_very_heavy_one_out_of_reach():
    assert all(case.extrapolated and not case.out_of_reach for case in tyre_cases(small("benchmark")).studied)
    values = dict(exactly_known("benchmark").values)
    values["mB"] = 300.0
    assert all(case.out_of_reach for case in tyre_cases(small(Bicycle("tandem", values))).studied)


def test_only_the_users_tyre_is_studied_where_one_is_given(tmp_path):
    own = own_table(tmp_path)
    mine = tyre_cases(small(tyre=str(own))).studied
    like = [case for case in tyre_cases(small()).studied if case.name == "Tyre3 flat"]
    assert [(c.name, c.condition) for c in mine] == [
        ("Mine (synthetic) flat", f"{bar} bar") for bar in (3.5, 5.5, 7.5)
    ]  # fmt: skip
    assert all(case.synthetic and not case.packaged for case in mine)
    for one, other in zip(mine, like, strict=True):  # between the loads the trend is fitted anew to the table
        np.testing.assert_allclose(one.contact, other.contact, rtol=0.01)
    drum = tyre_cases(small(tyre="Tyre1", surface="drum", pressures=(4.0,))).studied
    assert [(c.name, c.condition) for c in drum] == [("Tyre1 drum", "4 bar")]
    with pytest.raises(InputError, match="no tyre 'Tyre9' .did you mean"):
        tyre_cases(small(tyre="Tyre9"))


def test_a_condition_about_which_a_table_says_nothing_is_left_out_and_told(tmp_path):
    own = own_table(tmp_path, pressures=(5.5,))
    found = tyre_cases(small(tyre=str(own), pressures=(4.0, 5.5)))
    assert [(c.name, c.condition) for c in found.studied] == [("Mine (synthetic) flat", "5.5 bar")]
    (words,) = found.left_out
    assert words.startswith("Mine flat at 4 bar: ")
    assert "it was measured at 5.5 bar only" in words
    with pytest.raises(InputError, match="no tyre can be studied: Mine flat at 4 bar: .*at 5.5 bar only"):
        tyre_cases(small(tyre=str(own), pressures=(4.0,)))


def test_the_tyre_of_a_model_file_is_studied_at_its_measured_pressures_too():
    found = tyre_cases(small(contact={"tyre": "Tyre3", "pressure_bar": 5.5})).studied
    assert [(c.name, c.condition) for c in found] == [("Tyre3 flat", f"{bar} bar") for bar in (5.5, 3.5, 7.5)]
    asked = tyre_cases(small(contact={"tyre": "Tyre3", "pressure_bar": 5.5}, pressures=(4.0, 6.0))).studied
    assert [c.condition for c in asked] == ["4 bar", "6 bar"]  # nothing that was not asked for


def test_trail_and_twisting_torque_of_a_tyres_file_take_the_place_of_the_assumed_ones():
    """The .tir file of docs/tyres.md states both; its values stand in every world, and are not drawn."""
    tir = Path(__file__).parents[3] / "docs" / "examples" / "tyres" / "example.tir"
    settings = small(tyre=str(tir), pressures=(5.0,))
    (case,) = tyre_cases(settings).studied
    source = read_tyre(tir)
    wheels = [source.at(load=load, pressure=5e5) for load in settings.bicycle.static_loads]
    found = case.apply_to(settings.reference)
    assert found.trail == pytest.approx([p.pneumatic_trail for p in wheels])
    assert found.twisting == pytest.approx([p.twisting_stiffness for p in wheels])
    assert found.camber_share == pytest.approx([p.camber_stiffness / p.load for p in wheels])
    values = model(settings, found, case.contact).parameters
    assert values["pneumatic_trail.trail.front"] == pytest.approx(wheels[1].pneumatic_trail)
    drawn = front_values(settings, found, front_draws(settings), 0, values | settings.bicycle.values)
    assert not [key for key in drawn if key.startswith(("pneumatic", "twisting", "camber"))]


NUMBERS = {
    "cornering_stiffness": {"rear": 6000.0, "front": 5000.0}, "relaxation_length": {"rear": 0.12, "front": 0.1}
}  # fmt: skip


def test_numbers_of_a_model_file_are_a_tyre_known_to_a_tenth():
    first = tyre_cases(small(contact=NUMBERS)).studied[0]
    assert first.contact.tolist() == [6000.0, 0.12, 5000.0, 0.1]
    np.testing.assert_allclose(first.covariance, np.diag((0.1 * first.contact) ** 2))
    assert (first.name, first.condition) == ("tyre of the model file", "as given")
    assert np.isnan(first.pressure_bar)
    assert not first.packaged
    assert not first.extrapolated


def test_pressures_beside_numbers_of_a_tyre_are_refused():
    with pytest.raises(
        InputError, match=r"--pressures 4,7: the model file states the tyre by numbers, .* remove --pres"
    ):
        tyre_cases(small(contact=NUMBERS, pressures=(4.0, 7.0)))


def test_a_tyre_of_its_own_and_another_pressure_on_each_wheel():
    settings = small(
        contact={
            "tyre": {"rear": "Tyre1", "front": "Tyre3"}, "surface": {"rear": "drum", "front": "flat"},
            "pressure_bar": {"rear": 4.0, "front": 7.0},
        }
    )  # fmt: skip
    first = tyre_cases(settings).studied[0]
    rear_load, front_load = settings.bicycle.static_loads
    rear = TyreMap.load("Tyre1", surface="drum").assuming(0.03).at(load=rear_load, pressure=4e5)
    front = TyreMap.load("Tyre3").assuming(0.03).at(load=front_load, pressure=7e5)
    assert first.contact.tolist() == [
        rear.cornering_stiffness, rear.relaxation_length, front.cornering_stiffness, front.relaxation_length
    ]  # fmt: skip
    assert np.sqrt(np.diag(first.covariance))[[1, 3]] == pytest.approx(
        [rear.relaxation_length_sd, front.relaxation_length_sd]
    )
    assert not first.covariance[:2, 2:].any()  # two tyres share nothing
    assert (first.condition, first.pressure_bar, first.tyre) == ("4 / 7 bar", 5.5, "Tyre1 / Tyre3")
    assert first.packaged


def test_results_come_by_rising_pressure_whatever_is_asked_first(monkeypatch, results_alone):
    settings = small(contact={"tyre": "Tyre1", "pressure_bar": 5.5}, fronts=2, samples=20)
    one = settings.reference
    monkeypatch.setattr(Settings, "setups", property(lambda self: (one,)))  # one world tells it
    study = run_study(settings)
    assert [r.case.condition for r in study.results_of(settings.reference)] == ["3.5 bar", "5.5 bar", "7.5 bar"]
    assert [case.condition for case in study.subject] == ["3.5 bar", "5.5 bar", "7.5 bar"]
    assert study.focus.condition == "5.5 bar"
    (decomposition,) = [d for d in study.decompositions if d.setup == settings.reference]
    assert (decomposition.higher.condition, decomposition.lower.condition) == ("7.5 bar", "3.5 bar")
