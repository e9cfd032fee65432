"""Front frame of a standing bicycle by weighted least squares: one hinge, two joints, or a compliant hold.

Unknown are the logarithm of each stiffness, the height of the hinge above the hub and the time c/k, which is that of
both joints: damping in proportion to stiffness (Rayleigh; one vibration shows one damping ratio only). Numbers of the
bicycle, weights, places and sensors float with their standard uncertainties, so that the covariance contains them.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.special import chdtrc

from bicycle.effects.effect_registry import effect_class
from bicycle.model.default_sd import standard_deviations
from bicycle.model.model import Model
from bicycle.parameters.bicycle import LIGHTEST_RIDDEN
from bicycle.standing.prediction import (
    SUPPORT,
    TYRE,
    TYRE_DAMPING,
    Prediction,
    gain_error,
    load_error,
    place_error,
    point_of,
)
from bicycle.standing.readings import Readings
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError

FRONT, FORK, SADDLE = "front_compliance", "fork_bending", "rider_saddle"
TURNING = ("steer_damper", "steer_spring")  # what acts on a handlebar that is free
FORK_LENGTH = (0.22, 0.08)
"""Assumed height (m) of the fork's joint above the hub and its sd; wobble hardly depends on it."""
ASSUMED_HEIGHT = (0.35, 0.1)
"""Height of the hinge above the hub and its sd (m), assumed where the readings leave it open."""
REACH = 1.959964  # standard uncertainties of a normal number within which 95 % lie
OPEN = 0.8
"""Share of a prior's sd above which the readings leave a number open."""
POOR = 5e-3
"""Probability of chi^2 below which a hypothesis does not fit."""
ROUNDS = 4  # of a fit, each with the noise about the end of the one before
WORSE = 6.0  # chi^2 above the best, up to which another minimum is an answer as well
FRONT_KEYS = ("w", "c", "lam", "rF", "mH", "xH", "zH", "IHxx", "IHzz", "IHxz", "mF", "IFxx")
FRAME_KEYS = ("mB", "xB", "zB", "IBxx", "IBzz", "IBxz", "mR", "rR", "IRxx")
BARE_FRAME = {"mB": 5.5, "xB": 0.4, "zB": -0.5, "IBxx": 0.3, "IBzz": 0.25, "IBxz": 0.05}
"""Assumed rear frame (SI) of a bicycle whose numbers include a rider who was not there."""


@dataclass(frozen=True)
class Unknown:
    """A coordinate of a fit."""

    name: str
    lowest: float
    highest: float
    step: float  # of central differences
    prior: tuple[float, float] = (0.0, math.inf)  # mean and sd


STIFFNESS = Unknown("log_stiffness", math.log(50.0), math.log(1e7), 1e-4)  # N m/rad
HEIGHT = Unknown("height", -2.0, 20.0, 1e-5)  # m above the hub
SWAY_HEIGHT = replace(HEIGHT, prior=(1.5, 1.0))  # in beam frames 1.15 to 2.42 m, the fork at FORK_LENGTH
USUAL_HEIGHT = replace(HEIGHT, prior=(0.35, 0.15))
TIME = Unknown("log_time", math.log(1e-6), math.log(1.0), 1e-4)  # s
FORK_STIFFNESS = Unknown("log_fork_stiffness", math.log(50.0), math.log(1e7), 1e-4)  # N m/rad
LENGTH = Unknown("fork_length", 0.02, 0.5, 1e-4, FORK_LENGTH)  # m above the hub
ROTATION = Unknown("log_rotation", math.log(50.0), math.log(1e7), 1e-4, (math.log(1e4), 1.5))  # N m/rad
LATERAL = Unknown("log_lateral", math.log(1e3), math.log(1e9), 1e-4, (math.log(2e5), 1.5))  # N/m
HOLD_SHARE = Unknown("hold_share", -0.2, 1.0, 1e-4, (0.4, 0.1))  # of the wheelbase, before the rear contact
HOLD_HEIGHT = Unknown("hold_height", 0.0, 1.5, 1e-4, (0.5, 0.25))  # m above the ground


