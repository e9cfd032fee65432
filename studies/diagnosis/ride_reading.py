"""Rides of a measurement file: their segments of steady speed, and the spectra of these."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.identification.recording import CHANNELS, MOTOR_IN_TORQUE, STEER_TORQUE, Run, refuse_copies
from bicycle.identification.ride_recording import Ride, is_steady, read_ride
from bicycle.identification.tapered_spectra import RideSpectrum, bands_between, narrowest_band, ride_spectrum
from studies.diagnosis.bicycle_kind import SPEED
from studies.diagnosis.ride_disturbances import (
    ANSWERED,
    CONTROLLER,
    NOBODY,
    RIDER,
    SIZES,
    Disturbances,
    Steering,
)
from studies.diagnosis.ride_model import Rides
from studies.diagnosis.whitening import rough_noise
from tyre.formats.channel_map import TABLES, ChannelMap
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.files import named_folder
from tyre.ground.schema import any_table, anything, flag, list_of, maybe, needed, number, read, table, text

LOWEST_HZ, HIGHEST_HZ = 0.2, 15.0
SAME_MOTION = {"steer_rate_rad_s": "steer_rad", "lean_rad": "roll_rate_rad_s"}
"""Channel -> another that holds the same motion, which is used in its place."""
LEAST = 1e-12  # SI unit per root of Hz, below which a channel holds nothing
DEPENDENT = 1e-10  # smallest eigenvalue of the coherences in a band, below which a channel is a sum of others
ANSWERS_ALL = 0.95  # share of a torque that answers the motion, from which on a controller gave it
HOW = "write [[ride_spectra.rides]] with file, and speed_m_s where the file has no speed"
RIDE = table(
    {
        needed("file", "no file; give the recording"): text("must be a path in quotes", blank=False),
        maybe("speed_m_s"): SPEED,
    }
)
HERTZ = number(above=0, most=100, says="must be a frequency above 0, at most 100 Hz")
TABLE = table(
    {
        needed("rides", f"no rides; {HOW}"): list_of(any_table, f"must be tables with a file: {HOW}", least=1),
        maybe("folder"): text('must be a folder in quotes, such as "rides" or "$VARIABLE/rides"', blank=False),
        maybe("lowest_Hz", LOWEST_HZ): HERTZ,
        maybe(MOTOR_IN_TORQUE): flag,
        maybe("highest_Hz", HIGHEST_HZ): HERTZ,
        maybe("steering"): text(
            f"is not allowed; write {RIDER!r}, {CONTROLLER!r} or {NOBODY!r}", allowed=(RIDER, CONTROLLER, NOBODY)
        ),
        **dict.fromkeys(map(maybe, TABLES), anything),
    }
)


@dataclass(frozen=True)
class RidesRead:
    """Rides that were read, with what was left out of them."""

    rides: Rides
    segments: tuple[tuple[Run, ...], ...]  # of each ride
    left_out: tuple[str, ...]  # sentences: which parts, and why
    notes: tuple[str, ...]


def read_rides(content: Any, folder: Path, *, ridden: bool) -> RidesRead:
    """Read the table ``content`` of a measurement file; a rider steers if somebody is ``ridden`` by default."""
    settings = read(TABLE, content, section="ride_spectra")
    if "folder" in settings:
        folder = named_folder(settings["folder"], folder)
    tables = {key: settings[key] for key in TABLES if key in settings}
    channel_map = ChannelMap.from_table(tables, folder, where="[ride_spectra]") if tables else None
    entries = [read(RIDE, entry, where="[[ride_spectra.rides]]") for entry in settings["rides"]]
    rides = [read_ride(folder / e["file"], e.get("speed_m_s"), channel_map=channel_map) for e in entries]
    return spectra_of_rides(
        rides,
        steering=settings.get("steering", ""),
        ridden=ridden,
        lowest_hz=settings["lowest_Hz"],
        highest_hz=settings["highest_Hz"],
    )


def spectra_of_rides(
    rides: Sequence[Ride],
    *,
    steering: str = "",
    ridden: bool,
    lowest_hz: float = LOWEST_HZ,
    highest_hz: float = HIGHEST_HZ,
) -> RidesRead:
    """Spectra of ``rides``, their segments of nearly one speed put together.

    ``steering`` is "rider", "controller" or "nobody"; if it is empty the recorded torque and ``ridden`` decide.

    Raises
    ------
    InputError
        Fewer than two channels that all segments have, a channel that copies others, or too short segments.
    """
    runs = [run for ride in rides for run in ride.segments]
    refuse_copies(runs)
    channels, notes = _channels(runs)
    groups = _by_speed(runs)
    gains, share = _answers(groups, channels)
    who = _who_steers(steering, ridden, gains, share)
    if _torque_varies(groups) and share < ANSWERS_ALL and who == RIDER:
        channels = (*channels, STEER_TORQUE)
    elif gains is not None and who == CONTROLLER:
        notes += (f"{share:.1%} of the recorded steer torque answers the motion: it is a controller's",)
    elif gains is not None and not _torque_varies(groups):
        notes += (f"{STEER_TORQUE} is not used: it is constant at one speed or more",)
    durations = [sum(run.step * len(run.time) for run in group) for group in groups]
    nyquist = 0.4 / max(run.step for run in runs)
    shortest = groups[int(np.argmin(durations))]
    widths = [narrowest_band([run.step * len(run.time) for run in group]) for group in (shortest, *groups)]
    bands = bands_between(lowest_hz, min(highest_hz, nyquist), max(widths))
    if len(bands.middle) < 4:
        raise InputError(
            f"{runs[0].name}: between {lowest_hz:g} and {min(highest_hz, nyquist):g} Hz are {len(bands.middle)} bands "
            f"of {max(widths):.2g} Hz; 4 are needed: ride longer at one speed, or raise highest_Hz"
        )
    spectra = tuple(ride_spectrum(_name(group), group, channels, bands, speed=_mean_speed(group)) for group in groups)
    for spectrum in spectra:
        _refuse_dependent(spectrum)
    floors = np.array([_floor(runs, name) for name in channels])
    disturbances = Disturbances(tuple(SIZES), floors, who, gains if who == CONTROLLER else None)
    left_out = tuple(f"{ride.name}: {sentence}" for ride in rides for sentence in ride.left_out)
    all_notes = tuple(dict.fromkeys([*notes, *(note for ride in rides for note in ride.notes)]))
    return RidesRead(Rides(spectra, disturbances), tuple(groups), left_out, all_notes)


def lowest_of_all(rides: Sequence[Ride], periods: float) -> float:
    """Lowest frequency (Hz), at most :data:`LOWEST_HZ`, with ``periods`` in the longest segment of every speed."""
    groups = _by_speed([run for ride in rides for run in ride.segments])
    longest = [max(run.step * len(run.time) for run in group) for group in groups]
    return min(LOWEST_HZ, periods / min(longest)) if longest else LOWEST_HZ


def _channels(runs: Sequence[Run]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Channels that all ``runs`` have and that differ in their motion; notes on those that are not used."""
    common = [name for name in CHANNELS if all(name in run.channels for run in runs)]
    notes = []
    used = []
    for name in common:
        twin = SAME_MOTION.get(name)
        if twin in common:
            notes.append(f"{name} is not used: {twin} holds the same motion")
        elif name == "lateral_acceleration_m_s2":
            notes.append(f"{name} is not used: the place of the sensor is not known")
        else:
            used.append(name)
    if len(used) < 2:
        raise InputError(
            f"{runs[0].name}: {', '.join(used) or 'no channel'} alone shows nothing that does not also depend on what "
            "moved the bicycle; record two of roll rate, yaw rate and steering, better all three"
        )
    return tuple(used), tuple(notes)


