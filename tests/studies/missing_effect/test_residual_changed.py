"""What is said where the residual torque takes named numbers elsewhere."""

from types import SimpleNamespace

import numpy as np

from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.residual.changed import changed
from studies.missing_effect.residual.words import _changed

UNKNOWNS = (
    UncertainParameter("xB", "m", {"xB": 1.0}, 0.35, 0.01),
    UncertainParameter("zB", "m", {"zB": 1.0}, -1.1, 0.01),
    UncertainParameter("mass", "kg", {"luggage.mass": 1.0}, 0.0, 5.0, 0.0, size=True),
)
LUGGAGE = Candidate("luggage", UNKNOWNS[2:])


def residual(mass, *, x=0.352):
    """As fitted: luggage of 11.6 +- 1.9 kg was named, and has another ``mass`` with the torque."""
    beside = SimpleNamespace(
        unknowns=UNKNOWNS, theta=np.array([0.352, -1.1, 11.6]), covariance=np.diag([0.005, 0.005, 1.9]) ** 2,
        candidates=(LUGGAGE,), columns=lambda _: slice(2, 3),
    )  # fmt: skip
    fit = SimpleNamespace(theta=np.array([x, -1.1, mass, -3.0]))
    return SimpleNamespace(beside=beside, fit=fit, covariance=np.diag([0.006, 0.006, 3.2, 0.1]) ** 2)


def test_a_named_number_that_the_torque_takes_away_is_told():
    (found,) = changed(residual(0.0))
    assert (found.effect, found.name, found.named, found.value, found.replaced) == ("luggage", "mass", 11.6, 0.0, True)
    said = _changed((found,), written=True)
    assert "luggage.mass 0 ± 3.2 kg in place of 11.6." in said
    assert "(`model.toml`) has the values with the torque" in said
    assert "luggage is no longer significant: the torque takes its place." in said
    assert "model.toml" not in _changed((found,), written=False)


def test_one_that_stays_significant_has_its_place_and_the_bicycle_comes_last():
    mass, x = changed(residual(8.0, x=0.36))
    assert (mass.name, mass.replaced, x.name, x.effect) == ("mass", False, "xB", "")
    said = _changed((mass, x), written=True)
    assert "luggage.mass 8.00 ± 3.2 kg in place of 11.6 and xB 0.360 ± 0.0060 m in place of 0.352." in said
    assert "no longer significant" not in said


def test_what_moves_by_less_than_one_sd_is_not_told():
    assert changed(residual(10.0)) == ()
    assert _changed((), written=True) == ""