TYPICAL_SADDLE = (math.log(9e3), 0.75)  # N m/rad; 2e3 to 4e4 in 95 %, the typical range of the effect
SADDLE_STIFFNESS = Unknown("log_saddle_stiffness", math.log(50.0), math.log(1e7), 1e-4, TYPICAL_SADDLE)
SADDLE_RATIO = Unknown("log_saddle_ratio", math.log(1e-3), math.log(2.0), 1e-4, (math.log(0.22), 0.5))
# N/m; of a bicycle tyre under all the weight, 45e3 to 320e3 in 95 %
REAR_TYRE = Unknown("log_tyre", math.log(1e4), math.log(1e7), 1e-4, (math.log(1.2e5), 0.5))
TYRE_TIME = Unknown("log_tyre_time", math.log(1e-6), math.log(1.0), 1e-4, (math.log(3e-4), 1.0))  # s
SEATED_TIME = replace(TIME, prior=(math.log(1e-3), 1.5))  # of a front with a damping ratio of 0.003 to 0.8 at 16 Hz
RIDER_SHARES = {"mass_share": 0.05, "inertia_share": 0.15, "joint_x": 0.02, "x": 0.01, "z": 0.03}
"""Standard uncertainty of what a model that does not state its seated rider assumes of this body (1, 1, m)."""


@dataclass(frozen=True)
class Hypothesis:
    """What the front and its hold are taken to be."""

    name: str
    unknowns: tuple[Unknown, ...]
    starts: tuple[Mapping[str, float], ...]  # by name of the unknown

    @property
    def forked(self) -> bool:
        """True with a second joint in the fork."""
        return FORK_STIFFNESS in self.unknowns

    @property
    def supported(self) -> bool:
        """True where the frame is not held."""
        return ROTATION in self.unknowns

    @property
    def seated(self) -> bool:
        """True with a rider who yaws on the saddle."""
        return SADDLE_STIFFNESS in self.unknowns


def _starts(rows: Sequence[Sequence[float]], names: Sequence[str]) -> tuple[Mapping[str, float], ...]:
    """Starts from rows of numbers: a stiffness becomes its logarithm."""
    return tuple(
        {name: math.log(x) if name.startswith("log") else x for name, x in zip(names, row, strict=True)} for row in rows
    )


ONE_ROWS = [(2000.0, 0.3), (8000.0, 0.3), (4000.0, 0.6), (15000.0, 1.1)]
ONE_HINGE = Hypothesis("one hinge", (STIFFNESS, HEIGHT), _starts(ONE_ROWS, ("log_stiffness", "height")))
TWO_JOINTS = Hypothesis(
    "two joints",
    (STIFFNESS, SWAY_HEIGHT, FORK_STIFFNESS, LENGTH),
    _starts(
        [(15000.0, 1.0, 5000.0, 0.22), (5000.0, 0.6, 8000.0, 0.22), (40000.0, 1.8, 4000.0, 0.22)],
        ("log_stiffness", "height", "log_fork_stiffness", "fork_length"),
    ),
)
RIDER_YAWS = Hypothesis(
    "one hinge and a rider who yaws on the saddle",
    (STIFFNESS, HEIGHT, SADDLE_STIFFNESS, SADDLE_RATIO, REAR_TYRE, TYRE_TIME),
    _starts(
        [(front, 0.3, saddle, 0.22, 1.2e5, 3e-4) for front in (2500.0, 7000.0) for saddle in (3000.0, 9000.0, 27000.0)],
        ("log_stiffness", "height", "log_saddle_stiffness", "log_saddle_ratio", "log_tyre", "log_tyre_time"),
    ),
)
NOT_HELD = Hypothesis(
    "the frame was not held",
    (STIFFNESS, USUAL_HEIGHT, ROTATION, LATERAL, HOLD_SHARE, HOLD_HEIGHT),
    _starts(
        [
            (2000.0, 0.3, 1e4, 2e5, 0.4, 0.5),
            (6000.0, 0.4, 1500.0, 3e4, 0.4, 0.5),
            (6000.0, 0.4, 4e4, 5e5, 0.4, 0.3),
            (12000.0, 0.4, 1e4, 3e5, 0.4, 0.3),
        ],
        ("log_stiffness", "height", "log_rotation", "log_lateral", "hold_share", "hold_height"),
    ),
)


