"""Whether something happens within a window that no free decay does: a second kick, a step of a sensor, a spike.

What the most probable noise leaves unforeseen of each sample, given those before it, is white and normal in a sound
window: of white or autoregressive sensors by differences, of driven modes by a Kalman filter (Anderson & Moore, Optimal
Filtering, 1979, ch. 5) of dz = lambda z dt + g dw with a circular g dw. A sample that is far too large is a break; the
window is fitted again up to it, and what moves farther than chance allows is told as :mod:`.window_start` does.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from bicycle.identification.decay_estimate import Estimate, estimate
from bicycle.identification.decay_window import SHARES, window
from bicycle.identification.run import Run
from bicycle.identification.window_start import CERTAIN, REACH, TOO_FAR, moved, numbers_of, same_mode
from tyre.base.arrays import Array
from tyre.base.errors import InputError

CHANCE = 1e-4  # that the largest sample of a sound window is as large
NORMAL = 1.4826  # sd of a normal distribution over the median of its absolute values
STEADY = 1e-4  # share of a driven motion that is new in each sample, at least
ORDINARY = 0.95  # of the samples: the larger ones may be breaks


@dataclass(frozen=True)
class Break:
    """A sample that neither the modes nor noise explain.

    Attributes
    ----------
    time_s : float
        Where it is largest, s after the first sample of the run.
    until_s : float
        Where a window ends that has nothing of it, s after the first sample of the run.
    channel : str
    size : float
        How large it is, in sd of what is unforeseen.
    shifts : dict
        As :attr:`.window_start.Movement.shifts`, where the window ends before it.
    farthest : float
        Largest of them over the sd of its number.
    what : str
        Name of that number; empty where nothing moves.
    refused : bool
        Whether it moves too far.
    """

    time_s: float
    until_s: float
    channel: str
    size: float
    shifts: dict[str, float]
    farthest: float
    what: str
    refused: bool


def broken(run: Run, found: Estimate, number: int) -> Break | None:
    """The largest break of a window, and how far a mode moves when the window ends before it.

    Parameters
    ----------
    run : Run
    found : Estimate
        Of the window.
    number : int
        Which of its modes.

    Returns
    -------
    Break or None
        None where there is no break; nothing moves where too little lies before it to be fitted.
    """
    w = found.window
    cycle = 2 * math.pi / float(found.mean[number, 1])
    large = np.abs(unforeseen(found))
    large[w.time < REACH * cycle] = 0.0  # there the start of the window is scanned
    place, channel = np.unravel_index(int(large.argmax()), large.shape)
    size = float(large[place, channel])
    if -math.expm1(large.size * math.log1p(-2 * norm.sf(size))) > CHANCE:
        return None
    end, at = (float(w.start + w.time[k]) for k in (place - 1, place))
    told = Break(at, end, w.channels[channel], size, dict.fromkeys(numbers_of(found, number), 0.0), 0.0, "", False)
    likely = [drift for drift, weight in found.kinds.items() if weight > 0.05]
    try:
        earlier = estimate(window(run, w.start, end, block=w.block, driven=w.driven), likely, [found.best.best])
    except InputError:
        return told
    if earlier is None:
        return told
    fits = [(found, number), (earlier, same_mode(found.best.best, earlier.mean, number))]
    fitted, drift = found.curves()
    power = ((fitted - drift) ** 2).sum(1)
    energy = [float(power.sum()), float(power[:place].sum())]
    table = [numbers_of(*fit) for fit in fits]
    shifts, farthest, what = moved(table, energy, 0)
    refused = moved(table, energy, 0, CERTAIN)[1] > TOO_FAR
    return replace(told, shifts=shifts, farthest=farthest, what=what, refused=refused)


def unforeseen(found: Estimate) -> Array:
    """What is left of each sample given those before it, shape (n, c), over its sd.

    Parameters
    ----------
    found : Estimate
    """
    best, w = found.best, found.window
    solved = best.evidence.solved(best.best[None], best.best_rate)
    noise = solved.most_probable()
    left = w.signals - found.curves()[0]
    driven = best.evidence.driven
    if noise.share is None or driven is None:
        phi = w.colours[noise.colours]
        left[1:] -= phi * left[:-1]
    else:
        seen = solved.linear().mean[0][:, : 2 * len(best.best)] / driven.level[:, None]
        sizes = SHARES[noise.share] ** 2 * np.exp(2 * best.best[:, :1] * w.time).mean(1)
        left = filtered(left / driven.level, seen, best.best, sizes, w.time[1] - w.time[0])
    ordinary = np.sort(np.abs(left), axis=0)[: math.ceil(ORDINARY * len(left))]
    edge = norm.isf((1 - ORDINARY) / 2)
    part = math.sqrt(1 - 2 * edge * norm.pdf(edge) / ORDINARY)  # rms of a normal distribution without its tails
    usual = np.maximum(NORMAL * np.median(np.abs(left), axis=0), np.sqrt((ordinary**2).mean(0)) / part)
    return np.asarray(left / usual)


def filtered(left: Array, seen: Array, modes: Array, sizes: Array, step: float) -> Array:
    """What is unforeseen of driven modes in white noise of unit sd, over its sd, shape (n, c).

    Parameters
    ----------
    left : ndarray, shape (n, c)
        Samples, over the sd of the noise.
    seen : ndarray, shape (c, 2 m)
        What each channel sees of the real and of the imaginary part of e^(lambda t) of each mode, in the same unit.
    modes : ndarray, shape (m, 2)
        sigma (1/s) and omega (rad/s).
    sizes : ndarray, shape (m,)
        E |z|^2 of each.
    step : float
        From sample to sample, s.
    """
    turned = np.exp((np.minimum(modes[:, 0], 0.0) + 1j * modes[:, 1]) * step)
    each = np.repeat(sizes / 2, 2)  # of the real and of the imaginary part
    forward = np.kron(np.diag(turned.real), np.eye(2)) + np.kron(np.diag(turned.imag), [[0.0, -1.0], [1.0, 0.0]])
    push = np.diag(each * np.repeat(np.maximum(1 - np.abs(turned) ** 2, STEADY), 2))
    state, spread, unforeseen_left = np.zeros(each.size), np.diag(each), np.empty_like(left)
    for k, sample in enumerate(left):
        covariance = seen @ spread @ seen.T + np.eye(len(sample))
        new = sample - seen @ state
        unforeseen_left[k] = new / np.sqrt(np.diag(covariance))
        gain = np.linalg.solve(covariance, seen @ spread).T
        state = forward @ (state + gain @ new)
        spread = forward @ (spread - gain @ seen @ spread) @ forward.T + push
    return unforeseen_left
