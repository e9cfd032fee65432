"""Cut the window of a free decay out of a run, and look for its modes about the peaks of its spectrum."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander

from bicycle.eigen import angular_frequency
from bicycle.identification.recording import Run
from tyre.arrays import Array
from tyre.errors import InputError

SLOWEST, FASTEST = 0.1, 200.0  # rad/s
LOWEST, HIGHEST = -50.0, 20.0  # 1/s
FEWEST = 20  # samples


@dataclass(frozen=True)
class Window:
    """Samples between two times of a run, scaled, with what a fit tries of drift and noise."""

    time: Array  # (n,), s from the first sample of the window
    start: float  # s after the first sample of the run
    channels: tuple[str, ...]
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
    """Cut a window, both ends in s after the first sample of the run; ``block`` samples are made one."""
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
    coarse, fine = np.std(means, axis=0), np.array([np.std(x) for x in signals.values()])
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
    wave = np.exp(root[..., None] * time)
    turning = 2 * root.shape[1]
    columns = np.empty((len(modes), turning + (rates is not None), len(time)))
    columns[:, :turning:2], columns[:, 1:turning:2] = wave.real, wave.imag
    if rates is not None:
        columns[:, -1] = np.exp(-rates[:, None] * time)
    return np.swapaxes(columns, 1, 2)  # samples lie side by side: sums over them are quicker


def residual(w: Window, modes: Array) -> tuple[Array, int]:
    """Samples (n, c) less ``modes`` (m, 2) and a parabola by least squares, and the number of columns fitted."""
    whole = np.hstack([basis(modes[None], w.time)[0], w.drift])
    return w.signals - whole @ np.linalg.lstsq(whole, w.signals, rcond=None)[0], whole.shape[1]


def noise_floor(w: Window, modes: Array) -> Array:
    """Sd (c,) of :func:`residual`, at least 1e-5: with less noise the normal equations are singular."""
    left, columns = residual(w, modes)
    return np.asarray(np.maximum(np.sqrt((left**2).sum(0) / max(len(w.time) - columns, 1)), 1e-5))


def guesses(w: Window, known: Array | None = None, start_hz: float | None = None) -> list[Array]:
    """The three best starts (m, 2) with one mode more than the ``known``, near ``start_hz`` or the highest peak."""
    peak = float(angular_frequency(start_hz)) if start_hz is not None else 0.0
    if start_hz is None:
        peak = _peak(w, w.signals if known is None else residual(w, known)[0])
    omega = np.array([0.35, 0.5, 0.65, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 1.8]) * peak
    omega = np.clip(omega, 1.01 * SLOWEST, 0.99 * FASTEST)
    damping = (-0.1, 0.02, 0.1, 0.2, 0.35, 0.6, *(() if known is None else (1.0, 2.5)))
    net = np.array([[[-zeta * o, o]] for o in omega for zeta in damping])
    net[..., 0] = np.clip(net[..., 0], 0.9 * LOWEST, 0.9 * HIGHEST)
    if known is not None:
        net = np.concatenate([np.repeat(known[None], len(net), 0), net], 1)
    fixed = np.broadcast_to(w.drift, (len(net), *w.drift.shape))
    q, _ = np.linalg.qr(np.concatenate([basis(net, w.time), fixed], 2))
    left = (w.signals**2).sum() - ((np.swapaxes(q, 1, 2) @ w.signals) ** 2).sum((1, 2))
    return [net[k] for k in np.argsort(left)[:3]]


def _peak(w: Window, signals: Array) -> float:
    """Highest peak of the summed spectra between 1 rad/s and half the fastest frequency, rad/s."""
    step, size = w.time[1] - w.time[0], 8 * len(w.time)
    power = (np.abs(np.fft.rfft(signals - signals.mean(0), size, axis=0)) ** 2).sum(1)
    frequency = angular_frequency(np.fft.rfftfreq(size, step))
    power = np.where((frequency < 1.0) | (frequency > FASTEST / 2), 0.0, power)
    return float(frequency[int(np.argmax(power))])
