"""Torques of a ride that nobody recorded: pedalling, a rider who sways, gusts. Each run has its own course of them.

Each is a normal process, whose course in a run is integrated out like an initial state. Its standard deviation is the
most probable one (empirical Bayes), like that of the noise.
"""

from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from studies.diagnosis.mistakes import SENSOR
from studies.inference.parameter import Candidate
from tyre.ground.arrays import Array

RIDING = "riding."
FAMILY = "a torque of the rider or the wind that was not recorded"
PUSHES = ("lean_torque", "steer_torque", "lateral_force")
# By what each of two independent courses pushes: the rider leans, and a share (trail times a force) acts at the
# steering; the wind pushes the mass centre, and a share is a lean torque, for its point of attack is not known.
SHARES = {
    "pedalling": np.array([[1.0, 0.0, 0.0], [0.0, 0.03, 0.0]]),
    "rider_sway": np.array([[1.0, 0, 0], [0, 0.03, 0]]),
    "side_gusts": np.array([[0.0, 0.0, 1.0], [0.3, 0.0, 0.0]]),
}
CADENCE_HZ = np.arange(0.7, 2.05, 0.1)
CORNER_S = {"rider_sway": 0.4, "side_gusts": 0.3}  # s, correlation: a smooth process, and one that jumps
POWER = {"rider_sway": 2, "side_gusts": 1}  # of their correlation exp(-x^power / power), x = time / corner
LEAN, STEER, CORNER = ("lean_torque_rms", "N m"), ("steer_torque_rms", "N m"), ("corner_frequency", "Hz")
SIZED = {
    "pedalling": (LEAN, STEER, ("frequency", "Hz")),
    "rider_sway": (LEAN, STEER, CORNER),
    "side_gusts": (("side_force_rms", "N"), LEAN, CORNER),
}
Sizes = dict[str, tuple[float, float, str]]
TITLES = {
    "pedalling": "torque of pedalling",
    "rider_sway": "slow lean torque of a rider",
    "side_gusts": "gusts or a rough road",
}
WORDS = {
    "pedalling": "a periodic lean torque, as of pedalling, between 0.7 and 2 Hz",
    "rider_sway": "a lean torque that changes slowly, as of a rider who sways",
    "side_gusts": "a side force that changes at random within a second, as of gusts or a rough road",
}
NODES, KEPT = 200, 0.995  # at which a process is known, share of its variance that is kept


class Course(NamedTuple):
    """Most probable size of one torque: its sd in N m (N of a force), and the frequency of each run in Hz, if any."""

    sd: float  # N m, of side gusts N
    hertz: tuple[float, ...] = ()  # (R,), cadence of each run; () where a torque has none


def riding_candidates() -> tuple[Candidate, ...]:
    """Candidates for torques that act on a ridden bicycle; nothing of them is fitted, all is integrated out."""
    return tuple(
        Candidate(
            name,
            (),
            fixed={RIDING + name: 1.0},
            signature=words,
            title=TITLES[name],
            weight=SENSOR,
            family=FAMILY,
            absorbs=True,
        )
        for name, words in WORDS.items()
    )


def riding_in(values: Mapping[str, Array]) -> list[str]:
    """Names of the torques that act among parameter ``values``."""
    return [name for name in WORDS if RIDING + name in values]


def shapes(name: str, time: Array, hertz: float | None) -> Array:
    """Independent courses (T, k) of one torque of unit variance at ``time`` (T,), their coefficients of sd 1."""
    if name == "pedalling":
        turn = 2 * np.pi * np.multiply.outer(time - time[0], CADENCE_HZ if hertz is None else np.array([hertz]))
        return np.concatenate([np.cos(turn), np.sin(turn)], 1)
    nodes, components = _process(name, float(time[-1] - time[0]), min(NODES, len(time)))
    return np.stack([np.interp(time - time[0], nodes, column) for column in components.T], 1)


@lru_cache(maxsize=64)
def _process(name: str, duration: float, count: int) -> tuple[Array, Array]:
    """Principal components of a process, largest first: times (count,), and values (count, k)."""
    nodes = np.linspace(0.0, duration, count)
    distance = np.abs(nodes[:, None] - nodes) / CORNER_S[name]
    size, axes = np.linalg.eigh(np.exp(-(distance ** POWER[name]) / POWER[name]))
    most = 1 + int(np.searchsorted(np.cumsum(size[::-1]), KEPT * count * (1 if name == "rider_sway" else 0.95)))
    return nodes, (axes * np.sqrt(np.maximum(size, 0.0)))[:, ::-1][:, :most]


def find_course(name: str, residual: Array, columns: Array, sizes: Array) -> Course:
    """Course of the torque ``name`` with the largest evidence among ``sizes`` (sd, N m).

    ``residual`` (R, n) are whitened runs with their starts integrated out, ``columns`` (R, n, k) what each coefficient
    of sd 1 N m adds; of pedalling, of every frequency. ln p = sum (u' r)^2 g / 2 - ln(1 + s^2) / 2, g = s^2/(1 + s^2).
    """
    if not (np.isfinite(columns).all() and np.isfinite(residual).all()):  # the bicycle has fallen
        return Course(float(sizes[0]), (1.0,) * len(residual) * (name == "pedalling"))
    options = [slice(None)]
    if name == "pedalling":
        count = len(CADENCE_HZ)
        options = [slice(k, None, count) for k in range(count)]
    evidence = np.empty((len(options), len(sizes), len(residual)))
    for k, option in enumerate(options):
        u, s, _ = np.linalg.svd(columns[..., option], full_matrices=False)
        power = np.einsum("rnk,rn->rk", u, residual) ** 2
        grown = np.multiply.outer(sizes**2, s**2)  # (sizes, R, k)
        evidence[k] = (power * grown / (1 + grown) - np.log1p(grown)).sum(-1) / 2
    best = evidence.max(0).sum(1).argmax()
    hertz = tuple(CADENCE_HZ[evidence[:, best].argmax(0)].tolist()) if name == "pedalling" else ()
    return Course(float(sizes[best]), hertz)


