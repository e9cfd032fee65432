"""Frequency and damping of one mode from raw free decays, with errors that respect coloured noise.

A decay is fitted to x = e^(sigma t) (a cos(omega t) + b sin(omega t)) + c for every channel at once (sigma and omega
shared, amplitudes and offset of each channel linear, so projected out). The errors come from the curvature with the
noise whitened by a first-order autoregression of the residual of each channel.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from studies.missing_effect.motion.history_table import Run
from tyre.errors import InputError

Array = NDArray[np.float64]
FEWEST_CYCLES = 1.0
POOREST = 0.8  # R^2 of the decay
ROUNDS = 3
RATIOS = {
    "steer_over_lean": ("steer_rate_rad_s", "roll_rate_rad_s"),
    "yaw_over_lean": ("yaw_rate_rad_s", "roll_rate_rad_s"),
}


@dataclass(frozen=True)
class Decay:
    """One mode of one run; eigenvalue in 1/s, 1-sigma of its parts, ratios of channels, R^2 and number of cycles."""

    run: str
    speed: float
    eigenvalue: complex
    sd: tuple[float, float]
    ratios: Mapping[str, tuple[complex, float]]
    r_squared: float
    cycles: float

    @property
    def rejected(self) -> str:
        """Why the run tells too little, or nothing."""
        if self.cycles < FEWEST_CYCLES:
            return f"{self.cycles:.1f} cycles in the window are too few (at least {FEWEST_CYCLES:g})"
        if self.r_squared < POOREST:
            return f"R^2 = {self.r_squared:.2f} is below {POOREST:g}: not one decaying oscillation"
        return ""

    def row(self, mode: str) -> dict[str, Any]:
        """A row of a modal table."""
        row: dict[str, Any] = {
            "speed_m_s": self.speed, "mode": mode, "real_1_s": self.eigenvalue.real, "imag_rad_s": self.eigenvalue.imag,
            "real_sd_1_s": self.sd[0], "imag_sd_rad_s": self.sd[1],
        }  # fmt: skip
        for name, (value, sd) in self.ratios.items():
            row |= {f"{name}_re": value.real, f"{name}_im": value.imag, f"{name}_sd": sd}
        return row


def identify(run: Run, *, first_s: float = 0.0, last_s: float = math.inf, start_hz: float | None = None) -> Decay:
    """Fit one decaying oscillation to all channels of a run between two times.

    Raises
    ------
    InputError
        Fewer than 20 samples in the window.
    """
    keep = (run.time >= run.time[0] + first_s - 1e-9) & (run.time <= run.time[0] + last_s + 1e-9)
    if keep.sum() < 20:
        raise InputError(
            f"{run.name}: {keep.sum()} samples between {first_s:g} and {last_s:g} s; at least 20 are needed"
        )
    t = run.time[keep] - run.time[keep][0]
    signals = {name: x[keep] for name, x in run.channels.items()}
    scale = {name: float(np.std(x)) for name, x in signals.items()}
    noise = {name: (0.3 * scale[name], 0.0) for name in signals}  # sd, autoregressive coefficient
    guesses = [2 * math.pi * start_hz] if start_hz else _frequencies(t, signals)
    best = None
    for round_ in range(ROUNDS):
        starts = [(s, w) for w in guesses for s in (-0.5, -2.0)] if best is None else [tuple(best.x)]
        for start in starts:
            found = least_squares(_residual, start, bounds=([-50, 0.1], [20, 200]), args=(t, signals, noise))
            if best is None or round_ or found.cost < best.cost:
                best = found
        assert best is not None
        noise = {name: _noise(_channel(best.x, t, x)[1]) for name, x in signals.items()}
    assert best is not None
    slopes = np.asarray(best.jac)
    covariance = np.linalg.inv(slopes.T @ slopes)
    sigma, omega = (float(x) for x in best.x)
    left = sum(float(np.sum(_channel(best.x, t, x)[1] ** 2)) / scale[name] ** 2 for name, x in signals.items())
    r_squared = 1 - left / (len(t) * len(signals))
    return Decay(
        run.name, run.speed, complex(sigma, omega), (math.sqrt(covariance[0, 0]), math.sqrt(covariance[1, 1])),
        _ratios(best.x, t, signals, noise), r_squared, omega * t[-1] / (2 * math.pi),
    )  # fmt: skip


def _frequencies(t: Array, signals: Mapping[str, Array]) -> list[float]:
    """Highest peaks of the summed spectra, rad/s."""
    step = t[1] - t[0]
    size = 8 * len(t)
    power = sum(np.abs(np.fft.rfft((x - x.mean()) / np.std(x), size)) ** 2 for x in signals.values())
    frequency = 2 * np.pi * np.fft.rfftfreq(size, step)
    power = np.where(frequency < 1.0, 0.0, power)
    first = float(frequency[int(np.argmax(power))])
    return [first, 0.6 * first, 1.6 * first]


def _basis(x: Array, t: Array) -> Array:
    decay = np.exp(np.clip(x[0] * t, -700, 700))
    return np.stack([decay * np.cos(x[1] * t), decay * np.sin(x[1] * t), np.ones_like(t)], 1)


def _channel(x: Array, t: Array, signal: Array) -> tuple[Array, Array]:
    """Amplitudes (3,) and residual of one channel."""
    basis = _basis(x, t)
    amplitudes = np.linalg.lstsq(basis, signal, rcond=None)[0]
    return np.asarray(amplitudes, float), np.asarray(signal - basis @ amplitudes, float)


def _whiten(signal: Array, noise: tuple[float, float]) -> Array:
    sd, colour = noise
    white = signal / sd
    white[1:] = (white[1:] - colour * white[:-1]) / math.sqrt(1 - colour**2)
    return white


def _residual(x: Array, t: Array, signals: Mapping[str, Array], noise: Mapping[str, tuple[float, float]]) -> Array:
    parts = []
    for name, signal in signals.items():
        basis, white = _whiten(_basis(x, t), noise[name]), _whiten(signal, noise[name])
        parts.append(white - basis @ np.linalg.lstsq(basis, white, rcond=None)[0])
    return np.concatenate(parts)


def _noise(residual: Array) -> tuple[float, float]:
    colour = float(np.clip(residual[1:] @ residual[:-1] / (residual @ residual), 0.0, 0.98))
    return float(np.std(residual)) + 1e-12, colour


def _ratios(
    x: Array, t: Array, signals: Mapping[str, Array], noise: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[complex, float]]:
    """Complex ratios of rate channels; a rate that was not recorded is lambda times its angle."""
    root, phasors, errors = complex(*x), {}, {}
    basis = _basis(x, t)
    for name, signal in signals.items():
        white = _whiten(basis, noise[name])
        a, b, _ = np.linalg.lstsq(white, _whiten(signal, noise[name]), rcond=None)[0]
        spread = np.linalg.inv(white.T @ white)
        phasors[name], errors[name] = complex(a, -b), math.sqrt((spread[0, 0] + spread[1, 1]) / 2)
    for angle, rate in (("steer_rad", "steer_rate_rad_s"), ("lean_rad", "roll_rate_rad_s")):
        if rate not in phasors and angle in phasors:
            phasors[rate], errors[rate] = root * phasors[angle], abs(root) * errors[angle]
    found = {}
    for name, (over, under) in RATIOS.items():
        if over in phasors and under in phasors:
            value = phasors[over] / phasors[under]
            sd = math.hypot(errors[over], abs(value) * errors[under]) / abs(phasors[under])
            found[name] = (value, sd)
    return found
