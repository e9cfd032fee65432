"""Frequency and damping of modes from raw free decays, with errors that respect noise, drift and the window's start.

Every channel is a sum of decaying oscillations, a drift and noise (:mod:`.decay_evidence`). The kind of drift (none,
constant, parabola, or a real mode that dies out) is weighed by its evidence (:mod:`.decay_estimate`), the window is
fitted again from later starts (:mod:`.window_start`), and repeats say what one decay cannot (:mod:`.repeats`).
`velotyre validate free-decays` counts how often the intervals hold the truth.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bicycle.eigenvalues.oscillation import angular_frequency, frequency_hz
from bicycle.identification.decay_estimate import CLEAR, Estimate, log_odds_of_each, sought
from bicycle.identification.decay_evidence import DRIFTS, KINDS, drift_of
from bicycle.identification.decay_guesses import FASTEST, SLOWEST
from bicycle.identification.decay_ratios import RATIOS
from bicycle.identification.decay_window import SHARES, window
from bicycle.identification.loud_decay import why_drowned
from bicycle.identification.recording import Run
from bicycle.identification.window_break import Break, broken
from bicycle.identification.window_start import PARTS, TOO_FAR, Movement, movement
from tyre.base.arrays import Array
from tyre.base.errors import InputError, unknown

POOREST = 0.8  # R^2 of a decay that is taken as it is
MOST_DOUBT = 0.3  # sd of a part of the eigenvalue over its size
MOST_MODES = 3
FEWEST_CYCLES = 0.25  # of a mode in the window
TOLD = {True: SHARES / SHARES.sum(), False: 0 * SHARES}  # what somebody sees driving is hardly driven the least
__all__ = ["DRIFTS", "MOST_DOUBT", "MOST_MODES", "POOREST", "RATIOS", "Decay", "identify", "identify_modes"]


@dataclass(frozen=True)
class Decay:
    """One mode of one run.

    Attributes
    ----------
    run : str
    speed : float
        m/s.
    eigenvalue : complex
        1/s.
    sd : tuple of float
        1-sigma of its real and imaginary part, 1/s: a 95 % interval is 1.96 of it to both sides.
    ratios : mapping of str to tuple
        Ratio of channels -> value and 1-sigma of each part.
    r_squared : float
        What such modes and the drift explain at most, over all channels.
    cycles : float
        In the window.
    drift : str
        The most probable kind, one of :data:`DRIFTS`.
    drift_odds : float
        Its probability.
    movement : Movement, optional
        How far the numbers move with the start of the window; None where that was not or could not be tried.
    beside : tuple of complex
        Eigenvalues of what was fitted beside, as the evidence for it is clear.
    estimate : Estimate, optional
        All of it; None where no oscillation was found.
    fewer : str
        That the window holds fewer modes than were asked for; empty where all are there.
    drowned : str
        Why R^2 is too small; empty where it is not, or where the rest is noise beside a clear oscillation.
    broken : Break, optional
        The largest sample that neither the modes nor noise explain; None where there is none, or where it was not
        sought.
    """

    run: str
    speed: float
    eigenvalue: complex
    sd: tuple[float, float]
    ratios: Mapping[str, tuple[complex, float]]
    r_squared: float
    cycles: float
    drift: str = ""
    drift_odds: float = 1.0
    movement: Movement | None = None
    beside: tuple[complex, ...] = ()
    estimate: Estimate | None = None
    fewer: str = ""
    drowned: str = ""
    broken: Break | None = None

    @property
    def rejected(self) -> str:
        """Why the run tells too little, or nothing."""
        if self.estimate is None:
            return "no decaying oscillation was found"
        if self.fewer:
            return self.fewer
        if self.drowned:
            shown = math.floor(1000 * self.r_squared) / 1000  # never rounded up to what it is below
            return f"R^2 = {shown:g} is below {POOREST:g}, and {self.drowned}"
        size, doubt = abs(self.eigenvalue), max(self.sd)
        if doubt > MOST_DOUBT * size:
            why = f"{self.cycles:.1f} cycles tell too little"
            if self.movement is not None and self.movement.what:
                why = "it moves too far with the start of the window"
            return f"{why}: an sd of {doubt:.2g} 1/s is {doubt / size:.0%} of |eigenvalue| (at most {MOST_DOUBT:.0%})"
        if self.cycles < FEWEST_CYCLES:
            return (
                f"it turns by {self.cycles:.2g} cycles in the window (at least {FEWEST_CYCLES:g}): a motion that does "
                "not oscillate, such as a capsize, looks like that; give the frequency of an oscillation (start_hz)"
            )
        if self.movement is not None and self.movement.refused:
            return self._moving(self.movement)
        if self.broken is not None and self.broken.refused:
            return (
                f"{self.broken.what.replace('_', ' ')} moves by {self.broken.farthest:.3g} sd (at most {TOO_FAR:g}) "
                f"when the window ends at {self.broken.until_s:.4g} s, before {self.broken.channel} jumps: end it there"
            )
        return ""

    def _moving(self, moved: Movement) -> str:
        return (
            f"{moved.what.replace('_', ' ')} moves by {moved.farthest:.3g} sd (at most {TOO_FAR:g}) when the window "
            f"begins later: start it at {moved.settled_s:.3g} s, from where it moves no more"
        )

    def row(self, mode: str) -> dict[str, Any]:
        """A row of a modal table, for the mode named ``mode``."""
        row: dict[str, Any] = {
            "speed_m_s": self.speed, "mode": mode, "real_1_s": self.eigenvalue.real, "imag_rad_s": self.eigenvalue.imag,
            "real_sd_1_s": self.sd[0], "imag_sd_rad_s": self.sd[1],
        }  # fmt: skip
        for name, (value, sd) in self.ratios.items():
            row |= {f"{name}_re": value.real, f"{name}_im": value.imag, f"{name}_sd": sd}
        return row


def identify(
    run: Run, *, first_s: float = 0.0, last_s: float = math.inf, start_hz: float | None = None,
    drift: str | None = None, driven: bool | Array | None = None, thorough: bool = True,
) -> Decay:  # fmt: skip
    """Fit one decaying oscillation to all channels of a run between two times.

    Parameters
    ----------
    run : Run
    first_s, last_s : float, optional
        Window, s after the first sample of the run.
    start_hz : float, optional
        Frequency (Hz) to start from; by default those at and about the highest peak of the spectrum.
    drift : str, optional
        One of :data:`DRIFTS`; by default all of them, weighed by their evidence.
    driven : bool or ndarray, shape (f,), optional
        Whether something, such as a rough road, drives the motion all along the window; or the probabilities, before
        the samples are seen, that it does so with each of :data:`SHARES`. By default even odds.
    thorough : bool, optional
        Also fit from later starts, and a further mode beside where the evidence for one is clear.

    Raises
    ------
    InputError
        Fewer than 20 samples in the window, a channel that is constant there, a start frequency out of range, an
        unknown drift.
    """
    settings: dict[str, Any] = {"start_hz": start_hz, "drift": drift, "driven": driven, "thorough": thorough}
    decays = identify_modes(run, 1, first_s=first_s, last_s=last_s, **settings)
    return decays[0]


def identify_modes(
    run: Run, count: int, *, first_s: float = 0.0, last_s: float = math.inf, start_hz: float | None = None,
    drift: str | None = None, driven: bool | Array | None = None, thorough: bool = True,
) -> tuple[Decay, ...]:  # fmt: skip
    """Fit several decaying oscillations at once; by frequency.

    Parameters
    ----------
    run : Run
    count : int
        Number of modes, up to :data:`MOST_MODES`.
    first_s, last_s, start_hz, drift, driven, thorough : optional
        As :func:`identify`.

    Raises
    ------
    InputError
        As :func:`identify`; more modes than are fitted.
    """
    if start_hz is not None and not SLOWEST < angular_frequency(start_hz) < FASTEST:
        low, high = (float(frequency_hz(1j * omega)) for omega in (SLOWEST, FASTEST))
        raise InputError(f"start_hz = {start_hz:g} is outside {low:.2g} .. {high:.2g} Hz")
    if drift is not None and drift not in DRIFTS:
        raise InputError(unknown("drift", drift, DRIFTS))
    if not 1 <= count <= MOST_MODES:
        raise InputError(f"{count} modes in one window; give 1 to {MOST_MODES}")
    drifts = tuple(kind for kind in KINDS if drift in (None, drift_of(kind)))
    chances = TOLD[driven] if isinstance(driven, bool) else driven
    found = sought(
        lambda block: window(run, first_s, last_s, block=block, driven=chances), drifts, start_hz, count,
        further=thorough and count == 1,
    )  # fmt: skip
    if found is None:
        nothing = Decay(run.name, run.speed, complex("nan+nanj"), (math.nan, math.nan), {}, math.nan, math.nan)
        return (nothing,) * count
    numbers = list(range(count))
    if len(found.mean) > count:  # one of two: that near the start frequency, else the larger one that oscillates
        near = np.abs(found.mean[:, 1] - (0.0 if start_hz is None else float(angular_frequency(start_hz))))
        turns = frequency_hz(1j * found.mean[:, 1]) * found.window.length >= FEWEST_CYCLES
        size = np.where(turns, 1 + found.energies(), 0.0)
        numbers = [int(np.argmax(size) if start_hz is None else np.argmin(near))]
    asked = len(found.mean) == count
    decays = tuple(_decay(run, found, number, last_s, asked=asked, scanned=thorough) for number in numbers)
    if count == 1:
        return decays
    why = _fewer(decays, log_odds_of_each(found))
    return tuple(replace(decay, fewer=why) for decay in decays)


def _fewer(decays: Sequence[Decay], odds: Array) -> str:
    """That the window holds fewer modes than these, whose log ``odds`` are infinite where they are clear; or empty."""
    count, there = len(decays), int(np.isinf(odds).sum())
    least = min(decay.cycles for decay in decays)
    if there < count:
        return (
            f"{there} of {count} modes are there (odds of {math.exp(odds.min()):.2g} : 1 for one more, at least "
            f"{math.exp(CLEAR):g}), and names go by frequency: ask for {there}"
        )
    if least < FEWEST_CYCLES:
        return (
            f"one of {count} modes turns by {least:.2g} cycles (at least {FEWEST_CYCLES:g}), which a drift or a real "
            "mode does as well, and names go by frequency: ask for fewer, or for a longer window"
        )
    return ""


def _decay(run: Run, found: Estimate, number: int, last_s: float, *, asked: bool, scanned: bool) -> Decay:
    sigma, omega = (float(x) for x in found.mean[number])
    w = found.window
    sd = (float(found.sd[number, 0]), float(found.sd[number, 1]))
    beside = tuple(complex(*mode) for place, mode in enumerate(found.mean) if place != number and not asked)
    decay = Decay(
        run.name, run.speed, complex(sigma, omega), sd, found.ratios[number], found.explained,
        float(frequency_hz(1j * omega)) * w.length, *next(iter(found.drifts.items())), None, beside, found,
        drowned=why_drowned(found) if found.explained < POOREST else "",
    )  # fmt: skip
    if not scanned or decay.rejected:
        return decay
    moved, broke = movement(run, found, number, last_s, beside=bool(beside)), broken(run, found, number)
    decay = replace(decay, movement=moved, broken=broke)
    for other in (moved, broke):
        if other is not None and other.refused:
            return decay
    for shifts in (other.shifts for other in (moved, broke) if other is not None):
        wider = [math.hypot(s, shifts[name]) for s, name in zip(decay.sd, PARTS, strict=True)]
        ratios = {name: (value, math.hypot(s, shifts[name])) for name, (value, s) in decay.ratios.items()}
        decay = replace(decay, sd=(wider[0], wider[1]), ratios=ratios)
    return decay
