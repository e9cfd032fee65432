"""A sweep as data: which model, what is varied over a grid, what is sampled, what is computed; read from TOML.

::

    model = "model.toml"                        # or a table like the content of a model file
    samples = 10000
    seed = 1
    outputs = ["largest_growth_rate", "damping_ratios"]

    [grid]                                      # any bicycle or effect parameter; of a measured tyre also
    speed_m_s = {from = 1, to = 20, count = 39} # tyre, surface, pressure_bar, load_N, each with .rear or .front
    pressure_bar = [3, 4, 5]
    front_compliance.stiffness = [2000, 3000]

    [sampled]
    bicycle_sd = true                           # what the bicycle file states
    tyre_covariance = true                      # what the tyre map states, both wheels together
    relative_cornering_stiffness_sd = 0.03      # assumed, for tables that state none
    c = {sd = 0.005}                            # normal around the model's value, or {mean, sd}
    mB = {low = 70, high = 100}                 # uniform

    [reduce]                                    # keep quantiles and extremes over the samples, not the samples
    quantiles = [0.05, 0.5, 0.95]
"""

import math
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.bicycle_file import load_bicycle
from bicycle.model import Model
from bicycle.model_file import TYRE_KEYS, build_model
from bicycle.parameters import UNITS
from studies.sweeps.spec import BY_SPEED, OUTPUTS, SPEED, TYRE_UNITS, WHEELS, Axis, Normal, Sweep, Uniform
from tyre.errors import InputError, unknown

TOP_KEYS = ("model", "samples", "seed", "outputs", "max_speed_m_s", "points_per_part", "grid", "sampled", "reduce")
SAMPLED_EXTRA = ("bicycle_sd", "tyre_covariance", "relative_cornering_stiffness_sd", "joint")
LEAF_KEYS = {"from", "to", "count", "mean", "sd", "low", "high"}
REDUCIBLE = ("largest_growth_rate", "smallest_damping_ratio", "frequencies", "damping_ratios", "critical_speeds")


def read_sweep(path: str | Path) -> Sweep:
    """Read a sweep file; files it names are relative to it.

    Raises
    ------
    InputError
        No such file, not TOML, an unknown key or parameter, or values that make no sweep.
    """
    path = Path(path)
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such sweep file") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not a TOML file: {error}") from error
    try:
        return build_sweep(content, folder=path.parent)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def build_sweep(content: Mapping[str, Any], *, folder: Path = Path()) -> Sweep:
    """Build a sweep from the content of a sweep file."""
    _known(content, TOP_KEYS, "key")
    model, nominal = _model(content.get("model"), folder)
    tables = model.get("effects", {}).values()
    measured = any(key in table for table in tables for key in TYRE_KEYS)
    allowed = _parameters(nominal, measured)
    axes, speeds = _grid(content.get("grid", {}), allowed)
    sampled = content.get("sampled", {})
    normals, uniforms = _sampled(sampled, allowed, nominal)
    relative = sampled.get("relative_cornering_stiffness_sd", 0.0)
    covariance = sampled.get("tyre_covariance", False)
    if covariance and not measured:
        raise InputError("sampled.tyre_covariance needs a measured tyre: give tyre and pressure_bar in the model file")
    random = bool(normals or uniforms or covariance)
    sweep = Sweep(
        model=model, axes=axes, speeds=speeds,
        samples=_whole(content, "samples", 1, least=1), seed=_whole(content, "seed", 0, least=0),
        normals=normals, uniforms=uniforms, tyre_covariance=bool(covariance),
        relative_cornering_stiffness_sd=_number("sampled.relative_cornering_stiffness_sd", relative),
        outputs=_outputs(content.get("outputs")),
        max_speed=_number("max_speed_m_s", content.get("max_speed_m_s", 60.0)),
        quantiles=_reduce(content.get("reduce")), points_per_part=_whole(content, "points_per_part", 65536, least=1),
    )  # fmt: skip
    _check_whole(sweep, random)
    return sweep


