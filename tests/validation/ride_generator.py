"""SYNTHETIC rides: a bicycle of Kane's equations under coloured torques and a rider who steers, sampled exactly.

The bicycle is that of ``ride_bicycle``. Inputs are coloured noise of first or second order, of sizes and corner
frequencies of their own. The rider feeds lean, lean rate, steer and steer rate through two lags to the steer torque,
with gains tuned for each bicycle and speed; the fitter knows nothing of that. Motion, torques and inputs are one linear
stochastic system; its samples are exact by Van Loan (1978, IEEE Trans. Automatic Control 23, 395-404).

Not modelled: tyres that saturate, loads that change, friction, pitch, roughness that reaches the tyres themselves,
a rider who moves on the saddle, effects of dv/dt; a pause is a fade of speed and motion.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import expm, solve_continuous_lyapunov
from scipy.optimize import minimize

from tests.validation.ride_bicycle import INPUTS, Motion, Random, Real, RiddenBicycle, draw_bicycle
from tyre.ground import InputError, write_text

SAMPLE = 0.01  # s
COLUMNS = {  # what is recorded -> column of the file
    "roll_rate": "roll_rate_rad_s", "yaw_rate": "yaw_rate_rad_s", "steer_rate": "steer_rate_rad_s",
    "steer": "steer_rad", "lateral_acceleration": "lateral_acceleration_m_s2", "steer_torque": "steer_torque_N_m",
}  # fmt: skip
NOISE = {  # standard deviation of a sample
    "roll_rate": 0.005, "yaw_rate": 0.005, "steer_rate": 0.005, "steer": 0.002, "lateral_acceleration": 0.1,
    "steer_torque": 0.05,
}  # fmt: skip
GYROS = ("roll_rate", "yaw_rate", "steer_rate")
SLOWEST_DECAY = 0.15  # 1/s: a ride whose slowest motion decays more slowly is not drawn
TRIES = 60


@dataclass(frozen=True)
class Style:
    """How a rider rides: rms yaw rate (rad/s) of the bends that are followed, and that of the largest lean."""

    bends: tuple[float, float]  # drawn between
    largest: float  # all inputs are made smaller together where the bicycle would lean more than it needs


STYLES = {"straight": Style((0.02, 0.06), 0.06), "slalom": Style((0.2, 0.35), 0.35)}


@dataclass(frozen=True)
class Colour:
    """Noise of standard deviation ``sd`` (unit of its input) behind a filter of first or second order.

    First order (``damping`` 0): u' = -corner u + white. Second: u'' + 2 damping corner u' + corner^2 u = white; a small
    damping makes a narrow line, as pedalling does.
    """

    sd: float
    corner: float  # rad/s
    damping: float = 0.0

    def system(self) -> tuple[Real, Real]:
        """Matrix and column of the white noise; the first state is u."""
        if not self.damping:
            return np.array([[-self.corner]]), np.array([self.sd * math.sqrt(2 * self.corner)])
        matrix = np.array([[0.0, 1.0], [-(self.corner**2), -2 * self.damping * self.corner]])
        return matrix, np.array([0.0, self.sd * math.sqrt(4 * self.damping * self.corner**3)])


Colours = Mapping[str, tuple[Colour, ...]]
"""Input -> noises that add up to it."""

FED_BACK = ("lean", "roll_rate", "steer", "steer_rate")


@dataclass(frozen=True)
class Rider:
    """Steer torque (N m) = gains . (lean, lean rate, steer, steer rate) behind two lags (s) in series."""

    gains: tuple[float, ...]
    lags: tuple[float, float]


@dataclass(frozen=True)
class Loop:
    """z' = matrix z + drive w with unit white noise w; z holds bicycle, rider and inputs; outputs are rows over z."""

    speed: float
    matrix: Real
    drive: Real
    push: Real  # (n,) column of a further steer torque
    outputs: Mapping[str, Real]

    def sampled(self, step: float) -> tuple[Real, Real]:
        """Matrix of one step (s) and covariance of what the noise adds in it (Van Loan)."""
        n = len(self.matrix)
        loan = expm(step * np.block([[-self.matrix, self.drive @ self.drive.T], [np.zeros((n, n)), self.matrix.T]]))
        once = loan[n:, n:].T
        added = once @ loan[:n, n:]
        return once, (added + added.T) / 2

    @cached_property
    def covariance(self) -> Real:
        """Stationary covariance of z."""
        return np.asarray(solve_continuous_lyapunov(self.matrix, -self.drive @ self.drive.T))

    def sd(self, output: str) -> float:
        """Stationary standard deviation of an output."""
        row = self.outputs[output]
        return float(np.sqrt(row @ self.covariance @ row))


