"""Spectra of a ride: auto and cross spectra of its channels in bands of frequency, averaged over sine tapers.

K sine tapers (Riedel & Sidorenko 1995, IEEE Transactions on Signal Processing 43) give K independent estimates of a
spectrum that hardly changes over their band, of half width K / (2 T) about a frequency, T the duration. Those of the
stretches of a ride are averaged. A model is averaged over the same band before it is compared: by Gauss's rule for an
even band of the variance (K + 1) (2 K + 1) / (24 T^2) of the tapers' window. Seven nodes give the mean of a resonance
of damping ratio 0.5 % within 2 %.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from bicycle.identification.recording import Run
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError

NARROWEST = 24.0  # averages of a band of low frequency
RELATIVE_WIDTH = 0.03  # of a band over its frequency: the width of a resonance of damping ratio 1.5 %
NODES = 7  # frequencies at which a model is averaged over a band


@dataclass(frozen=True, eq=False)
class RideSpectrum:
    """Spectra of C channels in b bands, of one ride at one speed, one-sided: the variance is the integral over Hz."""

    name: str
    speed: float  # m/s
    channels: tuple[str, ...]  # (C,)
    hertz: Array  # (b,), Hz, the middle of each band
    nodes: Array  # (b, q), Hz, frequencies over which a model is averaged
    weights: Array  # (q,), of the nodes; their sum is 1
    values: Complex  # (b, C, C), product of the channels' units per Hz
    averages: Array  # (b,), independent estimates in each value
    duration: float  # s, of all stretches


@dataclass(frozen=True, eq=False)
class Bands:
    """Bands of frequency without gaps."""

    middle: Array  # (b,), Hz
    width: Array  # (b,), Hz


def bands_between(lowest: float, highest: float, narrowest: float) -> Bands:
    """Bands from ``lowest`` to ``highest`` (Hz), each ``narrowest`` (Hz) wide or 3 % of its frequency."""
    middles, widths, edge = [], [], lowest
    while True:
        width = max(narrowest, RELATIVE_WIDTH * edge / (1 - RELATIVE_WIDTH / 2))
        if edge + width > highest:
            break
        middles.append(edge + width / 2)
        widths.append(width)
        edge += width
    return Bands(np.array(middles), np.array(widths))


def narrowest_band(durations: Sequence[float]) -> float:
    """Narrowest band (Hz) that stretches of these ``durations`` (s) show: one taper of a typical one, 24 averages."""
    longest_first = np.sort(durations)[::-1]
    covered = np.cumsum(longest_first) / np.sum(durations)
    typical = longest_first[int(np.argmax(covered >= 0.8 - 1e-9))]
    return float(max(2.0 / typical, (NARROWEST + 1) / np.sum(durations)))


def ride_spectrum(
    name: str, stretches: Sequence[Run], channels: Sequence[str], bands: Bands, *, speed: float
) -> RideSpectrum:
    """Spectra of the ``channels`` (C,) of a ride, from its ``stretches`` at one ``speed`` (m/s), in ``bands`` (b,).

    Raises
    ------
    InputError
        Too few averages for so many channels in some band.
    """
    sums = np.zeros((len(bands.middle), len(channels), len(channels)), complex)
    averages = np.zeros(len(bands.middle))
    spread = np.zeros(len(bands.middle))  # variance of the window times the averages, Hz^2
    for run in stretches:
        duration = run.step * (len(run.time) + 1)
        tapers = np.round(bands.width * duration).astype(int) - 1
        signals = np.stack([_without_trend(run.channels[c] if c in run.channels else run.inputs[c]) for c in channels])
        sums += _tapered_products(signals, run.step, bands.middle, tapers)
        counted = np.maximum(tapers, 0)
        averages += counted
        spread += counted * (counted + 1) * (2 * counted + 1) / (24 * duration**2)
    if (averages < 2 * len(channels)).any():
        raise InputError(
            f"{name}: {averages.min():.0f} averages of a band are too few for {len(channels)} channels, which need "
            f"{2 * len(channels)}; record longer, or leave a channel out"
        )
    points, weights = np.polynomial.legendre.leggauss(NODES)
    half = np.sqrt(3 * spread / averages)
    return RideSpectrum(
        name,
        speed,
        tuple(channels),
        bands.middle,
        np.maximum(bands.middle[:, None] + half[:, None] * points, 1e-3),
        weights / 2,
        np.asarray(sums / averages[:, None, None]),
        averages,
        float(sum(run.step * len(run.time) for run in stretches)),
    )


def _without_trend(signal: Array) -> Array:
    """A ``signal`` (n,) less its mean and straight trend."""
    return np.asarray(scipy.signal.detrend(signal))


def _tapered_products(signals: Array, step: float, middles: Array, tapers: NDArray[np.int_]) -> Complex:
    """Sums (b, C, C) over sine tapers of the products of tapered ``signals`` (C, n), one-sided, unit^2/Hz.

    The transform of taper k is a difference of two values of that of the signal, padded to twice its length.
    """
    channels, n = signals.shape
    transform = np.fft.fft(signals, 2 * (n + 1), axis=1)
    scale = step / (n + 1)  # 2 step |Y|^2 with Y = sqrt(2 / (n + 1)) / 2 (...)
    sums = np.zeros((len(middles), channels, channels), complex)
    for band, (middle, count) in enumerate(zip(middles, tapers, strict=True)):
        if count < 1:
            continue
        centre = round(middle * 2 * (n + 1) * step)
        k = np.arange(1, count + 1)
        turn = np.exp(1j * np.pi * k / (n + 1))
        tapered = turn * transform[:, centre - k] - turn.conj() * transform[:, centre + k]
        sums[band] = scale * tapered @ tapered.conj().T
    return sums
