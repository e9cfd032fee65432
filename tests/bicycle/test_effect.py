"""Declared parameters: what an effect accepts and what it refuses, and that a new file would be found."""

import pytest

from bicycle import effect_class
from tyre.errors import InputError


@pytest.mark.parametrize(
    ("identifier", "given", "words"),
    [
        ("steer_damper", {"dampng": 1.0}, "unknown parameter 'dampng'; did you mean 'damping'"),
        ("no_slip", {"trail": 1.0}, "unknown parameter 'trail'; known: none"),
        ("side_slip", {}, "missing parameter 'cornering_stiffness' .*N/rad, one value or {rear, front}"),
        ("steer_damper", {"damping": -1.0}, "damping = -1 N m s/rad is outside 0 .. inf"),
        ("steer_damper", {"damping": float("inf")}, "damping = inf N m s/rad is outside"),
        ("steer_damper", {"damping": float("nan")}, "damping = nan must be a number"),
        ("steer_damper", {"damping": "1"}, "damping = '1' must be a number"),
        ("steer_damper", {"damping": {"rear": 1.0, "front": 1.0}}, "one number for the bicycle"),
        ("pneumatic_trail", {"trail": {"rear": 0.01}}, "has the keys rear; give rear and front"),
        ("pneumatic_trail", {"trail": {"rear": 0.01, "front": 0.3}}, "trail.front = 0.3 m is outside 0 .. 0.2"),
    ],
)
def test_refused_parameters(identifier, given, words):
    with pytest.raises(InputError, match=words):
        effect_class(identifier)(**given)


def test_unknown_effect_lists_the_known_ones():
    with pytest.raises(
        InputError, match=r"unknown effect 'steer_dampr'; did you mean 'steer_damper'\? known: .*no_slip"
    ):
        effect_class("steer_dampr")
