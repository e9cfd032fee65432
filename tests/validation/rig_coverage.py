"""Does the 95 % interval of a rig campaign hold the truth? SYNTHETIC campaigns with known C_Fy and K_y.

Every campaign is drawn anew (tyre, loads, pressure, noise, drift, friction, offsets, repeatability, calibration
errors, sweep rates, axis convention), written to CSV files with sidecars, and fitted from those files the way a
user would. Calibration errors are drawn from the very certificates the fit is told of, and the repeatability that
it is told is that of the remounting that is drawn. Counted: how often the interval of C_Fy, K_y and C/K holds the
truth, the mean relative error, and what the same fits say without the lag correction.
"""

import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from tyre.table import write_csv
from tyre.units import PASCAL_PER_BAR
from tyre.workers import worker_pool

CONDITIONS = 2
REMOUNTING = (0.002, 0.008)  # relative scatter from recording to recording
SWEEPS = (1.0, 2.0, 1.0)  # rates over the slower one; the faster one is drawn between 2 and 2.5 times as fast
PULLS = 3


def run(*, out: Path, seed: int, campaigns: int = 500, jobs: int = 2) -> dict[str, Any]:
    """Simulate and fit campaigns."""
    import pandas as pd

    from tyre.progress import progress_bar

    seeds = np.random.SeedSequence(seed).spawn(campaigns)
    rows: list[dict[str, float]] = []
    outcomes: Iterable[list[dict[str, float]]]
    if jobs == 1:
        for outcome in progress_bar(map(one_campaign, seeds), total=campaigns, desc="campaigns"):
            rows += outcome
    else:
        with worker_pool(jobs) as pool:
            outcomes = pool.map(one_campaign, seeds, chunksize=4)
            for outcome in progress_bar(outcomes, total=campaigns, desc="campaigns"):
                rows += outcome
    write_csv(out / "rig_coverage.csv", frame := pd.DataFrame(rows), number_format="%.6g")
    return summary(frame, seed=seed, campaigns=campaigns)


def summary(frame: Any, *, seed: int, campaigns: int) -> dict[str, Any]:
    """Coverage and bias of the cases in ``frame``, with their own statistical uncertainty."""

    def mean(name: str) -> dict[str, float]:
        values = 100.0 * frame[name].to_numpy()
        return {
            "mean_percent": round(float(values.mean()), 4),
            "standard_error_percent": round(float(values.std(ddof=1) / np.sqrt(values.size)), 4),
            "sd_percent": round(float(values.std(ddof=1)), 4),
        }

    def covered(name: str) -> dict[str, float]:
        values = frame[name].to_numpy()
        return {
            "share_percent": round(100.0 * float(values.mean()), 2),
            "held": int(values.sum()),
            "cases": int(values.size),
        }

    return {
        "synthetic": True,
        "what": "rig simulator -> CSV files -> velotyre fit; coverage of 95 % intervals and relative errors",
        "seed": seed,
        "campaigns": campaigns,
        "conditions_per_campaign": CONDITIONS,
        "made_by": f"python -m tests.validation rig-coverage --seed {seed} --campaigns {campaigns}",
        "coverage": {
            "cornering_stiffness": covered("C_held"),
            "lateral_stiffness": covered("K_held"),
            "relaxation_length": covered("length_held"),
        },
        "error": {
            "cornering_stiffness": mean("C_error"),
            "lateral_stiffness": mean("K_error"),
            "relaxation_length": mean("length_error"),
        },
        "without_lag_correction": {
            "cornering_stiffness": mean("C_error_no_lag"),
            "change_by_correction": mean("C_change_by_lag"),
            "coverage_cornering_stiffness": covered("C_held_no_lag"),
            "force_at_zero_slip_one_branch_N": {
                "without": round(float(frame["zero_force_error_no_lag_N"].abs().mean()), 3),
                "with": round(float(frame["zero_force_error_N"].abs().mean()), 3),
            },
        },
        "line_through_all_pull_points": mean("K_error_line"),
        "targets": {
            "coverage_percent": [92.0, 98.0],
            "bias_C_percent": 0.3,
            "bias_K_percent": 0.5,
        },
        "met": {
            "coverage_C": bool(0.92 <= frame["C_held"].mean() <= 0.98),
            "coverage_K": bool(0.92 <= frame["K_held"].mean() <= 0.98),
            "bias_C": bool(abs(frame["C_error"].mean()) < 0.003),
            "bias_K": bool(abs(frame["K_error"].mean()) < 0.005),
        },
    }


