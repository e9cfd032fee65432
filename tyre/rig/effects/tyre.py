"""Properties of the tyre and track that a fit may take for something else."""

from dataclasses import dataclass, replace

import numpy as np

from tyre.ground.arrays import Array
from tyre.recordings.recording import Condition
from tyre.rig.effect import Channels, RigEffect, RigParameter, RigTyre, SweepTerms, Term, declared, needs_sweep

_EXPONENT = RigParameter("exponent", "1", (0.0, 1.2), (0.0, 3.0), least=0.02)


def _soften(terms: SweepTerms, *, exponent: Array) -> None:
    terms.add(log_stiffness=-exponent * terms.track_curvature)


@dataclass(frozen=True)
class DrumCurvature(RigEffect):
    """Cornering stiffness falls on a drum: C_drum = C_flat / (1 + R / R_drum)^exponent.

    Empirical form of physics.md section 3; lateral stiffness unchanged, so the relaxation length falls alike.
    """

    exponent: float = declared(_EXPONENT, 0.6)  # of 1 + R / R_drum
    # R, m
    wheel_radius: float = declared(RigParameter("wheel_radius", "m", (0.3, 0.36), (0.05, 1.0), size=False), 0.34)

    terms = (
        Term(
            "drum_curvature",
            "cornering stiffness on a drum of radius Rd is that of a flat track over (1 + R / Rd)^exponent",
            (_EXPONENT,),
            sweep=_soften,
            needs=needs_sweep.also("other_track", "recordings and reference are of the same curvature of track"),
        ),
    )

    def on_tyre(self, tyre: RigTyre, condition: Condition, rng: np.random.Generator) -> RigTyre:
        if condition.surface != "drum" or condition.drum_radius is None:
            return tyre
        ratio = (1.0 + self.wheel_radius / condition.drum_radius) ** self.exponent
        return replace(tyre, cornering_stiffness=tyre.cornering_stiffness / ratio)


def _stiffen(terms: SweepTerms, *, exponent: Array) -> None:
    terms.add(log_stiffness=exponent * np.log(terms.load_ratio))


@dataclass(frozen=True)
class LoadDependence(RigEffect):
    """Cornering stiffness grows with load as load^exponent from the reference's load."""

    terms = (
        Term(
            "load_dependence",
            "cornering stiffness grows with load as load^exponent from the reference's load",
            (RigParameter("exponent", "1", (-1.0, 1.0), (-1.0, 3.0), least=0.02),),
            sweep=_stiffen,
            needs=needs_sweep.also("other_loads", "the reference covers the loads of the recordings"),
        ),
    )


_FORCE = RigParameter("force", "N", (-24.0, 24.0), least=0.2)
_SLIP = RigParameter("slip", "rad", (-3e-3, 3e-3), least=2e-5)


@dataclass(frozen=True)
class PlySteer(RigEffect):
    """Offsets of the lateral force curve: ``force`` (Sv, N) and ``slip`` (Sh, rad), as ply-steer and conicity give."""

    force: float = declared(_FORCE, 8.0)
    slip: float = declared(_SLIP, 0.0)

    terms = (
        Term(
            "ply_steer",
            "the lateral force vanishes at another slip angle than zero (or the zero of the angle is off)",
            (_SLIP,),
            sweep="slip_offset",
            needs=needs_sweep,
        ),
        Term(
            "conicity",
            "a lateral force at zero slip (or the zero of the force cell is off)",
            (_FORCE,),
            sweep="lateral_force",
            needs=needs_sweep,
        ),
    )

    def on_tyre(self, tyre: RigTyre, condition: Condition, rng: np.random.Generator) -> RigTyre:
        return replace(tyre, offset_force=self.force, offset_slip=self.slip)


@dataclass(frozen=True)
class SweepLag(RigEffect):
    """The slip lags over the relaxation length, (length / v) dx/dt + x = slip, and the force is on the curve at x.

    If the reference knows the length, the effect is there or not: its size is not asked.
    """

    terms = (
        Term(
            "sweep_lag",
            "the lateral force of a rolling tyre follows slip over the relaxation length",
            (RigParameter("relaxation_length", "m", (0.0, 0.2), (0.0, 2.0), least=0.005),),
            sweep="relaxation_length",
            needs=needs_sweep.also("speeds", "the rolling speed is not recorded; give speed_km_h in the sidecar"),
        ),
    )


@dataclass(frozen=True)
class TemperatureDrift(RigEffect):
    """The tyre warms by ``rise`` (K) along a rolling recording and its force changes by ``per_kelvin`` (1/K).

    The force is right at the condition's temperature, which is reached in the middle of the recording. A fit sees the
    relative ``change`` from begin to end.
    """

    rise: float = declared(RigParameter("rise", "K", (0.0, 20.0)), 3.0)
    per_kelvin: float = declared(RigParameter("per_kelvin", "1/K", (-0.01, 0.01)), -0.002)

    terms = (
        Term(
            "temperature_drift",
            "the lateral force grows or falls along the recording as the tyre warms",
            (RigParameter("change", "1", (-0.02, 0.02), least=0.001),),
            sweep="warming",
            needs=needs_sweep,
        ),
    )

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        time = channels["time"]
        warming = self.rise * ((time - time[0]) / (time[-1] - time[0]) - 0.5)
        channels["lateral_force"] *= 1.0 + self.per_kelvin * warming
        channels["temperature"] = channels["temperature"] + warming