def close_loop(motion: Motion, colours: Colours, rider: Rider | None = None) -> Loop:
    """Bicycle, rider and coloured inputs as one system; the steer torque is the rider's and its noise together."""
    n, parts = len(motion.matrix), [(k, colour) for k, name in enumerate(INPUTS) for colour in colours.get(name, ())]
    of_rider = 2 if rider else 0
    filters = [(k, *colour.system()) for k, colour in parts]
    size = n + of_rider + sum(len(matrix) for _, matrix, _ in filters)
    whole, drive = np.zeros((size, size)), np.zeros((size, len(filters)))
    reach = np.zeros((len(INPUTS), size))  # inputs as rows over z
    place = n + of_rider
    for column, (k, matrix, noise) in enumerate(filters):
        own = slice(place, place + len(matrix))
        whole[own, own], drive[own, column] = matrix, noise
        reach[k, place] = 1.0
        place += len(matrix)
    if rider:
        told = sum(gain * motion.outputs[name][:n] for gain, name in zip(rider.gains, FED_BACK, strict=True))
        first, second = rider.lags
        whole[n, :n], whole[n, n] = told / first, -1 / first
        whole[n + 1, n], whole[n + 1, n + 1] = 1 / second, -1 / second
        reach[0, n + 1] = 1.0
    whole[:n, :n] = motion.matrix
    whole[:n] += motion.inputs @ reach
    outputs = {name: np.pad(row[:n], (0, size - n)) + row[n:] @ reach for name, row in motion.outputs.items()}
    push = np.pad(motion.inputs[:, 0], (0, size - n))
    return Loop(motion.speed, whole, drive, push, outputs)


def tune_rider(motion: Motion, rng: Random, *, decay: float = SLOWEST_DECAY) -> Rider:
    """A rider for a bicycle at a speed: lags drawn, gains that leave least lean for least torque (H2).

    Lean torque of 10 N m and 2 rad/s disturbs; the cost is E[lean^2]/(3 deg)^2 + E[torque^2]/(3 N m)^2 by weights that
    are drawn too. InputError where no gains make all motions decay by ``decay`` (1/s) or faster.
    """
    lags = (float(rng.uniform(0.04, 0.1)), float(rng.uniform(0.015, 0.04)))
    weight = float(np.exp(rng.uniform(-1, 1)))
    disturbed = {"lean_torque": (Colour(10.0, 2.0),), "steer_torque": (Colour(0.5, 8.0),)}
    bare = close_loop(motion, disturbed, Rider((0.0,) * 4, lags))
    n = len(motion.matrix)
    seen = np.array([bare.outputs[name] for name in FED_BACK]) / lags[0]
    scale = np.array([10.0, 5.0, 10.0, 1.0])

    def cost(x: Real) -> float:
        whole = bare.matrix.copy()
        whole[n] += (x * scale) @ seen
        growth = float(np.linalg.eigvals(whole).real.max())
        if growth > -decay:
            return 1e6 * (1 + growth + decay)
        spread = solve_continuous_lyapunov(whole, -bare.drive @ bare.drive.T)
        lean = bare.outputs["lean"]
        return float(weight * (lean @ spread @ lean) / 0.05**2 + spread[n + 1, n + 1] / 9.0)

    starts = [np.zeros(4), np.array([1.0, 1.0, 0.0, 0.0]), np.array([2.0, 1.0, -1.0, -0.5])]
    searches = [minimize(cost, start, method="Nelder-Mead", options={"maxfev": 300}) for start in starts]
    best = min(searches, key=lambda search: search.fun)
    if best.fun >= 1e6:
        raise InputError(f"no rider holds this bicycle at {motion.speed:g} m/s")
    return Rider(tuple(float(gain) for gain in best.x * scale), lags)


