"""The content of a model file with some of its numbers changed, so that it still says where the others come from."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bicycle.effect import effect_class
from bicycle.files.wheel_tyres import EXTRAPOLATE, TYRE_KEYS
from bicycle.parameter_key import WHEELS, ParameterKey
from bicycle.parameters import UNITS
from studies.model_axes.model_space import ModelSpace


def changed_content(space: ModelSpace, x: ArrayLike) -> dict[str, Any]:
    """The content of the model file with other numbers for the axes; what is not changed stays as it stands there.

    A bicycle of which a number changes is written out, with the standard deviations it states. What a tyre gives is
    written out where one of these numbers is itself an axis.

    Parameters
    ----------
    space : ModelSpace
        Without speed and loads among its axes.
    x : array_like, shape (d,)
        In the units of the axes.
    """
    point = np.asarray(x, float)
    values = {key: float(np.ravel(value)[0]) for key, value in space.values([point]).items()}
    content = dict(space.content)
    tables = {name: dict(table) for name, table in content.get("effects", {}).items()}
    own = [axis.key for axis in space.axes]
    if any(key in UNITS for key in own):
        content["bicycle"] = _bicycle(space, {key for key in own if key in UNITS}, values)
    given = {} if space.tyres is None else space.tyres.given
    if any(entry in given for entries in space.entries for entry in entries):
        tables = {name: _without_tyre(name, table, given, values) for name, table in tables.items()}
    for axis, entries, number in zip(space.axes, space.entries, point.tolist(), strict=True):
        if axis.wheels:
            law = next(table for table in tables.values() if "tyre" in table)
            old = law["pressure_bar"]
            each: dict[str, Any] = dict(old) if isinstance(old, Mapping) else dict.fromkeys(WHEELS, old)
            law["pressure_bar"] = _plain(each | dict.fromkeys(axis.wheels, number))
        elif axis.key not in UNITS:
            key = ParameterKey.parse(entries[0])
            tables[key.effect][key.name] = _value(key.effect, key.name, values)
    return content | ({"effects": tables} if tables else {})


def _bicycle(space: ModelSpace, changed: set[str], values: Mapping[str, float]) -> dict[str, Any]:
    given = space.content["bicycle"]
    if isinstance(given, Mapping):
        sd = {key: space.model.bicycle.sd[key] for key in changed if key in space.model.bicycle.sd}
        return dict(given) | {key: _with_sd(values[key], sd.get(key)) for key in changed}
    bicycle = space.model.bicycle
    return {key: _with_sd(values.get(key, bicycle[key]), bicycle.sd.get(key)) for key in bicycle.values}


def _with_sd(value: float, sd: float | None) -> float | str:
    return value if sd is None else f"{value!r} +/- {sd!r}"


def _value(effect: str, name: str, values: Mapping[str, float]) -> Any:
    parameter = next(p for p in effect_class(effect).parameters if p.name == name)
    if not parameter.per_wheel:
        return values[f"{effect}.{name}"]
    return _plain({wheel: values[f"{effect}.{name}.{wheel}"] for wheel in WHEELS})


def _plain(each: Mapping[str, Any]) -> Any:
    return each[WHEELS[0]] if each[WHEELS[0]] == each[WHEELS[1]] else dict(each)


def _without_tyre(
    name: str, table: Mapping[str, Any], given: Mapping[str, str], values: Mapping[str, float]
) -> dict[str, Any]:
    """The table of an effect with numbers in place of what its tyre gives."""
    kept = {key: value for key, value in table.items() if key not in (*TYRE_KEYS, EXTRAPOLATE)}
    names = dict.fromkeys(ParameterKey.parse(key).name for key in given if ParameterKey.parse(key).effect == name)
    return kept | {own: _value(name, own, values) for own in names}


def near_to(content: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The content with files that lie in ``folder``, or below, named from there.

    Parameters
    ----------
    content : mapping
        With absolute file names.
    folder : Path
    """
    found, home = dict(content), folder.resolve()

    def name(value: Any) -> Any:
        path = Path(value) if isinstance(value, str) else None
        inside = path is not None and path.is_absolute() and path.is_relative_to(home)
        return path.relative_to(home).as_posix() if inside and path is not None else value

    found["bicycle"] = name(content.get("bicycle"))
    tables = {key: dict(table) for key, table in content.get("effects", {}).items()}
    for table in tables.values():
        if "tyre" in table:
            tyre = table["tyre"]
            table["tyre"] = {w: name(one) for w, one in tyre.items()} if isinstance(tyre, Mapping) else name(tyre)
    return found | ({"effects": tables} if tables else {})
