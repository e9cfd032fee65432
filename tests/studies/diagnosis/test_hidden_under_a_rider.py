"""An effect hidden under a rider who steers, made by equations that the fitter does not know: named with its size."""

import pytest
from small_library import among

from studies.diagnosis import find_candidates, read_measurement
from tests.validation import under_a_rider

LIKELY = {"steer_damper", "steer_spring", "pneumatic_trail", "speed_scale"}


@pytest.mark.parametrize("hidden", [("steer_damper",), ()])
def test_a_known_rider_is_part_of_the_base_model(hidden, tmp_path):
    truth = under_a_rider.make(tmp_path, hidden, seed=7000)
    measurement = read_measurement(tmp_path / "MEASUREMENT.toml")
    assert {"rider_control", "rider_steer_memory"} <= {effect.identifier for effect in measurement.model.effects}
    found = among(measurement, LIKELY).verdict
    if not hidden:
        assert found.verdict == "none"
        return
    assert (found.verdict, found.equivalent) == ("named", hidden)
    value, sd = found.effects[0].parameters["damping"]
    assert abs(value - truth["steer_damper"]["damping"]) < 4 * sd


def test_nobody_guesses_a_rider(tmp_path):
    under_a_rider.make(tmp_path, (), seed=1)
    found, refused = find_candidates(read_measurement(tmp_path / "MEASUREMENT.toml").model, {})
    assert not {"rider_control", "rider_path", "rider_delay"} & {one.identifier for one in found}
    assert "a rider who steers is known or measured, not guessed" in refused["rider_delay"]
