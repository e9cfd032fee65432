"""A sweep as data, read from TOML (docs/sweeps.md): which model, what is varied, what is sampled and computed."""

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.files.bicycle_files import bicycle_place, is_bicycle_table, read_bicycles
from bicycle.model.default_sd import MODEL_FILE
from bicycle.model.model import Model
from bicycle.model.model_file import allows_unusual, build_model, model_content, refuse_absurd_values
from bicycle.model.rider_in_model import locate_rider
from bicycle.model.wheel_tyres import TYRE_KEYS, located, tyre_file, values_of_tyres
from bicycle.parameters.bicycle import BOUNDS, HEAD_ANGLE, UNITS, Bicycle, canonical
from bicycle.parameters.parameter_covariance import WHEELS, ParameterKey, checked_covariance, entries_of
from studies.model_space.axes import bounds_of
from studies.model_space.command_options import check_memory
from studies.model_space.model_argument import find_bicycle
from studies.model_space.outputs import OUTPUTS
from studies.model_space.sampling import possible_moments
from studies.sweep.specification import BICYCLE, SPEED, TYRE_UNITS, GridAxis, Normal, Sweep, Uniform
from tyre.formats.sheet import split_row
from tyre.ground import schema
from tyre.ground.errors import InputError, refuse_unknown, shown
from tyre.ground.files import read_toml

NAMES = ("tyre", "surface")  # varied by name, not by number
RANGE_KEYS, DISTRIBUTIONS = ("from", "to", "count"), ({"low", "high"}, {"mean", "sd"}, {"sd"})
FINITE, SD = schema.number(), schema.number(least=0, says="must be >= 0")
NAMED = schema.text("must be a name in quotes")


def _model_of(content: Any) -> Any:
    if not isinstance(content, str | Mapping):
        raise schema.refusal(content, "must be a model file or a table like the content of one")
    return content


def _each_once(content: Any) -> tuple[float, ...]:
    quantiles = schema.list_of(schema.number(), "must be a list such as [0.05, 0.5, 0.95]", least=1, strict=False)(
        content
    )
    impossible = [share for share in quantiles if not 0 <= share <= 1]
    if impossible:
        raise schema.remarked(f"holds {impossible[0]:g}; give numbers from 0 to 1")
    if len(set(quantiles)) < len(quantiles):
        raise schema.remarked("holds a value twice; give each once")
    return tuple(quantiles)


def sweep_table() -> schema.Table:
    """The keys of a sweep file, with the outputs that are declared by now."""
    advice = f"give a list of {', '.join(OUTPUTS)}"
    return schema.table(
        {
            schema.needed("model", "model is missing: give a model file or a table like the content of one"): _model_of,
            schema.needed("outputs", f"outputs is missing: {advice}"): schema.list_of(
                schema.name_in("output", OUTPUTS), f"must hold at least one: {advice}", least=1, strict=False
            ),
            schema.maybe("samples", 1): schema.whole_number(least=1),
            schema.maybe("seed", 0): schema.whole_number(least=0),
            schema.maybe("max_speed_m_s", 60.0): schema.number(above=0, says="must be above 0 m/s"),
            schema.maybe("points_per_part", 65536): schema.whole_number(least=1),
            schema.maybe("grid", {}): schema.any_table,
            schema.maybe("sampled", {}): schema.any_table,
            schema.maybe("reduce"): schema.table(
                {schema.maybe("quantiles", [0.05, 0.5, 0.95]): _each_once}, kind="key of reduce:"
            ),
        }
    )


OPTIONS = schema.table(  # keys of [sampled] beside the distributions of parameters
    {
        schema.maybe("bicycle_sd", False): schema.flag,
        schema.maybe("tyre_covariance", False): schema.flag,
        schema.maybe("relative_cornering_stiffness_sd", 0.0): schema.number(
            least=0, says="must be >= 0 (0.02 is 2 % of C_alpha)"
        ),
        schema.maybe("joint", []): schema.list_of(
            schema.any_table, "must be a list of tables: write [[sampled.joint]], parameters and covariance"
        ),
    },
    others=True,
)

