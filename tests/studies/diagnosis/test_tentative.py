"""What leads its own table is never hidden: verdicts with a reservation, on synthetic files of an independent model."""

from pathlib import Path

import pytest
from small_library import among

from studies.diagnosis import find, read_measurement

TRIED = ("front_compliance", "steer_spring", "steer_damper", "pneumatic_trail", "crown_radius", "camber_thrust",
         "speed_scale")  # fmt: skip
CASES = Path(__file__).parent / "search_cases"


@pytest.mark.parametrize(("case", "hidden", "parameter", "truth", "reservation", "nothing"), [
    ("modal_005", "front_compliance", "stiffness", 151.217, "a size that occurs", "impossible"),
    (
        "modal_009",
        "steer_spring",
        "stiffness",
        0.77028,
        "survives doubling the uncertainty of the parameters",
        "possible",
    ),
])  # fmt: skip
def test_what_explains_everything_is_said_with_its_reservation(case, hidden, parameter, truth, reservation, nothing):
    measurement = read_measurement(CASES / case / "measurement.toml")
    verdict = among(measurement, TRIED).verdict
    assert verdict.verdict == "tentative"
    (effect,) = verdict.effects
    assert effect.identifier == hidden
    value, sd = effect.parameters[parameter]
    assert value == pytest.approx(truth, abs=3 * sd)
    assert reservation in [check.what for check in verdict.failed]
    assert (verdict.posterior["none"] < 1e-99) == (nothing == "impossible")
    assert verdict.goodness_of_fit_p > 0.01
    assert set(verdict.reasons) == set(verdict.equivalent)


def test_what_may_be_nothing_is_told_from_nothing():
    """A name that does not survive doubled uncertainties."""
    measurement = read_measurement(CASES / "modal_009" / "measurement.toml")
    found = among(measurement, TRIED)
    (failed,) = (check for check in found.verdict.checks if not check.passed)
    assert failed.what == "survives doubling the uncertainty of the parameters"
    findings = find(found)
    assert findings.between == ("steer_spring", "none")
    assert len(findings.further) > 3