def _check_whole(sweep: Sweep, random: bool) -> None:
    if random and sweep.samples < 2:
        raise InputError("parameters are sampled but samples is missing; give for example samples = 1000")
    if not random and sweep.samples > 1:
        raise InputError(f"samples = {sweep.samples}, but nothing is sampled; add [sampled] or leave it out")
    twice = [name for name in sweep.varied if sweep.varied.count(name) > 1]
    if twice:
        raise InputError(f"{twice[0]} is varied twice; keep one of grid, sampled and joint")
    for name in sweep.varied:
        wheels = [f"{name}.{wheel}" for wheel in WHEELS if f"{name}.{wheel}" in sweep.varied]
        if wheels:
            raise InputError(f"{name} and {wheels[0]} are both varied; give both wheels together or each on its own")
    if any(output in BY_SPEED for output in sweep.outputs) and not sweep.speeds and SPEED not in sweep.varied:
        raise InputError(
            f"{sweep.outputs[0]} need speeds: add grid.{SPEED}, for example {{from = 0, to = 20, count = 201}}"
        )
    if sweep.quantiles is not None:
        for output in sweep.outputs:
            if output not in REDUCIBLE:
                raise InputError(
                    f"{output} cannot be reduced over samples; with [reduce] ask for {', '.join(REDUCIBLE)}"
                )


def _model(given: Any, folder: Path) -> tuple[dict[str, Any], Model]:
    """The model file's content with the bicycle as numbers, and the model with the bicycle's standard deviations."""
    if isinstance(given, str):
        path = folder / given
        try:
            given, folder = tomllib.loads(path.read_text(encoding="utf-8")), path.parent
        except FileNotFoundError as error:
            raise InputError(f"model = {path.as_posix()!r}: no such model file") from error
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise InputError(f"model = {path.as_posix()!r}: not a TOML file: {error}") from error
    if not isinstance(given, Mapping):
        raise InputError("model is missing: give a model file or a table like the content of one")
    nominal = build_model(given, folder=folder)
    bicycle = given["bicycle"]
    if isinstance(bicycle, str):
        found = load_bicycle(folder / bicycle if (folder / bicycle).is_file() else bicycle)
        bicycle = {key: found[key] for key in UNITS}
    return {key: value for key, value in given.items() if key != "description"} | {"bicycle": dict(bicycle)}, nominal


def _parameters(model: Model, tyre: bool) -> set[str]:
    """Names that can be varied."""
    given_by_tyre = ("cornering_stiffness", "relaxation_length") if tyre else ()
    names = {*UNITS, SPEED}
    for effect in model.effects:
        for parameter in effect.parameters:
            if effect.slot == "contact law" and parameter.name in given_by_tyre:
                continue
            names |= {f"{effect.identifier}.{key}" for key in (parameter.name, *parameter.entries())}
    if tyre:
        names |= {key + wheel for key in TYRE_UNITS for wheel in ("", *(f".{w}" for w in WHEELS))}
    return names


def _grid(table: Any, allowed: set[str]) -> tuple[tuple[Axis, ...], tuple[float, ...]]:
    axes: list[Axis] = []
    speeds: tuple[float, ...] = ()
    for name, value in _leaves(table, "grid"):
        _known([name], allowed, "parameter")
        text = name.split(".")[0] in ("tyre", "surface")
        if isinstance(value, Mapping):
            _known(value, ("from", "to", "count"), f"key of grid.{name}:")
            missing = [key for key in ("from", "to", "count") if key not in value]
            if missing:
                raise InputError(f"grid.{name}: {missing[0]} is missing; write {{from = 0, to = 20, count = 201}}")
            ends = [_number(f"grid.{name}.{key}", value[key]) for key in ("from", "to")]
            value = np.linspace(ends[0], ends[1], _whole(value, "count", None, least=1)).tolist()
        if not isinstance(value, list) or not value:
            raise InputError(f"grid.{name} = {value!r}: give a list of values or {{from, to, count}}")
        values = tuple(v if text and isinstance(v, str) else _number(f"grid.{name}", v) for v in value)
        if len(set(values)) < len(values):
            raise InputError(f"grid.{name} holds a value twice; give each once")
        if name == SPEED:
            speeds = tuple(float(v) for v in values)
            if min(speeds) < 0:
                raise InputError(f"grid.{SPEED} holds {min(speeds):g}; give speeds >= 0 m/s")
        else:
            axes.append(Axis(name, values))
    return tuple(axes), speeds


