"""What others published, recomputed with the packaged models: the rows of the page of published numbers."""

import json

import numpy as np
import pytest

from bicycle.model import available_models, read_model
from bicycle.parameters import UNITS
from tests.published.papers import FOOT, HERE, ROWS, SIGNS, loads_1994, moore, other_code, page, sharp1994, tyres_1994

POUND = 4.4482216152605  # N


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row.paper}: {row.quantity}")
def test_a_published_number_comes_out(row):
    found = row.here
    assert len(found) == len(row.published)
    for here, printed, allowed in zip(found, row.published, row.allowed, strict=True):
        assert abs(here - float(printed)) <= allowed, printed


def test_sharp1971_is_the_set_printed_in_slug_foot_and_pound_force():
    table, found = json.loads((HERE / "sharp1971.json").read_text()), read_model("sharp1971").parameters
    si = {"m": FOOT, "kg": POUND / FOOT, "kg m^2": POUND * FOOT, "m/s^2": FOOT, "rad": 1.0}
    expected = {key: value * si[UNITS[key]] for key, value in table["parameters"].items() if key in UNITS}
    for key, name, unit in (
        ("cornering_stiffness_rear_front_lb_per_rad", "relaxation_length.cornering_stiffness", POUND),
        ("relaxation_length_rear_front_ft", "relaxation_length.relaxation_length", FOOT),
        ("camber_stiffness_rear_front_lb_per_rad", "camber_thrust.camber_stiffness", POUND),
    ):
        expected |= {f"{name}.{w}": unit * x for w, x in zip(("rear", "front"), table[key], strict=True)}
    expected["steer_damper.damping"] = table["steer_damping_lb_ft_s_per_rad"] * POUND * FOOT
    assert {key: found[key] for key in expected} == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("found", moore(), ids=lambda found: found.rider)
def test_riders_of_the_davis_bicycle_have_the_coefficients_that_the_thesis_implies(found):
    """Moore (2012), chapter System Identification: value / (1 + difference) within the rounding of both."""
    assert (found.inside, found.of) == (24, 24)


def test_another_author_s_code_of_sharp_s_equations_gives_the_same_eigenvalues():
    found = other_code()
    assert found.cases == 36
    assert found.difference < 1e-11


@pytest.mark.parametrize("frame", [-1.0, 1.0])
@pytest.mark.parametrize("rider", [-1.0, 1.0])
@pytest.mark.parametrize("sign", SIGNS, ids=lambda sign: sign.says)
def test_a_published_sign_holds_whatever_the_sign_of_the_products_of_inertia(sign, frame, rider):
    """The definition file does not say if its products are entries of the tensor; the packaged models take not."""
    assert sign.holds(**sign.here(frame=frame, rider=rider))


def test_the_packaged_models_have_the_products_with_the_sign_of_sharp_1971():
    for mode in ("wobble", "weave"):
        np.testing.assert_allclose(sharp1994(mode), sharp1994(mode, frame=-1.0, rider=-1.0), rtol=1e-9)


@pytest.mark.parametrize("name", ["sharp1994", "sharp1994_hands_on"])
def test_tyres_of_sharp_1994_are_its_polynomials_at_the_static_loads(name):
    model = read_model(name)
    for effect, table in tyres_1994(*loads_1994(model.bicycle)).items():
        for key, wheels in table.items():
            for wheel, value in wheels.items():
                assert model.parameters[f"{effect}.{key}.{wheel}"] == pytest.approx(value, rel=1e-8)


@pytest.mark.parametrize("name", available_models())
def test_a_packaged_model_states_its_source_and_is_not_doubted(name):
    model = read_model(name)
    assert len(model.bicycle.source) > 40
    assert not [text for text in model.linear_model().warnings if "usual" in text]


def test_the_page_has_every_row():
    shown = page()
    assert [row["quantity"] for row in shown["rows"]] == [row.quantity for row in ROWS]
    assert all(row["difference"] < 0.1 for row in shown["rows"])
    assert len(shown["signs"]) == len(SIGNS)
    assert len(shown["unread"]) > 5
