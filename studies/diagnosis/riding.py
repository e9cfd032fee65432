"""Unrecorded torques of a ride: pedalling, a rider who sways, gusts. Each run has its own course of them.

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
FAMILY = "an unrecorded torque of the rider or the wind"
PUSHES = ("lean_torque", "steer_torque", "lateral_push")
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
    "side_gusts": "a random side force of the air or the road, correlated within a second",
}
NODES, KEPT = 200, 0.995  # at which a process is known, share of its variance that is kept
RATIOS = np.geomspace(0.3, 30.0, 6)  # trial sizes of the second course, in shares of SHARES


class TorqueSize(NamedTuple):
    """Most probable size of a torque of the ride as a random process, and its cadence if it is periodic."""

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


def acting_torques(values: Mapping[str, Array]) -> list[str]:
    """Names of the torques of the ride that are among the parameter ``values`` of a model."""
    return [name for name in WORDS if RIDING + name in values]


def basis_courses(name: str, time: Array, hertz: float | None) -> Array:
    """Basis (T, k) of the courses of a torque at ``time`` (T,), s: times weights of sd 1, a course of variance 1.

    Of pedalling, cosine and sine of the cadence ``hertz``; None: first the cosines of all CADENCE_HZ, then the sines.
    Of other torques, the principal components of the process, whatever ``hertz``.
    """
    if name == "pedalling":
        cadences = CADENCE_HZ if hertz is None else np.array([hertz])
        phase = 2 * np.pi * np.multiply.outer(time - time[0], cadences)
        return np.concatenate([np.cos(phase), np.sin(phase)], 1)
    nodes, components = _principal_components(name, float(time[-1] - time[0]), min(NODES, len(time)))
    return np.stack([np.interp(time - time[0], nodes, column) for column in components.T], 1)


@lru_cache(maxsize=64)
def _principal_components(name: str, duration: float, count: int) -> tuple[Array, Array]:
    """Times (count,), s, from 0 to ``duration``, and principal components (count, k) there of a unit process.

    The largest first, each times the sd of its weight; as many as hold 99.5 % of the variance, of gusts 94.5 %.
    """
    nodes = np.linspace(0.0, duration, count)
    distance = np.abs(nodes[:, None] - nodes) / CORNER_S[name]
    variances, axes = np.linalg.eigh(np.exp(-(distance ** POWER[name]) / POWER[name]))
    share = KEPT * (1 if name == "rider_sway" else 0.95)  # gusts jump: their last variance is in many components
    most = 1 + int(np.searchsorted(np.cumsum(variances[::-1]), share * count))
    return nodes, (axes * np.sqrt(np.maximum(variances, 0.0)))[:, ::-1][:, :most]


def estimate_torque_size(name: str, residual: Array, columns: Array, sizes: Array) -> TorqueSize:
    """Most probable sd of the torque ``name`` among ``sizes`` (S,), N m (gusts: N), and cadence of each run, Hz.

    ``residual`` (R, n) is the whitened one of R runs, ``columns`` (R, n, k) the whitened responses to the basis of its
    two courses, k/2 each, with weights 1 N m; starts are integrated out of both. With u s v' = columns, g = s^2 size^2,
    ln p = sum (u' residual)^2 g / (1 + g) / 2 - ln(1 + g) / 2.
    """
    periodic = name == "pedalling"
    if not (np.isfinite(columns).all() and np.isfinite(residual).all()):  # the bicycle has fallen
        return TorqueSize(float(sizes[0]), (1.0,) * len(residual) if periodic else ())

    # The columns of one cadence are its cosine and sine, of both courses.
    options = [slice(k, None, len(CADENCE_HZ)) for k in range(len(CADENCE_HZ))] if periodic else [slice(None)]
    evidence = np.empty((len(options), len(sizes), len(residual)))
    for k, option in enumerate(options):
        u, s, _ = np.linalg.svd(columns[..., option], full_matrices=False)
        projected_squared = np.einsum("rnk,rn->rk", u, residual) ** 2
        gain = np.multiply.outer(sizes**2, s**2)  # (S, R, k)
        evidence[k] = (projected_squared * gain / (1 + gain) - np.log1p(gain)).sum(-1) / 2

    # One size for all runs, while each run has its own best cadence.
    best = evidence.max(0).sum(1).argmax()
    hertz = tuple(CADENCE_HZ[evidence[:, best].argmax(0)].tolist()) if periodic else ()
    return TorqueSize(float(sizes[best]), hertz)


class _RunMoments(NamedTuple):
    """Likelihood of one run, and mean square of both courses in it, by ratio, size S and frequency F."""

    log_evidence: Array  # (ratios, S, F)
    mean: Array  # (ratios, 2, S, F), (units of the size)^2, expected share of the run in the mean square of all runs
    variance: Array  # (ratios, 2, S, F), of that share


def posterior_sizes(name: str, times: list[Array], residual: Array, columns: Array, sizes: Array) -> Sizes:
    """Posterior mean, sd and unit of the rms over all runs (N m or N) of a torque, and of its frequency (Hz), by name.

    Of the two courses by which the torque acts, the one with the smaller relative sd; without the frequency if the ends
    of its range are probable. ``times`` (T,), s, of each run; others as of :func:`estimate_torque_size`. Averaged, by
    their evidence, over ``sizes`` of the first course, sizes of the second to it, and frequencies: the cadence of each
    run, or the corner that all runs share.
    """
    periodic = name == "pedalling"
    duration = sum(map(len, times))
    by_run = []
    for time, white, responses in zip(times, residual, columns, strict=True):
        hertz, square, mixing = _trial_frequencies(name, time)
        count, half = len(square[0]), responses.shape[-1] // 2  # behind ``count``, columns that only longer runs have
        both = np.hstack([responses[:, :count], responses[:, half : half + count]])
        by_run.append(_integrate_weights(white, both, mixing, square * len(time) / duration, sizes))
    log_evidence, mean, variance = (np.array(part) for part in zip(*by_run, strict=True))  # (R, ratios, ...)
    log_evidence = log_evidence[:, :, None]

    # Each run has its own cadence: averaged within the run, where a process has one corner in all.
    run_share = np.ones_like(log_evidence)
    if periodic:
        total = np.logaddexp.reduce(log_evidence, -1, keepdims=True)
        run_share = np.exp(log_evidence - total)
        log_evidence = total
        second_moment = (run_share * (variance + mean**2)).sum(-1, keepdims=True)
        mean = (run_share * mean).sum(-1, keepdims=True)
        variance = second_moment - mean**2

    # Runs are independent: their evidence is multiplied, and their shares of the mean square add up.
    weight = np.exp(log_evidence.sum(0) - log_evidence.sum(0).max())  # (ratios, 1, S, F, or 1)
    weight, mean, variance = weight / weight.sum(), mean.sum(0), variance.sum(0)
    frequency_share = (weight * run_share).sum((0, 1, 2, 3)) / len(times)  # (F,)

    # First and second moment of the rms of both courses and of the frequency; a cell of the grid has a width.
    rms = (weight * np.sqrt(mean)).sum((0, 2, 3))
    rms_squared = (weight * (mean + variance / (4 * mean))).sum((0, 2, 3))
    value = np.append(rms, frequency_share @ hertz)
    squared = np.append(rms_squared, frequency_share @ (hertz**2 + np.gradient(hertz) ** 2 / 12))
    factor = np.append(SHARES[name].max(1), 1.0)  # N m or N by unit of the size, Hz
    value, sd = factor * value, factor * np.sqrt(squared - value**2)

    # Of a process, always the first course: the second takes what is too fast for the first.
    clearer = int(periodic and value[1] * sd[0] > value[0] * sd[1])
    reported = (clearer, 2) if frequency_share[0] + frequency_share[-1] < 0.05 else (clearer,)
    return {SIZED[name][k][0]: (float(value[k]), float(sd[k]), SIZED[name][k][1]) for k in reported}


def _trial_frequencies(name: str, time: Array) -> tuple[Array, Array, Array]:
    """Trial frequencies (F,), Hz, and for basis weights the form of the mean square and the covariance's root at each.

    With weights w of :func:`basis_courses` (None), k of them: the mean square in the run is w' square w, (F, k, k), and
    w = mixing e, (F, k, j), gives them the covariance of that frequency, the e independent of sd 1.
    """
    basis = basis_courses(name, time, None)
    if name == "pedalling":
        hertz = np.linspace(CADENCE_HZ[0], CADENCE_HZ[-1], 66)
        mixing = np.linalg.pinv(basis, rcond=1e-6) @ np.array([basis_courses(name, time, f) for f in hertz])
    else:
        nodes, components = _principal_components(name, float(time[-1] - time[0]), min(NODES, len(time)))
        corner = CORNER_S[name] * np.geomspace(5, 0.2, 9)  # s
        hertz = (2 * np.log(2)) ** (POWER[name] / 2 - 0.5) / (2 * np.pi * corner)  # half of the power density
        distance = np.abs(nodes[:, None] - nodes) / corner[:, None, None]
        to_weights = np.linalg.pinv(components)
        covariance = to_weights @ np.exp(-(distance ** POWER[name]) / POWER[name]) @ to_weights.T
        mixing = np.linalg.cholesky(covariance + 1e-9 * np.eye(len(to_weights)))
    total = np.sum((basis @ mixing) ** 2, (1, 2), keepdims=True)
    return hertz, basis.T @ basis / total, mixing  # the expected mean square is 1 at every frequency


def _integrate_weights(white: Array, columns: Array, mixing: Array, square: Array, sizes: Array) -> _RunMoments:
    """Integrate the normal weights of both courses out of one run: its evidence, and moments of their mean squares.

    ``white`` (n,) residual, ``columns`` (n, 2 k) responses to the weights of both courses; ``mixing`` (F, k, j) and
    ``square`` (F, k, k) as of :func:`_trial_frequencies`, the latter times the share of the run in all samples.
    """
    s = sizes[:, None, None]
    moments = []
    for ratio in RATIOS:
        # Along these axes the weights are independent a priori (variance s^2) and a posteriori.
        pair_mixing = np.kron(np.diag([1.0, ratio]), mixing)
        gain, axes = np.linalg.eigh(pair_mixing.swapaxes(-1, -2) @ (columns.T @ columns) @ pair_mixing)
        axes = pair_mixing @ axes
        projected = white @ columns @ axes
        variances = 1 / (s**-2 + np.maximum(gain, 0.0))  # (S, F, 2 j)
        means = variances * projected
        log_evidence = (means * projected + np.log(variances / s**2)).sum(-1) / 2

        # Mean and variance of a quadratic form of normal weights, for the first and for the second course.
        expected, scatter = [], []
        for part in np.split(axes, 2, 1):
            form = part.swapaxes(-1, -2) @ square @ part  # (F, 2 j, 2 j)
            form_means = (form @ means[..., None])[..., 0]
            form_variances = (form**2 @ variances[..., None])[..., 0]
            expected.append((form_means * means + np.diagonal(form, 0, 1, 2) * variances).sum(-1))
            scatter.append((4 * form_means**2 * variances + 2 * form_variances * variances).sum(-1))
        moments.append((log_evidence, np.array(expected), np.array(scatter)))
    log_evidences, expected_by_ratio, scatter_by_ratio = (np.array(part) for part in zip(*moments, strict=True))
    return _RunMoments(log_evidences, expected_by_ratio, scatter_by_ratio)
