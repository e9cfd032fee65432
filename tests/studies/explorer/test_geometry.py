"""Sliders of geometry and masses: the bicycle they make, what cannot be, and the side view that moves along."""

import re

import numpy as np
import pytest

from bicycle import load_bicycle
from bicycle.model import build_model
from studies import explorer as site
from tests.shared.explorer_page import NOTHING_WAITS, QUIET, until
from tyre.ground import InputError

HINGED = (
    "bicycle=benchmark&effects.relaxation_length.cornering_stiffness=6000&effects.relaxation_length.relaxation_length=0.1"
    "&effects.front_compliance.joint_x=0.9&effects.front_compliance.joint_z=-0.6"
)


def test_a_moved_bicycle_is_the_one_with_these_numbers():
    """Weave and capsize of the benchmark with 0.05 m of trail and a head angle of 70 deg, wheelbase 1.1 m."""
    bicycle = load_bicycle("benchmark")
    by_hand = bicycle.replace(c=0.05, lam=np.radians(20.0), w=1.1, xH=bicycle["xH"] + 1.1 - bicycle["w"], zB=-1.0)
    address = "&".join(["bicycle=benchmark", "geometry.trail=0.05", "geometry.head_angle=70", "geometry.wheelbase=1.1",
                        "geometry.rear_height=1"])  # fmt: skip
    found = site.build(site.parse_state(address))
    assert dict(found.bicycle.values) == pytest.approx(dict(by_hand.values))
    assert site.parse_state(site.parse_state(address).address) == site.parse_state(address)
    for field, key in zip(site.slider_fields(found.bicycle), site.SLIDERS, strict=True):
        expected = {"trail": 0.05, "head_angle": 70.0, "wheelbase": 1.1, "rear_height": 1.0}.get(key)
        assert float(field["low"]) <= float(field["value"]) <= float(field["high"])
        assert expected is None or float(field["value"]) == pytest.approx(expected, rel=1e-3)
    saved = site.model_content(site.parse_state(address))
    assert build_model(saved).bicycle.values == pytest.approx(dict(by_hand.values))


def test_the_hinge_of_the_front_keeps_its_distance_from_the_steer_axis():
    state = site.parse_state(f"{HINGED}&geometry.trail=0.1&geometry.head_angle=75")
    before = load_bicycle("benchmark")
    joint = site.build(state).parameters["front_compliance.joint_x"]
    axis = [before["w"] + trail - 0.6 * np.tan(np.radians(90 - angle)) for trail, angle in ((0.08, 72), (0.1, 75))]
    assert joint - axis[1] == pytest.approx(0.9 - axis[0], abs=1e-9)


@pytest.mark.parametrize(("key", "value", "words"), [
    ("wheelbase", 0.6, "the wheels overlap by"), ("rear_wheel_radius", 0.8, "the wheels overlap by"),
    ("trail", 0.4, "the fork needs an offset of"), ("head_angle", 30, "must be between 45 and 90 deg"),
    ("front_mass", 0, "must be above 0"), ("rear_x", 1.5, "of the weight; the bicycle tips over"),
    ("front_height", -0.2, "must be above 0"),
])  # fmt: skip
def test_geometry_that_cannot_be_names_its_slider(key, value, words):
    with pytest.raises(site.Misfit, match=words) as refused:
        site.move_bicycle(load_bicycle("benchmark"), {key: float(value)})
    assert refused.value.key == f"geometry.{key}"
    with pytest.raises(InputError, match="geometry: unknown key 'tail'"):
        site.move_bicycle(load_bicycle("benchmark"), {"tail": 1.0})


def test_a_height_above_the_hub_follows_the_steer_axis():
    """Trail and head angle move the axis; the hinge stays 0.3 m above the hub's nearest point on it."""
    front = "effects.front_compliance.height_above_hub=0.3&effects.front_compliance.damping_ratio=0.1"
    address = f"{HINGED.partition('&effects.front')[0]}&{front}&geometry.trail=0.05&geometry.head_angle=70"
    state = site.parse_state(address)
    p = site.build(state).parameters
    lean = np.radians(20.0)
    to_hub = 0.05 * np.sin(lean) + p["rF"] * np.cos(lean)  # from the ground, along the axis
    assert p["front_compliance.joint_z"] == pytest.approx(-(to_hub + 0.3) * np.cos(lean))
    hinge = dict(site.side_view(site.build(state).bicycle, site.model_content(state)["effects"])["lines"])["hinge"]
    first = np.array(hinge[0].split("L")[0].split(" "), float)
    place = 1e3 * np.array([p["front_compliance.joint_x"], p["front_compliance.joint_z"]])
    np.testing.assert_allclose(first, place - 50, atol=0.1)


