"""Does the 95 % interval of a rig campaign hold the truth? SYNTHETIC campaigns with known C_alpha and K_y.

Every campaign is drawn anew (tyre, loads, pressure, noise, drift, friction, offsets, repeatability, calibration
errors, sweep rates, axis convention), written to CSV files with sidecars, and fitted from those files the way a
user would. Calibration errors are drawn from the very certificates the fit is told of, and the repeatability that
it is told is that of the remounting that is drawn. Counted: how often the interval of C_alpha, K_y and C/K holds the
truth, the mean relative error, and what the same fits say without the lag correction.
"""

import tempfile
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.cases import KeptCases, Row
from tyre.fits import FitSettings, fit_campaign, fit_slip_sweep, read_recording, slip_reversals, write_csv
from tyre.ground import PASCAL_PER_BAR
from tyre.measured import Calibration
from tyre.recordings import Condition, LateralStiffnessTest, RigRun
from tyre.rig import (
    DialGauge,
    LoadCellDrift,
    Noise,
    PlySteer,
    Protocol,
    Remounting,
    RigEffect,
    RigFriction,
    RigTyre,
    RimCompliance,
    SensorGain,
    TemperatureDrift,
    simulate_pull,
    simulate_sweep,
    synthetic_tyre,
)

REMOUNTING = (0.002, 0.008)  # relative scatter from recording to recording
SWEEPS = (1.0, 2.0, 1.0)  # rates over the slower one; the faster one is drawn between 2 and 2.5 times as fast
PULLS = 3
TARGETS = {"coverage_percent": [92.0, 98.0], "bias_C_percent": 0.3, "bias_K_percent": 0.5}


def run(*, out: Path, seed: int, campaigns: int = 500, jobs: int = 2) -> dict[str, Any]:
    """Simulate and fit campaigns."""
    kept = KeptCases(out / "rig_coverage_cases.jsonl", ("seed", "number"), also=("conditions",))
    wanted = [(seed, number) for number in range(campaigns)]
    rows = kept.computed(wanted, one_campaign, workers=jobs, what="campaigns")
    return summary([condition for row in rows for condition in row["conditions"]])


def summary(rows: list[dict[str, float]]) -> dict[str, Any]:
    """Coverage and bias of ``rows``, one a condition, with their own statistical uncertainty."""
    import pandas as pd

    frame = pd.DataFrame(rows)

    def mean(name: str) -> dict[str, float]:
        values = 100.0 * frame[name]
        error = values.std() / np.sqrt(len(values))
        found = {"mean_percent": values.mean(), "standard_error_percent": error, "sd_percent": values.std()}
        return {key: round(float(value), 4) for key, value in found.items()}

    def covered(name: str) -> dict[str, float]:
        held = int(frame[name].sum())
        return {"share_percent": round(100.0 * held / len(frame), 2), "held": held, "cases": len(frame)}

    names = {"C": "cornering_stiffness", "K": "lateral_stiffness", "length": "relaxation_length"}
    coverage = {name: covered(f"{short}_held") for short, name in names.items()}
    error = {name: mean(f"{short}_error") for short, name in names.items()}
    low, high = TARGETS["coverage_percent"]
    met = {f"coverage_{k}": low <= coverage[names[k]]["share_percent"] <= high for k in "CK"}
    met |= {f"bias_{k}": abs(error[names[k]]["mean_percent"]) < TARGETS[f"bias_{k}_percent"] for k in "CK"}
    zero = {way: round(float(frame[f"zero_force_error_{way}_lag_N"].abs().mean()), 3) for way in ("with", "without")}
    return {
        "coverage": coverage, "error": error,
        "without_lag_correction": {
            "cornering_stiffness": mean("C_error_no_lag"), "change_by_correction": mean("C_change_by_lag"),
            "coverage_cornering_stiffness": covered("C_held_no_lag"), "force_at_zero_slip_one_branch_N": zero,
        },
        "line_through_all_pull_points": mean("K_error_line"), "targets": TARGETS, "met": met,
    }  # fmt: skip


def one_campaign(seed: int, number: int) -> Row:
    """Simulate, write, read and fit campaign ``number`` of a ``seed``; its ``conditions``."""
    calibration = Calibration(repeatability=float(np.mean(REMOUNTING)))
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truths = write_campaign(folder, rng, calibration)
        fitted, plain = (
            fit_campaign(folder, settings=FitSettings(calibration, lag_correction=lag), progress=False, jobs=1)
            for lag in (True, False)
        )
        for condition, without in zip(fitted.conditions, plain.conditions, strict=True):
            c, k, zero = truths[condition.load]
            known = {"C": c, "K": k, "length": c / k}
            found = {"C": condition.cornering_stiffness, "K": condition.lateral_stiffness}
            row: dict[str, float] = {"load_N": condition.load}
            for key, one in (found | {"length": condition.relaxation_length}).items():
                assert one is not None
                row |= {f"{key}_error": one.value / known[key] - 1.0, f"{key}_held": float(one.covers(known[key]))}
            late = without.cornering_stiffness
            assert late is not None
            row |= {"C_error_no_lag": late.value / c - 1.0, "C_held_no_lag": float(late.covers(c))}
            row["C_change_by_lag"] = row["C_error"] - row["C_error_no_lag"]
            with_lag, no_lag = _one_branch(folder / condition.sweeps[0].file, c / k, zero)
            row |= {"zero_force_error_with_lag_N": with_lag, "zero_force_error_without_lag_N": no_lag}
            row["K_error_line"] = _line([folder / pull.file for pull in condition.pulls]) / k - 1.0
            rows.append(row)
    return {"seed": seed, "number": number, "conditions": rows}


