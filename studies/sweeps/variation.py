"""What a sweep varies: values on a grid, and distributions by mean and sd, by both ends, or joint."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.files.wheel_tyres import tyre_file
from bicycle.model import Model
from bicycle.parameter_key import WHEELS, ParameterKey, entries_of
from bicycle.parameters import UNITS
from bicycle.sensitivity.propagation import checked_covariance
from studies.sampling.bounded_draws import possible_moments
from studies.sweeps.spec import SPEED, TYRE_UNITS, Axis, Normal, Uniform, bounds_of
from studies.sweeps.toml_values import finite, flag, known, leaves, whole
from tyre.base.errors import InputError, is_number, shown

SAMPLED_EXTRA = ("bicycle_sd", "tyre_covariance", "relative_cornering_stiffness_sd", "joint")
NAMES = ("tyre", "surface")  # varied by name, not by number
MOST_VALUES = 10**6  # of one axis


def variable_names(model: Model, taken: Collection[str]) -> set[str]:
    """Names that can be varied; ``taken`` are the parameters that a tyre gives, of which the contact law's cannot."""
    names = {*UNITS, SPEED}
    for effect in model.effects:
        for parameter in effect.parameters:
            if effect.slot == "contact law" and f"{effect.identifier}.{parameter.entries()[0]}" in taken:
                continue
            names |= {f"{effect.identifier}.{key}" for key in (parameter.name, *parameter.entries())}
    if taken:
        names |= {str(ParameterKey("", key, wheel)) for key in TYRE_UNITS for wheel in ("", *WHEELS)}
    return names


def read_grid(table: Any, allowed: set[str], folder: Path) -> tuple[tuple[Axis, ...], tuple[float, ...]]:
    """Axes of the grid, and the speeds (m/s) apart from them; files of tyres are relative to ``folder``."""
    axes, speeds = [], ()
    for name, value in leaves(table, "grid", allowed):
        known([name], allowed, "parameter")
        values = _axis_values(name, value)
        if ParameterKey.parse(name).name == "tyre":
            values = tuple(tyre_file(tyre, folder) for tyre in values)
        if len(set(values)) < len(values):
            raise InputError(f"grid.{name} holds a value twice; give each once")
        if name != SPEED:
            axes.append(Axis(name, values))
        elif min(values) < 0:
            raise InputError(f"grid.{SPEED} holds {min(values):g}; give speeds >= 0 m/s")
        else:
            speeds = values
    return tuple(axes), speeds


def _axis_values(name: str, value: Any) -> tuple[Any, ...]:
    if isinstance(value, Mapping):
        known(value, ("from", "to", "count"), f"key of grid.{name}:")
        for key in ("from", "to", "count"):
            if key not in value:
                raise InputError(f"grid.{name}: {key} is missing; write {{from = 0, to = 20, count = 201}}")
        ends = [finite(f"grid.{name}.{key}", value[key]) for key in ("from", "to")]
        count = whole(value, "count", None, least=1 if ends[0] == ends[1] else 2, most=MOST_VALUES)
        value = np.linspace(ends[0], ends[1], count).tolist()
    if not isinstance(value, list) or not value:
        raise InputError(f"grid.{name} = {shown(value)}: give a list of values or {{from, to, count}}")
    if ParameterKey.parse(name).name not in NAMES:
        return tuple(finite(f"grid.{name}", v) for v in value)
    for v in value:
        if not isinstance(v, str):
            raise InputError(f"grid.{name} = {shown(v)} must be a name in quotes")
    return tuple(value)


