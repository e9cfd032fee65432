"""Riders of model files: a moving body that is named by the bicycle without it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bicycle.effects.effect import Effect
from bicycle.effects.sprung_joint import MovingBody
from bicycle.files.bicycle_files import bicycle_place, load_bicycle
from bicycle.parameters.bicycle import Bicycle
from bicycle.rider.rider_difference import seated_rider
from tyre.ground.errors import InputError, shown

WITHOUT_RIDER = "without_rider"
"""Key of a moving body in place of its numbers: the same bicycle without rider, packaged or a file."""


def with_rider_body(
    kind: type[Effect], table: Mapping[str, Any], ridden: Bicycle, folder: Path = Path()
) -> dict[str, Any]:
    """The table of an effect with the numbers of the rider's body where it names the bicycle without rider."""
    if WITHOUT_RIDER not in table or not issubclass(kind, MovingBody):
        return dict(table)
    where, name = f"effect {kind.identifier!r}", table[WITHOUT_RIDER]
    if not isinstance(name, str):
        raise InputError(f"{where}: {WITHOUT_RIDER} = {shown(name)} must be a packaged bicycle or a file of one")
    numbers = seated_rider(ridden, load_bicycle(bicycle_place(name, folder)))
    twice = [key for key in numbers if key in table]
    if twice:
        raise InputError(f"{where}: {WITHOUT_RIDER} gives {', '.join(twice)} already; remove one of the two")
    return {key: value for key, value in table.items() if key != WITHOUT_RIDER} | numbers


def locate_rider(table: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The ``table`` of an effect with the file of the bicycle without rider, relative to ``folder``, made absolute."""
    name = table.get(WITHOUT_RIDER)
    return {**table, WITHOUT_RIDER: bicycle_place(name, folder)} if isinstance(name, str) else dict(table)