def _refuse_dependent(spectrum: RideSpectrum) -> None:
    """Refuse a channel that is a copy of another or a sum of others: it shows nothing and has no noise of its own."""
    size = np.sqrt(np.diagonal(spectrum.values, axis1=1, axis2=2).real)
    if (size < LEAST).any():
        silent, channel = np.unravel_index(np.argmin(size), size.shape)
        raise InputError(
            f"{spectrum.name}: {spectrum.channels[channel]} shows nothing at {spectrum.hertz[silent]:.3g} Hz; "
            "correct its unit, or leave it out"
        )
    values, axes = np.linalg.eigh(spectrum.values / (size[:, :, None] * size[:, None]))
    band = int(np.argmin(values[:, 0]))
    if values[band, 0] > DEPENDENT:
        return
    share = np.abs(axes[band, :, 0])
    names = [name for name, part in zip(spectrum.channels, share, strict=True) if part > 0.1]
    raise InputError(
        f"{spectrum.name}: at {spectrum.hertz[band]:.3g} Hz {', '.join(names)} hold the same motion without any noise "
        "of their own; leave a copied or computed channel out"
    )


def _by_speed(runs: Sequence[Run]) -> list[tuple[Run, ...]]:
    """Segments of nearly one speed together, slowest first."""
    groups: list[list[Run]] = []
    for run in sorted(runs, key=lambda run: run.speed):
        if groups and is_steady(groups[-1][0].speed, run.speed):
            groups[-1].append(run)
        else:
            groups.append([run])
    return [tuple(group) for group in groups]