@dataclass(frozen=True, eq=False)
class FrontFit:
    """A hypothesis fitted to readings."""

    hypothesis: Hypothesis
    theta: Array  # (p,), coordinates of the unknowns
    covariance: Array  # (p, p), of the coordinates
    chi2: float  # of the readings and of all that floats
    freedom: int  # numbers that were read less unknowns without a prior
    values: Mapping[str, float]  # effect.parameter and support keys, SI
    factor: Array  # (m, p): derivatives of the values in their order along the coordinates
    residual: Array  # (n,), (measured - predicted) / sd
    height_assumed: bool = False  # the readings leave the height of the hinge open
    others: tuple["FrontFit", ...] = ()  # further minima that fit as well

    @property
    def goodness(self) -> float:
        """P(chi^2 larger); NaN if there is nothing to be checked."""
        return float(chdtrc(self.freedom, self.chi2)) if self.freedom > 0 else math.nan

    @property
    def height_open(self) -> bool:
        """True if the height of the hinge is hardly better known than before."""
        prior = next(u for u in self.hypothesis.unknowns if u.name == HEIGHT.name).prior
        return self.height_assumed or self.height[1] > OPEN * prior[1]

    @property
    def fits(self) -> bool:
        """True unless the readings contradict it."""
        return not self.goodness < POOR

    @cached_property
    def value_covariance(self) -> Array:
        """Covariance (m, m) of :attr:`values`, SI."""
        return np.asarray(self.factor @ self.covariance @ self.factor.T)

    def sd(self, key: str) -> float:
        """Standard uncertainty of one of the :attr:`values`, SI."""
        place = list(self.values).index(key)
        return math.sqrt(max(self.value_covariance[place, place], 0.0))

    @property
    def height(self) -> tuple[float, float]:
        """Height of the hinge above the hub and its sd, m."""
        place = [u.name for u in self.hypothesis.unknowns].index(HEIGHT.name)
        return float(self.theta[place]), math.sqrt(max(self.covariance[place, place], 0.0))

    def coordinate(self, unknown: Unknown) -> tuple[float, float]:
        """Value and sd of a coordinate."""
        place = self.hypothesis.unknowns.index(unknown)
        return float(self.theta[place]), math.sqrt(max(self.covariance[place, place], 0.0))

    def value_interval(self, key: str, reach: float = REACH) -> tuple[float, float]:
        """Ends of the 95 % interval of one of the positive :attr:`values` (SI), even in its logarithm."""
        value = self.values[key]
        factor = _exp(reach * self.sd(key) / value)
        return value / factor, value * factor

    def interval(self, unknown: Unknown, reach: float = REACH) -> tuple[float, float]:
        """Ends of the 95 % interval of a stiffness (of its logarithm, turned back), a time, or a height (m)."""
        x, sd = self.coordinate(unknown)
        ends = x - reach * sd, x + reach * sd
        return (_exp(ends[0]), _exp(ends[1])) if unknown.name.startswith("log") else ends


def _exp(x: float) -> float:
    """Exponential, infinite beyond the largest number."""
    return math.exp(x) if x < 700.0 else math.inf


