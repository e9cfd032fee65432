"""Noise of free decays beside that of the sensors: the same modes, excited by the ground all along the window.

White noise w that drives a mode with eigenvalue lambda = sigma + i omega, dz = lambda z dt + g dw with a real w and any
complex g, gives its complex coordinate z the stationary covariances E z(t + s) conj(z(t)) = S e^(lambda s) and
E z(t + s) z(t) = M e^(lambda s) for s > 0, where |M| / S = |sigma / lambda| and the phase of M is twice that of g,
less that of -lambda (Lyapunov's equation; Gardiner, Handbook of Stochastic Methods, section 4.4.6). A channel sees z
by the phasor c that its free motion shows: the covariance of channels k and l is
Re(c_k conj(c_l) S e^(lambda s) + c_k c_l M e^(lambda s)) / 2, so one disturbance moves all channels in the shape of the
mode. The phase hangs on where the ground pushes; the most probable of a few is taken. Its state at the start of the
window is among the free amplitudes.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bicycle.identification.decay_window import SHARES, Window
from tyre.base.arrays import Array

PHASES: Array = math.pi / 3 * np.arange(6, dtype=np.float64)
"""Of M, rad."""

LEAST_DECAY = 0.25  # e-folds over the window of what is driven; with less, nothing is stationary
NODES, FEWEST_NODES = 240, 40  # places of a driven motion, all samples where there are no more
PER_CYCLE, SLOWER = 16, 4  # places, where the phase of M matters and where it does not
DIFFERENCES = 4  # of samples, to which motions of 16 samples a cycle add little
LEAST_NOISE = 1e-4  # of a signal; with less, sums of squares lose their digits
NEGLIGIBLE = 1e-3  # variance of a direction beside that of the sensors


@dataclass(frozen=True)
class Driven:
    """Covariance of the samples of all channels: that of white sensors and, for each share, of driven modes.

    All but the level is seen in units of it: samples and polynomials are divided by it once more.

    Attributes
    ----------
    level : ndarray, shape (c,)
        Sd of the sensors' noise, in units of the window's scale.
    chances : ndarray, shape (f,)
        Prior probabilities of the shares, with sum 1.
    directions : ndarray, shape (c, n, r)
        Orthonormal over channels and samples where these are in units of ``level``; divided by it.
    variances : ndarray, shape (f, r)
        Of the driven motion along them, for each share.
    left : ndarray, shape (f, r)
        What a sum of squares keeps of each direction.
    signals : ndarray, shape (f, r)
        The samples along the directions, as much as is left.
    squares : ndarray, shape (f,)
        Sum of squares of the samples.
    spread : ndarray, shape (f,)
        Log determinant; one of the levels is integrated, the others are known to sqrt(1 / 2n).
    beside, beside_drift : ndarray, shape (c, n) and (c, 3)
        What no direction moves of the samples, and products with the polynomials of the drift.
    taken, drift_products, drift_signals : ndarray, shape (f, c, 3, r), (f, c, 3, c, 3) and (f, c, 3)
        Of the polynomials what is not left along the directions, and products with themselves and with ``signals``.
    """

    level: Array
    chances: Array
    directions: Array
    variances: Array
    left: Array
    signals: Array
    squares: Array
    spread: Array
    beside: Array
    beside_drift: Array
    taken: Array
    drift_products: Array
    drift_signals: Array


@dataclass(frozen=True)
class Driving:
    """Modes of a window that something drives.

    Attributes
    ----------
    window : Window
    level : ndarray, shape (c,)
        Sd of the sensors' noise, in units of the window's scale.
    phasors : ndarray, shape (m, c)
        Of each mode in the channels, over ``level``.
    paths : tuple of ndarray, shape (n, r)
        Of each mode, complex: z is their sum with independent standard normal weights, of the rms that the mode has,
        at phase zero.
    phases : tuple of ndarray
        Of M of each mode, rad, that are to be tried.
    """

    window: Window
    level: Array
    phasors: NDArray[np.complex128]
    paths: tuple[NDArray[np.complex128], ...]
    phases: tuple[Array, ...]

    @classmethod
    def of(cls, w: Window, modes: Array) -> "Driving":
        """Driven noise of a window ``w`` about the eigenvalues and phasors of its ``modes`` (m, 2; 1/s and rad/s)."""
        m = len(modes)
        waves = np.exp((modes[:, 0] + 1j * modes[:, 1]) * w.time[:, None])
        whole = np.hstack([waves.real, waves.imag, w.drift])
        amplitudes = np.linalg.lstsq(whole, w.signals, rcond=None)[0]
        left = w.signals - whole @ amplitudes
        rough = np.diff(left, DIFFERENCES, axis=0) / math.sqrt(math.comb(2 * DIFFERENCES, DIFFERENCES))  # white noise
        level = np.maximum(np.sqrt((rough**2).mean(0)), LEAST_NOISE)
        phasors = (amplitudes[:m] - 1j * amplitudes[m : 2 * m]) / level
        sizes = np.sqrt((np.abs(waves) ** 2).mean(0))
        paths = [
            _paths(w.time, complex(*mode), float(size), float(np.abs(seen).max()))
            for mode, size, seen in zip(modes, sizes, phasors, strict=True)
        ]
        phases = tuple(PHASES if _has_phase(w.time, complex(*mode)) else PHASES[:1] for mode in modes)
        return cls(w, level, phasors, tuple(paths), phases)

    def at(self, phases: Sequence[float]) -> Driven:
        """The covariance for ``phases`` (m,) of M of each mode, rad."""
        w, level = self.window, self.level
        n, channels = w.signals.shape
        columns = [
            (seen[:, None, None] * (path * np.exp(0.5j * phase))).real
            for seen, path, phase in zip(self.phasors, self.paths, phases, strict=True)
        ]
        u = np.concatenate(columns, 2).reshape(channels * n, -1)
        squares, turned = np.linalg.eigh(u.T @ u)  # quicker than singular values
        kept = squares * SHARES.max() ** 2 > NEGLIGIBLE
        singular = np.sqrt(squares[kept])
        along, variances = u @ (turned[:, kept] / singular), (SHARES[:, None] * singular) ** 2
        left = 1 / (1 + variances)
        scaled = (w.signals / level).T
        of_signals = scaled.ravel() @ along
        apart = scaled - (along @ of_signals).reshape(channels, n)
        directions = along.reshape(channels, n, -1) / level[:, None, None]
        polynomials = w.drift.T @ directions
        spread = np.log1p(variances).sum(1) + 2 * n * np.log(level).sum() - (channels - 1) * math.log(math.pi / n)
        taken = polynomials * (1 - left)[:, None, None]
        return Driven(
            level, w.driven / w.driven.sum(), directions, variances, left, left * of_signals,
            (apart**2).sum() + left @ of_signals**2, spread, apart / level[:, None],
            apart / level[:, None] @ w.drift, taken,
            np.einsum("fckr,dlr->fckdl", taken, polynomials), np.einsum("fr,ckr->fck", left * of_signals, polynomials),
        )  # fmt: skip


def _paths(time: Array, mode: complex, size: float, seen: float) -> NDArray[np.complex128]:
    """Principal paths of a driven ``mode`` of rms ``size``, shape (n, r), without those that nobody has ``seen``.

    They are those of a few places in a long window, and straight between these in a frame that turns with the mode.
    """
    length = time[-1] - time[0]
    nodes = time
    if len(time) > NODES:
        per_cycle = PER_CYCLE if _has_phase(time, mode) else SLOWER
        count = min(max(math.ceil(per_cycle * mode.imag * length / (2 * math.pi)), FEWEST_NODES), NODES)
        nodes = np.linspace(time[0], time[-1], count)
    root = complex(-max(abs(mode.real), LEAST_DECAY / length), mode.imag)
    one, other = np.indices((len(nodes), len(nodes)))
    turned = np.exp(root * (nodes - nodes[0]))[np.abs(one - other)]
    circular, elliptic = turned.real / 2, -root.real / abs(root) * turned / 2 * _has_phase(time, mode)
    across = np.where(one > other, -1, 1) * turned.imag / 2  # E Re z(t) Im z(u)
    covariance = np.block(
        [[circular + elliptic.real, across + elliptic.imag], [across.T + elliptic.imag, circular - elliptic.real]]
    )
    values, vectors = np.linalg.eigh(covariance)
    kept = values * (size * SHARES.max() * seen) ** 2 > NEGLIGIBLE / 10
    half = vectors[:, kept] * np.sqrt(values[kept]) * size
    paths = np.asarray(half[: len(nodes)] + 1j * half[len(nodes) :])
    if nodes is time:
        return paths
    slow = np.exp(-1j * mode.imag * nodes)[:, None] * paths
    between = np.array([np.interp(time, nodes, path) for path in slow.T]).T
    return np.exp(1j * mode.imag * time)[:, None] * between


def _has_phase(time: Array, mode: complex) -> bool:
    """Whether M of a ``mode`` is taken into account: of many cycles it is small, and turns twice in each.

    Beside S it is as large as the damping ratio, which is small where a motion lasts for many cycles.
    """
    return len(time) <= NODES or mode.imag * (time[-1] - time[0]) * PER_CYCLE < 2 * math.pi * NODES
