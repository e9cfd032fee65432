"""Derivation and second use of a model, timed on request: ``pytest tests/benchmarks --benchmark-only``."""

from bicycle import Model, effect_class, load_bicycle
from bicycle.effects import registry
from bicycle.equations import derive


def everything():
    """The largest set of effects that fits one model."""
    excluded = {"no_slip", "side_slip", "pneumatic_trail", "contact_length"}  # slots that other effects take
    return tuple(cls for identifier, cls in registry().items() if identifier not in excluded)


def test_derivation_of_all_effects(benchmark):
    model = benchmark.pedantic(derive, args=(everything(),), rounds=3)
    assert model.states


def test_second_use_of_an_effect_set(benchmark):
    tyre = effect_class("relaxation_length")(cornering_stiffness=6000.0, relaxation_length=0.1)
    model = Model(load_bicycle("benchmark"), (tyre,))
    model.linear_model()
    assert benchmark(model.linear_model).order == 8