def draw_colours(rng: Random, *, pedalling: bool = False) -> dict[str, tuple[Colour, ...]]:
    """Inputs of a ride: sizes and corners from ``rng``, of first or of second order; ``pedalling`` adds a line."""
    sizes = {"steer_torque": (0.4, 1.2), "lean_torque": (5, 15), "side_force": (5, 15), "yaw_moment": (0.7, 3)}
    corners = {"steer_torque": (3, 15), "lean_torque": (1, 6), "side_force": (1, 8), "yaw_moment": (10, 50)}
    colours: dict[str, tuple[Colour, ...]] = {}
    for name in INPUTS:
        sd, corner = (float(np.exp(rng.uniform(*np.log(span[name])))) for span in (sizes, corners))
        damping = float(rng.uniform(0.5, 1.0)) if rng.random() < 0.5 else 0.0
        colours[name] = (Colour(sd, corner, damping),)
    if pedalling:
        cadence = 2 * np.pi * rng.uniform(1.0, 1.5)
        colours["lean_torque"] += (Colour(float(rng.uniform(4, 10)), cadence, 0.015),)
        colours["steer_torque"] += (Colour(float(rng.uniform(0.2, 0.5)), cadence, 0.015),)
    return colours


def scale_colours(colours: Colours, factor: float) -> Colours:
    """The same inputs, all larger by a factor."""
    return {name: tuple(replace(colour, sd=factor * colour.sd) for colour in parts) for name, parts in colours.items()}


def add_wander(motion: Motion, colours: Colours, rider: Rider | None, yaw_rate: float, rng: Random) -> Colours:
    """Add what makes the bicycle follow gentle bends, a slow steer torque or hands off a slow lean torque.

    Its corner is 0.3 to 1 rad/s; alone it makes a yaw rate of standard deviation ``yaw_rate`` (rad/s).
    """
    name = "steer_torque" if rider else "lean_torque"
    slow = Colour(1.0, float(rng.uniform(0.3, 1.0)))
    alone = close_loop(motion, {name: (slow,)}, rider)
    slow = replace(slow, sd=yaw_rate / alone.sd("yaw_rate"))
    return {**colours, name: (*colours[name], slow)}


@dataclass(frozen=True)
class Leg:
    """A bicycle at one speed: its rider (None: hands off) and inputs, and the loop that they make."""

    bicycle: RiddenBicycle
    speed: float  # m/s
    rider: Rider | None
    colours: Colours

    @cached_property
    def loop(self) -> Loop:
        """The whole system at the leg's speed."""
        return close_loop(self.bicycle.motion(self.speed), self.colours, self.rider)


def make_leg(
    bicycle: RiddenBicycle, speed: float, rng: Random, *, hands_off: bool = False, pedalling: bool = False,
    style: str = "straight",
) -> Leg:  # fmt: skip
    """Draw rider and inputs for a bicycle at a speed (m/s), in one of ``STYLES``.


    InputError where no rider holds the bicycle, or hands off its slowest motion decays too slowly.
    """
    motion = bicycle.motion(speed)
    if hands_off and motion.growth > -SLOWEST_DECAY:
        raise InputError(f"hands off the bicycle is not stable enough at {speed:g} m/s")
    rider = None if hands_off else tune_rider(motion, rng)
    yaw_rate = float(rng.uniform(*STYLES[style].bends))
    colours = add_wander(motion, draw_colours(rng, pedalling=pedalling), rider, yaw_rate, rng)
    upright = STYLES[style].largest * speed / bicycle.values["g"] / close_loop(motion, colours, rider).sd("lean")
    return Leg(bicycle, speed, rider, scale_colours(colours, min(1.0, upright)))


def self_stable_speed(bicycle: RiddenBicycle, speeds: tuple[float, float] = (3.0, 10.0)) -> float:
    """Speed (m/s) between two at which the bicycle without a rider decays best; InputError if too slowly."""
    grid = np.linspace(*speeds, 29)
    growths = [bicycle.motion(float(v)).growth for v in grid]
    best = int(np.argmin(growths))
    if growths[best] > -SLOWEST_DECAY:
        raise InputError("hands off the bicycle is stable nowhere")
    return float(grid[best])


