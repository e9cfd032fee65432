"""Is a wrong unit, sign or place of a column told before any search? SYNTHETIC histories with one hidden effect.

Each case is made once and read in eight wrong ways, one after the other, and once as it is, which must pass. Seconds
are of the processor.
"""

import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from bicycle.identification import Run
from studies.diagnosis import Histories, read_measurement
from studies.inference import preflight
from tests.validation.blind.hidden import HIDDEN
from tests.validation.blind.histories import history_case
from tests.validation.cases import KeptCases, Row, attempted, share

ROLL, STEER, YAW, TORQUE = "roll_rate_rad_s", "steer_rad", "yaw_rate_rad_s", "steer_torque_N_m"
DEGREES = 180 / np.pi
WRONG: dict[str, tuple[dict[str, float], float]] = {
    f"{STEER} in degrees": ({STEER: DEGREES}, 1.0),
    f"{ROLL} in degrees": ({ROLL: DEGREES}, 1.0),
    f"{YAW} in mrad": ({YAW: 1e3}, 1.0),
    f"{ROLL} of the opposite sign": ({ROLL: -1.0}, 1.0),
    f"{STEER} of the opposite sign": ({STEER: -1.0}, 1.0),
    f"{ROLL} and {YAW} swapped": ({}, 1.0),
    "speeds in km/h": ({}, 3.6),
    "speeds in mph": ({}, 1 / 0.44704),
}
"""Reading that is right -> factors on the columns, and on the speeds."""


def wrong(run: Run, what: str) -> Run:
    """Read a ``run`` in one of the wrong ways."""
    factors, speed = WRONG[what]
    channels = {name: factors.get(name, 1.0) * x for name, x in run.channels.items()}
    if what.endswith("swapped"):
        channels |= {ROLL: channels[YAW], YAW: channels[ROLL]}
    return replace(run, channels=channels, speed=speed * run.speed)


def one_case(seed: int) -> Row:
    """Ask of each wrong way of the case of a ``seed``, and of the case as it is."""
    return attempted({"seed": seed, "told": {}, "seconds": {}, "hidden": ""}, partial(_asked, seed))


def _asked(seed: int, folder: Path, row: Row) -> None:
    rng = np.random.default_rng([seed, 46])
    row["hidden"] = str(rng.choice([name for name in HIDDEN if name not in ("relaxation_length", "camber_thrust")]))
    history_case(folder, hidden=(row["hidden"],), rng=rng, runs=4, duration=2.5)
    measurement = read_measurement(folder / "MEASUREMENT.toml")
    assert isinstance(measurement, Histories)
    for what in ("as it is", *WRONG):
        runs = measurement.runs if what == "as it is" else tuple(wrong(run, what) for run in measurement.runs)
        started = time.process_time()
        found = preflight(replace(measurement, runs=runs).prepare())
        row["seconds"][what] = round(time.process_time() - started, 2)
        row["told"][what] = [] if found is None else list(found.readings)


def run(*, out: Path, seed: int, cases: int = 10, workers: int = 1) -> dict[str, Any]:
    """Make a number of ``cases`` and count the wrong ways that are told."""
    rows = KeptCases(out / "readings_cases.jsonl", ("seed",)).computed(
        [(seed + k,) for k in range(cases)], one_case, workers=workers, what="readings"
    )
    sound = [row for row in rows if not row["error"]]
    seconds = [s for row in sound for s in row["seconds"].values()]
    return {
        "told": {what: share(sum(what in row["told"][what] for row in sound), len(sound)) for what in WRONG},
        "told_first": share(sum(row["told"][what][:1] == [what] for row in sound for what in WRONG), 8 * len(sound)),
        "told_though_right": share(sum(bool(row["told"]["as it is"]) for row in sound), len(sound)),
        "seconds": {"median": median(seconds), "most": max(seconds)} if seconds else None,
        "errors": [row["error"] for row in rows if row["error"]],
    }
