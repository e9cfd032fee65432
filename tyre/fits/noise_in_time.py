"""White plus first-order autoregressive (AR(1)) noise at any instants: its covariance, and its constants found.

For even samples and many of them :mod:`tyre.fits.noise` is quicker.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import minimize

from tyre.base.arrays import Array
from tyre.base.parallel import one_blas_thread


@dataclass(frozen=True)
class AR1Noise:
    """White noise plus AR(1) noise.

    Attributes
    ----------
    white, correlated : float
        Variances of the two parts.
    memory : float
        Correlation time of the second, s.
    """

    white: float
    correlated: float
    memory: float

    def covariance(self, time: Array) -> Array:
        """Covariance (n, n) at the instants ``time`` (n,), s."""
        apart = np.abs(time[:, None] - time[None])
        return self.white * np.eye(len(time)) + self.correlated * np.exp(-apart / max(self.memory, 1e-9))


@one_blas_thread()
def estimate_noise(time: Array, residual: Array, basis: Array, floor: float) -> AR1Noise:
    """Constants of the noise in the residuals of a fit.

    Restricted maximum likelihood (Patterson & Thompson 1971), which allows for what the fit has swallowed.

    Parameters
    ----------
    time, residual : ndarray, shape (n,)
        s, and in the unit of the data.
    basis : ndarray, shape (n, p)
        Orthonormal, of the tangent space of the fit.
    floor : float
        Least white variance, in the unit of the data squared.
    """
    step, power = float(np.median(np.diff(time))), max(float(residual @ residual) / len(residual), floor)
    start = np.log([0.3 * power, 0.7 * power, 3 * step])

    def noise(z: Array) -> AR1Noise:
        white, correlated, memory = np.exp(np.clip(z, start - 12, start + 12))
        return AR1Noise(max(float(white), floor), float(correlated), float(min(memory, time[-1] - time[0])))

    def likelihood(z: Array) -> float:
        factor = np.linalg.cholesky(noise(z).covariance(time))
        both = solve_triangular(factor, np.column_stack([basis, residual]), lower=True, check_finite=False)
        orthogonal, triangle = np.linalg.qr(both[:, :-1])
        rest = both[:, -1] - orthogonal @ (orthogonal.T @ both[:, -1])
        log_det = np.log(np.diag(factor)).sum() + np.log(np.abs(np.diag(triangle))).sum()
        return float(2 * log_det + rest @ rest + 0.02 * ((z - start) ** 2).sum())

    search: Any = minimize
    found = search(likelihood, start, method="Nelder-Mead", options={"maxiter": 150, "xatol": 0.02, "fatol": 0.01})
    return noise(found.x)
