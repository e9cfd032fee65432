"""One number of a model that is run or varied: what it is called, its unit, and how far it may go."""

import math
from dataclasses import dataclass

import numpy as np

from bicycle.files.wheel_tyres import MOST_BAR
from bicycle.model import Model
from bicycle.parameter_key import WHEELS, ParameterKey, entries_of
from bicycle.parameters import TYPICAL, UNITS, UNUSED
from studies.sensitivity.ranking import unit_of
from studies.sweeps.spec import bounds_of
from tyre.base.errors import InputError, unknown

SPEED = "speed"
OF_THE_TYRE = {"pressure_bar": "bar", "load_N": "N"}


@dataclass(frozen=True)
class Axis:
    """A number that runs.

    Attributes
    ----------
    key, unit : str
        What it is called; the unit of its values.
    wheels : tuple of str
        Of a pressure or load: whose; else empty.
    bounds : tuple of float
        Lowest and highest value that is possible, in the unit.
    """

    key: str
    unit: str
    wheels: tuple[str, ...] = ()
    bounds: tuple[float, float] = (-math.inf, math.inf)

    @property
    def condition(self) -> str:
        """``pressure_bar`` or ``load_N`` of a tyre's condition, else empty."""
        return ParameterKey.parse(self.key).name if self.wheels else ""

    @property
    def said(self) -> str:
        """``front_compliance.stiffness`` -> "front compliance stiffness"; of a contact law the parameter alone."""
        own = ParameterKey.parse(self.key)
        law = own.name in ("cornering_stiffness", "relaxation_length")
        parts = ("" if law else own.effect, own.name.removesuffix("_bar").removesuffix("_N"), own.wheel)
        return " ".join(dict.fromkeys(part for part in parts if part)).replace("_", " ")

    @property
    def column(self) -> str:
        """Name of a column with its values, the unit behind it."""
        unit = self.unit.replace("/", "_").replace(" ", "_").replace("^", "")
        name = self.key.replace(".", "_")
        return name if self.unit == "1" or name.endswith(f"_{unit}") else f"{name}_{unit}"


def axis_keys(model: Model) -> list[str]:
    """Keys of a model that can be an axis, beside the speed and the condition of its tyres.

    Parameters
    ----------
    model : Model
    """
    known = dict.fromkeys(str(ParameterKey.parse(entry).whole) for entry in model.parameters)
    return [key for key in known if key not in UNUSED]


def axis_of(model: Model, key: str) -> Axis:
    """The axis that a key stands for in a model.

    Parameters
    ----------
    model : Model
    key : str
        ``speed``; a key of the bicycle; ``effect.parameter`` (of both wheels where it has one for each) or
        ``effect.parameter.wheel``; ``pressure_bar`` or ``load_N`` of the tyres, or of one with ``.rear``, ``.front``.

    Raises
    ------
    InputError
        The model has no such number.
    """
    if key == SPEED:
        return Axis(SPEED, "m/s", (), (0.0, math.inf))
    own = ParameterKey.parse(key)
    if own.name in OF_THE_TYRE and not own.effect:
        bounds = (0.0, MOST_BAR if own.name == "pressure_bar" else math.inf)
        return Axis(key, OF_THE_TYRE[own.name], (own.wheel,) if own.wheel else WHEELS, bounds)
    if not entries_of(key, set(model.parameters) - set(UNUSED)):
        missing = own.effect and own.effect not in {effect.identifier for effect in model.effects}
        hint = f"the model has no effect {own.effect}: add [effects.{own.effect}] to its file; " if missing else ""
        raise InputError(hint + unknown("parameter", key, {SPEED, *OF_THE_TYRE, *axis_keys(model)}))
    if key in model.tied:
        raise InputError(f"{key} was not given and equals {model.tied[key]} of the bicycle; give it a number first")
    return Axis(key, unit_of(key), (), bounds_of(model, key))


def typical_range(model: Model, axis: Axis) -> tuple[float, float]:
    """Where the values of an axis of the bicycle or of an effect usually lie, as far as they are possible.

    Parameters
    ----------
    model : Model
    axis : Axis

    Returns
    -------
    tuple of float
        In the unit of the axis.
    """
    if axis.key in UNITS:
        base = model.parameters[axis.key]
        low, high = TYPICAL[axis.key]
        span = 0.5 * abs(base) or 0.25 * (high - low)
        return max(base - span, axis.bounds[0]), min(base + span, axis.bounds[1])
    own = ParameterKey.parse(axis.key)
    effect = next(effect for effect in model.effects if effect.identifier == own.effect)
    typical = next(p.typical for p in effect.parameters if p.name == own.name)
    return max(typical[0], axis.bounds[0]), min(typical[1], axis.bounds[1])


def base_value(model: Model, axis: Axis, conditions: dict[str, float]) -> float:
    """The value of the model as it stands; NaN of the speed and where rear and front differ.

    Parameters
    ----------
    model : Model
    axis : Axis
    conditions : dict of str to float
        Pressure (bar) or load (N) of each wheel, of an axis of the tyre.
    """
    if axis.key == SPEED:
        return math.nan
    given = (
        [conditions[wheel] for wheel in axis.wheels]
        if axis.wheels
        else [model.parameters[entry] for entry in entries_of(axis.key, model.parameters)]
    )
    return given[0] if np.ptp(given) == 0 else math.nan
