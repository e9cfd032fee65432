"""What the main study is asked: a bicycle, the worlds it is put into, and how far its assumed front may be off."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bicycle.parameters import Bicycle
from tyre.base.arrays import Array

Table = Mapping[str, Any]
CONTACT_LENGTH = "contact_length"  # the effect
CAMBER_SHARE = 0.65  # 1/rad, the middle of what Dressel (2013) measured, 0.0075 to 0.015 of the load per degree
CAMBER_RANGE = (0.43, 0.86)  # 1/rad, the ends


@dataclass(frozen=True)
class Front:
    """A flexible front: hinge at ``joint_height`` (m) where the steer axis passes it, SI units.

    ``joint_x`` (m) and ``axis_tilt`` (rad) are None where nothing is known: on the steer axis, across it. ``friction``
    (N m s/rad) is that of the steering, written as damping. ``given`` is whether a model file says so.
    """

    stiffness: float = 5000.0
    damping: float = 20.0
    joint_height: float = 0.65
    joint_x: float | None = None
    axis_tilt: float | None = None
    friction: float = 0.0
    given: bool = False

    def hinge_x(self, p: Table) -> Any:
        """Where the hinge is, m before the rear contact of a parameter set."""
        if self.joint_x is not None:
            return self.joint_x
        return p["w"] + p["c"] - self.joint_height * np.tan(p["lam"])

    @property
    def words(self) -> str:
        """As a report says it."""
        return (
            f"a hinge {self.joint_height:.2f} m above the ground, {self.stiffness:g} N m/rad, "
            f"{self.damping:g} N m s/rad"
        )


@dataclass(frozen=True)
class Arms:
    """Both hands on the bar: what the arms add to the steering, SI units (effect ``rider_arms``).

    The inertia is what two hands, forearms and part of the upper arms weigh at half the width of a bar: 1.2 kg a side
    (a forearm with hand is 2.2 % of the body, an upper arm 2.8 %; Winter, Biomechanics and Motor Control of Human
    Movement) at 0.2 m is 0.1 kg m^2. Stiffness and damping are assumed, at the relaxed end of the range the effect
    declares.
    """

    inertia: float = 0.1
    stiffness: float = 5.0
    damping: float = 1.0
    given: bool = False


@dataclass(frozen=True)
class Ranges:
    """Plausible values of what nobody measured: (low, high) of each, SI; ``hinge`` and ``friction`` as shifts.

    What is above zero at both ends is spread evenly in its logarithm, the others evenly.
    """

    stiffness: tuple[float, float] = (2500.0, 10000.0)
    damping: tuple[float, float] = (5.0, 40.0)
    hinge: tuple[float, float] = (-0.1, 0.1)
    friction: tuple[float, float] = (0.0, 1.0)
    camber_share: tuple[float, float] = CAMBER_RANGE
    arm_inertia: tuple[float, float] = (0.05, 0.2)
    arm_stiffness: tuple[float, float] = (0.0, 30.0)
    arm_damping: tuple[float, float] = (0.2, 3.0)

    @classmethod
    def of(cls, front: Front, arms: Arms, *, camber_given: bool, friction_given: bool) -> "Ranges":
        """The ranges around what is assumed; what a model file gives is known to a fifth.

        ``camber_given`` and ``friction_given`` say whether it gives camber thrust and friction of the steering.
        """
        found: dict[str, tuple[float, float]] = {}
        if front.given:
            found |= {"stiffness": around(front.stiffness), "damping": around(front.damping), "hinge": (-0.02, 0.02)}
        if arms.given:
            found |= {f"arm_{name}": around(getattr(arms, name)) for name in ("inertia", "stiffness", "damping")}
        if camber_given:
            found["camber_share"] = around(1.0)
        if friction_given:
            found["friction"] = (0.0, 0.0)
        return cls(**found)


def around(value: float) -> tuple[float, float]:
    """A fifth of ``value`` (any unit) to both sides."""
    return 0.8 * value, 1.25 * value


@dataclass(frozen=True)
class Setup:
    """What is beside the tyre: a flexible front (None: rigid), hands on the bar (None: off), and the tyre's extras.

    ``camber_share`` is the camber stiffness over the load, 1/rad; ``contact_half_length`` (m) that of the contact of
    rear and front wheel, None for a tyre that answers with a single lag.
    """

    front: Front | None
    arms: Arms | None = None
    camber_share: float = CAMBER_SHARE
    contact_half_length: tuple[float, float] | None = None

    @property
    def front_name(self) -> str:
        """``rigid`` or ``flexible``."""
        return "flexible" if self.front else "rigid"

    @property
    def hands(self) -> str:
        """``on`` or ``off``."""
        return "on" if self.arms else "off"

    @property
    def label(self) -> str:
        """As a heading."""
        return f"hands {self.hands}, {self.front_name} front"

    @property
    def words(self) -> str:
        """In a sentence."""
        return f"hands {self.hands} and a {self.front_name} front"


@dataclass(frozen=True)
class Settings:
    """One main study.

    Attributes
    ----------
    bicycle : Bicycle
    further : mapping
        Tables of effects that every world has, as in a model file; what it says of camber thrust replaces the
        assumption.
    tyres : tuple of str
        Files of tyre tables that are studied beside the packaged tyres; the question is about the first.
    pressures : tuple of float
        Inflation pressures to study, bar; empty: those at which each tyre was measured.
    contact : mapping, optional
        Table of ``relaxation_length`` in a model file: numbers, or tyre, surface and pressure_bar. The question is then
        about this tyre.
    postures : tuple of Bicycle
        The same rider in other postures, this one included, to show what the posture does; empty: not shown.
    report_speed : float
        Where frequencies and damping ratios are compared, m/s; critical speeds are searched up to ``max_speed``.
    samples, seed : int
        Random bicycles that check the linear standard deviations.
    fronts : int
        Random bicycles with plausible fronts, for the outer error bar of each case.
    """

    bicycle: Bicycle
    speeds: Array = field(default_factory=lambda: np.linspace(0, 30, 121))
    front: Front = field(default_factory=Front)
    arms: Arms = field(default_factory=Arms)
    camber_share: float = CAMBER_SHARE
    further: Mapping[str, Table] = field(default_factory=dict)
    tyres: tuple[str, ...] = ()
    pressures: tuple[float, ...] = ()
    contact: Table | None = None
    postures: tuple[Bicycle, ...] = ()
    report_speed: float = 15.0
    max_speed: float = 60.0
    samples: int = 500
    seed: int = 0
    fronts: int = 64

    @property
    def fastest(self) -> float:
        """The highest speed that is looked at where random bicycles and alternatives are compared, m/s."""
        return float(self.speeds[-1])

    @property
    def reference(self) -> Setup:
        """The world that the first sentence is about: nothing holds the handlebar, the front flexes."""
        return Setup(self.front, None, self.camber_share)

    @property
    def setups(self) -> tuple[Setup, ...]:
        """The four worlds, the one of the first sentence first."""
        share = self.camber_share
        return (
            self.reference, Setup(self.front, self.arms, share), Setup(None, None, share),
            Setup(None, self.arms, share),
        )  # fmt: skip

    @property
    def ranges(self) -> Ranges:
        """How far what is assumed may be off."""
        return Ranges.of(
            self.front, self.arms, camber_given="camber_thrust" in self.further,
            friction_given="steer_damper" in self.further,
        )  # fmt: skip
