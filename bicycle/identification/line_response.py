"""Frequency response at the lines of an input that is made of lines: a multisine, a sum of sines, any periodic input.

Between its lines such an input says nothing, and averaged segments that hold no whole number of periods mix
neighbouring lines with phases that are the same in each segment: that does not average out, and the coherence stays one
(Pintelon & Schoukens 2012, System Identification, ch. 2 and 3). So the response is taken at the lines only, from the
whole record: with Y and U, the lines of output and input fitted together (:mod:`.line_spectrum`),

    H = Y / U.

The lines average the noise of both signals before they are divided, also what a rider or controller answers to it.

Noise: E = y - H u, of what the lines leave of both, has lines at frequencies between those of the input; their mean
power beside a line is that of the noise in it (Pintelon & Schoukens, ch. 2: the same number as the scatter between
periods), of white noise in both. A transient at the start lies there, too, and widens the sd.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bicycle.identification.line_spectrum import APART, LOWEST, ROWS, basis, fitted, weights
from tyre.base.arrays import Array, Complex

BESIDE = 8  # frequencies without a line from which the noise of one line is taken
OFF = 2.0  # bins between them
WORST = 0.1  # relative sd of a line of the input


@dataclass(frozen=True)
class LineResponse:
    """Response at m lines, of one record.

    Attributes
    ----------
    frequency_hz : ndarray, shape (m,)
        Hz.
    gain : ndarray of complex, shape (m,)
        Unit of the output over that of the input.
    variance : ndarray, shape (m,)
        Of real and of imaginary part.
    strength : ndarray, shape (m,)
        Power of the line of the input over that of unit white noise in it.
    moved : ndarray of bool, shape (m,)
        Whether the line of the input stands out of its noise.
    """

    frequency_hz: Array
    gain: Complex
    variance: Array
    strength: Array
    moved: NDArray[np.bool_]


def line_response(hertz: Array, given: Array, seen: Array, step: float) -> LineResponse:
    """Response of one record at known lines.

    Parameters
    ----------
    hertz : ndarray, shape (m,)
        All lines, Hz, increasing.
    given, seen : ndarray, shape (k,)
        Input and output.
    step : float
        Sample time, s.
    """
    size, m = len(given), len(hertz)
    found, (rest_u, rest_y) = fitted(hertz, [given, seen], step)
    u, y = (found[:m] - 1j * found[m : 2 * m]).T
    between = _between(hertz, size, step)
    v, width = weights(size), 2 * m + 2
    once, twice, cross = np.zeros((width, width)), np.zeros((width, width)), np.zeros((width, len(between)), complex)
    line_u, line_y, own = np.zeros(len(between), complex), np.zeros(len(between), complex), float(v @ v)
    down = np.zeros((width, len(between)), complex)
    for rows in (slice(k, k + ROWS) for k in range(0, size, ROWS)):
        a = basis(hertz, size, step, rows)
        time = (np.arange(size)[rows] - (size - 1) / 2) * step
        wave = v[rows, None] * np.exp(2j * np.pi * np.outer(time, between))
        once += a.T @ (a * v[rows, None])
        twice += a.T @ (a * v[rows, None] ** 2)
        down += a.T @ wave
        cross += a.T @ (wave * v[rows, None])
        line_u += wave.conj().T @ rest_u[rows]
        line_y += wave.conj().T @ rest_y[rows]
    inverse = np.linalg.pinv(once, hermitian=True)
    of_lines = inverse[:, :m] - 1j * inverse[:, m : 2 * m]
    taken = np.einsum("ij,ik,kj->j", of_lines.conj(), twice, of_lines).real  # sum |h|^2 of each line
    q = inverse @ down
    kept = own - 2 * np.einsum("ij,ij->j", q.conj(), cross).real + np.einsum("ij,ik,kj->j", q.conj(), twice, q).real
    near = np.argsort(np.abs(between - hertz[:, None]), axis=1)[:, :BESIDE]
    n = near.shape[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = y / u
        power = (np.abs(line_y[near] - gain[:, None] * line_u[near]) ** 2 / kept[near]).mean(1)
        of_input = (np.abs(line_u[near]) ** 2 / kept[near]).mean(1) * taken
        variance = power * taken / np.abs(u) ** 2 / 2 * n / (n - 1)  # that of Student's t, of 2 n numbers
    return LineResponse(hertz, gain, variance, np.abs(u) ** 2 / taken, of_input < 2 * WORST**2 * np.abs(u) ** 2)


def _between(hertz: Array, size: int, step: float) -> Array:
    """Frequencies, Hz, that are clear of every line: in each gap, not more than serve the line at its ends."""
    bin_width = 1 / (size * step)
    ends = np.concatenate(
        [[LOWEST * bin_width / 2], hertz, [min(hertz[-1] + (BESIDE + 1) * OFF * bin_width, 0.5 / step)]]
    )
    found = []
    for low, high in pairwise(ends):
        gap = (high - low) / bin_width
        count = int(gap / OFF) - 1 if gap >= 2 * OFF else int(gap >= APART)
        places = low + (high - low) * np.arange(1, count + 1) / (count + 1)
        found.append(places if count <= 2 * BESIDE else np.concatenate([places[:BESIDE], places[-BESIDE:]]))
    return np.concatenate(found)
