"""From a state to the model of its bicycle, rider, tyres and effects; nothing but packaged and loaded data is read."""

from collections.abc import Iterable, Mapping
from functools import cache, lru_cache
from typing import Any

from bicycle.files.bicycle_file import available_bicycles, given_numbers, load_bicycle
from bicycle.files.model_file import allows_unusual, build_model
from bicycle.model import Model
from bicycle.parameters import Bicycle
from studies.explorer.own_loads import LOAD, at_own_loads, own_load_notes
from studies.explorer.state import State
from studies.explorer.tyre_files import TYRES, refuse_unloaded
from tyre import available_tyres
from tyre.base.errors import InputError, unknown
from tyre.find_tyre import packaged_formulas


def known_tyres() -> tuple[str, ...]:
    """Tyres that a state may name: the packaged ones, and the files that were loaded."""
    return (*_packaged_tyres(), *TYRES.names())


def model_content(state: State) -> dict[str, Any]:
    """The content of the model file of a state: its rider is part of the bicycle, loaded tyres have their paths.

    Parameters
    ----------
    state : State

    Raises
    ------
    InputError
        A bicycle or tyre that is neither packaged nor loaded, or a rider that does not fit.
    """
    content = state.content
    refuse_other_files(content)
    loads = content.pop(LOAD, {})
    whole = TYRES.located(content | _rider(state, content))
    with TYRES.by_name():
        return at_own_loads(whole, bicycle_of(state), _by_wheel(loads)) if loads else whole


def load_notes(state: State) -> list[str]:
    """What must be told of loads that were given by hand; empty without.

    Parameters
    ----------
    state : State
    """
    loads = state.content.get(LOAD, {})
    return own_load_notes(TYRES.located(state.content), bicycle_of(state), _by_wheel(loads)) if loads else []


def refuse_other_files(content: Mapping[str, Any]) -> None:
    """Refuse a bicycle or tyre that would have to be read from a file.

    Parameters
    ----------
    content : mapping
        Of a model file, in its units.

    Raises
    ------
    InputError
        With the names that are known.
    """
    bicycle = content.get("bicycle")
    if isinstance(bicycle, str) and bicycle not in available_bicycles():
        raise InputError(f"{unknown('bicycle', bicycle, available_bicycles())}; or drop the file of yours on the page")
    for name, table in content.get("effects", {}).items():
        tyre = table.get("tyre") if isinstance(table, Mapping) else None
        for one in tyre.values() if isinstance(tyre, Mapping) else [tyre]:
            if one is not None and one not in known_tyres():
                where = f"effect {name!r}"
                if isinstance(one, str):
                    refuse_unloaded(one, where=where)
                raise InputError(
                    f"{where}: {unknown('tyre', one, known_tyres())}; or drop the file of yours on the page"
                )


def build(state: State) -> Model:
    """The model of a state.

    Parameters
    ----------
    state : State

    Raises
    ------
    InputError
        As :func:`model_content`, and what :func:`bicycle.files.model_file.build_model` refuses.
    """
    content = model_content(state)
    with TYRES.by_name():
        return build_model(content)


def bicycle_of(state: State) -> Bicycle:
    """The bicycle of a state with its rider, without effects: what the wheels carry.

    Parameters
    ----------
    state : State

    Raises
    ------
    InputError
        It makes none.
    """
    content = state.content
    refuse_other_files(content)
    alone = {key: content[key] for key in ("bicycle", "allow_unusual") if key in content}
    return build_model(alone | _rider(state, content)).bicycle


def as_table(bicycle: Bicycle) -> dict[str, Any]:
    """A bicycle as the table of a model file, each value with its sd where one is stated.

    Parameters
    ----------
    bicycle : Bicycle
    """
    return {
        key: f"{value!r} +/- {bicycle.sd[key]!r}" if key in bicycle.sd else value
        for key, value in bicycle.values.items()
    }


def bicycle_name(state: State) -> str:
    """What the bicycle of a state is called, with its rider.

    Parameters
    ----------
    state : State
    """
    given = state.content["bicycle"]
    name = given if isinstance(given, str) else state.name or "own bicycle"
    return f"{name} with {state.rider}, {state.posture}" if state.rider else name


def _by_wheel(loads: Any) -> dict[str, float]:
    if not isinstance(loads, Mapping) or any(not isinstance(load, float) for load in loads.values()):
        raise InputError("load: give load.rear and load.front, each a number in N")
    return dict(loads)


def _rider(state: State, content: Mapping[str, Any]) -> dict[str, Any]:
    if not state.rider:
        return {}
    return {"bicycle": as_table(_with_rider(_frame(content, state), state.rider, state.posture))}


def _frame(content: Mapping[str, Any], state: State) -> Bicycle:
    given = content["bicycle"]
    if isinstance(given, str):
        return load_bicycle(given)
    numbers = given_numbers(given, place="bicycle")
    return Bicycle(state.name or "own", numbers.values, numbers.sd, "", "", tuple(numbers.notes))


@cache
def _packaged_tyres() -> tuple[str, ...]:
    return (*available_tyres(), *packaged_formulas())


@lru_cache(maxsize=32)
def _with_rider(frame: Bicycle, rider: str, posture: str) -> Bicycle:
    from bicycle.rider.geometry_file import packaged_geometry, read_geometry
    from bicycle.rider.measurements import available_riders, read_rider
    from bicycle.rider.rider_frame import rider_on_bicycle
    from bicycle.rider.seat_geometry import SeatGeometry
    from studies.riders.rider_words import with_provenance

    if rider not in available_riders():
        raise InputError(unknown("rider", rider, available_riders()))
    known = packaged_geometry(frame.name)
    geometry = read_geometry(known, posture) if known else SeatGeometry()
    try:
        found = rider_on_bicycle(frame, read_rider(rider), posture=posture, geometry=geometry)
    except ImportError as error:
        raise InputError(f"a rider needs a package: {error}") from error
    return with_provenance(found, f"{frame.name}_{rider}_{posture}")


def unusual(state: State) -> bool:
    """Whether values far outside what is typical are allowed.

    Parameters
    ----------
    state : State
    """
    return allows_unusual(state.content)


def tyres_of(content: Mapping[str, Any]) -> Iterable[tuple[str, Mapping[str, Any]]]:
    """Contact laws that take a tyre: name and table.

    Parameters
    ----------
    content : mapping
        Of a model file, in its units.
    """
    return [(name, table) for name, table in content.get("effects", {}).items() if "tyre" in table]
