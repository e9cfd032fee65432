"""Identify frequency and damping of modes from raw free decays, with errors that respect noise, drift and the start.

Every channel is a sum of decaying oscillations, a drift and autoregressive noise (:mod:`.decay_noise`). The kinds of
drift are weighed by their evidence (:mod:`.decay_posterior`), and repeats say what one decay cannot (:mod:`.scatter`).

The window is fitted again in parts. A later window is a part of the earlier one, so the difference of the two estimates
has the difference of their variances (Hausman 1978, Econometrica 46, 1251-1271). The noise of each window is estimated
by itself, so a later window may state the smaller sd; its variance is taken to be larger at least by the share of the
oscillation's energy that it lacks.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy
from scipy.special import chdtrc, ndtr, ndtri

from bicycle.identification import decay_posterior as posterior
from bicycle.identification.decay_noise import DRIFTS, FASTEST, KINDS, SLOWEST, window
from bicycle.identification.decay_posterior import Estimate
from bicycle.identification.recording import Run
from bicycle.model.eigen import angular_frequency, frequency_hz
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, refuse_unknown

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
    """Movement of a mode when its window begins later: a disturbance that still acts, or a fast mode."""

    settled_s: float | None  # first start from which nothing moves, s after the first sample of the run


@dataclass(frozen=True)
class Break(Shift):
    """The largest sample that neither modes nor noise explain; how far a mode moves if the window ends before."""

    time_s: float  # s after the first sample of the run
    until_s: float  # end of a window that has nothing of it, s after the first sample of the run
    channel: str  # column of that sample
    size: float  # sd of what is unforeseen


def movement(run: Run, whole: Estimate, number: int, last_s: float, *, beside: bool) -> Movement | None:
    """Movement of mode ``number`` of a fit when its window begins later, at three starts; None if it gets too short."""
    fits = [(whole, number)]
    cycle = 2 * math.pi / float(whole.mean[number, 1])
    for step in dict.fromkeys(max(round(REACH * cycle * k / 3 / run.step), 1) * run.step for k in (1, 2, 3)):
        later = _refit_part(run, fits[0], whole.window.start + step, last_s, beside=beside)
        if later is None:
            break
        fits.append(later)
    if len(fits) == 1:
        return None
    starts = [fit.window.start for fit, _ in fits]
    table = [numbers_of(*fit) for fit in fits]
    energy = whole.energy_from(starts)
    shifts, farthest, name = largest_shifts(table, energy, 0)
    settled = next((place for place in range(1, len(fits) - 1) if largest_shifts(table, energy, place)[1] == 0), None)
    is_refused = settled is not None and largest_shifts(table, energy, 0, CERTAIN)[1] > TOO_FAR
    return Movement(shifts, farthest, name, is_refused, None if settled is None else starts[settled])


def find_break(run: Run, fit: Estimate, number: int) -> Break | None:
    """Find a second impulse, a step of a sensor or a spike: a sample that the noise makes in one of 10,000 windows."""
    w = fit.window
    large = np.abs(unforeseen(fit))
    large[w.time < REACH * 2 * math.pi / float(fit.mean[number, 1])] = 0.0  # there the start of the window is scanned
    place, channel = np.unravel_index(int(large.argmax()), large.shape)
    size = float(large[place, channel])
    if -math.expm1(large.size * math.log1p(-2 * ndtr(-size))) > 1e-4:
        return None
    end, at = (float(w.start + w.time[k]) for k in (place - 1, place))
    earlier = _refit_part(run, (fit, number), w.start, end, beside=False)
    whole = numbers_of(fit, number)
    shift = dict.fromkeys(whole, 0.0), 0.0, "", False  # too little lies before it to be fitted
    if earlier is not None:
        table = [whole, numbers_of(*earlier)]
        energy, after = fit.energy_from([w.start, at])
        is_refused = largest_shifts(table, [energy, energy - after], 0, CERTAIN)[1] > TOO_FAR
        shift = (*largest_shifts(table, [energy, energy - after], 0), is_refused)
    return Break(*shift, at, end, w.channels[channel], size)


def _refit_part(
    run: Run, whole: tuple[Estimate, int], first_s: float, last_s: float, *, beside: bool
) -> tuple[Estimate, int] | None:
    """Fit the part of a window from ``first_s`` to ``last_s``; its fit and the place of the mode in it, or None."""
    estimate, number = whole
    likely, modes = [drift for drift, weight in estimate.kinds.items() if weight > 0.05], estimate.best.best
    try:
        w = window(run, first_s, last_s, block=estimate.window.block)
    except InputError:
        return None
    part = posterior.estimate(w, likely, [modes])
    if beside:
        single = posterior.estimate(w, likely, [modes[number : number + 1]])
        if single is not None and (part is None or not posterior.clearer(part.best, single.best)):
            return single, 0
    if part is None:
        return None
    distance = np.hypot(*(modes[:, None, :] - part.mean[None, :, :]).transpose(2, 0, 1))
    return part, int(scipy.optimize.linear_sum_assignment(distance)[1][number])  # near modes may change places


def numbers_of(fit: Estimate, number: int) -> Numbers:
    """Parts of the eigenvalue and ratios of a mode, each with its sd."""
    parts = {name: (fit.mean[number, k : k + 1], float(fit.sd[number, k])) for k, name in enumerate(PARTS)}
    ratios = fit.ratios[number].items()
    return parts | {name: (np.array([value.real, value.imag]), sd) for name, (value, sd) in ratios}


def largest_shifts(
    table: Sequence[Numbers], energy: Sequence[float], place: int, chances: float = 2.5
) -> tuple[dict[str, float], float, str]:
    """Compare the numbers of the window at ``place`` with those of its parts that follow, as :class:`Shift` says."""
    shifts, farthest, farthest_name = dict.fromkeys(table[place], 0.0), 0.0, ""
    for later, remaining in zip(table[place + 1 :], energy[place + 1 :], strict=True):
        more = max(energy[place] / max(remaining, 1e-300) - 1, 0.0)  # of the variance; less is rounding
        for name, (value, sd) in table[place].items():
            shift = float(np.abs(later[name][0] - value).max())
            if shift > sd and shift > chances * math.sqrt(max(later[name][1] ** 2 - sd**2, more * sd**2)):
                shifts[name] = max(shifts[name], shift)
                if shift / sd > farthest:
                    farthest, farthest_name = shift / sd, name
    return shifts, farthest, farthest_name


def unforeseen(fit: Estimate, ordinary: float = 0.95) -> Array:
    """Residual of each sample given the one before it (n, c), over its sd; white and normal in a sound window."""
    innovations = fit.window.signals - fit.curves()[0]
    innovations = np.vstack([innovations[:1], fit.whiten(innovations)])
    usual = np.sort(np.abs(innovations), axis=0)[: math.ceil(ordinary * len(innovations))]
    edge = -ndtri((1 - ordinary) / 2)
    density = math.exp(-(edge**2) / 2) / math.sqrt(2 * math.pi)
    part = math.sqrt(1 - 2 * edge * density / ordinary)  # rms of a normal distribution without its tails
    median = np.median(np.abs(innovations), axis=0) / ndtri(0.75)
    return np.asarray(innovations / np.maximum(median, np.sqrt((usual**2).mean(0)) / part))


def probability_of_noise(fit: Estimate) -> float:
    """Probability that noise leaves at least as much correlation between neighbours as the most probable modes do.

    Portmanteau test of Ljung & Box (1978, Biometrika 65, 297-303), all channels together.
    """
    innovations = fit.whiten(fit.residual())
    n, channels = innovations.shape
    lags = np.arange(1, max(min(n // 5, 20), 3) + 1)
    innovations = innovations - innovations.mean(0)
    correlations = np.array([(innovations[lag:] * innovations[:-lag]).sum(0) for lag in lags]) / (innovations**2).sum(0)
    return float(chdtrc(lags.size * channels, n * (n + 2) * (correlations**2 / (n - lags)[:, None]).sum()))


POOREST = 0.8  # R^2 of a decay that is taken as it is
MOST_DOUBT = 0.3  # sd of a part of the eigenvalue over its size
MOST_MODES = 3
FEWEST_CYCLES = 0.25  # of a mode in the window
REASONS = {  # why a run tells too little, or nothing
    "nothing": "no decaying oscillation was found",
    "fewer": "{there} of {count} modes are there (odds of {odds:.2g} : 1 for one more, at least {least:g}), and names "
    "go by frequency: ask for {there}",
    "slow": "one of {count} modes turns by {cycles:.2g} cycles (at least {least:g}), which a drift or a real mode does "
    "as well, and names go by frequency: ask for fewer, or for a longer window",
    "drowned": "R^2 = {r_squared:g} is below {least:g}, and an oscillation on top of drift and noise has odds of "
    "{odds} : "
    "1 (at least {clear:g})",
    "disturbed": "R^2 = {r_squared:g} is below {least:g}, and the residuals are not noise (p {p:.2g}): another or a "
    "driven motion is too large",
    "doubtful": "{why}: an sd of {sd:.2g} 1/s is {share:.0%} of |eigenvalue| (at most {most:.0%})",
    "still": "it turns by {cycles:.2g} cycles in the window (at least {least:g}): a motion that does not oscillate, "
    "such as a capsize, looks like that; give the frequency of an oscillation (start_hz)",
    "early": "{what} moves by {farthest:.3g} sd (at most {most:g}) when the window begins later: start it at "
    "{settled_s:.3g} s, from where it moves no more",
    "broken": "{what} moves by {farthest:.3g} sd (at most {most:g}) when the window ends at {until_s:.4g} s, before "
    "{channel} jumps: end it there",
}


@dataclass(frozen=True)
class Decay:
    """One mode of one run."""

    run: str  # name of the recording
    speed: float  # m/s
    eigenvalue: complex = complex("nan+nanj")  # 1/s
    sd: tuple[float, float] = (math.nan, math.nan)  # of both parts, 1/s: a 95 % interval is 1.96 of it to both sides
    ratios: Mapping[str, tuple[complex, float]] = field(default_factory=dict)  # of channels: value, sd of each part
    r_squared: float = math.nan  # share of the squares that modes and drift explain at most, over all channels
    cycles: float = math.nan  # in the window
    drift: str = ""  # the most probable kind, one of :data:`DRIFTS`
    beside: tuple[complex, ...] = ()  # eigenvalues of what was fitted beside, as the evidence for it is clear
    estimate: Estimate | None = None  # None if no oscillation was found
    noise_p: float = math.nan  # probability that noise leaves what is left; a small one says that sd may be too small
    doubt: tuple[str, Mapping[str, Any]] = ("", {})  # one of :data:`REASONS` by the whole window, and its numbers
    movement: Movement | None = None  # with the start of the window; None if not tried
    broken: Break | None = None  # within the window; None if there is none

    @property
    def rejected(self) -> str:
        """Why the run is not used; empty if it is."""
        name, numbers = self._reason()
        return REASONS[name].format(**numbers) if name else ""

    def _reason(self) -> tuple[str, Mapping[str, Any]]:
        if self.estimate is None:
            return "nothing", {}
        if self.doubt[0]:
            rounded = math.floor(1000 * self.r_squared) / 1000  # never rounded up to what it is below
            return self.doubt[0], {"r_squared": rounded, "least": POOREST, **self.doubt[1]}
        size = abs(self.eigenvalue)
        doubt = max(self.sd)
        if doubt > MOST_DOUBT * size:
            why = f"{self.cycles:.1f} cycles are too few"
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
            "speed_m_s": self.speed,
            "mode": mode,
            "real_1_s": self.eigenvalue.real,
            "imag_rad_s": self.eigenvalue.imag,
            "real_sd_1_s": self.sd[0],
            "imag_sd_rad_s": self.sd[1],
        }
        for name, (value, sd) in self.ratios.items():
            row |= {f"{name}_re": value.real, f"{name}_im": value.imag, f"{name}_sd": sd}
        return row


def identify(run: Run, **settings: Any) -> Decay:
    """Fit one decaying oscillation to all channels of a run between two times, as :func:`identify_modes`."""
    return identify_modes(run, 1, **settings)[0]


def identify_modes(
    run: Run,
    count: int,
    *,
    first_s: float = 0.0,
    last_s: float = math.inf,
    start_hz: float | None = None,
    drift: str | None = None,
    thorough: bool = True,
) -> tuple[Decay, ...]:
    """Fit several decaying oscillations to all channels of a run at once, by frequency."""
    if start_hz is not None and not SLOWEST < angular_frequency(start_hz) < FASTEST:
        low, high = (float(frequency_hz(1j * omega)) for omega in (SLOWEST, FASTEST))
        raise InputError(f"start_hz = {start_hz:g} is outside {low:.2g} .. {high:.2g} Hz")
    refuse_unknown("drift", [] if drift is None else [drift], DRIFTS)
    if not 1 <= count <= MOST_MODES:
        raise InputError(f"{count} modes in one window; give 1 to {MOST_MODES}")
    drifts = tuple(kind for kind in KINDS if drift in (None, kind.partition("/")[0]))
    further = thorough and count == 1
    fit = posterior.seek_modes(
        lambda block: window(run, first_s, last_s, block=block), drifts, start_hz, count, further=further
    )
    if fit is None:
        return (Decay(run.name, run.speed),) * count
    numbers = range(count)
    if len(fit.mean) > count:  # one of two: that near the start frequency, else the larger one that oscillates
        distance = np.abs(fit.mean[:, 1] - (0.0 if start_hz is None else float(angular_frequency(start_hz))))
        turns = frequency_hz(1j * fit.mean[:, 1]) * fit.window.length >= FEWEST_CYCLES
        number = int(np.argmax(np.where(turns, 1 + fit.energies(), 0.0)) if start_hz is None else np.argmin(distance))
        numbers = range(number, number + 1)
    decays = tuple(_decay(run, fit, number, asked=len(fit.mean) == count) for number in numbers)
    if thorough:
        decays = tuple(_weigh_shifts(run, decay, number, last_s) for decay, number in zip(decays, numbers, strict=True))
    if count == 1:
        return decays
    doubt = _doubt_count(fit, min(decay.cycles for decay in decays))
    return tuple(replace(decay, doubt=doubt if doubt[0] else decay.doubt) for decay in decays)


def _decay(run: Run, fit: Estimate, number: int, *, asked: bool) -> Decay:
    sigma, omega = (float(x) for x in fit.mean[number])
    other_modes = tuple(complex(*mode) for place, mode in enumerate(fit.mean) if place != number and not asked)
    p = probability_of_noise(fit)
    doubt: tuple[str, dict[str, Any]] = ("", {})
    if fit.explained < POOREST:
        any_odds = posterior.log_odds_of_any(fit)
        if any_odds < posterior.CLEAR:
            words = f"{math.exp(any_odds):.2g}" if any_odds > -200 else "less than 1e-86"
            doubt = ("drowned", {"odds": words, "clear": math.exp(posterior.CLEAR)})
        elif p <= 0.01:
            doubt = ("disturbed", {"p": p})
    sd = (float(fit.sd[number, 0]), float(fit.sd[number, 1]))
    cycles = float(frequency_hz(1j * omega))
    return Decay(
        run.name,
        run.speed,
        complex(sigma, omega),
        sd,
        fit.ratios[number],
        fit.explained,
        cycles * fit.window.length,
        next(iter(fit.drifts)),
        other_modes,
        fit,
        p,
        doubt,
    )


def _doubt_count(fit: Estimate, least: float) -> tuple[str, dict[str, Any]]:
    """Doubt if the window holds fewer modes than were fitted, or one that hardly turns: ``least`` cycles."""
    odds = posterior.log_odds_of_each(fit)
    count = len(fit.mean)
    supported = int(np.isinf(odds).sum())
    if supported < count:
        more, clear = math.exp(odds.min()), math.exp(posterior.CLEAR)
        return "fewer", {"there": supported, "count": count, "odds": more, "least": clear}
    return ("slow", {"count": count, "cycles": least, "least": FEWEST_CYCLES}) if least < FEWEST_CYCLES else ("", {})


def _weigh_shifts(run: Run, decay: Decay, number: int, last_s: float) -> Decay:
    """Refuse a decay that moves too far with its window, or widen what it says by how far it moves."""
    if decay.estimate is not None and decay.doubt[0] == "disturbed":
        return replace(decay, broken=find_break(run, decay.estimate, number))
    if decay.rejected or decay.estimate is None:
        return decay
    shift = movement(run, decay.estimate, number, last_s, beside=bool(decay.beside))
    decay = replace(decay, movement=shift, broken=find_break(run, decay.estimate, number))
    moves: list[Shift] = [move for move in (decay.movement, decay.broken) if move is not None]
    if any(move.refused for move in moves):
        return decay
    for shifts in (move.shifts for move in moves):
        real, imaginary = (math.hypot(s, shifts[name]) for s, name in zip(decay.sd, PARTS, strict=True))
        ratios = {name: (value, math.hypot(s, shifts[name])) for name, (value, s) in decay.ratios.items()}
        decay = replace(decay, sd=(real, imaginary), ratios=ratios)
    return decay
