"""What every effect of the registry must keep, whoever writes it. Adding an effect adds its tests."""

import inspect
import itertools
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from bicycle import Effect, Model, load_bicycle, registry
from bicycle.effects import effect_of
from bicycle.equations import derive
from bicycle.parameters import UNITS, Bicycle
from tests.shared.refusals import refuses
from tyre.ground import InputError

EFFECTS = registry()
BASE = {"m": (1, 0, 0), "kg": (0, 1, 0), "s": (0, 0, 1), "N": (1, 1, -2), "rad": (0, 0, 0), "1": (0, 0, 0)}
SPEED = 6.0
OFF = ("damping", "grip_damping", "gain", "lean_gain")
COMMANDS = {"motor command": "steer_assist", "rider torque": "rider_control", "seated rider": "rider_saddle"}
ONE_WAY = {"side_slip", "steer_motor", *(n for n, e in EFFECTS.items() if "rider torque" in e.requires + e.provides)}


def bicycle() -> Bicycle:
    """The benchmark with a rear frame (synthetic) so heavy that any typical moving body can be taken out of it."""
    return load_bicycle("benchmark").replace(mB=125.0, zB=-1.1, IBxx=25.0, IBzz=8.0, IBxz=2.0)


def draw(effect: type[Effect], share: float = 0.5, **changes: float) -> Effect:
    """An effect with every parameter at a share of its typical range; a stated body is the rider's as a whole."""
    middle = {p.name: p.typical[0] + share * (p.typical[1] - p.typical[0]) for p in effect.parameters}
    whole = dict.fromkeys(middle.keys() & {"mass_share", "inertia_share"}, 1.0)
    return effect(**(middle | whole | changes))


def companions(effect: type[Effect], share: float = 0.5) -> tuple[Effect, ...]:
    """What the effect needs: the relaxing tyre, unless it is a contact law, and what commands or carries it."""
    if effect.slot == "contact law":
        return ()
    commands = [COMMANDS[need] for need in effect.requires if need in COMMANDS]
    return tuple(draw(EFFECTS[name], share) for name in ("relaxation_length", *commands))


def unmatched(small: np.ndarray, large: np.ndarray) -> float:
    """Largest distance of the eigenvalues ``small`` from a partner in ``large``, relative to max(|z|, 1/s)."""
    distance = np.abs(small[:, None] - large) / np.maximum(np.abs(small), 1)[:, None]
    return float(distance[linear_sum_assignment(distance)].max())


def refusal(build: Callable[[], object]) -> str:
    """Words of the InputError, empty where it builds."""
    try:
        build()
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS)
def test_the_declaration_is_complete(effect):
    assert re.fullmatch("[a-z_]+", effect.identifier)
    assert effect.description.endswith(".")
    assert len(effect.source) > 15
    assert len(effect.signature) > 15
    assert effect.why or not effect.requires
    assert set(effect.requires) <= {thing for other in EFFECTS.values() for thing in other.provides}
    assert len(Path(inspect.getfile(effect)).read_text(encoding="utf-8").splitlines()) <= 80
    assert len({parameter.name for parameter in effect.parameters}) == len(effect.parameters)


@pytest.mark.parametrize("effect", [e for e in EFFECTS.values() if any(p.neutral is not None for p in e.parameters)])
def test_the_neutral_value_gives_the_parent_back(effect):
    """Exactly where the effect vanishes, and as 1/stiffness where a joint is locked."""
    parent = Model(bicycle(), companions(effect)).linear_model().eigenvalues(SPEED)

    def error(neutral_of: dict[str, float]) -> float:
        share = 0.5 if effect.nameable else 0.6  # the middle of what has either sign is neutral
        model = Model(bicycle(), (*companions(effect), draw(effect, share, **neutral_of)))
        return unmatched(parent, model.linear_model().eigenvalues(SPEED))

    assert error({}) > 1e-4
    neutral = {p.name: p.neutral for p in effect.parameters if p.neutral is not None}
    if refusal(lambda: error(neutral)):
        assert "an infinite stiffness is the rigid bicycle; leave it out" in refusal(lambda: error(neutral))
        errors = [error({"stiffness": stiffness}) for stiffness in (1e7, 1e8, 1e9)]
        np.testing.assert_allclose([errors[0] / errors[1], errors[1] / errors[2]], 10, rtol=0.02)
    else:
        assert error(neutral) < 1e-12


def dimension(unit: str) -> tuple[float, ...]:
    """Exponents of length, mass and time of a unit string such as ``N m s/rad`` or ``kg/m^3``."""
    over, _, under = unit.partition("/")
    total = np.zeros(3)
    for words, sign in ((over, 1), (under, -1)):
        for word in words.split():
            name, _, power = word.partition("^")
            total += sign * int(power or 1) * np.array(BASE[name])
    return tuple(total)


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS)
@settings(max_examples=3)
@given(exponents=st.tuples(*[st.floats(0.1, 0.9)] * 3), share=st.floats(0.05, 0.6), speed=st.floats(2.0, 15.0))
def test_units_do_not_matter(effect, exponents, share, speed):
    """With other units of length, mass and time every eigenvalue is the same number per unit of time."""

    def factor(unit: str) -> float:
        return float(np.exp(exponents @ np.array(dimension(unit))))

    def rescaled(given_effect: Effect) -> Effect:
        values = given_effect.values({})
        factors = {entry: factor(p.unit) for p in given_effect.parameters for entry in p.entries()}
        scaled = {key: value * factors[key.partition(".")[2]] for key, value in values.items()}
        return effect_of(type(given_effect), scaled)

    effects = (*companions(effect, share), draw(effect, share))
    here = Model(bicycle(), effects).linear_model().eigenvalues(speed)
    units = {key: bicycle()[key] * factor(unit) for key, unit in UNITS.items()}
    there_bicycle = bicycle().replace(**units, allow_unusual=True)
    there = Model(there_bicycle, tuple(map(rescaled, effects))).linear_model().eigenvalues(speed * factor("m/s"))
    assert unmatched(here, there * factor("s")) < 1e-9


