"""What can stand along the axes of the stability chart, and the form that chooses it."""

from typing import Any

from studies.explorer.computed import model_of
from studies.explorer.state import State
from studies.model_axes.axis import OF_THE_TYRE, SPEED, axis_keys, axis_of, typical_range
from tyre.base.errors import InputError


def axis_options(state: State) -> list[dict[str, Any]]:
    """What can stand along an axis of the chart of a state: key, words with the unit, usual range.

    Parameters
    ----------
    state : State

    Raises
    ------
    InputError
        The state makes no model.
    """
    model = model_of(state)
    found = [{"key": SPEED, "words": "speed, m/s", "low": f"{state.slow:g}", "high": f"{state.fast:g}"}]
    tyres = any("tyre" in table for table in state.content.get("effects", {}).values())
    found += [{"key": key, "words": f"{key.split('_')[0]} of the tyres, {unit}", "low": "", "high": ""}
              for key, unit in OF_THE_TYRE.items() if tyres]  # fmt: skip
    for key in axis_keys(model):
        try:
            axis = axis_of(model, key)
            low, high = typical_range(model, axis)
        except InputError:  # one that follows another
            continue
        unit = "" if axis.unit == "1" else f", {axis.unit}"
        words = f"{key.replace('_', ' ').replace('.', ': ', 1)}{unit}"
        found.append({"key": key, "words": words, "low": f"{low:.6g}", "high": f"{high:.6g}"})
    return found


def chart_axes(state: State) -> list[dict[str, Any]]:
    """The two axes of the stability chart: ``name``, ``words``, ``options``, ``low``, ``high`` and ``log``.

    Parameters
    ----------
    state : State
    """
    try:
        options = axis_options(state)
    except InputError:  # the message stands beside the figures
        return []
    found: list[dict[str, Any]] = []
    for name, words, usual, given in (("x", "Across", 0, state.x), ("y", "Upwards", 1, state.y)):
        key, equals, ends = given.partition("=")
        chosen = next((one for one in options if one["key"] == key), options[usual])
        taken = ends if equals and chosen["key"] == key else ""
        low, _, high = taken.removesuffix(":log").partition(":")
        found.append({
            "name": name, "words": words, "options": options, "chosen": chosen["key"], "low": low or chosen["low"],
            "high": high or chosen["high"], "log": taken.endswith(":log"),
        })  # fmt: skip
    return found