@dataclass(frozen=True)
class _Problem:
    """Residuals of a hypothesis; what floats is integrated out, to first order about each point that is tried."""

    readings: Readings
    hypothesis: Hypothesis
    base: Mapping[str, float]  # parameters of the bicycle, SI
    floating: Mapping[str, float]  # key of what floats -> sd
    prediction: Prediction = field(compare=False)
    tied: Mapping[str, str] = field(default_factory=dict)  # parameter -> the one that it equals

    @cached_property
    def data(self) -> tuple[Array, Array, NDArray[np.intp]]:
        """Numbers that were measured (n,), their sd, and their places among all predicted ones."""
        measured, sd = self.readings.numbers()
        used = np.flatnonzero(np.isfinite(measured))
        return measured[used], sd[used], used

    @cached_property
    def priors(self) -> tuple[Array, Array]:
        """Mean and sd (p,) of the unknowns, which may be infinite."""
        mean, sd = zip(*(u.prior for u in self.hypothesis.unknowns), strict=True)
        return np.array(mean), np.array(sd)

    @cached_property
    def steps(self) -> Array:
        """Steps of central differences (p,)."""
        return np.array([u.step for u in self.hypothesis.unknowns])

    def predict(self, theta: Array, errors: Array | None = None) -> Array:
        """Predicted numbers (k, n) at coordinates (k, p), with ``errors`` (k, floating) in units of their sd."""
        values = {key: np.full(len(theta), number) for key, number in self.base.items()}
        if errors is not None:
            for k, (key, sd) in enumerate(self.floating.items()):
                values[key] = values.get(key, 0.0) + sd * errors[:, k]
        for follower, leader in self.tied.items():
            values[follower] = values[follower] + values[leader] - self.base[leader]
        coordinates = {u.name: theta[:, k] for k, u in enumerate(self.hypothesis.unknowns)}
        return self.prediction(values | front_values(coordinates, values))[:, self.data[2]]

    def jacobian(self, theta: Array) -> Array:
        """Derivatives (n, p) of the predicted numbers along the unknowns."""
        steps = np.diag(self.steps)
        more, less = np.split(self.predict(np.concatenate([theta + steps, theta - steps])), 2)
        return np.asarray((more - less).T / (2 * self.steps))

    def noise_root(self, theta: Array) -> Array:
        """Cholesky factor (n, n) of the covariance of the readings about the prediction at ``theta`` (p,)."""
        count, step = len(self.floating), 0.1
        shifts = step * np.concatenate([np.eye(count), -np.eye(count)])
        points = np.repeat(theta[None], 2 * count, 0)
        more, less = np.split(self.predict(points, shifts), 2)
        slopes = (more - less) / (2 * step)
        return np.asarray(np.linalg.cholesky(np.diag(self.data[1] ** 2) + slopes.T @ slopes))

    def minimise(self, theta: Array) -> tuple[Array, Array, float]:
        """Coordinates (p,) of the minimum that is reached from ``theta``, the noise's factor there, and chi^2."""
        unknowns, (mean, sd) = self.hypothesis.unknowns, self.priors
        bounds = [u.lowest for u in unknowns], [u.highest for u in unknowns]
        root = self.noise_root(theta)

        def residual(x: Array) -> Array:
            gap = scipy.linalg.solve_triangular(root, self.data[0] - self.predict(x[None])[0], lower=True)
            return np.concatenate([gap, (x - mean) / sd])

        def slopes(x: Array) -> Array:
            rows = scipy.linalg.solve_triangular(root, -self.jacobian(x), lower=True)
            return np.concatenate([rows, np.diag(1 / sd)])

        for _ in range(ROUNDS):
            start = theta
            end = scipy.optimize.least_squares(
                residual, theta, slopes, bounds=bounds, x_scale="jac", ftol=1e-6, xtol=1e-7, max_nfev=30
            )
            theta = end.x
            root = self.noise_root(theta)
            if np.abs(theta - start).max() < 1e-3:
                break
        gap = residual(theta)
        return theta, root, float(gap @ gap)


def front_values(x: Mapping[str, Array], values: Mapping[str, Array]) -> dict[str, Array]:
    """Parameters of the effects and of the hold, SI, at named coordinates ``x`` on bicycles ``values``."""
    time = np.exp(x["log_time"]) if "log_time" in x else 0.0
    stiffness = np.exp(x["log_stiffness"])
    joint_x, joint_z = point_of(values, x["height"], on_wheel=False)
    front = {
        f"{FRONT}.stiffness": stiffness,
        f"{FRONT}.damping": time * stiffness,
        f"{FRONT}.joint_x": joint_x,
        f"{FRONT}.joint_z": joint_z,
        f"{FRONT}.axis_tilt": values["lam"],
    }
    if "log_fork_stiffness" in x:
        fork = np.exp(x["log_fork_stiffness"])
        front |= {f"{FORK}.stiffness": fork, f"{FORK}.damping": time * fork}
        front[f"{FORK}.length"] = x["fork_length"]
    if "log_saddle_stiffness" in x:
        front |= _saddle_values(np.exp(x["log_saddle_stiffness"]), np.exp(x["log_saddle_ratio"]), values)
    if "log_tyre" in x:
        front[TYRE] = np.exp(x["log_tyre"])
        front[TYRE_DAMPING] = np.exp(x["log_tyre_time"]) * front[TYRE]
    if "log_rotation" in x:
        hold = np.exp(x["log_rotation"]), np.exp(x["log_lateral"]), x["hold_share"] * values["w"], -x["hold_height"]
        front |= dict(zip(SUPPORT, hold, strict=True))
    return front


def _saddle_values(stiffness: Array, ratio: Array, values: Mapping[str, Array]) -> dict[str, Array]:
    """Stiffness (N m/rad) and damping (N m s/rad) of the rider's hinge, from its damping ratio on a held frame."""
    prefix = f"{SADDLE}."
    own = {key.removeprefix(prefix): number for key, number in values.items() if key.startswith(prefix)}
    saddle: Any = effect_class(SADDLE)()
    inertia = saddle.carried_inertia(own)
    return {f"{SADDLE}.stiffness": stiffness, f"{SADDLE}.damping": 2 * ratio * np.sqrt(stiffness * inertia)}