def draw_legs(
    rng: Random, speeds: Sequence[float], *, self_stable: bool = False, pedalling: bool = False,
    style: str = "straight", **of_bicycle: Any,
) -> list[Leg]:  # fmt: skip
    """Draw a bicycle (by the arguments of :func:`draw_bicycle`) that can be ridden at all ``speeds`` (m/s).

    With ``self_stable`` a leg comes first at the speed where the bicycle is most stable without hands.
    """
    for _ in range(TRIES):
        bicycle = draw_bicycle(rng, **of_bicycle)
        try:
            first = [self_stable_speed(bicycle)] if self_stable else []
            off = [make_leg(bicycle, v, rng, hands_off=True, pedalling=pedalling, style=style) for v in first]
            return off + [make_leg(bicycle, v, rng, pedalling=pedalling, style=style) for v in speeds]
        except InputError:
            continue
    raise InputError(f"no such bicycle can be ridden at {', '.join(f'{v:g}' for v in speeds)} m/s")


@dataclass(frozen=True)
class Sensors:
    """What is recorded and how: noise of a sample (in ``NOISE`` where not given here) and errors of the measurement.

    ``box`` turns the gyros of the frame about x, y and z (rad); ``gain`` and ``delay`` (s) are by channel. With
    ``fork_box`` the steer rate is the difference of a gyro on the fork and those of the frame, whose noise it shares.
    ``speed_scale``: the stated speed is so many times the true one.
    """

    channels: tuple[str, ...] = GYROS
    noise: Mapping[str, float] = field(default_factory=dict)
    box: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gain: Mapping[str, float] = field(default_factory=dict)
    delay: Mapping[str, float] = field(default_factory=dict)
    bias: Mapping[str, float] = field(default_factory=dict)
    fork_box: bool = False
    speed_scale: float = 1.0

    def sd(self, channel: str) -> float:
        """Standard deviation of the noise of a channel."""
        return self.noise.get(channel, NOISE[channel])

    def noise_factor(self, tilt: float) -> Real:
        """Factor (channels, sources) of the noise's covariance; ``tilt`` of the steer axis in rad."""
        factor = np.diag([self.sd(channel) for channel in self.channels])
        if self.fork_box:
            at = self.channels.index
            factor[at("steer_rate"), at("roll_rate")] = -math.sin(tilt) * self.sd("roll_rate")
            factor[at("steer_rate"), at("yaw_rate")] = -math.cos(tilt) * self.sd("yaw_rate")
        return factor

    def rows(self, outputs: Mapping[str, Real]) -> Real:
        """Rows (channels, n) of what the sensors see, with the turned box and gains, but without delays."""
        seen = dict(outputs)
        x, y, z = self.box
        # the box shows R' omega of omega = (roll rate, 0, yaw rate), R = Rz Ry Rx
        turn = _about(2, z) @ _about(1, y) @ _about(0, x)
        seen["roll_rate"] = turn[0, 0] * outputs["roll_rate"] + turn[2, 0] * outputs["yaw_rate"]
        seen["yaw_rate"] = turn[0, 2] * outputs["roll_rate"] + turn[2, 2] * outputs["yaw_rate"]
        return np.array([self.gain.get(channel, 1.0) * seen[channel] for channel in self.channels])

    def read(self, time: Real, true: Mapping[str, Real], tilt: float, rng: Random) -> dict[str, Real]:
        """What is recorded of true signals (samples,) at ``time``."""
        seen = self.rows(true)
        noise = self.noise_factor(tilt) @ rng.standard_normal(seen.shape)
        recorded = {}
        for k, channel in enumerate(self.channels):
            signal = seen[k]
            if channel in self.delay:
                signal = CubicSpline(time, signal)(np.maximum(time - self.delay[channel], time[0]))
            recorded[channel] = signal + noise[k] + self.bias.get(channel, 0.0)
        return recorded


