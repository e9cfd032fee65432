"""Periodic motions of random models against shooting, and the sign of their first Lyapunov coefficient in time.

Bicycles are packaged ones with every number off by up to 15 %, tyres, curves and a flexible front are random
(synthetic). The equations and the Magic Formula of the judge stand in tests/shared/shooting.py: all they share with
velotyre is the linear state matrix. One motion a branch is compared, at a random speed of it and below 20 degrees.
At a critical speed no mode grows by the linear model, so that the cubic term alone decides: a small motion in the plane
of the mode is followed over eight periods.
"""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from bicycle import Model, effect_class, load_bicycle
from bicycle.motion import LimitCycles, MagicTyre, Onset, find_limit_cycles
from tests.shared.shooting import WHEELS, own_equations, own_state, shoot
from tests.validation.random_models import random_effect
from tyre.ground import InputError

BICYCLES = ("benchmark", "pista_rider", "browser", "rigid_rider", "pista_charlie_drops")
ALSO = ("luggage", "handlebar_bag", "rear_compliance", "rider_arms", "rider_lean", "crown_radius")
LARGEST, FASTEST = 20.0, 45.0  # degrees at the bar, m/s
SLIP = 0.2  # B s of the small motion, of 1 where a curve is far from straight
PERIODS = 8


def run(*, out: Path, seed: int, models: int = 200, signs: int = 100) -> dict[str, Any]:
    """Compare the motions of ``models``, and the sign of up to ``signs`` coefficients said to be determined."""
    from tyre.ground import progress_bar

    generator = np.random.default_rng(seed)
    errors: list[dict[str, Any]] = []
    tried: list[dict[str, Any]] = []
    lost, counts = [], {"refused": 0, "without_motion": 0, "branches": 0, "outside": 0, "onsets_not_determined": 0}
    counts |= {"points": 0, "points_beyond_16_harmonics": 0, "points_not_resolved": 0}
    for number in progress_bar(range(models), desc="models"):
        model, numbers = random_bicycle(generator)
        rear, front = (MagicTyre(*(value[k] for value in numbers.values())) for k in range(2))
        try:
            found = find_limit_cycles(model, rear=rear, front=front, max_speed=FASTEST)
        except InputError:
            counts["refused"] += 1
            continue
        counts["without_motion"] += int(not found.branches)
        for onset in found.onsets:
            counts["onsets_not_determined"] += int(onset.kind == "not determined")
            if onset.kind != "not determined" and len(tried) < signs:
                ratio = bend_in_time(model, onset, numbers) / onset.bend
                tried.append({"model": number, "speed_m_s": onset.critical.speed, "kind": onset.kind, "ratio": ratio})
        for branch in found.branches:
            counts["branches"] += 1
            speeds = [point.cycle.speed for point in branch.points]
            counts["points"] += len(speeds)
            counts["points_beyond_16_harmonics"] += sum(len(point.cycle.slips) > 16 for point in branch.points)
            counts["points_not_resolved"] += sum(not found.resolved(point.cycle) for point in branch.points)
            cycles = branch.at(generator.uniform(min(speeds), max(speeds)))
            below = [cycle for cycle in cycles if np.degrees(found.amplitude(cycle)) < LARGEST]
            if not below:
                counts["outside"] += 1
                continue
            cycle = below[generator.integers(len(below))]
            row = {"model": number, "mode": branch.mode, "speed_m_s": cycle.speed, "frequency_Hz": cycle.frequency_hz}
            row |= {"within_geometry": found.within_geometry(cycle), "harmonics": len(cycle.slips)}
            try:
                errors.append(row | against_shooting(model, found, cycle, numbers))
            except (AssertionError, np.linalg.LinAlgError, ValueError) as error:
                lost.append(row | {"error": str(error)})
    return counts | summary(errors) | {
        "shooting_lost": lost,
        "signs": len(tried),
        "signs_right": sum(bool(one["ratio"] > 0) for one in tried),
        "signs_wrong": [one for one in tried if not one["ratio"] > 0],
        "kinds": {kind: sum(one["kind"] == kind for one in tried) for kind in ("supercritical", "subcritical")},
        "bend_in_time_over_stated": quantiles([one["ratio"] for one in tried]),
    }  # fmt: skip


