"""Keys of parameters: what is written is what is read back, and nothing else passes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicycle import registry
from bicycle.parameters import UNITS, WHEELS, ParameterKey, entries_of
from tyre.ground import InputError

names = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,20}", fullmatch=True).filter(lambda name: name not in WHEELS)


@given(st.one_of(st.just(""), names), names, st.sampled_from(["", *WHEELS]))
def test_a_key_is_read_back_as_it_was_written(effect, name, wheel):
    key = ParameterKey(effect, name, wheel)
    assert ParameterKey.parse(str(key)) == key
    assert ParameterKey.parse(key) is key


def test_every_parameter_of_the_house_is_taken_apart_as_its_effect_declares_it():
    for effect in registry().values():
        for parameter in effect.parameters:
            for entry in parameter.entries():
                key = ParameterKey.parse(f"{effect.identifier}.{entry}")
                assert (key.effect, key.name, key.entry) == (effect.identifier, parameter.name, entry)
                assert (key.wheel in WHEELS) == parameter.per_wheel
    assert all(ParameterKey.parse(name) == ParameterKey("", name) for name in UNITS)


def test_wheels_come_and_go():
    rear = ParameterKey.parse("relaxation_length.cornering_stiffness.rear")
    assert rear.entry == "cornering_stiffness.rear"
    assert str(rear.whole) == "relaxation_length.cornering_stiffness"
    assert rear.whole.at_wheel("rear") == rear
    assert ParameterKey.parse("pressure_bar.front") == ParameterKey("", "pressure_bar", "front")


@pytest.mark.parametrize("text", ["", ".", "c.", ".c", "a.b.c", "a.b.c.rear", "rear", "a.rear.front", "a..rear"])
def test_other_text_is_refused(text):
    with pytest.raises(InputError, match=r"write a key of the bicycle, effect\.name|name of the effect before the dot"):
        ParameterKey.parse(text)


def test_a_key_without_a_wheel_stands_for_both():
    known = {"c", "tyre.stiffness.rear", "tyre.stiffness.front", "arms.inertia", "half.rear"}
    assert entries_of("c", known) == ("c",)
    assert entries_of("tyre.stiffness", known) == ("tyre.stiffness.rear", "tyre.stiffness.front")
    assert entries_of("tyre.stiffness.front", known) == ("tyre.stiffness.front",)
    assert entries_of("half", known) == ("half.rear",)
    assert entries_of("stiffness", known) == ()
