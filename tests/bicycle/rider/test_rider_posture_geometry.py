"""Seat geometry: files, the raw measurements of the neighbouring project, points of contact and the fit rule."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicycle.rider import SeatGeometry, complete_geometry, contacts, packaged_geometry, read_geometry, read_rider
from tyre.ground import InputError

BICYCLE = {"w": 1.02, "rR": 0.33, "rF": 0.34}
RAW = """whb = 0.535 # width
lst = 0.5476875
lsp = 0.2032
LhbR = 1.0795+/-0.004
LhbF = 0.90805
hbb = 0.291
lcs = 0.423
lamst = 1.267109037+/-0.01
aB1 = -0.5215+/-0.001
"""


@pytest.fixture
def file(tmp_path):
    def make(text, name="seat.toml"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return make


def test_the_raw_measurements_are_the_packaged_geometry(file):
    raw, packaged = read_geometry(file(RAW, "RigidMeasured.txt"), "drops"), read_geometry(
        packaged_geometry("rigid"), "upright"
    )  # fmt: skip
    assert raw.values == pytest.approx(packaged.values)
    assert raw.sd["rear_hub_to_hand_m"] == 0.004
    assert raw.sd["seat_tube_angle_deg"] == pytest.approx(math.degrees(0.01))
    assert raw.sd["saddle_distance_m"] == 0.005
    with pytest.raises(InputError, match="seat and handlebar need .*; missing: lsp"):
        read_geometry(file(RAW.replace("lsp", "lxx"), "a.txt"), "drops")
    with pytest.raises(InputError, match="line 3: lsp = 'abc' is not a finite number"):
        read_geometry(file(RAW.replace("0.2032", "abc"), "a.txt"), "drops")


@given(st.floats(0.2, 0.9), st.floats(0.8, 1.3), st.floats(0.15, 0.35))
def test_hands_are_where_both_hubs_see_them(x, height, half):
    """From a point to its distances in space and back."""
    hubs = (np.array([0.0, 0.0, -0.33]), np.array([1.02, 0.0, -0.34]))
    hand = np.array([x, half, -height])
    distances = [float(np.linalg.norm(hand - hub)) for hub in hubs]
    found = contacts(
        SeatGeometry(
            {
                "chain_stay_m": 0.42, "bottom_bracket_height_m": 0.28, "seat_tube_angle_deg": 73,
                "saddle_distance_m": 0.7,
                "hand_width_m": 2 * half, "rear_hub_to_hand_m": distances[0], "front_hub_to_hand_m": distances[1],
            }
        ),
        BICYCLE,
    )  # fmt: skip
    np.testing.assert_allclose(found.hands, [x, -height], atol=1e-9)
    assert np.hypot(*(found.pedals - [0, -0.33])) == pytest.approx(0.42)
    assert np.hypot(*(found.pedals - found.hip)) == pytest.approx(0.7)
    assert found.hip[0] < found.pedals[0]


def test_a_posture_has_its_own_hands(file):
    path = file(
        "[values]\nreach_m = 0.6\ndrop_m = -0.1\n[posture.drops]\nreach_m = 0.7\ndrop_m = 0.2\n[sd]\nreach_m = 0.002\n"
    )
    assert read_geometry(path, "upright").values == {"reach_m": 0.6, "drop_m": -0.1}
    assert read_geometry(path, "upright").source == path.name  # where the file states no source
    drops = read_geometry(path, "drops")
    assert drops.values == {"reach_m": 0.7, "drop_m": 0.2}
    assert (drops.sd, drops.assumed) == ({"reach_m": 0.002, "drop_m": 0.005}, ())


@pytest.mark.parametrize(("text", "message"), [
    ("value = 1", "unknown key 'value'; did you mean 'values'"),
    ("[values]\nchain_stay = 0.4", "unknown values 'chain_stay'; did you mean 'chain_stay_m'"),
    ("[values]\nchain_stay_m = 423", "chain_stay_m = 423 is outside 0.2 to 1.2; is the unit right"),
    ("[values]\nseat_tube_angle_deg = 1.27", "seat_tube_angle_deg = 1.27 is outside 20 to 110"),
    ("[values]\nchain_stay_m = true", r"\[values\]: chain_stay_m = True must be a finite number"),
    ("[values]\nreach_m = 0.6", "give the hands either by rear_hub_to_hand_m .* leave all four out"),
    ("[values]\nreach_m=0.6\ndrop_m=0\nrear_hub_to_hand_m=1\nfront_hub_to_hand_m=1", "give the hands either by"),
    ("[posture.dropps]\nreach_m = 0.6", "unknown posture 'dropps'; did you mean 'drops'"),
    ("[posture.drops]\nchain_stay_m = 0.4", r"\[posture.drops\]: unknown key 'chain_stay_m'"),
    ("[sd]\nreach_m = -1", "a standard deviation must not be negative"),
    ("assumed = 3", "assumed = 3 must be a list of keys"),
    ("assumed = ['reach_m']", "unknown assumed key 'reach_m'"),
    ("values = 3", r"values = 3 must be a table: write \[values\]"),
])  # fmt: skip
def test_what_is_refused(file, text, message):
    with pytest.raises(InputError, match=message):
        read_geometry(file(text), "drops")


def test_files_that_are_none(tmp_path):
    for name in ("no.toml", "no.txt"):
        with pytest.raises(InputError, match=f"{name}: no such geometry file"):
            read_geometry(tmp_path / name, "drops")


def test_the_fit_rule_fills_in_and_says_so():
    rider, known = read_rider("jason"), SeatGeometry({"chain_stay_m": 0.43}, {"chain_stay_m": 0.001})
    filled = complete_geometry(known, rider, BICYCLE, hand_width=0.42)
    assert filled.values["chain_stay_m"] == 0.43
    assert "chain_stay_m" not in filled.assumed
    assert set(filled.assumed) == {
        "bottom_bracket_height_m", "seat_tube_angle_deg", "saddle_distance_m", "hand_width_m"
    }  # fmt: skip
    # the rule of 0.883 of the inseam (crotch to floor), published by LeMond, agrees within its sd
    inseam = rider.leg - rider.lengths["Lj1L"]
    assert abs(filled.values["saddle_distance_m"] - 0.883 * inseam) < filled.sd["saddle_distance_m"]
    assert filled.sd["saddle_distance_m"] > 0.02


def test_distances_that_make_no_triangle():
    values = {
        "chain_stay_m": 0.42, "bottom_bracket_height_m": 0.28, "seat_tube_angle_deg": 73, "saddle_distance_m": 0.7,
        "hand_width_m": 0.5, "rear_hub_to_hand_m": 0.4, "front_hub_to_hand_m": 0.4,
    }  # fmt: skip
    with pytest.raises(InputError, match=r"make no triangle over hubs that are 1.020 m apart; measure the distances"):
        contacts(SeatGeometry(values), BICYCLE)
    with pytest.raises(InputError, match="chain_stay_m = 0.2 is shorter than the height of the rear hub"):
        contacts(SeatGeometry({**values, "chain_stay_m": 0.2, "bottom_bracket_height_m": 0.1}), BICYCLE)
