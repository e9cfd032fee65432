"""What a state makes the library compute: modes along speed, critical speeds, uncertainty and sensitivity at one."""

from dataclasses import dataclass
from functools import lru_cache
from threading import RLock

import numpy as np

from bicycle.critical.critical_speed import CriticalSpeed
from bicycle.critical.critical_speeds import critical_speeds
from bicycle.linear_model import LinearModel
from bicycle.modal.named_modes import Modes, modes
from bicycle.model import Model
from bicycle.parameters import Bicycle
from bicycle.sensitivity.model_covariance import model_covariance
from bicycle.sensitivity.propagation import mode_sd
from studies.explorer.models import bicycle_of, build, load_notes
from studies.explorer.state import State, parse_state
from studies.explorer.tyre_files import TYRES
from studies.sensitivity.ranking import Ranking, rank
from tyre.base.errors import InputError

POINTS = 60
"""Speeds along a curve."""

KEPT = 32
_one_at_a_time = RLock()  # requests come in parallel; the same state is computed once


@dataclass(frozen=True, eq=False)
class Computed:
    """A model along its speed range.

    Attributes
    ----------
    model : Model
    linear : LinearModel
    named : Modes
        At :data:`POINTS` speeds from the slowest to the fastest.
    critical : tuple of CriticalSpeed
        Up to the fastest speed.
    notes : tuple of str
        What a reader of the numbers must be told.
    """

    model: Model
    linear: LinearModel
    named: Modes
    critical: tuple[CriticalSpeed, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class AtSpeed:
    """The modes at one speed.

    Attributes
    ----------
    named : Modes
        At that speed only.
    sd : dict of str to float
        One sd of the damping ratio of each pair, to first order from what the model's sources state; NaN: not a pair,
        or nothing is stated.
    uncertain : tuple of str
        Parameters whose sd is stated.
    """

    named: Modes
    sd: dict[str, float]
    uncertain: tuple[str, ...]

    def first(self, mode: str) -> str:
        """The asked ``mode`` where there is one of that name, else the first of all."""
        here = [name for name, values in self.named.branches.items() if not np.isnan(values).all()]
        return mode if mode in here else here[0]


def computed(state: State) -> Computed:
    """Model, modes and critical speeds of a state; kept, so that asking again is free.

    Parameters
    ----------
    state : State

    Raises
    ------
    InputError
        What the library refuses.
    """
    with _one_at_a_time:
        key = _model_key(state)
        return _computed(_build(key), _notes(key), state.slow, state.fast)


def at_speed(state: State) -> AtSpeed:
    """Modes of a state at its chosen speed, with uncertainty.

    Parameters
    ----------
    state : State
    """
    with _one_at_a_time:
        return _at_speed(_build(_model_key(state)), state.at)


def ranking(state: State) -> Ranking:
    """Parameters ranked by what one sd of each does to the chosen mode at the chosen speed.

    Parameters
    ----------
    state : State
    """
    with _one_at_a_time:
        return _ranking(_build(_model_key(state)), at_speed(state).first(state.mode), state.at, state.fast)


def bicycle_or_none(state: State) -> Bicycle | None:
    """The bicycle of a state with its rider, without effects; None where it makes none.

    Parameters
    ----------
    state : State
    """
    with _one_at_a_time:
        try:
            return _bicycle(_model_key(state))
        except InputError:
            return None


def model_of(state: State) -> Model:
    """The model of a state; kept, so that asking again is free.

    Parameters
    ----------
    state : State

    Raises
    ------
    InputError
        What the library refuses.
    """
    with _one_at_a_time:
        return _build(_model_key(state))[0]


def _model_key(state: State) -> str:
    return State(state.model, state.name, state.rider, state.posture).address


@lru_cache(maxsize=KEPT)
def _bicycle(address: str) -> Bicycle:
    return bicycle_of(parse_state(address))


@lru_cache(maxsize=KEPT)
def _build(address: str) -> tuple[Model, LinearModel]:
    model = build(parse_state(address))
    return model, model.linear_model()


@lru_cache(maxsize=KEPT)
def _notes(address: str) -> tuple[str, ...]:
    return tuple(
        TYRES.in_words(str(note)) for note in (*load_notes(parse_state(address)), *_build(address)[1].warnings)
    )


@lru_cache(maxsize=KEPT)
def _computed(built: tuple[Model, LinearModel], notes: tuple[str, ...], slow: float, fast: float) -> Computed:
    model, linear = built
    found = modes(linear, np.linspace(slow, fast, POINTS))
    return Computed(model, linear, found, critical_speeds(linear, max_speed=fast), notes)


@lru_cache(maxsize=KEPT)
def _at_speed(built: tuple[Model, LinearModel], speed: float) -> AtSpeed:
    model, linear = built
    named = modes(linear, [speed])
    names, covariance = model_covariance(model)
    roots = np.array([[values[0, 0] for values in named.branches.values()]])
    damping = mode_sd(model, [speed], roots, names, covariance)[1] if names else np.full(roots.shape, np.nan)
    return AtSpeed(named, dict(zip(named.branches, damping[0].tolist(), strict=True)), names)


@lru_cache(maxsize=KEPT)
def _ranking(built: tuple[Model, LinearModel], mode: str, speed: float, fastest: float) -> Ranking:
    return rank(built[0], mode=mode, speed=speed, max_speed=fastest)
