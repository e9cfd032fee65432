"""Identify frequency and damping of modes from raw free decays, with errors that respect noise, drift and the start.

Every channel is a sum of decaying oscillations, a drift and autoregressive noise (:mod:`.decay_noise`). The kinds of
drift are weighed by their evidence (:mod:`.decay_posterior`), the window is fitted again in parts
(:mod:`.decay_checks`), and repeats say what one decay cannot (:mod:`.scatter`).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from bicycle.eigen import angular_frequency, frequency_hz
from bicycle.identification.decay_checks import (
    PARTS,
    TOO_FAR,
    Break,
    Movement,
    Shift,
    broken,
    movement,
    probability_of_noise,
)
from bicycle.identification.decay_noise import DRIFTS, KINDS
from bicycle.identification.decay_posterior import CLEAR, Estimate, log_odds_of_any, log_odds_of_each, sought
from bicycle.identification.decay_window import FASTEST, SLOWEST, window
from bicycle.identification.recording import Run
from tyre.errors import InputError, unknown

POOREST = 0.8  # R^2 of a decay that is taken as it is
MOST_DOUBT = 0.3  # sd of a part of the eigenvalue over its size
MOST_MODES = 3
FEWEST_CYCLES = 0.25  # of a mode in the window
REASONS = {
    "nothing": "no decaying oscillation was found",
    "fewer": "{there} of {count} modes are there (odds of {odds:.2g} : 1 for one more, at least {least:g}), and names "
    "go by frequency: ask for {there}",
    "slow": "one of {count} modes turns by {cycles:.2g} cycles (at least {least:g}), which a drift or a real mode does "
    "as well, and names go by frequency: ask for fewer, or for a longer window",
    "drowned": "R^2 = {r_squared:g} is below {least:g}, and an oscillation beside drift and noise has odds of {odds} : "
    "1 (at least {clear:g})",
    "disturbed": "R^2 = {r_squared:g} is below {least:g}, and what is left is no noise (p {p:.2g}): another motion, or "
    "its own that something drives, is too large",
    "doubtful": "{why}: an sd of {sd:.2g} 1/s is {share:.0%} of |eigenvalue| (at most {most:.0%})",
    "still": "it turns by {cycles:.2g} cycles in the window (at least {least:g}): a motion that does not oscillate, "
    "such as a capsize, looks like that; give the frequency of an oscillation (start_hz)",
    "early": "{what} moves by {farthest:.3g} sd (at most {most:g}) when the window begins later: start it at "
    "{settled_s:.3g} s, from where it moves no more",
    "broken": "{what} moves by {farthest:.3g} sd (at most {most:g}) when the window ends at {until_s:.4g} s, before "
    "{channel} jumps: end it there",
}
"""Why a run tells too little, or nothing."""


@dataclass(frozen=True)
class Decay:
    """One mode of one run."""

    run: str
    speed: float  # m/s
    eigenvalue: complex = complex("nan+nanj")  # 1/s
    sd: tuple[float, float] = (math.nan, math.nan)  # of both parts, 1/s: a 95 % interval is 1.96 of it to both sides
    ratios: Mapping[str, tuple[complex, float]] = field(default_factory=dict)  # of channels: value, sd of each part
    r_squared: float = math.nan  # share of the squares that modes and drift explain at most, over all channels
    cycles: float = math.nan  # in the window
    drift: str = ""  # the most probable kind, one of :data:`DRIFTS`
    drift_odds: float = 1.0  # its probability
    beside: tuple[complex, ...] = ()  # eigenvalues of what was fitted beside, as the evidence for it is clear
    estimate: Estimate | None = None  # None if no oscillation was found
    noise_p: float = math.nan  # probability that noise leaves what is left; a small one says that sd may be too small
    doubt: tuple[str, Mapping[str, Any]] = ("", {})  # one of :data:`REASONS` by the whole window, and its numbers
    movement: Movement | None = None  # with the start of the window; None if not tried
    broken: Break | None = None  # within the window; None if there is none

    @property
    def rejected(self) -> str:
        """Why the run tells too little, or nothing; empty if it is used."""
        name, numbers = self._reason()
        return REASONS[name].format(**numbers) if name else ""

    def _reason(self) -> tuple[str, Mapping[str, Any]]:
        if self.estimate is None:
            return "nothing", {}
        if self.doubt[0]:
            shown = math.floor(1000 * self.r_squared) / 1000  # never rounded up to what it is below
            return self.doubt[0], {"r_squared": shown, "least": POOREST, **self.doubt[1]}
        size, doubt = abs(self.eigenvalue), max(self.sd)
        if doubt > MOST_DOUBT * size:
            why = f"{self.cycles:.1f} cycles tell too little"
            if self.movement is not None and self.movement.what:
                why = "it moves too far with the start of the window"
            return "doubtful", {"why": why, "sd": doubt, "share": doubt / size, "most": MOST_DOUBT}
        if self.cycles < FEWEST_CYCLES:
            return "still", {"cycles": self.cycles, "least": FEWEST_CYCLES}
        for name, shift in (("early", self.movement), ("broken", self.broken)):
            if shift is not None and shift.refused:
                return name, {**vars(shift), "what": shift.what.replace("_", " "), "most": TOO_FAR}
        return "", {}

    def row(self, mode: str) -> dict[str, Any]:
        """Row of a modal table, for the mode named ``mode``."""
        row: dict[str, Any] = {
            "speed_m_s": self.speed, "mode": mode, "real_1_s": self.eigenvalue.real, "imag_rad_s": self.eigenvalue.imag,
            "real_sd_1_s": self.sd[0], "imag_sd_rad_s": self.sd[1],
        }  # fmt: skip
        for name, (value, sd) in self.ratios.items():
            row |= {f"{name}_re": value.real, f"{name}_im": value.imag, f"{name}_sd": sd}
        return row


def identify(
    run: Run, *, first_s: float = 0.0, last_s: float = math.inf, start_hz: float | None = None,
    drift: str | None = None, thorough: bool = True,
) -> Decay:  # fmt: skip
    """Fit one decaying oscillation to all channels of a run between two times, as :func:`identify_modes`."""
    return identify_modes(run, 1, first_s=first_s, last_s=last_s, start_hz=start_hz, drift=drift, thorough=thorough)[0]


def identify_modes(
    run: Run, count: int, *, first_s: float = 0.0, last_s: float = math.inf, start_hz: float | None = None,
    drift: str | None = None, thorough: bool = True,
) -> tuple[Decay, ...]:  # fmt: skip
    """Fit several decaying oscillations to all channels of a run at once, by frequency."""
    if start_hz is not None and not SLOWEST < angular_frequency(start_hz) < FASTEST:
        low, high = (float(frequency_hz(1j * omega)) for omega in (SLOWEST, FASTEST))
        raise InputError(f"start_hz = {start_hz:g} is outside {low:.2g} .. {high:.2g} Hz")
    if drift is not None and drift not in DRIFTS:
        raise InputError(unknown("drift", drift, DRIFTS))
    if not 1 <= count <= MOST_MODES:
        raise InputError(f"{count} modes in one window; give 1 to {MOST_MODES}")
    drifts = tuple(kind for kind in KINDS if drift in (None, kind.partition("/")[0]))
    further = thorough and count == 1
    found = sought(lambda block: window(run, first_s, last_s, block=block), drifts, start_hz, count, further=further)
    if found is None:
        return (Decay(run.name, run.speed),) * count
    numbers = range(count)
    if len(found.mean) > count:  # one of two: that near the start frequency, else the larger one that oscillates
        near = np.abs(found.mean[:, 1] - (0.0 if start_hz is None else float(angular_frequency(start_hz))))
        turns = frequency_hz(1j * found.mean[:, 1]) * found.window.length >= FEWEST_CYCLES
        size = np.where(turns, 1 + found.energies(), 0.0)
        number = int(np.argmax(size) if start_hz is None else np.argmin(near))
        numbers = range(number, number + 1)
    decays = tuple(_decay(run, found, number, asked=len(found.mean) == count) for number in numbers)
    if thorough:
        decays = tuple(_checked(run, decay, number, last_s) for decay, number in zip(decays, numbers, strict=True))
    if count == 1:
        return decays
    doubt = _fewer(found, min(decay.cycles for decay in decays))
    return tuple(replace(decay, doubt=doubt if doubt[0] else decay.doubt) for decay in decays)


def _decay(run: Run, found: Estimate, number: int, *, asked: bool) -> Decay:
    sigma, omega = (float(x) for x in found.mean[number])
    beside = tuple(complex(*mode) for place, mode in enumerate(found.mean) if place != number and not asked)
    drift, odds = next(iter(found.drifts.items()))
    p = probability_of_noise(found)
    doubt: tuple[str, dict[str, Any]] = ("", {})
    if found.explained < POOREST:
        any_odds = log_odds_of_any(found)
        if any_odds < CLEAR:
            words = f"{math.exp(any_odds):.2g}" if any_odds > -200 else "less than 1e-86"
            doubt = ("drowned", {"odds": words, "clear": math.exp(CLEAR)})
        elif p <= 0.01:
            doubt = ("disturbed", {"p": p})
    sd, cycles = (float(found.sd[number, 0]), float(found.sd[number, 1])), float(frequency_hz(1j * omega))
    return Decay(
        run.name, run.speed, complex(sigma, omega), sd, found.ratios[number], found.explained,
        cycles * found.window.length, drift, odds, beside, found, p, doubt,
    )  # fmt: skip


def _fewer(found: Estimate, least: float) -> tuple[str, dict[str, Any]]:
    """Doubt if the window holds fewer modes than were fitted, or one that hardly turns: ``least`` cycles."""
    odds, count = log_odds_of_each(found), len(found.mean)
    there = int(np.isinf(odds).sum())
    if there < count:
        return "fewer", {"there": there, "count": count, "odds": math.exp(odds.min()), "least": math.exp(CLEAR)}
    return ("slow", {"count": count, "cycles": least, "least": FEWEST_CYCLES}) if least < FEWEST_CYCLES else ("", {})


def _checked(run: Run, decay: Decay, number: int, last_s: float) -> Decay:
    """Refuse a decay that moves too far with its window, or widen what it says by how far it moves."""
    if decay.estimate is not None and decay.doubt[0] == "disturbed":
        return replace(decay, broken=broken(run, decay.estimate, number))
    if decay.rejected or decay.estimate is None:
        return decay
    moved = movement(run, decay.estimate, number, last_s, beside=bool(decay.beside))
    decay = replace(decay, movement=moved, broken=broken(run, decay.estimate, number))
    moves: list[Shift] = [move for move in (decay.movement, decay.broken) if move is not None]
    if any(move.refused for move in moves):
        return decay
    for shifts in (move.shifts for move in moves):
        real, imaginary = (math.hypot(s, shifts[name]) for s, name in zip(decay.sd, PARTS, strict=True))
        ratios = {name: (value, math.hypot(s, shifts[name])) for name, (value, s) in decay.ratios.items()}
        decay = replace(decay, sd=(real, imaginary), ratios=ratios)
    return decay
