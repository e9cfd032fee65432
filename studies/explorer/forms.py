"""Make the controls of a state from what the library declares, as data of ``templates/controls.html.j2``."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from bicycle.effects.effect import WHEELS, Effect, Parameter
from bicycle.effects.effect_registry import registry
from bicycle.effects.sprung_joint import STAND_INS
from bicycle.files.bicycle_files import available_bicycles
from bicycle.model.wheel_tyres import FROM_TYRE, MOST_BAR
from bicycle.parameters.bicycle import Bicycle
from bicycle.rider.rider_body import available_riders
from bicycle.rider.rider_posture import POSTURES
from studies.explorer.chart import chart_axes
from studies.explorer.exports import template
from studies.explorer.geometry import GEOMETRY, slider_fields
from studies.explorer.models import bicycle_or_none, known_tyres
from studies.explorer.state import FASTEST, ON, State, write_value
from studies.explorer.tyre_files import TYRES, is_loaded, shown_name
from studies.model_space.model_argument import LAWS
from studies.model_space.model_example import typical_values
from tyre.ground.errors import InputError
from tyre.ground.units import PASCAL_PER_BAR
from tyre.measured.properties import TyreSource


def tyre_rows(state: State, law: str) -> list[dict[str, Any]]:
    """Describe for each wheel tyre, surface, pressure (bar) and load (N), the last two over what was measured."""
    model = dict(state.model)
    bicycle = bicycle_or_none(state)
    loads = None if bicycle is None else [float(load) for load in bicycle.static_loads]
    rows = []
    for number, wheel in enumerate(WHEELS):
        keys = {name: f"effects.{law}.{name}.{wheel}" for name in ("tyre", "surface", "pressure_bar")}
        name, surface = str(model.get(keys["tyre"], "")), str(model.get(keys["surface"], ""))
        pressure = model.get(keys["pressure_bar"])
        names = dict.fromkeys((*known_tyres(), name))  # the message says what is wrong with an unknown one
        try:
            source: TyreSource | None = TYRES.read(name, surface or None) if name in known_tyres() else None
        except InputError:
            source = None  # said by the model itself
        bars = None if source is None else [end / PASCAL_PER_BAR for end in source.pressure_range]
        rows.append(
            {
                "wheel": wheel,
                "address": keys,
                "tyres": [{"value": tyre, "words": _words(tyre), "chosen": tyre == name} for tyre in names],
                "surfaces": [
                    {"value": choice, "words": choice or "as measured", "chosen": choice == surface}
                    for choice in ("", "flat", "drum")
                ],
                "pressure": write_value(pressure) if isinstance(pressure, float) else "",
                "pressure_bar": None if bars is None else _bar(pressure, bars, most=MOST_BAR),
                "load": None if loads is None else f"{loads[number]:.1f}",
                "load_bar": None if source is None or loads is None else _bar(loads[number], source.load_range),
            }
        )
    return rows


def _words(name: str) -> str:
    """Name a tyre for its reader; with the digest where loaded files share a name."""
    if not is_loaded(name):
        return name
    file = shown_name(name)
    alike = sum(shown_name(tyre) == file for tyre in TYRES.names() if is_loaded(tyre)) > 1
    lost = "" if name in TYRES.names() else ", not here"
    return f"{file} (loaded{f' {name[len(file) :]}' if alike else ''}{lost})"


def _bar(value: Any, measured: Sequence[float], *, most: float = float("inf")) -> dict[str, Any] | None:
    """Make a scale as much wider than the measured range as values may be taken; places on it in percent."""
    low, high = measured
    if not low < high < float("inf"):
        return None
    bottom = max(0.0, 2 * low - high)
    top = min(most, 2 * high - low)
    is_number = isinstance(value, float)
    if is_number:
        bottom, top = min(bottom, value), max(top, value)
    begin, end, at = (round(100 * (x - bottom) / (top - bottom), 2) for x in (low, high, value if is_number else low))
    return {
        "from": begin,
        "to": end,
        "at": at if is_number else None,
        "low": bottom,
        "high": top,
        "words": f"{low:g} .. {high:g}",
        "outside": is_number and not low <= value <= high,
        "step": float(f"{(top - bottom) / 200:.1g}"),
    }


CONTACT = "contact law"


@dataclass(frozen=True)
class Edit:
    """Change that a control makes to the address: prefixes of keys that go, and keys that are set."""

    remove: tuple[str, ...] = ()  # prefixes of keys
    put: Mapping[str, str] = field(default_factory=dict)  # values in the unit of the key

    def __str__(self) -> str:
        return json.dumps({"remove": list(self.remove), "set": dict(self.put)})


def controls_html(state: State) -> dict[str, str]:
    """Render the forms of a state by their place: model, speeds, chosen speed with mode, axes of the chart."""
    ends = [
        {
            "key": key,
            "words": words,
            "value": write_value(getattr(state, key)),
            "low": 0.1,
            "high": FASTEST,
            "step": 0.1,
        }
        for key, words in (("slow", "From"), ("fast", "To"))
    ]
    at = {
        "key": "at",
        "words": "Chosen speed",
        "value": write_value(state.at),
        "low": state.slow,
        "high": state.fast,
        "step": 0.05,
    }
    return {
        "model": template("controls").render(**controls(state)),
        "speeds": template("speeds").render(fields=ends, most=FASTEST),
        "at": template("speeds").render(fields=[at], most=FASTEST, mode=True),
        "chart": template("chart").render(axes=chart_axes(state)),
    }


def controls(state: State) -> dict[str, Any]:
    """Collect what the form of the model shows."""
    model = dict(state.model)
    effects = registry().values()
    is_own = "bicycle" not in model
    laws = [effect.identifier for effect in effects if effect.slot == CONTACT]
    law = next((name for name in laws if _has_prefix(model, f"effects.{name}")), "no_slip")
    measured = f"effects.{law}.tyre.rear" in model or f"effects.{law}.tyre.front" in model
    bicycle = bicycle_or_none(state)
    extrapolate = f"effects.{law}.extrapolate"
    free = [effect for effect in effects if effect.slot != CONTACT]
    loaded = (
        [{"value": "", "words": f"file: {state.name or 'unnamed'}", "chosen": True, "edit": Edit()}] if is_own else []
    )
    return {
        "bicycles": [
            *loaded,
            *(
                {
                    "value": name,
                    "words": name,
                    "chosen": model.get("bicycle") == name,
                    "edit": Edit(("bicycle", "name", "covariance", GEOMETRY), {"bicycle": name}),
                }
                for name in available_bicycles()
            ),
        ],
        "geometry": slider_fields(bicycle) if bicycle else [],
        "riders": _options("rider", {"": "none added", **{name: name for name in available_riders()}}, state.rider),
        "postures": _options("posture", {name: name for name in POSTURES}, state.posture),
        "laws": law_options(law, bicycle, measured=measured),
        "law": [] if measured else _fields(registry()[law], model, mounted=False),
        "law_words": _first(registry()[law].description),
        "wheels": tyre_rows(state, law) if measured else [],
        "extrapolate": _switch(extrapolate, {extrapolate: "true"}, {}, on=extrapolate in model) if measured else None,
        "rider_effects": [effect_panel(e, model, bicycle, mounted=measured) for e in free if e.needs_rider],
        "effects": [effect_panel(e, model, bicycle, mounted=measured) for e in free if not e.needs_rider],
        "unusual": _switch("allow_unusual", {"allow_unusual": "true"}, {}, on=model.get("allow_unusual") is True),
    }


def _has_prefix(model: Mapping[str, Any], prefix: str) -> bool:
    """True if a key of the address begins with the prefix."""
    return any(key.startswith(prefix) for key in model)


def law_options(chosen: str, bicycle: Bicycle | None, *, measured: bool) -> list[dict[str, Any]]:
    """List how the wheels may touch the ground: each law with numbers, and with a measured tyre if it takes one."""
    laws = [effect.identifier for effect in registry().values() if effect.slot == CONTACT]
    prefixes = tuple(f"effects.{name}" for name in laws)
    options = []
    for name in sorted(laws, key=lambda law: (law not in LAWS, law)):
        words = name.replace("_", " ")
        if name in LAWS:
            start = {f"effects.{name}.tyre.{wheel}": "Tyre1" for wheel in WHEELS}
            start |= {f"effects.{name}.pressure_bar.{wheel}": "5.5" for wheel in WHEELS}
            options.append(
                {
                    "words": f"{words}, measured tyre",
                    "chosen": name == chosen and measured,
                    "edit": Edit(prefixes, start),
                    "value": f"{name}-tyre",
                }
            )
        start = starts(registry()[name], bicycle)
        words += ", your values" if name in LAWS else " (wheels roll without slip)"
        options.append(
            {"words": words, "chosen": name == chosen and not measured, "edit": Edit(prefixes, start), "value": name}
        )
    return options


def starts(effect: type[Effect], bicycle: Bicycle | None) -> dict[str, str]:
    """Choose the values of an effect that is switched on, by key: defaults, else typical ones for the bicycle."""
    fitting = typical_values(effect, bicycle) if bicycle else None
    values: dict[str, str] = {}
    for p in effect.parameters:
        if isinstance(p.default, str):
            continue  # equals a parameter of the bicycle
        usual = p.default if isinstance(p.default, float | int) else float(f"{sum(p.typical) / 2:.4g}")
        value = fitting[p.name] if fitting else usual
        values |= {f"effects.{effect.identifier}.{key}": write_value(float(value)) for key in p.entries()}
    return values or {f"effects.{effect.identifier}": ON}


def effect_panel(
    effect: type[Effect], model: Mapping[str, Any], bicycle: Bicycle | None, *, mounted: bool
) -> dict[str, Any]:
    """Describe an effect: switch, words and, if it is on, the fields of its parameters."""
    prefix = f"effects.{effect.identifier}"
    on = any(key == prefix or key.startswith(f"{prefix}.") for key in model)
    words = effect.identifier.replace("_", " ")
    hands = effect.acts_through == "steer_torque" and effect.needs_rider
    return _switch(prefix, starts(effect, bicycle), {}, on=on) | {
        "id": effect.identifier,
        "words": f"hands on the handlebar ({words})" if hands else words,
        "about": _first(effect.description),
        "needs": ", ".join(effect.requires),
        "source": effect.source,
        "fields": _fields(effect, model, mounted=mounted) if on else [],
    }


def number_field(key: str, words: str, value: Any, parameter: Parameter) -> dict[str, Any]:
    """Describe slider and number of a parameter, in its unit; the slider spans what is typical and the value."""
    low, high = parameter.typical
    usual = parameter.default if isinstance(parameter.default, float | int) else low
    numbers = [value] if isinstance(value, float) else []
    bottom = min(low, usual, *numbers)
    top = max(high, usual, *numbers)
    return {
        "key": key,
        "words": words,
        "unit": "" if parameter.unit == "1" else parameter.unit,
        "low": bottom,
        "high": top,
        "step": float(f"{(top - bottom) / 200:.1g}"),
        "value": write_value(value) if isinstance(value, float) else "",
        "about": parameter.description,
        "typical": f"{low:g} .. {high:g}",
        "tied": parameter.default if isinstance(parameter.default, str) else "",
    }


def _fields(effect: type[Effect], model: Mapping[str, Any], *, mounted: bool) -> list[dict[str, Any]]:
    """Describe the fields of an effect's parameters; with a ``mounted`` tyre they may be taken from it.

    What the model gives in place of parameters, such as a damping ratio, has a field in place of theirs.
    """
    given = [both for name, both in STAND_INS.items() if f"effects.{effect.identifier}.{name}" in model]
    replaced = {name for _, names in given for name in names}
    panels = []
    for p in (*(p for p in effect.parameters if p.name not in replaced), *(p for p, _ in given)):
        whole = f"effects.{effect.identifier}.{p.name}"
        from_tyre = model.get(whole) == FROM_TYRE
        usual = {key: text for key, text in starts(effect, None).items() if key == whole or key.startswith(f"{whole}.")}
        offer = _switch(whole, {whole: FROM_TYRE}, usual, on=from_tyre) if (p.tyre and (mounted or from_tyre)) else None
        words = p.name.replace("_", " ")
        numbers = []
        for entry in p.entries():
            key, wheel = f"effects.{effect.identifier}.{entry}", entry.rpartition(".")[2]
            value = model.get(key, p.default if isinstance(p.default, float) else None)
            numbers.append(number_field(key, f"{words}, {wheel}" if wheel in WHEELS else words, value, p))
        panels.append({"offer": offer, "id": whole, "words": words, "numbers": [] if from_tyre else numbers})
    return panels


def _options(key: str, choices: Mapping[str, str], chosen: str) -> list[dict[str, Any]]:
    """Describe the ``choices`` (value -> words) of a key, each with its change of the address; refuse another value."""
    if chosen not in choices:
        raise InputError(f"{key} = {chosen!r} is not known; known: {', '.join(filter(None, choices))}")
    edits = {value: Edit((key, GEOMETRY), {key: value} if value else {}) for value in choices}
    return [
        {"value": value, "words": words, "chosen": value == chosen, "edit": edits[value]}
        for value, words in choices.items()
    ]


def _switch(key: str, put: Mapping[str, str], back: Mapping[str, str], *, on: bool) -> dict[str, Any]:
    return {"on": on, "switch_on": Edit((key,), put), "switch_off": Edit((key,), back)}


def _first(text: str) -> str:
    """Take the first paragraph, on one line."""
    return " ".join(text.split("\n\n")[0].split())
