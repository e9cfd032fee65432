"""Joint diagnosis on blind cases: several sets of data of one bicycle together against each of them alone.

Cases are synthetic and come from equations that share nothing with the search (:mod:`tests.validation.blind`).
``--cases`` measurements of two or three parts hide one effect; half as many again have a mistake planted in one part (a
wrong scale of the steer sensor, a wrong speed).
"""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from tests.validation.cases import KeptCases, Row, attempted, share, share_of

OF = "/"
SAYS = ("named", "class", "partial", "tentative")


def run(*, out: Path, seed: int, cases: int = 150, workers: int = 2) -> dict[str, Any]:
    """Make, diagnose and score the cases."""
    wanted = [(seed + k, "") for k in range(cases)]
    wanted += [(seed + k, ("scale", "speed")[k % 2]) for k in range(cases // 2)]
    kept = KeptCases(out / "joint_cases.jsonl", ("seed", "planted"))
    return scored(kept.computed(wanted, one_case, workers=workers, what="joint diagnosis"))


def one_case(seed: int, planted: str) -> Row:
    """Make a case, diagnose it jointly and, if nothing is ``planted``, each part alone."""
    return attempted({"seed": seed, "planted": planted}, partial(_diagnosed, seed, planted))


def _diagnosed(seed: int, planted: str, folder: Path, row: Row) -> None:
    from tests.validation.blind.hidden import HIDDEN
    from tests.validation.blind.joint import PLANTED, joint_case

    generator = np.random.default_rng([seed, PLANTED.index(planted)])
    row["hidden"] = str(generator.choice(list(HIDDEN)))
    case = joint_case(folder, hidden=(row["hidden"],), rng=generator, planted=planted, third=bool(seed % 2))
    row |= {"part": case.planted, "mistake": dict(case.mistake), "parts": case.parts}
    row["joint"] = answer(folder / "MEASUREMENT.toml", case.truth.effects)
    if not planted:
        row["alone"] = {part: answer(folder / f"{part}.toml", case.truth.effects) for part in case.parts}


def answer(file: Path, hidden: Mapping[str, Any]) -> dict[str, Any]:
    """What the search says of a file: verdict, whether it is right, sizes with sd, parts that contradict the rest."""
    from studies.diagnosis import diagnose, read_measurement
    from studies.inference import parts_against_rest
    from tests.validation.blind.score import judge

    found = diagnose(read_measurement(file))
    verdict = found.verdict.to_dict()
    score = judge(verdict, {"effects": hidden})
    sizes = {
        f"{e['identifier']}.{key}": [number["value"], number["sd"]]
        for e in verdict["effects"]
        for key, number in e["parameters"].items()
    }
    wrong = []
    if found.kind.parts:
        wrong = [p.part for p in parts_against_rest(found.kind, found.final) if p.contradicts]
    return {
        "verdict": verdict["verdict"], "class": verdict["class"], "sizes": sizes, "contradicts": wrong,
        "right": bool(score["right"] or score["tentative_right"]), "misnamed": bool(score["misnamed"]),
        "some_false": bool(score["some_false"]), "covered": score["covered"], "judged": score["judged"],
    }  # fmt: skip


def scored(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Shares with Wilson's 95 % intervals of ``rows`` of :func:`one_case`."""
    told = [row for row in rows if not row["error"]]
    plain, planted = ([row for row in told if bool(row["planted"]) == wrong] for wrong in (False, True))
    joint = [row["joint"] for row in plain]
    answers = {"joint": joint}
    for row in plain:
        for name in row["parts"]:
            answers.setdefault(name, []).append(row["alone"][name])
    ratios = [ratio for row in plain for ratio in _narrower(row)]
    found = {
        kind: [_accuses(row["joint"], (row["part"],)) for row in planted if row["planted"] == kind]
        for kind in ("scale", "speed")
    }
    return {
        "crashed": share_of(rows, "error"),
        "right": {name: share_of(some, "right") for name, some in answers.items()},
        "some_false_name": {name: share_of(some, "some_false") for name, some in answers.items()},
        "truth_inside_95_joint": share(sum(a["covered"] for a in joint), sum(a["judged"] for a in joint)),
        "sd_joint_over_best_part": {"median": median(ratios) if ratios else None, "largest": max(ratios, default=None),
                                    "of": len(ratios)},
        "false_contradiction": share_of([_accuses(row["joint"], row["parts"]) for row in plain]),
        "planted_found": share_of([one for some in found.values() for one in some]),
        "planted_found_by_mistake": {kind: share_of(some) for kind, some in found.items()},
        "errors": [{key: row[key] for key in ("seed", "planted", "error")} for row in rows if row["error"]],
    }  # fmt: skip


def _accuses(answer: Mapping[str, Any], parts: Sequence[str]) -> bool:
    """Whether an answer says that one of some parts contradicts the rest, or names a mistake of it."""
    named = {name for member in answer["class"] for name in member.split("+")} if answer["verdict"] in SAYS else set()
    return any(part in answer["contradicts"] or any(n.startswith(part + OF) for n in named) for part in parts)


def _narrower(row: Mapping[str, Any]) -> list[float]:
    """Sd of the hidden effect's sizes, joint over the narrowest part, where both are right."""
    if not row["joint"]["right"]:
        return []
    found = []
    for key, (_, sd) in row["joint"]["sizes"].items():
        alone = [one["sizes"][key][1] for one in row["alone"].values() if one["right"] and key in one["sizes"]]
        if key.startswith(row["hidden"]) and alone and min(alone) > 0:
            found.append(sd / min(alone))
    return found
