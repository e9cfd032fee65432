"""Wheel loads given by hand: the tyre's values there, put as numbers where the tyre stood."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

from bicycle.effect import WHEELS, effect_class
from bicycle.files.tyre_values import FROM_TYRE, MountedTyres
from bicycle.files.wheel_tyres import TYRE_KEYS, tyre_notes, wheel_tyres
from bicycle.parameters import Bicycle
from tyre.base.errors import InputError, refuse_unknown
from tyre.properties import TyreProperties

LOAD = "load"
"""Key of an address, ``load.rear`` and ``load.front``, N; one left out is what the wheel carries at rest."""


@dataclass(frozen=True)
class _Loads:
    """What :func:`wheel_tyres` asks of a bicycle."""

    static_loads: tuple[float, float]


def at_own_loads(content: Mapping[str, Any], bicycle: Bicycle, loads: Mapping[str, float]) -> dict[str, Any]:
    """The content of a model file with numbers in place of its tyre, taken at given loads.

    The numbers stand alone: the uncertainty of the tyre is not among them.

    Parameters
    ----------
    content : mapping
        Of the model file, in its units.
    bicycle : Bicycle
        Its bicycle with rider.
    loads : mapping of str to float
        Of ``rear`` and ``front``, N.

    Raises
    ------
    InputError
        No measured tyre, a wheel that is none, a load that is out of the tyre's reach.
    """
    law, table = _law(content)
    mounted = MountedTyres(law, _properties(table, bicycle, loads))
    effects: dict[str, Any] = {}
    for name, given in content["effects"].items():
        kind = effect_class(name)
        asked = {p.name: p for p in kind.parameters if given.get(p.name) == FROM_TYRE or (name == law and p.tyre)}
        kept = {key: value for key, value in given.items() if key not in (*TYRE_KEYS, "extrapolate", *asked)}
        own = {key: given[key] for key in asked if given.get(key, FROM_TYRE) != FROM_TYRE}
        taken = {key: mounted.values(kind, p, WHEELS) for key, p in asked.items() if key not in own}
        effects[name] = kept | taken | own
    return dict(content) | {"effects": effects}


def own_load_notes(content: Mapping[str, Any], bicycle: Bicycle, loads: Mapping[str, float]) -> list[str]:
    """What must be told of tyre values at given loads.

    Parameters
    ----------
    content, bicycle, loads
        As in :func:`at_own_loads`.
    """
    given = ", ".join(f"{wheel} {load:g} N" for wheel, load in loads.items())
    said = (
        f"loads by hand ({given}): the tyre is taken there, without its uncertainty; the bicycle is as heavy as before"
    )
    return [said, *tyre_notes(_properties(_law(content)[1], bicycle, loads))]


def _law(content: Mapping[str, Any]) -> tuple[str, Mapping[str, Any]]:
    for name, table in content.get("effects", {}).items():
        if "tyre" in table:
            return name, table
    raise InputError("load: a load by hand is for a measured tyre, and the model has none; leave it out")


def _properties(table: Mapping[str, Any], bicycle: Bicycle, loads: Mapping[str, float]) -> dict[str, TyreProperties]:
    refuse_unknown("wheel", loads, WHEELS, where="load")
    for wheel, load in loads.items():
        if not load > 0:
            raise InputError(f"load.{wheel} = {load:g} N must be above 0; leave it out for the load at rest")
    rear, front = (float(loads.get(w, rest)) for w, rest in zip(WHEELS, bicycle.static_loads, strict=True))
    return wheel_tyres(
        tyre=table["tyre"], surface=table.get("surface"), pressure_bar=table.get("pressure_bar"),
        bicycle=cast(Bicycle, _Loads((rear, front))), extrapolate=table.get("extrapolate", False),
    )  # fmt: skip
