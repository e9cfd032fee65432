"""Critical speeds: where a root of a model crosses the imaginary axis, of one bicycle or of many."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from bicycle.equations.speed_polynomial import SpeedPolynomial
from bicycle.model.eigen import angular_frequency, decompose, frequency_hz
from bicycle.model.model import Model, as_linear
from bicycle.model.model_family import ModelFamily
from bicycle.model.state_space import LinearModel
from bicycle.stability.crossing_search import find_crossings
from bicycle.stability.naming import Rules, check_trackable, find_untrackable, name_points, speed_unit, stack_of_one
from bicycle.stability.tracking import assign_sets
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError

OSCILLATORY, REAL = "oscillatory", "real"
DESTABILISING, STABILISING = "destabilising", "stabilising"


class CrossingIdentity(NamedTuple):
    """Which crossing it is, whatever its speed: the mode, which way, and its number among these from slow to fast."""

    mode: str  # its name
    destabilising: bool  # it is unstable above the speed
    occurrence: int = 1  # 1 for the slowest

    def __str__(self) -> str:
        number = f" ({self.occurrence})" if self.occurrence > 1 else ""
        return f"{self.mode} {'unstable' if self.destabilising else 'stable'} above{number}"


@dataclass(frozen=True)
class CriticalSpeed:
    """A speed at which a mode changes its stability.

    Attributes
    ----------
    speed : float
        m/s.
    kind : str
        ``oscillatory`` (a pair crosses the imaginary axis) or ``real`` (a real root crosses zero).
    mode : str
        Name as in :func:`bicycle.stability.named_modes.modes`; empty as long as it is not known.
    frequency_hz : float
        Of the crossing pair, Hz; 0 for a real root.
    direction : str
        What happens to that root as the speed grows: ``stabilising`` or ``destabilising``.
    bifurcation : str, optional
        How the motion begins on tyres that saturate: ``supercritical``, ``subcritical`` or ``not determined``, see
        :class:`bicycle.motion.limit_cycles.Onset`; None of a real root and where it was not looked at.
    """

    speed: float
    kind: str
    mode: str
    frequency_hz: float
    direction: str
    bifurcation: str | None = field(default=None, kw_only=True)

    @classmethod
    def of_root(cls, *, speed: float, root: complex, destabilising: bool, mode: str = "") -> "CriticalSpeed":
        """A root on the axis at ``speed`` (m/s): ``root`` (1/s), ``destabilising`` or not, with the name ``mode``."""
        kind = OSCILLATORY if root.imag else REAL
        hertz = abs(float(frequency_hz(root)))
        return cls(float(speed), kind, mode, hertz, DESTABILISING if destabilising else STABILISING)

    def __repr__(self) -> str:
        oscillation = f" at {self.frequency_hz:.4g} Hz" if self.oscillatory else ", a real root"
        return f"<CriticalSpeed {self.speed:.6g} m/s: {self.mode} {self.direction}{oscillation}>"

    @property
    def oscillatory(self) -> bool:
        """True if a pair crosses, False if a real root does."""
        return self.kind == OSCILLATORY

    @property
    def destabilising(self) -> bool:
        """True if the mode loses its stability as the speed grows."""
        return self.direction == DESTABILISING

    @property
    def angular_frequency(self) -> float:
        """Imaginary part of the crossing root, rad/s; 0 for a real root."""
        return float(angular_frequency(self.frequency_hz))

    @property
    def unstable_roots(self) -> int:
        """By how much the number of unstable roots grows here: +-2 for a pair, +-1 for a real root."""
        return (2 if self.oscillatory else 1) * (1 if self.destabilising else -1)

    def rename(self, mode: str) -> "CriticalSpeed":
        """Return this crossing under the name ``mode``."""
        return replace(self, mode=mode)


ACriticalSpeed = TypeVar("ACriticalSpeed", bound=CriticalSpeed)


def by_identity(crossings: Iterable[ACriticalSpeed]) -> dict[CrossingIdentity, ACriticalSpeed]:
    """Critical speeds of one model by their identity, in the order given, which is from slow to fast."""
    count = Counter[tuple[str, bool]]()
    identities = {}
    for crossing in crossings:
        key = (crossing.mode, crossing.destabilising)
        count[key] += 1
        identities[CrossingIdentity(*key, count[key])] = crossing
    return identities


def critical_speeds(model: Model | LinearModel, max_speed: float = 60.0) -> tuple[CriticalSpeed, ...]:
    """All speeds 0 < v <= max_speed at which a root crosses the imaginary axis, by speed.

    A root that only touches the axis is not listed. Where the equations switch at a speed, a root that jumps across
    the axis there is listed at that speed, with kind and frequency of the root above it.

    Parameters
    ----------
    model : Model or LinearModel
        A bicycle with its effects, or its linear model.
    max_speed : float
        m/s.

    Returns
    -------
    tuple of CriticalSpeed
        :func:`by_identity` matches them with those of another model.

    Raises
    ------
    InputError
        ``max_speed`` is not a positive finite number or too high, or the model is too stiff.
    """
    model = as_linear(model)
    _check_max_speed(max_speed)
    check_trackable(model, np.array([max_speed]), "max_speed")
    unit = np.array([speed_unit(model)])
    rules = Rules.of(model)
    crossings: list[CriticalSpeed] = []
    for number, at in enumerate(model.ranges):
        if at.lower < max_speed:
            stack = stack_of_one(model, number)
            limits = np.array([[at.lower, min(at.upper, max_speed)]])
            (in_range,) = crossings_of(rules, stack, unit, model.parameters["g"], limits)
            crossings += in_range
    crossings += _jumps(model, rules, max_speed)
    return tuple(sorted(crossings, key=lambda c: (c.speed, c.frequency_hz)))


def critical_speeds_of_many(
    family: ModelFamily, numbers: Mapping[str, Any], count: int, max_speed: float = 60.0
) -> tuple[list[tuple[CriticalSpeed, ...]], dict[int, str]]:
    """Critical speeds of each of ``count`` bicycles as :func:`critical_speeds` finds them, all at once.

    ``numbers``, shape () or (count,), are as in :meth:`ModelFamily.values`. The second part of the result states why
    those of a bicycle (its number) cannot be computed; its tuple in the first is empty.
    """
    _check_max_speed(max_speed)
    critical: list[tuple[CriticalSpeed, ...]] = [()] * count
    reasons: dict[int, str] = {}
    columns = {key: np.broadcast_to(number, count) for key, number in numbers.items()}
    values = family.values(columns)

    def linear(number: int) -> LinearModel:
        return family.linear_model({key: float(np.broadcast_to(x, count)[number]) for key, x in values.items()})

    gravity, wheelbase = (np.broadcast_to(np.asarray(values[key], float), count) for key in "gw")
    polynomial, bad = None, np.ones(count, bool)
    if not family.evaluate.symbolic.switches:
        polynomial, bad = family.polynomials(columns, count)
        bad |= find_untrackable(polynomial, gravity, wheelbase, max_speed)
    for number in np.flatnonzero(bad).tolist():  # equations that switch, and to say what is wrong
        try:
            critical[number] = critical_speeds(linear(number), max_speed)
        except InputError as error:
            reasons[number] = str(error)
    good = np.flatnonzero(~bad)
    if good.size and polynomial is not None:
        unit = np.sqrt(gravity * wheelbase)[good]
        limits = np.broadcast_to([0.0, max_speed], (len(good), 2))
        rules = Rules.of(linear(int(good[0])))
        stack = polynomial.take(good)
        for number, crossings in zip(
            good.tolist(), crossings_of(rules, stack, unit, gravity[good], limits), strict=True
        ):
            critical[number] = tuple(crossings)
    return critical, reasons


def _check_max_speed(max_speed: float) -> None:
    if not (np.isfinite(max_speed) and max_speed > 0):
        raise InputError(f"max_speed = {max_speed!r} m/s is not allowed; give a finite speed > 0 m/s")


def crossings_of(
    rules: Rules, polynomial: SpeedPolynomial, unit: Array, gravity: float | Array, limits: Array
) -> list[list[CriticalSpeed]]:
    """Named crossings of bicycles A(v), with sqrt(g w) = ``unit`` (m,), in ``limits`` (m, 2), m/s; of each by speed."""
    zeros = find_crossings(polynomial, unit, limits)
    result: list[list[CriticalSpeed]] = [[] for _ in unit]
    if not len(zeros.speed):
        return result
    named = name_points(rules, polynomial, unit, gravity, zeros.owner, zeros.speed)
    place = np.abs(named.values - 1j * zeros.omega[:, None]).argmin(1)[:, None]
    first, second = (np.take_along_axis(x, place, 1)[:, 0].tolist() for x in (named.first, named.second))
    for k, bicycle in enumerate(zeros.owner.tolist()):
        result[bicycle].append(
            CriticalSpeed.of_root(
                speed=zeros.speed[k],
                root=1j * zeros.omega[k],
                destabilising=bool(zeros.slope[k].real > 0),
                mode=rules.name(first[k], second[k]),
            )
        )
    return result


def _jumps(model: LinearModel, rules: Rules, max_speed: float) -> list[CriticalSpeed]:
    """Roots that jump across the axis where the equations switch, under the name that they have below."""
    jumps = []
    unit, owner = np.array([speed_unit(model)]), np.array([0])
    for number, (lower, _) in enumerate(pairwise(model.ranges)):
        if lower.upper > max_speed:
            continue
        v = np.array([lower.upper])
        stacks = (stack_of_one(model, k) for k in (number, number + 1))
        sides = [name_points(rules, stack, unit, model.parameters["g"], owner, v) for stack in stacks]
        before, after = sides[0].values, sides[1].values
        after = np.take_along_axis(after, assign_sets(before, after), 1)
        was, is_ = (x.real[0] > 1e-12 * np.abs(x).max() for x in (before, after))
        for i in np.flatnonzero((was != is_) & (after.imag[0] >= 0)):
            mode = rules.name(int(sides[0].first[0, i]), int(sides[0].second[0, i]))
            root = 1j * after[0, i].imag
            jumps.append(CriticalSpeed.of_root(speed=v[0], root=root, destabilising=bool(is_[i]), mode=mode))
    return jumps


def follow_crossing(
    polynomials: SpeedPolynomial, speeds: Array, angular_frequency: Array, *, destabilising: bool
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Speeds (m,) at which one root of each bicycle crosses the imaginary axis, by Newton from where it is expected."""
    v, root = speeds.copy(), 1j * angular_frequency
    size, current, slope = np.zeros(len(v)), np.zeros(len(v), complex), np.zeros(len(v), complex)
    moving = np.arange(len(v))
    for _ in range(25):
        values, slopes, _, _ = decompose(polynomials.take(moving), v[moving])
        at = np.abs(values - root[moving, None]).argmin(1)[:, None]
        current[moving], slope[moving] = (np.take_along_axis(part, at, 1)[:, 0] for part in (values, slopes))
        size[moving] = np.abs(values).max(1)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = -current[moving].real / slope[moving].real
        longest = 0.1 * v[moving]
        step = np.where(np.isfinite(step), np.clip(step, -longest, longest), 0.0)
        v[moving], root[moving] = v[moving] + step, current[moving] + slope[moving] * step
        moving = moving[np.abs(step) > 1e-13 * v[moving]]
        if not moving.size:
            break
    kind = np.where(angular_frequency > 0, current.imag > 1e-9 * size, np.abs(current.imag) <= 1e-9 * size)
    converged = kind & (np.abs(current.real) <= 1e-9 * size) & ((slope.real > 0) == destabilising)
    return v, np.abs(current.imag), converged
