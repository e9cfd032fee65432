"""Fronts that sway, SYNTHETIC: joints of random beam frames, tapped at three places, and their wobble.

Frequencies and ratios come from two rigid bodies on two hinges (:mod:`tests.validation.beam_front`), which share
nothing with the package. Wobble is that of the package for the true joints and for those that are fitted.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from tests.validation.beam_front import Front, TwoJoints, draw_front, hub_compliance, two_joint_modes

RIDDEN, UNRIDDEN, TYRE, BAR = "pista_charlie_drops", "pista", "Tyre1", 5.5
RIM, STEM = -0.31, 0.6  # m above the hub
SD = {"frequency": 1e-3, "damping": 0.03, "ratio": 0.005}
WRONG = 0.02  # of the damping ratio, beyond which one hinge is to be refused
EXACT = ("w", "c", "lam", "rF", "mH", "xH", "zH", "IHxx", "IHzz", "IHxz", "mF", "IFxx")


def draw_joints(seed: int) -> tuple[Front, TwoJoints, float, Any]:
    """Draw a beam frame, its two joints, the damping ratio of its first mode, and the source of errors."""
    rng = np.random.default_rng([310462, seed])
    front = draw_front(rng)
    length = float(rng.uniform(0.1, 0.3))
    stiffness, height, fork = hub_compliance(front).two_joints(length)
    return front, TwoJoints((stiffness, height), (fork, length)), float(rng.uniform(0.01, 0.05)), rng


def read_taps(joints: TwoJoints, ratio: float, p: Mapping[str, float], rng: Any) -> Any:
    """Numbers of one tap at rim, hub and stem, with the errors that :class:`bicycle.standing.Errors` states."""
    from bicycle.standing import Errors, Place, Ratio, Readings, Tap

    errors = Errors()
    true_places = [above + errors.place * float(rng.standard_normal()) for above in (RIM, STEM)]
    hertz, shapes = two_joint_modes(p, joints, true_places)
    gains = 1 + errors.gain * rng.standard_normal(2)
    noise = rng.standard_normal(4)
    sds = SD["frequency"] * hertz[0], SD["damping"] * ratio
    ratios = tuple(
        Ratio(Place(above, on), Place(0.0), float(gain * shape + SD["ratio"] * error), SD["ratio"])
        for above, on, gain, shape, error in zip(
            (RIM, STEM), ("wheel", "fork"), gains, shapes[:, 0], noise[2:], strict=True
        )
    )
    tap = Tap("tap", hertz[0] + sds[0] * noise[0], sds[0], ratio + sds[1] * noise[1], sds[1], ratios)
    return Readings((), (tap,))


def lowest_damping(values: Mapping[str, float]) -> float:
    """Lowest damping ratio of wobble from 3 to 20 m/s, hands off, of a ridden bicycle with these joints."""
    from bicycle import load_bicycle
    from bicycle.model import build_model

    tables: dict[str, dict[str, Any]] = {}
    for key, value in values.items():
        effect, _, name = key.partition(".")
        tables.setdefault(effect, {})[name] = value
    loads = dict(zip(("rear", "front"), load_bicycle(RIDDEN).static_loads, strict=True))
    effects = tables | {
        "relaxation_length": {"tyre": TYRE, "pressure_bar": BAR},
        "camber_thrust": {"camber_stiffness": {wheel: 0.685 * load for wheel, load in loads.items()}},
        "pneumatic_trail": {"trail": 0.019},
        "twisting_torque": {"twisting_stiffness": 5.4},
    }
    model = build_model({"bicycle": RIDDEN, "effects": effects, "allow_unusual": True}).linear_model()
    lowest = math.inf
    for roots in np.linalg.eigvals(model.state_matrix(np.arange(3.0, 20.01, 0.5))):
        hertz = np.abs(roots.imag) / (2 * math.pi)
        wobble = (hertz > 3) & (hertz < 15)
        if wobble.any():
            lowest = min(lowest, float((-roots.real / np.abs(roots))[wobble].min()))
    return lowest


def true_values(joints: TwoJoints, ratio: float, p: Mapping[str, float]) -> dict[str, float]:
    """Parameters of the package's two joints, their damping in proportion to their stiffness."""
    (stiffness, height), (fork, length) = joints.frame, joints.fork
    hertz, _ = two_joint_modes(p, joints, [0.0])
    time = 2 * ratio / (2 * math.pi * hertz[0])
    sine, cosine = math.sin(p["lam"]), math.cos(p["lam"])
    joint_z = -(p["c"] * sine + p["rF"] * cosine + height) * cosine
    return {
        "front_compliance.stiffness": stiffness,
        "front_compliance.damping": time * stiffness,
        "front_compliance.joint_x": p["w"] + p["c"] + joint_z * math.tan(p["lam"]),
        "front_compliance.joint_z": joint_z,
        "fork_bending.stiffness": fork,
        "fork_bending.damping": time * fork,
        "fork_bending.length": length,
    }


