"""Bicycles whose front frame, steering friction and hands were measured: is it said if they wobble, and rightly?

Each is a case of ``answer_grades``, with arms of its own. Its owner knows what a half-hour test leaves: stiffness of
the front to 1.5 %, hinge to 4 mm, damping to 5 %, friction to 10 %, inertia and damping of the arms to 9 %. The tyre's
moments and the bicycle stay as uncertain as they are. The truth comes from Kane's equations. It counts wobble of
0.5 1/s or more at 3 to 20 m/s; hands off from 4 m/s and the weave speed on.

Each hands off that stays indefinite is taken apart: four times the samples, the variance of the fastest growth by what
is uncertain (regression), and the grade with one group of numbers known exactly.
"""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.answer_grades import GROWTH, HANDS_OFF, RIDDEN, SD_OF_TYRE, SPEEDS, Case, draw, true_growth

RELAXED = {"inertia": 0.1, "stiffness": 5.0, "damping": 1.0}  # kg m^2, N m/rad, N m s/rad
MOMENTS = ("trail", "twisting", "camber_share")
GROUPS = {
    "tyre's moments and camber stiffness": ("pneumatic_trail.", "twisting_torque.", "camber_thrust."),
    "tyre's stiffness and length": ("relaxation_length.",),
    "front frame": ("front_compliance.",),
    "steering friction": ("steer_damper.",),
}  # of effects; everything else is the bicycle
BICYCLE = "bicycle"
LAW = "relaxation_length"
LENGTHS = {wheel: f"{LAW}.relaxation_length.{wheel}" for wheel in ("rear", "front")}
MANY = 256  # samples of a case that is taken apart
SD = {
    "stiffness": 0.015, "damping_ratio": 0.05, "friction": 0.10,  # relative
    "hinge": 0.004,  # m
    "arms": 0.09,  # relative
}  # fmt: skip


def judge(seed: int, many: int = MANY) -> dict[str, Any]:
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
    if measured["off"] not in ("yes", "no"):
        row["apart"] = take_apart(case, seen, contact, many)
    return row


def take_apart(case: Case, seen: dict[str, float], contact: Any, many: int) -> dict[str, Any]:
    """Why a measured bicycle has no definite answer hands off; ``contact`` (4,) as its owner knows the tyre.

    ``many`` samples are taken, and a quarter of them where a group is known.
    """
    samples, values = sampled(settings_of(case, seen, {}, fronts=many))
    growth, _ = true_growth(case, contact * (1 + case.errors[0]), {})
    ridden = (RIDDEN[0] <= SPEEDS) & (RIDDEN[1] >= SPEEDS)
    moments = {name: (case.numbers[name],) * 2 for name in MOMENTS}
    fronts = max(many // 4, 4)
    true_front, exact = {name: case.numbers[name] for name in seen}, exact_bicycle(case)
    known = {
        "tyre's moments and camber stiffness": settings_of(case, seen, {}, exact=moments, fronts=fronts),
        "tyre's stiffness and length": settings_of(case, seen, {}, contact=contact, fronts=fronts),
        "front frame and steering friction": settings_of(case, true_front, {}, scale=1e-3, fronts=fronts),
        BICYCLE: settings_of(exact, seen, {}, fronts=fronts),
        "tyre": settings_of(case, seen, {}, exact=moments, contact=contact, fronts=fronts),
        "tyre's stiffness and length, bicycle": settings_of(exact, seen, {}, contact=contact, fronts=fronts),
        "tyre and bicycle": settings_of(exact, seen, {}, exact=moments, contact=contact, fronts=fronts),
    }
    relative = {name: np.std([one[key] for one in values]) / np.mean([one[key] for one in values])
                for name, key in LENGTHS.items()}  # fmt: skip
    peak = samples.peak[samples.computed]
    return {
        "share": round(samples.wobbling_share, 3),
        "grade_of_many": grade_of(samples),
        "excess_1_s": round(float(growth[ridden].max()) - GROWTH, 3),
        "sd_1_s": round(float(peak.std()), 3),
        "variance": variance_shares(peak, values),
        "sd_of_relaxation_length": {name: round(float(sd), 3) for name, sd in relative.items()},
        "known": {name: grade_of(sampled(settings)[0]) for name, settings in known.items()},
    }


def exact_bicycle(case: Case) -> Case:
    """The case with a bicycle that is known exactly."""
    from bicycle.parameters import ParameterCovariance

    zeros = dict.fromkeys(case.bicycle.values, 0.0)
    return replace(case, bicycle=replace(case.bicycle, sd=zeros, covariance=ParameterCovariance()))


def variance_shares(peak: Any, values: list[dict[str, float]]) -> dict[str, float]:
    """Share of the variance of the fastest growth (n,) by group, by regression on one group after the other.

    The bicycle comes first: what others vary with it, as camber stiffness with the load, is the bicycle's.
    """
    columns: dict[str, list[Any]] = {name: [] for name in (BICYCLE, *GROUPS)}
    for key in values[0]:
        numbers = np.array([one[key] for one in values])
        if numbers.std() > 1e-9 * max(abs(numbers.mean()), 1e-9):
            group = next((name for name, of in GROUPS.items() if key.startswith(of)), BICYCLE)
            columns[group].append((numbers - numbers.mean()) / numbers.std())
    left, table = peak - peak.mean(), [np.ones(len(peak))]
    total, shares = float(left @ left), {}
    for name, of_group in columns.items():
        table += of_group
        matrix = np.column_stack(table)
        remaining = peak - matrix @ np.linalg.lstsq(matrix, peak, rcond=1e-6)[0]
        shares[name] = round(float(left @ left - remaining @ remaining) / total, 3)
        left = remaining
    return shares | {"not linear": round(float(left @ left) / total, 3)}


def truly_wobbles(case: Case, contact: Any, arms: dict[str, float]) -> bool:
    """Whether the bicycle wobbles at ridden speeds."""
    growth, weave = true_growth(case, contact, arms)
    slowest = RIDDEN[0] if arms else max(HANDS_OFF, float(SPEEDS[np.argmax(weave <= 0)]))
    return bool((growth[(slowest <= SPEEDS) & (RIDDEN[1] >= SPEEDS)] >= GROWTH).any())


def settings_of(
    case: Case,
    seen: dict[str, float],
    held: dict[str, float],
    *,
    fronts: int = 64,
    exact: Any = None,
    scale: float = 1.0,
    contact: Any = None,
) -> Any:
    """Settings of the main study for what the owner measured; ``exact`` ranges replace those that are assumed.

    ``scale`` multiplies the standard uncertainties of what was measured. A ``contact`` (4,) has those of ``SD_OF_TYRE``
    in place of the packaged tyre's.
    """
    from bicycle.parameters import ParameterCovariance
    from studies.main_study import Arms, Front, Ranges, Settings

    @dataclass(frozen=True)
    class Exact(Settings):  # type: ignore[misc]
        """Settings with ranges of their own."""

        exact: dict[str, Any] = field(default_factory=dict)

        @property
        def ranges(self) -> Ranges:
            return replace(super().ranges, **self.exact)

    options: dict[str, Any] = {"tyre": case.tyre, "pressures": (5.5,), "seed": case.seed, "fronts": fronts}
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
        }
        sds = {key: scale * sd for key, sd in sds.items()}
        if contact is not None:
            table = {"cornering_stiffness": dict(zip(LENGTHS, contact[::2].tolist(), strict=True)),
                     "relaxation_length": dict(zip(LENGTHS, contact[1::2].tolist(), strict=True))}  # fmt: skip
            options |= {"tyre": "", "pressures": (), "contact": table}
            sds |= {f"{LAW}.{name}.{wheel}": sd * number
                    for (name, numbers), sd in zip(table.items(), SD_OF_TYRE.values(), strict=True)
                    for wheel, number in numbers.items()}  # fmt: skip
        options["measured"] = ParameterCovariance(tuple(sds), np.diag(np.square(list(sds.values()))))
    return Exact(case.bicycle, **options, exact=exact or {})


