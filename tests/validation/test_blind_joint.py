"""Blind joint cases: readable alone and together, repeatable, with a mistake where one is planted."""

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
    ratios = []
    for name in "ab":
        whole = read_measurement(tmp_path / name / "MEASUREMENT.toml")
        channels = next(part.kind for part in whole.parts if part.name == "kicks").runs[0].channels
        ratios.append(np.std(channels["steer_rad"][20:]) / np.std(channels["roll_rate_rad_s"][20:]))
    assert ratios[1] / ratios[0] != pytest.approx(1, abs=0.02)


def test_the_speed_of_the_modes_can_be_wrong(tmp_path):
    found = case(tmp_path, "speed")
    assert found.planted == "modes"
    assert OFFSET[0] <= abs(found.mistake["speed_offset"]) <= OFFSET[1]


@pytest.mark.parametrize(("planted", "place", "span"), [("speed", 0, OFFSET), ("scale", 1, SCALE)])
def test_a_planted_mistake_has_either_sign_and_fills_its_range(planted, place, span):
    rng = np.random.default_rng(8)
    drawn = np.array([draw_mistake(planted, rng) for _ in range(2000)])
    sizes = np.abs(drawn[:, place])
    assert [sizes.min(), sizes.max()] == pytest.approx(span, abs=0.02 * (span[1] - span[0]))
    assert 0.45 < np.mean(drawn[:, place] < 0) < 0.55
    assert (drawn[:, 1 - place] == 0).all()
