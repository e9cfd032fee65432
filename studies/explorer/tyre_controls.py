"""The controls of a measured tyre on each wheel: where it was measured, and where the bicycle asks for it."""

from typing import Any

from bicycle.effect import WHEELS
from bicycle.files.wheel_tyres import MOST_BAR
from studies.explorer.computed import bicycle_or_none
from studies.explorer.flat_keys import written
from studies.explorer.models import known_tyres
from studies.explorer.own_loads import LOAD
from studies.explorer.state import State
from studies.explorer.tyre_files import TYRES, is_loaded, shown_name
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.tyre_source import TyreSource

SURFACES = ("", "flat", "drum")


def tyre_rows(state: State, law: str) -> list[dict[str, Any]]:
    """For each wheel its tyre, surface, pressure and load, the last two as bars over what was measured.

    Parameters
    ----------
    state : State
    law : str
        The contact law that holds the tyres.
    """
    model, bicycle = dict(state.model), bicycle_or_none(state)
    loads = None if bicycle is None else [float(load) for load in bicycle.static_loads]
    rows = []
    for number, wheel in enumerate(WHEELS):
        keys = {name: f"effects.{law}.{name}.{wheel}" for name in ("tyre", "surface", "pressure_bar")}
        name, surface = str(model.get(keys["tyre"], "")), str(model.get(keys["surface"], ""))
        pressure, own = model.get(keys["pressure_bar"]), model.get(f"{LOAD}.{wheel}")
        try:
            source: TyreSource | None = TYRES.read(name, surface or None) if name in known_tyres() else None
        except InputError:
            source = None  # said by the model itself
        bars = None if source is None else _in_bar(source.pressure_range)
        rows.append({
            "wheel": wheel,
            "address": keys,
            "tyres": [{"value": one, "words": _words(one), "chosen": one == name} for one in _known(name)],
            "surfaces": [{"value": one, "words": one or "as measured", "chosen": one == surface} for one in SURFACES],
            "pressure": written(pressure) if isinstance(pressure, float) else "",
            "pressure_bar": None if bars is None else _bar(pressure, bars, most=MOST_BAR),
            "load": None if loads is None else f"{loads[number]:.1f}",
            "own_load": written(own) if isinstance(own, float) else "",
            "load_bar": None if source is None or loads is None else _bar(
                own if isinstance(own, float) else loads[number], source.load_range
            ),
        })  # fmt: skip
    return rows


def _known(name: str) -> tuple[str, ...]:
    """Every tyre, and the present one where it is none of them: the message says what is wrong with it."""
    return known_tyres() if name in known_tyres() else (*known_tyres(), name)


def _words(name: str) -> str:
    """Name of a tyre for its reader; the digest tells apart files of one name."""
    if not is_loaded(name):
        return name
    file = shown_name(name)
    alike = sum(shown_name(one) == file for one in TYRES.names() if is_loaded(one)) > 1
    lost = "" if name in TYRES.names() else ", not here"
    return f"{file} (loaded{f' {name[len(file) :]}' if alike else ''}{lost})"


def _in_bar(pressures: tuple[float, float]) -> tuple[float, float]:
    return pressures[0] / PASCAL_PER_BAR, pressures[1] / PASCAL_PER_BAR


def _bar(value: Any, measured: tuple[float, float], *, most: float = float("inf")) -> dict[str, Any] | None:
    """A scale that is as much wider than the measured range as values may be taken, in percent."""
    low, high = measured
    if not low < high < float("inf"):
        return None
    bottom, top = max(0.0, 2 * low - high), min(most, 2 * high - low)
    if isinstance(value, float):
        bottom, top = min(bottom, value), max(top, value)

    def percent(at: float) -> float:
        return round(100 * (at - bottom) / (top - bottom), 2)

    return {
        "from": percent(low), "to": percent(high), "low": bottom, "high": top, "words": f"{low:g} .. {high:g}",
        "at": percent(value) if isinstance(value, float) else None,
        "outside": isinstance(value, float) and not low <= value <= high, "step": float(f"{(top - bottom) / 200:.1g}"),
    }  # fmt: skip