@pytest.mark.parametrize("effect", [e for e in EFFECTS.values() if e.identifier not in ONE_WAY])
def test_at_rest_without_dampers_eigenvalues_come_in_pairs(effect):
    """No damping, no motion, no control: the equations are the same backwards in time, so -z goes with every z."""
    rates = {p.name: 0.0 for p in effect.parameters if "_from_" in p.name and "_rate" in p.name}
    off = rates | {p.name: 0.0 for p in effect.parameters if p.name in OFF}
    carriers = [
        draw(type(other), damping=0.0) if any(p.name == "damping" for p in other.parameters) else other
        for other in companions(effect)
    ]
    found = Model(bicycle(), (*carriers, draw(effect, **off))).linear_model().eigenvalues(0.0)
    assert unmatched(found, -found) < 1e-9
    if "damping" in off:
        damped = Model(bicycle(), (*companions(effect), draw(effect))).linear_model().eigenvalues(0.0)
        assert unmatched(damped, -damped) > 1e-3


@pytest.mark.parametrize("effect", [e for e in EFFECTS.values() if e.parameters])
def test_a_missing_or_impossible_value_fails_by_name(effect):
    for parameter in effect.parameters:
        where = rf"effect '{effect.identifier}': {parameter.name}"
        refuses(where + r"(\.rear)? = nan must be a number", draw, effect, **{parameter.name: math.nan})
        low = parameter.bounds[0]
        if math.isfinite(low):
            refuses(where + r"(\.rear)? = .* is outside", draw, effect, **{parameter.name: low - 1})
    for name in [p.name for p in effect.parameters if p.default is None]:
        rest = {p.name: p.typical[1] for p in effect.parameters if p.name != name}
        refuses(f"effect '{effect.identifier}': missing parameter '{name}'", effect, **rest)


def test_every_pair_is_a_model_or_is_refused_with_a_reason():
    """Pairs without a contact law stand on rolling without slip; effects that need a tyre are refused there."""
    refused = set()
    for one, other in itertools.combinations(EFFECTS.values(), 2):
        effects = (draw(one), draw(other))
        if reason := refusal(lambda effects=effects: Model(bicycle(), effects)):
            refused.add((one.identifier, other.identifier))
            assert re.search("exclude each other: both are the|needs a .*, which no other effect gives: .", reason)
            assert one.identifier in reason or other.identifier in reason
    laws = {name for name, effect in EFFECTS.items() if effect.slot == "contact law"}
    assert {tuple(sorted(pair)) for pair in itertools.combinations(laws, 2)} <= refused
    known = {("camber_thrust", "no_slip"), ("side_slip", "wheel_compliance"), ("aligning_moment", "no_slip")}
    assert known | {("relaxation_length", "steer_motor")} <= refused
    for name, effect in EFFECTS.items():
        if name not in laws:
            assert set(effect.requires) & {*COMMANDS} or tuple(sorted(("relaxation_length", name))) not in refused
            assert effect.requires or tuple(sorted(("no_slip", name))) not in refused


def test_all_compatible_effects_together_build():
    chosen, slots = [], set()
    for effect in EFFECTS.values():
        if (effect.slot == "contact law" and effect.identifier != "relaxation_length") or effect.slot in slots:
            continue
        slots |= {effect.slot} - {None}
        chosen.append(draw(effect))
    model = Model(bicycle(), tuple(chosen)).linear_model()
    assert {"front_compliance", "rider_lean", "rear_lateral_force", "front_lateral_force"} <= set(model.states)
    assert np.isfinite(model.eigenvalues([0.0, 5.0, 30.0])).all()


def test_a_derivation_has_no_hidden_parameters():
    """Every declared parameter occurs in the equations, but two: a hinge along x hides Izz of a body, along z Ixx."""
    idle = set()
    for effect in EFFECTS.values():
        found = derive((*map(type, companions(effect)), effect)).parameters
        declared = {f"{effect.identifier}.{key}" for p in effect.parameters for key in p.entries()}
        idle |= declared - set(found)
    assert idle == {"rider_lean.Izz", "rider_saddle.Ixx"}


def test_effects_given_one_after_the_other_are_refused():
    """The second would be taken for the notes, and be missing from the model."""
    with pytest.raises(InputError, match=r"give them as one: Model\(bicycle, \[one, other\]\)"):
        Model(load_bicycle("benchmark"), EFFECTS["steer_damper"](damping=1.0), EFFECTS["steer_damper"](damping=2.0))
