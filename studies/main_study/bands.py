"""Speeds at which the handlebar shakes by itself: bands between critical speeds of wobble.

Wobble is what tracking calls so: the pair of the front turning about the steer axis. Its frequency alone does not tell
it from weave: without a rider weave reaches 6 Hz, and heavy arms slow wobble to 4 Hz. Only where the two cannot be told
apart, and tracking gives both names, the frequency decides.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from bicycle.critical.critical_speed import ACriticalSpeed, CriticalSpeed
from bicycle.eigenvalues.oscillation import frequency_hz
from bicycle.linear_model import LinearModel

WOBBLE, WEAVE = "wobble", "weave"
KMH = 3.6  # km/h per m/s
FASTER_THAN_WEAVE = 4.0  # Hz: weave is at 1 to 4 Hz, wobble at 4 to 10 Hz
SLOWER_THAN_TYRES = 15.0  # Hz: near rest the wheels vibrate on their tyres at 16 to 20 Hz
NEAR_REST = 1e-3  # of the highest speed looked at; at rest a bicycle without damping is neutral


@dataclass(frozen=True)
class UncertainCriticalSpeed(CriticalSpeed):
    """A critical speed with standard deviations (m/s): of tyre data and bicycle, and of the tyre data alone."""

    sd: float
    tyre_sd: float

    @property
    def value(self) -> float:
        """The speed, m/s."""
        return self.speed


@dataclass(frozen=True)
class Band:
    """Speeds in which a mode is unstable; None: it begins below, or goes on above, the speeds looked at."""

    start: UncertainCriticalSpeed | None
    end: UncertainCriticalSpeed | None


def is_wobble(edge: CriticalSpeed) -> bool:
    """Whether wobble begins or ends at a critical speed."""
    if not edge.oscillatory or WOBBLE not in edge.mode.split("+") or edge.frequency_hz >= SLOWER_THAN_TYRES:
        return False
    return edge.mode == WOBBLE or edge.frequency_hz >= FASTER_THAN_WEAVE


def wobble_edges(edges: Iterable[ACriticalSpeed]) -> list[ACriticalSpeed]:
    """Critical speeds at which wobble begins or ends, rising."""
    return sorted((edge for edge in edges if is_wobble(edge)), key=lambda edge: edge.speed)


@dataclass(frozen=True)
class Span:
    """Unstable wobble from its first onset to its last end, m/s; from 0 at rest on, to infinity beyond ``limit``."""

    low: float
    high: float
    limit: float

    @property
    def words(self) -> str:
        """``from 3.2 to 29.0 m/s (11 to 104 km/h)``."""
        low, high = self.low, self.high
        if math.isinf(high):
            beyond, kmh = f"beyond {self.limit:.1f} m/s", f"beyond {KMH * self.limit:.0f} km/h"
            return f"from rest to {beyond}" if low == 0 else f"from {low:.1f} to {beyond} ({KMH * low:.0f} to {kmh})"
        if low == 0:
            return f"up to {high:.1f} m/s ({KMH * high:.0f} km/h)"
        return f"from {low:.1f} to {high:.1f} m/s ({KMH * low:.0f} to {KMH * high:.0f} km/h)"


def wobble_span(linear: LinearModel, edges: Iterable[CriticalSpeed], limit: float) -> Span | None:
    """Unstable wobble up to ``limit`` (m/s), from its first onset to its last end; None where there is none."""
    mine = [edge for edge in wobble_edges(edges) if edge.speed <= limit]
    if not mine:
        throughout = all(grows_fast(linear, speed) for speed in (NEAR_REST * limit, limit))
        return Span(0.0, math.inf, limit) if throughout else None
    first, last = mine[0], mine[-1]
    return Span(
        float(first.speed) if first.destabilising else 0.0,
        math.inf if last.destabilising else float(last.speed),
        limit,
    )


def grows_fast(linear: LinearModel, speed: float) -> bool:
    """Whether an oscillation as fast as wobble grows at a ``speed`` (m/s)."""
    values = linear.eigenvalues(speed)
    hertz = frequency_hz(values)
    return bool(((values.real > 0) & (hertz >= FASTER_THAN_WEAVE) & (hertz < SLOWER_THAN_TYRES)).any())


def unstable_bands(crossings: Sequence[UncertainCriticalSpeed]) -> list[Band]:
    """Pair the crossings of one mode into bands of instability."""
    bands: list[Band] = []
    start: UncertainCriticalSpeed | None = None
    inside = False
    for crossing in sorted(crossings, key=lambda c: c.speed):
        if crossing.destabilising:
            start, inside = crossing, True
        elif inside or not bands:
            bands.append(Band(start, crossing))
            start, inside = None, False
    if inside:
        bands.append(Band(start, None))
    return bands
