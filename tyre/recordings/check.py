"""What no recording of a bicycle-tyre rig can be: limits that catch a wrong unit or a mangled file at reading.

What a recording can be but should not (few sweeps, drift, dropouts) is the business of ``tyre.recordings.preflight``.
"""

import numpy as np

from tyre.bands import GRAVITY, POUND
from tyre.base.errors import InputError
from tyre.base.plausible import SMALLEST
from tyre.recordings.recording import Channel, Condition, PullTest, RigRun

# name of a Condition field -> lowest, highest, factor to the printed unit, printed unit
_CONDITION_LIMITS = {
    "load": (5.0, 1e4, 1.0, "N"),
    "pressure": (0.2e5, 20e5, 1e-5, "bar"),
    "drum_radius": (0.1, 20.0, 1.0, "m"),
    "speed": (0.0, 60.0, 1.0, "m/s"),
    "temperature": (-40.0, 120.0, 1.0, "degrees Celsius"),
    "camber": (-np.pi / 3, np.pi / 3, 180.0 / np.pi, "deg"),
}
# name of a channel -> largest magnitude, factor to the printed unit, printed unit
_CHANNEL_LIMITS = {
    "slip_angle": (np.pi / 3, 180.0 / np.pi, "deg"),
    "side_force": (2e4, 1.0, "N"),
    "aligning_moment": (1e3, 1.0, "N m"),
    "inclination": (np.pi / 3, 180.0 / np.pi, "deg"),
    "speed": (60.0, 1.0, "m/s"),
    "temperature": (200.0, 1.0, "degrees Celsius"),
    "plate_displacement": (0.2, 1e3, "mm"),
    "rim_displacement": (0.2, 1e3, "mm"),
}
_LOAD_RATIO = 5.0
# name -> usual values and, with the factor to the right one, what may have gone wrong with a unit; all SI
_GUESSES = {
    "load": ((50.0, 2000.0), ((1e-3, "newtons under kN"), (1e3, "kilonewtons under N"))),
    "pressure": (
        (1.5e5, 10e5),
        ((1e-2, "kPa under bar"), (1e2, "bar under kPa"), (0.0689476, "psi under bar"), (1e5, "bar under Pa"),
         (1e-5, "Pa under bar")),
    ),
    "drum_radius": ((0.3, 3.0), ((1e-3, "millimetres under m"), (1e3, "metres under mm"))),
    "speed": ((0.5, 15.0), ((1 / 3.6, "km/h under m/s"),)),
    "slip_angle": ((np.deg2rad(2.0), np.deg2rad(15.0)), ((np.pi / 180.0, "degrees under rad"),)),
    "inclination": ((0.0, np.deg2rad(30.0)), ((np.pi / 180.0, "degrees under rad"),)),
    "camber": ((0.0, np.deg2rad(30.0)), ((np.pi / 180.0, "degrees under rad"),)),
    "side_force": ((30.0, 1500.0), ((1e-3, "newtons under kN"),)),
    "plate_displacement": ((5e-4, 0.02), ((1e-3, "millimetres under m"), (1e-6, "micrometres under m"))),
    "rim_displacement": ((1e-5, 0.01), ((1e-3, "millimetres under m"), (1e-6, "micrometres under m"))),
}  # fmt: skip


def _guess(name: str, value: float) -> str:
    """The unit that a ``value`` (SI) may be in, `` (kPa under bar?)``; empty where none explains it."""
    (low, high), slips = _GUESSES.get(name, ((0.0, 0.0), ()))
    return next((f" ({words}?)" for factor, words in slips if low <= factor * abs(value) <= high), "")


def check_condition(condition: Condition, *, where: str) -> None:
    """Refuse a condition outside of what rigs do.

    Parameters
    ----------
    condition : Condition
    where : str
        What the message calls the file.

    Raises
    ------
    InputError
        Naming the quantity, its value and the allowed range; also when a drum has no radius or a flat track has one.
    """
    for name, (lowest, highest, factor, unit) in _CONDITION_LIMITS.items():
        value = getattr(condition, name)
        if value is not None and not lowest <= value <= highest:
            raise InputError(
                f"{where}: {name.replace('_', ' ')} is {value * factor:g} {unit}, allowed are {lowest * factor:g} to "
                f"{highest * factor:g} {unit}; check the unit{_guess(name, value)}"
            )
    if condition.surface not in ("flat", "drum"):
        raise InputError(f"{where}: surface = {condition.surface!r} is neither 'flat' nor 'drum'")
    if (condition.surface == "drum") != (condition.drum_radius is not None):
        raise InputError(f"{where}: a drum needs its radius (drum_radius_m) and a flat track must not have one")


def check_channels(recording: RigRun | PullTest, *, where: str) -> None:
    """Refuse channels that are empty, infinite or beyond what a rig can produce.

    Parameters
    ----------
    recording : RigRun or PullTest
    where : str
        What the message calls the file.

    Raises
    ------
    InputError
        Naming the channel, its largest value and the limit.
    """
    samples = len(recording.side_force)
    if samples < 2:
        raise InputError(f"{where}: has {samples} of the 2 or more samples that are needed; was the file cut off?")
    for name in ("time", "vertical_load", *_CHANNEL_LIMITS):
        channel: Channel | None = getattr(recording, name, None)
        if channel is None:
            continue
        if np.isinf(channel).any():
            raise InputError(f"{where}: {name} is infinite in sample {int(np.isinf(channel).argmax()) + 1}")
        finite = channel[np.isfinite(channel)]
        if not finite.size:
            raise InputError(f"{where}: {name} has no valid sample at all; leave the channel out or repair the file")
        if name in _CHANNEL_LIMITS:
            limit, factor, unit = _CHANNEL_LIMITS[name]
            largest = float(np.abs(finite).max())
            if largest > limit:
                raise InputError(
                    f"{where}: {name} reaches {largest * factor:.4g} {unit}, allowed are {limit * factor:.4g} {unit}; "
                    f"check the unit{_guess(name, largest)}"
                )
    if isinstance(recording, RigRun):
        _check_load(recording, where)


def _check_load(run: RigRun, where: str) -> None:
    median = float(np.nanmedian(run.vertical_load))
    if median < 0.0:
        raise InputError(
            f"{where}: vertical load is negative (median {median:.4g} N), but {run.axes} axes count it positive; "
            "declare axes = 'SAE' or turn its sign"
        )
    ratio = median / run.condition.load
    if not 1 / _LOAD_RATIO <= ratio <= _LOAD_RATIO:
        times = max(ratio, 1 / ratio) if ratio > SMALLEST else np.inf  # an empty channel is in no other unit
        slips = ((GRAVITY, "kg"), (POUND, "lbf"), (1e3, "kN"))
        said = [f" ({unit} in {'the recording' if ratio < 1 else 'the declared load'}?)" for factor, unit in slips
                if abs(times / factor - 1.0) < 0.1]  # fmt: skip
        raise InputError(
            f"{where}: median vertical load is {median:.4g} N, the declared load {run.condition.load:.4g} N; "
            f"one of the two has the wrong unit{said[0] if said else ''}"
        )
