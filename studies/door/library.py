"""Studies in a line of Python: what the commands do, with arrays for parameters and labelled arrays as results."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bicycle.files.bicycle_numbers import covariance_table, model_table
from bicycle.model.model import DEFAULT_CONTACT, Model
from bicycle.parameters.bicycle import Bicycle, by_key
from bicycle.parameters.parameter_covariance import ParameterCovariance
from tyre.ground.errors import InputError, shown
from tyre.measured.plausible import WAY_OUT

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    import pandas as pd
    from numpy.typing import ArrayLike

    from bicycle.model.inputs import InputHistory
    from bicycle.model.state_space import LinearModel
    from bicycle.motion.limit_cycles import LimitCycles
    from bicycle.motion.nonlinear import CurveTyre, MagicTyre
    from bicycle.motion.responses import Response
    from bicycle.stability.critical import CriticalSpeed
    from bicycle.stability.named_modes import Modes
    from studies.chart.chart import StabilityChart
    from studies.design.design import Design
    from studies.motion.locus import RootLocus

    AnyModel = Model | Bicycle | str | Path | Mapping[str, Any]


def content_of(model: AnyModel) -> dict[str, Any]:
    """Content of the model file that says the same as a ``model``: a name, a file, a bicycle, a model or a content."""
    from studies.model_space.model_argument import choose

    if isinstance(model, Bicycle):
        model = Model(model)
    if isinstance(model, Model):
        effects = {e.identifier: e for e in model.effects if e.identifier != DEFAULT_CONTACT}
        tables = {name: e.table for name, e in effects.items()}
        content: dict[str, Any] = {"bicycle": model_table(model.bicycle), WAY_OUT: True, "effects": tables}
        return content | covariance_table(_beside_bicycle(model))
    if hasattr(model, "state_matrix"):
        raise InputError("a LinearModel has no parameters any more; give the Model it was made of")
    if hasattr(model, "keys"):
        return dict(model)  # type: ignore[arg-type]
    if not isinstance(model, str) and not hasattr(model, "joinpath"):
        raise InputError(f"{shown(model)} is no model; give a bicycle's name, a file, a Bicycle or a Model")
    return dict(choose(str(model)).content)


def _beside_bicycle(model: Model) -> ParameterCovariance:
    """Covariance of the parameters that a model states in addition to its bicycle's, with uncorrelated sd."""
    uncorrelated = {name: sd for name, sd in model.sd.items() if name not in model.covariance.names}
    together = [name for name in model.covariance.names if name not in model.bicycle.covariance.names]
    variances = [0.0] * len(together) + [sd**2 for sd in uncorrelated.values()]
    names = (*together, *uncorrelated)
    return ParameterCovariance(names, model.covariance.among(names) + np.diag(variances))


def model_of(model: AnyModel) -> Model:
    """The model of a name, a file, a bicycle or a content; a ``model`` as it is."""
    from bicycle.model.model_file import build_model

    return model if isinstance(model, Model) else build_model(content_of(model))


def _linear(model: Any) -> LinearModel:
    return model if hasattr(model, "state_matrix") else model_of(model).linear_model()


