"""Does a plan of further measurements settle what it promises? Cases of the blind generator, measured on as planned.

A laboratory (synthetic, :mod:`studies.missing_effect.blind.continued`, which shares nothing with the fitter) measures a
few eigenvalues of a bicycle that hides an effect or nothing. Where the diagnosis leaves something open, a plan is made
at standard prices, the planned runs are generated at the planned speeds with the planned channels, and the diagnosis is
made again with them. It is right where it names what is hidden, or says that nothing is missing where nothing is; a
class is right where it holds what is hidden and else only what the plan had said cannot be told from it.
"""

import json
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

HIDDEN = (
    "steer_damper", "steer_spring", "pneumatic_trail", "crown_radius", "twisting_torque", "camber_thrust",
)  # fmt: skip
NOISE = (1.0, 2.0)
NOTHING = 1 / 3  # share of cases in which nothing is hidden
POINTS = (5, 8)  # fewest and most speeds of the first table
OPEN = ("class", "tentative", "none")


def run(*, out: Path, seed: int, cases: int = 100, most: int = 6) -> dict[str, Any]:
    """Count.

    Parameters
    ----------
    out : Path
        Folder of ``measurement_plan.jsonl``, a line a case; cases that are there already are not made again.
    seed : int
        Of the first case; the others follow.
    cases : int
        Number of cases, before those are left out in which nothing is open.
    most : int
        Number of runs that can be made at each of the seven speeds.
    """
    from tyre.base.progress import progress_bar

    lines = out / "measurement_plan.jsonl"
    text = lines.read_text(encoding="utf-8").splitlines() if lines.is_file() else []
    done = {row["seed"]: row for row in map(json.loads, text)}
    with lines.open("a", encoding="utf-8") as file:
        for number in progress_bar(range(seed, seed + cases), total=cases, desc="cases"):
            if number not in done:
                done[number] = case(number, most)
                file.write(json.dumps(done[number]) + "\n")
                file.flush()
    return summary([done[number] for number in range(seed, seed + cases)], seed, most)


def case(seed: int, most: int = 6) -> dict[str, Any]:
    """One laboratory: what was open, what was planned, and what came of it.

    Parameters
    ----------
    seed : int
        Of the case.
    most : int
        Number of runs that can be made at each speed.
    """
    from studies.missing_effect import diagnose, read_measurement
    from studies.missing_effect.blind.continued import RATIOS, laboratory
    from studies.missing_effect.plan.costs import Costs, Stop
    from studies.missing_effect.plan.plan import plan

    rng = np.random.default_rng([seed, 31])
    hidden = () if rng.random() < NOTHING else (str(rng.choice(HIDDEN)),)
    noise, points = float(rng.choice(NOISE)), int(rng.integers(*POINTS, endpoint=True))
    ratios = tuple(name for name in RATIOS if rng.random() < 0.25)
    lab = laboratory(rng, hidden, points=points, noise=noise, ratios=ratios)
    row: dict[str, Any] = {"seed": seed, "hidden": list(hidden), "bicycle": lab.bicycle, "noise": noise}
    with tempfile.TemporaryDirectory() as folder:
        first = diagnose(read_measurement(lab.write(Path(folder) / "first")))
        row |= {"first": first.verdict.verdict, "first_names": list(first.verdict.equivalent)}
        if first.verdict.verdict not in OPEN:
            return row
        low, high = lab.speeds
        speeds = np.round(np.linspace(0.9 * low, 1.3 * high, 7), 2)
        sd = dict.fromkeys(RATIOS, 0.03 * noise)
        prices = {name: 300.0 for name in RATIOS if name not in ratios}
        stops = tuple(Stop(float(v), 50.0, 10.0, most) for v in speeds)
        made = plan(first, Costs(stops=stops, channels=prices, sd=sd))
        row |= {"open": [q.words for q in made.questions], "cost": made.cost, "channels": list(made.channels),
                "runs": {f"{s.speed:g}": s.count for s in made.steps},
                "inseparable": [q.words for q in made.questions if q.why], "proven": made.proven,
                "at_most": [round(q.at_most.probability, 3) for q in made.questions],
                "promised": min((q.then.probability for q in made.questions if not q.why), default=None)}  # fmt: skip
        if not made.steps:
            return row
        ridden = [s.speed for s in made.steps for _ in range(s.count) if s.speed is not None]
        more = lab.measure(ridden, (*ratios, *made.channels))
        second = diagnose(read_measurement(lab.write(Path(folder) / "second", more))).verdict
    row |= {"second": second.verdict, "second_names": list(second.equivalent)}
    row["right"] = right(row)
    return row


def right(row: dict[str, Any]) -> bool:
    """Whether the second verdict is right: ``row`` as :func:`case` makes it, names without units."""
    if not row["hidden"]:
        return bool(row["second"] == "none")
    name = "+".join(row["hidden"])
    if row["second"] not in ("named", "class") or name not in row["second_names"]:
        return False
    twins = {part for words in row["inseparable"] for part in words.split(" or ") if name in words.split(" or ")}
    return set(row["second_names"]) <= {name, *twins}


def summary(rows: list[dict[str, Any]], seed: int, most: int = 6) -> dict[str, Any]:
    """Counts of some ``rows`` (a dict each, without units); ``seed`` of the first, number of runs at ``most``."""
    planned = [row for row in rows if "right" in row]
    open_ = [row for row in rows if row.get("open")]
    promised = [row["promised"] for row in planned if row["promised"] is not None]

    def share(chosen: list[dict[str, Any]]) -> dict[str, Any]:
        n, k = len(chosen), sum(row["right"] for row in chosen)
        return {"cases": n, "right": k, "share": k / n if n else None}

    return {
        "synthetic": True,
        "what": "share of right verdicts after the runs that a plan asked for, of cases that were open before",
        "seed": seed, "cases": len(rows), "most_runs_at_a_speed": most,
        "made_by": f"velotyre validate measurement-plan --seed {seed} --cases {len(rows)} --most {most}",
        "first_verdicts": dict(sorted(Counter(row["first"] for row in rows).items())),
        "something_open": len(open_),
        "nothing_that_runs_could_settle": sum("right" not in row for row in open_),
        "after_planned_runs": share(planned),
        "named_wrongly": sum(r["second"] == "named" and not r["right"] for r in planned),
        "where_the_plan_promised_to_settle_all": share([row for row in planned if not row["inseparable"]]),
        "by_first_verdict": {word: share([r for r in planned if r["first"] == word]) for word in OPEN},
        "by_hidden": {name or "nothing": share([r for r in planned if r["hidden"] == ([name] if name else [])])
                      for name in ("", *HIDDEN)},
        "promised_probability_mean": float(np.mean(promised)) if promised else None,
        "cost_median": float(np.median([r["cost"] for r in planned])) if planned else None,
        "cheapest_proven": sum(r["proven"] for r in planned),
        "wrong": [{key: r[key] for key in ("seed", "hidden", "first", "first_names", "open", "second", "second_names")}
                  for r in planned if not r["right"]],
    }  # fmt: skip
