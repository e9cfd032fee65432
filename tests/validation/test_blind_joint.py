"""Blind joint cases: readable alone and together, repeatable, with a mistake where one is planted."""

import re

import numpy as np
import pytest

from studies.diagnosis import read_measurement
from tests.validation.blind.joint import OFFSET, SCALE, draw_mistake, joint_case


def case(folder, planted="", seed=3):
    return joint_case(folder, hidden=("steer_damper",), rng=np.random.default_rng(seed), planted=planted, third=True)


def test_a_case_is_read_as_a_whole_and_part_by_part(tmp_path):
    found = case(tmp_path)
    assert found.parts == ("modes", "kicks", "pushes")
    assert set(found.truth.effects) == {"steer_damper"}
    whole = read_measurement(tmp_path / "MEASUREMENT.toml")
    assert [part.name for part in whole.parts] == list(found.parts)
    for name, part in ((part.name, part.kind) for part in whole.parts):
        alone = read_measurement(tmp_path / f"{name}.toml")
        assert getattr(alone, "points", ()) == getattr(part, "points", ())
        assert len(getattr(alone, "runs", ())) == len(getattr(part, "runs", ()))
        assert alone.uncertainty == part.uncertainty
    assert "hidden" not in (tmp_path / "MEASUREMENT.toml").read_text()


def test_a_seed_gives_the_same_case(tmp_path):
    assert case(tmp_path / "a") == case(tmp_path / "b")
    for file in (tmp_path / "a").iterdir():
        assert file.read_text() == (tmp_path / "b" / file.name).read_text()


def test_the_mistake_of_a_sensor_is_in_the_kicks_alone(tmp_path):
    true, wrong = case(tmp_path / "a"), case(tmp_path / "b", "scale")
    assert (true.planted, wrong.planted) == ("", "kicks")
    ((name, size),) = wrong.mistake.items()
    assert name == "steer_scale"
    assert SCALE[0] <= abs(size) <= SCALE[1]
    read = [read_measurement(tmp_path / name / "MEASUREMENT.toml") for name in "ab"]
    kicks = [next(part.kind for part in whole.parts if part.name == "kicks").runs[0] for whole in read]
    inner = slice(20, None)
    other = [np.std(run.channels["steer_rad"][inner]) / np.std(run.channels["roll_rate_rad_s"][inner]) for run in kicks]
    assert other[1] / other[0] != pytest.approx(1, abs=0.02)


def test_the_speed_of_the_modes_can_be_wrong(tmp_path):
    found = case(tmp_path, "speed")
    assert found.planted == "modes"
    assert OFFSET[0] <= abs(found.mistake["speed_offset"]) <= OFFSET[1]


@pytest.mark.parametrize(
    ("planted", "place", "said", "unit"),
    [("speed", 0, r"([\d.]+) to ([\d.]+) m/s", 1.0), ("scale", 1, r"([\d.]+) to ([\d.]+) %", 0.01)],
)
def test_a_planted_mistake_has_the_sizes_that_are_documented(planted, place, said, unit):
    """Of 2000 drawn ones none lies outside, some lie within 2 % of the range from either end, half are below zero."""
    low, high = (unit * float(end) for end in re.search(said, draw_mistake.__doc__).groups())
    rng = np.random.default_rng(8)
    drawn = np.array([draw_mistake(planted, rng) for _ in range(2000)])
    sizes = np.abs(drawn[:, place])
    assert low <= sizes.min() <= low + 0.02 * (high - low)
    assert high - 0.02 * (high - low) <= sizes.max() <= high
    assert 0.45 < np.mean(drawn[:, place] < 0) < 0.55
    assert (drawn[:, 1 - place] == 0).all()
