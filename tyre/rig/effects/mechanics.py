"""Mechanics of a rig: friction, play, the rim and the mounting."""

import math
from dataclasses import dataclass, replace

import numpy as np

from tyre.fits.friction import dahl_friction
from tyre.ground.arrays import Array
from tyre.recordings.recording import Condition
from tyre.rig.effect import (
    Channels,
    PullTerms,
    RigEffect,
    RigParameter,
    RigTyre,
    Term,
    declared,
    needs_pull,
    needs_sweep,
)


@dataclass(frozen=True)
class Remounting(RigEffect):
    """Repeatability: every recording sees a remounted tyre, C and K off by a relative standard deviation ``sd``."""

    sd: float = declared(RigParameter("sd", "1", (0.0, 0.02), (0.0, 0.5)), 0.005)

    def on_tyre(self, tyre: RigTyre, condition: Condition, rng: np.random.Generator) -> RigTyre:
        c, k = 1.0 + self.sd * rng.standard_normal(2)
        return replace(
            tyre, cornering_stiffness=c * tyre.cornering_stiffness, lateral_stiffness=k * tyre.lateral_stiffness
        )


# friction builds up over 0.05 mm in the middle
_PRESLIDING = RigParameter("presliding", "m", (5e-5 / math.exp(1.4), 5e-5 * math.exp(1.4)), (1e-9, 1.0), size=False)


def _pull(terms: PullTerms, *, friction: Array, presliding: Array) -> None:
    terms.add(force=friction[:, None] * dahl_friction(terms.displacement, presliding=presliding))


@dataclass(frozen=True)
class RigFriction(RigEffect):
    """Friction of the rig in the lateral stiffness test: a loop of +-``force`` (N), developed over ``presliding`` (m)
    by Dahl's law.

    See :mod:`tyre.fits.lateral_stiffness`. At the origin it shows as stiction. Less than 0.05 N is not worth a name.
    """

    force: float = declared(RigParameter("force", "N", (0.0, 3.0), (0.0, math.inf)), 2.0)
    presliding: float = declared(_PRESLIDING, 4e-5)

    terms = (
        Term(
            "rig_friction",
            "friction of the rig adds to the force of a lateral stiffness test, against the motion",
            (RigParameter("friction", "N", (0.0, 3.0), (0.0, 30.0), least=0.05), _PRESLIDING),
            pull=_pull,
            needs=needs_pull,
        ),
    )

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        travel = np.diff(channels["plate_displacement"] - channels["rim_displacement"], prepend=0.0)
        remaining, share = np.exp(-np.abs(travel) / self.presliding), 0.0
        for n, way in enumerate(np.sign(travel)):  # presliding dT/d(travel) = sign - T, exactly along each reading
            share = way + (share - way) * remaining[n]
            channels["lateral_force"][n] += self.force * share


@dataclass(frozen=True)
class RimCompliance(RigEffect):
    """A rim of lateral ``stiffness`` (N/m; default: a stiff laboratory rim) in series with the tyre.

    It moves by F / stiffness in the lateral stiffness test, and lengthens the relaxation of the rolling wheel to
    C (1/K_y + 1/K_rim).
    """

    stiffness: float = declared(RigParameter("stiffness", "N/m", (5e4, math.inf), (1e3, math.inf), size=False), 6e6)

    terms = (
        Term(
            "rim_compliance",
            "rim and fixture move by compliance times force, in series with the tyre",
            (RigParameter("compliance", "m/N", (0.0, 2e-5), (0.0, 2e-4), least=1e-7),),
            sweep="compliance",
            pull="compliance",
            needs=needs_pull,
        ),
    )

    def on_tyre(self, tyre: RigTyre, condition: Condition, rng: np.random.Generator) -> RigTyre:
        return replace(tyre, rim_stiffness=self.stiffness)


_HALF_GAP = RigParameter("half_gap", "rad", (0.0, 1e-3), (0.0, 0.02), least=1e-5)


@dataclass(frozen=True)
class SteeringPlay(RigEffect):
    """The sensor is ahead of the wheel by ``half_gap`` (rad) in whichever direction it turns.

    In a slip step the sensor stays ahead after it has come to rest.
    """

    half_gap: float = declared(_HALF_GAP, 5e-4)

    terms = (
        Term(
            "steering_play",
            "the slip of the wheel stays behind that of the sensor by the same angle at any rate",
            (_HALF_GAP,),
            sweep="half_gap",
            needs=needs_sweep.also("both_branches", "one branch alone: the same as ply_steer"),
        ),
    )

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        steps = np.sign(np.diff(channels["slip_angle"], prepend=0.0))
        last = np.maximum.accumulate(np.where(steps != 0, np.arange(len(steps)), 0))
        channels["slip_angle"] = channels["slip_angle"] + self.half_gap * steps[last]