def _about(axis: int, angle: float) -> Real:
    turn = np.eye(3)
    one, other = (axis + 1) % 3, (axis + 2) % 3
    turn[[one, other], [one, other]] = math.cos(angle)
    turn[one, other], turn[other, one] = -math.sin(angle), math.sin(angle)
    return turn


@dataclass(frozen=True)
class Ride:
    """A recorded ride and its truth: signals (samples,) by name, outputs of the loop and inputs in SI units."""

    leg: Leg
    sensors: Sensors
    time: Real  # s
    speed: Real  # (samples,) true, m/s
    truth: Mapping[str, Real]
    recorded: Mapping[str, Real]
    steady: NDArray[np.bool_]  # (samples,) false where the rider stands, starts, stops or turns on purpose

    @property
    def stated_speed(self) -> float:
        """The speed that the rider states, m/s."""
        return round(float(np.mean(self.speed[self.steady])) * self.sensors.speed_scale, 4)


@dataclass(frozen=True)
class Course:
    """What a ride has beside a steady speed.

    ``drift``: standard deviation of a slow change of the speed, as a share of it. ``turns``: bends of 6 s for which the
    rider adds a steer torque; ``pauses``: the bicycle is stopped for 10 s, with 5 s of braking and of starting.
    """

    drift: float = 0.0
    turns: int = 0
    pauses: int = 0


STEADY = Course()
SPEED_STEP = 0.02  # m/s, speeds are rounded to it where they drift
BEND, BEND_YAW_RATE = 6.0, 0.35  # s, rad/s
BRAKING, STANDING = 5.0, 10.0  # s


def ride(
    leg: Leg, rng: Random, *, sensors: Sensors | None = None, duration: float = 300.0, step: float = SAMPLE,
    course: Course = STEADY,
) -> Ride:  # fmt: skip
    """Simulate and record a ride of ``duration`` s, sampled every ``step`` s, that begins in its stationary state."""
    sensors = sensors or Sensors()
    count = round(duration / step)
    time = step * np.arange(count)
    speed = _drifting(leg.speed, course.drift, time, rng)
    bends, torque = _bends(leg, course.turns, time, rng)
    states, loops = _march(leg, speed, torque, step, rng)
    truth = _signals(states, loops, torque)
    halted, fade = _pauses(course.pauses, time, rng)
    truth = {name: fade * signal for name, signal in truth.items()}
    recorded = sensors.read(time, truth, leg.bicycle.values["lam"], rng)
    return Ride(leg, sensors, time, speed * fade, truth, recorded, ~(bends | halted))


def _drifting(speed: float, share: float, time: Real, rng: Random) -> Real:
    """Speeds (samples,): constant, or sums of slow sines, rounded."""
    if not share:
        return np.full(len(time), speed)
    periods, phases = rng.uniform(40, 200, 4), rng.uniform(0, 2 * np.pi, 4)
    waves = np.sin(2 * np.pi * time[:, None] / periods + phases).sum(1) / np.sqrt(2)
    return np.asarray(np.round(speed * (1 + share * waves) / SPEED_STEP) * SPEED_STEP)


def _bends(leg: Leg, turns: int, time: Real, rng: Random) -> tuple[NDArray[np.bool_], Real]:
    """Where bends are, and the steer torque (samples,) that makes them."""
    inside, torque = np.zeros(len(time), bool), np.zeros(len(time))
    gain = _steady_gain(leg.loop)
    for _ in range(turns):
        begin = rng.uniform(0.05, 0.9) * time[-1]
        here = (time >= begin) & (time < begin + BEND)
        torque[here] = rng.choice([-1, 1]) * BEND_YAW_RATE / gain
        inside |= (time >= begin) & (time < begin + BEND + 3 / SLOWEST_DECAY)
    return inside, torque


def _steady_gain(loop: Loop) -> float:
    """Steady yaw rate per further steer torque, rad/s/(N m)."""
    return float(loop.outputs["yaw_rate"] @ np.linalg.solve(-loop.matrix, loop.push))