def fit_front(
    readings: Readings, model: Model, hypothesis: Hypothesis, stated_sd: Mapping[str, float] | None = None
) -> FrontFit:
    """Fit a hypothesis to readings of the bicycle of a model.

    Parameters
    ----------
    readings : Readings
        Deflections and taps; their errors.
    model : Model
        The bicycle; of its effects those at a free handlebar are used.
    hypothesis : Hypothesis
        :data:`ONE_HINGE`, :data:`TWO_JOINTS`, :data:`RIDER_YAWS` or :data:`NOT_HELD`.
    stated_sd : mapping, optional
        Standard uncertainty of parameters of the bicycle, SI, in place of those that the model states or that are
        assumed.

    Raises
    ------
    InputError
        Fewer numbers than unknowns.
    """
    if readings.damped:
        last = {"log_time": math.log(1e-3)}
        starts = tuple({**start, **last} for start in hypothesis.starts)
        time = SEATED_TIME if hypothesis.seated else TIME
        hypothesis = replace(hypothesis, unknowns=(*hypothesis.unknowns, time), starts=starts)
    problem = _problem(readings.merge_alike(), model, hypothesis, stated_sd or {})
    unknowns = [u for u in hypothesis.unknowns if math.isinf(u.prior[1])]
    count = len(problem.data[0])
    least = len(unknowns) - 1 if HEIGHT in unknowns else len(unknowns)  # that height may be assumed
    if count < least:
        raise InputError(
            f"{hypothesis.name} needs {least} numbers, and {count} were read; add readings at another place"
        )
    if HEIGHT not in hypothesis.unknowns:
        best = _solve_all(problem)
        return replace(best[0], others=tuple(best[1:]))
    guided = _solve_all(replace(problem, hypothesis=_with_prior(hypothesis)))
    if guided[0].height[1] > OPEN * ASSUMED_HEIGHT[1]:
        return _widen_by_height(problem, guided[0])
    best = _solve_all(problem, [fit.theta for fit in guided])
    return replace(best[0], others=tuple(best[1:]))


def _with_prior(hypothesis: Hypothesis, prior: tuple[float, float] = ASSUMED_HEIGHT) -> Hypothesis:
    """The hypothesis with an assumed height of the hinge."""
    unknowns = tuple(replace(u, prior=prior) if u is HEIGHT else u for u in hypothesis.unknowns)
    return replace(hypothesis, unknowns=unknowns)


def _widen_by_height(problem: "_Problem", fit: FrontFit) -> FrontFit:
    """The fit with the variance of the stiffness that an assumed height has at both ends of its interval.

    The inertia about the hinge grows faster than in proportion to its height: the slope at the middle says too little.
    """
    height, sd = fit.height
    places = [u.name for u in fit.hypothesis.unknowns]
    stiffness = places.index(STIFFNESS.name)
    moves = []
    for sign in (1.0, -1.0):
        fixed = _with_prior(problem.hypothesis, (height + sign * REACH * sd, 1e-3 * sd))
        theta, _, _ = replace(problem, hypothesis=fixed).minimise(fit.theta)
        moves.append(abs(theta[stiffness] - fit.theta[stiffness]) / REACH)
    covariance = fit.covariance.copy()
    covariance[stiffness, stiffness] = max(covariance[stiffness, stiffness], (moves[0] ** 2 + moves[1] ** 2) / 2)
    return replace(fit, covariance=covariance, height_assumed=True)


