"""Errors of the sensors of a rig."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from tyre.rig.effect import Channels, RigEffect, RigParameter, Term, declared, needs_pull, needs_sweep

_DELAY = RigParameter("delay", "s", (-0.01, 0.01), least=5e-4)


@dataclass(frozen=True)
class ChannelDelay(RigEffect):
    """The lateral force of a rolling recording lags the slip angle by ``delay`` (s), as a filter makes it."""

    delay: float = declared(_DELAY, 0.01)

    terms = (
        Term(
            "channel_delay",
            "the force is recorded later than the slip angle",
            (_DELAY,),
            sweep="delay",
            needs=needs_sweep,
        ),
    )

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        time = channels["time"]
        channels["lateral_force"] = np.interp(time - self.delay, time, channels["lateral_force"])


@dataclass(frozen=True)
class DialGauge(RigEffect):
    """Displacements are read off to the nearest ``resolution`` (m)."""

    resolution: float = declared(RigParameter("resolution", "m", (1e-6, 1e-4), (1e-12, 1.0), size=False), 1e-5)

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        for name in ("plate_displacement", "rim_displacement"):
            channels[name] = np.round(channels[name] / self.resolution) * self.resolution


@dataclass(frozen=True)
class Dropouts(RigEffect):
    """A ``share`` of the rolling force samples is lost (NaN), and as many are spikes of ``spike`` (N)."""

    share: float = declared(RigParameter("share", "1", (0.0, 0.01), (0.0, 1.0)), 1e-3)
    spike: float = declared(RigParameter("spike", "N", (0.0, 500.0)), 150.0)

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        n = channels["lateral_force"].size
        channels["lateral_force"][rng.random(n) < self.share] = np.nan
        hit = rng.random(n) < self.share
        channels["lateral_force"][hit] += self.spike * rng.choice([-1.0, 1.0], hit.sum())


_DIFFERENCE = RigParameter("difference", "1", (-0.05, 0.05), (-0.5, 0.5), least=0.002)


@dataclass(frozen=True)
class ForceGainBySign(RigEffect):
    """A lateral force to the right is read 1 + ``difference``/2 times, one to the left 1 - ``difference``/2 times.

    A cell calibrated differently in tension and compression does this, or an amplifier near its limit. A lateral
    stiffness test has one sign: there it is a matter of gain.
    """

    difference: float = declared(_DIFFERENCE, 0.02)

    terms = (
        Term(
            "force_gain_by_sign",
            "the force cell has one gain for forces to the right and another to the left",
            (_DIFFERENCE,),
            sweep="gain_by_sign",
            needs=needs_sweep.also(
                "both_signs", "every sweep has slip angles of one sign, where it is another gain of the force cell"
            ),
        ),
    )

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        force = channels["lateral_force"]
        force *= np.where(force > 0, 1 + self.difference / 2, 1 - self.difference / 2)


@dataclass(frozen=True)
class LoadCellDrift(RigEffect):
    """The zero of the lateral force cell walks by ``rate`` (N per minute)."""

    rate: float = declared(RigParameter("rate", "N/min", (-5.0, 5.0)), 2.0)

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        channels["lateral_force"] += self.rate / 60.0 * (channels["time"] - channels["time"][0])

    on_pull = on_rolling


def _size(name: str, unit: str, usual: float, default: float) -> Any:
    return declared(RigParameter(name, unit, (0.0, usual), (0.0, np.inf)), default)


@dataclass(frozen=True)
class Noise(RigEffect):
    """White and first-order autoregressive noise of the rolling channels, white noise of the force in a lateral
    stiffness test.

    ``white`` and ``correlated`` in N (standard deviations), ``correlation_time`` in s, ``slip`` in rad, ``load``,
    ``moment`` in N m, ``pull`` in N.
    """

    white: float = _size("white", "N", 10.0, 3.0)
    correlated: float = _size("correlated", "N", 10.0, 2.0)
    correlation_time: float = declared(
        RigParameter("correlation_time", "s", (0.05, 5.0), (1e-6, np.inf), size=False), 0.3
    )
    slip: float = _size("slip", "rad", 1e-3, 2e-4)
    load: float = _size("load", "N", 10.0, 3.0)
    moment: float = _size("moment", "N m", 0.5, 0.1)
    pull: float = _size("pull", "N", 1.0, 0.3)

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        n = channels["time"].size
        step = (channels["time"][-1] - channels["time"][0]) / (n - 1)
        memory, before = float(np.exp(-step / self.correlation_time)), rng.standard_normal()
        drawn = np.sqrt(1.0 - memory**2) * rng.standard_normal(n)
        drawn[0] += memory * before  # stationary from the first sample
        correlated = scipy.signal.lfilter([1.0], [1.0, -memory], drawn)
        channels["lateral_force"] += self.white * rng.standard_normal(n) + self.correlated * correlated
        channels["slip_angle"] += self.slip * rng.standard_normal(n)
        channels["vertical_load"] += self.load * rng.standard_normal(n)
        channels["aligning_moment"] += self.moment * rng.standard_normal(n)

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        channels["lateral_force"] += self.pull * rng.standard_normal(channels["lateral_force"].size)


_SCALE = (RigParameter("scale", "1", (-0.05, 0.05), least=0.002),)


@dataclass(frozen=True)
class SensorGain(RigEffect):
    """Wrong calibration: relative errors of the force, slip-angle and displacement readings, constant in a campaign.

    A wrong gain of the load cell shows in a fit as the stiffness of another load.
    """

    force: float = declared(
        RigParameter("force", "1", (-0.05, 0.05)), 0.0
    )  # indicated over true lateral force, less one
    slip: float = declared(RigParameter("slip", "1", (-0.05, 0.05)), 0.0)  # indicated over true slip, less one
    # indicated over true displacement, less one
    displacement: float = declared(RigParameter("displacement", "1", (-0.05, 0.05)), 0.0)

    terms = (
        Term("force_scale", "gain of the force cell", _SCALE, sweep="force_gain", pull="force_gain"),
        Term("slip_scale", "gain of the slip-angle sensor", _SCALE, sweep="slip_gain", needs=needs_sweep),
        Term("load_scale", "gain of the load cell", _SCALE, sweep="load_gain", needs=needs_sweep),
        Term(
            "displacement_scale", "gain of the displacement gauges", _SCALE, pull="displacement_gain", needs=needs_pull
        ),
    )

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        channels["lateral_force"] *= 1.0 + self.force
        channels["slip_angle"] *= 1.0 + self.slip

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        channels["lateral_force"] *= 1.0 + self.force
        for name in ("plate_displacement", "rim_displacement"):
            channels[name] *= 1.0 + self.displacement
