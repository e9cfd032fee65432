"""Cut the window of a free decay out of a run, and compute how probable its samples are, given its modes and its drift.

Each channel is y = sum over modes e^(sigma t) (a cos(omega t) + b sin(omega t)) + drift + noise. The noise is a first-
order autoregression of unknown sd s and coefficient in each channel. Amplitudes, drift and s are integrated out in
closed form and the coefficients summed, so that only eigenvalues are left (linear model with conjugate priors: O'Hagan
& Forster, Kendall's Advanced Theory of Statistics 2B, 2nd ed., ch. 11). Priors: amplitudes as large as three times the
signal, in the plane that a mode spans; the drift as :data:`KINDS` says; log s even.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray
from scipy.special import gammaln

from bicycle.identification.recording import Run
from bicycle.model.eigen import angular_frequency
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError

SLOWEST, FASTEST = 0.1, 200.0  # rad/s
LOWEST, HIGHEST = -50.0, 20.0  # 1/s
FEWEST = 20  # samples


@dataclass(frozen=True)
class Window:
    """Samples between two times of a run, scaled, with what a fit tries of drift and noise."""

    time: Array  # (n,), s from the first sample of the window
    start: float  # s after the first sample of the run
    channels: tuple[str, ...]  # columns of the recording, such as roll_rate_rad_s
    signals: Array  # (n, c), over ``scale``
    scale: Array  # (c,), standard deviation of each channel, SI
    drift: Array  # (n, 3), legendre polynomials of degree 0 to 2, each of rms 1
    colours: Array  # (f,), autoregressive coefficients that the noise may have
    block: int = 1  # samples of the recording in each of these: their means keep the eigenvalues

    @property
    def length(self) -> float:
        """Time from the first to the last sample, s."""
        return float(self.time[-1])

    @property
    def seeking_block(self) -> int:
        """Samples that may be made one where peaks are sought; in longer blocks a fast oscillation seems slow."""
        return max(1, int(2 * math.pi / FASTEST / (self.time[1] - self.time[0])))

    def fitting_block(self, omega: float) -> int:
        """Samples that may be made one if the fastest mode turns with ``omega`` (rad/s): 16 a cycle, 40 in all."""
        cycle = 2 * math.pi / omega / (self.length / (len(self.time) - 1))
        return max(1, min(int(cycle / 16), len(self.time) // 40))


def window(run: Run, first_s: float, last_s: float, *, block: int = 1) -> Window:
    """Cut a window, both ends in s after the first sample of the run; its samples are means of ``block`` samples."""
    keep = (run.time >= run.time[0] + first_s - 1e-9) & (run.time <= run.time[0] + last_s + 1e-9)
    where = f"between {first_s:g} and {last_s:g} s"
    if keep.sum() < FEWEST:
        raise InputError(f"{run.name}: {keep.sum()} samples {where}; at least {FEWEST} are needed")
    signals = {name: x[keep] for name, x in run.channels.items()}
    dead = [name for name, x in signals.items() if np.ptp(x) == 0]
    if dead:
        raise InputError(f"{run.name}: {', '.join(dead)} is constant {where}; leave it out")
    count = int(keep.sum()) // block
    time = np.asarray(run.time[keep][: count * block].reshape(count, block).mean(1), float)
    means = np.stack([x[: count * block].reshape(count, block).mean(1) for x in signals.values()], 1)
    coarse = np.std(means, axis=0)
    fine = np.array([np.std(x) for x in signals.values()])
    scale: Array = np.where(coarse > 0, coarse, fine).astype(np.float64)
    drift: Array = np.asarray(legvander(np.linspace(-1.0, 1.0, count), 2) * np.sqrt([1.0, 3.0, 5.0]), np.float64)
    longest = math.exp(-4.0 / count)  # noise that remembers more than a quarter of the window is drift
    colours: Array = np.concatenate([[0.0], 1 - np.geomspace(0.7, 1 - longest, 5)])
    start = float(run.time[keep][0] - run.time[0])
    return Window(time - time[0], start, tuple(signals), means / scale, scale, drift, colours, block)


@np.errstate(over="ignore", invalid="ignore")  # a trial that grows all through a long recording
def basis(modes: Array, time: Array, rates: Array | None = None) -> Array:
    """Decaying cosines and sines of ``modes`` (points, m, 2; 1/s, rad/s), perhaps a real mode: (points, n, columns)."""
    root = modes[..., 0] + 1j * modes[..., 1]
    wave = _waves(root[..., None], time)
    turning = 2 * root.shape[1]
    columns = np.empty((len(modes), turning + (rates is not None), len(time)))
    columns[:, :turning:2], columns[:, 1:turning:2] = wave.real, wave.imag
    if rates is not None:
        columns[:, -1] = np.exp(-rates[:, None] * time)
    return np.swapaxes(columns, 1, 2)  # samples lie side by side: sums over them are quicker


def _waves(root: NDArray[np.complex128], time: Array) -> NDArray[np.complex128]:
    """Exponentials of ``root`` (..., 1) times ``time`` (n,); for even steps products of few, which are quicker."""
    n = len(time)
    many = math.isqrt(len(time)) + 1
    even = time[-1] / (n - 1) * np.arange(many * many)
    if np.abs(even[:n] - time).max() > 1e-13 * time[-1]:
        return np.asarray(np.exp(root * time))
    products = np.exp(root * even[::many])[..., None] * np.exp(root * even[:many])[..., None, :]
    return products.reshape(*root.shape[:-1], many * many)[..., :n]


def residual(w: Window, modes: Array) -> tuple[Array, int]:
    """Samples (n, c) less ``modes`` (m, 2) and a parabola by least squares, and the number of columns fitted."""
    whole = np.hstack([basis(modes[None], w.time)[0], w.drift])
    return w.signals - whole @ np.linalg.lstsq(whole, w.signals, rcond=None)[0], whole.shape[1]


def noise_floor(w: Window, modes: Array) -> Array:
    """Sd (c,) of :func:`residual`, at least 1e-5: with less noise the normal equations are singular."""
    residuals, columns = residual(w, modes)
    return np.asarray(np.maximum(np.sqrt((residuals**2).sum(0) / max(len(w.time) - columns, 1)), 1e-5))


def guesses(w: Window, known_modes: Array | None = None, start_hz: float | None = None) -> list[Array]:
    """The three best starts (m, 2) with one mode more than ``known_modes``, near ``start_hz`` or the highest peak."""
    unexplained = w.signals if known_modes is None else residual(w, known_modes)[0]
    peak = _peak(w, unexplained) if start_hz is None else float(angular_frequency(start_hz))
    omega = np.array([0.35, 0.5, 0.65, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 1.8]) * peak
    omega = np.clip(omega, 1.01 * SLOWEST, 0.99 * FASTEST)
    damping = (-0.1, 0.02, 0.1, 0.2, 0.35, 0.6, *(() if known_modes is None else (1.0, 2.5)))
    net = np.array([[[-zeta * o, o]] for o in omega for zeta in damping])
    net[..., 0] = np.clip(net[..., 0], 0.9 * LOWEST, 0.9 * HIGHEST)
    if known_modes is not None:
        net = np.concatenate([np.repeat(known_modes[None], len(net), 0), net], 1)
    q, _ = np.linalg.qr(np.concatenate([basis(net, w.time), np.broadcast_to(w.drift, (len(net), *w.drift.shape))], 2))
    misfit = (w.signals**2).sum() - ((np.swapaxes(q, 1, 2) @ w.signals) ** 2).sum((1, 2))
    return [net[k] for k in np.argsort(misfit)[:3]]


def _peak(w: Window, signals: Array) -> float:
    """Highest peak of the summed spectra between 1 rad/s and half the fastest frequency, rad/s."""
    step, size = w.time[1] - w.time[0], 8 * len(w.time)
    power = (np.abs(np.fft.rfft(signals - signals.mean(0), size, axis=0)) ** 2).sum(1)
    frequency = angular_frequency(np.fft.rfftfreq(size, step))
    power = np.where((frequency < 1.0) | (frequency > FASTEST / 2), 0.0, power)
    return float(frequency[int(np.argmax(power))])


AMPLITUDE, REAL = 3.0, 0.3  # prior sd of a mode and of a real mode in units of the signal's sd
TWINS = 1e-12  # of a diagonal: two equal modes leave it regular
PLAIN = {
    "none": (), "constant": (1.0,), "parabola": (1.0, 0.3, 0.1), "parabola/3": (1.0, 0.1, 0.03),
    "parabola/10": (1.0, 0.03, 0.01),
}  # fmt: skip
WITH_REAL_MODE = {
    "exponential": (1.0,), "parabola-exponential": (1.0, 0.1, 0.03), "parabola-exponential/3": (1.0, 0.03, 0.01),
}  # fmt: skip
KINDS = PLAIN | WITH_REAL_MODE
"""Kinds of drift and the prior sd of offset, slope and bend of each, rms over the window in units of the signal; the
last have a real mode as well (capsize, castering). A prior that is much too large is evidence against what is slight,
so there are several sizes."""

DRIFTS = tuple(dict.fromkeys(kind.partition("/")[0] for kind in KINDS))  # names of drifts, without sizes


def log_sum(logs: Array) -> Array:
    """Logarithm of the sum of exponentials along the first axis."""
    top = logs.max(0)
    return np.asarray(top + np.log(np.exp(logs - top).sum(0)))


@dataclass(frozen=True)
class Linear:
    """Amplitudes given eigenvalues, in units of each channel's scale: cos, sin of each mode, real mode, polynomials."""

    mean: Array  # (points, channels, p)
    covariance: Array  # (points, channels, p, p); channels are independent

    def reorder(self, order: NDArray[np.intp]) -> "Linear":
        """Amplitudes with the modes in this ``order`` (m,)."""
        places = np.arange(self.mean.shape[-1])
        places[: 2 * order.size] = np.stack([2 * order, 2 * order + 1], 1).ravel()
        return Linear(self.mean[..., places], self.covariance[:, :, places][..., places])


