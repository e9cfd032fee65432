"""A simulated rig: synthetic slip sweeps, lateral stiffness tests and campaigns of the paper's protocol.

It computes with no code of the fits, which are judged by it.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
import scipy

from tyre.ground.errors import InputError, refuse_unknown
from tyre.ground.files import make_folder, write_text
from tyre.ground.units import PASCAL_PER_BAR
from tyre.recordings.recording import SIMULATED_NOTE, Channel, Condition, LateralStiffnessTest, RigRun
from tyre.rig.effect import Channels, RigEffect, RigTyre, simulated_effects
from tyre.rig.effects.mechanics import Remounting, RigFriction, RimCompliance
from tyre.rig.effects.sensors import DialGauge, LoadCellDrift, Noise, SensorGain
from tyre.rig.effects.tyre import DrumCurvature, PlySteer, TemperatureDrift


@dataclass(frozen=True)
class Protocol:
    """Drive of a recording: speeds in m/s, slip in rad, rates in rad/s, times in s, lengths in m."""

    speed: float = 9.3 / 3.6  # m/s, of a slip sweep
    slip_amplitude: float = np.deg2rad(4.0)  # rad
    slip_rate: float = np.deg2rad(1.0)  # rad/s
    cycles: int = 3  # 0, +amplitude, -amplitude, 0: so many times
    sample_rate: float = 200.0  # Hz
    step_slip: float = np.deg2rad(1.0)  # rad, slip after the step
    step_speed: float = 0.5  # m/s, of a slip step
    step_rise: float = 0.06  # s, of the slip
    step_wait: float = 1.0  # s of rolling straight before
    step_distance: float = 1.2  # m of rolling after the rise
    pull_force: float = 150.0  # N, at the end of a stroke
    pull_readings: int = 20  # per stroke, out or back
    pull_cycles: int = 2  # out and back
    pull_duration: float = 120.0  # s, of the whole test


def simulate_sweep(
    *,
    tyre: RigTyre,
    condition: Condition,
    protocol: Protocol,
    effects: Sequence[RigEffect],
    rng: np.random.Generator,
    axes: str = "adapted SAE",
) -> RigRun:
    """Triangular slip sweep: 0, +amplitude, -amplitude, ..., 0."""
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
    """Slip step: straight for ``step_wait``, then ``step_slip`` within ``step_rise``, at the slow ``step_speed``."""
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
) -> LateralStiffnessTest:
    """Static lateral stiffness test: ``pull_cycles`` times out and back, ``pull_readings`` readings a stroke."""
    for effect in effects:
        tyre = effect.on_tyre(tyre, condition, rng)
    reach = protocol.pull_force / tyre.lateral_stiffness
    outward = np.linspace(0.0, 1.0, protocol.pull_readings + 1)
    path = np.concatenate(
        [[0.0]] + [np.concatenate([outward[1:], outward[-2::-1]]) for _ in range(protocol.pull_cycles)]
    )
    # readings are not taken at exactly even positions; this also keeps rounding of the gauges random
    jitter = rng.uniform(-0.3, 0.3, path.size) / protocol.pull_readings
    path = np.where((path > 0.0) & (path < 1.0), path + jitter, path)
    deflection = reach * path
    force = tyre.lateral_stiffness * deflection * (1.0 - tyre.softening * path)
    rim = force / tyre.rim_stiffness
    channels: Channels = {
        "time": np.linspace(0.0, protocol.pull_duration, path.size),
        "lateral_force": force,
        "plate_displacement": deflection + rim,
        "rim_displacement": rim,
    }
    for effect in effects:
        effect.on_pull(channels, rng)
    recorded: dict[str, Any] = dict(channels)
    return LateralStiffnessTest(condition=condition, axes=axes, synthetic=True, notes=(SIMULATED_NOTE,), **recorded)


def _roll(
    tyre: RigTyre,
    condition: Condition,
    slip: Channel,
    time: Channel,
    speed: float,
    kind: Literal["slip_sweep", "slip_step"],
    effects: Sequence[RigEffect],
    rng: np.random.Generator,
    axes: str,
) -> RigRun:
    for effect in effects:
        tyre = effect.on_tyre(tyre, condition, rng)
    lagged = slip
    if tyre.relaxation:  # length d(lagged)/d(distance) = slip - lagged, with slip linear between the samples
        rate = speed / tyre.relaxation_length
        _, lagged, _ = scipy.signal.lsim(([[-rate]], [[rate]], [[1.0]], [[0.0]]), slip, time - time[0], slip[0])
    force = tyre.steady_force(lagged)
    trail = tyre.pneumatic_trail / (1.0 + ((lagged + tyre.offset_slip) / tyre.trail_slip) ** 2)
    full = np.full_like(time, 1.0)
    channels: Channels = {
        "time": time,
        "slip_angle": slip.copy(),
        "lateral_force": force.copy(),
        "vertical_load": condition.load * full,
        "aligning_moment": -trail * (force - tyre.offset_force),
        "speed": speed * full,
        "temperature": (20.0 if condition.temperature is None else condition.temperature) * full,
    }
    for effect in effects:
        effect.on_rolling(channels, rng)
    recorded: dict[str, Any] = dict(channels)
    driven = replace(condition, speed=speed)
    return RigRun(condition=driven, axes=axes, synthetic=True, kind=kind, notes=(SIMULATED_NOTE,), **recorded)


@dataclass(frozen=True)
class CampaignPlan:
    """Conditions of a synthetic campaign (SI units) and the number of recordings at each."""

    tyre: str = "Synthetic tyre"  # name of the tyre
    loads: tuple[float, ...] = (340.0, 400.0, 490.0)  # N
    pressures: tuple[float, ...] = (3.5e5, 5.5e5, 7.5e5)  # Pa
    surfaces: tuple[str, ...] = ("flat",)  # ``flat`` and ``drum``
    rates: tuple[float, ...] = (float(np.deg2rad(1.0)), float(np.deg2rad(2.0)))  # rad/s, slip rates of the sweeps
    sweeps: int = 1  # at each condition and rate
    pulls: int = 2  # at each condition on the flat surface
    steps: int = 0  # at each condition
    drum_radius: float = 1.3  # m
    axes: str = "adapted SAE"  # convention that the recordings declare
    file_format: str = "csv"  # ``csv``, ``tdx`` or ``mixed``


def synthetic_tyre(*, load: float, pressure: float) -> RigTyre:
    """A made-up tyre of the size of a 26 mm racing tyre, smooth in ``load`` (N) and ``pressure`` (Pa)."""
    f, p = load / 400.0, pressure / 5.5e5
    stiffness = 7600.0 * np.sin(2.0 * np.arctan(load / (560.0 * p**0.15))) / p**0.05
    return RigTyre(
        cornering_stiffness=float(stiffness),
        lateral_stiffness=float(60e3 * p**0.65 * f**0.05),
        peak_force=float(1.05 * load),
        shape=1.4,
        curvature=0.1,
        pneumatic_trail=float(0.018 * f**0.5 / p**0.3),
    )


def default_effects(rng: np.random.Generator) -> tuple[RigEffect, ...]:
    """The rig-side effects of a fair laboratory; the calibration errors of the campaign are drawn here, by ``rng``."""
    force, slip, gauge = rng.normal(0.0, [0.003, 0.003, 0.002])
    gain = SensorGain(force=float(force), slip=float(slip), displacement=float(gauge))
    tyre = (DrumCurvature(), PlySteer(), RimCompliance(), Remounting(), TemperatureDrift())
    return (*tyre, RigFriction(), gain, LoadCellDrift(), Noise(), DialGauge())


def set_effect(effects: Sequence[RigEffect], name: str, values: Mapping[str, float] | None) -> tuple[RigEffect, ...]:
    """Set the values of one effect, add it, or take it out."""
    effect_types = simulated_effects()
    refuse_unknown("effect", [name], effect_types)
    kind = effect_types[name]
    if values is None:
        return tuple(effect for effect in effects if type(effect) is not kind)
    allowed = [item.name for item in fields(kind)]
    refuse_unknown("parameter", values, allowed, where=f"effect {name}")
    if any(type(effect) is kind for effect in effects):
        return tuple(replace(effect, **values) if type(effect) is kind else effect for effect in effects)
    return (*effects, kind(**values))


def write_campaign_files(
    folder: Path,
    *,
    plan: CampaignPlan,
    effects: Sequence[RigEffect],
    rng: np.random.Generator,
    seed: int | None = None,
    protocol: Protocol | None = None,
) -> list[Path]:
    """Write a synthetic campaign: one file per recording and ``truth.json``."""
    from tyre.fits.recording_files import write_csv
    from tyre.fits.tydex_recording import write_tydex

    protocol = protocol or Protocol()
    refuse_unknown("format", [plan.file_format], ("csv", "tdx", "mixed"))
    refuse_unknown("surface", plan.surfaces, ("flat", "drum"))
    make_folder(folder)
    if any(path.suffix in (".csv", ".tdx") for path in folder.iterdir()):
        raise InputError(f"{folder}: already holds recordings; give an empty folder")
    written: list[Path] = []

    def write(recording: RigRun | LateralStiffnessTest, stem: str) -> None:
        tydex = plan.file_format == "tdx" or (plan.file_format == "mixed" and len(written) % 2 == 1)
        path = folder / f"{stem}.{'tdx' if tydex else 'csv'}"
        (write_tydex if tydex else write_csv)(recording, path)
        written.append(path)

    truth = []
    for surface, pressure, load in product(plan.surfaces, plan.pressures, plan.loads):
        tyre = synthetic_tyre(load=load, pressure=pressure)
        condition = Condition(
            tyre=plan.tyre,
            load=load,
            pressure=pressure,
            surface=surface,
            drum_radius=plan.drum_radius if surface == "drum" else None,
            rim="laboratory",
            speed=protocol.speed,
            temperature=22.0,
        )
        truth.append(_truth(tyre, condition, effects))
        stem = f"{surface}_{pressure / PASCAL_PER_BAR:g}bar_{load:g}N"
        common: dict[str, Any] = {"tyre": tyre, "effects": effects, "rng": rng, "axes": plan.axes}
        for rate, number in product(plan.rates, range(1, plan.sweeps + 1)):
            run = simulate_sweep(condition=condition, protocol=replace(protocol, slip_rate=rate), **common)
            write(run, f"{stem}_sweep_{np.rad2deg(rate):g}deg_s_{number}")
        for number in range(1, plan.steps + 1):
            write(simulate_step(condition=condition, protocol=protocol, **common), f"{stem}_step_{number}")
        for number in range(1, plan.pulls + 1 if surface == "flat" else 1):
            still = replace(condition, speed=None)
            write(simulate_pull(condition=still, protocol=protocol, **common), f"{stem}_pull_{number}")
    table = {
        "synthetic": True,
        "seed": seed,
        "protocol": asdict(protocol),
        "effects": {type(effect).__name__: asdict(effect) for effect in effects},
        "conditions": truth,
    }
    write_text(folder / "truth.json", json.dumps(table, indent=1) + "\n")
    return written


def _truth(tyre: RigTyre, condition: Condition, effects: Sequence[RigEffect]) -> dict[str, Any]:
    """Return the result of a perfect analysis: the tyre on this surface, without the scatter of remounting."""
    rng = np.random.default_rng(0)
    for effect in effects:
        if not isinstance(effect, Remounting):
            tyre = effect.on_tyre(tyre, condition, rng)
    return {
        "tyre": condition.tyre,
        "surface": condition.surface,
        "load_N": condition.load,
        "pressure_bar": condition.pressure / PASCAL_PER_BAR,
        "cornering_stiffness_N_per_rad": tyre.cornering_stiffness,
        "lateral_stiffness_N_per_m": tyre.lateral_stiffness,
        "relaxation_length_m": tyre.cornering_stiffness / tyre.lateral_stiffness,
        "relaxation_length_rolling_m": tyre.relaxation_length,
        "pneumatic_trail_m": tyre.pneumatic_trail,
        "lateral_force_offset_N": tyre.offset_force,
    }
