"""What no rig can record is refused at reading, with the unit it may be in."""

import numpy as np
import pytest

from tests.shared.refusals import refuses
from tyre.recordings import Condition, RigRun, check_channels, check_condition

FLAT = Condition("T", 400.0, 5.5e5, "flat")
X = np.linspace(-1.0, 1.0, 9)


def run(**channels):
    usual = {"time": X, "slip_angle": 0.07 * X, "lateral_force": 300 * X, "vertical_load": 400 + X}
    return RigRun(FLAT, "ISO", **{**usual, **channels})


@pytest.mark.parametrize(("values", "words"), [
    ({"pressure": 5.5e7}, r"pressure is 550 bar, .*check the unit \(kPa under bar\?\)"),
    ({"pressure": 80e5}, r"pressure is 80 bar, .*\(psi under bar\?\)"),
    ({"pressure": 5.5e3}, r"pressure is 0.055 bar, .*\(bar under kPa\?\)"),
    ({"load": 4e5}, r"load is 400000 N, .*\(newtons under kN\?\)"),
    ({"load": 0.4}, r"load is 0.4 N, .*\(kilonewtons under N\?\)"),
    ({"load": 1.0}, r"load is 1 N, allowed are 5 to 10000 N; check the unit \(kilonewtons"),
    ({"camber": 5.0}, r"camber is 286.479 deg, .*\(degrees under rad\?\)"),
    ({"drum_radius": 0.05}, r"drum radius is 0.05 m, allowed are 0.1 to 20 m"),
    ({"speed": 1e3}, r"speed is 1000 m/s, allowed are 0 to 60 m/s; check the unit$"),
])  # fmt: skip
def test_conditions_in_other_units(values, words):
    refuses(words, check_condition, Condition(**{**vars(FLAT), **values}), where="t")


@pytest.mark.parametrize(("channels", "words"), [
    ({"slip_angle": 4.0 * X}, r"slip_angle reaches 229.2 deg, .*check the unit \(degrees under rad\?\)"),
    ({"lateral_force": 3e5 * X}, r"lateral_force reaches 3e\+05 N, .*\(newtons under kN\?\)"),
    ({"vertical_load": 40.8 + X}, r"median vertical load is 40.8 N, .*wrong unit \(kg in the recording\?\)"),
    ({"vertical_load": 0.4 + 0.001 * X}, r"wrong unit \(kN in the recording\?\)"),
    ({"vertical_load": 3923.0 + X}, r"wrong unit \(kg in the declared load\?\)"),
    ({"vertical_load": 10.0 + X}, r"wrong unit$"),
    ({"vertical_load": 0.0 * X}, r"median vertical load is 0 N, the declared load .*wrong unit$"),
    ({"vertical_load": 5e-324 + 0.0 * X}, r"median vertical load is 4.941e-324 N, .*wrong unit$"),
])  # fmt: skip
def test_channels_in_other_units(channels, words):
    refuses(words, check_channels, run(**channels), where="t")


@pytest.mark.parametrize("name", ["speed", "pressure", "temperature", "inclination"])
def test_channels_after_one_that_is_missing_are_checked(name):
    refuses(f"{name} is infinite in sample 1", check_channels, run(**{name: np.full(X.size, np.inf)}), where="t")