def one_campaign(seed: np.random.SeedSequence) -> list[dict[str, float]]:
    """Simulate (from ``seed``), write, read and fit one campaign; one row per condition."""
    from tyre.campaign import fit_campaign
    from tyre.condition import FitSettings
    from tyre.properties import Calibration

    calibration = Calibration(repeatability=float(np.mean(REMOUNTING)))
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truths = _write(folder, rng, calibration)
        common: dict[str, Any] = {"progress": False, "jobs": 1}
        fitted = fit_campaign(folder, settings=FitSettings(calibration), **common)
        plain = fit_campaign(folder, settings=FitSettings(calibration, lag_correction=False), **common)
        rows = []
        for condition, without in zip(fitted.conditions, plain.conditions, strict=True):
            truth = truths[condition.load]
            c, k, length, c_plain = (
                condition.cornering_stiffness,
                condition.lateral_stiffness,
                condition.relaxation_length,
                without.cornering_stiffness,
            )
            assert c is not None
            assert k is not None
            assert length is not None
            assert c_plain is not None
            lam = truth["C"] / truth["K"]
            first = folder / condition.sweeps[0].file
            with_lag, no_lag = _one_branch(first, lam, truth["zero_force"])
            rows.append(
                {
                    "load_N": condition.load,
                    "pressure_bar": condition.pressure / PASCAL_PER_BAR,
                    "C_N_per_rad": truth["C"],
                    "K_N_per_m": truth["K"],
                    "C_error": c.value / truth["C"] - 1.0,
                    "C_sd": c.sd / truth["C"],
                    "C_held": float(c.covers(truth["C"])),
                    "K_error": k.value / truth["K"] - 1.0,
                    "K_sd": k.sd / truth["K"],
                    "K_held": float(k.covers(truth["K"])),
                    "length_error": length.value / lam - 1.0,
                    "length_held": float(length.covers(lam)),
                    "C_error_no_lag": c_plain.value / truth["C"] - 1.0,
                    "C_change_by_lag": (c.value - c_plain.value) / truth["C"],
                    "C_held_no_lag": float(c_plain.covers(truth["C"])),
                    "zero_force_error_N": with_lag,
                    "zero_force_error_no_lag_N": no_lag,
                    "K_error_line": _line(folder, [item.file for item in condition.pulls]) / truth["K"] - 1.0,
                }
            )
    return rows


