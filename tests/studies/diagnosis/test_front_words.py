"""A named front hinge is reported with its height above the hub and its damping ratio."""

from types import SimpleNamespace

import pytest

from bicycle import Model, load_bicycle
from bicycle.effects import effect_class
from bicycle.parameters import front_words
from studies.diagnosis import named_rows
from studies.inference import Named

FITTED = {"stiffness": (4000.0, 300.0), "damping": (12.0, 3.0), "joint_x": (0.87, 0.02), "joint_z": (-0.66, 0.03)}


def judgement(model, named):
    kind = SimpleNamespace(candidates=(), model=model)
    return SimpleNamespace(kind=kind, final=SimpleNamespace(candidates=()), verdict=SimpleNamespace(effects=(named,)))


def test_the_values_of_a_named_front_hinge_are_said_in_other_words():
    bicycle = load_bicycle("pista")
    units = {"stiffness": "N m/rad", "damping": "N m s/rad", "joint_x": "m", "joint_z": "m"}
    rows = named_rows(judgement(Model(bicycle), Named("front_compliance", FITTED, units)))
    hinge = effect_class("front_compliance")(**{name: value for name, (value, _) in FITTED.items()})
    words = front_words(Model(bicycle, (hinge,)).parameters)
    by_name = {row[1]: row[2:4] for row in rows}
    assert by_name["joint_z"] == [f"-0.660 m ({words['front_compliance.joint_z']})", "± 0.030 m"]
    assert by_name["damping"][0] == f"12.0 N m s/rad ({words['front_compliance.damping']})"
    assert by_name["stiffness"] == ["4000 N m/rad", "± 300 N m/rad"]


@pytest.mark.parametrize("model", [None, Model(load_bicycle("pista"))])
def test_other_effects_are_reported_as_they_are(model):
    named = Named("steer_damper", {"damping": (0.5, 0.1)}, {"damping": "N m s/rad"})
    ((identifier, name, value, sd, _),) = named_rows(judgement(model, named))
    assert (identifier, name, value, sd) == ("steer_damper", "damping", "0.50 N m s/rad", "± 0.10 N m s/rad")
