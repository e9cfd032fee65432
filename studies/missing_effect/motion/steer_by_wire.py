"""Kicks of a riderless steer-by-wire bicycle: real time histories with known (commanded) steer torque.

The recordings stay outside the project (MIT, Dialynas & Drauksas); the folder is named by VELOTYRE_EXTRA_DATA, itself
or its sub-folder steer_by_wire. The steer torque is the commanded one, which the controller makes proportional to roll
rate; the plant is unstable at low speed, so a replay is kept to the first second after the kick.
"""

import csv
import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from bicycle import Bicycle, Model
from bicycle.identification.recording import Run, read_run
from studies.missing_effect.motion.measurements import HistoryMeasurement
from tyre.base.errors import InputError

VARIABLE = "VELOTYRE_EXTRA_DATA"
KICK_S = 0.08
REPLAY_S = 1.0
USED = ("roll_rate_rad_s", "steer_rad")  # lean is a filtered roll rate, steer rate a difference of steer
NOISE = {"roll_rate_rad_s": 0.03, "steer_rad": 0.004}
"""Noise sd: gyro on a loose carrier; encoder of 0.00077 rad steps whose magnet is not well centred."""

BORROWED = {"IBxx": 0.4, "IBzz": 0.5, "IBxz": 0.2, "IHxx": 0.01, "IHzz": 0.004, "IHxz": 0.002, "IFyy": 0.01}
"""1-sigma (kg m^2) of what was borrowed from another bicycle or guessed."""


def find_folder() -> Path:
    """The folder with runs.csv; InputError where the variable does not lead to it."""
    given = os.environ.get(VARIABLE, "")
    for folder in (Path(given), Path(given) / "steer_by_wire"):
        if given and (folder / "runs.csv").is_file():
            return folder
    raise InputError(f"{VARIABLE} = {given!r}: no steer_by_wire recordings (runs.csv) there; see data/SOURCES.md")


def steer_by_wire(folder: str | Path, *, per_speed: int = 3) -> HistoryMeasurement:
    """The first ``per_speed`` runs in ``folder`` judged good of each treadmill speed, as a measurement."""
    folder = Path(folder)
    content = json.loads((folder / "bicycle.json").read_text(encoding="utf-8"))
    values = {key: value for key, value in content["parameters"].items() if value is not None}
    taken: dict[str, int] = {}
    runs = []
    for row in csv.DictReader((folder / "runs.csv").read_text(encoding="utf-8").splitlines()):
        speed = row["treadmill_speed_m_s"]
        taken[speed] = taken.get(speed, 0) + (row["quality"] == "good")
        if row["quality"] == "good" and taken[speed] <= per_speed:
            runs.append(_cut(read_run(folder / row["file"], float(row["speed_m_s"]), f"{speed} m/s")))
    model = Model(Bicycle("steer-by-wire", values))
    return HistoryMeasurement(
        name="steer_by_wire", model=model, runs=tuple(runs), uncertainty=BORROWED, noise_sd=NOISE,
        description=f"First {REPLAY_S:g} s of kicks of a riderless steer-by-wire bicycle, commanded torque replayed.",
        source=content["source"], notes=(f"runs judged fair are left out, and the first {KICK_S:g} s (the kick)",),
    )  # fmt: skip


def _cut(run: Run) -> Run:
    keep = (run.time >= run.time[0] + KICK_S - 1e-9) & (run.time <= run.time[0] + KICK_S + REPLAY_S + 1e-9)

    def part(signals: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        return {name: x[keep] for name, x in signals.items()}

    seen = {name: x for name, x in run.channels.items() if name in USED}
    return replace(run, time=run.time[keep], channels=part(seen), inputs=part(dict(run.inputs)))