def wobble_and_sd(fit: Any) -> tuple[float, float]:
    """Lowest damping ratio of wobble with the joints of a fit, and its standard uncertainty by their covariance."""
    keys = list(fit.values)
    middle = lowest_damping(fit.values)
    sds = np.sqrt(np.maximum(np.linalg.eigvalsh(fit.covariance), 0.0))
    directions = np.linalg.eigh(fit.covariance)[1]
    variance = 0.0
    for sd, direction in zip(sds, directions.T, strict=True):
        step = fit.factor @ (sd * direction)
        ends = []
        for sign in (1.0, -1.0):
            moved = {key: fit.values[key] + sign * by for key, by in zip(keys, step, strict=True)}
            moved = {k: max(v, 0.05 * fit.values[k]) if k.endswith(("stiffness", "damping")) else v
                     for k, v in moved.items()}  # fmt: skip
            ends.append(lowest_damping(moved))
        variance += ((ends[0] - ends[1]) / 2) ** 2
    return middle, math.sqrt(variance)


def sway(seed: int) -> dict[str, Any]:
    """One front that sways: how the fitted joints wobble, and whether one hinge is refused."""
    from bicycle import Model, load_bicycle
    from bicycle.standing import ONE_HINGE, measure_front

    bicycle = load_bicycle(UNRIDDEN)
    _, joints, ratio, rng = draw_joints(seed)
    readings = read_taps(joints, ratio, bicycle.values, rng)
    result = measure_front(readings, Model(bicycle), dict.fromkeys(EXACT, 0.0))
    truth = lowest_damping(true_values(joints, ratio, bicycle.values))
    one = lowest_damping(result.fits[ONE_HINGE.name].values)
    row: dict[str, Any] = {
        "seed": seed, "outcome": str(result.outcome), "truth": truth, "one_hinge_error": one - truth,
        "sway_stiffness": joints.frame[0], "sway_height": joints.frame[1], "fork": joints.fork[0],
    }  # fmt: skip
    if result.fit is not None:
        found, sd = wobble_and_sd(result.fit)
        row |= {"error": found - truth, "sd": sd, "within_2_sd": abs(found - truth) <= 2 * sd}
    return row


def sway_summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Errors of wobble, and how often one hinge is refused where it is wrong."""
    from tests.validation.cases import share

    used = [row for row in rows if row["outcome"] == "two_joints"]
    wrong = [row for row in rows if abs(row["one_hinge_error"]) > WRONG]
    errors = np.array([row["error"] for row in used])
    return {
        "fronts": len(rows),
        "two_joints": len(used),
        "rms_of_lowest_damping": round(float(np.sqrt((errors**2).mean())), 5) if len(errors) else None,
        "bias_of_lowest_damping": round(float(errors.mean()), 5) if len(errors) else None,
        "median_stated_sd": round(float(np.median([row["sd"] for row in used])), 5) if used else None,
        "within_2_sd": share(sum(row["within_2_sd"] for row in used), len(used)),
        "one_hinge_refused_where_wrong": share(sum(row["outcome"] != "one_hinge" for row in wrong), len(wrong)),
    }
