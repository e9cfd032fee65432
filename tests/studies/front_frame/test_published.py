"""Published figures of a front frame become a hinge; what does not go together is refused."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from studies.front_frame import PublishedFigures, front_frame, map_figures, map_of, read_map
from tyre.ground import InputError

SUMMARY = json.loads(
    (Path(__file__).parents[3] / "data" / "validation" / "published_front_figures.json").read_text(encoding="utf-8")
)
PAIR = {"head_tube_N_m_per_deg": 95.0, "fork_N_per_mm": 45.0}


def test_the_packaged_map_is_that_of_the_validation():
    assert read_map() == map_of(SUMMARY["map"])


def test_the_intervals_hold_fresh_frames():
    """At least 90 of 100 frames that did not tune the map, within 25 %; of the head tube alone wider."""
    for method in ("pair", "ground"):
        fresh = SUMMARY["fresh"][method]
        assert fresh["fronts"] == 100
        assert fresh["stiffness_held"] >= 90
        assert fresh["height_held"] >= 90
        assert fresh["half_width"] <= 0.25
    assert SUMMARY["fresh"]["head_tube"]["stiffness_held"] >= 90


@pytest.mark.parametrize(
    "figures", [PAIR, {"head_tube_N_m_per_deg": 95.0}, {"ground_deflection_mm": 32.7, "weight_kg": 20.0}]
)
def test_another_authors_frame_is_held(figures):
    """A frame of 95 N m/deg with a fork of 45 N/mm tilts 3435 N m/rad about a point 0.308 m above the hub."""
    hinge = front_frame(**figures)
    low, high = hinge.stiffness_interval
    assert low < 3435 < high
    assert high / low < 2.2
    assert hinge.height_interval[0] < 0.308 < hinge.height_interval[1]
    assert hinge.stiffness == pytest.approx(3510, rel=0.12)


def test_frame_and_fork_are_two_springs_in_series():
    content = read_map()
    hinge = front_frame(**PAIR)
    frame, fork = content.frame["factor"] * math.degrees(95.0), content.fork["stiffness_N_m_per_rad"]
    assert hinge.stiffness == pytest.approx(frame * fork / (frame + fork))
    # the hinge of both lies between the two, nearer to the softer one
    weights = np.array([1 / frame, 1 / fork])
    heights = np.array([content.frame["height_m"], content.fork["height_m"]])
    assert hinge.height == pytest.approx(weights @ heights / weights.sum())
    assert hinge.stiffness < min(frame, fork)


def test_a_stiffer_head_tube_or_fork_is_a_stiffer_front():
    soft = front_frame(head_tube_N_m_per_deg=70, fork_N_per_mm=45).stiffness
    assert soft < front_frame(**PAIR).stiffness < front_frame(head_tube_N_m_per_deg=95, fork_N_per_mm=70).stiffness
    ground = [front_frame(ground_deflection_mm=mm, weight_kg=20).stiffness for mm in (40, 32.7, 28)]
    assert ground == sorted(ground)


def test_more_figures_leave_less_open():
    assert front_frame(**PAIR).relative_sd < front_frame(head_tube_N_m_per_deg=95).relative_sd


def test_the_error_of_the_figures_counts():
    """Twice the error of the ground figure adds its power squared times the variance."""
    content = read_map()
    figures = PublishedFigures(ground_deflection_mm=32.7, weight_kg=20.0)
    exact = map_figures(figures, map_of(SUMMARY["map"] | {"figure_sd": 0.0})).covariance[0, 0]
    added = map_figures(figures, content).covariance[0, 0] - exact
    assert added == pytest.approx((content.ground["power"] * content.figure_sd) ** 2, rel=1e-6)


@pytest.mark.parametrize(
    ("figures", "words"),
    [
        ({}, "give either the stiffness of the head tube"),
        ({"fork_N_per_mm": 45.0}, "the fork alone says little"),
        ({"ground_deflection_mm": 30.0}, "needs the weight"),
        ({"weight_kg": 20.0}, "needs the weight"),
        (PAIR | {"ground_deflection_mm": 30.0, "weight_kg": 20.0}, "give either"),
        ({"head_tube_N_m_per_deg": -95.0}, "head_tube_N_m_per_deg = -95 must be above 0"),
        ({"head_tube_N_m_per_deg": math.nan}, "must be above 0"),
        ({"head_tube_N_m_per_deg": 5443.0}, "5443 N m/deg is outside 61 to 143 N m/deg"),
        (PAIR | {"fork_N_per_mm": 45000.0}, "check the unit"),
    ],
)
def test_what_does_not_go_together_is_refused(figures, words):
    with pytest.raises(InputError) as refused:
        front_frame(**figures)
    assert words in str(refused.value)


def test_a_figure_outside_the_frames_is_noted():
    (note,) = front_frame(head_tube_N_m_per_deg=95, fork_N_per_mm=100).notes
    assert note.startswith("fork 100 N/mm is outside 29 to 83 N/mm")
    assert "extrapolated" in note
    assert front_frame(**PAIR).notes == ()