def _write(folder: Path, rng: np.random.Generator, calibration: Any) -> dict[float, dict[str, float]]:
    """Draw a campaign, write its recordings and return the truth by load."""
    from dataclasses import replace

    from tyre.recording import Condition
    from tyre.recording_files import write_csv
    from tyre.rig import (
        DialGauge,
        LoadCellDrift,
        Noise,
        PlySteer,
        Protocol,
        Remounting,
        RigEffect,
        RigFriction,
        RimCompliance,
        SensorGain,
        TemperatureDrift,
        simulate_pull,
        simulate_sweep,
        synthetic_tyre,
    )

    effects: list[RigEffect] = [
        PlySteer(force=rng.uniform(-10.0, 25.0), slip=np.deg2rad(rng.uniform(-0.3, 0.3))),
        RimCompliance(stiffness=10 ** rng.uniform(6.0, 7.0)),
        Remounting(sd=rng.uniform(*REMOUNTING)),
        TemperatureDrift(rise=rng.uniform(0.0, 4.0), per_kelvin=rng.uniform(-0.003, -0.001)),
        RigFriction(force=rng.uniform(0.5, 3.0), presliding=rng.uniform(2e-5, 1e-4)),
        SensorGain(
            force=rng.normal(0.0, calibration.force),
            slip=rng.normal(0.0, calibration.slip),
            displacement=rng.normal(0.0, calibration.displacement),
        ),
        LoadCellDrift(rate=rng.normal(0.0, 3.0)),
        Noise(
            white=rng.uniform(1.5, 4.0),
            correlated=rng.uniform(0.5, 2.5),
            correlation_time=10 ** rng.uniform(-1.0, -0.3),
            pull=rng.uniform(0.1, 0.6),
        ),
        DialGauge(),
    ]
    axes = str(rng.choice(["ISO", "SAE", "adapted SAE"]))
    pressure = PASCAL_PER_BAR * round(rng.uniform(3.5, 7.5), 1)
    loads = [float(round(rng.uniform(330.0, 400.0))), float(round(rng.uniform(420.0, 500.0)))]
    slow, ratio = np.deg2rad(rng.uniform(0.8, 1.5)), rng.uniform(2.0, 2.5)
    truths = {}
    for load in loads:
        made_up = synthetic_tyre(load=load, pressure=pressure)
        tyre = replace(
            made_up,
            cornering_stiffness=made_up.cornering_stiffness * rng.uniform(0.85, 1.1),
            lateral_stiffness=made_up.lateral_stiffness * rng.uniform(0.85, 1.15),
            peak_force=load * rng.uniform(0.9, 1.2),
            shape=rng.uniform(1.2, 1.6),
            curvature=rng.uniform(-0.5, 0.5),
        )
        condition = Condition(tyre="Synthetic tyre", load=load, pressure=pressure, surface="flat", temperature=22.0)
        for number, faster in enumerate(SWEEPS):
            protocol = Protocol(
                slip_rate=float(slow * (ratio if faster > 1.0 else 1.0)), cycles=4 if faster > 1.0 else 2
            )
            sweep = simulate_sweep(
                tyre=tyre, condition=condition, protocol=protocol, effects=effects, rng=rng, axes=axes
            )
            write_csv(sweep, folder / f"sweep_{load:g}N_{number}.csv")
        for number in range(PULLS):
            pull = simulate_pull(
                tyre=tyre, condition=condition, protocol=Protocol(), effects=effects, rng=rng, axes=axes
            )
            write_csv(pull, folder / f"pull_{load:g}N_{number}.csv")
        for effect in effects:
            if isinstance(effect, PlySteer):
                tyre = effect.on_tyre(tyre, condition, rng)
        truths[load] = {
            "C": tyre.cornering_stiffness,
            "K": tyre.lateral_stiffness,
            "zero_force": float(tyre.steady_force(np.array([0.0]))[0]),
        }
    return truths


def _one_branch(path: Path, length: float, truth: float) -> tuple[float, float]:
    """Error of the side force at zero slip from one branch alone, with the lag known and with the lag left in, N."""
    from dataclasses import fields, replace

    from tyre.recording import RigRun
    from tyre.recording_files import read_recording
    from tyre.slip_sweep import fit_slip_sweep
    from tyre.sweep_curve import slip_reversals

    run = read_recording(path)
    assert isinstance(run, RigRun)
    turns = slip_reversals(run)
    part = {
        item.name: getattr(run, item.name)[turns[1] : turns[2]]
        for item in fields(run)
        if isinstance(getattr(run, item.name), np.ndarray)
    }
    branch = replace(run, **part)
    errors = [
        float(fit.steady_force(np.array([0.0]))[0]) - truth
        for fit in (
            fit_slip_sweep(branch, relaxation_length=length),
            fit_slip_sweep(branch, lag_correction=False),
        )
    ]
    return errors[0], errors[1]


def _line(folder: Path, files: list[str]) -> float:
    """What a straight line through all points of the pull tests would give, N/m."""
    from tyre.recording import PullTest
    from tyre.recording_files import read_recording

    slopes = []
    for name in files:
        test = read_recording(folder / name)
        assert isinstance(test, PullTest)
        slopes.append(float(np.polyfit(test.tyre_deflection, test.side_force, 1)[0]))
    return float(np.mean(slopes))
