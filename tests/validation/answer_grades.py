"""Bicycles whose every number is drawn and then known: how often the grade of the main study's answer is right.

Each case is a packaged bicycle with a rider on a measured tyre. Its owner knows the bicycle, the tyre and, in half of
the cases, the front frame to about a tenth. What nobody measured is drawn from the ranges below, which are written here
from the documentation and not taken from the package. Wobble grows by 0.5 1/s or more and counts from 4 m/s and the
weave speed on. The truth is computed from Kane's equations (``kane_bicycle``), which share no code with the package.

A grade *yes* or *probably* is right if lower pressure truly widens the range by at least 1 m/s, or raises the fastest
growth at 3 to 20 m/s by at least 0.5 1/s, in its direction; *little difference* if neither is so.
"""

import json
import math
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.files import load_bicycle
from bicycle.parameters import Bicycle
from tests.validation.kane_bicycle import KaneBicycle

BICYCLES = ("pista_charlie_drops", "pista_charlie_hoods", "pista_charlie_upright", "pista_rider", "benchmark",
            "rigid_rider", "rigid_rider_joined")  # fmt: skip
TYRES = ("Tyre1", "Tyre2", "Tyre3")
EFFECTS = ("camber_thrust", "front_compliance", "pneumatic_trail", "relaxation_length", "steer_damper",
           "twisting_torque")  # fmt: skip
RANGES = {
    # a positive lower end: logarithmically even; else even
    "stiffness": (2500.0, 10000.0),  # N m/rad, of the front frame
    "damping_ratio": (0.15, 0.40),  # of the front on its hinge: frame and seated rider together
    "hinge": (0.55, 0.75),  # m above the ground, on the steer axis
    "friction": (0.05, 0.35),  # N m s/rad, of the steering
    "camber_share": (0.43, 0.94),  # 1/rad of the wheel load
    "trail": (0.012, 0.026),  # m, pneumatic trail
    "twisting": (2.4, 12.0),  # N m/rad
}
SD_OF_TYRE = {"stiffness": 0.02, "length": 0.03}  # relative standard uncertainty, common to the pressures of a rig
SD_OF_OWNER = 0.1  # relative, of a front frame that was measured
SPEEDS = np.arange(0.25, 30.01, 0.5)  # m/s
WOBBLE_HZ = (4.0, 15.0)
GROWTH = 0.5  # 1/s, from which wobble counts
HANDS_OFF = 4.0  # m/s, below which nobody rides hands off
PRACTICAL = 1.0  # m/s
PRACTICAL_GROWTH = 0.5  # 1/s
RIDDEN = (3.0, 20.0)  # m/s, speeds of the fastest growth


@dataclass(frozen=True)
class Case:
    """One bicycle whose numbers are known, and what its owner knows of it."""

    seed: int
    bicycle: Bicycle  # as its owner knows it
    tyre: str
    numbers: dict[str, float]  # of RANGES, SI
    # stiffness, damping ratio and hinge of the front frame as its owner measured them; or empty
    measured: dict[str, float]
    errors: NDArray[Any]  # (2, 4): relative, of stiffness and length, rear then front; alike at each pressure


def draw(seed: int) -> Case:
    """Draw a case from a ``seed``."""
    rng = np.random.default_rng([281159, seed])
    numbers = {}
    for name, (low, high) in RANGES.items():
        share = rng.random()
        numbers[name] = low * (high / low) ** share if low > 0 else low + (high - low) * share
    measured = {}
    if rng.random() < 0.5:
        for name in ("stiffness", "damping_ratio"):
            measured[name] = numbers[name] * math.exp(SD_OF_OWNER * rng.standard_normal())
        measured["hinge"] = numbers["hinge"] + 0.01 * rng.standard_normal()
    sd = np.tile([SD_OF_TYRE["stiffness"], SD_OF_TYRE["length"]], 2)
    errors = np.tile(sd * rng.standard_normal(4), (2, 1))
    return Case(seed, load_bicycle(str(rng.choice(BICYCLES))), str(rng.choice(TYRES)), numbers, measured, errors)


