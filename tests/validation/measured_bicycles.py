"""Bicycles whose front frame, steering friction and hands were measured: is it said if they wobble, and rightly?

Each is a case of ``answer_grades``, with arms of its own. Its owner knows what a half-hour test leaves: stiffness of
the front to 1.5 %, hinge to 4 mm, damping to 5 %, friction to 10 %, inertia and damping of the arms to 9 %. The tyre's
moments and the bicycle stay as uncertain as they are. The truth comes from Kane's equations. It counts wobble of
0.5 1/s or more at 3 to 20 m/s; hands off from 4 m/s and the weave speed on.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.answer_grades import GROWTH, HANDS_OFF, RIDDEN, SPEEDS, Case, draw, true_growth

RELAXED = {"inertia": 0.1, "stiffness": 5.0, "damping": 1.0}  # kg m^2, N m/rad, N m s/rad
SD = {
    "stiffness": 0.015, "damping_ratio": 0.05, "friction": 0.10,  # relative
    "hinge": 0.004,  # m
    "arms": 0.09,  # relative
}  # fmt: skip


def judge(seed: int) -> dict[str, Any]:
    """Grades and truths of one bicycle, hands off and on, with nothing measured and with all measured."""
    rng = np.random.default_rng([611129, seed])
    case = draw(seed)
    arms = {name: value * math.exp(rng.uniform(-math.log(2), math.log(2))) for name, value in RELAXED.items()}
    today, contact = grades(case, {}, {})
    seen = {name: case.numbers[name] * math.exp(SD[name] * rng.standard_normal())
            for name in ("stiffness", "damping_ratio", "friction")}  # fmt: skip
    seen["hinge"] = case.numbers["hinge"] + SD["hinge"] * rng.standard_normal()
    held = {name: value * math.exp(SD["arms"] * rng.standard_normal()) for name, value in arms.items()}
    measured, _ = grades(case, seen, held)
    true_contact = contact * (1 + case.errors[0])
    row: dict[str, Any] = {"seed": seed, "bicycle": case.bicycle.name, "tyre": case.tyre}
    for hands, of_arms in (("off", {}), ("on", arms)):
        truth = truly_wobbles(case, true_contact, of_arms)
        row[hands] = {"truth": truth, "today": today[hands], "measured": measured[hands]}
    return row


def truly_wobbles(case: Case, contact: Any, arms: dict[str, float]) -> bool:
    """Whether the bicycle wobbles at ridden speeds."""
    growth, weave = true_growth(case, contact, arms)
    slowest = RIDDEN[0] if arms else max(HANDS_OFF, float(SPEEDS[np.argmax(weave <= 0)]))
    return bool((growth[(slowest <= SPEEDS) & (RIDDEN[1] >= SPEEDS)] >= GROWTH).any())


def grades(case: Case, seen: dict[str, float], held: dict[str, float]) -> tuple[dict[str, str], Any]:
    """What the package answers, hands off and relaxed, and the tyre's numbers that it takes."""
    from bicycle.parameters import ParameterCovariance
    from studies.main_study import Arms, Front, Settings, grade_samples, sample_bicycles, tyre_cases

    options: dict[str, Any] = {"tyre": case.tyre, "pressures": (5.5,), "seed": case.seed}
    if seen:
        front = Front(seen["stiffness"], seen["damping_ratio"], seen["hinge"], from_file=True)
        damping = float(front.damping(case.bicycle.values))
        sds = {
            "front_compliance.stiffness": SD["stiffness"] * front.stiffness,
            "front_compliance.damping": SD["damping_ratio"] * damping,
            "front_compliance.joint_z": SD["hinge"],
            "steer_damper.damping": SD["friction"] * seen["friction"],
        } | {f"rider_arms.{name}": SD["arms"] * value for name, value in held.items()}
        options |= {
            "front": front,
            "arms": Arms(**held, grip="", from_file=True),
            "further": {"steer_damper": {"damping": seen["friction"]}},
            "measured": ParameterCovariance(tuple(sds), np.diag(np.square(list(sds.values())))),
        }
    settings = Settings(case.bicycle, **options)
    (studied,) = tyre_cases(settings).studied[:1]
    answers = {}
    for hands, setup in zip(("off", "on"), settings.setups[:2], strict=True):
        samples = sample_bicycles(settings, studied, setup)
        votes = np.where(samples.wobbles_ridden[samples.computed], 1, -1)
        answers[hands] = grade_samples(votes, {}, either=True).grade.value
    return answers, np.array(studied.contact)


def run(*, out: Path, seed: int, bicycles: int = 30, workers: int = 2) -> dict[str, Any]:
    """Count definite and right answers of ``bicycles``."""
    from bicycle.effects import model_workers

    with model_workers(workers) as pool:
        rows = list(pool.map(judge, range(seed, seed + bicycles)))
    counts: dict[str, Any] = {}
    for hands in ("off", "on"):
        for when in ("today", "measured"):
            definite = [row[hands] for row in rows if row[hands][when] in ("yes", "no")]
            right = sum((row[when] == "yes") == row["truth"] for row in definite)
            counts[f"hands {hands}, {when}"] = {"definite": len(definite), "right": right, "of": len(rows)}
    return {"counts": counts, "rows": rows}
