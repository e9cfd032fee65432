"""The samples between two times of a run, scaled, with the polynomials and the noise colours that a fit tries."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.polynomial.legendre import legvander

from bicycle.identification.run import Run
from tyre.base.arrays import Array
from tyre.base.errors import InputError

FEWEST = 20  # samples
LONGEST_COLOUR = 0.25  # correlation time of the noise over the window; what is slower is drift
COLOURS = 6
PER_CYCLE, FEWEST_BLOCKS = 16, 40
HIGHEST_DEGREE = 2  # of the drift

SHARES: Array = 10.0 ** np.arange(-1.5, 0.3, 0.25)
"""Rms of the driven motion over that of the mode in the window: 0.03 to 1.8, so near each other that none between two
is taken for a level at which the scatter is half of what it is."""

EVEN: Array = np.full(SHARES.size, 0.5 / SHARES.size)
"""Prior probabilities of the shares where nobody says whether something drives the motion."""


@dataclass(frozen=True)
class Window:
    """Samples of one window.

    Attributes
    ----------
    name : str
        Of the run.
    time : ndarray, shape (n,)
        s, from 0 at the first sample of the window.
    start : float
        s after the first sample of the run.
    channels : tuple of str
        Columns, as :data:`bicycle.identification.recording.CHANNELS`.
    signals : ndarray, shape (n, c)
        In units of ``scale``.
    scale : ndarray, shape (c,)
        Standard deviation of each channel, SI.
    drift : ndarray, shape (n, 3)
        Legendre polynomials of degree 0, 1, 2 over the window, each of rms 1.
    colours : ndarray, shape (f,)
        Autoregressive coefficients that the noise may have.
    block : int
        Samples of the recording in each of these: their means, which keep the eigenvalues.
    driven : ndarray, shape (f,)
        Probabilities, before the samples are seen, that something drives the motion all along the window with each of
        :data:`SHARES`; what their sum leaves is that nothing does.
    """

    name: str
    time: Array
    start: float
    channels: tuple[str, ...]
    signals: Array
    scale: Array
    drift: Array
    colours: Array
    block: int = 1
    driven: Array = field(default_factory=lambda: EVEN)

    @property
    def length(self) -> float:
        """Time from the first to the last sample, s."""
        return float(self.time[-1])


def window(run: Run, first_s: float, last_s: float, *, block: int = 1, driven: Array | None = None) -> Window:
    """Cut a window out of a run.

    Parameters
    ----------
    run : Run
    first_s, last_s : float
        s after the first sample of the run; at its ends the samples themselves count as inside.
    block : int
        Number of samples that are made one.
    driven : ndarray, shape (f,), optional
        As :attr:`Window.driven`; by default even odds, and all shares alike.

    Raises
    ------
    InputError
        Fewer than :data:`FEWEST` samples, or a channel that is constant there.
    """
    keep = (run.time >= run.time[0] + first_s - 1e-9) & (run.time <= run.time[0] + last_s + 1e-9)
    if keep.sum() < FEWEST:
        raise InputError(
            f"{run.name}: {keep.sum()} samples between {first_s:g} and {last_s:g} s; at least {FEWEST} are needed"
        )
    signals: Mapping[str, Array] = {name: x[keep] for name, x in run.channels.items()}
    dead = [name for name, x in signals.items() if np.ptp(x) == 0]
    if dead:
        raise InputError(
            f"{run.name}: {', '.join(dead)} is constant between {first_s:g} and {last_s:g} s; leave it out"
        )
    count = int(keep.sum()) // block
    time = np.asarray(run.time[keep][: count * block].reshape(count, block).mean(1), float)
    means = np.stack([x[: count * block].reshape(count, block).mean(1) for x in signals.values()], 1)
    coarse, fine = np.std(means, axis=0), np.array([np.std(x) for x in signals.values()])
    scale: Array = np.where(coarse > 0, coarse, fine).astype(np.float64)
    u = np.linspace(-1.0, 1.0, count)
    rms = np.sqrt(2.0 * np.arange(HIGHEST_DEGREE + 1) + 1)
    drift: Array = np.asarray(legvander(u, HIGHEST_DEGREE) * rms, np.float64)
    longest = math.exp(-1.0 / (LONGEST_COLOUR * count))
    colours: Array = np.concatenate([[0.0], 1 - np.geomspace(0.7, 1 - longest, COLOURS - 1)])
    start = float(run.time[keep][0] - run.time[0])
    chances = EVEN if driven is None else driven
    return Window(run.name, time - time[0], start, tuple(signals), means / scale, scale, drift, colours, block, chances)


def fitting_block(w: Window, omega: float) -> int:
    """Samples of a window ``w`` that may be made one where the fastest mode turns with ``omega``, rad/s."""
    cycle = 2 * math.pi / omega / (w.length / (len(w.time) - 1))
    return max(1, min(int(cycle / PER_CYCLE), len(w.time) // FEWEST_BLOCKS))
