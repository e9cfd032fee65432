"""Speeds at which the handlebar shakes by itself: bands between critical speeds of wobble.

Wobble is what tracking calls so: the pair of the front turning about the steer axis. Its frequency alone does not tell
it from weave: without a rider weave reaches 6 Hz, and heavy arms slow wobble to 4 Hz. Only where the two cannot be told
apart, and tracking gives both names, the frequency decides.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from bicycle.linear_model import LinearModel

WOBBLE, WEAVE = "wobble", "weave"
KMH = 3.6  # km/h per m/s
FASTER_THAN_WEAVE = 4.0  # Hz: weave is at 1 to 4 Hz, wobble at 4 to 10 Hz
SLOWER_THAN_TYRES = 15.0  # Hz: near rest the wheels vibrate on their tyres at 16 to 20 Hz
NEAR_REST = 1e-3  # of the highest speed looked at; at rest a bicycle without damping is neutral


class Edge(Protocol):
    """A critical speed."""

    @property
    def mode(self) -> str:
        """Name."""

    @property
    def kind(self) -> str:
        """``oscillatory`` or ``real``."""

    @property
    def direction(self) -> str:
        """``destabilising`` or ``stabilising``."""

    @property
    def speed(self) -> float:
        """m/s."""

    @property
    def frequency_hz(self) -> float:
        """Hz."""


AnEdge = TypeVar("AnEdge", bound=Edge)


@dataclass(frozen=True)
class Crossing:
    """A critical speed (m/s): where ``mode`` becomes stable or unstable; frequency in Hz.

    ``sd`` is of the tyre data and the bicycle, ``tyre_sd`` of the tyre data alone.
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


def is_wobble(edge: Edge) -> bool:
    """Whether wobble begins or ends at a critical speed."""
    if edge.kind != "oscillatory" or WOBBLE not in edge.mode.split("+") or edge.frequency_hz >= SLOWER_THAN_TYRES:
        return False
    return edge.mode == WOBBLE or edge.frequency_hz >= FASTER_THAN_WEAVE


def wobble_edges(edges: Iterable[AnEdge]) -> list[AnEdge]:
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


def wobble_span(linear: LinearModel, edges: Iterable[Edge], limit: float) -> Span | None:
    """Unstable wobble up to ``limit`` (m/s), from its first onset to its last end; None where there is none."""
    mine = [edge for edge in wobble_edges(edges) if edge.speed <= limit]
    if not mine:
        throughout = all(grows_fast(linear, speed) for speed in (NEAR_REST * limit, limit))
        return Span(0.0, math.inf, limit) if throughout else None
    first, last = mine[0], mine[-1]
    return Span(
        float(first.speed) if first.direction == "destabilising" else 0.0,
        math.inf if last.direction == "destabilising" else float(last.speed),
        limit,
    )


def grows_fast(linear: LinearModel, speed: float) -> bool:
    """Whether an oscillation as fast as wobble grows at a ``speed`` (m/s)."""
    values = linear.eigenvalues(speed)
    hertz = values.imag / (2 * np.pi)
    return bool(((values.real > 0) & (hertz >= FASTER_THAN_WEAVE) & (hertz < SLOWER_THAN_TYRES)).any())


def unstable_bands(crossings: Sequence[Crossing]) -> list[Band]:
    """Pair the crossings of one mode into bands of instability."""
    bands: list[Band] = []
    start: Crossing | None = None
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
