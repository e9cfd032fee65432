"""Answers to questions are what the package computes."""

import math

import pytest
from pages import page, run_page

import studies.velotyre as vt

PAGE = page("faq")


def wobble(stiffness, damping):
    tyre = vt.read_tyre("Tyre1")
    bicycle = vt.load_bicycle("pista_charlie_drops")
    loads = bicycle.static_loads
    at = {wheel: tyre.at(load=load, pressure=5.5e5) for wheel, load in zip(("rear", "front"), loads, strict=True)}
    lag = vt.RelaxationLength(
        cornering_stiffness={wheel: one.cornering_stiffness for wheel, one in at.items()},
        relaxation_length={wheel: one.relaxation_length for wheel, one in at.items()},
    )
    front = vt.FrontCompliance(stiffness=stiffness, damping=damping, joint_x=0.86, joint_z=-0.65)
    found = vt.critical_speeds(vt.Model(bicycle, [lag, front]))
    return next(one for one in found if one.mode == "wobble"), at["front"].relaxation_length


def test_the_page_runs_and_says_what_is_seen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shown = run_page(PAGE)
    on_the_bar = shown[2]
    assert "capsize" in on_the_bar
    assert "wobble" not in on_the_bar  # "this bicycle does not wobble"


def test_the_onset_follows_the_damping_of_the_front():
    for damping, told in ((20, "5.7 m/s with 5000 N m/rad and 20 N m s/rad"), (5, "1.3 m/s with 5 N m s/rad")):
        onset, _ = wobble(5000, damping)
        assert told.startswith(f"{onset.speed:.1f} m/s")
        assert told in PAGE
    onset, relaxation = wobble(4000, 12)
    assert onset.speed / onset.frequency_hz == pytest.approx(0.4, abs=0.005)  # "the wave on the road is 0.4 m long"
    assert onset.speed / onset.frequency_hz / relaxation == pytest.approx(3.5, abs=0.3)


@pytest.mark.parametrize(("growth", "seconds"), [(0.1245, 6), (3.925, 0.2), (0.0613, 11)])
def test_times_of_doubling(growth, seconds):
    assert math.log(2) / growth == pytest.approx(seconds, rel=0.13)
