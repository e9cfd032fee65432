"""Which parameter sets are no bicycle, many at once, against the checks of one."""

import numpy as np

from bicycle import load_bicycle
from bicycle.model import impossible_bicycles
from bicycle.parameters import BOUNDS, UNITS, Bicycle
from tyre.ground import InputError


def test_every_parameter_has_bounds():
    assert list(BOUNDS) == list(UNITS)
    assert BOUNDS["mB"] == BOUNDS["w"] == (0.0, np.inf)
    assert BOUNDS["IBxz"] == BOUNDS["c"] == BOUNDS["zB"] == (-np.inf, np.inf)


def test_the_reasons_are_named():
    p = dict(load_bicycle("benchmark").values)
    assert impossible_bicycles(p) == {}
    odd = p | {"IBxz": np.array([2.4, 6.0]), "w": np.array([1.02, 0.2]), "lam": np.array([np.nan, 0.3])}
    found = {why: mask.tolist() for why, mask in impossible_bicycles(odd).items()}
    assert found["IBxx IBzz < IBxz^2"] == [False, True]
    assert found["the rear wheel bears no load"] == [False, True]
    assert found["a number that is not finite"] == [True, False]


def test_the_conditions_for_many_are_those_of_one():
    """Every bicycle that these conditions let pass, and none that they refuse, is accepted one by one."""
    rng, plain = np.random.default_rng(3), load_bicycle("benchmark")
    number = 300
    many = {key: np.full(number, plain[key]) for key in BOUNDS}
    for row in range(number):
        key = list(BOUNDS)[row % len(BOUNDS)]
        many[key][row] = plain[key] + 3 * rng.standard_normal() * (abs(plain[key]) + 0.5)
    refused = np.any(list(impossible_bicycles(many).values()), axis=0)
    for row in range(number):
        values = {key: float(many[key][row]) for key in BOUNDS}
        said = _refusal(values)
        assert bool(said) == refused[row] or "mass matrix" in said  # which is looked at elsewhere
    assert 20 < refused.sum() < 200


def _refusal(values):
    try:
        Bicycle("one", values)
    except InputError as error:
        return str(error)
    return ""
