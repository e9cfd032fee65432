"""Bicycles by scaling: each measured one guessed from the other makes, with one rider on it."""

from dataclasses import replace

import numpy as np
import pytest

from bicycle import Bicycle, Model, critical_speeds
from bicycle.files import (
    FEATURES,
    MAKES,
    Geometry,
    feature,
    features_of,
    guess_bicycle,
    measured_bicycles,
    values_of,
    with_rider,
)
from bicycle.parameters import UNITS
from bicycle.rider import RigidBody
from bicycle.stability import model_covariance

RIDER = RigidBody(75.0, np.array([0.36, 0.0, -1.09]), np.array([[7.7, 0, 1.0], [0, 8.5, 0], [1.0, 0, 2.6]]))
"""About 1.8 m tall, on the hoods."""


def weave_and_capsize(frame):
    found = critical_speeds(Model(Bicycle("b", {key: with_rider(frame, RIDER)[key] for key in UNITS})), 20.0)
    weave = [one.speed for one in found if one.mode == "weave" and one.direction == "stabilising"]
    capsize = [one.speed for one in found if one.mode == "capsize" and one.direction == "destabilising"]
    return (weave or [np.nan])[-1], (capsize or [np.nan])[0]


@pytest.fixture(scope="module")
def truth():
    return {name: weave_and_capsize(bicycle.values) for name, bicycle in measured_bicycles().items()}


def weighed(name, keys):
    """A bicycle as one finds it if the other makes and some of its own numbers are known."""
    bicycle = measured_bicycles()[name]
    own = dict(zip(FEATURES, features_of(bicycle.values), strict=True))
    return guess_bicycle(Geometry.of(bicycle.values), MAKES[name]).condition_on({key: (own[key], 0.01) for key in keys})


@pytest.mark.parametrize("name", MAKES)
def test_features_say_everything(name):
    bicycle = measured_bicycles()[name]
    found = values_of(features_of(bicycle.values), Geometry.of(bicycle.values))
    assert found == pytest.approx({key: bicycle[key] for key in UNITS}, rel=1e-9)


@pytest.mark.parametrize(
    ("keys", "weave", "capsize"),  # m/s, median and 90 % of the errors
    [
        ((), (0.21, 1.4), (0.9, 2.8)),
        (("mF", "mH"), (0.21, 1.0), (0.6, 2.0)),
        (("mF", "mH", "IFyy"), (0.17, 0.35), (0.3, 0.9)),
    ],
    ids=["eight numbers", "kitchen scale", "scale and pendulum"],
)  # fmt: skip
def test_makes_left_out_are_guessed_and_what_is_weighed_helps(truth, keys, weave, capsize):
    errors = np.array([np.subtract(weave_and_capsize(weighed(name, keys).values()), truth[name]) for name in MAKES])
    middle, most = np.nanmedian(np.abs(errors), 0), np.nanquantile(np.abs(errors), 0.9, axis=0)
    assert (middle <= [weave[0], capsize[0]]).all()
    assert (most <= [weave[1], capsize[1]]).all()
    assert np.isfinite(errors).all()


def test_nine_of_ten_plausible_bicycles_hold_the_truth(truth):
    """Of 14 bands fewer than 10 would be a chance of one in 100."""
    within = []
    for name in MAKES:
        rng = np.random.default_rng(7)
        speeds = np.array([weave_and_capsize(values) for values in weighed(name, ()).draws(rng, 40)])
        low, high = np.nanquantile(speeds, (0.05, 0.95), axis=0)
        within += [low[k] <= truth[name][k] <= high[k] for k in (0, 1)]
    assert sum(within) >= 10


def test_the_covariance_of_the_bicycle_is_that_of_its_plausible_ones():
    geometry = Geometry(1.02, 0.06, 0.305, 0.337, 0.337, 9.0)
    guess = replace(guess_bicycle(geometry), covariance=0.01 * guess_bicycle(geometry).covariance)  # where it is linear
    names, covariance = model_covariance(Model(guess.bicycle("b", "", "", rider=RIDER, mass_sd=0.0)))
    draws = [with_rider(values, RIDER) for values in guess.draws(np.random.default_rng(3), 4000)]
    drawn = np.cov([[one[key] for one in draws] for key in names])
    sd = np.sqrt(np.diag(drawn))
    np.testing.assert_allclose(covariance / np.outer(sd, sd), drawn / np.outer(sd, sd), atol=0.1)
    wheel = [names.index(key) for key in ("mF", "IFyy")]
    correlated = covariance[np.ix_(wheel, wheel)]
    assert correlated[0, 1] > 0.5 * np.sqrt(correlated[0, 0] * correlated[1, 1])  # a heavy wheel is hard to turn


def test_a_measured_mass_is_the_one_that_is_taken():
    geometry = Geometry(1.02, 0.06, 0.305, 0.337, 0.337, 9.0)
    known = {"mF": (feature("mF", 1.9, geometry), 1e-6), "IFyy": (feature("IFyy", 0.14, geometry, 1.9), 1e-6)}
    found = guess_bicycle(geometry).condition_on(known).values()
    assert (found["mF"], found["IFyy"]) == (pytest.approx(1.9, rel=1e-4), pytest.approx(0.14, rel=1e-4))
    assert sum(found[key] for key in ("mR", "mB", "mH", "mF")) == pytest.approx(9.0)
