"""Does the interval of a slip step hold the relaxation length on a rig that is not perfect? SYNTHETIC.

Tyres of 28 to 62 mm under 340 to 800 N roll at walking pace and are steered by one degree or so. Their slip lags, by
classical Runge-Kutta steps, and their force is a Magic Formula of many shapes. The rig: play in the slip drive that is
worth about 1 N, a force cell that drifts and whose noise has a memory, a load that wanders and swings once a turn of
the wheel, and gains of force, slip and speed that are 0.3 % off. Every tyre is also measured without these, with white
noise alone. Counted: 95 % intervals that hold the truth, the bias, and the scatter in units of the stated deviation.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.validation.cases import KeptCases, Row, attempted, share_of
from tyre.fits import fit_slip_step
from tyre.recordings import Condition, RigRun

Real = NDArray[np.float64]
RATE = 200.0  # Hz
TARGETS = {"disturbed_held": 28 / 30, "clean_held": 1.0}


def lagging_slip(slip: Real, speed: Real, length: float) -> Real:
    """Solve length / speed d(lagging)/dt + lagging = slip from rest; the slip is straight from sample to sample."""
    lagging = np.empty_like(slip)
    lagging[0] = slip[0]
    for k in range(1, slip.size):
        slips = slip[k - 1], (slip[k - 1] + slip[k]) / 2, slip[k]
        pace = (speed[k - 1] + speed[k]) / 2 / length / RATE
        old = lagging[k - 1]
        a = pace * (slips[0] - old)
        b = pace * (slips[1] - old - a / 2)
        c = pace * (slips[1] - old - b / 2)
        d = pace * (slips[2] - old - c)
        lagging[k] = old + (a + 2 * b + 2 * c + d) / 6
    return lagging


def slow_noise(count: int, seconds: float, rng: np.random.Generator) -> Real:
    """Noise of unit sd with a correlation time (s): a walk that is drawn back."""
    kept = np.exp(-1 / RATE / seconds)
    noise = np.empty(count)
    noise[0] = rng.standard_normal()
    for k in range(1, count):
        noise[k] = kept * noise[k - 1] + np.sqrt(1 - kept**2) * rng.standard_normal()
    return noise


def behind_play(driven: Real, play: float) -> Real:
    """Angle of a wheel whose drive has so much play; it may stand anywhere in it at first."""
    wheel, at = np.empty_like(driven), driven[0]
    for k, angle in enumerate(driven):
        at = min(max(at, angle - play / 2), angle + play / 2)
        wheel[k] = at
    return wheel


def roll(rng: np.random.Generator, *, disturbed: bool) -> tuple[RigRun, float]:
    """Roll a drawn tyre over a step of slip; also gives its relaxation length (m)."""
    load = rng.uniform(340, 800)
    stiffness, length = load * rng.uniform(9, 17), rng.uniform(0.05, 0.16)  # N/rad, m
    peak, shape, bend = load * rng.uniform(0.75, 1.15), rng.uniform(1.25, 1.6), rng.uniform(-1.0, 0.4)
    speed, turn = rng.uniform(0.3, 0.6), 2 * np.pi * rng.uniform(0.31, 0.36)  # m/s, m
    time = np.arange(round((1.1 + rng.uniform(8, 12) * length / speed) * RATE)) / RATE
    driven = np.deg2rad(rng.uniform(0.7, 1.3)) * np.clip((time - 1) / 0.06, 0, 1)
    pressed, wheel, pace, cell = np.ones_like(time), driven, np.full_like(time, speed), np.zeros_like(time)
    gains = np.ones(3)
    if disturbed:
        way = speed * time
        pressed = 1 + rng.uniform(0.01, 0.03) * np.sin(2 * np.pi * way / turn + rng.uniform(0, 6))
        pressed += rng.uniform(0.005, 0.015) * slow_noise(time.size, 2.0, rng)
        wheel = behind_play(driven, 2 * rng.uniform(0.5, 1.5) / stiffness)
        pace = speed * (1 + 0.005 * np.sin(2 * np.pi * rng.uniform(0.5, 2) * time + rng.uniform(0, 6)))
        cell = rng.normal(0, 0.5) * time + rng.uniform(1.0, 2.0) * slow_noise(time.size, rng.uniform(0.1, 0.5), rng)
        gains = 1 + 0.003 * rng.standard_normal(3)
    lagging = lagging_slip(wheel, pace, length)
    reduced = stiffness / (shape * peak) * lagging
    force = pressed * peak * np.sin(shape * np.arctan(reduced - bend * (reduced - np.arctan(reduced))))
    seen = gains[0] * force + cell + rng.uniform(1, 3) * rng.standard_normal(time.size) + rng.uniform(-8, 8)
    run = RigRun(
        condition=Condition(tyre="Stepped", load=load, pressure=4e5, surface="flat"),
        axes="adapted SAE",
        time=time,
        slip_angle=gains[1] * driven + np.deg2rad(0.003) * rng.standard_normal(time.size),
        lateral_force=seen,
        vertical_load=load * pressed + 3 * rng.standard_normal(time.size),
        speed=gains[2] * pace + 0.003 * rng.standard_normal(time.size),
        synthetic=True,
        kind="slip_step",
    )
    return run, length


def one_step(seed: int, number: int) -> Row:
    """Measure and fit tyre ``number``, disturbed and clean."""
    return attempted({"seed": seed, "number": number}, lambda _, row: _fitted(row))


def _fitted(row: Row) -> None:
    for name in ("disturbed", "clean"):
        rng = np.random.default_rng([row["seed"], row["number"]])
        run, length = roll(rng, disturbed=name == "disturbed")
        found = fit_slip_step(run).relaxation_length
        row[name] = {
            "deviation": found.value / length - 1,
            "z": (found.value - length) / found.sd,
            "relative_sd": found.sd / length,
            "held": found.covers(length),
        }


def run(*, out: Path, seed: int, tyres: int = 120, workers: int = 2) -> dict[str, Any]:
    """Measure and fit a number of ``tyres``."""
    kept = KeptCases(out / "disturbed_steps_cases.jsonl", ("seed", "number"))
    rows = kept.computed([(seed, number) for number in range(tyres)], one_step, workers=workers, what="tyres")
    sound = [row for row in rows if not row["error"]]
    parts = {name: summary([row[name] for row in sound]) for name in ("disturbed", "clean")}
    return {"targets": TARGETS} | parts | {"errors": [row["error"] for row in rows if row["error"]]}


def summary(rows: list[Row]) -> dict[str, Any]:
    """Count one kind."""
    deviation, z, sd = (np.array([row[name] for row in rows]) for name in ("deviation", "z", "relative_sd"))
    return {
        "held": share_of(rows, "held"),
        "bias_percent": round(100 * float(deviation.mean()), 2),
        "scatter_percent": round(100 * float(deviation.std(ddof=1)), 2),
        "median_stated_sd_percent": round(100 * float(np.median(sd)), 2),
        "rms_of_deviation_over_stated_sd": round(float(np.sqrt(np.mean(z**2))), 2),
    }