def _mean_speed(group: Iterable[Run]) -> float:
    runs = list(group)
    return float(np.average([run.speed for run in runs], weights=[len(run.time) for run in runs]))


def _name(group: Sequence[Run]) -> str:
    files = list(dict.fromkeys(run.name.partition("#")[0] for run in group))
    return f"{' and '.join(files[:2])}{' ...' * (len(files) > 2)}, {_mean_speed(group):.3g} m/s"


def _answers(groups: Sequence[Sequence[Run]], channels: Sequence[str]) -> tuple[Array | None, float]:
    """Gains (R, 4) of the recorded torque on the motion, T = -gains . motion, and the share of it that answers so."""
    if any(STEER_TORQUE not in run.inputs for group in groups for run in group):
        return None, 0.0
    answered = [(k, name) for name in channels for k, output in enumerate(ANSWERED) if CHANNELS[name] == output]
    gains, left, total = np.zeros((len(groups), len(ANSWERED))), 0.0, 0.0
    for row, group in enumerate(groups):
        motion = np.concatenate([np.stack([_centred(run.channels[n]) for _, n in answered], 1) for run in group])
        torque = np.concatenate([_centred(run.inputs[STEER_TORQUE]) for run in group])
        coefficients = np.linalg.lstsq(motion, torque, rcond=None)[0]
        gains[row, [k for k, _ in answered]] = -coefficients
        left += float(np.sum((torque - motion @ coefficients) ** 2))
        total += float(np.sum(torque**2))
    return gains, 1 - left / total if total else 0.0


def _centred(signal: Array) -> Array:
    return np.asarray(signal - signal.mean())


def _torque_varies(groups: Sequence[Sequence[Run]]) -> bool:
    """True if a steer torque was recorded at every speed, and was changed."""
    return all(
        all(STEER_TORQUE in run.inputs for run in group) and any(np.ptp(run.inputs[STEER_TORQUE]) > 0 for run in group)
        for group in groups
    )


def _who_steers(steering: str, ridden: bool, gains: Array | None, share: float) -> Steering:  # noqa: FBT001
    """Rider, controller or nobody: as stated, else as the recorded torque and the bicycle tell."""
    if steering == CONTROLLER and gains is None:
        raise InputError(
            "[ride_spectra]: steering = 'controller' needs the recorded steer_torque_N_m, from which its gains follow"
        )
    for who in (RIDER, CONTROLLER, NOBODY):
        if steering == who:
            return who
    if gains is not None and share > ANSWERS_ALL:
        return CONTROLLER
    return RIDER if ridden else NOBODY


def _floor(runs: Sequence[Run], name: str) -> float:
    """Usual noise density of a channel, unit^2/Hz: white noise of the size that second differences show."""
    signals = [{**run.channels, **run.inputs}[name] for run in runs]
    return 2 * runs[0].step * rough_noise(signals).sd ** 2
