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

    bicycle = "bicycles.csv"                    # every bicycle of a table, in place of the model's

    [sampled]
    bicycle_sd = true                           # what the bicycle file states
    tyre_covariance = true                      # what the tyre map states, both wheels together
    relative_cornering_stiffness_sd = 0.03      # assumed, for tables that state none
    c = {sd = 0.005}                            # normal around the model's value, or {mean, sd}
    mB = {low = 70, high = 100}                 # uniform
    joint = [{parameters = ["xB", "zB"], covariance = [[1e-4, 2e-5], [2e-5, 1e-4]]}]

    [reduce]                                    # keep quantiles and extremes over the samples, not the samples
    quantiles = [0.05, 0.5, 0.95]
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bicycle.files.model_file import allows_unusual, build_model, refuse_absurd_values
from bicycle.files.tyre_values import values_of_tyres
from bicycle.files.wheel_tyres import TYRE_KEYS, located
from bicycle.model import Model
from bicycle.parameter_key import entries_of
from bicycle.parameters import UNITS, Bicycle
from studies.sweeps.many_bicycles import BICYCLE, read_bicycle_axis, stated_sd
from studies.sweeps.spec import BY_SPEED, OUTPUTS, SPEED, Axis, Sweep
from studies.sweeps.variation import read_grid, read_options, read_sampled, variable_names
from tyre.base.checks import any_table, known, list_of, number, refused, remarked, whole
from tyre.base.errors import InputError
from tyre.base.schema import maybe, needed, read, table
from tyre.base.toml_file import read_toml

REDUCIBLE = ("largest_growth_rate", "smallest_damping_ratio", "frequencies", "damping_ratios", "critical_speeds")
MOST_BICYCLES = 10**9


def _model_of(given: Any) -> Any:
    if not isinstance(given, str | Mapping):
        raise refused(given, "must be a model file or a table like the content of one")
    return given


def _each_once(given: Any) -> tuple[float, ...]:
    quantiles = list_of(number(), "must be a list such as [0.05, 0.5, 0.95]", least=1, strict=False)(given)
    for share in quantiles:
        if not 0 <= share <= 1:
            raise remarked(f"holds {share:g}; give numbers from 0 to 1")
    if len(set(quantiles)) < len(quantiles):
        raise remarked("holds a value twice; give each once")
    return tuple(quantiles)


REDUCE = table({maybe("quantiles", [0.05, 0.5, 0.95]): _each_once}, kind="key of reduce:")
WANTED = f"give a list of {', '.join(OUTPUTS)}"
SWEEP = table(
    {
        needed("model", "model is missing: give a model file or a table like the content of one"): _model_of,
        needed("outputs", f"outputs is missing: {WANTED}"): list_of(
            known("output", OUTPUTS), f"must hold at least one: {WANTED}", least=1, strict=False
        ),
        maybe("samples", 1): whole(least=1), maybe("seed", 0): whole(least=0),
        maybe("max_speed_m_s", 60.0): number(above=0, says="must be above 0 m/s"),
        maybe("points_per_part", 65536): whole(least=1),
        maybe("grid", {}): any_table, maybe("sampled", {}): any_table, maybe("reduce"): REDUCE,
    }
)  # fmt: skip
TOP_KEYS = SWEEP.keys