def random_bicycle(generator: np.random.Generator) -> tuple[Model, dict[str, Any]]:
    """Draw a bicycle on lagged slips, most with a flexible front, and D, C and E of its tyres (rear, front)."""
    while True:
        base = load_bicycle(str(generator.choice(BICYCLES)))
        changes = {key: value * generator.uniform(0.85, 1.15) for key, value in base.values.items() if key != "g"}
        names = ["relaxation_length", *(["front_compliance"] if generator.random() < 0.8 else [])]
        names += [name for name in ALSO if generator.random() < 0.2]
        try:
            effects = tuple(random_effect(effect_class(name), generator) for name in names)
            model = Model(base.replace(**changes), effects)
            model.linear_model()
        except InputError:
            continue  # no physical bicycle
        friction, shape, curvature = (
            generator.uniform(low, high, 2) for low, high in ((0.5, 1.1), (1.1, 1.6), (-1.0, 0.6))
        )
        return model, {"friction": friction, "shape": shape, "curvature": curvature}


def against_shooting(model: Model, found: LimitCycles, cycle: Any, numbers: dict[str, Any]) -> dict[str, float]:
    """Relative errors of amplitude and period of a ``cycle``."""
    rate, names = own_equations(model, cycle.speed, **numbers)
    start = own_state(model, found, cycle) * 1.002
    half, states = shoot(rate, start, cycle.period / 2 * 1.002, names.index("steer_rate"))
    own = np.abs(states[names.index("steer")]).max()
    amplitude, period = found.amplitude(cycle) / own, cycle.period / (2 * half)
    return {"amplitude": float(abs(amplitude - 1)), "period": float(abs(period - 1))}


def bend_in_time(model: Model, onset: Onset, numbers: dict[str, Any]) -> float:
    """Coefficient in a' = bend a^3 of the steer amplitude a, by a small motion at the critical speed, 1/(s rad^2)."""
    rate, names = own_equations(model, onset.critical.speed, **numbers)
    linear = model.linear_model()
    values, vectors = np.linalg.eig(linear.matrices_at(onset.critical.speed)[0])
    place = int(np.abs(values - 1j * onset.critical.angular_frequency).argmin())
    right = vectors[:, place] / vectors[names.index("steer"), place]
    left = np.linalg.inv(vectors)[place] * vectors[names.index("steer"), place]
    peaks = np.multiply(numbers["friction"], linear.static_loads) * numbers["shape"]
    share = [
        abs(right[names.index(f"{wheel}_lateral_force")]) / peak for wheel, peak in zip(WHEELS, peaks, strict=True)
    ]
    period = 2 * np.pi / abs(values[place].imag)
    times = np.linspace(0, PERIODS * period, 100 * PERIODS + 1)
    start = SLIP / max(share) * right.real
    x = solve_ivp(rate, (0, times[-1]), start, "DOP853", t_eval=times, rtol=1e-10, atol=1e-14).y
    size = 2 * np.abs(left @ x)[:-1].reshape(PERIODS, -1).mean(1)
    return float((1 / size[1] ** 2 - 1 / size[-1] ** 2) / (2 * period * (PERIODS - 2)))


def summary(errors: list[dict[str, Any]]) -> dict[str, Any]:
    """Errors of amplitude and period of all motions, of each mode and of those within linear geometry."""
    worst = sorted(errors, key=lambda one: -max(one["amplitude"] / 1e-5, one["period"] / 1e-6))
    groups = {mode: [one for one in errors if one["mode"] == mode] for mode in sorted({one["mode"] for one in errors})}
    groups |= {"all": errors, "within_linear_geometry": [one for one in errors if one["within_geometry"]]}
    told = {
        name: {
            "compared": len(rows),
            "amplitude_error": quantiles([one["amplitude"] for one in rows]),
            "period_error": quantiles([one["period"] for one in rows]),
            "amplitude_above_1e-5": sum(bool(one["amplitude"] > 1e-5) for one in rows),
            "period_above_1e-6": sum(bool(one["period"] > 1e-6) for one in rows),
        }
        for name, rows in groups.items()
    }
    return {"motions": told, "worst": worst[:9]}


def quantiles(values: list[float]) -> dict[str, float]:
    """Least, median, 95 % and largest of ``values``."""
    if not values:
        return {}
    return dict(
        zip(("least", "median", "p95", "largest"), np.quantile(values, [0, 0.5, 0.95, 1]).tolist(), strict=True)
    )
