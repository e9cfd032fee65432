"""Many draws in batches, and critical speeds that share a name."""

from dataclasses import dataclass

import numpy as np

from bicycle.critical.critical_speed import CrossingIdentity, identified
from studies.uncertainty import uncertain_model
from studies.uncertainty.propagation import Uncertainty

GIVEN = {
    "bicycle": "benchmark",
    "effects": {"relaxation_length": {"cornering_stiffness": 6000.0, "relaxation_length": 0.1}},
}


def test_draws_in_several_batches_are_those_of_one(monkeypatch):
    model = Uncertainty(GIVEN, sd={"IBxz": 2.0}, defaults=False)  # so wide that some draws are no bicycles
    z = model.draw(50, 3)
    kept, reasons = model.possible(z)
    assert 16 < len(kept) < 50
    assert sum(reasons.values()) == 50 - len(kept)
    monkeypatch.setattr(uncertain_model, "BATCH", 16)  # the last one is not full
    again, counted = model.possible(z)
    np.testing.assert_array_equal(again, kept)
    assert counted == reasons


def test_critical_speeds_of_one_name_stay_two():
    @dataclass(frozen=True)
    class Crossing:
        mode: str
        destabilising: bool
        speed: float

    found = identified([
        Crossing("wobble", True, 8.0), Crossing("wobble", False, 9.0), Crossing("wobble", True, 15.0),
        Crossing("weave", True, 16.0),
    ])  # fmt: skip
    assert {identity: crossing.speed for identity, crossing in found.items()} == {
        CrossingIdentity("wobble", True, 1): 8.0, CrossingIdentity("wobble", False, 1): 9.0,
        CrossingIdentity("wobble", True, 2): 15.0, CrossingIdentity("weave", True, 1): 16.0,
    }  # fmt: skip
