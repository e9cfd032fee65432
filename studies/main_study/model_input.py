"""From what a user gives to the settings of a study: a bicycle or a model file, tyres, pressures."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from bicycle.effect import WHEELS, effect_class
from bicycle.files.bicycle_file import load_bicycle
from bicycle.files.model_file import read_model
from bicycle.files.tyre_values import values_of_tyres
from bicycle.files.wheel_tyres import MOST_BAR, located
from bicycle.model import DEFAULT_CONTACT, Model
from bicycle.parameter_key import ParameterKey
from bicycle.parameters import Bicycle
from studies.main_study.riders import packaged_postures, with_rider
from studies.main_study.settings import Arms, Front, Settings
from studies.model_argument import bicycle_alone
from tyre.base.errors import InputError
from tyre.base.toml_file import read_toml

DEFAULT_BICYCLE = "pista_charlie_drops"
LAW = "relaxation_length"
CONFLICT = "a model file names its own bicycle"


def settings_of(
    model: str | None = None, *, bicycle: str | None = None, tyres: Sequence[str] = (), pressures: str | None = None,
    rider: str | None = None, posture: str | None = None,
) -> Settings:  # fmt: skip
    """The study of a model file, or of a bicycle with everything beside it assumed.

    Parameters
    ----------
    model : str, optional
        Model file: its tyre is what the question is about, its front and arms take the place of the assumed ones, all
        other effects are in every world. Or a bicycle, as ``bicycle``.
    bicycle : str, optional
        Packaged bicycle or file, by default the packaged one with a rider in the drops.
    tyres : sequence of str
        Files of tyre tables.
    pressures : str, optional
        ``3.5,5,7`` in bar.
    rider, posture : str, optional
        A packaged rider or a file of measurements, put on the bicycle in a posture (by default in the drops).

    Raises
    ------
    InputError
        Two bicycles, a model and a bicycle or rider, a model without a lagging tyre, or a value that is not allowed.
    """
    bars = read_pressures(pressures)
    alone = None if model is None else bicycle_alone(model)
    if alone is not None:
        if bicycle is not None:
            raise InputError(f"two bicycles, {model} and --bicycle {bicycle}; leave one out")
        model, bicycle = None, alone
    if posture is not None and rider is None:
        raise InputError(f"--posture {posture} needs a --rider; or take a packaged bicycle whose rider sits so")
    if model is None and rider is not None:
        if bicycle is None:
            raise InputError(f"--rider {rider} needs the --bicycle to sit on, for example --bicycle pista")
        ridden, others = with_rider(bicycle, rider, posture)
        return Settings(ridden, tyres=tuple(tyres), pressures=bars, postures=others)
    if model is None:
        found = load_bicycle(bicycle or DEFAULT_BICYCLE)
        return Settings(found, tyres=tuple(tyres), pressures=bars, postures=packaged_postures(found))
    for option, value in (("bicycle", bicycle), ("rider", rider)):
        if value is not None:
            raise InputError(f"--{option} {value}: {CONFLICT}; leave --{option} out or change 'bicycle' in {model}")
    whole = read_model(model)  # complains of all that is wrong in the file
    tables = dict(read_toml(Path(model), "model file").get("effects", {}))
    law = next(effect.identifier for effect in whole.effects if effect.slot == "contact law")
    if law not in (LAW, DEFAULT_CONTACT):
        raise InputError(
            f"{model}: the main study is about tyres with a relaxation length, but the file has {law}; use {LAW}, or "
            f"velotyre critical {model} for this model"
        )
    tables = with_numbers(tables, whole)
    contact = tables.pop(LAW, None)
    tables.pop(DEFAULT_CONTACT, None)
    return Settings(
        whole.bicycle, tyres=tuple(tyres), pressures=bars,
        front=own_front(tables.pop("front_compliance", None), whole.bicycle),
        arms=own_arms(tables.pop("rider_arms", None)), further=tables,
        contact=None if contact is None else located(contact, Path(model).parent),
    )  # fmt: skip


def with_numbers(tables: Mapping[str, Any], model: Model) -> dict[str, Any]:
    """The ``tables`` of effects, in which what the tyre gives beside its contact law stands as numbers."""
    found = {name: dict(table) for name, table in tables.items()}
    for text in values_of_tyres(tables):
        key = ParameterKey.parse(text)
        if key.effect != LAW:
            given = found[key.effect][key.name]
            each = dict(given) if isinstance(given, Mapping) else dict.fromkeys(WHEELS, given)
            found[key.effect][key.name] = each | {key.wheel: model.parameters[text]}
    return found


def own_front(table: Mapping[str, Any] | None, bicycle: Bicycle) -> Front:
    """The flexible front of a model file's ``table``, or the assumed one."""
    if table is None:
        return Front()
    values = effect_class("front_compliance")(**table).values(bicycle.values)
    number = {ParameterKey.parse(key).entry: value for key, value in values.items()}
    return Front(
        number["stiffness"], number["damping"], -number["joint_z"], number["joint_x"], number["axis_tilt"], given=True
    )


def own_arms(table: Mapping[str, Any] | None) -> Arms:
    """The arms of a model file's ``table``, or the assumed ones."""
    if table is None:
        return Arms()
    effect = effect_class("rider_arms")(**table)
    return Arms(
        **{one.name: float(getattr(effect, one.name)) for one in fields(Arms) if one.name != "given"}, given=True
    )


def read_pressures(text: str | None) -> tuple[float, ...]:
    """Pressures in bar from a ``text`` like ``3.5,5,7``, ascending."""
    if text is None:
        return ()
    try:
        bars = [float(part) for part in text.split(",")]
    except ValueError as error:
        raise InputError(f"--pressures {text!r}: give bar, for example 3.5,5,7") from error
    for bar in bars:
        if not (math.isfinite(bar) and 0 < bar <= MOST_BAR):
            raise InputError(f"--pressures {text!r}: {bar:g} is out of range; give above 0 and up to {MOST_BAR:g} bar")
    if len(set(bars)) < len(bars):
        raise InputError(f"--pressures {text!r} holds a pressure twice; give each once")
    return tuple(sorted(bars))