def sampled(settings: Any) -> tuple[Any, list[dict[str, float]]]:
    """Samples hands off, and the parameters (SI) of each that was computed."""
    from studies.main_study import draws, front_draws, front_values, sample_bicycles, tyre_cases, uncertainty

    (studied,) = tyre_cases(settings).studied[:1]
    setup = settings.reference
    samples = sample_bicycles(settings, studied, setup)
    drawn, values = front_draws(settings), []
    for k, one in enumerate(draws(settings, studied, uncertainty(settings, studied, setup), settings.fronts)):
        if samples.computed[k]:
            values.append(one | front_values(settings, studied.apply_to(setup), drawn, k, one))
    return samples, values


def grade_of(samples: Any) -> str:
    """What the package answers."""
    from studies.main_study import grade_samples

    votes = np.where(samples.wobbles_ridden[samples.computed], 1, -1)
    return str(grade_samples(votes, {}, either=True).grade.value)


def grades(case: Case, seen: dict[str, float], held: dict[str, float]) -> tuple[dict[str, str], Any]:
    """What the package answers, hands off and relaxed, and the tyre's numbers that it takes."""
    from studies.main_study import sample_bicycles, tyre_cases

    settings = settings_of(case, seen, held)
    (studied,) = tyre_cases(settings).studied[:1]
    setups = zip(("off", "on"), settings.setups[:2], strict=True)
    answers = {hands: grade_of(sample_bicycles(settings, studied, setup)) for hands, setup in setups}
    return answers, np.array(studied.contact)


def run(*, out: Path, seed: int, bicycles: int = 30, many: int = MANY, workers: int = 2) -> dict[str, Any]:
    """Count definite and right answers of ``bicycles``, and take those apart that are indefinite hands off."""
    from bicycle.effects import model_workers

    with model_workers(workers) as pool:
        rows = list(pool.map(judge, range(seed, seed + bicycles), [many] * bicycles))
    counts: dict[str, Any] = {}
    for hands in ("off", "on"):
        for when in ("today", "measured"):
            definite = [row[hands] for row in rows if row[hands][when] in ("yes", "no")]
            right = sum((row[when] == "yes") == row["truth"] for row in definite)
            counts[f"hands {hands}, {when}"] = {"definite": len(definite), "right": right, "of": len(rows)}
    indefinite = summary([row["apart"] for row in rows if "apart" in row], many)
    for row in rows:
        row.get("apart", {}).pop("known", None)  # counted in the summary
    return {"counts": counts, "indefinite": indefinite, "rows": rows}


def summary(apart: list[dict[str, Any]], many: int) -> dict[str, Any]:
    """Mean shares of the variance, and how many become definite with more samples or with a group known."""
    if not apart:
        return {}
    definite = {name: sum(one["known"][name] in ("yes", "no") for one in apart) for name in apart[0]["known"]}
    definite[f"{many} samples"] = sum(one["grade_of_many"] in ("yes", "no") for one in apart)
    shares = {name: float(np.mean([one["variance"][name] for one in apart])) for name in apart[0]["variance"]}
    return {
        "bicycles": len(apart),
        "excess_within_an_sd": sum(abs(one["excess_1_s"]) < one["sd_1_s"] for one in apart),
        "variance": {name: round(share, 3) for name, share in shares.items()},
        "definite": definite,
    }
