"""A whole synthetic campaign written to files, with its truth beside it. Nothing here is measured."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.errors import InputError, refuse_unknown
from tyre.base.files import write_text
from tyre.base.units import PASCAL_PER_BAR
from tyre.magic_formula.mf61 import saturation
from tyre.recordings.recording import Condition, PullTest, RigRun
from tyre.rig.effect import RigEffect, simulated_effects
from tyre.rig.effects.dial_gauge import DialGauge
from tyre.rig.effects.drum_curvature import DrumCurvature
from tyre.rig.effects.load_cell_drift import LoadCellDrift
from tyre.rig.effects.noise import Noise
from tyre.rig.effects.ply_steer import PlySteer
from tyre.rig.effects.remounting import Remounting
from tyre.rig.effects.rig_friction import RigFriction
from tyre.rig.effects.rim_compliance import RimCompliance
from tyre.rig.effects.sensor_gain import SensorGain
from tyre.rig.effects.temperature_drift import TemperatureDrift
from tyre.rig.simulator import Protocol, simulate_pull, simulate_step, simulate_sweep
from tyre.rig.tyre import RigTyre

_REFERENCE_LOAD, _REFERENCE_PRESSURE = 400.0, 5.5e5


@dataclass(frozen=True)
class CampaignPlan:
    """What a synthetic campaign contains: conditions (SI units) and the number of recordings at each.

    ``rates`` in rad/s: ``sweeps`` slip sweeps are made at each. Pull tests are made on the flat track only, as in
    the paper.
    """

    tyre: str = "Synthetic tyre"
    loads: tuple[float, ...] = (340.0, 400.0, 490.0)
    pressures: tuple[float, ...] = (3.5e5, 5.5e5, 7.5e5)
    surfaces: tuple[str, ...] = ("flat",)
    rates: tuple[float, ...] = (float(np.deg2rad(1.0)), float(np.deg2rad(2.0)))
    sweeps: int = 1
    pulls: int = 2
    steps: int = 0
    drum_radius: float = 1.3
    axes: str = "adapted SAE"
    file_format: str = "csv"


def synthetic_tyre(*, load: float, pressure: float) -> RigTyre:
    """A made-up tyre of the size of a 26 mm racing tyre, smooth in ``load`` (N) and ``pressure`` (Pa)."""
    f, p = load / _REFERENCE_LOAD, pressure / _REFERENCE_PRESSURE
    stiffness = 7600.0 * saturation(load / (560.0 * p**0.15)) / p**0.05
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
    return (
        DrumCurvature(),
        PlySteer(),
        RimCompliance(),
        Remounting(),
        TemperatureDrift(),
        RigFriction(),
        SensorGain(force=float(force), slip=float(slip), displacement=float(gauge)),
        LoadCellDrift(),
        Noise(),
        DialGauge(),
    )


def set_effect(effects: Sequence[RigEffect], name: str, values: Mapping[str, float] | None) -> tuple[RigEffect, ...]:
    """Set the values of one effect, add it, or take it out.

    Parameters
    ----------
    effects : sequence of RigEffect
    name : str
        A name of :func:`tyre.rig.effect.simulated_effects`.
    values : mapping of str to float, or None
        New values by parameter (SI units); None removes the effect.

    Returns
    -------
    tuple of RigEffect

    Raises
    ------
    InputError
        For an unknown effect or parameter; the message suggests the nearest.
    """
    known = simulated_effects()
    refuse_unknown("effect", [name], known)
    kind = known[name]
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
    """Write a synthetic campaign: one file per recording and ``truth.json``.

    Parameters
    ----------
    folder : Path
        Made if missing; must not hold recordings yet.
    plan : CampaignPlan
    effects : sequence of RigEffect
    rng : numpy.random.Generator
    seed : int, optional
        Kept in the truth file.
    protocol : Protocol, optional

    Returns
    -------
    list of Path
        Recordings (.csv or .tdx) in the order they were made.

    Raises
    ------
    InputError
        When the folder already holds recordings or the plan names an unknown format or surface.
    """
    from tyre.recordings.read import write_csv
    from tyre.recordings.tydex import write_tydex

    protocol = protocol or Protocol()
    if plan.file_format not in ("csv", "tdx", "mixed"):
        raise InputError(f"format {plan.file_format!r} is not one of csv, tdx, mixed")
    for surface in plan.surfaces:
        if surface not in ("flat", "drum"):
            raise InputError(f"surface {surface!r} is not one of flat, drum")
    folder.mkdir(parents=True, exist_ok=True)
    if any(path.suffix in (".csv", ".tdx") for path in folder.iterdir()):
        raise InputError(f"{folder}: already holds recordings; give an empty folder")
    written: list[Path] = []

    def write(recording: RigRun | PullTest, stem: str) -> None:
        tydex = plan.file_format == "tdx" or (plan.file_format == "mixed" and len(written) % 2 == 1)
        path = folder / f"{stem}.{'tdx' if tydex else 'csv'}"
        (write_tydex if tydex else write_csv)(recording, path)
        written.append(path)

    truth = []
    for surface in plan.surfaces:
        for pressure in plan.pressures:
            for load in plan.loads:
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
                for rate in plan.rates:
                    driven = replace(protocol, slip_rate=rate)
                    for number in range(1, plan.sweeps + 1):
                        run = simulate_sweep(condition=condition, protocol=driven, **common)
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
    """What a perfect analysis would find: the tyre on this surface, without the scatter of remounting."""
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
        "side_force_offset_N": tyre.offset_force,
    }
