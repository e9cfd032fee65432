"""Modes, damping ratios and critical speeds of one case, each with the standard deviation the tyre data give it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.critical import critical_speeds
from bicycle.linear_model import LinearModel
from bicycle.modes import Modes, modes
from studies.main_study_cases import Array, Settings, Setup, TyreCase, build

COMPARED_MODES = ("wobble", "weave")
RELATIVE_STEP = 1e-4


@dataclass(frozen=True)
class Uncertain:
    """A number and its standard deviation."""

    value: float
    sd: float


@dataclass(frozen=True)
class Crossing:
    """A critical speed (m/s): where ``mode`` becomes stable or unstable; frequency in Hz."""

    mode: str
    kind: str
    direction: str
    speed: float
    sd: float
    frequency_hz: float

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
    damping: dict[str, Uncertain]  # mode -> damping ratio at the report speed; missing where it is no oscillation

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


class Neighbours:
    """The models one small step away in each of the four tyre numbers: numerical derivatives of anything at a speed."""

    def __init__(self, build_at: Callable[[Array], LinearModel], contact: Array) -> None:
        self.steps = RELATIVE_STEP * contact
        self.pairs = [
            (build_at(contact + step), build_at(contact - step)) for step in np.diag(self.steps)
        ]  # central differences

    def gradient(self, speed: float, eigenvalue: complex, quantity: Callable[[complex], float]) -> Array:
        """Derivative (4,) of a quantity of the eigenvalue nearest to ``eigenvalue`` (1/s) at a speed (m/s)."""
        values = [[quantity(nearest(model, speed, eigenvalue)) for model in pair] for pair in self.pairs]
        return np.array([(more - less) / (2 * step) for (more, less), step in zip(values, self.steps, strict=True)])


def nearest(model: LinearModel, speed: float, eigenvalue: complex) -> complex:
    """The eigenvalue (1/s) of a model that is nearest to a given one."""
    values = model.eigenvalues(speed)
    return complex(values[int(np.argmin(np.abs(values - eigenvalue)))])


def damping_ratio(eigenvalue: complex) -> float:
    """Minus the real part over the modulus."""
    return -eigenvalue.real / abs(eigenvalue)


def standard_deviation(gradient: Array, covariance: NDArray[np.float64]) -> float:
    """First-order propagation, sqrt(g' S g)."""
    return float(np.sqrt(max(float(gradient @ covariance @ gradient), 0.0)))


def solve(settings: Settings, case: TyreCase, setup: Setup) -> Result:
    """Modes over the study's speeds, damping ratios at its report speed and critical speeds, with uncertainty."""
    model = build(settings.bicycle, setup, case.contact)
    neighbours = Neighbours(lambda contact: build(settings.bicycle, setup, contact), case.contact)
    found = modes(model, np.append(settings.speeds, settings.report_speed))
    damping = {}
    for mode, eigenvalue in oscillations(found, -1).items():
        gradient = neighbours.gradient(settings.report_speed, eigenvalue, damping_ratio)
        damping[mode] = Uncertain(damping_ratio(eigenvalue), standard_deviation(gradient, case.covariance))
    crossings = [
        _crossing(model, neighbours, case, one) for one in critical_speeds(model, max_speed=settings.max_speed)
    ]
    return Result(case, setup, found, tuple(crossings), damping)


def oscillations(found: Modes, row: int) -> dict[str, complex]:
    """Eigenvalues (1/s, upper half) of the compared modes at one of the speeds, where they are oscillations."""
    values = {name: complex(found.branches[name][row, 0]) for name in COMPARED_MODES if name in found.branches}
    return {name: value for name, value in values.items() if value.imag > 0}


def _crossing(model: LinearModel, neighbours: Neighbours, case: TyreCase, found: Any) -> Crossing:
    """d(critical speed)/dp = -(d Re/dp) / (d Re/dv) at the crossing."""
    target = complex(0.0, found.frequency)
    step = RELATIVE_STEP * max(found.speed, 1.0)
    ahead, behind = (nearest(model, found.speed + sign * step, target).real for sign in (1, -1))
    slope = (ahead - behind) / (2 * step)
    gradient = -neighbours.gradient(found.speed, target, lambda value: value.real) / slope
    sd = standard_deviation(gradient, case.covariance)
    return Crossing(
        found.mode, found.kind, found.direction, float(found.speed), sd, float(found.frequency) / (2 * np.pi)
    )


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
