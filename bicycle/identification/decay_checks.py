"""Check the fit of a window: later starts, breaks within it, and whether what is left is noise.

A later window is a part of the earlier one, so the difference of the two estimates has the difference of their
variances (Hausman 1978, Econometrica 46, 1251-1271). The noise of each window is estimated anew, so a later window may
state the smaller sd; its variance is taken to be larger at least by the share of the oscillation's energy that it
lacks.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.stats import chi2, norm

from bicycle.identification.decay_posterior import Estimate, clearer, estimate
from bicycle.identification.decay_window import window
from bicycle.identification.recording import Run
from tyre.arrays import Array
from tyre.errors import InputError

CERTAIN = 3.4  # the same, for a refusal: with twelve comparisons one sound window of a hundred
TOO_FAR = 3.0  # sd beyond which a window is refused if a part of it settles
REACH = 0.25  # cycle, how much later a window may start
PARTS = ("real part", "imaginary part")
Numbers = dict[str, tuple[Array, float]]  # name of a part or ratio -> value (one or two numbers) and sd


@dataclass(frozen=True)
class Shift:
    """Movement of the numbers of a mode with the window, beyond chance."""

    shifts: dict[str, float]  # name of a part or ratio -> how far it moves, in its own unit; 0: not
    farthest: float  # largest of them over the sd of its number
    what: str  # name of that number; empty if nothing moves
    refused: bool  # it moves too far, beyond what chance does in one of a hundred windows


@dataclass(frozen=True)
class Movement(Shift):
    """Movement of a mode when its window begins later: a kick that still lasts, or a fast mode."""

    settled_s: float | None  # first start from which nothing moves, s after the first sample of the run


@dataclass(frozen=True)
class Break(Shift):
    """The largest sample that neither modes nor noise explain; how far a mode moves if the window ends before."""

    time_s: float  # s after the first sample of the run
    until_s: float  # end of a window that has nothing of it, s after the first sample of the run
    channel: str
    size: float  # sd of what is unforeseen


def movement(run: Run, found: Estimate, number: int, last_s: float, *, beside: bool) -> Movement | None:
    """Fit a window again from three later starts; None if no later window is long enough."""
    fits = [(found, number)]
    cycle = 2 * math.pi / float(found.mean[number, 1])
    steps = dict.fromkeys(max(round(REACH * cycle * k / 3 / run.step), 1) * run.step for k in (1, 2, 3))
    for step in steps:
        later = _again(run, fits[0], found.window.start + step, last_s, beside=beside)
        if later is None:
            break
        fits.append(later)
    if len(fits) == 1:
        return None
    starts = [fit.window.start for fit, _ in fits]
    table, energy = [numbers_of(*fit) for fit in fits], found.energy_from(starts)
    shifts, farthest, what = moved(table, energy, 0)
    settled = next((place for place in range(1, len(fits) - 1) if moved(table, energy, place)[1] == 0), None)
    refused = settled is not None and moved(table, energy, 0, CERTAIN)[1] > TOO_FAR
    return Movement(shifts, farthest, what, refused, None if settled is None else starts[settled])


def broken(run: Run, found: Estimate, number: int) -> Break | None:
    """Find a second kick, a step of a sensor or a spike: a sample that the noise makes in one of 10,000 windows."""
    w = found.window
    large = np.abs(unforeseen(found))
    large[w.time < REACH * 2 * math.pi / float(found.mean[number, 1])] = 0.0  # there the start of the window is scanned
    place, channel = np.unravel_index(int(large.argmax()), large.shape)
    size = float(large[place, channel])
    if -math.expm1(large.size * math.log1p(-2 * norm.sf(size))) > 1e-4:
        return None
    end, at = (float(w.start + w.time[k]) for k in (place - 1, place))
    earlier = _again(run, (found, number), w.start, end, beside=False)
    whole = numbers_of(found, number)
    shift = dict.fromkeys(whole, 0.0), 0.0, "", False  # too little lies before it to be fitted
    if earlier is not None:
        table, (every, after) = [whole, numbers_of(*earlier)], found.energy_from([w.start, at])
        refused = moved(table, [every, every - after], 0, CERTAIN)[1] > TOO_FAR
        shift = (*moved(table, [every, every - after], 0), refused)
    return Break(*shift, at, end, w.channels[channel], size)


def _again(
    run: Run, whole: tuple[Estimate, int], first_s: float, last_s: float, *, beside: bool
) -> tuple[Estimate, int] | None:
    """Fit a part of the window; the place of the mode in it."""
    found, number = whole
    likely, known = [drift for drift, weight in found.kinds.items() if weight > 0.05], found.best.best
    try:
        w = window(run, first_s, last_s, block=found.window.block)
    except InputError:
        return None
    part = estimate(w, likely, [known])
    if beside:
        alone = estimate(w, likely, [known[number : number + 1]])
        if alone is not None and (part is None or not clearer(part.best, alone.best)):
            return alone, 0
    if part is None:
        return None
    distance = np.hypot(*(known[:, None, :] - part.mean[None, :, :]).transpose(2, 0, 1))
    return part, int(linear_sum_assignment(distance)[1][number])  # near modes may change places


def numbers_of(found: Estimate, number: int) -> Numbers:
    """Parts of the eigenvalue and ratios of a mode, each with its sd."""
    numbers = {name: (found.mean[number, k : k + 1], float(found.sd[number, k])) for k, name in enumerate(PARTS)}
    for name, (value, sd) in found.ratios[number].items():
        numbers[name] = (np.array([value.real, value.imag]), sd)
    return numbers


def moved(
    table: Sequence[Numbers], energy: Sequence[float], place: int, chances: float = 2.5
) -> tuple[dict[str, float], float, str]:
    """Compare the numbers of the window at ``place`` with those of the parts of it that follow, as :class:`Shift`
    says."""
    shifts, farthest, what = dict.fromkeys(table[place], 0.0), 0.0, ""
    for later, left in zip(table[place + 1 :], energy[place + 1 :], strict=True):
        more = max(energy[place] / max(left, 1e-300) - 1, 0.0)  # of the variance; less is rounding
        for name, (value, sd) in table[place].items():
            shift = float(np.abs(later[name][0] - value).max())
            chance = math.sqrt(max(later[name][1] ** 2 - sd**2, more * sd**2))
            if shift > sd and shift > chances * chance:
                shifts[name] = max(shifts[name], shift)
                if shift / sd > farthest:
                    farthest, what = shift / sd, name
    return shifts, farthest, what


def unforeseen(found: Estimate, ordinary: float = 0.95) -> Array:
    """Residual of each sample given the one before it (n, c), over its sd; white and normal in a sound window."""
    left = found.window.signals - found.curves()[0]
    left = np.vstack([left[:1], found.whitened(left)])
    usual = np.sort(np.abs(left), axis=0)[: math.ceil(ordinary * len(left))]
    edge = norm.isf((1 - ordinary) / 2)
    part = math.sqrt(1 - 2 * edge * norm.pdf(edge) / ordinary)  # rms of a normal distribution without its tails
    median = np.median(np.abs(left), axis=0) / norm.isf(0.25)
    return np.asarray(left / np.maximum(median, np.sqrt((usual**2).mean(0)) / part))


def probability_of_noise(found: Estimate) -> float:
    """Probability that noise leaves at least as much correlation between neighbours as the most probable modes do.

    Portmanteau test of Ljung & Box (1978, Biometrika 65, 297-303), all channels together.
    """
    left = found.whitened(found.left())
    n, channels = left.shape
    lags = np.arange(1, max(min(n // 5, 20), 3) + 1)
    left = left - left.mean(0)
    correlations = np.array([(left[lag:] * left[:-lag]).sum(0) for lag in lags]) / (left**2).sum(0)
    total = n * (n + 2) * (correlations**2 / (n - lags)[:, None]).sum()
    return float(chi2.sf(total, lags.size * channels))
