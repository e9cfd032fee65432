"""Model file of a front frame that was measured: effects with their numbers, and the covariance of these."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bicycle.effects.effect_registry import effect_class
from bicycle.effects.sprung_joint import DAMPING_RATIO
from bicycle.files.bicycle_numbers import covariance_table, model_table
from bicycle.model.model import DEFAULT_CONTACT, Model
from bicycle.model.model_file import build_model
from bicycle.parameters.bicycle import LIGHTEST_RIDDEN
from bicycle.parameters.parameter_covariance import MODEL_FILE, ParameterCovariance
from bicycle.standing import FORK, FRONT, SADDLE, SEATED, FrontResult
from tyre.measured.plausible import WAY_OUT

ASSUMED_FRONT: Any = effect_class(FRONT)
"""Declaration of the front frame whose damping is assumed for frame and rider together."""


BARE_RATIO = 0.03
"""Assumed damping ratio of a front frame alone, under a rider who yaws: bare structures have 0.01 to 0.10."""


@dataclass(frozen=True)
class DampingUse:
    """Use of a measured damping in the model, or the reason against it."""

    measured: bool  # it was read
    used: bool  # it is used in the model


def damping_use(result: FrontResult, model: Model, held: str) -> DampingUse:
    """Say whether the measured damping is that of the front under way.

    A rider who is fixed to the frame takes no energy, so the damping of an empty frame would let a ridden model wobble
    as no rider reports; there the assumed damping of frame and rider together stays. With a rider who yaws on the
    saddle the damping of an empty frame is right as measured.
    """
    measured = result.readings.damped and result.fit is not None
    ridden = model.bicycle["mB"] >= LIGHTEST_RIDDEN
    seated = held == SEATED or any(effect.identifier == SADDLE for effect in model.effects)
    separate = not result.damping_not_separate
    return DampingUse(measured, measured and separate and (seated or not ridden))


def front_effects(result: FrontResult, use: DampingUse) -> dict[str, dict[str, float]]:
    """Tables of the effects that a result determines, SI.

    A damping that is not used is left to its default; two joints share the time c/k of the default front.
    """
    assert result.fit is not None
    tables: dict[str, dict[str, float]] = {}
    for key, value in result.fit.values.items():
        effect, _, name = key.partition(".")
        if effect == SADDLE or (effect in (FRONT, FORK) and (name != "damping" or use.used)):
            tables.setdefault(effect, {})[name] = value
    if SADDLE in tables and not use.used:
        tables[FRONT][DAMPING_RATIO] = BARE_RATIO
    if FORK in tables and not use.used:
        time = ASSUMED_FRONT.damping.default / ASSUMED_FRONT.stiffness.default
        for table in tables.values():
            table["damping"] = time * table["stiffness"]
    return tables


def front_covariance(result: FrontResult, use: DampingUse) -> ParameterCovariance:
    """Covariance of the numbers of :func:`front_effects` that were measured, SI."""
    fit = result.fit
    assert fit is not None
    written = [f"{effect}.{name}" for effect, table in front_effects(result, use).items() for name in table]
    places = [place for place, key in enumerate(fit.values) if key in written and fit.sd(key) > 0]
    names = tuple(list(fit.values)[place] for place in places)
    matrix = fit.value_covariance[places][:, places]
    return ParameterCovariance(names, (matrix + matrix.T) / 2, origin=MODEL_FILE)


def model_file_text(result: FrontResult, model: Model, use: DampingUse, description: str) -> str:
    """Text (TOML) of a model file: the bicycle, the effects of its model, the front frame, the covariance.

    Raises
    ------
    InputError
        What was measured makes no model.
    """
    import tomli_w

    tables: dict[str, Any] = {
        effect.identifier: effect.table
        for effect in model.effects
        if effect.identifier not in (DEFAULT_CONTACT, FRONT, FORK)
    }
    content: dict[str, Any] = {
        "description": description,
        WAY_OUT: False,
        "bicycle": model_table(model.bicycle),
        "effects": tables | _with_rider(tables, front_effects(result, use)),
        **covariance_table(front_covariance(result, use)),
    }
    if _is_unusual(content):
        content[WAY_OUT] = True  # what was measured, however far from the usual
    text = tomli_w.dumps(content)
    build_model(tomllib.loads(text))
    return text


def _with_rider(tables: Mapping[str, Any], measured: dict[str, dict[str, float]]) -> dict[str, Any]:
    """The ``measured`` tables; a seated rider of the model keeps what was not measured."""
    if SADDLE not in measured:
        return dict(measured)
    kept = {key: value for key, value in tables.get(SADDLE, {}).items() if key != DAMPING_RATIO}
    return measured | {SADDLE: {**kept, **measured[SADDLE]}}


def _is_unusual(content: Mapping[str, Any]) -> bool:
    """True if a number of the front frame is outside its usual range."""
    tables = content["effects"]
    return any(effect_class(name)(**table).doubts() for name, table in tables.items() if name in (FRONT, FORK, SADDLE))
