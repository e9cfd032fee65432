"""Modes, frequencies, damping ratios and critical speeds of one case, each with its standard deviation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bicycle.critical import critical_speeds
from bicycle.linear_model import LinearModel
from bicycle.modes import Modes, modes
from bicycle.propagation import critical_speed_sd, mode_sd
from studies.main_study.cases import Settings, Setup, TyreCase, model
from studies.main_study.spread import spread, tyre_spread

COMPARED_MODES = ("wobble", "weave")


@dataclass(frozen=True)
class Uncertain:
    """A number, its standard deviation, and that of the tyre data alone."""

    value: float
    sd: float
    tyre_sd: float


@dataclass(frozen=True)
class Crossing:
    """A critical speed (m/s): where ``mode`` becomes stable or unstable; frequency in Hz.

    ``sd`` is of all that is uncertain, ``tyre_sd`` of the tyre data alone.
    """

    mode: str
    kind: str
    direction: str
    speed: float
    sd: float
    tyre_sd: float
    frequency_hz: float

    @property
    def value(self) -> float:
        """The speed, m/s."""
        return self.speed

    @property
    def destabilising(self) -> bool:
        """True where the mode loses its stability as the speed grows."""
        return self.direction == "destabilising"


@dataclass(frozen=True)
class Band:
    """Speeds in which a mode is unstable; None: it begins below, or goes on above, the speeds looked at."""

    start: Crossing | None
    end: Crossing | None


@dataclass(frozen=True, eq=False)
class Result:
    """One tyre case in one setup; the last speed of ``modes`` is the report speed, added to the study's."""

    case: TyreCase
    setup: Setup
    modes: Modes
    crossings: tuple[Crossing, ...]
    frequency: dict[str, Uncertain]  # mode -> Hz at the report speed; missing where it is no oscillation
    damping: dict[str, Uncertain]  # mode -> damping ratio, likewise

    def bands(self, mode: str) -> list[Band]:
        """Unstable speed bands of a mode; one without edges where it is unstable and never crosses."""
        found = unstable_bands(self.crossings, mode)
        value = self.modes.branches[mode][-1, 0].real if mode in self.modes.branches else np.nan
        return found or ([Band(None, None)] if value > 0 and not self.crossed(mode) else [])

    def crossed(self, mode: str) -> bool:
        """Whether a mode has a critical speed."""
        return any(c.mode == mode for c in self.crossings)

    def first(self, mode: str, direction: str) -> float | None:
        """Lowest critical speed (m/s) of a mode in one direction."""
        speeds = [c.speed for c in self.crossings if (c.mode, c.direction) == (mode, direction)]
        return min(speeds, default=None)


def nearest(model: LinearModel, speed: float, eigenvalue: complex) -> complex:
    """The eigenvalue (1/s) of a model that is nearest to a given one."""
    values = model.eigenvalues(speed)
    return complex(values[int(np.argmin(np.abs(values - eigenvalue)))])


def damping_ratio(eigenvalue: complex) -> float:
    """Minus the real part over the modulus."""
    return -eigenvalue.real / abs(eigenvalue)


def solve(settings: Settings, case: TyreCase, setup: Setup) -> Result:
    """Modes over the study's speeds, frequency and damping ratio at its report speed, critical speeds, with sd."""
    built = model(settings.bicycle, setup, case.contact)
    linear = built.linear_model()
    spreads = (spread(settings, case, setup), tyre_spread(case))
    found = modes(linear, np.append(settings.speeds, settings.report_speed))
    roots = oscillations(found, -1)
    every, tyre = (mode_sd(built, settings.report_speed, list(roots.values()), *one) for one in spreads)
    frequency, damping = {}, {}
    for k, (mode, root) in enumerate(roots.items()):
        frequency[mode] = Uncertain(root.imag / (2 * np.pi), float(every[0][k]), float(tyre[0][k]))
        damping[mode] = Uncertain(damping_ratio(root), float(every[1][k]), float(tyre[1][k]))
    critical = critical_speeds(linear, max_speed=settings.max_speed)
    sds = [critical_speed_sd(built, critical, *one).tolist() for one in spreads]
    crossings = [
        Crossing(c.mode, c.kind, c.direction, float(c.speed), sd, tyre_sd, float(c.frequency) / (2 * np.pi))
        for c, sd, tyre_sd in zip(critical, *sds, strict=True)
    ]
    return Result(case, setup, found, tuple(crossings), frequency, damping)


def oscillations(found: Modes, row: int) -> dict[str, complex]:
    """Eigenvalues (1/s, upper half) of the compared modes at one of the speeds, where they are oscillations."""
    values = {name: complex(found.branches[name][row, 0]) for name in COMPARED_MODES if name in found.branches}
    return {name: value for name, value in values.items() if value.imag > 0}


def unstable_bands(crossings: Sequence[Crossing], mode: str) -> list[Band]:
    """Pair the crossings of a mode into bands of instability."""
    bands: list[Band] = []
    start: Crossing | None = None
    inside = False
    for crossing in sorted((c for c in crossings if c.mode == mode), key=lambda c: c.speed):
        if crossing.destabilising:
            start, inside = crossing, True
        elif inside or not bands:
            bands.append(Band(start, crossing))
            start, inside = None, False
    if inside:
        bands.append(Band(start, None))
    return bands
