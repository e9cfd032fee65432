"""The controls of a state, generated from what the library declares, as data of ``templates/controls.html.j2``.

A change of a control is an edit of the address: keys that go (by what they begin with) and keys that are set.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

from bicycle.effect import WHEELS, Effect, Parameter, registry
from bicycle.files.bicycle_file import available_bicycles
from bicycle.files.tyre_values import FROM_TYRE
from bicycle.parameters import Bicycle
from bicycle.rider.measurements import available_riders
from bicycle.rider.posture import POSTURES
from studies.explorer.chart_axes import chart_axes
from studies.explorer.computed import bicycle_or_none
from studies.explorer.flat_keys import ON, written
from studies.explorer.state import FASTEST, State
from studies.explorer.tyre_controls import tyre_rows
from studies.model_argument import LAWS
from studies.model_example import typical_values
from studies.reporting.markdown_text import html_template
from tyre.base.errors import InputError

CONTACT = "contact law"
HANDS = "steer_torque"
"""A rider's effect that acts through it is his hands."""

FIRST_TYRE, FIRST_BAR = "Tyre1", 5.5
STEPS = 200  # of a slider


@dataclass(frozen=True)
class Edit:
    """What a control does to the address: prefixes of keys that go, and keys that are set.

    Attributes
    ----------
    remove : tuple of str
    put : mapping of str to str
        Values in the unit of the key.
    """

    remove: tuple[str, ...] = ()
    put: Mapping[str, str] = field(default_factory=dict)

    def __str__(self) -> str:
        return json.dumps({"remove": list(self.remove), "set": dict(self.put)})


def controls_html(state: State) -> dict[str, str]:
    """The forms of a state by their place; everything in them that is not markup is escaped.

    Parameters
    ----------
    state : State

    Returns
    -------
    dict
        ``model``, ``speeds`` (range), ``at`` (chosen speed and mode) and ``chart`` (its axes).
    """
    ends = [
        {"key": key, "words": words, "value": written(getattr(state, key)), "low": 0.1, "high": FASTEST, "step": 0.1}
        for key, words in (("slow", "From"), ("fast", "To"))
    ]
    at = {
        "key": "at", "words": "Chosen speed", "value": written(state.at), "low": state.slow, "high": state.fast,
        "step": 0.05,
    }  # fmt: skip
    return {
        "model": _template("controls").render(**controls(state)),
        "speeds": _template("speeds").render(fields=ends, most=FASTEST),
        "at": _template("speeds").render(fields=[at], most=FASTEST, mode=True),
        "chart": _template("chart").render(axes=chart_axes(state)),
    }


def controls(state: State) -> dict[str, Any]:
    """What the form shows.

    Parameters
    ----------
    state : State

    Returns
    -------
    dict
        ``bicycles``, ``riders``, ``postures``, ``laws`` (options), ``law`` (fields), ``wheels`` (tyre of each wheel),
        ``rider_effects``, ``effects``, ``unusual``, ``extrapolate``.
    """
    model = dict(state.model)
    every = registry().values()
    own = "bicycle" not in model
    law = next((name for name in law_names() if any(key.startswith(f"effects.{name}") for key in model)), "no_slip")
    measured = f"effects.{law}.tyre.rear" in model or f"effects.{law}.tyre.front" in model
    bicycle = bicycle_or_none(state)
    free = [effect for effect in every if effect.slot != CONTACT]
    return {
        "bicycles": [
            *([{"value": "", "words": f"own: {state.name or 'unnamed'}", "chosen": True, "edit": Edit()}] * own),
            *(
                {"value": name, "words": name, "chosen": model.get("bicycle") == name,
                 "edit": Edit(("bicycle", "name", "covariance"), {"bicycle": name})}
                for name in available_bicycles()
            ),
        ],
        "riders": _options("rider", {"": "none put on it", **{name: name for name in available_riders()}}, state.rider),
        "postures": _options("posture", {name: name for name in POSTURES}, state.posture),
        "laws": law_options(law, bicycle, measured=measured),
        "law": [] if measured else _fields(registry()[law], model, mounted=False),
        "law_words": _first(registry()[law].description),
        "wheels": tyre_rows(state, law) if measured else [],
        "extrapolate": _switch(
            f"effects.{law}.extrapolate", "true", on=f"effects.{law}.extrapolate" in model
        ) if measured else None,
        "rider_effects": [effect_panel(e, model, bicycle, mounted=measured) for e in free if e.needs_rider],
        "effects": [effect_panel(e, model, bicycle, mounted=measured) for e in free if not e.needs_rider],
        "unusual": _switch("allow_unusual", "true", on=model.get("allow_unusual") is True),
    }  # fmt: skip


def law_names() -> list[str]:
    """Contact laws by identifier."""
    return [effect.identifier for effect in registry().values() if effect.slot == CONTACT]


def law_options(chosen: str, bicycle: Bicycle | None, *, measured: bool) -> list[dict[str, Any]]:
    """How the wheels may touch the ground: each law with numbers, and with a measured tyre where it takes one.

    Parameters
    ----------
    chosen : str
        The law of the state.
    bicycle : Bicycle or None
        Of the state.
    measured : bool
        It has a measured tyre.
    """
    gone = ("load", *(f"effects.{name}" for name in law_names()))
    found = []
    for name in sorted(law_names(), key=lambda one: (one not in LAWS, one)):
        words = name.replace("_", " ")
        if name in LAWS:
            start = {f"effects.{name}.tyre.{wheel}": FIRST_TYRE for wheel in WHEELS}
            start |= {f"effects.{name}.pressure_bar.{wheel}": written(FIRST_BAR) for wheel in WHEELS}
            found.append({"words": f"{words}, measured tyre", "chosen": name == chosen and measured,
                          "edit": Edit(gone, start), "value": f"{name}-tyre"})  # fmt: skip
        start = starts(registry()[name], bicycle)
        words += ", own numbers" if name in LAWS else " (wheels roll without slip)"
        found.append({"words": words, "chosen": name == chosen and not measured, "edit": Edit(gone, start),
                      "value": name})  # fmt: skip
    return found