def read_sampled(
    table: Any, allowed: set[str], model: Model, tyre: Mapping[str, Any]
) -> tuple[tuple[Normal, ...], tuple[Uniform, ...]]:
    """Distributions of ``[sampled]``; ``tyre`` is the table of the measured tyre in the model, empty without one."""
    if not isinstance(table, Mapping):
        raise InputError("sampled is a table: write [sampled] and the parameters below it")
    normals, uniforms = [], []
    for name, value in leaves({k: v for k, v in table.items() if k not in SAMPLED_EXTRA}, "sampled", allowed):
        _number_name(name, allowed)
        if not isinstance(value, Mapping) or set(value) not in ({"low", "high"}, {"mean", "sd"}, {"sd"}):
            raise InputError(f"sampled.{name} = {shown(value)}: give {{mean, sd}}, {{sd}} or {{low, high}}")
        numbers = {key: finite(f"sampled.{name}.{key}", number) for key, number in value.items()}
        if "low" in numbers:
            if not numbers["low"] < numbers["high"]:
                raise InputError(f"sampled.{name}: low = {numbers['low']:g} must be below high = {numbers['high']:g}")
            low, high = bounds_of(model, name)
            for key in ("low", "high"):
                if not low <= numbers[key] <= high:
                    raise InputError(f"sampled.{name}: {key} = {numbers[key]:g} is outside {low:g} .. {high:g}")
            uniforms.append(Uniform(name, numbers["low"], numbers["high"]))
            continue
        if numbers["sd"] < 0:
            raise InputError(f"sampled.{name}.sd = {numbers['sd']:g} must be >= 0")
        mean = numbers["mean"] if "mean" in numbers else _nominal(name, model, tyre)
        possible_moments(f"sampled.{name}", mean, numbers["sd"], bounds_of(model, name))
        normals.append(Normal((name,), (mean,), ((numbers["sd"],),)))
    if flag("sampled.bicycle_sd", table.get("bicycle_sd", False)):
        sd = {key: value for key, value in model.bicycle.sd.items() if value > 0 and key in UNITS}
        if not sd:
            raise InputError(f"sampled.bicycle_sd: bicycle {model.bicycle.name!r} states no standard deviations")
        normals += [Normal((key,), (model.bicycle[key],), ((value,),)) for key, value in sd.items()]
    joint = table.get("joint", [])
    if not isinstance(joint, list) or not all(isinstance(entry, Mapping) for entry in joint):
        raise InputError("sampled.joint is a list of tables: write [[sampled.joint]], parameters and covariance")
    normals += [_joint(entry, allowed, model, tyre) for entry in joint]
    return tuple(normals), tuple(uniforms)


def _joint(entry: Mapping[str, Any], allowed: set[str], model: Model, tyre: Mapping[str, Any]) -> Normal:
    known(entry, ("parameters", "covariance", "mean"), "key of sampled.joint:")
    names, rows = entry.get("parameters", []), entry.get("covariance", [])
    if not isinstance(names, list) or not names:
        raise InputError("sampled.joint: parameters is missing; give a list of names and their covariance")
    for name in names:
        _number_name(name, allowed)
    where, size = f"sampled.joint of {', '.join(names)}", len(names)
    square = isinstance(rows, list) and all(isinstance(row, list) and len(row) == size for row in rows)
    if not square or len(rows) != size or not all(is_number(number) for row in rows for number in row):
        raise InputError(f"{where}: covariance must be {size} x {size} numbers")
    try:
        covariance = checked_covariance(names, rows)
    except InputError as error:
        raise InputError(f"sampled.joint: {error}") from error
    mean = entry.get("mean", [])
    if not isinstance(mean, list) or ("mean" in entry and len(mean) != size):
        raise InputError(f"{where}: mean = {shown(mean)}; give a list of one number per parameter")
    means = [finite(f"{where}: mean", value) for value in mean] or [_nominal(name, model, tyre) for name in names]
    for name, value, variance in zip(names, means, np.diag(covariance), strict=True):
        possible_moments(f"sampled.joint: {name}", value, float(np.sqrt(max(variance, 0.0))), bounds_of(model, name))
    return Normal(tuple(names), tuple(means), _root(covariance))


def _root(covariance: Any) -> tuple[tuple[float, ...], ...]:
    """Square root of a covariance, of its correlations so that units do not matter."""
    sd = np.sqrt(np.diag(covariance))
    scale = np.where(sd > 0, sd, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return tuple(map(tuple, (sd[:, None] * vectors * np.sqrt(np.maximum(values, 0))).tolist()))


def _number_name(name: Any, allowed: set[str]) -> None:
    known([name], allowed, "parameter")
    if ParameterKey.parse(name).name in NAMES:
        raise InputError(f"sampled {name}: a name cannot be sampled; list names in [grid]")


def _nominal(name: str, model: Model, tyre: Mapping[str, Any]) -> float:
    values: dict[str, Any] = dict(model.parameters)
    pressure = tyre.get("pressure_bar")
    per_wheel = pressure if isinstance(pressure, Mapping) else dict.fromkeys(WHEELS, pressure)
    values |= {f"pressure_bar.{wheel}": value for wheel, value in per_wheel.items() if value is not None}
    found = {values[key] for key in entries_of(name, values)}
    if len(found) != 1:
        raise InputError(f"sampled {name}: mean is missing; the model has no single value of it")
    return float(found.pop())