@dataclass(frozen=True)
class Solved:
    """Least squares at some eigenvalues for each coefficient of the noise, (points, colours, channels)."""

    logs: Array  # (points, colours, channels), logarithms of the marginal likelihood
    gram: Array  # (points, colours, channels, h, h), normal equations of h amplitudes, priors included
    right: Array  # (points, colours, channels, h), their right sides
    squares: Array  # (points, colours, channels), sum of squares that is left, the prior's share included
    samples: int  # in the window

    def take(self, points: NDArray[np.bool_]) -> "Solved":
        """Keep the points at which ``points`` (points,) is true."""
        return Solved(self.logs[points], self.gram[points], self.right[points], self.squares[points], self.samples)

    def log(self) -> Array:
        """Logarithm of the marginal likelihood, (points,)."""
        return np.asarray(log_sum(np.swapaxes(self.logs, 0, 1)).sum(-1))

    def colour(self) -> NDArray[np.intp]:
        """Place (channels,) among the window's ``colours`` of the most probable one, at the first point."""
        return np.asarray(self.logs[0].argmax(0))

    def linear(self) -> Linear:
        """Amplitudes with the most probable coefficient of the noise."""
        points, places = np.indices((len(self.logs), self.logs.shape[2]))
        likeliest = points, self.logs.argmax(axis=1), places
        gram = self.gram[likeliest]
        mean = np.linalg.solve(gram, self.right[likeliest][..., None])[..., 0]
        return Linear(mean, np.linalg.inv(gram) * (self.squares[likeliest] / self.samples)[..., None, None])