def true_wobble(case: Case, contact: NDArray[Any]) -> tuple[float, float]:
    """Length (m/s) from the first to the last speed of wobble up to 30 m/s, hands off, and its fastest growth (1/s).

    Growth too slow for wobble is that from which it counts.

    ``contact`` (4,): cornering stiffness N/rad and relaxation length m, rear then front.
    """
    growth, weave = true_growth(case, contact, {})
    slowest = max(HANDS_OFF, float(SPEEDS[np.argmax(weave <= 0)]))
    peak = max(GROWTH, float(growth[(RIDDEN[0] <= SPEEDS) & (RIDDEN[1] >= SPEEDS)].max()))
    wobbles = np.flatnonzero((growth >= GROWTH) & (slowest <= SPEEDS))
    if not len(wobbles):
        return 0.0, peak
    return _crossing(growth, wobbles[-1], 1) - max(slowest, _crossing(growth, wobbles[0], -1)), peak


def true_growth(case: Case, contact: NDArray[Any], arms: dict[str, float]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Growth rates (1/s) of wobble and of weave at ``SPEEDS``; ``arms``: inertia, stiffness, damping (SI), or empty."""
    p, numbers = case.bicycle.values, case.numbers
    rear_load, front_load = _wheel_loads(p)
    height = numbers["hinge"]
    inertia = _inertia(p, height)
    parameters = {
        **p,
        "front_compliance.stiffness": numbers["stiffness"],
        "front_compliance.damping": numbers["damping_ratio"] * 2 * math.sqrt(numbers["stiffness"] * inertia),
        "front_compliance.joint_x": p["w"] + p["c"] - height * math.tan(p["lam"]),
        "front_compliance.joint_z": -height,
        "front_compliance.axis_tilt": p["lam"],
        "steer_damper.damping": numbers["friction"],
        "camber_thrust.lag_share": 1.0,
    }
    for k, (wheel, load) in enumerate((("rear", rear_load), ("front", front_load))):
        parameters[f"relaxation_length.cornering_stiffness.{wheel}"] = contact[2 * k]
        parameters[f"relaxation_length.relaxation_length.{wheel}"] = contact[2 * k + 1]
        parameters[f"camber_thrust.camber_stiffness.{wheel}"] = numbers["camber_share"] * load
        parameters[f"pneumatic_trail.trail.{wheel}"] = numbers["trail"]
        parameters[f"twisting_torque.twisting_stiffness.{wheel}"] = numbers["twisting"]
    effects = EFFECTS
    if arms:
        effects += ("rider_arms",)
        parameters |= {f"rider_arms.{name}": value for name, value in arms.items()}
    matrices = [KaneBicycle(parameters, effects, v).state_matrix()[1] for v in SPEEDS]
    growth = np.array([_growth(matrix, *WOBBLE_HZ) for matrix in matrices])
    return growth, np.array([_growth(matrix, 0.0, WOBBLE_HZ[0]) for matrix in matrices])


def _inertia(p: Any, height: float) -> float:
    """Inertia (kg m^2) of handlebar, fork and wheel about a hinge across the steer axis at a height (m)."""
    sine, cosine = math.sin(p["lam"]), math.cos(p["lam"])
    x, z = p["w"] + p["c"] - height * math.tan(p["lam"]), -height
    arms = [sine * (a - x) + cosine * (b - z) for a, b in ((p["xH"], p["zH"]), (p["w"], -p["rF"]))]
    about_centres = p["IHxx"] * cosine**2 + p["IHzz"] * sine**2 - 2 * p["IHxz"] * sine * cosine + p["IFxx"]
    return float(about_centres + p["mH"] * arms[0] ** 2 + p["mF"] * arms[1] ** 2)


def _wheel_loads(p: Any) -> tuple[float, float]:
    """Loads of rear and front wheel at rest, N, by moments about the contacts."""
    masses = np.array([p["mR"], p["mB"], p["mH"], p["mF"]])
    places = np.array([0.0, p["xB"], p["xH"], p["w"]])
    front = p["g"] * float(masses @ places) / p["w"]
    return p["g"] * float(masses.sum()) - front, front


def _growth(matrix: NDArray[Any], slowest: float, fastest: float) -> float:
    """Largest real part (1/s) of the oscillations between two frequencies (Hz); -1 without one."""
    roots = np.linalg.eigvals(matrix)
    hertz = roots.imag / (2 * np.pi)
    chosen = roots[(hertz > 0) & (hertz >= slowest) & (hertz < fastest)]
    return float(chosen.real.max()) if len(chosen) else -1.0


def _crossing(growth: NDArray[Any], k: int, side: int) -> float:
    """Speed (m/s) past point ``k`` at which wobble begins or ceases, by a straight line, or the end of the range."""
    j = k + side
    if not 0 <= j < len(SPEEDS):
        return 0.0 if side < 0 else float(SPEEDS[-1])
    return float(SPEEDS[k] + (SPEEDS[j] - SPEEDS[k]) * (growth[k] - GROWTH) / (growth[k] - growth[j]))


def question(case: Case) -> tuple[str, NDArray[Any], int]:
    """What the package answers its owner: the grade, and the tyre (2, 4) at the lowest and highest pressure."""
    from studies.main_study import Front, Settings, grade, sample_bicycles, tyre_cases

    known = case.measured
    front = Front()
    if known:
        front = Front(known["stiffness"], known["damping_ratio"], known["hinge"], from_file=True)
    settings = Settings(case.bicycle, tyre=case.tyre, front=front, seed=case.seed)
    cases = sorted(tyre_cases(settings).studied, key=lambda one: one.pressure_bar)
    ends = cases[0], cases[-1]
    samples = [sample_bicycles(settings, end, settings.reference) for end in ends]
    graded = grade(settings, ("trail", "twisting", "camber_share"), *samples)
    return str(graded.grade), np.array([end.contact for end in ends]), graded.for_it


def judge(seed: int) -> dict[str, Any]:
    """Answer and truth of one case."""
    case = draw(seed)
    answer, contact, worse = question(case)
    low, high = (true_wobble(case, one * (1 + error)) for one, error in zip(contact, case.errors, strict=True))
    by_range, by_growth = low[0] - high[0], low[1] - high[1]
    truth = np.sign(by_range) * (abs(by_range) >= PRACTICAL) + np.sign(by_growth) * (abs(by_growth) >= PRACTICAL_GROWTH)
    return {
        "seed": seed, "bicycle": case.bicycle.name, "tyre": case.tyre, "front_measured": bool(case.measured),
        "answer": answer, "worse_samples": worse, "low_m_s": low[0], "high_m_s": high[0],
        "low_1_s": low[1], "high_1_s": high[1], "truth": int(np.sign(truth)),
    }  # fmt: skip


AGREES = {"yes": 1, "probably": 1, "no": -1, "probably_not": -1, "little_difference": 0}


def run(*, out: Path, seed: int, cases: int = 200, workers: int = 2) -> dict[str, Any]:
    """Count right grades of ``cases`` bicycles, with Wilson's 95 % intervals; every case goes to a file."""
    from bicycle.effects import model_workers
    from tests.validation.cases import wilson

    with model_workers(workers) as pool:
        rows = list(pool.map(judge, range(seed, seed + cases)))
    lines = "".join(json.dumps(row) + "\n" for row in rows)
    (out / "answer_grades_cases.jsonl").write_text(lines, encoding="utf-8")
    grades = {}
    for answer, number in Counter(row["answer"] for row in rows).most_common():
        chosen = [row for row in rows if row["answer"] == answer]
        grades[answer] = {"cases": number, "truth": dict(Counter(str(row["truth"]) for row in chosen))}
        if answer in AGREES:
            right = sum(row["truth"] == AGREES[answer] for row in chosen)
            grades[answer] |= {"right": right, "interval": [round(end, 3) for end in wilson(right, number)]}
    return {"grades": grades}
