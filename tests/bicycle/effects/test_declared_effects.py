"""Effects, bicycles and models as values: signature and help from the declaration, equality, hash and a short repr."""

import inspect

import pytest

from bicycle import Effect, Model, critical_speeds, effect_class, load_bicycle, modes, registry
from bicycle.effects import RelaxationLength, SideSlip, SteerDamper
from tyre import TyreMap
from tyre.ground import InputError

LAGGED = RelaxationLength(cornering_stiffness={"rear": 6000.0, "front": 5000}, relaxation_length=0.1)


def typical(effect: type[Effect]) -> Effect:
    return effect(**{p.name: p.typical[1] for p in effect.parameters if not isinstance(p.default, str)})


@pytest.mark.parametrize("identifier", registry())
def test_signature_and_help_hold_the_declaration(identifier):
    effect = registry()[identifier]
    arguments = inspect.signature(effect).parameters
    assert set(arguments) == {p.name for p in effect.parameters}
    assert all(argument.kind is inspect.Parameter.KEYWORD_ONLY for argument in arguments.values())
    text = " ".join((effect.__doc__ or "").split())
    for p in effect.parameters:
        required = arguments[p.name].default is inspect.Parameter.empty
        assert required == (p.default is None)
        assert f"{p.name} : float" in text
        assert f"typical {p.typical[0]:g} .. {p.typical[1]:g}" in text
        assert not isinstance(p.default, float) or p.typical[0] <= p.default <= p.typical[1]
        if isinstance(p.default, str):
            assert repr(arguments[p.name].default) == f"<{p.default} of the bicycle>"


@pytest.mark.parametrize("identifier", registry())
def test_an_effect_is_written_as_it_is_made(identifier):
    made = typical(registry()[identifier])
    names = {effect.__name__: effect for effect in registry().values()}
    assert eval(repr(made), names) == made


def test_effects_with_the_same_values_are_equal():
    lengths = {"rear": 0.1, "front": 0.1}
    same = RelaxationLength(cornering_stiffness={"front": 5000.0, "rear": 6000}, relaxation_length=lengths)
    assert same == LAGGED
    assert hash(same) == hash(LAGGED)
    assert RelaxationLength(cornering_stiffness=6000.0, relaxation_length=0.1) != LAGGED
    assert SideSlip(cornering_stiffness=5000.0) != SteerDamper(damping=5000.0)
    assert SteerDamper(damping=0.5) != {"damping": 0.5}
    assert len({LAGGED, same, SteerDamper(damping=1.0)}) == 2


def test_one_effect_several_in_any_order_and_none_make_models():
    pista, damper = load_bicycle("pista"), SteerDamper(damping=1.0)
    assert Model(pista, LAGGED) == Model(pista, (LAGGED,)) == Model(pista, [LAGGED])
    assert Model(pista, [LAGGED, damper]) == Model(pista, (e for e in (damper, LAGGED)))
    assert hash(Model(pista, [LAGGED, damper])) == hash(Model(pista, [damper, LAGGED]))
    assert Model(pista) != Model(pista, LAGGED)
    assert Model(pista, LAGGED) != Model(load_bicycle("fisher"), LAGGED)
    assert Model(pista, LAGGED) != Model(pista, LAGGED, sd={"relaxation_length.relaxation_length.rear": 0.01})
    assert {Model(pista, LAGGED): 1}[Model(pista, LAGGED)] == 1


def test_what_things_are_in_a_few_lines():
    pista = load_bicycle("pista")
    model = Model(pista, LAGGED)
    linear, found = model.linear_model(), modes(model, [2.0, 5.0, 8.5])
    first = critical_speeds(model)[0]
    shown = {
        pista: ("Bicycle 'pista'", "9.72 kg", "wheelbase 0.989 m", "N rear"),
        model: ("Model of <Bicycle 'pista'", "RelaxationLength(cornering_stiffness={'rear': 6000.0, 'front': 5000.0}"),
        linear: ("LinearModel with relaxation_length", "8 states", "rear_lateral_force"),
        found: ("Modes at 3 speeds 2-8.5 m/s", "weave, wobble, capsize", "unstable at one of them: weave, capsize"),
        first: (f"CriticalSpeed {first.speed:.6g} m/s: weave stabilising", "Hz"),
        TyreMap.load("Tyre1"): ("TyreMap of Tyre1 on flat", "9 conditions", "340-490 N", "103.2-116.7 N/deg"),
    }
    for thing, words in shown.items():
        text = repr(thing)
        assert all(word in text for word in words), text
        assert text.count("\n") <= 3
        assert "array(" not in text


@pytest.mark.parametrize(("identifier", "given", "words"), [
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
])  # fmt: skip
def test_refused_parameters(identifier, given, words):
    with pytest.raises(InputError, match=words):
        effect_class(identifier)(**given)


def test_unknown_effect_lists_the_known_ones():
    with pytest.raises(InputError, match=r"unknown effect 'steer_dampr'; did you mean 'steer_damper'\? known: .*no_s"):
        effect_class("steer_dampr")