def _sampled(table: Any, allowed: set[str], model: Model) -> tuple[tuple[Normal, ...], tuple[Uniform, ...]]:
    normals, uniforms = [], []
    if not isinstance(table, Mapping):
        raise InputError("sampled is a table: write [sampled] and the parameters below it")
    for name, value in _leaves({k: v for k, v in table.items() if k not in SAMPLED_EXTRA}, "sampled"):
        _known([name], allowed, "parameter")
        if not isinstance(value, Mapping) or set(value) not in ({"low", "high"}, {"mean", "sd"}, {"sd"}):
            raise InputError(f"sampled.{name} = {value!r}: give {{mean, sd}}, {{sd}} or {{low, high}}")
        numbers = {key: _number(f"sampled.{name}.{key}", number) for key, number in value.items()}
        if "sd" in numbers:
            if numbers["sd"] < 0:
                raise InputError(f"sampled.{name}.sd = {numbers['sd']:g} must be >= 0")
            mean = numbers["mean"] if "mean" in numbers else _nominal(name, model)
            normals.append(Normal((name,), (mean,), ((numbers["sd"],),)))
        else:
            if not numbers["low"] < numbers["high"]:
                raise InputError(f"sampled.{name}: low = {numbers['low']:g} must be below high = {numbers['high']:g}")
            uniforms.append(Uniform(name, numbers["low"], numbers["high"]))
    if table.get("bicycle_sd"):
        sd = {key: value for key, value in model.bicycle.sd.items() if value > 0 and key in UNITS}
        if not sd:
            raise InputError(f"sampled.bicycle_sd: bicycle {model.bicycle.name!r} states no standard deviations")
        normals += [Normal((key,), (model.bicycle[key],), ((value,),)) for key, value in sd.items()]
    normals += [_joint(entry, allowed, model) for entry in table.get("joint", [])]
    return tuple(normals), tuple(uniforms)


def _joint(entry: Mapping[str, Any], allowed: set[str], model: Model) -> Normal:
    _known(entry, ("parameters", "covariance", "mean"), "key of sampled.joint:")
    names = tuple(entry.get("parameters", ()))
    if not names:
        raise InputError("sampled.joint: parameters is missing; give names and their covariance")
    _known(names, allowed, "parameter")
    try:
        covariance = np.array(entry.get("covariance", ()), float)
    except (ValueError, TypeError):
        covariance = np.empty(0)
    if covariance.shape != (len(names), len(names)) or not np.isfinite(covariance).all():
        raise InputError(f"sampled.joint of {', '.join(names)}: covariance must be {len(names)} x {len(names)} numbers")
    values, vectors = np.linalg.eigh(covariance)
    if not np.allclose(covariance, covariance.T, rtol=1e-9, atol=0) or values[0] < -1e-12 * values[-1]:
        raise InputError(
            f"sampled.joint of {', '.join(names)}: covariance must be symmetric without negative eigenvalues"
        )
    mean = entry.get("mean", [_nominal(name, model) for name in names])
    if len(mean) != len(names):
        raise InputError(f"sampled.joint of {', '.join(names)}: mean has {len(mean)} numbers; give one per parameter")
    factor = vectors * np.sqrt(np.maximum(values, 0))
    return Normal(names, tuple(float(value) for value in mean), tuple(map(tuple, factor.tolist())))


def _nominal(name: str, model: Model) -> float:
    values = model.parameters
    found = {values[key] for key in (name, *(f"{name}.{wheel}" for wheel in WHEELS)) if key in values}
    if len(found) != 1:
        raise InputError(f"sampled {name}: mean is missing; the model has no single value of it")
    return found.pop()


def _outputs(given: Any) -> tuple[str, ...]:
    if not isinstance(given, list) or not given:
        raise InputError(f"outputs is missing: give a list of {', '.join(OUTPUTS)}")
    _known(given, OUTPUTS, "output")
    return tuple(dict.fromkeys(given))


def _reduce(given: Any) -> tuple[float, ...] | None:
    if given is None:
        return None
    _known(given, ("quantiles",), "key of reduce:")
    quantiles = tuple(_number("reduce.quantiles", q) for q in given.get("quantiles", [0.05, 0.5, 0.95]))
    for q in quantiles:
        if not 0 <= q <= 1:
            raise InputError(f"reduce.quantiles holds {q:g}; give numbers from 0 to 1")
    return quantiles


def _leaves(table: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    """Parameters by full name; ``[grid.relaxation_length]`` and a quoted ``"relaxation_length.x"`` are the same."""
    if not isinstance(table, Mapping):
        raise InputError(f"{prefix} is a table: write [{prefix}] and the parameters below it")
    for key, value in table.items():
        if (
            isinstance(value, Mapping)
            and value
            and not set(value) & {"from", "to", "count", "mean", "sd", "low", "high"}
        ):
            yield from ((f"{key}.{name}", leaf) for name, leaf in _leaves(value, key))
        else:
            yield key, value


def _known(names: Any, allowed: Any, kind: str) -> None:
    for name in names:
        if name not in allowed:
            raise InputError(unknown(kind, name, allowed))


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"{name} = {value!r} must be a finite number")
    return float(value)


def _whole(table: Mapping[str, Any], key: str, default: Any, *, least: int) -> int:
    value = table.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value < 2**63:
        raise InputError(f"{key} = {value!r} must be a whole number from {least}")
    return value