JOINT = schema.table(
    {
        schema.needed("parameters", "parameters is missing; give a list of names and their covariance"): schema.list_of(
            NAMED, "must be a list of names", least=1
        ),
        schema.maybe("covariance", []): schema.anything,
        schema.maybe("mean"): schema.anything,
    },
    kind="key of sampled.joint:",
)


def read_sweep(path: str | Path) -> Sweep:
    """Read a sweep file, TOML; files it names are relative to it."""
    path = Path(path)
    content = read_toml(path, "sweep file")
    try:
        return build_sweep(content, folder=path.parent)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def build_sweep(content: Mapping[str, Any], *, folder: Path = Path()) -> Sweep:
    """Build a sweep from the content of a sweep file; files it names are relative to ``folder``."""
    settings = schema.read(sweep_table(), content, dotted=True)
    grid, sampled = dict(settings["grid"]), dict(settings["sampled"])
    model_content, model_folder = _read_model(settings["model"], folder)
    bicycles: tuple[Bicycle, ...] = ()
    if BICYCLE in grid:
        bicycles = _bicycle_axis(grid.pop(BICYCLE), folder, allow_unusual=allows_unusual(model_content))
        model_content = {"bicycle": _parameters_of(bicycles[0])} | dict(model_content)
    nominal = build_model(model_content, folder=model_folder)
    model = _locate_files(model_content, nominal, model_folder)
    effects = model.get("effects", {})
    tyre = _find_tyre(effects)

    allowed = variable_names(nominal, values_of_tyres(effects))
    axes, speeds = _read_grid(grid, allowed, folder)
    options = schema.read(OPTIONS, sampled, section="sampled", dotted=True)
    bicycle_sd = _stated_sd(bicycles) if bicycles and options["bicycle_sd"] else {}
    if bicycles:
        sampled.pop("bicycle_sd", None)
    normals, uniforms = _Sampled(allowed, nominal, tyre or {}).read(sampled, [axis.name for axis in axes])
    if bicycles:
        axes = (GridAxis(BICYCLE, tuple(bicycle.name for bicycle in bicycles)), *axes)
    if not allows_unusual(model):
        _refuse_absurd(nominal, axes, normals, uniforms)
    _check_tyre_options(options, tyre)

    sweep = Sweep(
        model=model,
        axes=axes,
        speeds=speeds,
        samples=settings["samples"],
        seed=settings["seed"],
        normals=normals,
        uniforms=uniforms,
        tyre_covariance=options["tyre_covariance"],
        relative_cornering_stiffness_sd=options["relative_cornering_stiffness_sd"],
        outputs=tuple(dict.fromkeys(settings["outputs"])),
        max_speed=settings["max_speed_m_s"],
        quantiles=settings["reduce"]["quantiles"] if "reduce" in settings else None,
        points_per_part=settings["points_per_part"],
        bicycles={bicycle.name: _parameters_of(bicycle) for bicycle in bicycles},
        bicycle_sd=bicycle_sd,
    )
    _check_samples(sweep)
    _check_varied(sweep)
    return sweep


def _read_model(model: Any, folder: Path) -> tuple[Mapping[str, Any], Path]:
    """Content of a model and the folder that its files are relative to.

    ``model`` is a table, a model or bicycle file in ``folder``, or the name of a packaged one.
    """
    if not isinstance(model, str):
        return model, folder
    path = folder / model
    if path.suffix and not path.is_file():
        return read_toml(path, "model file", where=f"model = {path.as_posix()!r}"), path.parent  # refused
    text = path.as_posix() if path.is_file() else model
    try:
        bicycle = find_bicycle(text)
    except InputError as error:
        raise InputError(f"model = {text!r}: {error}") from error
    content = model_content(text) if bicycle is None else {"bicycle": bicycle}
    return content, path.parent


