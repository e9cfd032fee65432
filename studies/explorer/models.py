"""Make the model of a state and compute its modes; nothing but packaged and loaded data is read."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, lru_cache, wraps
from threading import RLock
from typing import Any, TypeVar

import numpy as np

from bicycle.files.bicycle_files import available_bicycles, load_bicycle
from bicycle.files.bicycle_numbers import given_numbers, model_table
from bicycle.model.model import Model
from bicycle.model.model_file import build_model
from bicycle.model.state_space import LinearModel
from bicycle.motion.limit_cycles import find_limit_cycles
from bicycle.parameters.bicycle import Bicycle
from bicycle.parameters.front_hinge import front_line, front_words
from bicycle.stability.critical import CriticalSpeed, critical_speeds
from bicycle.stability.named_modes import Modes, modes
from bicycle.stability.propagation import mode_sd, model_covariance
from studies.explorer.geometry import GEOMETRY, keep_hinge_on_axis, move_bicycle, side_view
from studies.explorer.state import State
from studies.explorer.tyre_files import TYRES, refuse_unloaded
from studies.model_space.lasting_motions import Trace, curves_of, traces_of
from studies.model_space.ranking import Ranking, rank
from tyre import available_tyres
from tyre.ground.errors import InputError, refuse_unknown
from tyre.maps.find_tyre import packaged_formulas

POINTS = 60  # speeds along a curve
R = TypeVar("R")
_one_at_a_time = RLock()  # requests come in parallel; the same state is computed once


def _cache_by_view(*view: str) -> Callable[[Callable[[State], R]], Callable[[State], R]]:
    """Decorate a function of a state: remember its last results by model and the fields ``view`` of the state."""

    def keep(make: Callable[[State], R]) -> Callable[[State], R]:
        cached = lru_cache(maxsize=32)(make)

        @wraps(make)
        def call(state: State) -> R:
            fields = {name: getattr(state, name) for name in ("model", "name", "rider", "posture", *view)}
            with _one_at_a_time:
                return cached(State(**fields))

        return call

    return keep


@dataclass(frozen=True, eq=False)
class Computed:
    """A model along its speed range."""

    model: Model  # with its effects
    linear: LinearModel  # its equations
    named: Modes  # at :data:`POINTS` speeds from the slowest to the fastest
    critical: tuple[CriticalSpeed, ...]  # up to the fastest speed
    notes: tuple[str, ...]  # what a reader of the numbers must know


@dataclass(frozen=True, eq=False)
class AtSpeed:
    """Modes at one speed."""

    named: Modes  # at one speed
    sd: dict[str, float]  # of the damping ratio of each pair, to first order from stated sd; NaN: not a pair
    uncertain: tuple[str, ...]  # parameters whose sd is stated

    def first(self, mode: str) -> str:
        """Choose ``mode`` if there is one of that name, else the first of all."""
        present = [name for name, values in self.named.branches.items() if not np.isnan(values).all()]
        return mode if mode in present else present[0]


@_cache_by_view("slow", "fast")
def compute_modes(state: State) -> Computed:
    """Compute model, modes and critical speeds of a state."""
    model, linear = _build_linear(state)
    notes = tuple(TYRES.in_words(str(note)) for note in linear.warnings)
    if front := front_line(model.parameters):
        notes = (front, *notes)
    named = modes(linear, np.linspace(state.slow, state.fast, POINTS))
    return Computed(model, linear, named, critical_speeds(linear, max_speed=state.fast), notes)


@_cache_by_view("at")
def at_speed(state: State) -> AtSpeed:
    """Compute the modes of a state at its chosen speed, and the sd of their damping ratios."""
    model, linear = _build_linear(state)
    named = modes(linear, [state.at])
    names, covariance = model_covariance(model)
    roots = np.array([[values[0, 0] for values in named.branches.values()]])
    damping = mode_sd(model, [state.at], roots, names, covariance)[1] if names else np.full(roots.shape, np.nan)
    return AtSpeed(named, dict(zip(named.branches, damping[0].tolist(), strict=True)), names)


@_cache_by_view("mode", "at", "fast")
def ranking(state: State) -> Ranking:
    """Rank parameters by what one sd of each does to the chosen mode at the chosen speed."""
    return rank(model_of(state), mode=at_speed(state).first(state.mode), speed=state.at, max_speed=state.fast)


@_cache_by_view("fast")
def amplitudes(state: State) -> tuple[Trace, ...]:
    """Follow the motions of a state on tyres that saturate, from its critical speeds up to the fastest speed on."""
    curves = curves_of(model_content(state))
    model = model_of(state)
    cycles = find_limit_cycles(model, rear=curves.get("rear"), front=curves.get("front"), max_speed=state.fast)
    return tuple(traces_of(cycles))


def words_beside(model: Model) -> dict[str, str]:
    """Say what numbers of a front hinge mean on the bicycle of a ``model``, by the key of their field."""
    given = {f"{effect.identifier}.{name}" for effect in model.effects for name in effect.table}
    words = front_words(model.parameters)
    return {f"effects.{key}": text for key, text in words.items() if key in given}


def model_of(state: State) -> Model:
    """Give the model of a state."""
    return _build_linear(state)[0]


@_cache_by_view()
def _build_linear(state: State) -> tuple[Model, LinearModel]:
    """Build the model of a state and its equations."""
    model = build(state)
    return model, model.linear_model()


def bicycle_or_none(state: State) -> Bicycle | None:
    """Give the bicycle of a state with its rider, without effects; None if it makes none."""
    try:
        return _bicycle(state)
    except InputError:
        return None


@_cache_by_view()
def _bicycle(state: State) -> Bicycle:
    """Build the bicycle of a state with its rider, its sliders moved."""
    content = state.content
    refuse_other_files(content)
    bicycle_table = {key: content[key] for key in ("bicycle", "allow_unusual") if key in content}
    return move_bicycle(build_model(bicycle_table | _rider(state, content)).bicycle, state.geometry)


def build(state: State) -> Model:
    """Build the model of a state."""
    content = model_content(state)
    with TYRES.by_name():
        return build_model(content)


def model_content(state: State) -> dict[str, Any]:
    """Make the model file of a state: its rider is part of the bicycle, loaded tyres have their paths."""
    content = state.content
    refuse_other_files(content)
    if state.geometry:
        unmoved = tuple((key, value) for key, value in state.model if not key.startswith(f"{GEOMETRY}."))
        before, after = _bicycle(replace(state, model=unmoved)), _bicycle(state)
        effects = keep_hinge_on_axis(content.get("effects", {}), before, after)
        return TYRES.with_paths(content | {"bicycle": model_table(after), "effects": effects})
    return TYRES.with_paths(content | _rider(state, content))


def refuse_other_files(content: Mapping[str, Any]) -> None:
    """Refuse a bicycle or tyre that would have to be read from a file."""
    bicycle = content.get("bicycle")
    drop = "or drop your file on the page"
    refuse_unknown("bicycle", [bicycle] if isinstance(bicycle, str) else [], available_bicycles(), more=drop)
    for name, table in content.get("effects", {}).items():
        tyre = table.get("tyre") if isinstance(table, Mapping) else None
        effect = f"effect {name!r}"
        for name_of_tyre in tyre.values() if isinstance(tyre, Mapping) else [tyre]:
            if isinstance(name_of_tyre, str) and name_of_tyre not in known_tyres():
                refuse_unloaded(name_of_tyre, where=effect)
            refuse_unknown(
                "tyre", [] if name_of_tyre is None else [name_of_tyre], known_tyres(), where=effect, more=drop
            )


def known_tyres() -> tuple[str, ...]:
    """List the tyres that a state may name: the packaged ones, and the files that were loaded."""
    return (*_packaged_tyres(), *TYRES.names())


@cache
def _packaged_tyres() -> tuple[str, ...]:
    return (*available_tyres(), *packaged_formulas())


def view_from_the_side(state: State) -> dict[str, Any]:
    """Draw the bicycle of a state from the side, mm; with its name, and whether rider and hinge are drawn."""
    drawing = side_view(_bicycle(state), model_content(state).get("effects", {}))
    kinds = {kind for kind, _ in drawing["lines"]}
    return drawing | {"name": bicycle_name(state), "rider": "rider" in kinds, "hinge": "hinge" in kinds}


def bicycle_name(state: State) -> str:
    """Name the bicycle of a state, with its rider."""
    bicycle = state.content["bicycle"]
    name = bicycle if isinstance(bicycle, str) else state.name or "own bicycle"
    name = f"{name} with {state.rider}, {state.posture}" if state.rider else name
    return f"{name}, modified" if state.geometry else name


def _rider(state: State, content: Mapping[str, Any]) -> dict[str, Any]:
    """Make the bicycle table with the rider of a state; empty without one."""
    if not state.rider:
        return {}
    bicycle = content["bicycle"]
    if isinstance(bicycle, str):
        frame = load_bicycle(bicycle)
    else:
        frame = given_numbers(bicycle, place="bicycle").bicycle(state.name or "own", "model file", allow_unusual=True)
    return {"bicycle": model_table(_with_rider(frame, state.rider, state.posture))}


@lru_cache(maxsize=32)
def _with_rider(frame: Bicycle, rider: str, posture: str) -> Bicycle:
    """Put a packaged rider on a frame."""
    from bicycle.rider.rider_body import available_riders, read_rider
    from bicycle.rider.rider_frame import rider_on_bicycle
    from bicycle.rider.rider_posture import SeatGeometry, packaged_geometry, read_geometry
    from studies.reporting.rider_report import with_provenance

    refuse_unknown("rider", [rider], available_riders())
    geometry_file = packaged_geometry(frame.name)
    geometry = read_geometry(geometry_file, posture) if geometry_file else SeatGeometry()
    try:
        cyclist = rider_on_bicycle(frame, read_rider(rider), posture=posture, geometry=geometry)
    except ImportError as error:
        raise InputError(f"a rider needs a package: {error}") from error
    return with_provenance(cyclist, f"{frame.name}_{rider}_{posture}")
