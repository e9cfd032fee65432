"""Commented model file that ``velotyre new`` writes; the text about an effect comes from the effect."""

from textwrap import wrap
from typing import Any

from bicycle.effects.effect import Effect, Parameter, sentence
from bicycle.effects.effect_registry import effect_class, registry
from bicycle.model.model import Model
from bicycle.model.wheel_tyres import TYRE_KEYS
from bicycle.parameters.bicycle import Bicycle
from bicycle.parameters.front_hinge import front_words
from studies.reporting.markdown_text import render_file
from tyre.ground.errors import InputError
from tyre.measured.properties import TyreSource, out_of_reach


def example_model(bicycle: Bicycle, tyre: TyreSource, *, file: str, place: str = "", front_frame: str = "") -> str:
    """Write a model file that runs as it is, with every key explained and every effect to be switched on.

    ``place`` is the packaged name of the bicycle (by default its own), or its file as found from the model file;
    ``front_frame`` holds tables of a known front frame, which are switched on.
    """
    middle = float(tyre.pressures[tyre.pressures.size // 2])
    effects = registry()
    law = effects["relaxation_length"]
    content = {
        "file": file,
        "bicycle": bicycle,
        "place": place or bicycle.name,
        "tyre": tyre,
        "pressure": middle,
        "law": law,
        "tyre_keys": TYRE_KEYS,
        "far": any(out_of_reach(tyre, load=load, pressure=middle) for load in bicycle.static_loads),
        "front_frame": front_frame,
        "laws": [e for e in effects.values() if e.slot == law.slot and e is not law and e.parameters],
        "others": [e for e in effects.values() if e.slot != law.slot],
    }
    filters: dict[str, Any] = {
        "about": lambda effect: wrap(effect.description.split("\n\n")[0], 116),
        "sentence": sentence,
        "values": lambda effect: typical_values(effect, bicycle),
        "front_words": lambda effect: _front_words(effect, bicycle),
        "first": lambda p: _value(p, 0.5),
    }
    return render_file("studies.reporting", "model.toml.j2", content, escaped=False, filters=filters)


def _front_words(effect: type[Effect], bicycle: Bicycle) -> dict[str, str]:
    """Say what the example's numbers of a front hinge mean, by the name of the parameter."""
    values = typical_values(effect, bicycle)
    if values is None:
        return {}
    parameters = {**bicycle.values, **effect(**values).values(bicycle.values)}
    return {key.rpartition(".")[2]: text for key, text in front_words(parameters).items()}


def typical_values(effect: type[Effect], bicycle: Bicycle) -> dict[str, float] | None:
    """Values to begin with, by the name of the parameter, in its unit: defaults, also of the bicycle, else typical."""
    law = effect_class("relaxation_length")
    tyred = Model(bicycle, law(**{p.name: _value(p, 0.5) for p in law.parameters}))
    for share in (0.5, 0.25, 0.0):
        tied = {p.name: bicycle[p.default] for p in effect.parameters if isinstance(p.default, str)}
        values = {p.name: _value(p, share) for p in effect.parameters} | tied
        try:
            tyred.with_effect(effect(**values))
        except InputError:
            continue
        return values
    return None


def _value(p: Parameter, share: float) -> float:
    low, high = p.typical
    return p.default if isinstance(p.default, float) else float(f"{low + share * (high - low):.4g}")
