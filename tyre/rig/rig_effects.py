"""Rig-side effects of the simulator: what a rig adds to, or takes from, the tyre it measures. All synthetic.

One frozen dataclass per effect. An effect changes the tyre as it runs on the rig (``on_tyre``), the channels of a
rolling recording (``on_rolling``) or those of a pull test (``on_pull``); a campaign declares a tuple of them and they
act in its order. A new effect is a new class here: nothing else lists them.
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import lfilter

from tyre.drum import flat_over_drum
from tyre.recordings.recording import Channel, Condition

if TYPE_CHECKING:
    from tyre.rig.simulator import RigTyre

Channels = dict[str, Channel]


@dataclass(frozen=True)
class RigEffect:
    """Base of all rig effects: does nothing."""

    def on_tyre(self, tyre: "RigTyre", condition: Condition, rng: np.random.Generator) -> "RigTyre":
        """Return the tyre as it behaves on the rig in this recording."""
        return tyre

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        """Change the recorded channels of a slip sweep or step in place (SI, adapted SAE)."""

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        """Change the channels of a pull test in place (SI, adapted SAE)."""


@dataclass(frozen=True)
class DrumCurvature(RigEffect):
    """Cornering stiffness falls on a drum: C_drum = C_flat / (1 + R / R_drum)^exponent.

    Empirical form of physics.md section 3; lateral stiffness unchanged, so the relaxation length falls alike.
    """

    exponent: float = 0.6
    wheel_radius: float = 0.34

    def on_tyre(self, tyre: "RigTyre", condition: Condition, rng: np.random.Generator) -> "RigTyre":
        if condition.surface != "drum" or condition.drum_radius is None:
            return tyre
        ratio = flat_over_drum(
            exponent=self.exponent, wheel_radius=self.wheel_radius, drum_radius=condition.drum_radius
        )
        return replace(tyre, cornering_stiffness=tyre.cornering_stiffness / float(ratio))


@dataclass(frozen=True)
class PlySteer(RigEffect):
    """Offsets of the side-force curve: ``force`` (Sv, N) and ``slip`` (Sh, rad), as ply-steer and conicity give."""

    force: float = 8.0
    slip: float = 0.0

    def on_tyre(self, tyre: "RigTyre", condition: Condition, rng: np.random.Generator) -> "RigTyre":
        return replace(tyre, offset_force=self.force, offset_slip=self.slip)


@dataclass(frozen=True)
class RimCompliance(RigEffect):
    """A rim of lateral ``stiffness`` (N/m; default: a stiff laboratory rim) in series with the tyre.

    It moves by F / stiffness in the pull test, and lengthens the relaxation of the rolling wheel to
    C (1/K_y + 1/K_rim).
    """

    stiffness: float = 6e6

    def on_tyre(self, tyre: "RigTyre", condition: Condition, rng: np.random.Generator) -> "RigTyre":
        return replace(tyre, rim_stiffness=self.stiffness)


@dataclass(frozen=True)
class Remounting(RigEffect):
    """Repeatability: every recording sees a remounted tyre, C and K off by a relative standard deviation ``sd``."""

    sd: float = 0.005

    def on_tyre(self, tyre: "RigTyre", condition: Condition, rng: np.random.Generator) -> "RigTyre":
        c, k = 1.0 + self.sd * rng.standard_normal(2)
        return replace(
            tyre, cornering_stiffness=c * tyre.cornering_stiffness, lateral_stiffness=k * tyre.lateral_stiffness
        )


@dataclass(frozen=True)
class TemperatureDrift(RigEffect):
    """The tyre warms by ``rise`` (K) along a rolling recording and its force changes by ``per_kelvin`` (1/K).

    The force is right at the condition's temperature, which is reached in the middle of the recording.
    """

    rise: float = 3.0
    per_kelvin: float = -0.002

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        time = channels["time"]
        warming = self.rise * ((time - time[0]) / (time[-1] - time[0]) - 0.5)
        channels["side_force"] *= 1.0 + self.per_kelvin * warming
        channels["temperature"] = channels["temperature"] + warming


@dataclass(frozen=True)
class LoadCellDrift(RigEffect):
    """The zero of the side-force cell walks by ``rate`` (N per minute)."""

    rate: float = 2.0

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        channels["side_force"] += self.rate / 60.0 * (channels["time"] - channels["time"][0])

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        channels["side_force"] += self.rate / 60.0 * (channels["time"] - channels["time"][0])


@dataclass(frozen=True)
class SensorGain(RigEffect):
    """Wrong calibration: relative errors of the force, slip-angle and displacement readings, constant in a campaign."""

    force: float = 0.0
    slip: float = 0.0
    displacement: float = 0.0

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        channels["side_force"] *= 1.0 + self.force
        channels["slip_angle"] *= 1.0 + self.slip

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        channels["side_force"] *= 1.0 + self.force
        channels["plate_displacement"] *= 1.0 + self.displacement
        channels["rim_displacement"] *= 1.0 + self.displacement


@dataclass(frozen=True)
class Noise(RigEffect):
    """White and first-order autoregressive noise of the rolling channels, white noise of the force in a pull test.

    ``white`` and ``correlated`` in N (standard deviations), ``correlation_time`` in s, ``slip`` in rad, ``load``,
    ``moment`` in N m, ``pull`` in N.
    """

    white: float = 3.0
    correlated: float = 2.0
    correlation_time: float = 0.3
    slip: float = 2e-4
    load: float = 3.0
    moment: float = 0.1
    pull: float = 0.3

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        n = channels["time"].size
        step = (channels["time"][-1] - channels["time"][0]) / (n - 1)
        memory = np.exp(-step / self.correlation_time)
        start = rng.standard_normal()
        wander, _ = lfilter(
            [1.0], [1.0, -memory], np.sqrt(1.0 - memory**2) * rng.standard_normal(n), zi=[memory * start]
        )
        channels["side_force"] += self.white * rng.standard_normal(n) + self.correlated * wander
        channels["slip_angle"] += self.slip * rng.standard_normal(n)
        channels["vertical_load"] += self.load * rng.standard_normal(n)
        channels["aligning_moment"] += self.moment * rng.standard_normal(n)

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        channels["side_force"] += self.pull * rng.standard_normal(channels["side_force"].size)


@dataclass(frozen=True)
class RigFriction(RigEffect):
    """Friction of the rig in the pull test: a loop of +-``force`` (N), developed over ``presliding`` (m) by Dahl's law.

    Dahl (1968): dT/dx = (1 - T sgn(dx) / force) force / presliding. At the origin it shows as stiction.
    """

    force: float = 2.0
    presliding: float = 4e-5

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        deflection = channels["plate_displacement"] - channels["rim_displacement"]
        steps = np.diff(deflection, prepend=0.0)
        friction, drag = np.empty(deflection.size), 0.0
        for index, step in enumerate(steps):
            target = np.copysign(self.force, step)
            drag = target + (drag - target) * np.exp(-abs(step) / self.presliding)
            friction[index] = drag
        channels["side_force"] += friction


@dataclass(frozen=True)
class DialGauge(RigEffect):
    """Displacements are read off to the nearest ``resolution`` (m)."""

    resolution: float = 1e-5

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        for name in ("plate_displacement", "rim_displacement"):
            channels[name] = np.round(channels[name] / self.resolution) * self.resolution


@dataclass(frozen=True)
class Dropouts(RigEffect):
    """A ``share`` of the rolling force samples is lost (NaN), and as many are spikes of ``spike`` (N)."""

    share: float = 1e-3
    spike: float = 150.0

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        n = channels["side_force"].size
        channels["side_force"][rng.random(n) < self.share] = np.nan
        hit = rng.random(n) < self.share
        channels["side_force"][hit] += self.spike * rng.choice([-1.0, 1.0], hit.sum())
