"""What a sweep varies: values on a grid, and distributions by mean and sd, by both ends, or joint."""

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.default_sd import MODEL_FILE
from bicycle.files.wheel_tyres import tyre_file
from bicycle.model import Model
from bicycle.parameter_covariance import ParameterCovariance, checked_covariance
from bicycle.parameter_key import WHEELS, ParameterKey, entries_of
from bicycle.parameters import UNITS
from studies.sampling.bounded_draws import possible_moments
from studies.sweeps.spec import SPEED, TYRE_UNITS, Axis, Normal, Uniform, bounds_of
from tyre.base.checks import any_table, anything, flag, list_of, number, text, whole
from tyre.base.errors import InputError, refuse_unknown, shown
from tyre.base.schema import maybe, needed, read, table

NAMES = ("tyre", "surface")  # varied by name, not by number
MOST_VALUES = 10**6  # of one axis
FINITE, SD = number(), number(least=0, says="must be >= 0")
RANGE_KEYS, DISTRIBUTIONS = ("from", "to", "count"), ({"low", "high"}, {"mean", "sd"}, {"sd"})
LEAF_KEYS = {*RANGE_KEYS, "mean", "sd", "low", "high"}
NAMED = text("must be a name in quotes")
OPTIONS = table(
    {
        maybe("bicycle_sd", False): flag, maybe("tyre_covariance", False): flag,
        maybe("relative_cornering_stiffness_sd", 0.0): number(least=0, says="must be >= 0 (0.02 is 2 % of C_Fy)"),
        maybe("joint", []): list_of(
            any_table, "must be a list of tables: write [[sampled.joint]], parameters and covariance"
        ),
    },
    others=True,
)  # fmt: skip
SAMPLED_EXTRA = OPTIONS.keys
JOINT = table(
    {
        needed("parameters", "parameters is missing; give a list of names and their covariance"): list_of(
            NAMED, "must be a list of names", least=1
        ),
        maybe("covariance", []): anything, maybe("mean"): anything,
    },
    kind="key of sampled.joint:",
)  # fmt: skip


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


def read_grid(content: Any, allowed: set[str], folder: Path) -> tuple[tuple[Axis, ...], tuple[float, ...]]:
    """Axes of the grid, and the speeds (m/s) apart from them.

    Parameters
    ----------
    content : mapping
        The table ``[grid]``.
    allowed : set of str
        Names of :func:`variable_names`.
    folder : Path
        Where the files of tyres are.
    """
    axes, speeds = [], ()
    for name, value in _leaves(content, allowed):
        refuse_unknown("parameter", [name], allowed)
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


def _leaves(content: Mapping[str, Any], allowed: set[str], start: str = "") -> Iterator[tuple[str, Any]]:
    """Parameters by full name; ``[grid.relaxation_length]`` and a quoted ``"relaxation_length.x"`` are the same."""
    for key, value in content.items():
        name = start + key
        inner = isinstance(value, Mapping) and value and not set(value) & LEAF_KEYS
        if inner and any(other.startswith(f"{name}.") for other in allowed):
            yield from _leaves(value, allowed, f"{name}.")
        else:
            yield name, value


def _axis_values(name: str, value: Any) -> tuple[Any, ...]:
    if isinstance(value, Mapping):
        count = whole(least=1 if value.get("from") == value.get("to") else 2, most=MOST_VALUES)
        checks = dict(zip(RANGE_KEYS, (FINITE, FINITE, count), strict=True))
        declared = {
            needed(k, f"{k} is missing; write {{from = 0, to = 20, count = 201}}"): c for k, c in checks.items()
        }
        ends = read(table(declared, kind=f"key of grid.{name}:"), value, section=f"grid.{name}", dotted=True)
        value = np.linspace(ends["from"], ends["to"], ends["count"]).tolist()
    if not isinstance(value, list) or not value:
        raise InputError(f"grid.{name} = {shown(value)}: give a list of values or {{from, to, count}}")
    entry = NAMED if ParameterKey.parse(name).name in NAMES else FINITE
    return tuple(read(entry, v, section=f"grid.{name}", dotted=True) for v in value)


def read_options(content: Mapping[str, Any]) -> dict[str, Any]:
    """What the table ``[sampled]`` says beside the distributions of parameters.

    Parameters
    ----------
    content : mapping
        That table, units in its keys.

    Returns
    -------
    dict
        By the keys of :data:`OPTIONS`.
    """
    return dict(read(OPTIONS, content, section="sampled", dotted=True))


