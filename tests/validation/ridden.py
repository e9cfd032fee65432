"""What spoils real rides: named, or not known, or taken for physics? SYNTHETIC rides with one such cause each.

A box of gyros that is turned, pedalling, coasting down, gusts, a rider who sways, a recorder whose clock runs off; half
of the cases have an effect of the library hidden beside it. The motion is integrated by Runge-Kutta along the speed
that the ride has, from the blind test's own chain of bodies; the gyros turn with the finite lean. Nothing here is
shared with the fitter.
"""

from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from bicycle import load_bicycle
from studies.diagnosis import diagnose, read_measurement
from tests.validation.blind.closing import Machine, Space, at_speed
from tests.validation.blind.hidden import RIDDEN, UNRIDDEN, base_effects, hide, perturbed, uncertainty
from tests.validation.blind.histories import Run, coloured, write_histories
from tests.validation.cases import KeptCases, Row, attempted, share_of
from tyre.ground import Array

STEP, SUBSTEPS = 0.02, 4  # s
DURATION, SPEEDS, TWICE = 3.0, 4, 2
NOISE = {"roll_rate_rad_s": 0.02, "steer_rad": 0.004, "yaw_rate_rad_s": 0.01}
HIDDEN = ("steer_damper", "steer_spring", "pneumatic_trail")
Random = np.random.Generator

ANSWERS: Mapping[str, tuple[str, ...]] = {
    "rotated": ("imu_rotation",),
    "pedalling": ("pedalling", "rider_sway", "side_gusts"),
    "coast_down": ("coast_down",),
    "gusts": ("side_gusts", "rider_sway"),
    "sway": ("rider_sway", "side_gusts"),
    "clock": ("imu_clock",),
    "none": (),
}
"""Cause, and the names that are right for it; torques of the ride differ in how they change, and are one family."""


def signed(rng: Random, low: float, high: float) -> float:
    """Draw a number of either sign."""
    return float(rng.choice([-1, 1]) * rng.uniform(low, high))


def disturbance(cause: str, time: Array, mass: float, rng: Random) -> Array:
    """Steer torque, lean torque (N m) and lateral force (N), (3, samples), at ``time``, finer than recorded."""
    found, t = np.zeros((3, len(time))), time
    if cause == "pedalling":
        hertz = rng.uniform(1.0, 1.6)
        for row, size in ((0, rng.uniform(0.05, 0.2)), (1, 0.02 * mass * rng.uniform(1.0, 3.0))):
            found[row] = size * np.sin(2 * np.pi * hertz * t + rng.uniform(0, 6.28))
    elif cause == "sway":
        for _ in range(3):
            turn = 2 * np.pi * rng.uniform(0.1, 0.5) * t + rng.uniform(0, 6.28)
            found[1] += 0.015 * mass * rng.uniform(0.5, 2.0) * np.sin(turn)
    elif cause == "gusts":
        keep = np.exp(-(t[1] - t[0]) / 0.25)
        found[2] = coloured(len(t), 0.06 * mass * rng.uniform(0.5, 1.5), keep, rng)
    return found


def motion(
    machine: Machine, speed: Callable[[float], float], pushed: Array, start: Array, aside: tuple[float, float]
) -> Array:
    """States (samples, n) along a ``speed`` in time, ``pushed`` (3, finer samples) from ``start`` (n,)."""
    h, count = STEP / SUBSTEPS, pushed.shape[1]

    @lru_cache(maxsize=8)
    def at(v: float) -> Space:
        return at_speed(machine.coefficients, machine.law, v, machine.maxwell, aside)

    def rate(k: float, x: Array) -> Array:
        space, low = at(speed(k * h)), int(k)
        u = pushed[:, low] + (k - low) * (pushed[:, min(low + 1, count - 1)] - pushed[:, low])
        return space.matrix @ x + space.inputs @ u

    found, x = [start], start
    for k in range(count - 1):
        a = rate(k, x)
        b = rate(k + 0.5, x + h / 2 * a)
        c = rate(k + 0.5, x + h / 2 * b)
        x = x + h / 6 * (a + 2 * b + 2 * c + rate(k + 1, x + h * c))
        if (k + 1) % SUBSTEPS == 0:
            found.append(x)
    return np.array(found)


