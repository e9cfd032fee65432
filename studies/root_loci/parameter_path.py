"""One parameter of a model run through a range: speed, any key of bicycle or effects, tyre pressure or load."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.files.model_file import allows_unusual, build_model, read_model, refuse_absurd_values
from bicycle.files.tyre_values import values_of_tyres
from bicycle.files.wheel_tyres import EXTRAPOLATE, MOST_BAR, TYRE_KEYS, located, wheel_sources, wheel_tyres
from bicycle.model import Model
from bicycle.model_family import ModelFamily
from bicycle.parameter_key import WHEELS, ParameterKey, entries_of
from bicycle.parameters import UNITS, UNUSED
from tyre.base.arrays import Array
from tyre.base.errors import InputError, unknown
from tyre.base.toml_file import read_toml
from tyre.base.units import PASCAL_PER_BAR

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
    own = ParameterKey.parse(key)
    if speed is None:
        if own.name not in OF_THE_TYRE and own.effect not in OF_THE_TYRE:
            path_family(model, key)  # an unknown name is said first
        raise InputError(f"parameter {key!r}: give the --speed (m/s) at which it runs")
    model.linear_model().check_speeds(speed)
    if own.effect in OF_THE_TYRE:
        raise InputError(f"parameter {key!r}: {unknown('wheel', own.name, WHEELS)}")
    if own.name in OF_THE_TYRE:
        return _tyre_path(content.get("effects", {}), folder, model, own, speed)
    family = path_family(model, key)
    values = {model.parameters[entry] for entry in family.entries(key)}

    def matrices(given: Array) -> Array:
        return family.state_matrices({key: given}, np.full((len(given), 1), speed))[:, 0]

    base = values.pop() if len(values) == 1 else math.nan
    allow = allows_unusual(content)

    def at(value: float) -> tuple[Model, float]:
        if not allow:
            refuse_absurd_values(model, {key: [value]})
        return family.with_values({key: value}), speed

    return ParameterPath(key, _unit(model, key), matrices, at, base)


def path_family(model: Model, key: str) -> ModelFamily:
    """The models along the parameter ``key`` of bicycle or effects."""
    known = {str(ParameterKey.parse(entry).whole) for entry in model.parameters} - set(UNUSED)
    if not entries_of(key, model.parameters):
        raise InputError(unknown("parameter", key, {"speed", *OF_THE_TYRE, *known}))
    return ModelFamily(model, (key,))


def _unit(model: Model, key: str) -> str:
    if key in UNITS:
        return UNITS[key]
    own = ParameterKey.parse(key)
    effect = next(effect for effect in model.effects if effect.identifier == own.effect)
    return next(p.unit for p in effect.parameters if p.name == own.name)


def _read(model_file: str | Path | Mapping[str, Any]) -> tuple[Model, Mapping[str, Any], Path]:
    """The model, the content of its file, and the folder that the files it names are relative to."""
    if isinstance(model_file, Mapping):
        return build_model(model_file), model_file, Path()
    path = Path(model_file)
    return read_model(path), read_toml(path, "model file"), path.parent


def _tyre_path(tables: Mapping[str, Any], folder: Path, model: Model, key: ParameterKey, speed: float) -> ParameterPath:
    what = key.name
    law = next((identifier for identifier, table in tables.items() if "tyre" in table), None)
    if law is None:
        raise InputError(f"{what} needs a measured tyre in the model file (tyre, surface, pressure_bar)")
    table = located(tables[law], folder)
    tyre, surface = ({w: x[w] if isinstance(x, Mapping) else x for w in WHEELS} for x in map(table.get, TYRE_KEYS[:2]))
    now = wheel_tyres(
        tyre=tyre, surface=surface, pressure_bar=table["pressure_bar"], bicycle=model.bicycle,
        extrapolate=table.get(EXTRAPOLATE, False),
    )  # fmt: skip
    sources = wheel_sources(tyre, surface)
    wheels = (key.wheel,) if key.wheel else WHEELS
    family = ModelFamily(model)
    of_tyres = ((ParameterKey.parse(text), name) for text, name in values_of_tyres(tables).items())
    taken = {own: name for own, name in of_tyres if own.wheel in wheels}

    def properties(wheel: str, value: float) -> Any:
        if what == "pressure_bar" and value > MOST_BAR:
            raise InputError(
                f"{key} = {value:g} of the range is not allowed; give pressures above 0 and up to {MOST_BAR:g} bar"
            )
        given = {"load": now[wheel].load, "pressure": now[wheel].pressure}
        given |= {"load": value} if what == "load_N" else {"pressure": value * PASCAL_PER_BAR}
        return sources[wheel].at(**given)

    def matrices(values: Array) -> Array:
        tyres = {wheel: [properties(wheel, value) for value in values] for wheel in wheels}
        changed = {str(own): np.array([getattr(p, name) for p in tyres[own.wheel]]) for own, name in taken.items()}
        return family.state_matrices(changed, np.full((len(values), 1), speed))[:, 0]

    def at(value: float) -> tuple[Model, float]:
        tyres = {wheel: properties(wheel, value) for wheel in wheels}
        changed = {str(own): getattr(tyres[own.wheel], name) for own, name in taken.items()}
        return family.with_values(changed), speed

    def inside(values: Array) -> NDArray[np.bool_]:
        return np.array([all(properties(wheel, value).inside for wheel in wheels) for value in values])

    bases = {now[w].load if what == "load_N" else now[w].pressure / PASCAL_PER_BAR for w in wheels}
    return ParameterPath(
        str(key), OF_THE_TYRE[what], matrices, at, bases.pop() if len(bases) == 1 else math.nan, inside
    )