def _parameters_of(bicycle: Bicycle) -> dict[str, float]:
    """Parameters of a bicycle by key, SI."""
    return {key: bicycle[key] for key in UNITS}


def _locate_files(content: Mapping[str, Any], nominal: Model, folder: Path) -> dict[str, Any]:
    """Content of a model file with the parameters of its bicycle in place of its name, and absolute paths of tyres."""
    model = {key: value for key, value in content.items() if key != "description"}
    model["bicycle"] = _parameters_of(nominal.bicycle)
    if "effects" in model:
        model["effects"] = {
            name: locate_rider(located(table, folder), folder) for name, table in model["effects"].items()
        }
    return model


def _find_tyre(effects: Mapping[str, Mapping[str, Any]]) -> Mapping[str, Any] | None:
    """Table of the effect that names a measured tyre; None if none does."""
    for table in effects.values():
        if any(key in table for key in TYRE_KEYS):
            return table
    return None


def _refuse_absurd(
    nominal: Model, axes: tuple[GridAxis, ...], normals: tuple[Normal, ...], uniforms: tuple[Uniform, ...]
) -> None:
    """Refuse values of the grid, ends and means of distributions that no bicycle has."""
    numbers = {axis.name: axis.values for axis in axes}
    numbers |= {uniform.name: (uniform.low, uniform.high) for uniform in uniforms}
    for normal in normals:
        numbers |= {name: (mean,) for name, mean in zip(normal.names, normal.mean, strict=True)}
    refuse_absurd_values(nominal, numbers)


def _check_tyre_options(options: Mapping[str, Any], tyre: Mapping[str, Any] | None) -> None:
    """Refuse options of drawn tyres that do nothing."""
    if options["tyre_covariance"] and tyre is None:
        raise InputError("sampled.tyre_covariance needs a measured tyre: give tyre and pressure_bar in the model file")
    if options["relative_cornering_stiffness_sd"] and not options["tyre_covariance"]:
        raise InputError("sampled.relative_cornering_stiffness_sd does nothing without tyre_covariance = true")


def _check_samples(sweep: Sweep) -> None:
    if sweep.random and sweep.samples < 2:
        raise InputError(
            f"parameters are sampled, but samples = {sweep.samples} (default 1) is too few; give two or "
            "more, for example samples = 1000"
        )
    if not sweep.random and sweep.samples > 1:
        raise InputError(f"samples = {sweep.samples}, but nothing is sampled; add [sampled] or leave it out")
    # matrices of one bicycle at all its speeds, their roots and vectors, complex
    check_memory(f"speeds of grid.{SPEED}", len(sweep.speeds), 64 * sweep.nominal.linear_model().order ** 2)
    if sweep.items > 10**9:
        raise InputError(f"the sweep has {sweep.items:.3g} bicycles; at most 1e+09 are allowed")
    if sweep.quantiles is None:
        return
    if not sweep.random:
        raise InputError("[reduce] makes quantiles over samples, but nothing is sampled; leave it out")
    for name in sweep.outputs:
        if not OUTPUTS[name].reducible:
            reducible = ", ".join(output.name for output in OUTPUTS.values() if output.reducible)
            raise InputError(f"{name} cannot be reduced over samples; with [reduce] ask for {reducible}")


def _check_varied(sweep: Sweep) -> None:
    varied = [*sweep.varied, *([SPEED] if sweep.speeds else [])]
    twice = [name for name in varied if varied.count(name) > 1]
    if twice:
        raise InputError(f"{twice[0]} is varied twice; keep one of grid, sampled and joint")
    for name in varied:
        wheels = entries_of(name, set(varied) - {name})
        if wheels:
            raise InputError(f"{name} and {wheels[0]} are both varied; give both wheels together or each on its own")
    of_bicycles = [name for name in varied if sweep.bicycles and name in UNITS]
    if of_bicycles:
        raise InputError(
            f"{of_bicycles[0]} is varied, but each bicycle of grid.{BICYCLE} has its own; leave one of them out"
        )
    by_speed = [name for name in sweep.outputs if OUTPUTS[name].by_speed]
    if by_speed and SPEED not in varied:
        raise InputError(f"{by_speed[0]} need speeds: add grid.{SPEED}, for example {{from = 0, to = 20, count = 201}}")
    if SPEED in varied and not by_speed:
        raise InputError(f"{SPEED} is varied, but {', '.join(sweep.outputs)} do not depend on it; leave it out")