def read_sweep(path: str | Path) -> Sweep:
    """Read a sweep file; files it names are relative to it.

    Parameters
    ----------
    path : str or Path
        A TOML file.

    Raises
    ------
    InputError
        No such file, not TOML, an unknown key or parameter, or values that make no sweep.
    """
    path = Path(path)
    content = read_toml(path, "sweep file")
    try:
        return build_sweep(content, folder=path.parent)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def build_sweep(content: Mapping[str, Any], *, folder: Path = Path()) -> Sweep:
    """Build a sweep from the content of a sweep file.

    Parameters
    ----------
    content : mapping
        As read from TOML.
    folder : Path
        What file names are relative to.
    """
    given = read(SWEEP, content, dotted=True)
    grid = dict(given["grid"])
    bicycles: tuple[Bicycle, ...] = ()
    if BICYCLE in grid:
        model_content, model_folder = _model_content(given["model"], folder)
        bicycles = read_bicycle_axis(grid.pop(BICYCLE), folder, allow_unusual=allows_unusual(model_content))
        first = {key: bicycles[0][key] for key in UNITS}
        model, nominal = _model({"bicycle": first} | dict(model_content), model_folder)
    else:
        model, nominal = _model(*_model_content(given["model"], folder))
    tyre = next((t for t in model.get("effects", {}).values() if any(key in t for key in TYRE_KEYS)), None)
    allowed = variable_names(nominal, values_of_tyres(model.get("effects", {})))
    axes, speeds = read_grid(grid, allowed, folder)
    sampled = read_options(given["sampled"])
    own_sd = stated_sd(bicycles) if bicycles and sampled["bicycle_sd"] else None
    others = {k: v for k, v in given["sampled"].items() if not (bicycles and k == "bicycle_sd")}
    normals, uniforms = read_sampled(others, allowed, nominal, tyre or {}, [axis.name for axis in axes])
    axes = (*([Axis(BICYCLE, tuple(one.name for one in bicycles))] if bicycles else []), *axes)
    if not allows_unusual(model):
        refuse_absurd_values(nominal, {axis.name: axis.values for axis in axes})
        refuse_absurd_values(nominal, {u.name: (u.low, u.high) for u in uniforms})
        for normal in normals:
            refuse_absurd_values(nominal, {name: (mean,) for name, mean in zip(normal.names, normal.mean, strict=True)})
    covariance, relative = sampled["tyre_covariance"], sampled["relative_cornering_stiffness_sd"]
    if covariance and tyre is None:
        raise InputError("sampled.tyre_covariance needs a measured tyre: give tyre and pressure_bar in the model file")
    if relative and not covariance:
        raise InputError("sampled.relative_cornering_stiffness_sd does nothing without tyre_covariance = true")
    sweep = Sweep(
        model=model, axes=axes, speeds=speeds, samples=given["samples"], seed=given["seed"],
        normals=normals, uniforms=uniforms, tyre_covariance=covariance, relative_cornering_stiffness_sd=relative,
        outputs=tuple(dict.fromkeys(given["outputs"])), max_speed=given["max_speed_m_s"],
        quantiles=given["reduce"]["quantiles"] if "reduce" in given else None,
        points_per_part=given["points_per_part"],
        bicycles={one.name: {key: one[key] for key in UNITS} for one in bicycles}, bicycle_sd=own_sd or {},
    )  # fmt: skip
    _check_samples(sweep, random=sweep.random)
    _check_varied(sweep)
    return sweep


def _check_samples(sweep: Sweep, *, random: bool) -> None:
    if random and sweep.samples < 2:
        raise InputError(
            f"parameters are sampled, but samples = {sweep.samples} (1 without the key) is no sample; give two or "
            "more, for example samples = 1000"
        )
    if not random and sweep.samples > 1:
        raise InputError(f"samples = {sweep.samples}, but nothing is sampled; add [sampled] or leave it out")
    if sweep.items > MOST_BICYCLES:
        raise InputError(f"the sweep has {sweep.items:.3g} bicycles; at most {MOST_BICYCLES:.0e} are allowed")
    if sweep.quantiles is not None:
        if not random:
            raise InputError("[reduce] makes quantiles over samples, but nothing is sampled; leave it out")
        for output in sweep.outputs:
            if output not in REDUCIBLE:
                raise InputError(
                    f"{output} cannot be reduced over samples; with [reduce] ask for {', '.join(REDUCIBLE)}"
                )


def _check_varied(sweep: Sweep) -> None:
    varied = [*sweep.varied, *([SPEED] if sweep.speeds else [])]
    twice = [name for name in varied if varied.count(name) > 1]
    if twice:
        raise InputError(f"{twice[0]} is varied twice; keep one of grid, sampled and joint")
    for name in varied:
        wheels = entries_of(name, set(varied) - {name})
        if wheels:
            raise InputError(f"{name} and {wheels[0]} are both varied; give both wheels together or each on its own")
    own = [name for name in varied if sweep.bicycles and name in UNITS]
    if own:
        raise InputError(f"{own[0]} is varied, but each bicycle of grid.{BICYCLE} has its own; leave one of them out")
    by_speed = [output for output in sweep.outputs if output in BY_SPEED]
    if by_speed and SPEED not in varied:
        raise InputError(f"{by_speed[0]} need speeds: add grid.{SPEED}, for example {{from = 0, to = 20, count = 201}}")
    if SPEED in varied and not by_speed:
        raise InputError(f"{SPEED} is varied, but {', '.join(sweep.outputs)} do not depend on it; leave it out")


def _model_content(given: Any, folder: Path) -> tuple[Mapping[str, Any], Path]:
    """The content of the model, and what its files are relative to."""
    if not isinstance(given, str):
        return given, folder
    path = folder / given
    return read_toml(path, "model file", where=f"model = {path.as_posix()!r}"), path.parent


def _model(given: Mapping[str, Any], folder: Path) -> tuple[dict[str, Any], Model]:
    """The model's content with the bicycle as numbers, and the model with the bicycle's standard deviations."""
    nominal = build_model(given, folder=folder)
    bicycle = {key: nominal.bicycle[key] for key in UNITS}
    content = {key: value for key, value in given.items() if key != "description"} | {"bicycle": bicycle}
    if "effects" in content:
        content["effects"] = {name: located(table, folder) for name, table in content["effects"].items()}
    return content, nominal