def seen(space_outputs: Mapping[str, Array], states: Array, box: Array) -> dict[str, Array]:
    """Channels of a box of gyros turned by ``box`` (3, 3), and of the steer encoder."""
    lean, yaw = states @ space_outputs["lean"], states @ space_outputs["yaw_rate"]
    body = np.stack([states @ space_outputs["lean_rate"], yaw * np.sin(lean), yaw * np.cos(lean)])
    gyros = box.T @ body
    return {"roll_rate_rad_s": gyros[0], "steer_rad": states @ space_outputs["steer"], "yaw_rate_rad_s": gyros[2]}


def turned(roll: float, pitch: float, yaw: float) -> Array:
    """Rotation matrix of a box turned by yaw, then pitch, then roll, rad."""

    def about(axis: int, angle: float) -> Array:
        i, j = [k for k in range(3) if k != axis]
        found, sign = np.eye(3), -1.0 if axis != 1 else 1.0
        found[i, i] = found[j, j] = np.cos(angle)
        found[i, j], found[j, i] = sign * np.sin(angle), -sign * np.sin(angle)
        return found

    return about(2, yaw) @ about(1, pitch) @ about(0, roll)


class Unrideable(Exception):
    """No four speeds below 10.3 m/s at which the motion of a run stays small."""


def rideable(hidden: tuple[str, ...], nominal: Any, real: Any, effects: Any, rng: Random) -> tuple[Any, Machine, Array]:
    """What is hidden, its machine and four speeds, 2.8 m/s in all, at which it can be ridden; drawn until there are."""
    for _ in range(50):
        drawn, machine = hide(hidden, nominal, real, effects, rng)
        for lowest in np.arange(4.2, 7.6, 0.25):
            speeds = np.linspace(lowest, lowest + 2.8, SPEEDS) + rng.uniform(-0.2, 0.2, SPEEDS)
            if all(machine.growth(speed) * DURATION <= 2.0 for speed in speeds):
                return drawn, machine, speeds
    raise Unrideable(f"{nominal.name} with {', '.join(hidden)}")


def make(folder: Path, cause: str, hidden: tuple[str, ...], rng: Random, *, twice: int = TWICE) -> dict[str, Any]:
    """Write MEASUREMENT.toml and ``twice`` runs at each of four speeds; what is hidden."""
    ridden = cause in ("pedalling", "sway") or rng.random() < 0.3
    nominal = load_bicycle(str(rng.choice(RIDDEN if ridden else UNRIDDEN)))
    sd = uncertainty(nominal)
    real, effects = perturbed(nominal, sd, rng), base_effects("slipping", nominal.static_loads, rng)
    drawn, machine, speeds = rideable(hidden, nominal, real, effects, rng)
    degrees = (
        np.radians([signed(rng, 1, 5), signed(rng, 5, 12), signed(rng, 1, 5)]) if cause == "rotated" else np.zeros(3)
    )
    box = turned(*degrees)
    slows = rng.uniform(0.15, 0.5) if cause == "coast_down" else 0.0
    late, skew = (signed(rng, 0.005, 0.03), signed(rng, 0.002, 0.01)) if cause == "clock" else (0.0, 0.0)
    time = np.arange(round(DURATION / STEP) + 1) * STEP
    fine = np.arange((len(time) - 1) * SUBSTEPS + 1) * STEP / SUBSTEPS
    aside, colour = (0.35, 0.9), float(rng.uniform(0.2, 0.6))
    made = []
    for speed in np.repeat(speeds, twice):
        first = at_speed(machine.coefficients, machine.law, speed, machine.maxwell, aside)
        start = np.zeros(len(first.matrix))
        for name, size in (("lean_rate", signed(rng, 0.3, 0.7)), ("steer", rng.normal(0, 0.02))):
            start += size * np.linalg.pinv(first.outputs[name][None])[:, 0]
        pushed = disturbance(cause, fine, real["mB"], rng)
        states = motion(machine, lambda t, v=speed: v - slows * (t - DURATION / 2), pushed, start, aside)
        largest = float(np.abs(states @ first.outputs["lean"]).max())
        if largest > 0.2:  # such a ride is not kept: an easier kick, and less of what spoils it
            states *= 0.2 / largest
        channels = seen(first.outputs, states, box)
        for name in ("roll_rate_rad_s", "yaw_rate_rad_s"):  # the box has a clock of its own
            channels[name] = np.interp(time * (1 + skew) - late, time, channels[name])
        inside = slice(3, len(time) - 3) if cause == "clock" else slice(None)
        run = Run(round(float(speed), 3), time[inside], {k: x[inside] for k, x in channels.items()}, None)
        run.seen = {k: x + coloured(len(x), NOISE[k], colour, rng) for k, x in run.channels.items()}
        made.append(run)
    content = {
        "kind": "histories", "description": "synthetic", "bicycle": nominal.name, "effects": effects,
        "uncertainty": sd, "histories": {},
    }  # fmt: skip
    write_histories(folder, content, made)
    told = {"rotated_deg": np.degrees(degrees).tolist(), "deceleration": slows, "late": late, "skew": skew}
    return {"cause": told, "effects": drawn}