def estimate_sizes(name: str, times: list[Array], residual: Array, columns: Array, sizes: Array) -> Sizes:
    """Root mean square over all runs of the course of a torque that is clearer, and its frequency: mean, sd and unit.

    Arguments as of :func:`find_course`. The coefficients are normal, given the size of the first course, that of the
    second to it, and the frequency, that of a run or the corner of all; over these is averaged by their evidence.
    """
    terms, half, periodic, s = [], columns.shape[-1] // 2, name == "pedalling", sizes[:, None, None]
    for time, white, push in zip(times, residual, columns, strict=True):
        unit_courses = shapes(name, time, None)
        if periodic:
            hertz = np.linspace(CADENCE_HZ[0], CADENCE_HZ[-1], 66)
            mixing = np.linalg.pinv(unit_courses, rcond=1e-6) @ np.array([shapes(name, time, f) for f in hertz])
        else:
            nodes, base = _process(name, float(time[-1] - time[0]), min(NODES, len(time)))
            corner = CORNER_S[name] * np.geomspace(5, 0.2, 9)
            inverse = np.linalg.pinv(base)
            distance = np.abs(nodes[:, None] - nodes) / corner[:, None, None]
            hertz = (2 * np.log(2)) ** (POWER[name] / 2 - 0.5) / (2 * np.pi * corner)  # half of the power density
            spread = inverse @ np.exp(-(distance ** POWER[name]) / POWER[name]) @ inverse.T
            mixing = np.linalg.cholesky(spread + 1e-9 * np.eye(len(inverse)))
        push = np.hstack([push[:, : unit_courses.shape[1]], push[:, half : half + unit_courses.shape[1]]])
        in_all = np.sum((unit_courses @ mixing) ** 2, (1, 2), keepdims=True)
        square = unit_courses.T @ unit_courses / in_all  # of variance 1 in all
        for ratio in np.geomspace(0.3, 30.0, 6):  # of the second course to its share
            pair_mixing = np.kron(np.diag([1.0, ratio]), mixing)
            gain, axes = np.linalg.eigh(pair_mixing.swapaxes(-1, -2) @ (push.T @ push) @ pair_mixing)
            axes = pair_mixing @ axes
            pull = white @ push @ axes
            spread_left = 1 / (s**-2 + np.maximum(gain, 0.0))  # variances (S, F, 2 m)
            terms.append((spread_left * pull**2 + np.log(spread_left / s**2)).sum(-1) / 2)
            for part in np.split(axes, 2, 1):
                power = part.swapaxes(-1, -2) @ square @ part * len(time) / sum(map(len, times))
                weighted, crossed = (
                    (p @ x[..., None])[..., 0] for p, x in ((power, spread_left * pull), (power**2, spread_left))
                )
                terms.append((weighted * spread_left * pull + np.diagonal(power, 0, 1, 2) * spread_left).sum(-1))
                terms.append((4 * weighted**2 * spread_left + 2 * crossed * spread_left).sum(-1))
    stacked = np.array(terms).reshape(len(times), -1, 5, *terms[0].shape)  # (R, ratios, 5, S, F)
    evidence, mean, variance = stacked[:, :, :1], stacked[:, :, 1::2], stacked[:, :, 2::2]
    share = np.ones_like(evidence)
    if periodic:
        total = np.logaddexp.reduce(evidence, -1, keepdims=True)
        evidence, share = total, np.exp(evidence - total)
        second, mean = ((share * x).sum(-1, keepdims=True) for x in (variance + mean**2, mean))
        variance = second - mean**2
    weight = np.exp(evidence.sum(0) - evidence.sum(0).max())  # (ratios, 1, S, F)
    weight, mean, variance = weight / weight.sum(), mean.sum(0), variance.sum(0)
    over = (weight * share).sum((0, 1, 2, 3)) / len(times)
    value = np.append((weight * np.sqrt(mean)).sum((0, 2, 3)), over @ hertz)
    square = np.append(
        (weight * (mean + variance / (4 * mean))).sum((0, 2, 3)), over @ (hertz**2 + np.gradient(hertz) ** 2 / 12)
    )
    factor = np.append(SHARES[name].max(1), 1.0)  # N m or N, Hz
    value, sd = factor * value, factor * np.sqrt(square - value**2)
    first = int(periodic and value[1] * sd[0] > value[0] * sd[1])  # of a process the second takes what is too fast
    reported = (first, 2) if over[0] + over[-1] < 0.05 else (first,)
    return {SIZED[name][k][0]: (float(value[k]), float(sd[k]), SIZED[name][k][1]) for k in reported}
