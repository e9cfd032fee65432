"""The page on the pipe from a simulated ride to a verdict runs as it stands, and tells of every key of a sensor."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from pages import few_hypotheses, run_page, section

from studies.motion import LIMITS, RECORDED, read_sensors

PAGE = section("diagnose", "Simulate, identify, diagnose")
HIDDEN = 2.0  # N m s/rad, which the page puts into ridden.toml
MODAL = ("steer_damper", "rider_arms", "steer_spring", "pneumatic_trail")
TRIED = {"modes.toml": MODAL, "kicks.toml": (*MODAL, "steer_friction", "steer_scale")}


def damping(file):
    """Damping of the leading hypothesis: value and sd, where that is the damper."""
    content = json.loads(Path(file).read_text(encoding="utf-8"))
    assert content["class"][0] in ("steer_damper", "rider_arms"), content["class"]
    assert "steer_damper" in content["class"]
    (effect,) = content["effects"]
    return effect["parameters"]["damping"].values()


def test_the_screen_of_a_real_case_is_shown(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (shown,) = run_page(section("diagnose", "Meaning"))
    assert shown.startswith("unknown. ")


@pytest.mark.usefixtures("no_pictures")
def test_the_page_runs_and_the_damper_is_found(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run_page(PAGE, few_hypotheses(TRIED))
    for file in ("modes.json", "kicks.json"):
        value, sd = damping(file)
        assert value == pytest.approx(HIDDEN, abs=1.96 * sd), file
        assert sd < 0.2 * HIDDEN
    recorded, again = (pd.read_csv(file, comment="#") for file in ("kick_1/recording.csv", "again/response_linear.csv"))
    assert set(recorded["steer_torque_N_m"]) == {-2.0, 0.0, 2.0}
    joined = np.interp(again["time_s"], recorded["time_s"], recorded["steer_torque_N_m"])
    assert again["steer_torque_N_m"].to_numpy() == pytest.approx(joined, abs=1e-9)
    assert sorted(read_sensors(Path("kicked.toml")).channels) == ["roll_rate_rad_s", "steer_rad", "steer_torque_N_m"]


def test_every_key_and_channel_stands_on_the_page():
    assert [name for name in (*LIMITS, *RECORDED) if f"`{name}`" not in PAGE] == []
    assert [row.split("`")[1] for row in PAGE.splitlines() if row.startswith("| `")] == [
        "low_pass_hz", "delay_s", "scale_error", "offset", "drift_per_s", "noise_sd", "correlation", "bandwidth_hz",
        "resolution",
    ]  # fmt: skip
