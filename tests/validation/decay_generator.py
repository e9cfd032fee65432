"""SYNTHETIC decays of a stochastic linear system, by its exact discretisation: no exponential times cosine in sight.

x' = A x + G w(t) with white w, y = C x + offset + v: A is of companion matrices (weave; perhaps wobble) and of single
real poles (capsize: slow; castering: fast). One step of x is expm(A h) with the covariance of Van Loan (1978, IEEE
Trans. Automatic Control 23, 395-404); v is white, or the exact samples of an Ornstein-Uhlenbeck process. The truth is
what numpy says of the eigenvalues of A.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, expm

from bicycle.identification import Run
from tyre.ground import Array

STEP = 0.01  # s
CHANNELS = ("roll_rate_rad_s", "steer_rate_rad_s")


@dataclass(frozen=True)
class Cell:
    """One kind of decay; amplitudes and noise over the amplitude of weave at the start of the window."""

    cycles: tuple[float, float] = (2.5, 4.0)
    noise: float = 0.1
    colour: float = 0.0
    offset: float = 0.0
    slow: float = 0.0
    fast: float = 0.0
    second: float = 0.0
    driven: float = 0.0
    damping: tuple[float, float] = (0.05, 0.25)
    slow_rate: tuple[float, float] = (0.2, 1.0)


@dataclass(frozen=True)
class Made:
    """A run and the true eigenvalues of its oscillations, by frequency; the ratio steer over roll rate of the first."""

    run: Run
    roots: tuple[complex, ...]
    ratio: complex


def make(cell: Cell, rng: np.random.Generator, *, root: complex | None = None, speed: float = 5.0) -> Made:
    """Draw a system of a ``cell`` and one decay of it."""
    if root is None:
        size = 2 * np.pi * rng.uniform(0.6, 1.3)
        ratio = rng.uniform(*cell.damping)
        root = complex(-ratio * size, size * np.sqrt(1 - ratio**2))
    size = abs(root)
    blocks, start = [_companion(root)], [*_turned(rng, 1.0, size)]
    outputs = [_mixed(rng, 1.0, size)]
    if cell.second:
        wobble = size * rng.uniform(3.5, 6.0)
        other = complex(-wobble * rng.uniform(0.03, 0.1), wobble)
        blocks.append(_companion(other))
        start += _turned(rng, cell.second, abs(other))
        outputs.append(_mixed(rng, 1.0, abs(other)))
    for amplitude, low, high in ((cell.slow, *cell.slow_rate), (cell.fast, 10.0, 20.0)):
        if amplitude:
            blocks.append(np.array([[-rng.uniform(low, high)]]))
            start.append(amplitude)
            outputs.append(rng.choice([-1.0, 1.0], (2, 1)) * rng.uniform(0.5, 1.0, (2, 1)))
    a, c = block_diag(*blocks), np.hstack(outputs)
    count = round(rng.uniform(*cell.cycles) * 2 * np.pi / root.imag / STEP) + 1
    push = np.zeros((len(a), 1))
    push[1] = cell.driven * size * np.sqrt(-4 * root.real) if cell.driven else 0.0  # white: rms of x is ``driven``
    states = _march(a, push, np.array(start), count, rng)
    y = states @ c.T + cell.offset * rng.uniform(-1, 1, 2) + _noise(cell, count, rng)
    time: Array = STEP * np.arange(count, dtype=np.float64)
    scale = rng.uniform(0.2, 0.6) * np.array([1.0, rng.uniform(0.6, 2.0)])
    channels = {name: scale[k] * y[:, k] for k, name in enumerate(CHANNELS)}
    values, vectors = np.linalg.eig(a)
    shape = (c * scale[:, None]) @ vectors[:, int(np.argmin(np.abs(values - root)))]
    roots = tuple(sorted((complex(z) for z in values if z.imag > 1e-9), key=lambda z: z.imag))
    return Made(Run("synthetic", speed, time, channels, {}), roots, complex(shape[1] / shape[0]))


def _companion(root: complex) -> Array:
    return np.array([[0.0, 1.0], [-(abs(root) ** 2), 2 * root.real]])


def _turned(rng: np.random.Generator, amplitude: float, size: float) -> list[float]:
    """A state (x, x') of about this amplitude at any phase."""
    phase = rng.uniform(0, 2 * np.pi)
    return [amplitude * float(np.cos(phase)), amplitude * size * float(np.sin(phase))]


def _mixed(rng: np.random.Generator, amplitude: float, size: float) -> Array:
    """Rows of two channels, each seeing x and x' / size by another angle."""
    angle = rng.uniform(0, 2 * np.pi, 2)
    return amplitude * np.stack([np.cos(angle), np.sin(angle) / size], 1)


def _march(a: Array, push: Array, start: Array, count: int, rng: np.random.Generator) -> Array:
    """States, shape (count, n)."""
    n = len(a)
    loan = expm(STEP * np.block([[-a, push @ push.T], [np.zeros((n, n)), a.T]]))
    step = loan[n:, n:].T
    covariance = step @ loan[:n, n:]
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    root = vectors * np.sqrt(np.clip(values, 0, None))
    states = np.empty((count, n))
    states[0] = start
    for k in range(1, count):
        states[k] = step @ states[k - 1] + root @ rng.standard_normal(n)
    return states


def _noise(cell: Cell, count: int, rng: np.random.Generator) -> Array:
    """Noise of the sensors, shape (count, 2)."""
    white = rng.standard_normal((count, 2))
    if cell.colour:
        kept = np.exp(-STEP / cell.colour)
        for k in range(1, count):
            white[k] = kept * white[k - 1] + np.sqrt(1 - kept**2) * white[k]
    return cell.noise * white