def starts(effect: type[Effect], bicycle: Bicycle | None) -> dict[str, str]:
    """Keys and values of an effect that is switched on: defaults, else typical values that the bicycle takes.

    Parameters
    ----------
    effect : subclass of Effect
    bicycle : Bicycle or None
        None: the middle of what is typical.
    """
    fitting = typical_values(effect, bicycle) if bicycle else None
    found: dict[str, str] = {}
    for p in effect.parameters:
        if isinstance(p.default, str):
            continue  # equals a parameter of the bicycle
        usual = p.default if isinstance(p.default, float | int) else float(f"{sum(p.typical) / 2:.4g}")
        value = fitting[p.name] if fitting else usual
        found |= {f"effects.{effect.identifier}.{key}": written(float(value)) for key in p.entries()}
    return found or {f"effects.{effect.identifier}": ON}


def effect_panel(
    effect: type[Effect], model: Mapping[str, Any], bicycle: Bicycle | None, *, mounted: bool
) -> dict[str, Any]:
    """One effect: switch, words and the fields of its parameters when it is on.

    Parameters
    ----------
    effect : subclass of Effect
    model : mapping
        Dotted keys of the state, values in their units.
    bicycle : Bicycle or None
        Of the state; None where it makes none.
    mounted : bool
        The wheels have a measured tyre, whose values an effect may take.
    """
    prefix = f"effects.{effect.identifier}"
    on = any(key == prefix or key.startswith(f"{prefix}.") for key in model)
    words = effect.identifier.replace("_", " ")
    return {
        "id": effect.identifier,
        "words": f"hands on the bar ({words})" if effect.acts_through == HANDS and effect.needs_rider else words,
        "on": on,
        "switch_on": Edit((prefix,), starts(effect, bicycle)),
        "switch_off": Edit((prefix,)),
        "about": _first(effect.description),
        "needs": ", ".join(effect.requires),
        "source": effect.source,
        "fields": _fields(effect, model, mounted=mounted) if on else [],
    }


def number_field(key: str, words: str, value: Any, parameter: Parameter) -> dict[str, Any]:
    """Slider and number of one parameter; the slider spans what is typical and the value.

    Parameters
    ----------
    key : str
        Of the address.
    words : str
        Its label.
    value : float or None
        In the parameter's unit; None: it equals one of the bicycle.
    parameter : Parameter
    """
    low, high = parameter.typical
    usual = parameter.default if isinstance(parameter.default, float | int) else low
    given = [value] if isinstance(value, float) else []
    bottom, top = min(low, usual, *given), max(high, usual, *given)
    unit = "" if parameter.unit == "1" else parameter.unit
    return {
        "key": key, "words": words, "unit": unit, "low": bottom, "high": top,
        "step": float(f"{(top - bottom) / STEPS:.1g}"),
        "value": written(value) if isinstance(value, float) else "", "about": parameter.description,
        "typical": f"{low:g} .. {high:g}", "tied": parameter.default if isinstance(parameter.default, str) else "",
    }  # fmt: skip


def _fields(effect: type[Effect], model: Mapping[str, Any], *, mounted: bool) -> list[dict[str, Any]]:
    found = []
    for p in effect.parameters:
        whole = f"effects.{effect.identifier}.{p.name}"
        from_tyre = model.get(whole) == FROM_TYRE
        usual = {key: text for key, text in starts(effect, None).items() if key == whole or key.startswith(f"{whole}.")}
        offer = {
            "on": from_tyre, "switch_on": Edit((whole,), {whole: FROM_TYRE}), "switch_off": Edit((whole,), usual),
        } if p.tyre and (mounted or from_tyre) else None  # fmt: skip
        words = p.name.replace("_", " ")
        numbers = [
            number_field(key, words + wheel, model.get(key, p.default if isinstance(p.default, float) else None), p)
            for entry in p.entries()
            for key, wheel in [(f"effects.{effect.identifier}.{entry}", _wheel(entry))]
        ]
        found.append({"offer": offer, "id": whole, "words": words, "numbers": [] if from_tyre else numbers})
    return found


def _wheel(entry: str) -> str:
    wheel = entry.rpartition(".")[2]
    return f", {wheel}" if wheel in WHEELS else ""


def _options(key: str, choices: Mapping[str, str], chosen: str) -> list[dict[str, Any]]:
    if chosen not in choices:
        raise InputError(f"{key} = {chosen!r} is not known; known: {', '.join(filter(None, choices))}")
    return [
        {"value": value, "words": words, "chosen": value == chosen, "edit": Edit((key,), {key: value} if value else {})}
        for value, words in choices.items()
    ]


def _switch(key: str, value: str, *, on: bool) -> dict[str, Any]:
    return {"on": on, "switch_on": Edit((key,), {key: value}), "switch_off": Edit((key,))}


def _first(text: str) -> str:
    return " ".join(text.split("\n\n")[0].split())


@cache
def _template(name: str) -> Any:
    text = files("studies.explorer").joinpath(f"templates/{name}.html.j2").read_text(encoding="utf-8")
    return html_template(text)
