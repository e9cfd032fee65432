"""Terms of the residual torque: which torque, linear in which state, with which power of the speed."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bicycle.effect import effect_class
from studies.inference.parameter import Candidate, UncertainParameter
from tyre.base.arrays import Array
from tyre.base.errors import InputError

EFFECT = "residual_torque"
TORQUES = ("steer", "lean")
STATES = ("lean", "steer", "lean_rate", "steer_rate")
DEGREES = ("", "_slope", "_curve")
CHANGES = (1.0, 0.5, 0.5)  # prior sd of constant, change over half the speed range and curvature, in usual sizes
LEAST_SPAN = 0.1  # of the middle speed; speeds that lie closer are one

Pair = tuple[str, str]
Degrees = Mapping[Pair, int]
"""How many terms of each pair of torque and state there are: 1 constant, 2 linear, 3 quadratic in the speed."""

PAIRS: tuple[Pair, ...] = tuple((torque, state) for torque in TORQUES for state in STATES)


@dataclass(frozen=True)
class SpeedScale:
    """The coordinate x = (v - middle) / span in which coefficients change with the speed v, m/s.

    Attributes
    ----------
    middle, span : float
        m/s.
    most : int
        Most terms of a pair that the number of distinct speeds allows.
    """

    middle: float
    span: float
    most: int

    @classmethod
    def of(cls, speeds: ArrayLike) -> "SpeedScale":
        """Of measured ``speeds`` (n,), m/s."""
        v = np.unique(np.asarray(speeds, float))
        middle, half = float(v[0] + v[-1]) / 2, float(v[-1] - v[0]) / 2
        distinct = 1 + int((np.diff(v) > LEAST_SPAN / 2 * v[1:]).sum())
        return cls(middle, max(half, LEAST_SPAN * middle), min(distinct, len(DEGREES)))

    @property
    def ends(self) -> tuple[float, float]:
        """The slowest and the fastest measured speed, m/s."""
        return self.middle - self.span, self.middle + self.span

    def powers(self, speeds: ArrayLike) -> Array:
        """1, x, x^2 at ``speeds`` (..., ), m/s: (..., 3)."""
        x = (np.asarray(speeds, float) - self.middle) / self.span
        return np.stack([np.ones_like(x), x, x**2], -1)


def name_of(pair: Pair, degree: int) -> str:
    """Parameter of the effect: of a ``pair`` and a power of the speed, the number ``degree`` from 0 to 2."""
    return f"{pair[0]}_from_{pair[1]}{DEGREES[degree]}"


def unknown(pair: Pair, degree: int) -> UncertainParameter:
    """The coefficient of a ``pair`` and a power of the speed, the number ``degree`` from 0 to 2, with its prior.

    The usual size of the effect's declaration is one standard deviation.
    """
    name = name_of(pair, degree)
    declared = next(p for p in effect_class(EFFECT).parameters if p.name == name)
    scale = declared.typical[1] * CHANGES[degree]
    return UncertainParameter(name, declared.unit, {f"{EFFECT}.{name}": 1.0}, 0.0, scale, size=True)


def keys(degrees: Degrees) -> tuple[tuple[Pair, int], ...]:
    """The terms of ``degrees``, in a fixed order."""
    return tuple((pair, k) for pair in PAIRS for k in range(degrees.get(pair, 0)))


def candidate(degrees: Degrees, scale: SpeedScale) -> Candidate:
    """The residual torque with some terms, ready to join a hypothesis; its name tells the terms.

    Parameters
    ----------
    degrees : mapping
        Number of terms by pair.
    scale : SpeedScale
    """
    effect = effect_class(EFFECT)
    fixed = {f"{EFFECT}.{p.name}": 0.0 for p in effect.parameters}
    fixed |= {f"{EFFECT}.middle_speed": scale.middle, f"{EFFECT}.speed_span": scale.span}
    unknowns = tuple(unknown(*key) for key in keys(degrees))
    shown = ", ".join(f"{torque} from {state} {degrees[torque, state]}" for torque, state in PAIRS
                      if degrees.get((torque, state)))  # fmt: skip
    return Candidate(f"residual torque ({shown})", unknowns, effect=effect, fixed=fixed)


def check_absent(effects: tuple[object, ...]) -> None:
    """Refuse a base model with ``effects`` that hold a residual torque already.

    Raises
    ------
    InputError
        One does: two in one model could not be told apart.
    """
    if any(getattr(effect, "identifier", "") == EFFECT for effect in effects):
        raise InputError(f"the base model has [effects.{EFFECT}] already; take it out to fit it anew")