def _bicycle_axis(value: Any, folder: Path, *, allow_unusual: bool) -> tuple[Bicycle, ...]:
    """The bicycles of ``[grid] bicycle = "bicycles.csv"``."""
    if not isinstance(value, str) or not is_bicycle_table(value) or split_row(value)[1]:
        raise InputError(f'grid.{BICYCLE} = {shown(value)}: give a table of bicycles, for example "bicycles.csv"')
    return tuple(read_bicycles(Path(bicycle_place(value, folder)), allow_unusual=allow_unusual))


def _stated_sd(bicycles: tuple[Bicycle, ...]) -> dict[str, dict[str, float]]:
    """Standard deviations (SI) above 0 that the bicycles of a table state, by name and key."""
    sd_of_bicycles = {b.name: {key: sd for key, sd in b.sd.items() if sd > 0 and key in UNITS} for b in bicycles}
    if not any(sd_of_bicycles.values()):
        raise InputError(f"sampled.bicycle_sd: no bicycle of grid.{BICYCLE} states standard deviations")
    for bicycle in bicycles:
        for key, sd in sd_of_bicycles[bicycle.name].items():
            possible_moments(f"bicycle {bicycle.name}: {key}", bicycle[key], sd, BOUNDS[key])
    return sd_of_bicycles


def variable_names(model: Model, of_tyres: Collection[str]) -> set[str]:
    """Names that can be varied; ``taken`` are the parameters that a tyre gives, of which the contact law's cannot."""
    names = {*UNITS, SPEED} | {
        f"{effect.identifier}.{key}"
        for effect in model.effects
        for parameter in effect.parameters
        if effect.slot != "contact law" or f"{effect.identifier}.{parameter.entries()[0]}" not in of_tyres
        for key in (parameter.name, *parameter.entries())
    }
    of_tyre = {str(ParameterKey("", key, wheel)) for key in TYRE_UNITS for wheel in ("", *WHEELS)}
    return names | of_tyre if of_tyres else names


def _read_grid(content: Any, allowed: set[str], folder: Path) -> tuple[tuple[GridAxis, ...], tuple[float, ...]]:
    """Axes of the grid, and the speeds (m/s) apart from them."""
    axes, speeds = [], ()
    for name, value in _leaves(content, allowed):
        refuse_unknown("parameter", [name], allowed)
        values = _axis_values(name, value)
        if ParameterKey.parse(name).name == "tyre":
            values = tuple(tyre_file(tyre, folder) for tyre in values)
        if len(set(values)) < len(values):
            raise InputError(f"grid.{name} holds a value twice; give each once")
        if name != SPEED:
            axes.append(GridAxis(name, values))
        elif min(values) < 0:
            raise InputError(f"grid.{SPEED} holds {min(values):g}; give speeds >= 0 m/s")
        else:
            speeds = values
    return tuple(axes), speeds


def _leaves(content: Mapping[str, Any], allowed: set[str], start: str = "") -> Iterator[tuple[str, Any]]:
    """Parameters by full name; ``[grid.relaxation_length]`` and a quoted ``"relaxation_length.x"`` are the same."""
    leaf_keys = {*RANGE_KEYS, "mean", "sd", "low", "high"}
    for key, value in content.items():
        name = start + key
        inner = isinstance(value, Mapping) and value and not set(value) & leaf_keys
        if inner and any(allowed_name.startswith(f"{name}.") for allowed_name in allowed):
            yield from _leaves(value, allowed, f"{name}.")
        elif name == HEAD_ANGLE and isinstance(value, list):
            yield "lam", np.radians(90 - np.array(value, float)).tolist()
        else:
            yield canonical(name), value