def _pauses(pauses: int, time: Real, rng: Random) -> tuple[NDArray[np.bool_], Real]:
    """Where the bicycle is halted, and the share (samples,) that is left of speed and motion: a stand-in."""
    fade = np.ones(len(time))
    for _ in range(pauses):
        middle = rng.uniform(0.1, 0.9) * time[-1]
        fade = np.minimum(fade, np.clip((np.abs(time - middle) - STANDING / 2) / BRAKING, 0, 1))
    return fade < 1, fade


def _march(leg: Leg, speed: Real, torque: Real, step: float, rng: Random) -> tuple[Real, list[tuple[slice, Loop]]]:
    """States (samples, n), and the stretches of one speed, each with its loop."""
    cuts = [0, *(np.flatnonzero(np.diff(speed)) + 1), len(speed)]
    known: dict[float, tuple[Loop, Real, Real, Real]] = {}
    states = np.empty((len(speed), len(leg.loop.matrix)))
    x = _factor(leg.loop.covariance) @ rng.standard_normal(states.shape[1])
    stretches = []
    for first, last in itertools.pairwise(cuts):
        v = float(speed[first])
        if v not in known:
            loop = close_loop(leg.bicycle.motion(v), leg.colours, leg.rider)
            once, added = loop.sampled(step)
            pushed = np.linalg.solve(loop.matrix, (once - np.eye(len(once))) @ loop.push)
            known[v] = (loop, once, _factor(added), pushed)
        loop, once, factor, pushed = known[v]
        shocks = rng.standard_normal((last - first, len(x))) @ factor.T + torque[first:last, None] * pushed
        for k in range(first, last):
            states[k] = x
            x = once @ x + shocks[k - first]
        stretches.append((slice(first, last), loop))
    return states, stretches


def _factor(covariance: Real) -> Real:
    """A matrix L with L L' = covariance, which may be singular."""
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    return np.asarray(vectors * np.sqrt(np.clip(values, 0, None)))


def _signals(states: Real, stretches: Sequence[tuple[slice, Loop]], torque: Real) -> dict[str, Real]:
    names = list(stretches[0][1].outputs)
    signals = {name: np.empty(len(states)) for name in names}
    for part, loop in stretches:
        values = states[part] @ np.array([loop.outputs[name] for name in names]).T
        for k, name in enumerate(names):
            signals[name][part] = values[:, k]
    signals["steer_torque"] = signals["steer_torque"] + torque
    return signals


def write_ride(path: Path, taken: Ride, *, with_speed: bool = False) -> None:
    """Write what was recorded as CSV in the columns that velotyre reads; ``with_speed`` adds that of a wheel sensor."""
    columns = {"time_s": taken.time} | {COLUMNS[name]: signal for name, signal in taken.recorded.items()}
    if with_speed:
        columns["speed_m_s"] = taken.speed * taken.sensors.speed_scale
    rows = np.column_stack([*columns.values()])
    lines = [",".join(columns), *(",".join(f"{x:.8g}" for x in row) for row in rows.tolist())]
    write_text(path, "\n".join(lines) + "\n")


def spectrum(loop: Loop, sensors: Sensors, tilt: float, omega: Real, step: float = SAMPLE) -> NDArray[Any]:
    """Spectral matrices (m, c, c) of the sampled channels at ``omega`` (m,) rad/s: unit^2 per sample, aliasing and all.

    S = C (z - A)^-1 Q (z - A)^-H C' + R with z = exp(i omega step): the mean periodogram |sum y exp(-i omega k
    step)|^2 / N of a long ride without delays.
    """
    once, added = loop.sampled(step)
    rows, noise = sensors.rows(loop.outputs), sensors.noise_factor(tilt)
    z = np.exp(1j * omega * step)
    resolvent = z[:, None, None] * np.eye(len(once)) - once.T
    through = np.linalg.solve(resolvent, np.broadcast_to(rows.T, (len(z), *rows.T.shape)))
    seen = through.transpose(0, 2, 1) @ _factor(added)
    late = np.exp(-1j * omega[:, None] * np.array([sensors.delay.get(name, 0.0) for name in sensors.channels]))
    seen = late[:, :, None] * seen
    return np.asarray(seen @ seen.conj().transpose(0, 2, 1) + noise @ noise.T)
