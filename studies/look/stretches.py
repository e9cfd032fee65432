"""Find stretches in which something happens: the slip angle moves, or a motion dies away after a kick."""

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
from tyre.recording import RigRun

PARTS = 400  # of a recording, in which movement is told from rest
LOAD_CHANGE = 0.08  # of the largest load within three parts: the wheel is being set down, or the load changed
STARTS, LENGTHS = (0.0, 0.1, 0.3), (12.0, 6.0, 4.0, 2.5)  # s after the peak, s
ORDER = ("roll_rate_rad_s", "yaw_rate_rad_s", "steer_rate_rad_s", "lean_rad", "steer_rad")
"""In which kicks are sought."""
MOST_SAMPLES = 100_000
"""Of a run that is fitted as a whole."""


def moving(run: RigRun) -> list[tuple[int, int]]:
    """Find where the slip angle moves under a steady load: first sample and the one after the last, from 0."""
    count = run.time.size
    size = max(count // PARTS, 5)
    edges = np.arange(0, count, size)
    if edges.size < 4:
        return []
    slip, load = _means(run.slip_angle, edges), _means(run.vertical_load, edges)
    span = float(np.ptp(slip))
    if span == 0:
        return []
    noise = noise_level(run.slip_angle[np.isfinite(run.slip_angle)])
    change = np.abs(_ahead(slip)) / 2
    active = change > max(4 * noise / np.sqrt(size), 2e-3 * span)
    heavy = float(np.quantile(load, 0.9))
    active &= (np.abs(_ahead(load)) < LOAD_CHANGE * heavy) & (load > 0.3 * heavy)
    found: list[list[int]] = []
    for place in np.flatnonzero(active):
        steady = found and abs(load[place] - load[found[-1][1] - 1]) < LOAD_CHANGE * heavy
        if found and place - found[-1][1] <= 5 and steady:  # parts of rest within one event: a sweep turns round
            found[-1][1] = int(place) + 1
        else:
            found.append([int(place), int(place) + 1])
    return [
        (int(edges[first]), min(int(edges[last - 1]) + size, count))
        for first, last in found
        if np.ptp(slip[max(first - 1, 0) : last + 1]) > 0.05 * span
    ]


def with_rest(stretches: list[tuple[int, int]], place: int, run: RigRun) -> tuple[int, int]:
    """The stretch number ``place`` of ``stretches`` with the rest before and after it in a ``run``: a step of slip."""
    first, last = stretches[place]
    before = stretches[place - 1][1] if place else 0
    after = stretches[place + 1][0] if place + 1 < len(stretches) else run.time.size
    load = float(np.nanmedian(run.vertical_load[first:last]))
    near = np.abs(run.vertical_load - load) < 2 * LOAD_CHANGE * abs(load)
    lifted = np.flatnonzero(~near & np.isfinite(run.vertical_load))
    before = max([before, *(lifted[lifted < first][-1:] + 1).tolist()])
    after = min([after, *lifted[lifted >= last][:1].tolist()])
    return int(before), int(after)


def _means(channel: Array, edges: NDArray[np.intp]) -> Array:
    """Means between ``edges``, those without a sample filled from the side."""
    there = np.isfinite(channel)
    total = np.add.reduceat(np.where(there, channel, 0.0), edges)
    number = np.add.reduceat(there.astype(float), edges)
    known = number > 0
    if not known.any():
        return np.zeros(edges.size)
    return np.interp(np.arange(edges.size), np.flatnonzero(known), total[known] / number[known])


def _ahead(means: Array) -> Array:
    """Change from the part before to the part after, shape as given."""
    padded = np.pad(means, 1, mode="edge")
    return np.asarray(padded[2:] - padded[:-2])


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