def sweep(
    model: AnyModel,
    outputs: str | Iterable[str],
    numbers: Mapping[str, ArrayLike] | None = None,
    *,
    speeds: ArrayLike | None = None,
    samples: int = 1,
    seed: int = 0,
    sampled: Mapping[str, Any] | None = None,
    max_speed: float = 60.0,
    **more: ArrayLike,
) -> Any:
    """Compute outputs of all combinations of some numbers of a model, in memory.

    >>> found = sweep("benchmark", "max_growth_rate", speeds=[3, 5], trail=[0.06, 0.08])
    >>> found.max_growth_rate.sel(c=0.08, speed_m_s=5).item().__round__(4)
    -0.3229

    Parameters
    ----------
    model : str, Path, Bicycle, Model or mapping
        A packaged bicycle, a file, or what a model file holds.
    outputs : str or iterable of str
        Names as in docs/sweeps.md, such as ``"modes"``, ``"critical_speeds"``, ``"max_growth_rate"``.
    numbers, **more : array_like, shape (k,)
        Parameters that run, SI, by key (``c`` or ``trail``) or ``effect.parameter``; one number stays one bicycle.
        ``bicycle="many.csv"`` takes the bicycles of a table.
    speeds : array_like, shape (m,)
        m/s.
    samples, seed : int
        Number of samples in each combination, and the seed, no unit.
    sampled : mapping
        What is drawn, as the table ``[sampled]`` of a sweep file.
    max_speed : float
        Highest critical speed, m/s.

    Returns
    -------
    xarray.Dataset
        Dimensions named by keys, ``speed_m_s``, and those of the outputs; ``attrs["units"]`` of each variable.

    Raises
    ------
    InputError
        An unknown name, a bicycle that cannot be, or more than memory holds.
    """
    from bicycle.model.model_file import build_model
    from studies.model_space.command_options import check_memory
    from studies.sweep.file import build_sweep
    from studies.sweep.parts import pieces
    from studies.sweep.result import label_rows
    from studies.sweep.worker import compute
    from tyre.ground.progress import optional_module

    optional_module("xarray", extra="sweeps")
    runs = by_key({**(numbers or {}), **more})
    content: dict[str, Any] = {
        "model": content_of(model),
        "outputs": [outputs] if isinstance(outputs, str) else list(outputs),
        "grid": {k: v if isinstance(v, str) else np.atleast_1d(v).tolist() for k, v in runs.items()},
        "samples": samples,
        "seed": seed,
        "sampled": dict(sampled or {}),
        "max_speed_m_s": max_speed,
    }
    if speeds is not None:
        content["grid"]["speed_m_s"] = np.atleast_1d(_numbers("speeds", speeds)).tolist()
    plan = build_sweep(content)
    check_memory("points", plan.items * plan.points_per_item, 64 * build_model(plan.model).linear_model().order)
    parts = [compute(plan, *piece) for piece in pieces(plan, max(1, 65536 // plan.points_per_item))]
    data = label_rows(plan, {name: np.concatenate([part[name] for part in parts]) for name in parts[0]})
    single = [key for key, value in runs.items() if not np.ndim(value) and not isinstance(value, str)]
    return data.squeeze(single)


def _numbers(name: str, values: ArrayLike) -> Any:
    try:
        return np.asarray(values, float)
    except (TypeError, ValueError):
        raise InputError(f"{name} = {shown(values)}: give numbers") from None


def modes(
    model: AnyModel | LinearModel,
    speeds: ArrayLike,
    numbers: Mapping[str, ArrayLike] | None = None,
    **more: ArrayLike,
) -> Modes | Any:
    """Eigenvalues, frequencies and damping ratios of the named modes; with arrays for parameters of many bicycles.

    >>> modes("benchmark", [4.0, 5.0]).frequency("weave").round(3)
    array([0.49 , 0.711])
    >>> modes("benchmark", 5.0, trail=np.linspace(0.06, 0.08, 3)).frequency.sel(mode="weave").values.round(3)
    array([0.727, 0.718, 0.711])

    Parameters
    ----------
    model : str, Path, Bicycle, Model, LinearModel or mapping
        A packaged bicycle, a file, or what a model file holds.
    speeds : array_like, shape (m,)
        m/s.
    numbers, **more : array_like, shape (k,)
        Parameters that run, SI, as in :func:`sweep`.

    Returns
    -------
    Modes, or xarray.Dataset with numbers
        ``eigenvalue`` (1/s; of two real roots the larger), ``frequency`` (Hz) and ``damping_ratio`` over the numbers,
        ``speed`` and ``mode``; a single speed has no dimension.
    """
    from bicycle.stability.named_modes import modes as modes_of_one

    if not numbers and not more:
        return modes_of_one(_linear(model), _numbers("speeds", speeds))
    any_model: Any = model  # a LinearModel is refused there
    data = sweep(any_model, ["modes", "frequencies", "damping_ratios"], {**(numbers or {}), **more}, speeds=speeds)
    names = {"modes": "eigenvalue", "frequencies": "frequency", "damping_ratios": "damping_ratio", "speed_m_s": "speed"}
    data = data.rename(names).drop_vars(["tyre_extrapolated", "impossible"], errors="ignore")
    has_root = np.isfinite(data.eigenvalue).any([dim for dim in data.eigenvalue.dims if dim != "mode"])
    return data.sel(mode=has_root).squeeze([] if np.ndim(speeds) else "speed")


def critical_speeds(
    model: AnyModel | LinearModel,
    max_speed: float = 60.0,
    numbers: Mapping[str, ArrayLike] | None = None,
    **more: ArrayLike,
) -> tuple[CriticalSpeed, ...] | Any:
    """Speeds at which a mode becomes stable or unstable; with arrays for parameters those of many bicycles.

    >>> critical_speeds("benchmark")[0]
    <CriticalSpeed 4.29238 m/s: weave stabilising at 0.5467 Hz>

    Parameters
    ----------
    model : str, Path, Bicycle, Model, LinearModel or mapping
        A packaged bicycle, a file, or what a model file holds.
    max_speed : float
        m/s.
    numbers, **more : array_like, shape (k,)
        Parameters that run, SI, as in :func:`sweep`.

    Returns
    -------
    tuple of CriticalSpeed, or xarray.DataArray with numbers
        In m/s, over the numbers, ``crossing_mode``, ``as_speed_grows`` and ``occurrence``, NaN for none.
    """
    from bicycle.stability.critical import critical_speeds as speeds_of_one
    from studies.model_space.lasting_motions import with_onsets

    if not numbers and not more:
        crossings = speeds_of_one(_linear(model), max_speed)
        return (
            crossings if hasattr(model, "state_matrix") else with_onsets(model_of(model), content_of(model), crossings)
        )
    any_model: Any = model  # a LinearModel is refused there
    return sweep(any_model, "critical_speeds", {**(numbers or {}), **more}, max_speed=max_speed).critical_speeds


def limit_cycles(
    model: AnyModel,
    *,
    rear: MagicTyre | CurveTyre | None = None,
    front: MagicTyre | CurveTyre | None = None,
    max_speed: float = 60.0,
    dry_friction: float = 0.0,
) -> LimitCycles:
    """Find the periodic motions of a bicycle on tyres that saturate, from its critical speeds on.

    >>> front = {"stiffness": 4000, "damping": 12, "joint_x": 0.86, "joint_z": -0.65}
    >>> tyres = {"tyre": "Tyre1", "pressure_bar": 5.5}
    >>> effects = {"relaxation_length": tyres, "front_compliance": front}
    >>> found = limit_cycles({"bicycle": "pista_charlie_drops", "effects": effects}, max_speed=20.0)
    >>> found.frame([10.0])["steer_amplitude_deg"].round(2).tolist()
    [10.29]

    Parameters
    ----------
    model : str, Path, Bicycle, Model or mapping
        A model on the effect ``relaxation_length``, a file, or what a model file holds.
    rear, front : MagicTyre or CurveTyre
        Curves of the tyres, by default those of the tyre file, else the Magic Formula with D = 0.8, C = 1.3, E = 0.
    max_speed : float
        m/s, up to which critical speeds are looked for and motions followed.
    dry_friction : float
        Torque (N m) of dry friction in the steering: no critical speed is left, and branches close.

    Returns
    -------
    bicycle.motion.limit_cycles.LimitCycles
        ``frame(speeds)`` tabulates amplitude, frequency and stability.

    Raises
    ------
    InputError
        No model, tyres that do not saturate, wheel loads or equations that change with the speed, or friction below 0.
    """
    from bicycle.motion.limit_cycles import find_limit_cycles
    from studies.model_space.lasting_motions import curves_of

    tyre_curves = curves_of(content_of(model))
    rear, front = rear or tyre_curves.get("rear"), front or tyre_curves.get("front")
    return find_limit_cycles(model_of(model), rear=rear, front=front, max_speed=max_speed, dry_friction=dry_friction)


def root_locus(model: AnyModel, parameter: str, values: ArrayLike, *, speed: float | None = None) -> RootLocus:
    """Follow every root as one parameter runs; where it crosses the imaginary axis.

    >>> found = root_locus("benchmark", "speed", np.linspace(1, 8, 50))
    >>> [(one.mode, round(one.value, 4)) for one in found.crossings]
    [('weave', 4.2924), ('capsize', 6.0243)]

    Parameters
    ----------
    model : str, Path, Bicycle, Model or mapping
        A packaged bicycle, a file, or what a model file holds.
    parameter : str
        Key (``c`` or ``trail``), ``effect.parameter``, ``speed``, ``pressure_bar`` or ``load_N``.
    values : array_like, shape (m,)
        Rising values, SI or bar.
    speed : float
        m/s, unless the speed runs.

    Returns
    -------
    RootLocus
        ``eigenvalues`` (m, n) in 1/s, ``names`` of the columns, ``crossings``, and ``frame()`` as a table.
    """
    from studies.motion.locus import parameter_path
    from studies.motion.locus import root_locus as follow

    rising = np.unique(_numbers("values", values))
    if rising.size < 2 or not np.isfinite(rising).all():
        raise InputError(f"values of {parameter}: give two or more finite numbers")
    return follow(parameter_path(content_of(model), parameter, speed=speed), rising)


def sensitivity(
    model: AnyModel, mode: str, speed: float, *, sd: Mapping[str, float] | None = None, max_speed: float = 40.0
) -> pd.DataFrame:
    """Rank the parameters of a model by what one standard deviation does to the growth rate of a mode.

    >>> sensitivity("benchmark", "weave", 5.0).parameter[0]
    'IBxz'

    Parameters
    ----------
    model : str, Path, Bicycle, Model or mapping
        A packaged bicycle, a file, or what a model file holds.
    mode : str
        Name of the mode.
    speed : float
        m/s.
    sd : mapping
        Standard deviations, SI, in place of stated and usual ones.
    max_speed : float
        Highest critical speed whose change is given, m/s.

    Returns
    -------
    DataFrame
        A row per parameter, the largest change first: value, sd, where that comes from, and the changes (1/s, Hz, m/s).
    """
    import pandas as pd

    from studies.model_space.ranking import rank, record

    ranking = rank(model_of(model), mode=mode, speed=speed, given_sd=by_key(sd or {}), max_speed=max_speed)
    return pd.DataFrame(record(ranking)["parameters"])


def uncertainty(
    model: AnyModel,
    speeds: ArrayLike = (),
    *,
    sd: Mapping[str, float] | None = None,
    assume: bool = True,
    samples: int = 2000,
    seed: int = 0,
    max_speed: float = 60.0,
) -> pd.DataFrame:
    """Carry the uncertainty of a model to frequency and damping ratio of its modes and to critical speeds.

    >>> uncertainty("benchmark", sd={"trail": 0.002}, assume=False, samples=200).round(3).linear_sd.tolist()
    [0.023, 0.058]

    Parameters
    ----------
    model : str, Path, Bicycle, Model or mapping
        A packaged bicycle, a file, or what a model file holds.
    speeds : array_like, shape (m,)
        m/s; without any only critical speeds are given.
    sd : mapping
        Standard uncertainties, SI, in addition to those that the model states.
    assume : bool
        Take usual standard deviations for what no source states.
    samples, seed : int
        Number of samples and the seed, no unit.
    max_speed : float
        Highest critical speed, m/s.

    Returns
    -------
    DataFrame
        A row per quantity: value, sd to first order and by Monte Carlo, its 95 % band, how many bicycles do not have
        it, and what causes most of it.
    """
    import pandas as pd

    from studies.uncertainty.propagation import Uncertainty

    of = Uncertainty(content_of(model), sd=by_key(sd or {}), defaults=assume)
    rows = []
    for q in of.quantities(_numbers("speeds", speeds), max_speed=max_speed, samples=samples, seed=seed):
        low, high = q.band()
        cause = max(q.shares, key=lambda name: q.shares[name])
        rows.append(
            {
                "quantity": q.name,
                "unit": q.unit,
                "value": q.value,
                "linear_sd": q.linear_sd,
                "monte_carlo_sd": q.sampled_sd,
                "low": low,
                "high": high,
                "lost": q.lost,
                "main_cause": cause,
                "its_share": q.shares[cause],
            }
        )
    return pd.DataFrame(rows)


def chart(
    model: AnyModel,
    x: str,
    y: str,
    *,
    speed: float | None = None,
    sd: Mapping[str, float] | None = None,
    assume: bool = False,
) -> StabilityChart:
    """Find the exact boundaries between stable and unstable over two numbers of a model.

    >>> sorted(set(chart("benchmark", "speed=3:8", "c=0.07:0.09").frame()["mode"]))
    ['capsize', 'weave']

    Parameters
    ----------
    model : str, Path, Bicycle, Model or mapping
        A packaged bicycle, a file, or what a model file holds.
    x, y : str
        Axes, in SI units: ``"speed=1:10"``, ``"trail"``, ``"front_compliance.stiffness=1000:10000:log"``.
    speed : float
        m/s, unless the speed is an axis.
    sd : mapping
        Standard deviations, SI, for the band of each boundary.
    assume : bool
        Take usual standard deviations for what no source states.

    Returns
    -------
    StabilityChart
        ``boundaries`` with names, ``frame()`` as a table, ``doubts`` in words.
    """
    from studies.chart import Plane, stability_chart

    return stability_chart(Plane.of(content_of(model), x, y, speed=speed), sd=by_key(sd or {}), assume=assume)


def design(
    model: AnyModel,
    keep: Mapping[str, str | float],
    vary: Sequence[str],
    *,
    speeds: tuple[float, float],
    limits: Mapping[str, tuple[float, float]] | None = None,
    sd: Mapping[str, float] | None = None,
    probability: float | None = None,
    samples: int = 1000,
    seed: int = 0,
) -> Design:
    """Find the smallest change of some numbers of a model that keeps modes stable over a range of speed.

    >>> found = design("benchmark", {"weave": "stable"}, ["trail"], speeds=(4.2, 5.5))
    >>> bool(found.after.kept), found.after.x.round(4).tolist()
    (True, [0.0722])

    Parameters
    ----------
    model : str, Path, Bicycle, Model or mapping
        A packaged bicycle, a file, or what a model file holds.
    keep : mapping
        Mode, or ``"all"``, to ``"stable"`` or a minimum damping ratio from 0 to below 1; or one mode to a
        maximum steer amplitude such as ``"2deg"``.
    vary : sequence of str
        Keys, or ``effect.parameter``, of the numbers that may change.
    speeds : (float, float)
        Lowest and highest speed, m/s.
    limits : mapping
        Lowest and highest value of a number, SI.
    sd : mapping
        Standard deviations, SI.
    probability : float
        Share of bicycles, above 0 below 1, that are to keep it.
    samples, seed : int
        Number of samples and the seed, no unit.

    Returns
    -------
    Design
        ``after.kept``, the numbers ``after.x``, and ``content`` of the changed model file, for ``build_model``.
    """
    from bicycle.parameters.bicycle import canonical
    from studies.design import Wishes, demands, find_design, with_effects

    keys = [canonical(key) for key in vary]
    content, _ = with_effects(content_of(model), keys)
    wanted = Wishes(
        {},
        by_key(sd or {}),
        {canonical(key): ends for key, ends in (limits or {}).items()},
        probability=probability,
        samples=samples,
        seed=seed,
    )
    return find_design(content, keys, demands([(mode, str(what)) for mode, what in keep.items()]), speeds, wanted)


def simulate(
    model: AnyModel | LinearModel,
    speed: float,
    *,
    duration: float = 5.0,
    step: float = 0.005,
    initial: Mapping[str, float] | None = None,
    inputs: Mapping[str, InputHistory] | None = None,
) -> Response:
    """Compute the motion from initial states and inputs at one speed.

    >>> simulate("benchmark", 5.0, duration=1.0, initial={"lean": 0.02}).outputs["lean"][-1].round(5)
    np.float64(0.0225)

    Parameters
    ----------
    model : str, Path, Bicycle, Model, LinearModel or mapping
        A packaged bicycle, a file, or what a model file holds.
    speed : float
        m/s.
    duration, step : float
        s.
    initial : mapping
        States at the start, SI, such as lean (rad); the others are 0.
    inputs : mapping
        Input of the model -> its history: :func:`step`, :func:`pulse`, :func:`doublet` of ``velotyre``.

    Returns
    -------
    Response
        ``time`` (s), ``outputs`` by name, ``frame()`` as a table.
    """
    from bicycle.motion.responses import respond

    count = duration / step if step > 0 else np.nan
    if not (1 <= count <= 1e6):
        raise InputError(f"duration = {duration:g} s in steps of {step:g} s: give 1 to a million steps")
    return respond(_linear(model), speed=speed, time=np.arange(round(count) + 1) * step, initial=initial, inputs=inputs)
