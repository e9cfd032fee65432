"""The page on riders who steer: its file is read, and its counts are those of the packaged riders and of the study."""

import json
import re
from pathlib import Path

import pytest
from pages import section

from bicycle import Model, effect_class, load_bicycle
from studies.motion import available_controls, read_rider_control, rides

ROOT = Path(__file__).parents[2]
PAGE = section("riders", "A rider who steers")


def test_the_file_of_the_page_is_a_rider(tmp_path):
    (tmp_path / "mine.toml").write_text(re.search(r"^```toml\n(.*?)^```", PAGE, flags=re.M | re.S)[1])
    rider = read_rider_control(tmp_path / "mine.toml")
    assert rider.at(4.5)["roll"] == pytest.approx(42.5)
    assert all(f"`{name}`" in PAGE for name in available_controls())


def test_the_counts_of_riders_are_those_of_their_roots():
    sentence = r"All (\d+) identified riders hold .* slip,\s(\d+) on tyres of 7000 N/rad,\s(\d+) with camber"
    counts = [int(found) for found in re.search(sentence, PAGE, flags=re.S).groups()]
    bicycle, rider = load_bicycle("rigid_rider_joined"), read_rider_control("schwab2013")
    tyre = effect_class("side_slip")(cornering_stiffness=7000.0)
    camber = effect_class("camber_thrust")(
        camber_stiffness=dict(zip(("rear", "front"), bicycle.static_loads, strict=True))
    )
    models = {"rigid": Model(bicycle), "tyre": Model(bicycle, tyre), "camber": Model(bicycle, (tyre, camber))}
    held = []
    for ride in rides(rider, models):
        runs = [{name: values[k] for name, values in rider.gains.items()} for k in range(15)]
        held.append(sum(ride.root(gains, v)[0].real < 0 for gains, v in zip(runs, rider.speeds, strict=True)))
    assert counts == held


def test_the_counts_of_hands_are_those_of_the_study():
    study = json.loads((ROOT / "data" / "validation" / "hands_on_the_bar.json").read_text())
    postures = study["postures"].values()
    both = sum(one["onset_and_frequency"] for one in postures)
    spread = [one["steer_over_roll_of_those_5_50_95"] for one in postures]
    text = " ".join(PAGE.split())
    assert f"Of {3 * study['draws']} parameter samples on `pista_charlie` {both} meet the first two" in text
    assert f"steer is {min(s[0] for s in spread):.0f} to {max(s[2] for s in spread):.0f} times" in text
    assert sum(one["all_three"] for one in postures) == 0
    middle = [one["ranges_of_those_5_50_95"]["rider_hands.grip_stiffness"][1] for one in postures]
    assert all(50 < value < 70 for value in middle)
    assert study["bands"] == {"wobble_frequency_Hz": [8, 12], "onset_m_s": [2, 6], "steer_over_roll": [3, 5]}