@dataclass(frozen=True)
class Evidence:
    """Marginal likelihood of one window with one kind of drift; priors are in units of ``noise``, about its sd (c,)."""

    window: Window  # whose samples it explains
    drift: str  # one of :data:`KINDS`
    noise: Array  # (c,), in units of the window's scale

    def solve(self, modes: Array, rates: Array | None = None) -> Solved:
        """Solve for amplitudes at ``modes`` (points, m, 2; 1/s, rad/s) and ``rates`` (points,; 1/s) of a real mode."""
        w = self.window
        columns, sums, spread, _ = self._fixed
        waves = np.swapaxes(basis(modes, w.time, rates), 1, 2)
        p, channels = waves.shape[1], w.signals.shape[1]
        products = _products(np.concatenate([waves, np.broadcast_to(columns, (len(waves), *columns.shape))], 1))
        ridge, ridges = self._ridge(products[:, 0], 2 * modes.shape[1], p)
        h = p + len(KINDS[self.drift])
        whole = (sums @ products.reshape(len(products), 3, -1)).reshape(len(products), -1, h + channels, h + channels)
        full = np.empty((*whole.shape[:2], channels, h + 1, h + 1))
        full[..., :h, :h] = whole[:, :, None, :h, :h] + (ridge * (self.noise**2)[:, None, None])[:, None]
        full[..., h, :h] = whole[:, :, h:, :h]
        full[..., h, h] = np.diagonal(whole[:, :, h:, h:], axis1=2, axis2=3)
        return _solve_normal_equations(
            full, spread[:, None] - (ridges + 2 * h * np.log(self.noise))[:, None], len(w.time)
        )

    @cached_property
    def _fixed(self) -> tuple[Array, Array, Array, Array]:
        """Polynomials and signals (k, n); what each colour takes of the three sums; its log determinant; the ridge."""
        w, phi = self.window, self.window.colours
        degrees = len(KINDS[self.drift])
        sums = np.stack([1 + phi**2, -(phi**2), -phi], 1) / (1 - phi**2)[:, None]
        spread = (len(w.time) - 1) * np.log(1 - phi**2) + 2 * math.log(len(phi))
        sizes = np.tile(KINDS[self.drift], (w.signals.shape[1], 1))
        sizes[:, :1] *= np.maximum(1.0, np.abs(w.signals.mean(0)))[:, None]  # an offset may be larger than the motion
        return np.concatenate([w.drift[:, :degrees], w.signals], 1).T, sums, spread, 1 / sizes**2

    def _ridge(self, plain: Array, oscillating: int, p: int) -> tuple[Array, Array]:
        """Prior precision of the amplitudes (points, channels, h, h), in units of the noise, and log determinants."""
        fixed = self._fixed[3]
        energies = plain[:, :p, :p] / len(self.window.time) * (1 + TWINS * np.eye(p))
        ridge = np.zeros((len(plain), len(fixed), p + fixed.shape[1], p + fixed.shape[1]))
        turning = energies[:, :oscillating, :oscillating] / AMPLITUDE**2
        ridge[:, :, :oscillating, :oscillating] = turning[:, None]
        logs = np.linalg.slogdet(turning)[1]
        if p > oscillating:
            dying = energies[:, -1, -1] / REAL**2
            ridge[:, :, p - 1, p - 1] = dying[:, None]
            logs = logs + np.log(dying)
        for k, precision in enumerate(fixed.T, p):
            ridge[:, :, k, k] = precision
        return ridge, logs[:, None] + np.log(fixed).sum(1)