def _problem(readings: Readings, model: Model, hypothesis: Hypothesis, stated_sd: Mapping[str, float]) -> _Problem:
    names = [FRONT] + [FORK] * hypothesis.forked
    present = {effect.identifier for effect in model.effects}
    names += [SADDLE] * hypothesis.seated
    names += [name for name in TURNING if readings.bar_free and name in present]
    ridden = model.bicycle["mB"] >= LIGHTEST_RIDDEN
    prediction = Prediction(readings, tuple(effect_class(name) for name in names), ridden)
    base = dict(model.parameters)
    deviations = {key: deviation.sd for key, deviation in standard_deviations(model, stated_sd).items()}
    keys = list(FRONT_KEYS)
    if prediction.frame_free:
        keys += FRAME_KEYS
    tied: Mapping[str, str] = {}
    if hypothesis.seated:
        base, tied, shares = _with_rider(model)
        deviations |= shares
        keys += shares
    if hypothesis.supported:
        keys += FRAME_KEYS
        if base["mB"] > LIGHTEST_RIDDEN:
            base |= BARE_FRAME | {"xB": BARE_FRAME["xB"] * base["w"]}
            deviations |= {key: 0.2 * abs(number) for key, number in BARE_FRAME.items()}
    floating = {key: deviations[key] for key in keys if deviations.get(key, 0.0) > 0}
    errors = readings.errors
    floating |= {load_error(force): errors.load for force in readings.loads}
    floating |= {place_error(place): errors.place for place in readings.places}
    floating |= {gain_error(pair): errors.gain for pair in readings.pairs}
    return _Problem(readings, hypothesis, base, {key: sd for key, sd in floating.items() if sd > 0}, prediction, tied)


def _with_rider(model: Model) -> tuple[dict[str, float], dict[str, str], dict[str, float]]:
    """Parameters (SI) of a model with its seated rider, which of the rider's follow others, and sd of assumed ones.

    A rider whom the model states moves as stated. Numbers that equal one of the bicycle stay those of the bicycle.
    """
    stated = any(effect.identifier == SADDLE for effect in model.effects)
    whole = model if stated else model.with_effect(effect_class(SADDLE)())
    base = dict(whole.parameters)
    shares = {f"{SADDLE}.{name}": sd for name, sd in RIDER_SHARES.items()}
    exact = base[f"{SADDLE}.mass_share"] == 1.0  # the body is stated, but for the place of the saddle
    tied = {key: leader for key, leader in whole.tied.items() if key.startswith(f"{SADDLE}.")}
    return base, tied, {key: sd for key, sd in shares.items() if not exact or key.endswith("joint_x")}


def _solve_all(problem: _Problem, starts: Sequence[Array] = ()) -> list[FrontFit]:
    """Minima of a problem, the best first, with all others that are not much worse."""
    unknowns = problem.hypothesis.unknowns
    chosen = starts or [np.array([start[u.name] for u in unknowns]) for start in problem.hypothesis.starts]
    ends = sorted((problem.minimise(start) for start in chosen), key=lambda end: end[2])
    minima: list[FrontFit] = []
    for end in ends:
        if end[2] - ends[0][2] > WORSE:
            break
        fit = _fit_at(problem, *end)
        if not any(_same(fit, other) for other in minima):
            minima.append(fit)
    return minima


def _same(fit: FrontFit, other: FrontFit) -> bool:
    """True if two minima are one: no coordinate differs by three standard uncertainties of both."""
    sd = np.sqrt(np.diag(fit.covariance) + np.diag(other.covariance))
    return bool((np.abs(fit.theta - other.theta) < 3 * sd + 1e-3).all())


def _fit_at(problem: _Problem, theta: Array, root: Array, chi2: float) -> FrontFit:
    """The fit at a minimum ``theta`` (p,) with the factor ``root`` (n, n) of the noise there."""
    unknowns, count = problem.hypothesis.unknowns, len(problem.data[0])
    rows = scipy.linalg.solve_triangular(root, problem.jacobian(theta), lower=True)
    information = rows.T @ rows + np.diag(1 / problem.priors[1] ** 2)
    scale = np.sqrt(np.maximum(np.diag(information), 1e-12))
    inverse = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-12, hermitian=True)
    steps = np.diag(problem.steps)
    points = np.concatenate([theta[None], theta + steps, theta - steps])
    base = {key: np.full(len(points), number) for key, number in problem.base.items()}
    table = front_values({u.name: points[:, k] for k, u in enumerate(unknowns)}, base)
    del table[f"{FRONT}.axis_tilt"]  # follows the bicycle
    numbers = np.array(list(table.values()))
    p = len(theta)
    residual = problem.data[0] - problem.predict(theta[None])[0]
    return FrontFit(
        problem.hypothesis,
        theta,
        inverse / np.outer(scale, scale),
        chi2,
        count - sum(math.isinf(u.prior[1]) for u in unknowns),
        dict(zip(table, numbers[:, 0].tolist(), strict=True)),
        (numbers[:, 1 : p + 1] - numbers[:, p + 1 :]) / (2 * problem.steps),
        scipy.linalg.solve_triangular(root, residual, lower=True),
    )
