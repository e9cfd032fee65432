"""Modes, frequencies, damping ratios and critical speeds of one case, each with its standard deviation."""

from dataclasses import dataclass

import numpy as np

from bicycle.critical.critical_speeds import critical_speeds
from bicycle.eigenvalues.oscillation import angular_frequency, damping_ratio, frequency_hz
from bicycle.linear_model import LinearModel
from bicycle.modal.named_modes import Modes, modes
from bicycle.sensitivity.propagation import critical_speed_gradients, mode_gradients, standard_deviation
from studies.main_study.assemble import model
from studies.main_study.bands import (
    FASTER_THAN_WEAVE,
    WEAVE,
    WOBBLE,
    Band,
    Span,
    UncertainCriticalSpeed,
    unstable_bands,
    wobble_edges,
    wobble_span,
)
from studies.main_study.cases import TyreCase
from studies.main_study.settings import Settings, Setup
from studies.main_study.spread import spread, tyre_spread, within

COMPARED_MODES = (WOBBLE, WEAVE)
RIDDEN = (3.0, 20.0)  # m/s, 11 to 72 km/h: where wobble's least damping is looked for


@dataclass(frozen=True)
class Uncertain:
    """A number, its standard deviation, and that of the tyre data alone."""

    value: float
    sd: float
    tyre_sd: float


@dataclass(frozen=True)
class LeastDamped:
    """The least damped wobble at the speeds that are ridden: eigenvalue (1/s) and speed (m/s)."""

    eigenvalue: complex
    speed: float

    @property
    def damping_ratio(self) -> float:
        """Below zero where it grows."""
        return float(damping_ratio(self.eigenvalue))


@dataclass(frozen=True, eq=False)
class Result:
    """One tyre case in one setup; the last speed of ``modes`` is the report speed, added to the study's."""

    case: TyreCase
    setup: Setup
    modes: Modes
    crossings: tuple[UncertainCriticalSpeed, ...]
    frequency: dict[str, Uncertain]  # mode -> Hz at the report speed; missing where it is no oscillation
    damping: dict[str, Uncertain]  # mode -> damping ratio, likewise
    least: LeastDamped | None

    def bands(self, limit: float) -> list[Band]:
        """Bands of unstable wobble that begin up to ``limit`` (m/s); one without edges where it is unstable throughout.

        A band may end beyond the limit.
        """
        found = unstable_bands(self.wobble_edges)
        if not found and self.span(limit):
            return [Band(None, None)]
        return [band for band in found if not band.start or band.start.speed <= limit]

    @property
    def wobble_edges(self) -> list[UncertainCriticalSpeed]:
        """Critical speeds at which unstable wobble begins or ends, rising."""
        return wobble_edges(self.crossings)

    def span(self, limit: float) -> Span | None:
        """Unstable wobble at speeds up to ``limit`` (m/s)."""
        return wobble_span(self.modes.model, self.crossings, limit)


def nearest(linear: LinearModel, speed: float, eigenvalue: complex) -> complex:
    """The eigenvalue (1/s) of a model at a ``speed`` (m/s) that is nearest to ``eigenvalue`` (1/s)."""
    values = linear.eigenvalues(speed)
    return complex(values[int(np.argmin(np.abs(values - eigenvalue)))])


def solve(settings: Settings, case: TyreCase, setup: Setup) -> Result:
    """Modes over the study's speeds, frequency and damping ratio at its report speed, critical speeds, with sd.

    Raises
    ------
    InputError
        The bicycle and this tyre make no model, or one that cannot be computed.
    """
    built = model(settings, setup, case.contact)
    linear = built.linear_model()
    names, whole = spread(settings, case, setup)
    covariances = (whole, within(names, tyre_spread(case)))
    found = modes(linear, np.append(settings.speeds, settings.report_speed))
    roots = oscillations(found, -1)
    gradients = mode_gradients(built, settings.report_speed, list(roots.values()), names)
    sds = [[standard_deviation(one, covariance).tolist() for covariance in covariances] for one in gradients]
    frequency, damping = {}, {}
    for k, (mode, root) in enumerate(roots.items()):
        frequency[mode] = Uncertain(float(frequency_hz(root)), *(sd[k] for sd in sds[0]))
        damping[mode] = Uncertain(float(damping_ratio(root)), *(sd[k] for sd in sds[1]))
    critical = critical_speeds(linear, max_speed=settings.max_speed)
    slopes = critical_speed_gradients(built, critical, names)
    moved = [standard_deviation(slopes, covariance).tolist() for covariance in covariances]
    crossings = [
        UncertainCriticalSpeed(**vars(crossing), sd=sd, tyre_sd=tyre_sd)
        for crossing, sd, tyre_sd in zip(critical, *moved, strict=True)
    ]
    return Result(case, setup, found, tuple(crossings), frequency, damping, least_damped(found))


def least_damped(found: Modes) -> LeastDamped | None:
    """The least damped wobble at the speeds that are ridden; None where there is none."""
    ridden = (found.speeds >= RIDDEN[0]) & (found.speeds <= RIDDEN[1])
    best: LeastDamped | None = None
    for name, values in found.branches.items():
        slowest = 0.0 if name == WOBBLE else angular_frequency(FASTER_THAN_WEAVE)
        if WOBBLE not in name.split("+"):
            continue
        for speed, root in zip(found.speeds[ridden], values[ridden, 0], strict=True):
            if root.imag > slowest:
                one = LeastDamped(complex(root), float(speed))
                best = one if best is None or one.damping_ratio < best.damping_ratio else best
    return best


def oscillations(found: Modes, row: int) -> dict[str, complex]:
    """Eigenvalues (1/s, upper half) of the compared modes where they oscillate, at the speed with index ``row``."""
    values = {name: complex(found.branches[name][row, 0]) for name in COMPARED_MODES if name in found.branches}
    return {name: value for name, value in values.items() if value.imag > 0}
