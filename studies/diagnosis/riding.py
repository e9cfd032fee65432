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
from tyre.arrays import Array

RIDING = "riding."
FAMILY = "a torque of the rider or the wind that was not recorded"
PUSHES = ("lean_torque", "steer_torque", "lateral_force")
# By what each of two independent courses pushes: the rider leans, and a share (trail times a force) acts at the
# steering; the wind pushes the mass centre, and a share is a lean torque, for its point of attack is not known.
SHARES = {
    "pedalling": np.array([[1.0, 0.0, 0.0], [0.0, 0.03, 0.0]]), "rider_sway": np.array([[1.0, 0, 0], [0, 0.03, 0]]),
    "side_gusts": np.array([[0.0, 0.0, 1.0], [0.3, 0.0, 0.0]]),
}  # fmt: skip
CADENCE_HZ = np.arange(0.7, 2.05, 0.1)
CORNER_S = {"rider_sway": 0.4, "side_gusts": 0.3}  # s, correlation: a smooth process, and one that jumps
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

    sd: float
    hertz: tuple[float, ...] = ()


def riding_candidates() -> tuple[Candidate, ...]:
    """Candidates for torques that act on a ridden bicycle; nothing of them is fitted, all is integrated out."""
    return tuple(
        Candidate(
            name, (), fixed={RIDING + name: 1.0}, signature=words, title=TITLES[name], weight=SENSOR, family=FAMILY,
            absorbs=True,
        )
        for name, words in WORDS.items()
    )  # fmt: skip


def riding_in(values: Mapping[str, Array]) -> list[str]:
    """Names of the torques that act among parameter ``values``."""
    return [name for name in WORDS if RIDING + name in values]


def shapes(name: str, time: Array, hertz: float | None) -> Array:
    """Independent courses (T, k) of one torque of unit variance at ``time`` (T,), their coefficients of sd 1."""
    if name == "pedalling":
        turn = 2 * np.pi * np.multiply.outer(time - time[0], CADENCE_HZ if hertz is None else np.array([hertz]))
        return np.concatenate([np.cos(turn), np.sin(turn)], 1)
    nodes, own = _process(name, float(time[-1] - time[0]), min(NODES, len(time)))
    return np.stack([np.interp(time - time[0], nodes, column) for column in own.T], 1)


@lru_cache(maxsize=64)
def _process(name: str, duration: float, count: int) -> tuple[Array, Array]:
    """Principal components of a process, largest first: times (count,), and values (count, k)."""
    nodes = np.linspace(0.0, duration, count)
    apart = np.abs(nodes[:, None] - nodes) / CORNER_S[name]
    size, axes = np.linalg.eigh(np.exp(-(apart**2) / 2) if name == "rider_sway" else np.exp(-apart))
    most = 1 + int(np.searchsorted(np.cumsum(size[::-1]), KEPT * count * (1 if name == "rider_sway" else 0.95)))
    return nodes, (axes * np.sqrt(np.maximum(size, 0.0)))[:, ::-1][:, :most]


def most_probable(name: str, residual: Array, columns: Array, sizes: Array) -> Course:
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
    found = np.empty((len(options), len(sizes), len(residual)))
    for k, option in enumerate(options):
        u, s, _ = np.linalg.svd(columns[..., option], full_matrices=False)
        power = np.einsum("rnk,rn->rk", u, residual) ** 2
        grown = np.multiply.outer(sizes**2, s**2)  # (sizes, R, k)
        found[k] = (power * grown / (1 + grown) - np.log1p(grown)).sum(-1) / 2
    best = found.max(0).sum(1).argmax()
    hertz = tuple(CADENCE_HZ[found[:, best].argmax(0)].tolist()) if name == "pedalling" else ()
    return Course(float(sizes[best]), hertz)
