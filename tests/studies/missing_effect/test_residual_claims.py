"""What is said of critical speeds of a corrected model: by band, by words, by JSON, and whether a count believes it."""

import math
from types import SimpleNamespace

import pytest

from bicycle import Model, load_bicycle
from bicycle.critical.critical_speed import OSCILLATORY, REAL, STABILISING, CriticalSpeed
from bicycle.effect import effect_class
from bicycle.parameter_covariance import ParameterCovariance
from bicycle.sensitivity.critical_intervals import CriticalInterval
from studies.missing_effect.residual.claims import IN_PART, NO, YES, Claims, Critical, claims
from studies.missing_effect.residual.terms import SpeedScale
from studies.missing_effect.residual.words import critical_note, critical_rows
from studies.validations.residual_torque import weave_said

INF = math.inf
WEAVE = 4.292382536  # m/s, Meijaard et al. (2007), Proc. R. Soc. A 463, section 5


def torque_of(scale, curve=0.0):
    make = effect_class("residual_torque")
    return make(middle_speed=scale.middle, speed_span=scale.span, steer_from_steer_rate_curve=curve)


def said_of(low, high, sd, *, describes=True):
    """Of the benchmark bicycle with a residual torque that is zero but for its uncertainty."""
    scale = SpeedScale((low + high) / 2, (high - low) / 2, 3)
    torque = torque_of(scale)
    spread = ParameterCovariance(("residual_torque.steer_from_steer_rate_curve",), [[sd**2]], origin="model file")
    model = Model(load_bicycle("benchmark"), (torque,), covariance=spread, sd=spread.sd)
    return claims(SimpleNamespace(scale=scale, misfit=10.0, describes=describes), model)


def weave_of(said):
    return [one for one in said.found if one.interval.mode == "weave"]


def test_a_crossing_is_told_with_its_speed_where_all_of_its_interval_was_measured():
    (weave,) = weave_of(said_of(3.0, 6.0, 1.0))
    assert weave.measured == YES
    (crossing,) = weave.crossings
    assert crossing.speed == pytest.approx(WEAVE, abs=1e-6)
    assert crossing.direction == STABILISING
    assert weave.interval.holds(WEAVE)


@pytest.mark.parametrize(
    ("low", "high", "where"), [(4.28, 8.0, IN_PART), (5.0, 8.0, NO), (3.0, 4.3, IN_PART), (3.0, 4.2, NO)]
)
def test_outside_the_measured_speeds_only_the_interval_is_told(low, high, where):
    (weave,) = (one for one in weave_of(said_of(low, high, 1.0)) if one.interval.holds(WEAVE))
    assert (weave.measured, weave.crossings) == (where, ())


def test_what_is_extrapolated_farther_is_less_known():
    """The curve of a coefficient counts x^2, and x is -1 at the slowest measured speed."""
    near, far = (weave_of(said_of(low, 8.0, 1.0))[0].interval for low in (4.0, 5.5))
    assert far.high - far.low > 2 * (near.high - near.low)


def test_at_each_limit_the_real_part_is_1_96_sd_from_zero():
    """By the eigenvalues of the bicycle with a little of the torque, of either sign."""
    scale, sd = SpeedScale(4.5, 1.5, 3), 5.0
    limits = [end for one in weave_of(said_of(3.0, 6.0, sd)) for end in (one.interval.low, one.interval.high)]

    def growth(speed, curve):
        roots = Model(load_bicycle("benchmark"), (torque_of(scale, curve),)).linear_model().eigenvalues(speed)
        return max(roots[roots.imag > 0].real)

    assert len(limits) == 6
    for end in filter(math.isfinite, limits):
        slope = (growth(end, 1e-3) - growth(end, -1e-3)) / 2e-3
        assert abs(growth(end, 0.0)) == pytest.approx(1.96 * sd * abs(slope), rel=0.02)


def test_nothing_is_told_where_the_torque_does_not_describe_the_data():
    said = said_of(3.0, 6.0, 1.0, describes=False)
    assert said.found == ()
    assert critical_rows(said) == []
    assert critical_note(said) == (
        "No critical speed of the corrected model is told: χ² is 10 a number, so the torque does not describe the data."
    )
    assert said.to_dict()["withheld"] == "χ² is 10 a number, so the torque does not describe the data"


def critical(low, high, kind=OSCILLATORY, crossings=(), measured=NO):
    return Critical(CriticalInterval("weave", kind, low, high), crossings, measured)


CROSSING = CriticalSpeed(5.0, OSCILLATORY, "weave", 0.7, STABILISING)


@pytest.mark.parametrize(
    ("one", "row"),
    [
        (critical(4.0, 5.5, crossings=(CROSSING,), measured=YES),
         ["weave stabilising", "5.00 m/s, from 4.00 to 5.50 m/s", "yes"]),
        (critical(4.0, 5.5, REAL), ["weave critical, a real root", "perhaps, from 4.00 to 5.50 m/s", NO]),
        (critical(-INF, 5.5), ["weave critical", "perhaps, below 5.50 m/s", NO]),
        (critical(9.0, INF, measured=IN_PART), ["weave critical", "perhaps, above 9.00 m/s", "in part"]),
        (critical(-INF, INF), ["weave critical", "not told by these data", NO]),
    ],
)  # fmt: skip
def test_a_row_and_the_json_say_the_same(one, row):
    said = Claims(2.0, 12.0, "", (one,))
    assert critical_rows(said) == [row]
    (written,) = said.to_dict()["found"]
    assert written["low_m_s"] == (None if one.interval.low == -INF else one.interval.low)
    assert written["high_m_s"] == (None if one.interval.high == INF else one.interval.high)
    assert written["told"] == (row[1] != "not told by these data")
    assert [c["speed_m_s"] for c in written["crossings"]] == [c.speed for c in one.crossings]
    assert written["measured"] == row[2]
    assert "looked for from 2.00 to 12.0 m/s:" in critical_note(said)


def test_no_critical_speed_and_no_model_are_said():
    assert critical_note(Claims(2.0, 12.0)).startswith("From 2.00 to 12.0 m/s no mode of the corrected model has")
    assert critical_note(None) == ""
    assert critical_rows(None) == []


@pytest.mark.parametrize(
    ("true", "outcome"),
    [(5.0, "inside"), (9.5, "inside_one_limit"), (7.0, "outside"), (1.0, "not_looked_for"), (13.0, "not_looked_for"),
     (None, None)],
)  # fmt: skip
def test_a_claim_is_counted_as_it_is_said(true, outcome):
    real = critical(6.0, 8.0, REAL)  # of no oscillation, so it says nothing of the weave
    said = Claims(2.0, 12.0, "", (critical(4.0, 5.5), real, critical(9.0, INF)))
    assert weave_said(said, true) == {
        "looked_for": [2.0, 12.0], "intervals": [[4.0, 5.5], [9.0, None]], "outcome": outcome
    }  # fmt: skip


def test_what_claims_nothing_is_no_hit():
    assert weave_said(Claims(2.0, 12.0, "", (critical(-INF, INF),)), 5.0)["outcome"] == "not_told"
    assert weave_said(Claims(2.0, 12.0, "", ()), 5.0)["outcome"] == "outside"
    withheld = weave_said(Claims(2.0, 12.0, "why"), 5.0)
    assert (withheld["outcome"], withheld["intervals"]) == ("withheld", None)
    assert weave_said(None, 5.0)["outcome"] == "no_corrected_model"
