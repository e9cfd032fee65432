"""Find frequency responses from recorded runs, with their noise: by averaged spectra, or at the lines of the input.

Averaged spectra: every recording is cut into segments that overlap by half, without trend and under a Hann window
(Welch 1967, IEEE Trans. Audio Electroacoustics 15, 70-73). With their transforms U of the input, Y of the output and R
of a reference, H = sum(conj(R) Y) / sum(conj(R) U). Without a reference R = U: the estimate H1 (Bendat & Piersol,
Random Data, ch. 6), which a rider or controller that answers the motion biases. A reference outside the loop is free
of that (van den Hof & Schrama 1995, Automatica 31, 1751-1770).

Lines: a multisine or anything periodic says nothing between its lines, and leaks into the frequencies between them
alike in every segment (Pintelon & Schoukens 2012, System Identification, ch. 2 and 3). So the response is taken at the
lines only, H = Y / U of lines fitted to the whole record under a Hann window (Stoica & Moses 2005, Spectral Analysis of
Signals, ch. 4). The power of y - H u next to a line is that of the noise in it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError

APART, LOWEST = 2.5, 2.0  # bins (1 / duration): nearer lines are not told apart; below is trend
MOST = 250  # lines: with more the spectrum is full
BESIDE, OFF = 8, 2.0  # frequencies without a line from which the noise of one is taken, bins between them
WORST = 0.1  # relative sd of a line of the input, or of the response of the input to the reference
FEWEST_SEGMENTS, FEWEST_SAMPLES = 5.0, 16  # independent segments; samples of one: less is all window and trend
UNSMOOTHED = np.array([-1.0, 8.0, -1.0]) / 6  # second difference: takes away what the window averaged, H'' / (6 T^2)


def lines_of(signal: Array, step: float) -> Array:
    """Frequencies of the lines of a signal (m,), Hz; none if more than a twentieth of the power is outside of lines."""
    x = _off_a_line(np.asarray(signal, float))
    duration = len(x) * step
    total = float(weights(len(x)) @ x**2)
    lines, remainder, share = np.empty(0), x, 1.0
    for number in range(3):
        more = _peaks(remainder, step, lines)
        if not 0 < len(more) + len(lines) <= MOST:
            break
        first = np.sort(np.concatenate([lines, more]))
        remainder = fit_lines(first, [x], step)[1][0]
        if not number and float(weights(len(x)) @ remainder**2) > 0.2 * total:
            return np.empty(0)
        lines = first
        for _ in range(3):
            lines = _refine_lines(lines, x, step)
        remainder = fit_lines(lines, [x], step)[1][0]
        share = float(weights(len(x)) @ remainder**2) / total
        if share < 1e-4 or not len(more):
            break
    lines = lines[np.diff(lines, prepend=-np.inf) * duration > 1]
    return lines if share <= 0.05 else np.empty(0)


def weights(size: int) -> Array:
    """Hann window of ``size`` samples, shape (size,), symmetric and above zero."""
    return np.hanning(size + 2)[1:-1]


def _off_a_line(x: Array) -> Array:
    """Numbers (..., samples) less their own straight lines of least squares."""
    basis = np.linalg.qr(np.column_stack([np.ones(x.shape[-1]), np.linspace(-1.0, 1.0, x.shape[-1])]))[0]
    return np.asarray(x - x @ basis @ basis.T)


def _line_basis(hertz: Array, size: int, step: float) -> Iterator[tuple[slice, Array, Array]]:
    """Cosines, sines, one and a ramp at the samples (samples, 2 m + 2), some rows at a time with their times, s."""
    for first in range(0, size, 1 << 13):
        rows = slice(first, first + (1 << 13))
        time = np.asarray((np.arange(size)[rows] - (size - 1) / 2) * step, np.float64)
        wave = _waves(hertz, time, step)
        yield rows, np.column_stack([wave.real, wave.imag, np.ones_like(time), time / (size * step)]), time


def _waves(hertz: Array, time: Array, step: float) -> Complex:
    """exp(2 pi i f t) at even times (samples, m), by products of few: each exponential takes long."""
    late, early = (np.exp(2j * np.pi * np.outer(t, hertz)) for t in (time[::64], np.arange(64) * step))
    return np.asarray((late[:, None] * early).reshape(-1, len(hertz))[: len(time)])


def fit_lines(hertz: Array, signals: Sequence[Array], step: float) -> tuple[Array, Array]:
    """Fit lines, one and a ramp by weighted least squares: coefficients (2 m + 2, signals), residuals (signals, k)."""
    x = np.array(signals, float)
    size, width = x.shape[1], 2 * len(hertz) + 2
    gram = np.zeros((width, width))
    side = np.zeros((width, len(x)))
    v = np.sqrt(weights(size))
    for rows, a, _ in _line_basis(hertz, size, step):
        a *= v[rows, None]
        gram += a.T @ a
        side += a.T @ (x[:, rows] * v[rows]).T
    coefficients = np.linalg.lstsq(gram, side, rcond=None)[0]
    residuals = np.concatenate(
        [x[:, rows] - (a @ coefficients).T for rows, a, _ in _line_basis(hertz, size, step)], axis=1
    )
    return np.asarray(coefficients, float), residuals


def _peaks(x: Array, step: float, known_lines: Array) -> Array:
    """Peaks (Hz) of the spectrum that stand apart from each other and from the ``known_lines``, Hz."""
    size = len(x)
    padded = 8 * len(x)
    power = np.abs(np.fft.rfft(x * weights(size), padded))
    hertz = np.arange(len(power)) / (padded * step)
    inner = np.arange(1, len(power) - 1)
    highest = power[hertz * size * step >= LOWEST].max(initial=np.inf if size < 8 else 0)
    high = power[inner] >= 0.03 * highest  # the side lobes of the window lie at 0.027
    top = inner[high & (power[inner] > power[inner - 1]) & (power[inner] >= power[inner + 1])]
    top = top[hertz[top] * size * step >= LOWEST]
    if len(top) > 3 * MOST:
        return np.empty(0)
    chosen: list[float] = []
    for k in top[np.argsort(-power[top])]:
        before, at, after = np.log(power[k - 1 : k + 2])
        f = float(hertz[k] + 0.5 * (before - after) / (before - 2 * at + after) * hertz[1])
        if np.abs(np.concatenate([known_lines, chosen]) - f).min(initial=np.inf) * size * step >= APART:
            chosen.append(f)
    return np.array(chosen)


def _refine_lines(hertz: Array, x: Array, step: float) -> Array:
    """Frequencies ``hertz`` (m,), Hz, after one step of Gauss and Newton on the residual of their lines."""
    size, m = len(x), len(hertz)
    coefficients, residuals = fit_lines(hertz, [x], step)
    of_cos, of_sin = coefficients[:m, 0], coefficients[m : 2 * m, 0]
    width = 3 * m + 2
    gram = np.zeros((width, width))
    side = np.zeros(width)
    v = np.sqrt(weights(size))
    for rows, a, time in _line_basis(hertz, size, step):
        turn = 2 * np.pi * time[:, None] / (size * step)
        a = np.column_stack([a, turn * (of_sin * a[:, :m] - of_cos * a[:, m : 2 * m])]) * v[rows, None]
        gram += a.T @ a
        side += a.T @ (residuals[0, rows] * v[rows])
    scale = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    bins = (np.linalg.lstsq(gram / np.outer(scale, scale), side / scale, rcond=1e-12)[0] / scale)[2 * m + 2 :]
    return np.asarray(hertz + np.clip(bins, -0.25, 0.25) / (size * step))


@dataclass(frozen=True)
class LineResponse:
    """Response at m lines, of one record."""

    frequency_hz: Array  # (m,) hz
    gain: Complex  # (m,) unit of the output over that of the input
    variance: Array  # (m,) of real and of imaginary part
    strength: Array  # (m,) power of the line of the input over that of unit white noise in it
    moved: NDArray[np.bool_]  # (m,) true if the line of the input stands out of its noise


def line_response(hertz: Array, input_signal: Array, output_signal: Array, step: float) -> LineResponse:
    """Response of one record at the lines ``hertz`` (m,), Hz, sampled by ``step`` (s)."""
    size, m = len(input_signal), len(hertz)
    coefficients, (rest_u, rest_y) = fit_lines(hertz, [input_signal, output_signal], step)
    u, y = (coefficients[:m] - 1j * coefficients[m : 2 * m]).T
    between = _gap_frequencies(hertz, size, step)
    v, width = weights(size), 2 * m + 2
    once, twice, cross = np.zeros((width, width)), np.zeros((width, width)), np.zeros((width, len(between)), complex)
    line_u = np.zeros(len(between), complex)
    line_y = np.zeros(len(between), complex)
    window_energy = float(v @ v)
    down = np.zeros((width, len(between)), complex)
    for rows, a, time in _line_basis(hertz, size, step):
        wave = v[rows, None] * _waves(between, time, step)
        once += a.T @ (a * v[rows, None])
        twice += a.T @ (a * v[rows, None] ** 2)
        down += a.T @ wave
        cross += a.T @ (wave * v[rows, None])
        line_u += wave.conj().T @ rest_u[rows]
        line_y += wave.conj().T @ rest_y[rows]
    inverse = np.linalg.pinv(once, hermitian=True)
    of_lines = inverse[:, :m] - 1j * inverse[:, m : 2 * m]
    squares_of_lines = np.einsum("ij,ik,kj->j", of_lines.conj(), twice, of_lines).real  # sum |h|^2 of each line
    q = inverse @ down
    energy_left = (
        window_energy
        - 2 * np.einsum("ij,ij->j", q.conj(), cross).real
        + np.einsum("ij,ik,kj->j", q.conj(), twice, q).real
    )
    nearest_gaps = np.argsort(np.abs(between - hertz[:, None]), axis=1)[:, :BESIDE]
    n = nearest_gaps.shape[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = y / u
        power = (
            np.abs(line_y[nearest_gaps] - gain[:, None] * line_u[nearest_gaps]) ** 2 / energy_left[nearest_gaps]
        ).mean(1)
        of_input = (np.abs(line_u[nearest_gaps]) ** 2 / energy_left[nearest_gaps]).mean(1) * squares_of_lines
        variance = power * squares_of_lines / np.abs(u) ** 2 / 2 * n / (n - 1)  # that of Student's t, of 2 n numbers
    return LineResponse(
        hertz, gain, variance, np.abs(u) ** 2 / squares_of_lines, of_input < 2 * WORST**2 * np.abs(u) ** 2
    )


def _gap_frequencies(hertz: Array, size: int, step: float) -> Array:
    """Frequencies, Hz, that are clear of every line: in each gap, not more than serve the line at its ends."""
    bin_width = 1 / (size * step)
    ends = np.concatenate(
        [[LOWEST * bin_width / 2], hertz, [min(hertz[-1] + (BESIDE + 1) * OFF * bin_width, 0.5 / step)]]
    )
    frequencies = []
    for low, high in pairwise(ends):
        gap = (high - low) / bin_width
        count = int(gap / OFF) - 1 if gap >= 2 * OFF else int(gap >= APART)
        places = low + (high - low) * np.arange(1, count + 1) / (count + 1)
        frequencies.append(places if count <= 2 * BESIDE else np.concatenate([places[:BESIDE], places[-BESIDE:]]))
    return np.concatenate(frequencies)


@dataclass(frozen=True)
class SpectralResponse:
    """Frequency response at m frequencies."""

    frequency_hz: Array  # (m,) hz
    gain: Complex  # (m,) unit of the output over that of the input
    sd: Array  # (m,) one standard deviation of real and of imaginary part, in the unit of the gain
    coherence: Array  # (m,) gamma^2 of input and output; at lines, that which with ``averages`` has this sd
    averages: float  # independent segments; at lines, frequencies beside each from which its noise is taken
    left_out: int = 0  # frequencies at which the reference hardly moves the input, or lines that noise hides
    lines: int = 0  # lines of which the input is made; 0 where it fills the spectrum


def spectral_response(
    inputs: Sequence[Array],
    outputs: Sequence[Array],
    step: float,
    *,
    segment_s: float,
    references: Sequence[Array] | None = None,
    highest_hz: float = np.inf,
) -> SpectralResponse:
    """Find the frequency response from one or several recordings of one condition, evenly sampled by ``step`` (s)."""
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
        of, no = (
            [k for k, x in zip(long, lines, strict=True) if bool(len(x)) == has_lines] for has_lines in (True, False)
        )
        if no:
            raise InputError(
                f"the input of recording {of[0] + 1} is made of lines, that of recording {no[0] + 1} is not; give the "
                "recordings to the command one by one"
            )
        return _at_lines(signals, lines, step, highest_hz)
    seconds = step * sum(len(x) for x in inputs)
    averages = _averages([max(0, (len(x) - size) // (size // 2) + 1) for x in inputs], size) if long else 0.0
    if averages < FEWEST_SEGMENTS:
        raise InputError(
            f"{seconds:.3g} s hold {averages:.1f} independent segments of {segment_s:g} s; at least "
            f"{FEWEST_SEGMENTS:g} are needed: take shorter segments, or record longer"
        )
    hertz = np.arange(size // 2 + 1) / (size * step)
    bins = np.arange(2, len(hertz) - 1, 2)  # the window makes neighbours nearly the same number
    bins = bins[hertz[bins] <= highest_hz * (1 + 1e-9)]
    if len(bins) < 2:
        raise InputError(
            f"segments of {segment_s:g} s show {len(bins)} frequencies up to {min(highest_hz, hertz[-1]):g} Hz; take "
            "longer segments or a higher limit"
        )
    return _average_segments(signals, step, size, bins, joint=references is not None)


def _at_lines(
    signals: Sequence[Sequence[Array]], lines: Sequence[Array], step: float, highest_hz: float
) -> SpectralResponse:
    """Response at the ``lines`` of each recording; lines that several share are averaged by their strength."""
    responses = [line_response(h, u, y, step) for h, u, y in zip(lines, *signals[:2], strict=True)]
    hertz, gain, variance, power, is_driven = (
        np.concatenate([getattr(r, name) for r in responses])
        for name in ("frequency_hz", "gain", "variance", "strength", "moved")
    )
    order = np.argsort(hertz)
    resolution = 0.5 / (step * min(len(x) for x in signals[0]))
    group = np.empty(len(hertz), int)
    group[order] = np.cumsum(np.diff(hertz[order], prepend=-np.inf) > resolution) - 1
    weight = np.where(is_driven, power, 0)
    total = np.bincount(group, weight)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.bincount(group, weight * hertz) / total
        ratio = np.bincount(group, weight * gain.real) / total + 0j
        ratio += 1j * np.bincount(group, weight * gain.imag) / total
        sd = np.sqrt(np.bincount(group, weight**2 * variance)) / total
        coherence = 1 / (1 + 2 * BESIDE * (sd / np.abs(ratio)) ** 2)
    lowest = np.full(len(total), np.inf)
    np.minimum.at(lowest, group, hertz)
    in_range = lowest <= highest_hz * (1 + 1e-6)
    if not in_range.any():
        raise InputError(
            f"the input is made of lines from {lowest.min():.4g} to {hertz.max():.4g} Hz, none of them up to "
            f"{highest_hz:g} Hz; take a higher limit"
        )
    usable = in_range & (sd > 0) & np.isfinite(ratio)
    return SpectralResponse(
        mean[usable],
        ratio[usable],
        sd[usable],
        coherence[usable],
        float(BESIDE),
        int((in_range & ~usable).sum()),
        lines=len(total),
    )


def _average_segments(
    signals: Sequence[Sequence[Array]], step: float, size: int, bins: NDArray[np.intp], *, joint: bool
) -> SpectralResponse:
    """Find the response at ``bins`` of segments of ``size`` samples; ``joint``: the reference is not the input.

    E = Y - H U has the power sum |E|^2 / (n - 1) with n independent segments. H = sum_t h(t) y(t) is linear in the
    samples of the output, so its variance is that of white noise of this power times sum |h|^2: overlap, neighbouring
    bins and segments in which the input hardly moves are all in h. It is widened as the variance of Student's t.
    """
    hop, window = size // 2, np.hanning(size + 1)[:-1]
    segments = [_segments(parts, size, hop) for parts in signals]
    counts = [len(part) for part in segments[0]]
    averages = _averages(counts, size)
    around = bins + np.array([-1, 0, 1])[:, None]
    u, y, r = (np.concatenate([part[:, around] for part in parts]) for parts in segments)  # (segments, 3, bins)
    through = (r.conj() * u).sum(0)
    with np.errstate(divide="ignore", invalid="ignore"):
        gains = (r.conj() * y).sum(0) / through
        gain = UNSMOOTHED @ gains
        power = (np.abs(y - gains * u) ** 2).sum(0)[1] / (averages - 1) / (window @ window)
        weights = (UNSMOOTHED[:, None] * r.conj() / through).swapaxes(0, 2)  # (bins, 3, segments)
        variance = power * _energy(weights, around, counts, window) / 2 * (averages - 1) / (averages - 2)
        good = np.isfinite(gain) & (variance > 0)
        if joint:
            input_coherence = _coherence(
                r[:, 1], u[:, 1]
            )  # the response of the input to the reference, by which is divided
            good &= (1 - input_coherence) < WORST**2 * 2 * averages * input_coherence
    coherence = _coherence(u[:, 1], y[:, 1])
    return SpectralResponse(
        bins[good] / (size * step), gain[good], np.sqrt(variance[good]), coherence[good], averages, int((~good).sum())
    )


def _averages(counts: Sequence[int], size: int) -> float:
    """Independent segments among ``counts`` that overlap by half."""
    window = np.hanning(size + 1)[:-1]
    shared = float(window[size // 2 :] @ window[: size - size // 2] / (window @ window))
    return sum(k / (1 + 2 * shared**2 * (k - 1) / k) for k in counts if k)


def _energy(weights: Complex, around: NDArray[np.intp], counts: Sequence[int], window: Array) -> Array:
    """Sum of |h|^2 over the samples of all recordings (bins,), for weights (bins, 3, segments) of the transforms."""
    # h is the sum of the segments' parts: products of each with itself and with the next one, which it overlaps by half
    size = len(window)
    hop = len(window) // 2
    places = np.array([-1, 0, 1])
    turn = np.exp(-2j * np.pi * (places[:, None] - places)[..., None] * np.arange(size) / size)
    full_overlap, shared = turn @ window**2, turn[..., : size - hop] @ (window[hop:] * window[: size - hop])
    followed = np.delete(np.arange(sum(counts)), np.cumsum(counts) - 1)
    late = weights[..., followed] * np.exp(-2j * np.pi * around.T * hop / size)[..., None]
    total = np.einsum("bik,ij,bjk->b", weights, full_overlap, weights.conj()).real
    return np.asarray(total + 2 * np.einsum("bik,ij,bjk->b", late, shared, weights[..., followed + 1].conj()).real)


def _segments(signals: Sequence[Array], size: int, hop: int) -> list[Complex]:
    """Windowed Fourier transforms (segments, bins) of each recording, in segments of ``size`` samples every ``hop``."""
    cuts = (np.lib.stride_tricks.sliding_window_view(np.asarray(x, float), size)[::hop] for x in signals)
    return [np.asarray(np.fft.rfft(_off_a_line(cut) * np.hanning(size + 1)[:-1], axis=1)) for cut in cuts]


def _coherence(a: Complex, b: Complex) -> Array:
    cross = np.abs((a.conj() * b).sum(0)) ** 2
    of_a = (np.abs(a) ** 2).sum(0)
    of_b = (np.abs(b) ** 2).sum(0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(cross / (of_a * of_b)))
