"""What is read on a standing bicycle: deflections under loads, and vibrations after a tap."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tyre.ground.arrays import Array

CERTAIN = 3.4  # sd of a difference beyond which it is no chance
LEAST_CHANGE = 1.2  # damping ratio of the rest over that of the beginning


@dataclass(frozen=True)
class Place:
    """A point of the bicycle on a line along the steer axis: through the hub on the wheel, else on the axis itself."""

    above_hub: float  # m, along the steer axis, negative below the hub
    on: str = "wheel"  # wheel, fork (with stem and handlebar) or frame

    @property
    def is_axle(self) -> bool:
        """True of the hub itself, whose place needs no measuring."""
        return self.above_hub == 0.0


@dataclass(frozen=True)
class Deflection:
    """A deflection under a lateral load, both positive to one side."""

    force: float  # N
    loaded: Place
    read: Place
    value: float  # m, negative where the front moves against the load
    sd: float  # m, of the gauge


@dataclass(frozen=True)
class Ratio:
    """Motion of one place over that of another in a vibration, negative where they move against each other."""

    read: Place
    over: Place
    value: float
    sd: float
    imaginary: float = math.nan  # of the complex ratio, with the same sd; NaN: not measured


@dataclass(frozen=True)
class DampingChange:
    """Damping ratio of the beginning of a vibration and of its rest: alike if it decays exponentially."""

    early: float
    late: float
    sd: float  # of the difference

    @property
    def certain(self) -> bool:
        """True if the rest is damped more, beyond chance: dry friction, or a joint that rubs."""
        return self.late > LEAST_CHANGE * self.early and self.late - self.early > CERTAIN * self.sd


@dataclass(frozen=True)
class Tap:
    """A vibration after a tap, with the mass that was added for it."""

    name: str  # of its recording, or its line in a table
    frequency_hz: float  # Hz, |eigenvalue| / 2 pi
    frequency_sd_hz: float  # Hz
    damping_ratio: float = math.nan  # -real part / |eigenvalue|; NaN: not measured
    damping_ratio_sd: float = math.nan
    ratios: tuple[Ratio, ...] = ()
    added_mass: float = 0.0  # kg
    added: Place = field(default_factory=lambda: Place(0.0))  # of the added mass
    vibration: int = 1  # number of the vibration where one tap leaves two, the slower first
    change: DampingChange | None = None  # None: not a recording, or too short

    @property
    def arrangement(self) -> tuple[object, ...]:
        """What taps that repeat each other have in common."""
        pairs = tuple((ratio.read, ratio.over, math.isnan(ratio.imaginary)) for ratio in self.ratios)
        return self.added_mass, self.added, pairs, math.isnan(self.damping_ratio), self.vibration

    @property
    def angle(self) -> float:
        """Angle (rad) of the eigenvalue beyond the imaginary axis; NaN if no damping ratio was measured."""
        return math.asin(min(max(self.damping_ratio, 0.0), 1.0)) if not math.isnan(self.damping_ratio) else math.nan


@dataclass(frozen=True)
class Errors:
    """Standard uncertainties of what all readings have in common."""

    load: float = 0.005  # relative, of each weight
    place: float = 0.003  # m, of each place but the hub
    gain: float = 0.01  # relative, between two sensors of a ratio


@dataclass(frozen=True)
class Readings:
    """Everything that was read on one bicycle with its rear frame held and its front wheel in the air.

    Under a seated rider the rear wheel is on the ground, and the frame yaws and leans with the rider in the taps.
    Deflections are read with the frame held.
    """

    deflections: tuple[Deflection, ...] = ()
    taps: tuple[Tap, ...] = ()
    bar_free: bool = False  # the handlebar may turn in the taps
    on_side: bool = False  # the bicycle lies on its side
    errors: Errors = field(default_factory=Errors)
    seated: bool = False  # a rider sits on the saddle, and nothing else holds the frame
    axle_held: bool = False  # the rear axle is held, not the main frame

    @property
    def loads(self) -> tuple[float, ...]:
        """Loads (N) whose weights differ."""
        return tuple(dict.fromkeys(abs(deflection.force) for deflection in self.deflections))

    @property
    def places(self) -> tuple[Place, ...]:
        """Places that were measured off, each once."""
        return tuple(dict.fromkeys(place for place in self._all_places() if not place.is_axle))

    @property
    def pairs(self) -> tuple[tuple[Place, Place], ...]:
        """Pairs of sensors whose ratio was read."""
        return tuple(dict.fromkeys((ratio.read, ratio.over) for tap in self.taps for ratio in tap.ratios))

    @property
    def damped(self) -> bool:
        """True if a damping ratio was measured."""
        return any(not math.isnan(tap.damping_ratio) for tap in self.taps)

    @property
    def reads_frame(self) -> bool:
        """True if the rear frame was read as well: only that shows whether it was held."""
        return any(deflection.read.on == "frame" for deflection in self.deflections) or any(
            ratio.read.on == "frame" for tap in self.taps for ratio in tap.ratios
        )

    @property
    def change(self) -> DampingChange | None:
        """Mean change of damping over the taps, if it is certain."""
        changes = [tap.change for tap in self.taps if tap.change is not None]
        mean = mean_change(changes)
        return mean if mean is not None and mean.certain else None

    def numbers(self) -> tuple[Array, Array]:
        """Measured numbers (n,) and their sd: deflections in m; of each tap Hz, damping ratio, parts of ratios."""
        pairs = [(deflection.value, deflection.sd) for deflection in self.deflections]
        for tap in self.taps:
            pairs.append((tap.frequency_hz, tap.frequency_sd_hz))
            pairs.append((tap.damping_ratio, tap.damping_ratio_sd))
            for ratio in tap.ratios:
                pairs += [(ratio.value, ratio.sd), (ratio.imaginary, ratio.sd)]
        measured = np.array(pairs, float).reshape(-1, 2)
        return measured[:, 0], measured[:, 1]

    def merge_alike(self) -> "Readings":
        """Copy in which taps of one arrangement are one tap, their means by the weights 1/sd^2."""
        groups: dict[tuple[object, ...], list[Tap]] = {}
        for tap in self.taps:
            groups.setdefault(tap.arrangement, []).append(tap)
        return replace(self, taps=tuple(_mean_tap(taps) for taps in groups.values()))

    def _all_places(self) -> Iterable[Place]:
        for deflection in self.deflections:
            yield from (deflection.loaded, deflection.read)
        for tap in self.taps:
            if tap.added_mass:
                yield tap.added
            for ratio in tap.ratios:
                yield from (ratio.read, ratio.over)


def mean_change(changes: Sequence[DampingChange]) -> DampingChange | None:
    """Mean of the changes by the weights 1/sd^2, its sd widened by their scatter; None without any."""
    if not changes:
        return None
    weights = np.array([1 / one.sd**2 for one in changes])
    early, late = (weights @ [getattr(one, name) for one in changes] / weights.sum() for name in ("early", "late"))
    scatter = weights @ [(one.late - one.early - late + early) ** 2 for one in changes]
    widened = max(1.0, scatter / max(len(changes) - 1, 1))
    return DampingChange(float(early), float(late), float(np.sqrt(widened / weights.sum())))


def _mean_tap(taps: Sequence[Tap]) -> Tap:
    """Mean of taps of one arrangement."""
    first = taps[0]
    frequency, frequency_sd_hz = _weighted_mean([(tap.frequency_hz, tap.frequency_sd_hz) for tap in taps])
    damping, damping_sd = _weighted_mean([(tap.damping_ratio, tap.damping_ratio_sd) for tap in taps])
    ratios = []
    for k, ratio in enumerate(first.ratios):
        value, sd = _weighted_mean([(tap.ratios[k].value, tap.ratios[k].sd) for tap in taps])
        imaginary, _ = _weighted_mean([(tap.ratios[k].imaginary, tap.ratios[k].sd) for tap in taps])
        ratios.append(replace(ratio, value=value, sd=sd, imaginary=imaginary))
    return replace(
        first,
        frequency_hz=frequency,
        frequency_sd_hz=frequency_sd_hz,
        damping_ratio=damping,
        damping_ratio_sd=damping_sd,
        ratios=tuple(ratios),
    )


def _weighted_mean(pairs: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Mean of pairs (value, sd) by the weights 1/sd^2, and its sd."""
    values, sds = np.array(pairs).T
    weights = 1 / sds**2
    return float(weights @ values / weights.sum()), float(1 / np.sqrt(weights.sum()))
