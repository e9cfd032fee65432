"""Noise of a recording: its size and its colour."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from tyre.ground.arrays import Array
from tyre.ground.workers import one_blas_thread
from tyre.recordings.recording import Channel


def correlated_covariance(jacobian: NDArray[np.float64], residual: Channel) -> tuple[NDArray[np.float64], float]:
    """Covariance (J'J)^-1 J' R J (J'J)^-1 of fitted parameters, R the covariance of white plus AR(1) residuals.

    R_ij = white [i = j] + correlated phi^|i - j|. The constants come from restricted maximum likelihood (Patterson &
    Thompson, 1971), which allows for the part of slow noise that the fit itself has swallowed; the plain autocovariance
    of residuals does not.
    """
    n, p = jacobian.shape
    white, correlated, phi = noise_constants(jacobian, residual)
    # by how much each residual moves each parameter: J'J would square the error of rounding in a narrow valley
    lengths = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    influence = (np.linalg.pinv(jacobian / lengths, rcond=1e-7) / lengths[:, None]).T
    earlier = scipy.signal.lfilter([0.0, phi], [1.0, -phi], influence, axis=0)
    overlap = influence.T @ earlier
    covariance = (white + correlated) * influence.T @ influence + correlated * (overlap + overlap.T)
    # spectral weight at low frequency, where a fit feels the noise: white, against AR(1) times its correlation length
    slow = correlated * (1.0 + phi) / (1.0 - phi) if phi > 0.0 else 0.0
    share = slow / (slow + white) if slow > 0.0 else 0.0
    repeats = max(2.5, n * (1.0 - phi**2) / (1.0 + phi**2) - p)
    dof = 1.0 / (share**2 / repeats + (1.0 - share) ** 2 / max(n - p, 1))
    return covariance, dof


def noise_constants(jacobian: NDArray[np.float64], residual: Channel) -> tuple[float, float, float]:
    """Variances of the white and the AR(1) part of residuals, and the memory phi of the latter per sample."""
    n, p = jacobian.shape
    width = max(1, n // 120)  # the AR(1) part is slow: 120 averages hold its constants, and take a few milliseconds
    count = n // width
    basis, _ = np.linalg.qr(jacobian)
    x = basis[: count * width].reshape(count, width, p).mean(axis=1)
    y = residual[: count * width].reshape(count, width).mean(axis=1)
    power = float(y @ y) / count
    if power <= 0.0 or count <= p + 5:
        return float(residual @ residual) / max(n - p, 1), 0.0, 0.0
    columns = np.column_stack([x, y / np.sqrt(power)])

    def whitened(z: Channel) -> tuple[float, float, float]:
        """Share and memory of the AR(1) part, and twice the negative restricted log likelihood but for a constant."""
        by_share, by_memory = np.clip(z, -12.0, 12.0)  # a search that tries steps far out meets the light prior alone
        share, memory = 1.0 / (1.0 + np.exp(-by_share)), np.exp(-np.exp(-by_memory))
        # white + AR(1) is an ARMA(1, 1) process: its innovations come from one recursive filter
        power_0 = share * (1.0 - memory**2) + (1.0 - share) * (1.0 + memory**2)
        ratio = memory * (1.0 - share) / power_0
        theta = 2.0 * ratio / (1.0 + np.sqrt(max(1.0 - 4.0 * ratio**2, 0.0)))
        innovation = power_0 / (1.0 + theta**2)
        innovations = scipy.signal.lfilter([1.0, -memory], [1.0, -theta], columns, axis=0) / np.sqrt(innovation)
        innovations[0] *= np.sqrt(innovation)  # nothing predicts the first value: it has the variance of the process
        try:  # the last entry of the triangle is what the fit leaves
            triangle = np.abs(np.diag(np.linalg.cholesky(innovations.T @ innovations)))
        except np.linalg.LinAlgError:  # singular to rounding
            triangle = np.abs(np.diag(np.linalg.qr(innovations, mode="r")))
        logdet = (count - 1) * np.log(innovation) + 2.0 * float(np.sum(np.log(triangle[:p])))
        projected = max(float(triangle[p] ** 2), 1e-300)
        penalty = 0.004 * float(z @ z)  # keeps an undetermined share or memory from running away
        return projected, float(memory), logdet + (count - p) * np.log(projected) + penalty

    def unlikelihood(z: Channel) -> float:
        return whitened(z)[2]

    # A simplex from (0, 1) hardly moves along the share, and where it stops hangs on rounding.
    search: Any = scipy.optimize.minimize
    best = _settle_minimum(unlikelihood, search(unlikelihood, [0.0, 1.0], method="BFGS", jac="3-point").x)
    projected, memory, _ = whitened(best)
    share = 1.0 / (1.0 + np.exp(-np.clip(best[0], -12.0, 12.0)))
    variance = power * projected / (count - p)
    phi = float(memory ** (1.0 / width))
    lags = np.arange(1, width)
    averaging = (width + 2.0 * float(np.sum((width - lags) * phi**lags))) / width**2
    return float((1.0 - share) * variance * width), float(share * variance / averaging), phi


def _settle_minimum(function: Callable[[Channel], float], start: Channel) -> Channel:
    """Return where central differences of a function vanish, near a point (k,) at which a search ended.

    A search that compares values stops where their rounding hides the rest of the way. Here that moved the degrees of
    freedom by 5e-8 from one processor to another.
    """
    steps = 1e-3 * np.eye(start.size)  # so long that rounding is 1e-10 of a slope

    def slopes(z: Channel) -> list[float]:
        return [(function(z + step) - function(z - step)) / 2e-3 for step in steps]

    search: Any = scipy.optimize.root
    settled = search(slopes, start, options={"xtol": 1e-12}).x
    is_beside = np.all(np.abs(settled - start) < 0.05)
    return settled if is_beside else start


def draw_ar1(n: int, *, memory: float, rng: np.random.Generator) -> Channel:
    """Draw stationary AR(1) noise of unit variance: e_k = memory e_(k-1) + innovation."""
    start = rng.standard_normal()
    innovations = np.sqrt(1.0 - memory**2) * rng.standard_normal(n)
    noise, _ = scipy.signal.lfilter([1.0], [1.0, -memory], innovations, zi=[memory * start])
    return np.asarray(noise)


@dataclass(frozen=True)
class AR1Noise:
    """White noise plus AR(1) noise."""

    white: float  # variance
    correlated: float  # variance of the AR(1) part
    memory: float  # its correlation time, s

    def covariance(self, time: Array) -> Array:
        """Covariance (n, n) at the instants ``time`` (n,), s."""
        lags = np.abs(time[:, None] - time[None])
        return self.white * np.eye(len(time)) + self.correlated * np.exp(-lags / max(self.memory, 1e-9))


@one_blas_thread()
def estimate_noise(time: Array, residual: Array, basis: Array, floor: float) -> AR1Noise:
    """Constants of the noise in the residuals of a fit."""
    step, power = float(np.median(np.diff(time))), max(float(residual @ residual) / len(residual), floor)
    start = np.log([0.3 * power, 0.7 * power, 3 * step])

    def noise(z: Array) -> AR1Noise:
        white, correlated, memory = np.exp(np.clip(z, start - 12, start + 12))
        return AR1Noise(max(float(white), floor), float(correlated), float(min(memory, time[-1] - time[0])))

    def likelihood(z: Array) -> float:
        factor = np.linalg.cholesky(noise(z).covariance(time))
        whitened = solve_triangular(factor, np.column_stack([basis, residual]), lower=True, check_finite=False)
        orthogonal, triangle = np.linalg.qr(whitened[:, :-1])
        unexplained = whitened[:, -1] - orthogonal @ (orthogonal.T @ whitened[:, -1])
        log_det = np.log(np.diag(factor)).sum() + np.log(np.abs(np.diag(triangle))).sum()
        return float(2 * log_det + unexplained @ unexplained + 0.02 * ((z - start) ** 2).sum())

    search: Any = scipy.optimize.minimize
    solution = search(likelihood, start, method="Nelder-Mead", options={"maxiter": 150, "xatol": 0.02, "fatol": 0.01})
    return noise(solution.x)
