"""One parameter of a model run through a range: speed, any key of bicycle or effects, tyre pressure or load."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.effect import WHEELS, PerWheel
from bicycle.files.model_file import (
    EXTRAPOLATE,
    MOST_BAR,
    TYRE_KEYS,
    allows_unusual,
    build_model,
    located,
    read_model,
    refuse_absurd_values,
    wheel_maps,
    wheel_tyres,
)
from bicycle.model import Model
from bicycle.parameters import UNITS
from tyre.base.arrays import Array
from tyre.base.errors import InputError, unknown
from tyre.base.toml_file import read_toml
from tyre.maps.tables import PASCAL_PER_BAR

OF_THE_TYRE = {"pressure_bar": "bar", "load_N": "N"}


@dataclass(frozen=True)
class ParameterPath:
    """State matrices as a function of one number.

    Attributes
    ----------
    key, unit : str
        What runs, in the unit of its values.
    matrices : callable
        Values (m,) -> scaled state matrices (m, n, n), eigenvalues in 1/s.
    at : callable
        One value -> (model, speed in m/s).
    base : float
        Value of the model as it stands; NaN where rear and front differ.
    inside : callable
        Values (m,) -> whether the tyre values are measured or interpolated (m,).
    """

    key: str
    unit: str
    matrices: Callable[[Array], Array]
    at: Callable[[float], tuple[Model, float]]
    base: float
    inside: Callable[[Array], NDArray[np.bool_]] = lambda values: np.ones(len(values), bool)


def parameter_path(model_file: str | Path | Mapping[str, Any], key: str, *, speed: float | None) -> ParameterPath:
    """Path of ``key`` through a model file, or through the content of one with absolute paths.

    Keys: ``speed``; a bicycle parameter (``IFyy``); ``effect.parameter`` for both wheels or ``effect.parameter.front``;
    ``pressure_bar`` and ``load_N`` (or ``.rear``, ``.front``) where the file names a measured tyre: the pressure, or
    the load at which the tyre's values are taken, while the bicycle keeps its masses.

    Parameters
    ----------
    model_file : str or Path or mapping
    key : str
    speed : float or None
        m/s; None where it is the parameter.

    Raises
    ------
    InputError
        An unknown key, no measured tyre, or no speed (m/s) where another parameter runs.
    """
    model, content, folder = _read(model_file)
    if key == "speed":
        linear = model.linear_model()
        return ParameterPath("speed", "m/s", linear.state_matrix, lambda v: (model, v), math.nan)
    if speed is None:
        raise InputError(f"parameter {key!r}: give the --speed (m/s) at which it runs")
    model.linear_model().check_speeds(speed)
    if key.partition(".")[0] in OF_THE_TYRE:
        return _tyre_path(content.get("effects", {}), folder, model, key, speed)
    entries = entries_of(model, key)
    values = {model.parameters[entry] for entry in entries}

    def matrices(given: Array) -> Array:
        return state_matrices(model, dict.fromkeys(entries, given), speed)

    base = values.pop() if len(values) == 1 else math.nan
    allow = allows_unusual(content)

    def at(value: float) -> tuple[Model, float]:
        if not allow:
            refuse_absurd_values(model, {key: [value]})
        return with_value(model, key, value), speed

    return ParameterPath(key, _unit(model, key), matrices, at, base)


def entries_of(model: Model, key: str) -> tuple[str, ...]:
    """Parameters that ``key`` stands for: itself, or rear and front of a parameter per wheel."""
    if key in UNITS or key in model.parameters:
        return (key,)
    both = tuple(f"{key}.{wheel}" for wheel in WHEELS)
    if all(entry in model.parameters for entry in both):
        return both
    known = {name.removesuffix(".rear").removesuffix(".front") for name in model.parameters} & {
        *UNITS, *(f"{effect.identifier}.{p.name}" for effect in model.effects for p in effect.parameters)
    }  # fmt: skip
    raise InputError(unknown("parameter", key, {"speed", *OF_THE_TYRE, *known}))


def with_value(model: Model, key: str, value: float) -> Model:
    """The model with the parameter ``key`` changed to ``value`` (SI), checked as if it came from a file."""
    if key in UNITS:
        return Model(model.bicycle.replace(**{key: value}), model.effects, model.notes, model.sd, model.assumed_sd)
    identifier, name, *wheel = key.split(".")
    effect = next(effect for effect in model.effects if effect.identifier == identifier)
    table: dict[str, Any] = {p.name: getattr(effect, p.name) for p in effect.parameters if hasattr(effect, p.name)}
    if wheel:
        table[name] = PerWheel(**{w: value if w == wheel[0] else table[name][w] for w in WHEELS})
    else:
        table[name] = value
    return model.with_effect(type(effect)(**table))


def state_matrices(model: Model, changed: Mapping[str, Array], speed: float) -> Array:
    """Scaled state matrices (m, n, n) at one ``speed`` (m/s) with some parameters ``changed`` to arrays (m,), SI."""
    bicycle: dict[str, Any] = {**model.bicycle.values, **{key: x for key, x in changed.items() if key in UNITS}}
    values: dict[str, Any] = dict(bicycle)
    for effect in model.effects:
        values |= effect.values(bicycle)
    values |= changed
    evaluate, (m,) = model.evaluator, next(iter(changed.values())).shape
    indicators: tuple[Any, ...] = ()
    if evaluate.symbolic.switches:
        each = [{k: np.broadcast_to(x, m)[i] for k, x in values.items()} for i in range(m)]
        indicators = tuple(np.array([[speed <= s for s in evaluate.switch_speeds(one)] for one in each], float).T)
    found = evaluate(values, indicators)
    mass = np.broadcast_to(found.mass, (m, *found.mass.shape[-2:]))
    bad = np.linalg.eigvalsh((mass + mass.swapaxes(1, 2)) / 2)[:, 0] <= 0
    if bad.any():
        key, given = next(iter(changed.items()))
        raise InputError(f"{key} = {given[bad][0]:g}: the mass matrix is not positive definite; take another range")
    scale = model.linear_model().scale
    dynamics = sum((speed**power * matrix for power, matrix in found.dynamics.items() if speed or power >= 0), 0.0)
    return np.asarray(np.linalg.solve(mass, np.broadcast_to(dynamics, mass.shape) * scale) / scale[:, None])


def _unit(model: Model, key: str) -> str:
    if key in UNITS:
        return UNITS[key]
    identifier, name, *_ = key.split(".")
    effect = next(effect for effect in model.effects if effect.identifier == identifier)
    return next(p.unit for p in effect.parameters if p.name == name)


def _read(model_file: str | Path | Mapping[str, Any]) -> tuple[Model, Mapping[str, Any], Path]:
    """The model, the content of its file, and the folder that the files it names are relative to."""
    if isinstance(model_file, Mapping):
        return build_model(model_file), model_file, Path()
    path = Path(model_file)
    return read_model(path), read_toml(path, "model file"), path.parent


def _tyre_path(tables: Mapping[str, Any], folder: Path, model: Model, key: str, speed: float) -> ParameterPath:
    what, _, one = key.partition(".")
    if one and one not in WHEELS:
        raise InputError(f"parameter {key!r}: {unknown('wheel', one, WHEELS)}")
    law = next((identifier for identifier, table in tables.items() if "tyre" in table), None)
    if law is None:
        raise InputError(f"{what} needs a measured tyre in the model file (tyre, surface, pressure_bar)")
    table = located(tables[law], folder)
    tyre, surface = ({w: x[w] if isinstance(x, Mapping) else x for w in WHEELS} for x in map(table.get, TYRE_KEYS[:2]))
    now = wheel_tyres(
        tyre=tyre, surface=surface, pressure_bar=table["pressure_bar"], bicycle=model.bicycle,
        extrapolate=table.get(EXTRAPOLATE, False),
    )  # fmt: skip
    maps = wheel_maps(tyre, surface)
    wheels = (one,) if one else WHEELS
    names = [n for n in ("cornering_stiffness", "relaxation_length") if f"{law}.{n}.rear" in model.parameters]

    def properties(wheel: str, value: float) -> Any:
        if what == "pressure_bar" and value > MOST_BAR:
            raise InputError(
                f"{key} = {value:g} of the range is not allowed; give pressures above 0 and up to {MOST_BAR:g} bar"
            )
        given = {"load": now[wheel].load, "pressure": now[wheel].pressure}
        given |= {"load": value} if what == "load_N" else {"pressure": value * PASCAL_PER_BAR}
        return maps[wheel].at(**given)

    def matrices(values: Array) -> Array:
        found = {wheel: [properties(wheel, value) for value in values] for wheel in wheels}
        changed = {
            f"{law}.{n}.{wheel}": np.array([getattr(p, n) for p in f]) for n in names for wheel, f in found.items()
        }
        return state_matrices(model, changed, speed)

    def at(value: float) -> tuple[Model, float]:
        changed = model
        for wheel in wheels:
            for name in names:
                changed = with_value(changed, f"{law}.{name}.{wheel}", getattr(properties(wheel, value), name))
        return changed, speed

    def inside(values: Array) -> NDArray[np.bool_]:
        return np.array([all(properties(wheel, value).inside for wheel in wheels) for value in values])

    bases = {now[w].load if what == "load_N" else now[w].pressure / PASCAL_PER_BAR for w in wheels}
    return ParameterPath(key, OF_THE_TYRE[what], matrices, at, bases.pop() if len(bases) == 1 else math.nan, inside)
