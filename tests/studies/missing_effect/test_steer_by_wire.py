"""Real recordings with known torque, where VELOTYRE_EXTRA_DATA leads to them; skipped elsewhere."""

import os

import pytest

from studies.inference.fit import fit
from studies.missing_effect import diagnose
from studies.missing_effect.motion.steer_by_wire import VARIABLE, find_folder, steer_by_wire
from tyre.base.errors import InputError


def test_the_variable_must_lead_to_the_recordings(monkeypatch, tmp_path):
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    with pytest.raises(InputError, match=r"no steer_by_wire recordings \(runs.csv\) there"):
        find_folder()


@pytest.mark.skipif(not os.environ.get(VARIABLE), reason=f"{VARIABLE} is not set")
def test_something_that_opposes_the_steer_rate_is_found():
    """A replay made independently of velotyre: viscous steer damping of about 0.5 N m s/rad closes most of the gap.

    Dry friction of about 0.25 N m, which does the same work at 0.6 rad/s (4 T / (pi c)), closes more of it.
    """
    measurement = steer_by_wire(find_folder(), per_speed=2)
    forward = measurement.forward()
    forward = forward.refined(fit(forward))
    candidates = {c.identifier: c for c in forward.candidates}
    viscous, dry = (fit(forward, (candidates["bias"], candidates[name])) for name in ("steer_damper", "steer_friction"))
    assert viscous.theta[-1] == pytest.approx(0.5, abs=0.15)
    assert dry.theta[-1] == pytest.approx(0.25, abs=0.08)
    assert dry.log_evidence > viscous.log_evidence + 50
    found = diagnose(measurement).verdict
    assert found.verdict in ("partial", "class", "named")
    assert {"steer_damper", "steer_friction"} & {e.identifier for e in found.effects}
    assert found.held_out_gap["final"] < 0.5 * found.held_out_gap["nuisance_only"]
