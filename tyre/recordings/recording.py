"""Rig recordings in SI units and one sign convention, the conventions of files, and limits that no rig exceeds.

===============  ==========================  ==========================  =========  =========
convention       axes                        slip angle                  camber     load
===============  ==========================  ==========================  =========  =========
``adapted SAE``  x forward, y right, z down  -vy/vx: force grows         > 0 right  > 0
``ISO``          x forward, y left, z up     vy/vx: the same slip        > 0 right  > 0
``SAE``          x forward, y right, z down  vy/vx: force falls          > 0 right  Fz < 0
===============  ==========================  ==========================  =========  =========

vx, vy: velocity of the contact centre in the axes of the row. ISO: ISO 8855, the W-axes of TYDEX and the sign
convention of .tir files; SAE: SAE J670e; adapted SAE: Pacejka, Tire and Vehicle Dynamics, 3rd ed., Appendix 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tyre.ground.errors import InputError, hint
from tyre.ground.units import GRAVITY, PASCAL_PER_BAR
from tyre.measured.plausible import POUND, SMALLEST

Channel = NDArray[np.float64]


def shown_range(channel: Channel, unit: str) -> str:
    """``-6 to 6 deg``: lowest and highest of the finite readings (n,) of a ``channel`` in its ``unit``."""
    finite = channel[np.isfinite(channel)]
    return f"{finite.min():.4g} to {finite.max():.4g} {unit}" if finite.size else "without a reading"


@dataclass(frozen=True)
class Condition:
    """Under which condition a recording was made; SI units, None where the lab did not say.

    Load, pressure and camber may be NaN until :mod:`tyre.fits.segments` has taken them from the channels.
    """

    tyre: str  # name of the tyre
    load: float  # N, nominal vertical load, > 0
    pressure: float  # Pa, inflation pressure
    surface: str  # ``flat`` or ``drum``
    drum_radius: float | None = None  # m; None on a flat track
    rim: str | None = None  # name of the rim
    speed: float | None = None  # m/s, of rolling
    temperature: float | None = None  # degrees Celsius
    camber: float = 0.0  # rad, positive to the right

    def __str__(self) -> str:
        """Write it in the units of the field, without what is not known yet and a camber of zero."""
        parts = [f"{self.tyre} on {self.surface}"]
        if np.isfinite(self.load):
            parts.append(f"{self.load:g} N")
        if np.isfinite(self.pressure):
            parts.append(f"{self.pressure / PASCAL_PER_BAR:g} bar")
        if self.camber and np.isfinite(self.camber):
            parts.append(f"camber {np.rad2deg(self.camber):.4g} deg")
        return ", ".join(parts)


SIMULATED_NOTE = "synthetic: computed by the rig simulator, not measured"
COMPUTED_NOTE = "synthetic: computed by a simulation, not measured"
SYNTHETIC_NOTES = (SIMULATED_NOTE, COMPUTED_NOTE)
"""Notes in files of synthetic recordings for their readers; ``synthetic`` of the recording already states it."""


@dataclass(frozen=True)
class RigRun:
    """One slip-sweep (or slip-step) recording of a rolling tyre, or settled points of it (``steady``).

    Settled points have no time: there it is their number, and nothing is made of it.
    """

    condition: Condition  # what the laboratory set and stated
    axes: str  # one of :data:`CONVENTIONS`, in which the file counts; the channels are in adapted SAE
    time: Channel  # (n,), s; of settled points their number
    slip_angle: Channel  # (n,), rad, positive for a lateral force to the right
    lateral_force: Channel  # (n,), N, positive to the right
    vertical_load: Channel  # (n,), N, positive
    aligning_moment: Channel | None = None  # (n,), N m, positive turns the wheel to the right
    inclination: Channel | None = None  # (n,), rad, positive to the right
    speed: Channel | None = None  # (n,), m/s
    temperature: Channel | None = None  # (n,), degrees Celsius
    pressure: Channel | None = None  # (n,), Pa
    source: Path | None = None  # file of the recording
    synthetic: bool = False  # True if a program computed it
    kind: Literal["slip_sweep", "slip_step", "steady"] = "slip_sweep"  # how the slip was driven
    notes: tuple[str, ...] = ()  # what a reader of any result must know

    def __repr__(self) -> str:
        duration = "" if self.kind == "steady" else f" over {np.ptp(self.time):.4g} s"
        slip = shown_range(np.rad2deg(self.slip_angle), "deg")
        return (
            f"<RigRun {self.kind}: {self.condition}; {self.time.size} samples{duration}\n"
            f" slip angle {slip}, lateral force {shown_range(self.lateral_force, 'N')}; notes: {len(self.notes)}>"
        )


@dataclass(frozen=True)
class LateralStiffnessTest:
    """A lateral stiffness test: ``lateral_force`` N over ``plate_displacement`` and ``rim_displacement`` m, shape (n,).

    The tyre's own deflection is plate minus rim (Dell'Orto et al., eq. 8).
    """

    condition: Condition  # what the laboratory set and stated
    axes: str  # one of :data:`CONVENTIONS`, in which the file counts; the channels are in adapted SAE
    lateral_force: Channel  # (n,), N, positive to the right
    plate_displacement: Channel  # (n,), m, positive to the right
    rim_displacement: Channel  # (n,), m, positive to the right
    time: Channel | None = None  # (n,), s
    source: Path | None = None  # file of the recording
    synthetic: bool = False  # True if a program computed it
    notes: tuple[str, ...] = ()  # what a reader of any result must know

    def __repr__(self) -> str:
        return (
            f"<LateralStiffnessTest: {self.condition}; {self.lateral_force.size} readings\n"
            f" lateral force {shown_range(self.lateral_force, 'N')}, "
            f"tyre deflection {shown_range(1e3 * self.tyre_deflection, 'mm')}; notes: {len(self.notes)}>"
        )

    @property
    def tyre_deflection(self) -> Channel:
        """Lateral deflection of the tyre alone, m."""
        return self.plate_displacement - self.rim_displacement

    @property
    def complete(self) -> NDArray[np.bool_]:
        """Readings with a force and both displacements, shape (n,): the others are not fitted."""
        return np.isfinite(self.lateral_force) & np.isfinite(self.tyre_deflection)


@dataclass(frozen=True)
class ChannelKind:
    """A channel of a rig: its quantity, the unit of its column with the factor from SI, its largest magnitude (SI)."""

    quantity: str  # name of the quantity, as units know it
    unit: str  # of a column that is written, as its name ends
    factor: float = 1.0  # number in ``unit`` over that in SI
    limit: float = np.inf  # largest magnitude of a sound recording, SI
    signs: tuple[float, float, float] = (1.0, 1.0, 1.0)  # factors from :data:`CONVENTIONS` to adapted SAE


CONVENTIONS = ("ISO", "SAE", "adapted SAE")
_PER_RADIAN = float(np.rad2deg(1.0))
CHANNELS = {
    "time": ChannelKind("time", "s"),
    "slip_angle": ChannelKind("angle", "deg", _PER_RADIAN, np.pi / 3, (1.0, -1.0, 1.0)),
    "lateral_force": ChannelKind("force", "N", 1.0, 2e4, (-1.0, 1.0, 1.0)),
    "vertical_load": ChannelKind("force", "N", signs=(1.0, -1.0, 1.0)),  # of a loaded tyre
    "aligning_moment": ChannelKind("moment", "Nm", 1.0, 1e3, (-1.0, 1.0, 1.0)),
    "inclination": ChannelKind("angle", "deg", _PER_RADIAN, np.pi / 3),
    "speed": ChannelKind("speed", "km_h", 3.6, 60.0),
    "temperature": ChannelKind("temperature", "C", 1.0, 200.0),
    "pressure": ChannelKind("pressure", "bar", 1e-5, 20e5),
    "plate_displacement": ChannelKind("length", "mm", 1e3, 0.2, (-1.0, 1.0, 1.0)),
    "rim_displacement": ChannelKind("length", "mm", 1e3, 0.2, (-1.0, 1.0, 1.0)),
}
"""Channels of a rig by name."""


def signs(axes: str, *, where: str = "axes") -> dict[str, float]:
    """Factor +1 or -1 of every channel between a declared convention and adapted SAE; another name is refused."""
    if axes not in CONVENTIONS:
        raise InputError(f"{where}: axes = {axes!r} is not one of {', '.join(CONVENTIONS)}{hint(axes, CONVENTIONS)}")
    return {name: channel.signs[CONVENTIONS.index(axes)] for name, channel in CHANNELS.items()}


def slope_grows(axes: str) -> bool:
    """True if the lateral force of a sound tyre grows with slip in the raw numbers of a convention."""
    turn = signs(axes)
    return turn["slip_angle"] * turn["lateral_force"] > 0.0


# name of a Condition field -> lowest, highest, factor to the printed unit, printed unit
_CONDITION_LIMITS = {
    "load": (5.0, 1e4, 1.0, "N"), "pressure": (0.2e5, 20e5, 1e-5, "bar"), "drum_radius": (0.1, 20.0, 1.0, "m"),
    "speed": (0.0, 60.0, 1.0, "m/s"), "temperature": (-40.0, 120.0, 1.0, "degrees Celsius"),
    "camber": (-np.pi / 3, np.pi / 3, 180.0 / np.pi, "deg"),
}  # fmt: skip
_PRINTED = {"km_h": ("m/s", 1.0), "C": ("degrees Celsius", 1.0), "Nm": ("N m", 1.0)}
# name -> usual values and, with the factor to the right one, what may have gone wrong with a unit; all SI
_DEGREES = ((np.pi / 180.0, "degrees under rad"),)
_GUESSES: dict[str, tuple[tuple[float, float], Sequence[tuple[float, str]]]] = {
    "load": ((50.0, 2000.0), ((1e-3, "newtons under kN"), (1e3, "kilonewtons under N"))),
    "pressure": (
        (1.5e5, 10e5),
        (
            (1e-2, "kPa under bar"),
            (1e2, "bar under kPa"),
            (0.0689476, "psi under bar"),
            (1e5, "bar under Pa"),
            (1e-5, "Pa under bar"),
        ),
    ),
    "drum_radius": ((0.3, 3.0), ((1e-3, "millimetres under m"), (1e3, "metres under mm"))),
    "speed": ((0.5, 15.0), ((1 / 3.6, "km/h under m/s"),)),
    "slip_angle": ((np.deg2rad(2.0), np.deg2rad(15.0)), _DEGREES),
    "inclination": ((0.0, np.deg2rad(30.0)), _DEGREES),
    "camber": ((0.0, np.deg2rad(30.0)), _DEGREES),
    "lateral_force": ((30.0, 1500.0), ((1e-3, "newtons under kN"),)),
    "plate_displacement": ((5e-4, 0.02), ((1e-3, "millimetres under m"), (1e-6, "micrometres under m"))),
    "rim_displacement": ((1e-5, 0.01), ((1e-3, "millimetres under m"), (1e-6, "micrometres under m"))),
}


def _guess(name: str, value: float) -> str:
    """The unit that a ``value`` (SI) may be in, `` (kPa under bar?)``; empty if none explains it."""
    (low, high), slips = _GUESSES.get(name, ((0.0, 0.0), ()))
    return next((f" ({words}?)" for factor, words in slips if low <= factor * abs(value) <= high), "")


def check_condition(condition: Condition, *, where: str) -> None:
    """Refuse a condition outside of what rigs do; also a drum without a radius, or a flat track with one."""
    for name, (lowest, highest, factor, unit) in _CONDITION_LIMITS.items():
        value = getattr(condition, name)
        if value is not None and not (lowest <= value <= highest or np.isnan(value)):
            raise InputError(
                f"{where}: {name.replace('_', ' ')} is {value * factor:g} {unit}, allowed are {lowest * factor:g} to "
                f"{highest * factor:g} {unit}; check the unit{_guess(name, value)}"
            )
    if condition.surface not in ("flat", "drum"):
        raise InputError(f"{where}: surface = {condition.surface!r} is neither 'flat' nor 'drum'")
    if (condition.surface == "drum") != (condition.drum_radius is not None):
        raise InputError(f"{where}: a drum needs its radius (drum_radius_m) and a flat track must not have one")


def check_channels(recording: RigRun | LateralStiffnessTest, *, where: str) -> None:
    """Refuse channels that are empty, infinite or beyond what a rig can produce."""
    samples = len(recording.lateral_force)
    if samples < 2:
        raise InputError(f"{where}: has {samples} of the 2 or more samples that are needed; was the file cut off?")
    for name, kind in CHANNELS.items():
        channel: Channel | None = getattr(recording, name, None)
        if channel is None:
            continue
        if np.isinf(channel).any():
            raise InputError(f"{where}: {name} is infinite in sample {int(np.isinf(channel).argmax()) + 1}")
        finite = channel[np.isfinite(channel)]
        if not finite.size:
            raise InputError(f"{where}: {name} has no valid sample at all; leave the channel out or repair the file")
        unit, factor = _PRINTED.get(kind.unit, (kind.unit, kind.factor))
        largest = float(np.abs(finite).max())
        if largest > kind.limit:
            raise InputError(
                f"{where}: {name} reaches {largest * factor:.4g} {unit}, allowed are {kind.limit * factor:.4g} {unit}; "
                f"check the unit{_guess(name, largest)}"
            )
    if isinstance(recording, RigRun):
        _check_load(recording, where)


def _check_load(run: RigRun, where: str) -> None:
    """Refuse a load of the wrong sign, or five times as large or small as the declared one."""
    median = float(np.nanmedian(run.vertical_load))
    if median < 0.0:
        raise InputError(
            f"{where}: vertical load is negative (median {median:.4g} N), but {run.axes} axes count it positive; "
            "declare axes = 'SAE' or turn its sign"
        )
    ratio = median / run.condition.load
    if ratio < 1 / 5 or ratio > 5:
        times = max(ratio, 1 / ratio) if ratio > SMALLEST else np.inf  # an empty channel is in no other unit
        slips = ((GRAVITY, "kg"), (POUND, "lbf"), (1e3, "kN"))
        suspicions = [
            f" ({unit} in {'the recording' if ratio < 1 else 'the declared load'}?)"
            for factor, unit in slips
            if abs(times / factor - 1.0) < 0.1
        ]
        raise InputError(
            f"{where}: median vertical load is {median:.4g} N, the declared load {run.condition.load:.4g} N; "
            f"one of the two has the wrong unit{suspicions[0] if suspicions else ''}"
        )