def read_sampled(
    content: Mapping[str, Any], allowed: set[str], model: Model, tyre: Mapping[str, Any],
    elsewhere: Collection[str] = (),
) -> tuple[tuple[Normal, ...], tuple[Uniform, ...]]:  # fmt: skip
    """Distributions of ``[sampled]``; ``bicycle_sd`` stands for what nothing else varies: of the bicycle, and what the
    ``[covariance]`` of a model file has, drawn together.

    Parameters
    ----------
    content : mapping
        That table.
    allowed : set of str
        Names of :func:`variable_names`.
    model : Model
        Gives means and bounds.
    tyre : mapping
        Table of the measured tyre in the model, empty without one.
    elsewhere : collection of str
        Names that are varied outside this table.
    """
    options = read_options(content)
    normals, uniforms = [], []
    for name, value in _leaves({k: v for k, v in content.items() if k not in OPTIONS.keys}, allowed):
        _number_name(name, allowed)
        if not isinstance(value, Mapping) or set(value) not in DISTRIBUTIONS:
            raise InputError(f"sampled.{name} = {shown(value)}: give {{mean, sd}}, {{sd}} or {{low, high}}")
        declared = table({needed(key): SD if key == "sd" else FINITE for key in value})
        numbers = read(declared, value, section=f"sampled.{name}", dotted=True)
        if "low" in numbers:
            uniforms.append(_uniform(name, numbers["low"], numbers["high"], bounds_of(model, name)))
            continue
        mean = numbers["mean"] if "mean" in numbers else _nominal(name, model, tyre)
        possible_moments(f"sampled.{name}", mean, numbers["sd"], bounds_of(model, name))
        normals.append(Normal((name,), (mean,), ((numbers["sd"],),)))
    joint = [_joint(entry, allowed, model, tyre) for entry in options["joint"]]
    if options["bicycle_sd"]:
        stated = model.covariance if model.covariance.origin == MODEL_FILE else ParameterCovariance()
        sd = {
            key: value for key, value in model.bicycle.sd.items()
            if value > 0 and key in UNITS and key not in stated.names
        }  # fmt: skip
        if not sd and not any(stated.sd.values()):
            raise InputError(
                f"sampled.bicycle_sd: bicycle {model.bicycle.name!r} states no standard deviations; give them in its "
                "file ([sd]), in [covariance] of the model file, or of single parameters here, such as c = {sd = 0.003}"
            )
        own = {*elsewhere, *(u.name for u in uniforms), *(name for one in (*normals, *joint) for name in one.names)}
        normals += [Normal((key,), (model.bicycle[key],), ((value,),)) for key, value in sd.items() if key not in own]
        together = [key for key, value in stated.sd.items() if value > 0 and not own & {key, _both_wheels(key)}]
        if together:
            spread = stated.among(together).tolist()
            joint.append(_joint({"parameters": together, "covariance": spread}, allowed, model, tyre))
    return (*normals, *joint), tuple(uniforms)


def _both_wheels(key: str) -> str:
    """The name that varies a parameter at both wheels, of a ``key`` of one of them; else itself."""
    return str(ParameterKey.parse(key).whole)


def _uniform(name: str, low: float, high: float, bounds: tuple[float, float]) -> Uniform:
    if not low < high:
        raise InputError(f"sampled.{name}: low = {low:g} must be below high = {high:g}")
    for key, end in (("low", low), ("high", high)):
        if not bounds[0] <= end <= bounds[1]:
            raise InputError(f"sampled.{name}: {key} = {end:g} is outside {bounds[0]:g} .. {bounds[1]:g}")
    return Uniform(name, low, high)


def _joint(entry: Mapping[str, Any], allowed: set[str], model: Model, tyre: Mapping[str, Any]) -> Normal:
    given = read(JOINT, entry, section="sampled.joint", dotted=True)
    names = given["parameters"]
    for name in names:
        _number_name(name, allowed)
    where, size = f"sampled.joint of {', '.join(names)}", len(names)
    row = list_of(FINITE, f"must be {size} numbers", least=size, most=size)
    square = list_of(row, f"must be {size} x {size} numbers", least=size, most=size)
    rows = read(square, given["covariance"], where=where, section="covariance")
    try:
        covariance = checked_covariance(names, rows)
    except InputError as error:
        raise InputError(f"sampled.joint: {error}") from error
    if "mean" in given:
        one_each = list_of(FINITE, "; give a list of one number per parameter", least=size, most=size, strict=False)
        means = read(one_each, given["mean"], where=where, section="mean", dotted=True)
    else:
        means = [_nominal(name, model, tyre) for name in names]
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
    refuse_unknown("parameter", [name], allowed)
    if ParameterKey.parse(name).name in NAMES:
        raise InputError(f"sampled {name}: a name cannot be sampled; list names in [grid]")


def _nominal(name: str, model: Model, tyre: Mapping[str, Any]) -> float:
    values: dict[str, Any] = dict(model.parameters)
    pressure = tyre.get("pressure_bar")
    per_wheel = pressure if isinstance(pressure, Mapping) else dict.fromkeys(WHEELS, pressure)
    values |= {f"pressure_bar.{wheel}": value for wheel, value in per_wheel.items() if value is not None}
    found = {values[key] for key in entries_of(name, values)}
    if len(found) == len(WHEELS):
        rear, front = (values[f"{name}.{wheel}"] for wheel in WHEELS)
        raise InputError(
            f"sampled {name}: mean is missing; the model has {rear:g} at the rear and {front:g} at the front wheel, so "
            f"give {name}.rear and {name}.front"
        )
    if len(found) != 1:
        raise InputError(f"sampled {name}: mean is missing; the model has no single value of it")
    return float(found.pop())