def run(*, out: Path, seed: int, cases: int = 4, workers: int = 2) -> dict[str, Any]:
    """Make and diagnose so many ``cases`` of each cause, with nothing and with an effect hidden beside it."""
    wanted = [(cause, seed + k, beside) for k in range(cases) for cause in ANSWERS for beside in (0, 1)]
    rows = KeptCases(out / "ridden_cases.jsonl", ("cause", "seed", "beside")).computed(
        wanted, one_case, workers=workers, what="ridden"
    )
    return {"errors": [row["error"] for row in rows if row["error"]], **summary([r for r in rows if not r["error"]])}


def one_case(cause: str, seed: int, beside: int) -> Row:
    """Make and diagnose one case."""
    return attempted({"cause": cause, "seed": seed, "beside": beside}, partial(_judged, cause, seed, beside))


def _judged(cause: str, seed: int, beside: int, folder: Path, row: Row) -> None:
    rng = np.random.default_rng([seed, list(ANSWERS).index(cause), beside])
    for hidden in [(str(name),) for name in rng.permutation(HIDDEN)] if beside else [()]:
        try:
            truth = make(folder, cause, hidden, rng)
            break
        except Unrideable:  # as with a long trail under a rider's weight: another effect is hidden
            continue
    row |= judged(diagnose(read_measurement(folder / "MEASUREMENT.toml")).verdict, cause, hidden) | {
        "truth": str(truth)
    }


def judged(verdict: Any, cause: str, hidden: tuple[str, ...]) -> Row:
    """Score a ``verdict``: what it names, whether it names something false, whether it finds what is ``hidden``."""
    members = [set(name.split("+")) for name in verdict.equivalent] or [set()]
    named = {e.identifier for e in verdict.effects}
    right = {*ANSWERS[cause], *hidden, "yaw_gyro_leans"}  # as the gyros of these rides do
    physics = {e.identifier for e in verdict.effects if not e.mistake}
    return {
        "hidden": list(hidden), "verdict": verdict.verdict, "named": sorted(named), "class": list(verdict.equivalent),
        # nothing false in what leads; or one of its class has nothing false
        "not_wrong": verdict.verdict in ("none", "unknown") or any(member <= right for member in members),
        "no_false_physics": physics <= right,
        "cause_named": bool(named & set(ANSWERS[cause])),
        "effect_found": bool(hidden) and any(set(hidden) <= member for member in members),
    }  # fmt: skip


def summary(rows: list[Row]) -> dict[str, Any]:
    """Count by cause, and over all causes."""
    spoilt = [row for row in rows if row["cause"] != "none"]
    groups = {cause: [row for row in rows if row["cause"] == cause] for cause in ANSWERS} | {"every cause": spoilt}
    return {
        name: {
            "rightly_named_or_not_known": share_of(some, "not_wrong"),
            "cause_named": share_of(some, "cause_named"),
            "effect_found_beside": share_of([row for row in some if row["hidden"]], "effect_found"),
        }
        for name, some in groups.items()
    }  # fmt: skip