def test_what_a_hinge_means_stands_beside_its_numbers():
    state = site.parse_state(HINGED)
    assert set(site.words_beside(site.build(state))) == {
        "effects.front_compliance.joint_z",
        "effects.front_compliance.damping",
    }
    words = site.words_beside(site.build(state))["effects.front_compliance.joint_z"]
    height = 0.6 / np.cos(np.pi / 10) - 0.08 * np.sin(np.pi / 10) - 0.35 * np.cos(np.pi / 10)  # by hand, m
    assert words == f"{height:.2f} m above the front hub"
    assert f'data-beside="{"effects.front_compliance.joint_z"}"' in site.controls_html(state)["model"]


def test_what_stands_for_parameters_has_a_field_in_their_place():
    front = "effects.front_compliance.height_above_hub=0.3&effects.front_compliance.damping_ratio=0.1"
    html = site.controls_html(site.parse_state(f"{HINGED.partition('&effects.front')[0]}&{front}"))["model"]
    shown = set(re.findall(r'for="n-effects\.front_compliance\.(\w+)"', html))
    assert shown == {"stiffness", "axis_tilt", "damping_ratio", "height_above_hub"}


def test_the_side_view_is_to_scale():
    bicycle = load_bicycle("benchmark")
    found = site.side_view(bicycle, {"front_compliance": {"joint_x": 0.9, "joint_z": -0.6}})
    circles = {(kind, x, z): r for kind, x, z, r in found["circles"]}
    assert circles["wheel", 0.0, -300.0] == 300.0
    assert circles["wheel", 1020.0, -350.0] == 350.0
    assert ("mass", 300.0, -900.0) in circles  # of frame and rider
    lines = dict(found["lines"])
    assert lines["trail"] == ["1020.0 30.0L1100.0 30.0"]
    start, end = (np.array(point.split(" "), float) for point in lines["axis"][0].split("L"))
    assert start.tolist() == [1100.0, 0.0]
    assert (start[0] - end[0]) / -end[1] == pytest.approx(np.tan(np.pi / 10), abs=1e-4)  # 18 deg
    assert "rider" in lines
    assert "hinge" in lines
    assert "rider" not in dict(site.side_view(load_bicycle("pista"), {})["lines"])


def test_the_axis_of_frequencies_holds_what_is_slow():
    """The wheels on their tyres oscillate at 45 Hz; wobble at 8 and weave at 2 Hz need the room."""
    found = site.compute_modes(site.start_state(None))
    top = site.modes_figure(found, {}, site.LIGHT)["layout"]["yaxis2"]["range"][1]
    assert max(np.nanmax(found.named.frequency(name)) for name in found.named.names) > 20
    assert np.nanmax(found.named.frequency("wobble")) < top < 20


def test_sliders_move_the_view_and_two_bicycles_stand_side_by_side(opened):
    page = opened("bicycle=pista_rider")
    until(page, f"{NOTHING_WAITS} && {QUIET} && document.querySelector('#sides svg')")
    trail = page.locator("#sides .side-trail").first.get_attribute("d")
    page.fill("[id='n-geometry.trail']", "0.09")
    until(page, f"document.querySelector('#sides .side-trail').getAttribute('d') !== {trail!r} && {QUIET}")
    assert "trail 90 mm" in page.inner_text("#sides figcaption")
    page.fill("[id='n-geometry.wheelbase']", "0.5")
    until(page, "document.getElementById('said-geometry.wheelbase').textContent")
    assert re.match("the wheels overlap by 1.. mm", page.inner_text("[id='said-geometry.wheelbase']"))
    assert page.inner_text("#message") == ""
    page.fill("[id='n-geometry.wheelbase']", "1.0")
    until(page, f"{QUIET} && !document.getElementById('said-geometry.wheelbase').textContent")
    page.click("#pin")
    page.select_option("#c-bicycle", "browser")
    until(page, f"{QUIET} && document.querySelectorAll('#sides svg').length === 2")
    captions = page.locator("#sides figcaption").all_text_contents()
    assert [text.partition(":")[0] for text in captions] == ["browser", "pista_rider, modified"]
    assert "geometry" not in page.url.partition("&pin")[0]