def _solve_normal_equations(full: Array, logdet: Array, count: int) -> Solved:
    """Solve normal equations ``full`` (..., h + 1, h + 1), whose last row holds right sides and the sum of squares."""
    h = full.shape[-1] - 1
    full.reshape(*full.shape[:-2], -1)[..., : h * (h + 2) : h + 2] *= 1 + TWINS
    gram, right, total = full[..., :h, :h], full[..., h, :h], full[..., h, h]
    try:
        root = np.diagonal(np.linalg.cholesky(full), axis1=-2, axis2=-1)
        squares, log_determinant = root[..., h] ** 2, 2 * np.log(root[..., :h]).sum(-1)
    except np.linalg.LinAlgError:  # singular to rounding, or a trial that grew beyond all numbers
        squares = total - (right * np.linalg.solve(gram, right[..., None])[..., 0]).sum(-1)
        log_determinant = np.linalg.slogdet(gram)[1]
    squares = np.maximum(squares, 1e-13 * total)
    logs = gammaln(count / 2) - 0.5 * (count * np.log(math.pi * squares) + log_determinant + logdet)
    return Solved(logs, gram, right, squares, count)


def _products(columns: Array) -> Array:
    """Sum products of columns (points, h, n): of each sample, of the two at the ends, of neighbours twice."""
    ends = columns[..., :: columns.shape[-1] - 1].copy()
    neighbours = columns[..., 1:] @ np.swapaxes(columns[..., :-1], 1, 2)
    pairs = (columns @ np.swapaxes(columns, 1, 2), ends @ np.swapaxes(ends, 1, 2))
    return np.stack([*pairs, neighbours + np.swapaxes(neighbours, 1, 2)], 1)
