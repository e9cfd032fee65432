"""Find the stretches in which a motion of the bicycle dies away after a kick."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from bicycle.identification.free_decay import Decay, identify
from bicycle.identification.recording import Run
from tyre.arrays import Array
from tyre.errors import InputError
from tyre.quality import noise_level

STARTS, LENGTHS = (0.0, 0.1, 0.3), (12.0, 6.0, 4.0, 2.5)  # s after the peak, s
ORDER = ("roll_rate_rad_s", "yaw_rate_rad_s", "steer_rate_rad_s", "lean_rad", "steer_rad")
"""In which kicks are sought."""
MOST_SAMPLES = 100_000
"""Of a run that is fitted as a whole."""


def decays(run: Run) -> list[tuple[float, float, Decay]]:
    """Windows of a ``run`` in which one oscillation dies away: start and end, s after its first sample, and its fit."""
    name = _foremost(run)
    x = np.abs(run.channels[name] - np.median(run.channels[name]))
    distance = max(int(1.5 / run.step), 1)  # s
    height = max(0.35 * float(x.max()), 5 * noise_level(run.channels[name]))
    peaks = find_peaks(np.concatenate([[0.0], x, [0.0]]), height=height, distance=distance)[0] - 1
    peaks = _after_rest(x, peaks, max(int(run.time.size and 1.0 / run.step), 1))
    peaks = np.sort(peaks[np.argsort(-x[peaks])][:12])
    found: list[tuple[float, float, Decay]] = []
    free = 0.0
    for number, peak in enumerate(peaks):
        begin = float(run.time[peak] - run.time[0])
        ends = run.time[peaks[number + 1]] - 0.2 if number + 1 < len(peaks) else run.time[-1]
        best = _best(run, begin, float(ends - run.time[0])) if begin >= free else None
        if best is not None:
            found.append(best)
            free = best[1]
    return found


def _after_rest(x: Array, peaks: NDArray[np.intp], second: int) -> NDArray[np.intp]:
    """Keep the ``peaks`` of ``x`` that do not belong to the motion after another one: kicks."""
    kicks: list[int] = []
    for peak in peaks:
        if kicks:
            between = x[kicks[-1] : peak]
            quiet = min(float(between[first : first + second].max()) for first in range(0, between.size, second))
            if quiet > 0.5 * x[peak] and x[peak] < 1.5 * x[kicks[-1]]:
                continue
        kicks.append(int(peak))
    return np.array(kicks, int)


def _foremost(run: Run) -> str:
    return next((name for name in ORDER if name in run.channels), next(iter(run.channels)))


def telling(run: Run) -> tuple[str, ...]:
    """Channels of a ``run`` that show the decays which its foremost channel shows by itself; none without decays."""
    first = _foremost(run)
    kicks = decays(replace(run, channels={first: run.channels[first]}))
    if not kicks:
        return ()
    begin, end, _ = max(kicks, key=lambda kick: kick[2].r_squared)
    return tuple(name for name in run.channels if name == first or _shows(run, name, begin, end))


def _shows(run: Run, name: str, begin: float, end: float) -> bool:
    try:
        found = identify(
            replace(run, channels={name: run.channels[name]}),
            first_s=begin,
            last_s=end,
            drift="parabola",
            thorough=False,
        )
    except (InputError, ArithmeticError, ValueError):
        return False
    return not found.rejected


def _best(run: Run, begin: float, end: float) -> tuple[float, float, Decay] | None:
    """The window after a kick that tells most of one decaying oscillation."""
    trials: list[tuple[float, float, Decay]] = []
    for start in STARTS:
        for length in dict.fromkeys(min(length, end - begin - start) for length in LENGTHS):
            first = round(begin + start, 3)
            last = min(round(first + length, 3), math.floor(1e3 * (run.time[-1] - run.time[0])) / 1e3)
            try:
                decay = identify(run, first_s=first, last_s=last, drift="parabola", thorough=False)
            except (InputError, ArithmeticError, ValueError):  # too short, or numbers that no fit goes through
                continue
            if not decay.rejected and decay.eigenvalue.real < 0:
                trials.append((first, last, decay))
    trials.sort(key=lambda trial: max(trial[2].sd) / abs(trial[2].eigenvalue))
    for first, last, _ in trials[:3]:  # windows of a kick whose start is checked as `modal` does
        decay = identify(run, first_s=first, last_s=last)
        if not decay.rejected and decay.eigenvalue.real < 0:
            return first, last, decay
    return None
