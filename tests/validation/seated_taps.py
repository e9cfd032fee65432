"""Taps under a seated rider, SYNTHETIC: do saddle and front frame come out together, and do their intervals hold?

Bicycles of finite rotations with a rider on a hinge at the saddle; their true numbers differ from those of their files
by the stated errors, and so does the body of the rider. The rear tyre is a spring to the side with a loss of which the
fit knows nothing. Hub, stem and head tube are recorded after one tap, with the errors of places and sensors that
:class:`bicycle.standing.Errors` states. The same recordings are read with the rider's body stated and with the defaults
of ``rider_saddle``.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.blind.hidden import bodies_exist, perturbed, uncertainty
from tests.validation.cases import KeptCases, Row, attempted, share
from tests.validation.seated_bench import Rider, Seated
from tests.validation.seated_rider import BARE, body_of, draw_number, draw_rider, joined

Random = np.random.Generator
STEM, HEAD = 0.6, 0.55  # m above the hub
TYRE = (8e4, 2e5)  # N/m, of a rear tyre to the side
LOSS = 5e-4  # s, of the tyre: a damping ratio of 0.02 at 13 Hz
SETS = ("rider stated", "rider assumed")
KEYS = ("front_compliance.stiffness", "front_compliance.damping", "rider_saddle.stiffness", "rider_saddle.damping")
COLUMNS = {
    "hub_lateral_m_s2": (0.0, "front"),
    "stem_lateral_m_s2": (STEM, "front"),
    "frame_lateral_m_s2": (HEAD, "frame"),
}


def draw(rng: Random) -> tuple[str, Seated]:
    """Draw the name of a bicycle and the same as it is, with its rider."""
    from bicycle import load_bicycle

    name = str(rng.choice(list(BARE)))
    ridden, bare = load_bicycle(name), load_bicycle(BARE[name])
    while True:
        real_bare, body = perturbed(bare, uncertainty(bare), rng), draw_rider(ridden, bare, rng)
        real = {**real_bare.values, **joined(body_of(real_bare.values), body)}
        if bodies_exist(ridden.replace(**real)):
            break
    saddle, stiffness = draw_number("joint_x", rng), draw_number("stiffness", rng)
    x, _, z = body.centre
    inertia = body.inertia[2, 2] + body.mass * (x - saddle) ** 2
    damping = 2 * draw_number("ratio", rng) * math.sqrt(stiffness * inertia)
    entries = (float(body.inertia[0, 0]), float(body.inertia[2, 2]), float(body.inertia[0, 2]))
    rider = Rider(body.mass, (x, z), entries, saddle, stiffness, damping)
    seated = Seated(real, rider, draw_number("front_stiffness", rng), 0.0, float(rng.uniform(0.2, 0.5)))
    mass, _, spring = (part[2, 2] for part in seated.matrices())
    damping = 2 * draw_number("front_ratio", rng) * math.sqrt(spring * mass)
    tyre = float(np.exp(rng.uniform(*np.log(TYRE))))
    return name, replace(seated, damping=damping, tyre=tyre, loss=LOSS)


def record(seated: Seated, rng: Random) -> tuple[Any, ...]:
    """Vibrations of one recorded tap, as the owner names the places."""
    from bicycle.standing import Errors, Place, TapRecording, identify_taps

    errors = Errors()
    moved = [(above and above + errors.place * float(rng.standard_normal()), part) for above, part in COLUMNS.values()]
    table = seated.recording(moved, rng)
    gains = [1.0, *(1 + errors.gain * float(rng.standard_normal()) for _ in moved[1:])]
    signals = {name: gain * table[f"place_{k}"] for k, (name, gain) in enumerate(zip(COLUMNS, gains, strict=True))}
    named = dict(zip(COLUMNS, (Place(0.0), Place(STEM, "fork"), Place(HEAD, "frame")), strict=True))
    return identify_taps([TapRecording("tap", table["time_s"], signals)], named, seated=True)


def judge(taps: Sequence[Any], name: str, true: Seated, *, stated: bool) -> Row:
    """Errors of what is found, and whether its 95 % intervals hold the truth."""
    from bicycle import load_bicycle
    from bicycle.model import build_model
    from bicycle.standing import Readings, measure_front

    effects: Mapping[str, Any] = {"rider_saddle": {"without_rider": BARE[name]}} if stated else {}
    model = build_model({"bicycle": name, "effects": effects})
    stated_sd = uncertainty(load_bicycle(name))
    result = measure_front(Readings((), tuple(taps), seated=True), model, stated_sd)
    row: Row = {"outcome": str(result.outcome), "vibrations": len(taps), "saddle_open": list(result.saddle_open)}
    if result.fit is None:
        return row
    row["damping_not_separate"] = result.damping_not_separate
    right = (true.stiffness, true.damping, true.rider.stiffness, true.rider.damping)
    for key, value in zip(KEYS, right, strict=True):
        low, high = result.fit.value_interval(key)
        error = math.log(result.fit.values[key] / value)
        row[key] = {"error": error, "holds": low <= value <= high, "sd": result.fit.sd(key) / result.fit.values[key]}
    return row


def one_case(seed: int) -> Row:
    """One bicycle in all sets."""
    return attempted({"seed": seed}, partial(_measured, seed))


def _measured(seed: int, _folder: Path, row: Row) -> None:
    rng = np.random.default_rng([310463, seed])
    name, seated = draw(rng)
    taps = record(seated, rng)
    row |= {"bicycle": name, "saddle": seated.rider.stiffness, "front": seated.stiffness}
    row["rider stated"] = judge(taps, name, seated, stated=True)
    row["rider assumed"] = judge(taps, name, seated, stated=False)


def run(*, out: Path, seed: int, cases: int = 40, workers: int = 1) -> dict[str, Any]:
    """Tap ``cases`` bicycles under their riders; every case goes to a file."""
    rows = KeptCases(out / "seated_taps_cases.jsonl", ("seed",)).computed(
        [(seed + k,) for k in range(cases)], one_case, workers=workers, what="seated taps"
    )
    result: dict[str, Any] = {"errors": [row["error"] for row in rows if row["error"]]}
    for name in SETS:
        result[name] = summary([row[name] for row in rows if name in row])
    return result


def summary(rows: Sequence[Row]) -> Row:
    """Bias, scatter and coverage of one set."""
    found = [row for row in rows if row["outcome"] == "rider_yaws"]
    result: Row = {
        "with_numbers": share(len(found), len(rows)),
        "outcomes": {name: sum(row["outcome"] == name for row in rows) for name in {row["outcome"] for row in rows}},
        "two_vibrations": sum(row["vibrations"] == 2 for row in rows),
        "saddle_open": sum(bool(row["saddle_open"]) for row in found),
        "damping_not_separate": sum(row["damping_not_separate"] for row in found),
    }
    for key in KEYS if found else ():
        errors = np.array([row[key]["error"] for row in found])
        result[key] = {
            "median_log_error": round(float(np.median(errors)), 4),
            "mean_log_error": round(float(errors.mean()), 4),
            "mean_standard_error": round(float(errors.std() / math.sqrt(len(errors))), 4),
            "rms_log_error": round(float(np.sqrt((errors**2).mean())), 4),
            "median_stated_sd": round(float(np.median([row[key]["sd"] for row in found])), 4),
            "holds": share(sum(row[key]["holds"] for row in found), len(found)),
        }
    return result
