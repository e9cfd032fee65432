"""Wobble of a ride without an impulse: frequency and decay from the correlations of the recorded motions.

Covariance-driven stochastic subspace identification (Van Overschee & De Moor 1996, Subspace Identification for Linear
Systems, ch. 3, canonical variate weighting; Peeters & De Roeck 1999, Mechanical Systems and Signal Processing 13). The
motion is x' = A x under unknown noise, with outputs C x. The correlations of future outputs with past ones have the
column space of [C; C A; C A^2; ...]. Their singular vectors, whitened by future and past, are taken for several orders.
A pole of the motion is there at all of them, one of noise is not. Poles of a coloured input and of a rider in the loop
are poles as well, so that the row is that of the bicycle as ridden.

Standard uncertainties are those of a jackknife (Efron & Tibshirani 1993, ch. 11) over blocks of the ride.

Weave is not given. Its decay is as fast as that of inputs and rider, and an identification without a model was wrong
there by many times its own uncertainty.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from bicycle.identification.recording import Run
from bicycle.identification.ride_recording import Ride
from bicycle.model.eigen import damping_ratio, frequency_hz
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError

LOWEST_HZ, HIGHEST_HZ = 4.0, 12.0  # band of wobble; weave is below it
MOST_DAMPED = 0.2  # damping ratio of wobble, and of all poles that are compared
RATE = 50.0  # Hz; faster recordings are averaged to this or more
SLOWEST_RATE = 30.0  # Hz, 2.5 times the highest frequency
LAG = 0.6  # s, of the past and of the future: some periods of wobble
ORDERS = tuple(range(6, 31, 2))  # of the identified systems
FEWEST_ORDERS = 5  # over which a pole is the same
SAME_FREQUENCY = 0.01  # share by which a frequency may change from an order to the next
SAME_DAMPING = 0.2, 0.003  # change of a damping ratio from an order to the next: as a share, or by itself
BLOCKS = 20  # of a jackknife, if the segments are long
SHORTEST = 60.0  # s, of all segments at a speed
MOST_DOUBT = 0.3  # standard uncertainty of a decay over its size: an interval that excludes zero
LEAST_DECAY_OF_BLOCK = 2.0  # decay times the length of a block; blocks of a slower motion are not independent
TINY = 1e-9  # share of the variance that keeps channels apart which are computed from each other

REASONS = {  # why a speed has no row -> its words
    "rate": "{rate:.3g} samples per second are recorded, and {least:g} are needed",
    "short": "the segments last {duration:.3g} s together, and {least:g} s are needed",
    "no pole": "no lightly damped pole of {low:g} to {high:g} Hz is the same over {least} orders",
    "several": "poles of {hertz} Hz are the same over {least} orders; --start-hz chooses one",
    "doubtful": "the decay is {decay:.2g} 1/s, and its standard uncertainty of {sd:.2g} 1/s is above {most:.0%} of it",
    "slow": "a decay of {decay:.2g} 1/s is too slow for {duration:.3g} s; a limit cycle looks like that too",
}


@dataclass(frozen=True)
class Wobble:
    """Wobble of a ride at one speed, or why there is none."""

    run: str  # name of the recording
    speed: float  # m/s, mean
    duration: float  # s, of all segments at this speed
    eigenvalue: complex = complex("nan+nanj")  # 1/s
    sd: tuple[float, float] = (math.nan, math.nan)  # of both parts, 1/s: 1.96 of it to both sides is the 95 % interval
    orders: tuple[int, ...] = ()  # in which the pole is the same
    rejected: str = ""  # why there is no row; empty if there is one

    def row(self) -> dict[str, str | float]:
        """Row of a modal table: speed (m/s), mode, eigenvalue (1/s, rad/s) and its standard uncertainties."""
        return {
            "speed_m_s": self.speed,
            "mode": "wobble",
            "real_1_s": self.eigenvalue.real,
            "imag_rad_s": self.eigenvalue.imag,
            "real_sd_1_s": self.sd[0],
            "imag_sd_rad_s": self.sd[1],
        }


@dataclass(frozen=True, eq=False)
class _Products:
    """Sums of products of past and future outputs in b blocks of a ride, of h numbers each."""

    sums: Array  # (b, 2 h, 2 h), the past first
    counts: Array  # (b,), products in each sum
    channels: int
    step: float  # s

    def mean(self, without: int | None = None) -> Array:
        """Covariance (2 h, 2 h) of past and future, of all blocks or ``without`` one."""
        sums, counts = self.sums, self.counts
        if without is not None:
            sums = np.delete(sums, without, axis=0)
            counts = np.delete(counts, without)
        return np.asarray(sums.sum(0) / counts.sum())


Column = dict[int, complex]
"""A pole (1/s) that is the same over successive orders."""


def identify_wobble(ride: Ride, *, start_hz: float | None = None) -> tuple[Wobble, ...]:
    """Wobble of a ride at each of its speeds, of the segments of nearly one speed together.

    Of several poles the one nearest to ``start_hz`` (Hz) is taken; without it several sound ones give no row. The
    result is ordered by speed. Raises InputError where ``start_hz`` is outside the band of wobble.
    """
    if start_hz is not None and not LOWEST_HZ <= start_hz <= HIGHEST_HZ:
        raise InputError(f"start_hz = {start_hz:g} is outside the band of wobble, {LOWEST_HZ:g} to {HIGHEST_HZ:g} Hz")
    runs_by_group: dict[str, list[Run]] = {}
    for run in ride.segments:
        runs_by_group.setdefault(run.group, []).append(run)
    wobbles = [_identify(ride.name, runs, start_hz) for runs in runs_by_group.values()]
    return tuple(sorted(wobbles, key=lambda wobble: wobble.speed))


def _identify(name: str, runs: Sequence[Run], start_hz: float | None) -> Wobble:
    """Identify the wobble of the segments ``runs`` at one speed."""
    durations = [run.step * len(run.time) for run in runs]
    speed = float(np.average([run.speed for run in runs], weights=durations))
    wobble = Wobble(name, speed, sum(durations))
    rate = 1 / max(run.step for run in runs)
    if rate < SLOWEST_RATE:
        return _reject(wobble, "rate", rate=rate, least=SLOWEST_RATE)
    if wobble.duration < SHORTEST:
        return _reject(wobble, "short", duration=wobble.duration, least=SHORTEST)

    products = _sum_products(runs)
    columns = _stable_columns(_poles_by_order(products, products.mean()))
    if not columns:
        return _reject(wobble, "no pole", low=LOWEST_HZ, high=HIGHEST_HZ, least=FEWEST_ORDERS)
    weighed = [_weigh(wobble, products, column) for column in columns]
    if start_hz is not None:
        return min(weighed, key=lambda found: abs(_hertz(found.eigenvalue) - start_hz))
    sound = [found for found in weighed if not found.rejected]
    if len(sound) > 1:
        hertz = " and ".join(f"{value:.2f}" for value in sorted(_hertz(found.eigenvalue) for found in sound))
        return _reject(wobble, "several", hertz=hertz, least=FEWEST_ORDERS)
    return (sound or weighed)[0]


def _reject(wobble: Wobble, reason: str, **numbers: float | str) -> Wobble:
    """State why a speed has no row."""
    return replace(wobble, rejected=REASONS[reason].format(**numbers))


def _weigh(wobble: Wobble, products: _Products, column: Column) -> Wobble:
    """Give eigenvalue and standard uncertainties of a pole; reject those that mean nothing."""
    eigenvalue, sd = _average_orders(products, column)
    wobble = replace(wobble, eigenvalue=eigenvalue, sd=(sd, sd), orders=tuple(column))
    decay = -eigenvalue.real
    if sd > MOST_DOUBT * decay:
        return _reject(wobble, "doubtful", decay=decay, sd=sd, most=MOST_DOUBT)
    block = float(np.median(products.counts)) * products.step
    if decay * block < LEAST_DECAY_OF_BLOCK:
        return _reject(wobble, "slow", decay=decay, duration=wobble.duration)
    return wobble


# ---------------------------------------------------------------------------------------------- products


def _sum_products(runs: Sequence[Run]) -> _Products:
    """Sum the products of past and future outputs in blocks of about one length; no block spans two segments."""
    common = [name for name in runs[0].channels if all(name in run.channels for run in runs)]
    averaged = max(1, math.floor(1 / (RATE * max(run.step for run in runs)) + 1e-6))  # samples
    step = averaged * float(np.mean([run.step for run in runs]))
    signals = [_average_samples(np.stack([run.channels[name] for name in common]), averaged) for run in runs]
    scale = np.sqrt(np.mean([signal.var(axis=1) for signal in signals], axis=0))
    lags = round(LAG / step)
    windows = [_windows(signal / scale[:, None], 2 * lags) for signal in signals]
    usual = sum(len(window) for window in windows) / BLOCKS
    blocks: list[Array] = []
    for window in windows:
        blocks += np.array_split(window, max(1, round(len(window) / usual)))
    sums = np.stack([block.T @ block for block in blocks])
    return _Products(sums, np.array([float(len(block)) for block in blocks]), len(common), step)


def _average_samples(signals: Array, count: int) -> Array:
    """Average ``signals`` (c, n) over ``count`` samples each, less mean and straight trend: (c, n / count)."""
    channels, n = signals.shape
    whole = n // count * count
    averages = signals[:, :whole].reshape(channels, -1, count).mean(axis=2)
    return np.asarray(scipy.signal.detrend(averages))


def _windows(signals: Array, length: int) -> Array:
    """Cut ``signals`` (c, n) into all windows of ``length`` samples, by time and then channel: (windows, length c)."""
    windows = np.lib.stride_tricks.sliding_window_view(signals, length, axis=1)  # (c, windows, length)
    return windows.transpose(1, 2, 0).reshape(windows.shape[1], -1)


# ---------------------------------------------------------------------------------------------- poles


def _poles_by_order(products: _Products, covariance: Array) -> dict[int, Complex]:
    """Poles (1/s) above the real axis of the systems of all orders."""
    half = len(covariance) // 2
    spread = covariance + TINY * np.trace(covariance) / len(covariance) * np.eye(len(covariance))
    past = np.linalg.cholesky(spread[:half, :half])
    future = np.linalg.cholesky(spread[half:, half:])
    whitened = scipy.linalg.solve_triangular(future, spread[half:, :half], lower=True)
    whitened = scipy.linalg.solve_triangular(past, whitened.T, lower=True).T
    vectors, values, _ = np.linalg.svd(whitened)
    observed = future @ vectors[:, :half] * np.sqrt(values)  # (h, h), columns of [C; C A; ...]
    poles: dict[int, Complex] = {}
    for order in ORDERS:
        if order >= half - products.channels:
            break
        earlier = observed[: -products.channels, :order]
        later = observed[products.channels :, :order]
        matrix = np.linalg.lstsq(earlier, later, rcond=None)[0]
        roots = np.log(np.linalg.eigvals(matrix).astype(complex)) / products.step
        poles[order] = roots[roots.imag > 0]
    return poles


def _stable_columns(poles: dict[int, Complex]) -> list[Column]:
    """Find the poles in the band of wobble that are the same over enough successive orders."""
    ended: list[Column] = []
    growing: list[Column] = []
    for order, roots in poles.items():
        left = [complex(root) for root in roots if _may_be_wobble(complex(root))]
        continued: list[Column] = []
        for column in sorted(growing, key=len, reverse=True):
            last = [*column.values()][-1]
            near = min(left, key=lambda root: abs(root - last), default=None)
            if near is None or not _is_same(last, near):
                ended.append(column)
                continue
            left.remove(near)
            continued.append({**column, order: near})
        growing = continued + [{order: root} for root in left]
    stable = [column for column in (*ended, *growing) if len(column) >= FEWEST_ORDERS]
    return [*_without_doubles(stable)]


def _without_doubles(columns: Sequence[Column]) -> Iterator[Column]:
    """Keep the longest of the columns of one frequency, whose pole was lost at some order and came again."""
    kept: list[float] = []  # Hz
    for column in sorted(columns, key=len, reverse=True):
        hertz = _hertz(complex(np.mean([*column.values()])))
        if all(abs(hertz / other - 1) > 3 * SAME_FREQUENCY for other in kept):
            kept.append(hertz)
            yield column


def _may_be_wobble(root: complex) -> bool:
    """True if frequency and damping ratio of a pole (1/s) are those of wobble."""
    return LOWEST_HZ <= _hertz(root) <= HIGHEST_HZ and 0 < float(damping_ratio(root)) < MOST_DAMPED


def _is_same(one: complex, other: complex) -> bool:
    """True if two poles (1/s) of successive orders are one."""
    ratio = float(damping_ratio(one))
    share, change = SAME_DAMPING
    same_damping = abs(float(damping_ratio(other)) - ratio) < max(share * ratio, change)
    return abs(other.imag / one.imag - 1) < SAME_FREQUENCY and same_damping


def _hertz(root: complex) -> float:
    """Frequency of a pole (1/s), Hz."""
    return float(frequency_hz(root))


def _average_orders(products: _Products, column: Column) -> tuple[complex, float]:
    """Average a pole (1/s) over its orders, with the standard uncertainty of either part (1/s).

    The weight of an order is the inverse of its variance by the jackknife. To the variance of the average that of the
    orders about it is added: a low order is precise and may be biased. Both parts of a lightly damped pole have one
    variance, decay / duration where the noise is white, so that it is estimated from both.
    """
    estimates = np.array([*column.values()])
    count = len(products.counts)
    parts = []  # the same pole without each block
    for block in range(count):
        poles = _poles_by_order(products, products.mean(without=block))
        parts.append([poles[order][np.argmin(np.abs(poles[order] - root))] for order, root in column.items()])
    deviations = np.array(parts) - np.mean(parts, axis=0)  # (blocks, orders)
    weights = 1 / (np.abs(deviations) ** 2).sum(0)
    weights /= weights.sum()
    average = complex(estimates @ weights)
    jackknife = (count - 1) / count * float((np.abs(deviations @ weights) ** 2).sum())
    between = float(weights @ np.abs(estimates - average) ** 2)
    return average, math.sqrt((jackknife + between) / 2)