def usual_faults(rng: np.random.Generator, calibration: Calibration) -> list[RigEffect]:
    """Draw what rigs do wrong."""
    return [
        PlySteer(force=rng.uniform(-10.0, 25.0), slip=np.deg2rad(rng.uniform(-0.3, 0.3))),
        RimCompliance(stiffness=10 ** rng.uniform(6.0, 7.0)),
        Remounting(sd=rng.uniform(*REMOUNTING)),
        TemperatureDrift(rise=rng.uniform(0.0, 4.0), per_kelvin=rng.uniform(-0.003, -0.001)),
        RigFriction(force=rng.uniform(0.5, 3.0), presliding=rng.uniform(2e-5, 1e-4)),
        SensorGain(**{key: rng.normal(0.0, getattr(calibration, key)) for key in ("force", "slip", "displacement")}),
        LoadCellDrift(rate=rng.normal(0.0, 3.0)),
        Noise(
            white=rng.uniform(1.5, 4.0), correlated=rng.uniform(0.5, 2.5),
            correlation_time=10 ** rng.uniform(-1.0, -0.3), pull=rng.uniform(0.1, 0.6),
        ),
        DialGauge(),
    ]  # fmt: skip


def write_campaign(
    folder: Path, rng: np.random.Generator, calibration: Calibration
) -> dict[float, tuple[float, float, float]]:
    """Draw a campaign and write its recordings; by load C (N/rad), K (N/m) and the force without slip (N)."""
    effects = usual_faults(rng, calibration)
    axes = str(rng.choice(["ISO", "SAE", "adapted SAE"]))
    pressure = PASCAL_PER_BAR * round(rng.uniform(3.5, 7.5), 1)
    loads = [float(round(rng.uniform(330.0, 400.0))), float(round(rng.uniform(420.0, 500.0)))]
    slow, ratio = np.deg2rad(rng.uniform(0.8, 1.5)), rng.uniform(2.0, 2.5)
    truths = {}
    for load in loads:
        tyre = drawn_tyre(load, pressure, rng)
        condition = Condition(tyre="Synthetic tyre", load=load, pressure=pressure, surface="flat", temperature=22.0)
        common: dict[str, Any] = {"condition": condition, "effects": effects, "rng": rng, "axes": axes}
        for number, faster in enumerate(SWEEPS):
            protocol = (
                Protocol(slip_rate=float(slow * ratio), cycles=4)
                if faster > 1
                else Protocol(slip_rate=float(slow), cycles=2)
            )
            write_csv(simulate_sweep(tyre=tyre, protocol=protocol, **common), folder / f"sweep_{load:g}N_{number}.csv")
        for number in range(PULLS):
            write_csv(simulate_pull(tyre=tyre, protocol=Protocol(), **common), folder / f"pull_{load:g}N_{number}.csv")
        (steer,) = (effect for effect in effects if isinstance(effect, PlySteer))
        real = steer.on_tyre(tyre, condition, rng)
        truths[load] = (real.cornering_stiffness, real.lateral_stiffness, float(real.steady_force(np.zeros(1))[0]))
    return truths


def drawn_tyre(load: float, pressure: float, rng: np.random.Generator) -> RigTyre:
    """Draw a tyre at a ``load`` (N) and ``pressure`` (Pa)."""
    usual = synthetic_tyre(load=load, pressure=pressure)
    return replace(
        usual, cornering_stiffness=usual.cornering_stiffness * rng.uniform(0.85, 1.1),
        lateral_stiffness=usual.lateral_stiffness * rng.uniform(0.85, 1.15), peak_force=load * rng.uniform(0.9, 1.2),
        shape=rng.uniform(1.2, 1.6), curvature=rng.uniform(-0.5, 0.5),
    )  # fmt: skip


def _one_branch(path: Path, length: float, truth: float) -> tuple[float, float]:
    """Error of the lateral force at zero slip from one branch alone, with the lag known and with the lag left in, N."""
    run = read_recording(path)
    assert isinstance(run, RigRun)
    turns = slip_reversals(run)
    arrays = {f.name: getattr(run, f.name) for f in fields(run) if isinstance(getattr(run, f.name), np.ndarray)}
    branch = replace(run, **{name: values[turns[1] : turns[2]] for name, values in arrays.items()})
    known, left = fit_slip_sweep(branch, relaxation_length=length), fit_slip_sweep(branch, lag_correction=False)
    zero = np.zeros(1)
    return float(known.steady_force(zero)[0]) - truth, float(left.steady_force(zero)[0]) - truth


def _line(files: list[Path]) -> float:
    """Slope of a straight line through all points of the lateral stiffness tests, N/m."""
    slopes = []
    for file in files:
        test = read_recording(file)
        assert isinstance(test, LateralStiffnessTest)
        slopes.append(float(np.polyfit(test.tyre_deflection, test.lateral_force, 1)[0]))
    return float(np.mean(slopes))