def _axis_values(name: str, value: Any) -> tuple[Any, ...]:
    if isinstance(value, Mapping):
        count = schema.whole_number(least=1 if value.get("from") == value.get("to") else 2, most=10**6)
        checks = dict(zip(RANGE_KEYS, (FINITE, FINITE, count), strict=True))
        declared = {
            schema.needed(k, f"{k} is missing; write {{from = 0, to = 20, count = 201}}"): c for k, c in checks.items()
        }
        ends = schema.read(
            schema.table(declared, kind=f"key of grid.{name}:"), value, section=f"grid.{name}", dotted=True
        )
        value = np.linspace(ends["from"], ends["to"], ends["count"]).tolist()
    if not isinstance(value, list) or not value:
        raise InputError(f"grid.{name} = {shown(value)}: give a list of values or {{from, to, count}}")
    entry = NAMED if ParameterKey.parse(name).name in NAMES else FINITE
    return tuple(schema.read(entry, v, section=f"grid.{name}", dotted=True) for v in value)


class _Sampled:
    """Reader of ``[sampled]``: names that can be varied, the model with means and bounds, the table of its tyre."""

    def __init__(self, allowed: set[str], model: Model, tyre: Mapping[str, Any]) -> None:
        self.allowed, self.model, self.tyre = allowed, model, tyre

    def read(
        self, content: Mapping[str, Any], elsewhere: Collection[str]
    ) -> tuple[tuple[Normal, ...], tuple[Uniform, ...]]:
        """Distributions of the table; ``elsewhere`` are names that are varied outside it."""
        options = schema.read(OPTIONS, content, section="sampled", dotted=True)
        leaves = _leaves({k: v for k, v in content.items() if k not in OPTIONS.keys}, self.allowed)
        distributions = [self._read_distribution(name, value) for name, value in leaves]
        normals = [distribution for distribution in distributions if isinstance(distribution, Normal)]
        uniforms = [distribution for distribution in distributions if isinstance(distribution, Uniform)]
        joint = [self._read_joint(entry) for entry in options["joint"]]
        if options["bicycle_sd"]:
            varied = {
                *elsewhere,
                *(u.name for u in uniforms),
                *(name for distribution in (*normals, *joint) for name in distribution.names),
            }
            single, together = self._read_stated(varied)
            normals, joint = normals + single, joint + [self._read_joint(entry) for entry in together]
        return (*normals, *joint), tuple(uniforms)

    def _read_distribution(self, name: str, value: Any) -> Normal | Uniform:
        self._check_name(name)
        if not isinstance(value, Mapping) or set(value) not in DISTRIBUTIONS:
            raise InputError(f"sampled.{name} = {shown(value)}: give {{mean, sd}}, {{sd}} or {{low, high}}")
        declared = schema.table({schema.needed(key): SD if key == "sd" else FINITE for key in value})
        numbers = schema.read(declared, value, section=f"sampled.{name}", dotted=True)
        bounds = bounds_of(self.model, name)
        if "low" in numbers:
            if not numbers["low"] < numbers["high"]:
                raise InputError(f"sampled.{name}: low = {numbers['low']:g} must be below high = {numbers['high']:g}")
            for key, end in numbers.items():
                if not bounds[0] <= end <= bounds[1]:
                    raise InputError(f"sampled.{name}: {key} = {end:g} is outside {bounds[0]:g} .. {bounds[1]:g}")
            return Uniform(name, numbers["low"], numbers["high"])
        mean = numbers["mean"] if "mean" in numbers else self._nominal(name)
        possible_moments(f"sampled.{name}", mean, numbers["sd"], bounds)
        return Normal((name,), (mean,), ((numbers["sd"],),))

    def _read_stated(self, varied: set[str]) -> tuple[list[Normal], list[dict[str, Any]]]:
        """Deviations that the bicycle's file states one by one, and those stated together by it or the model."""
        model = self.model
        covariance = model.covariance
        together = {k for k in covariance.names if covariance.origin_of(k) == MODEL_FILE}
        together |= set(model.bicycle.covariance.names)
        sd = {
            key: value for key, value in model.bicycle.sd.items() if value > 0 and key in UNITS and key not in together
        }
        if not sd and not any(covariance.sd[key] for key in together):
            raise InputError(
                f"sampled.bicycle_sd: bicycle {model.bicycle.name!r} states no standard deviations; give them in its "
                "file ([sd]), in [covariance] of the model file, or of single parameters here, such as c = {sd = 0.003}"
            )
        single = [Normal((key,), (model.bicycle[key],), ((value,),)) for key, value in sd.items() if key not in varied]
        names = [
            k
            for k, value in covariance.sd.items()
            if value > 0 and k in together and not varied & {k, str(ParameterKey.parse(k).whole)}
        ]
        joint = [{"parameters": names, "covariance": covariance.among(names).tolist()}] if names else []
        return single, joint

    def _read_joint(self, entry: Mapping[str, Any]) -> Normal:
        table = schema.read(JOINT, entry, section="sampled.joint", dotted=True)
        names = [canonical(name) for name in table["parameters"]]
        for name in names:
            self._check_name(name)
        where, size = f"sampled.joint of {', '.join(names)}", len(names)
        row = schema.list_of(FINITE, f"must be {size} numbers", least=size, most=size)
        square = schema.list_of(row, f"must be {size} x {size} numbers", least=size, most=size)
        rows = schema.read(square, table["covariance"], where=where, section="covariance")
        try:
            covariance = checked_covariance(names, rows)
        except InputError as error:
            raise InputError(f"sampled.joint: {error}") from error
        one_each = schema.list_of(
            FINITE, "; give a list of one number per parameter", least=size, most=size, strict=False
        )
        means = table.get("mean") or [self._nominal(name) for name in names]
        means = schema.read(one_each, means, where=where, section="mean", dotted=True)
        for name, value, variance in zip(names, means, np.diag(covariance), strict=True):
            sd = float(np.sqrt(max(variance, 0.0)))
            possible_moments(f"sampled.joint: {name}", value, sd, bounds_of(self.model, name))
        return Normal(tuple(names), tuple(means), _root(covariance))

    def _check_name(self, name: Any) -> None:
        refuse_unknown("parameter", [name], self.allowed)
        if ParameterKey.parse(name).name in NAMES:
            raise InputError(f"sampled {name}: a name cannot be sampled; list names in [grid]")

    def _nominal(self, name: str) -> float:
        pressure = self.tyre.get("pressure_bar", {})
        per_wheel = pressure if isinstance(pressure, Mapping) else dict.fromkeys(WHEELS, pressure)
        values = {**self.model.parameters, **{f"pressure_bar.{wheel}": value for wheel, value in per_wheel.items()}}
        candidates = {values[key] for key in entries_of(name, values)}
        if len(candidates) == len(WHEELS):
            rear, front = (values[f"{name}.{wheel}"] for wheel in WHEELS)
            raise InputError(
                f"sampled {name}: mean is missing; the model has {rear:g} at the rear and {front:g} at the front "
                f"wheel, so give {name}.rear and {name}.front"
            )
        if len(candidates) != 1:
            raise InputError(f"sampled {name}: mean is missing; the model has no single value of it")
        return float(candidates.pop())


def _root(covariance: Any) -> tuple[tuple[float, ...], ...]:
    """Square root of a covariance, of its correlations so that units do not matter."""
    sd = np.sqrt(np.diag(covariance))
    scale = np.where(sd > 0, sd, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return tuple(map(tuple, (sd[:, None] * vectors * np.sqrt(np.maximum(values, 0))).tolist()))
