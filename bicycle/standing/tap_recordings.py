"""Recordings of taps: frequency, damping ratio and signed ratios of the vibration that a tap leaves.

The fit of free decays (:mod:`bicycle.identification.free_decay`) reads oscillations up to 200 rad/s; a front frame may
vibrate faster. So its clock is stretched tenfold, which divides all eigenvalues by ten and changes no ratio.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from bicycle.identification.free_decay import Decay, identify, identify_modes
from bicycle.identification.recording import Run
from bicycle.identification.scatter import repeats
from bicycle.standing.readings import DampingChange, Place, Ratio, Tap, mean_change
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError
from tyre.ground.text_table import read_cells, read_columns

STRETCH = 10.0
SENSOR = re.compile(r"(?P<place>hub|rim|stem|frame)\w*_lateral_m_s2")
"""Column of a sensor: its place, perhaps further words, and the unit."""
NOISE = 0.01  # probability of what two vibrations leave, below which a third is tried
LEAST = 20  # samples after a tap
EARLY_CYCLES = 2.0  # shortest beginning of a vibration whose damping is compared with that of the rest
TRIES = 4  # starts of the window, each later than the one before


@dataclass(frozen=True)
class TapRecording:
    """One tap as it was recorded."""

    name: str  # of the file
    time: Array  # (n,), s
    channels: Mapping[str, Array]  # by column, (n,), m/s^2
    added_mass: float = 0.0  # kg
    added: Place = field(default_factory=lambda: Place(0.0))  # of the added mass


def read_tap(path: Path) -> tuple[Array, dict[str, Array]]:
    """Read time (n,), s, and channels (n,), m/s^2, of a recording: ``time_s`` and ``hub_lateral_m_s2`` and others.

    Raises
    ------
    InputError
        An unknown column, one sensor that is not at the hub, fewer samples than a fit needs, an uneven clock.
    """
    header = read_cells(path, kind="recording of a tap", example="time_s, hub_lateral_m_s2").header
    sensors = [name for name in header if SENSOR.fullmatch(name)]
    columns = read_columns(path, numbers=("time_s", *sensors), needed=("time_s", "hub_lateral_m_s2"))
    time = columns.numbers["time_s"]
    steps = np.diff(time)
    if len(time) < 2 * LEAST:
        raise InputError(f"{path}: {len(time)} samples are too few for a vibration; record 1 s at 200 Hz or more")
    usual = float(np.median(steps))
    if not usual > 0 or np.abs(steps - usual).max() > 0.2 * usual:
        worst = int(np.abs(steps - usual).argmax())
        raise InputError(
            f"{path}, line {columns.lines[worst + 1]}: time_s steps by {steps[worst]:g} s where {usual:g} s is usual; "
            "resample to even steps"
        )
    return time, {name: columns.numbers[name] for name in sorted(sensors, key=lambda name: not name.startswith("hub"))}


def identify_taps(
    recordings: Sequence[TapRecording], places: Mapping[str, Place], *, seated: bool = False
) -> tuple[Tap, ...]:
    """Find the slowest vibration of each recording; taps alike widen their sd by their scatter.

    Under a seated rider the frame and the rear tyre vibrate as well: two or three vibrations are read where the
    recording shows them, and the ratios keep their imaginary parts, in which the damping of the rider shows.

    Parameters
    ----------
    recordings : sequence of TapRecording
    places : mapping
        Column of a sensor -> its place.
    seated : bool
        A rider sits on the saddle.

    Raises
    ------
    InputError
        A recording without a vibration that can be read.
    """
    if seated:
        taps = _taps_under_rider(recordings, places)
    else:
        taps = [_tap(recording, identify_tap(recording), places) for recording in recordings]
    groups: dict[tuple[object, ...], list[int]] = {}
    for k, tap in enumerate(taps):
        groups.setdefault(tap.arrangement, []).append(k)
    for members in groups.values():
        for k, tap in zip(members, _widen([taps[k] for k in members]), strict=True):
            taps[k] = tap
    return tuple(taps)


def identify_tap(recording: TapRecording) -> Decay:
    """Fit the decay after the largest sample; the clock is stretched by :data:`STRETCH`."""
    run, first = _run_after_peak(recording)
    last = math.inf
    for _ in range(TRIES):
        decay = identify(run, first_s=first, last_s=last)
        movement, jump = decay.movement, decay.broken
        if decay.rejected and movement is not None and movement.refused and movement.settled_s is not None:
            first = movement.settled_s
        elif decay.rejected and jump is not None and jump.refused:
            last = jump.until_s
        else:
            break
    if decay.rejected:
        raise InputError(f"{recording.name}: {decay.rejected}; tap again, or leave the recording out")
    return decay


def _run_after_peak(recording: TapRecording) -> tuple[Run, float]:
    """The recording on its stretched clock, and the time (s) from which on it decays."""
    peak = max(int(np.abs(x - np.median(x)).argmax()) for x in recording.channels.values())
    run = _stretched(recording)
    return run, float(run.time[min(peak + 2, len(run.time) - 1)])


def _stretched(recording: TapRecording) -> Run:
    """The recording with its clock stretched by :data:`STRETCH`, from zero on."""
    time = STRETCH * (recording.time - recording.time[0])
    return Run(recording.name, 0.0, time, recording.channels, {})


def _taps_under_rider(recordings: Sequence[TapRecording], places: Mapping[str, Place]) -> list[Tap]:
    """All vibrations of each recording, numbered as in the one that shows most."""
    found = [
        [_tap(recording, decay, places, number, phased=True) for number, decay in enumerate(decays, 1)]
        for recording, decays in zip(recordings, map(_identify_several, recordings), strict=True)
    ]
    most = max(found, key=len)
    taps: list[Tap] = []
    for group in found:
        for tap in group:
            nearest = min(most, key=lambda other, tap=tap: _distance(other, tap))  # type: ignore[misc]
            taps.append(replace(tap, vibration=nearest.vibration))
    return taps


def _identify_several(recording: TapRecording) -> Sequence[Decay]:
    """Vibrations of front, frame under the rider and rear tyre: two if they leave noise, else three or one."""
    run, first = _run_after_peak(recording)
    two = identify_modes(run, 2, first_s=first)
    usable = not any(decay.rejected for decay in two)
    if usable and two[0].noise_p > NOISE:
        return two
    three = identify_modes(run, 3, first_s=first)
    if not any(decay.rejected for decay in three):
        return three
    return two if usable else (identify_tap(recording),)


def _distance(tap: Tap, other: Tap) -> float:
    """Distance of the logarithms of two eigenvalues."""
    return math.hypot(math.log(tap.frequency_hz / other.frequency_hz), tap.angle - other.angle)


def _tap(
    recording: TapRecording, decay: Decay, places: Mapping[str, Place], vibration: int = 1, *, phased: bool = False
) -> Tap:
    """Turn a decay of the stretched clock into frequency (Hz), damping ratio and ratios."""
    frequency, damping = _numbers(decay)
    first = next(iter(recording.channels))
    ratios = []
    for name in list(recording.channels)[1:]:
        ratio, sd = decay.ratios[f"{name}_over_{first}"]
        ratios.append(Ratio(places[name], places[first], ratio.real, sd, ratio.imag if phased else math.nan))
    return Tap(
        recording.name,
        *frequency,
        *damping,
        tuple(ratios),
        recording.added_mass,
        recording.added,
        vibration,
        None if phased else _damping_change(recording, decay),  # two vibrations together never decay exponentially
    )


def _numbers(decay: Decay) -> tuple[tuple[float, float], tuple[float, float]]:
    """Frequency (Hz) and damping ratio of a decay of the stretched clock, each with its sd."""
    root: Complex = np.asarray(decay.eigenvalue * STRETCH)
    real_sd, imaginary_sd = (STRETCH * sd for sd in decay.sd)
    size = abs(complex(root))
    cosine, sine = float(root.real) / size, float(root.imag) / size
    size_sd = math.hypot(cosine * real_sd, sine * imaginary_sd)
    damping_sd = abs(sine) * math.hypot(sine * real_sd, cosine * imaginary_sd) / size
    return (size / (2 * math.pi), size_sd / (2 * math.pi)), (-cosine, damping_sd)


def _damping_change(recording: TapRecording, decay: Decay) -> DampingChange | None:
    """Damping ratios before and after the vibration has halved; None where one of them cannot be read."""
    if decay.estimate is None or decay.eigenvalue.real >= 0:
        return None
    run, begin = _stretched(recording), float(decay.estimate.window.start)
    halved = math.log(2) / abs(decay.eigenvalue.real)
    middle = begin + max(halved, EARLY_CYCLES * 2 * math.pi / abs(decay.eigenvalue))
    try:
        early, late = identify(run, first_s=begin, last_s=middle), identify(run, first_s=middle)
    except InputError:  # too few samples of one of them, or a channel that shows nothing then
        return None
    if early.rejected or late.rejected:
        return None
    (_, (early_ratio, early_sd)), (_, (late_ratio, late_sd)) = _numbers(early), _numbers(late)
    return DampingChange(early_ratio, late_ratio, math.hypot(early_sd, late_sd))


def _widen(taps: Sequence[Tap]) -> list[Tap]:
    """Widen the sd of taps that are alike where they scatter more than their fits say.

    A decay that is not exponential has no single damping ratio: its sd spans that of the beginning and of the rest.
    """

    def widened(values: list[float], sds: list[float]) -> list[float]:
        return [float(sd) for sd in repeats([1.0] * len(values), values, sds).sd]

    frequency = widened([tap.frequency_hz for tap in taps], [tap.frequency_sd_hz for tap in taps])
    damping = widened([tap.damping_ratio for tap in taps], [tap.damping_ratio_sd for tap in taps])
    change = mean_change([tap.change for tap in taps if tap.change is not None])
    if change is not None and change.certain:  # alike in all taps, so it does not average out
        span = (change.late - change.early) / 2
        damping = [math.hypot(sd, span * math.sqrt(len(taps))) for sd in damping]
    ratios = [
        widened([tap.ratios[k].value for tap in taps], [tap.ratios[k].sd for tap in taps])
        for k in range(len(taps[0].ratios))
    ]
    return [
        replace(
            tap,
            frequency_sd_hz=frequency[k],
            damping_ratio_sd=damping[k],
            ratios=tuple(replace(ratio, sd=ratios[j][k]) for j, ratio in enumerate(tap.ratios)),
        )
        for k, tap in enumerate(taps)
    ]
