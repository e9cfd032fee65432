"""Frequency response of recorded motion to a recorded input, with its noise, by averaged spectra.

Every recording is cut into segments that overlap by half, without trend and under a Hann window (Welch 1967, IEEE
Trans. Audio Electroacoustics 15, 70-73). With their transforms U of the input, Y of the output and R of a reference,

    H = sum(conj(R) Y) / sum(conj(R) U).

Without a reference R = U: the usual estimate H1, for noise in the output (Bendat & Piersol, Random Data, ch. 6). Where
a rider or controller answers the motion, the noise of the output comes back in the input, and H1 is biased towards
minus one over the controller. A reference that nobody answers, added to the input from outside, is free of that noise:
the joint input-output estimate (van den Hof & Schrama 1995, Automatica 31, 1751-1770; Ljung 1999, System
Identification, ch. 13).

The window averages H over neighbouring frequencies, with a variance of 1 / (3 T^2) for segments of T seconds; to first
order this adds H'' / (6 T^2), which the second difference of neighbouring bins, over six, takes away again.

Noise: E = Y - H U has the power sum |E|^2 / (n - 1) with n independent segments. H being linear in the samples of the
output, H = sum_t h(t) y(t), its variance is that of white noise of this power times sum |h|^2: overlap, neighbouring
bins and segments in which the input hardly moves (a sweep passes each frequency once) are all in h. For segments that
share nothing this is the formula of Bendat & Piersol, ch. 9, |H|^2 (1 - gamma^2) / (gamma^2 n). Real and imaginary part
have half of it each; as the power is estimated itself, it is widened as the variance of Student's t.

An input that is made of lines (a multisine, anything periodic) leaks into the frequencies between them alike in every
segment; there the response is that of :mod:`.line_response`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import detrend, get_window

from bicycle.identification.line_response import BESIDE, line_response
from bicycle.identification.line_spectrum import lines_of
from tyre.base.arrays import Array, Complex
from tyre.base.errors import InputError

FEWEST_SEGMENTS = 5.0  # independent ones
FEWEST_SAMPLES = 16  # of a segment: less is all window and trend
EVERY = 2  # bins: the window makes neighbours nearly the same number
FIRST = 2  # bin: below it the trend was taken out
AROUND = np.array([-1, 0, 1])
UNSMOOTHED = np.array([-1.0, 8.0, -1.0]) / 6  # of neighbouring bins: what the window averaged taken away
WORST = 0.1  # relative sd of the response of the input to the reference


@dataclass(frozen=True)
class SpectralResponse:
    """Frequency response at m frequencies.

    Attributes
    ----------
    frequency_hz : ndarray, shape (m,)
        Hz.
    gain : ndarray of complex, shape (m,)
        Unit of the output over that of the input.
    sd : ndarray, shape (m,)
        One standard deviation of real and of imaginary part, in the unit of the gain.
    coherence : ndarray, shape (m,)
        gamma^2 of input and output; at lines, that which with ``averages`` has this sd.
    averages : float
        Independent segments; at lines, frequencies beside each from which its noise is taken.
    left_out : int
        Frequencies at which the reference hardly moves the input, or lines of the input that its noise hides.
    lines : int
        Lines of which the input is made; 0 where it fills the spectrum.
    """

    frequency_hz: Array
    gain: Complex
    sd: Array
    coherence: Array
    averages: float
    left_out: int = 0
    lines: int = 0


def spectral_response(
    inputs: Sequence[Array], outputs: Sequence[Array], step: float, *, segment_s: float,
    references: Sequence[Array] | None = None, highest_hz: float = np.inf,
) -> SpectralResponse:  # fmt: skip
    """Frequency response from one or several recordings of one condition.

    Parameters
    ----------
    inputs, outputs : sequence of ndarray, shape (k,)
        Of each recording; k may differ.
    step : float
        Sample time, s.
    segment_s : float
        Length of the segments, s: frequencies are 2 / ``segment_s`` apart. An input that is made of lines needs none:
        the frequencies are its lines.
    references : sequence of ndarray, shape (k,), optional
        Of each recording.
    highest_hz : float
        Hz.

    Raises
    ------
    InputError
        Segments that are too long for five independent ones, or too short for two frequencies; a highest frequency
        above half the sample rate; recordings of which some are made of lines and some are not; no line up to
        ``highest_hz``.
    """
    size = round(segment_s / step)
    if size < FEWEST_SAMPLES:
        raise InputError(
            f"segments of {segment_s:g} s hold {size} samples of {step:.3g} s; at least {FEWEST_SAMPLES} are needed: "
            f"take segments of {FEWEST_SAMPLES * step:.3g} s or more"
        )
    half = 0.5 / step
    if np.isfinite(highest_hz) and highest_hz > half * (1 + 1e-9):
        raise InputError(
            f"{highest_hz:g} Hz is above {half:.4g} Hz, half the sample rate, and cannot be seen; take a lower limit"
        )
    long = [k for k, x in enumerate(inputs) if len(x) >= size]
    signals = [[parts[k] for k in long] for parts in (inputs, outputs, references or inputs)]
    lines = [lines_of(x, step) for x in signals[2]]
    if any(map(len, lines)):
        _refuse_mixed(dict(zip(long, lines, strict=True)))
        return _at_lines(signals, lines, step, highest_hz)
    seconds = step * sum(len(x) for x in inputs)
    averages = _averages([_count(len(x), size) for x in inputs], size)
    if averages < FEWEST_SEGMENTS:
        raise InputError(
            f"{seconds:.3g} s hold {averages:.1f} independent segments of {segment_s:g} s; at least "
            f"{FEWEST_SEGMENTS:g} are needed: take shorter segments, or record longer"
        )
    hertz = np.arange(size // 2 + 1) / (size * step)
    bins = np.arange(FIRST, len(hertz) - 1, EVERY)
    bins = bins[hertz[bins] <= highest_hz * (1 + 1e-9)]
    if len(bins) < 2:
        raise InputError(
            f"segments of {segment_s:g} s show {len(bins)} frequencies up to {min(highest_hz, hertz[-1]):g} Hz; take "
            "longer segments or a higher limit"
        )
    return _averaged(signals, step, size, bins, joint=references is not None)


def _refuse_mixed(lines: Mapping[int, Array]) -> None:
    """Refuse recordings, by their place, of which some have ``lines`` and some have none."""
    of, no = ([k for k, x in lines.items() if bool(len(x)) == made] for made in (True, False))
    if no:
        raise InputError(
            f"the input of recording {of[0] + 1} is made of lines, that of recording {no[0] + 1} is not; give the "
            "recordings to the command one by one"
        )


def _at_lines(
    signals: Sequence[Sequence[Array]], lines: Sequence[Array], step: float, highest_hz: float
) -> SpectralResponse:
    """Response at the ``lines`` of each recording; lines that several share are averaged by their strength."""
    every = [line_response(h, u, y, step) for h, u, y in zip(lines, *signals[:2], strict=True)]
    hertz, gain, variance, power, moved = (
        np.concatenate([getattr(r, name) for r in every])
        for name in ("frequency_hz", "gain", "variance", "strength", "moved")
    )
    order = np.argsort(hertz)
    near = 0.5 / (step * min(len(x) for x in signals[0]))
    group = np.empty(len(hertz), int)
    group[order] = np.cumsum(np.diff(hertz[order], prepend=-np.inf) > near) - 1
    weight = np.where(moved, power, 0)
    total = np.bincount(group, weight)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.bincount(group, weight * hertz) / total
        ratio = np.bincount(group, weight * gain.real) / total + 0j
        ratio += 1j * np.bincount(group, weight * gain.imag) / total
        sd = np.sqrt(np.bincount(group, weight**2 * variance)) / total
        coherence = 1 / (1 + 2 * BESIDE * (sd / np.abs(ratio)) ** 2)
    lowest = np.full(len(total), np.inf)
    np.minimum.at(lowest, group, hertz)
    seen = lowest <= highest_hz * (1 + 1e-6)
    if not seen.any():
        raise InputError(
            f"the input is made of lines from {lowest.min():.4g} to {hertz.max():.4g} Hz, none of them up to "
            f"{highest_hz:g} Hz; take a higher limit"
        )
    kept = seen & (sd > 0) & np.isfinite(ratio)
    return SpectralResponse(
        mean[kept], ratio[kept], sd[kept], coherence[kept], float(BESIDE), int((seen & ~kept).sum()), lines=len(total)
    )  # fmt: skip


def _averaged(
    signals: Sequence[Sequence[Array]], step: float, size: int, bins: NDArray[np.intp], *, joint: bool
) -> SpectralResponse:
    """Response at ``bins`` of segments of ``size`` samples, where it is found; ``joint``: the reference is another."""
    hop, window = size // 2, _window(size)
    segments = [_segments(parts, size, hop) for parts in signals]
    counts = [len(part) for part in segments[0]]
    averages = _averages(counts, size)
    around = bins + AROUND[:, None]
    u, y, r = (np.concatenate([part[:, around] for part in parts]) for parts in segments)  # (segments, 3, bins)
    through = (r.conj() * u).sum(0)
    with np.errstate(divide="ignore", invalid="ignore"):
        gains = (r.conj() * y).sum(0) / through
        gain = UNSMOOTHED @ gains
        power = (np.abs(y - gains * u) ** 2).sum(0)[1] / (averages - 1) / (window @ window)
        weights = (UNSMOOTHED[:, None] * r.conj() / through).swapaxes(0, 2)  # (bins, 3, segments)
        spread = np.array([_energy(w, b, counts, hop, window) for w, b in zip(weights, around.T, strict=True)])
        variance = power * spread / 2 * (averages - 1) / (averages - 2)
        good = np.isfinite(gain) & (variance > 0)
        if joint:
            good &= _moved(r[:, 1], u[:, 1], averages)
    coherence = _coherence(u[:, 1], y[:, 1])
    return SpectralResponse(
        bins[good] / (size * step), gain[good], np.sqrt(variance[good]), coherence[good], averages, int((~good).sum())
    )  # fmt: skip


def _count(samples: int, size: int) -> int:
    return max(0, (samples - size) // (size // 2) + 1)


def _averages(counts: Sequence[int], size: int) -> float:
    """Independent segments among ``counts`` that overlap by half."""
    window = _window(size)
    shared = float(window[size // 2 :] @ window[: size - size // 2] / (window @ window))
    return sum(k / (1 + 2 * shared**2 * (k - 1) / k) for k in counts if k)


def _energy(weights: Complex, bins: NDArray[np.intp], counts: Sequence[int], hop: int, window: Array) -> float:
    """Sum of |h|^2 over the samples of all recordings, for ``weights`` (3, segments) of the transforms at ``bins``."""
    size, total, start = len(window), 0.0, 0
    waves = np.exp(-2j * np.pi * np.outer(bins, np.arange(size)) / size) * window
    for count in counts:
        parts = weights[:, start : start + count].T @ waves  # (segments, size)
        h = np.zeros(hop * (count - 1) + size if count else 0, complex)
        for k, part in enumerate(parts):
            h[k * hop : k * hop + size] += part
        total += float((np.abs(h) ** 2).sum())
        start += count
    return total


def _window(size: int) -> Array:
    return np.asarray(get_window("hann", size))


def _segments(signals: Sequence[Array], size: int, hop: int) -> list[Complex]:
    """Transforms (segments, bins) of each recording."""
    found = []
    for x in signals:
        if len(x) < size or hop < 1:
            found.append(np.empty((0, size // 2 + 1), complex))
            continue
        cut = np.lib.stride_tricks.sliding_window_view(np.asarray(x, float), size)[::hop]
        found.append(np.asarray(np.fft.rfft(detrend(cut, axis=1) * _window(size), axis=1)))
    return found


def _coherence(a: Complex, b: Complex) -> Array:
    cross, of_a, of_b = np.abs((a.conj() * b).sum(0)) ** 2, (np.abs(a) ** 2).sum(0), (np.abs(b) ** 2).sum(0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(cross / (of_a * of_b)))


def _moved(reference: Complex, moved: Complex, averages: float) -> NDArray[np.bool_]:
    """Whether the response of the input to the reference is known well enough to divide by it."""
    coherence = _coherence(reference, moved)
    return np.asarray((1 - coherence) < WORST**2 * 2 * averages * coherence)
