"""A synthetic bicycle-tyre rig: slip sweeps, slip steps and lateral pulls of a tyre whose truth is known.

The protocol is the one of Dell'Orto, Ballo, Mastinu & Gobbi (9.3 km/h, slip to +-4 deg); the rolling side force obeys
their eq. (1), (length / v) dF/dt + F = F_steady(slip), integrated exactly between samples. Every recording made here is
marked ``synthetic``: nothing of it was measured.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tyre.fits.lag import first_order_lag
from tyre.recordings.recording import SIMULATED_NOTE, Channel, Condition, PullTest, RigRun
from tyre.rig.effect import Channels, RigEffect
from tyre.rig.tyre import RigTyre


@dataclass(frozen=True)
class Protocol:
    """How a recording is driven: speeds in m/s, slip in rad, rates in rad/s, times in s, lengths in m.

    A pull goes out and back twice, with 20 readings a stroke.
    """

    speed: float = 9.3 / 3.6
    slip_amplitude: float = np.deg2rad(4.0)
    slip_rate: float = np.deg2rad(1.0)
    cycles: int = 3
    sample_rate: float = 200.0
    step_slip: float = np.deg2rad(1.0)
    step_speed: float = 0.5
    step_rise: float = 0.06
    step_wait: float = 1.0
    step_distance: float = 1.2
    pull_force: float = 150.0
    pull_readings: int = 20
    pull_cycles: int = 2
    pull_duration: float = 120.0


def simulate_sweep(
    *,
    tyre: RigTyre,
    condition: Condition,
    protocol: Protocol,
    effects: Sequence[RigEffect],
    rng: np.random.Generator,
    axes: str = "adapted SAE",
) -> RigRun:
    """Triangular slip sweep: 0, +amplitude, -amplitude, ..., 0.

    Parameters
    ----------
    tyre : RigTyre
        Truth before the rig's effects act.
    condition : Condition
    protocol : Protocol
    effects : sequence of RigEffect
        Applied in order.
    rng : numpy.random.Generator
    axes : str
        Convention the recording is declared in (it matters when written).

    Returns
    -------
    RigRun
        Channels of shape (n,), n = sample rate times 4 cycles amplitude / rate, marked synthetic.
    """
    duration = 4.0 * protocol.cycles * protocol.slip_amplitude / protocol.slip_rate
    time = np.arange(round(duration * protocol.sample_rate)) / protocol.sample_rate
    phase = time * protocol.slip_rate / protocol.slip_amplitude
    slip = protocol.slip_amplitude * (np.abs((phase + 3.0) % 4.0 - 2.0) - 1.0)
    return _roll(tyre, condition, slip, time, protocol.speed, "slip_sweep", effects, rng, axes)


def simulate_step(
    *,
    tyre: RigTyre,
    condition: Condition,
    protocol: Protocol,
    effects: Sequence[RigEffect],
    rng: np.random.Generator,
    axes: str = "adapted SAE",
) -> RigRun:
    """Slip step: straight for ``step_wait``, then ``step_slip`` within ``step_rise``, at the slow ``step_speed``.

    Parameters and returns as :func:`simulate_sweep`.
    """
    duration = protocol.step_wait + protocol.step_rise + protocol.step_distance / protocol.step_speed
    time = np.arange(round(duration * protocol.sample_rate)) / protocol.sample_rate
    slip = protocol.step_slip * np.clip((time - protocol.step_wait) / protocol.step_rise, 0.0, 1.0)
    return _roll(tyre, condition, slip, time, protocol.step_speed, "slip_step", effects, rng, axes)


def simulate_pull(
    *,
    tyre: RigTyre,
    condition: Condition,
    protocol: Protocol,
    effects: Sequence[RigEffect],
    rng: np.random.Generator,
    axes: str = "adapted SAE",
) -> PullTest:
    """Static pull test: the plate goes out and back ``pull_cycles`` times in ``pull_readings`` readings per stroke.

    The tyre's force is K x (1 - softening x / x_max). Parameters and returns as :func:`simulate_sweep`.
    """
    for effect in effects:
        tyre = effect.on_tyre(tyre, condition, rng)
    reach = protocol.pull_force / tyre.lateral_stiffness
    out = np.linspace(0.0, 1.0, protocol.pull_readings + 1)
    path = np.concatenate([[0.0]] + [np.concatenate([out[1:], out[-2::-1]]) for _ in range(protocol.pull_cycles)])
    # readings are not taken at exactly even positions; this also keeps rounding of the gauges random
    jitter = rng.uniform(-0.3, 0.3, path.size) / protocol.pull_readings
    path = np.where((path > 0.0) & (path < 1.0), path + jitter, path)
    deflection = reach * path
    force = tyre.lateral_stiffness * deflection * (1.0 - tyre.softening * path)
    rim = force / tyre.rim_stiffness
    channels: Channels = {
        "time": np.linspace(0.0, protocol.pull_duration, path.size),
        "side_force": force,
        "plate_displacement": deflection + rim,
        "rim_displacement": rim,
    }
    for effect in effects:
        effect.on_pull(channels, rng)
    recorded: dict[str, Any] = dict(channels)
    return PullTest(condition=condition, axes=axes, synthetic=True, notes=(SIMULATED_NOTE,), **recorded)


def _roll(
    tyre: RigTyre,
    condition: Condition,
    slip: Channel,
    time: Channel,
    speed: float,
    kind: str,
    effects: Sequence[RigEffect],
    rng: np.random.Generator,
    axes: str,
) -> RigRun:
    for effect in effects:
        tyre = effect.on_tyre(tyre, condition, rng)
    steady = tyre.steady_force(slip)
    step = (time[1] - time[0]) * speed / tyre.relaxation_length
    force = first_order_lag(steady, step=step) if tyre.relaxation else steady
    x = slip + tyre.offset_slip
    trail = tyre.pneumatic_trail / (1.0 + (x / tyre.trail_slip) ** 2)
    full = np.full_like(time, 1.0)
    channels: Channels = {
        "time": time,
        "slip_angle": slip.copy(),
        "side_force": force.copy(),
        "vertical_load": condition.load * full,
        "aligning_moment": -trail * (force - tyre.offset_force),
        "speed": speed * full,
        "temperature": (20.0 if condition.temperature is None else condition.temperature) * full,
    }
    for effect in effects:
        effect.on_rolling(channels, rng)
    recorded: dict[str, Any] = dict(channels)
    return RigRun(
        condition=replace(condition, speed=speed),
        axes=axes,
        synthetic=True,
        kind="slip_step" if kind == "slip_step" else "slip_sweep",
        notes=(SIMULATED_NOTE,),
        **recorded,
    )
