"""Misfit of the spectra of rides and those of a model: Whittle's likelihood as a sum of squares.

With v independent averages, the measured spectra W and those of the model S, both (C, C), minus twice the logarithm of
the likelihood of a band is 2 v (ln det S + tr(S^-1 W)), up to a constant (Whittle 1953, Arkiv foer Matematik 2). Of the
matrix A = R^-1 S R^-H with W = R R^H, and h(a) = sign(1 - a) sqrt(2 (1/a - 1 + ln a)), it is the sum of the squares of
the entries of sqrt(v) h(A): they are the residuals. Where the model is right their expected squares are a little above
1; they are divided by what complex Wishart matrices give (Goodman 1963, Annals of Mathematical Statistics 34).
"""

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import digamma

from tyre.ground.arrays import Array, Complex

NEAR = 1e-4  # of 1: below it series
FAR = 1e12  # times the measured spectra: a trial bicycle whose spectra are no numbers


@dataclass(frozen=True, eq=False)
class SpectralMisfit:
    """Measured spectra of R rides in b bands of C channels."""

    measured: Complex  # (R, b, C, C)
    averages: Array  # (R, b)
    share: float = 1.0  # of the misfit that counts

    @cached_property
    def root_inverse(self) -> Complex:
        """R^-1 (R, b, C, C) of W = R R^H."""
        return np.asarray(np.linalg.inv(np.linalg.cholesky(self.measured)))

    @cached_property
    def weight(self) -> Array:
        """Factor (R, b) of h(A): root of the averages, less what a right model has beyond its degrees of freedom."""
        channels = self.measured.shape[-1]
        logs = sum(np.log(self.averages) - digamma(self.averages - i) for i in range(channels))
        expected = 2 * self.averages * logs
        return np.asarray(np.sqrt(self.share * self.averages) * channels / np.sqrt(expected))

    def whiten(self, signals: Complex) -> Complex:
        """R^-1 y of ``signals`` y (R, b, ..., C, columns)."""
        shape = (*self.root_inverse.shape[:2], *(1,) * (signals.ndim - 4), *self.root_inverse.shape[2:])
        return np.asarray(self.root_inverse.reshape(shape) @ signals)

    def residual(self, relative: Complex) -> tuple[Array, "Axes"]:
        """Residuals (R, b, C^2) of model spectra ``relative`` (R, b, C, C), which are A, and axes for derivatives."""
        finite = np.isfinite(relative).all((-2, -1), keepdims=True)
        values, axes = np.linalg.eigh(np.where(finite, relative, FAR * np.eye(relative.shape[-1])))
        values = np.maximum(values, 1e-12)
        transformed = (axes * _transform(values)[..., None, :]) @ axes.conj().swapaxes(-1, -2)
        return self.weight[..., None] * _flatten(transformed), Axes(axes, _divided_differences(values), self.weight)


@dataclass(frozen=True, eq=False)
class Axes:
    """Eigenvectors of A and divided differences of h, for derivatives of the residuals."""

    vectors: Complex  # (R, b, C, C)
    differences: Array  # (R, b, C, C)
    weight: Array  # (R, b)

    def replaced(self, rides: NDArray[np.bool_], other: "Axes") -> "Axes":
        """Copy with the ``rides`` (R,) of the ``other``."""
        parts = ((self.vectors, other.vectors), (self.differences, other.differences), (self.weight, other.weight))
        chosen = (np.where(rides.reshape(-1, *(1,) * (old.ndim - 1)), new, old) for old, new in parts)
        return Axes(*chosen)

    def slopes(self, change: Complex) -> Array:
        """Derivatives (R, b, C^2, k) of residuals from those of A, ``change`` (R, b, k, C, C), all Hermitian."""
        return np.asarray(self._map @ _flatten(change).swapaxes(-1, -2))

    @cached_property
    def _map(self) -> Array:
        """Derivatives (R, b, C^2, C^2) of residuals by the real numbers of A."""
        basis = _basis(self.vectors.shape[-1])
        u = self.vectors[:, :, None]
        inside = self.differences[:, :, None] * (u.conj().swapaxes(-1, -2) @ basis @ u)
        flat = _flatten(u @ inside @ u.conj().swapaxes(-1, -2))
        return np.asarray(self.weight[..., None, None] * flat.swapaxes(-1, -2))


@cache
def _basis(channels: int) -> Complex:
    """Hermitian matrices (C^2, C, C) of which :func:`_flatten` makes the rows of a unit matrix."""
    rows, columns = np.triu_indices(channels, 1)
    basis = np.zeros((channels**2, channels, channels), complex)
    basis[range(channels), range(channels), range(channels)] = 1.0
    for k, (i, j) in enumerate(zip(rows, columns, strict=True)):
        for place, value in ((channels + k, 1.0), (channels + len(rows) + k, 1j)):
            basis[place, i, j] = value / np.sqrt(2)
            basis[place, j, i] = np.conj(value) / np.sqrt(2)
    return basis


def _transform(a: Array) -> Array:
    """h(a) = sign(1 - a) sqrt(2 (1/a - 1 + ln a)), about 1 - a."""
    e = a - 1
    near = np.abs(e) < NEAR
    far = np.sqrt(2 * np.maximum(1 / a - 1 + np.log(a), 0.0))
    return np.asarray(np.where(near, -e * (1 - 2 * e / 3), -np.sign(e) * far))


def _divided_differences(a: Array) -> Array:
    """(h(a_i) - h(a_j)) / (a_i - a_j), its derivative on the diagonal and for equal values; (..., C, C)."""
    h = _transform(a)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.where(np.abs(a - 1) < NEAR, -1 + 4 * (a - 1) / 3, (a - 1) / (a**2 * h))
        gap = a[..., :, None] - a[..., None, :]
        ratio = (h[..., :, None] - h[..., None, :]) / gap
    mean = (slope[..., :, None] + slope[..., None, :]) / 2
    close = np.abs(gap) < 1e-6 * (1 + np.abs(a[..., :, None]))
    return np.asarray(np.where(close, mean, ratio))


def _flatten(matrix: Complex) -> Array:
    """Real numbers (..., C^2) of Hermitian matrices (..., C, C), of the same sum of squares."""
    rows, columns = _above(matrix.shape[-1])
    above = np.sqrt(2) * matrix[..., rows, columns]
    diagonal = np.diagonal(matrix, axis1=-2, axis2=-1).real
    return np.concatenate([diagonal, above.real, above.imag], -1)


@cache
def _above(channels: int) -> tuple[Any, ...]:
    return np.triu_indices(channels, 1)
