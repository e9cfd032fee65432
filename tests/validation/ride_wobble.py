"""How well is wobble known from a ride without an impulse? SYNTHETIC rides of Kane's bicycle.

The truth is the pole of the closed loop of bicycle and rider at the mean speed. Cells: "wobble" (a wobble that decays
by 0.3 to 8 1/s, at steady speed), "restless" (the same with pedalling and a speed that drifts by 1.5 %), and "none" (no
pole of 3 to 13 Hz has a damping ratio below 0.3). Counted: how often a row is given, its error, how often the 95 %
interval holds the pole, and rows that are wrong and sure: more than 4 standard uncertainties from every pole.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.identification import Wobble, identify_wobble, read_ride
from tests.validation.cases import KeptCases, Row, attempted, share
from tests.validation.ride_bicycle import Random, draw_bicycle
from tests.validation.ride_generator import STEADY, Course, Leg, make_leg, ride, write_ride
from tyre.ground import InputError

CELLS = ("wobble", "restless", "none")
BICYCLES = ("benchmark", "rigid_rider")
SPEEDS = (4.0, 14.0)  # m/s
DECAYS = (0.3, 8.0)  # 1/s
BAND, WIDER_BAND = (4.0, 12.0), (3.0, 13.0)  # Hz
LIGHT, HEAVY = 0.2, 0.3  # damping ratios
FAR = 4.0  # standard uncertainties
TARGETS = {"covered": (0.93, 0.97), "wrong_and_sure": 0, "rows_without_wobble": 0}


def lightly_damped(leg: Leg, band: tuple[float, float], most: float) -> list[complex]:
    """Poles (1/s) of the closed loop in a ``band`` (Hz), damping ratio below ``most``, the least damped first."""
    poles = [complex(pole) for pole in np.linalg.eigvals(leg.loop.matrix)]
    inside = [pole for pole in poles if band[0] <= pole.imag / (2 * np.pi) <= band[1]]
    return sorted((pole for pole in inside if -pole.real < most * abs(pole)), key=lambda pole: -pole.real)


def draw_leg(cell: str, rng: Random, number: int) -> Leg:
    """A bicycle, a speed and a rider, as the cell wants them; every fourth front frame is rigid, in "none" all are.

    In the other cells the least damped pole of the band decays by 0.3 to 8 1/s.
    """
    rigid = cell == "none" or number % 4 == 3
    while True:
        bicycle = draw_bicycle(
            rng, base=BICYCLES[number % 2], tyre_sd=0.15, front_sd=0.2, compliance="none" if rigid else "declared"
        )
        try:
            leg = make_leg(bicycle, round(float(rng.uniform(*SPEEDS)), 2), rng, pedalling=cell == "restless")
        except InputError:  # nobody holds this bicycle
            continue
        if cell == "none":
            if not lightly_damped(leg, WIDER_BAND, HEAVY):
                return leg
            continue
        light = lightly_damped(leg, BAND, LIGHT)
        if light and DECAYS[0] <= -light[0].real <= DECAYS[1]:
            return leg


def judge(wobble: Wobble, poles: Sequence[complex]) -> Row:
    """Error of a row in its nearest pole, over its standard uncertainties."""
    row: Row = {"given": not wobble.rejected, "why": wobble.rejected}
    if wobble.rejected:
        return row
    pole = min(poles, key=lambda pole: abs(pole - wobble.eigenvalue))
    error = wobble.eigenvalue - pole
    over = (abs(error.real) / wobble.sd[0], abs(error.imag) / wobble.sd[1])
    return row | {
        "pole": [pole.real, pole.imag], "error": [error.real, error.imag], "sd": [*wobble.sd],
        "held": [z <= 1.96 for z in over], "wrong_and_sure": max(over) > FAR, "orders": len(wobble.orders),
    }  # fmt: skip


def one_ride(seed: int, duration: float, cell: str, number: int) -> Row:
    """Make, identify and judge one ride."""
    row: Row = {"seed": seed, "duration": duration, "cell": cell, "number": number}

    def work(folder: Path, row: Row) -> None:
        rng = np.random.default_rng([seed, CELLS.index(cell), number])
        leg = draw_leg(cell, rng, number)
        taken = ride(leg, rng, duration=duration, course=Course(drift=0.015) if cell == "restless" else STEADY)
        write_ride(folder / "ride.csv", taken)
        wobbles = identify_wobble(read_ride(folder / "ride.csv", taken.stated_speed))
        row["speed"] = leg.speed
        row["light"] = [[pole.real, pole.imag] for pole in lightly_damped(leg, BAND, LIGHT)]
        at_mean_speed = replace(leg, speed=float(np.mean(taken.speed)))
        row["judged"] = judge(wobbles[0], [complex(pole) for pole in np.linalg.eigvals(at_mean_speed.loop.matrix)])

    return attempted(row, work)


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Shares and errors of a cell."""
    judged = [row["judged"] for row in rows if not row["error"]]
    given = [row for row in judged if row["given"]]
    table: dict[str, Any] = {
        "rides": len(judged),
        "errors": [row["error"] for row in rows if row["error"]],
        "given": share(len(given), len(judged)),
        "without_a_row": dict(Counter(row["why"] for row in judged if not row["given"])),
    }
    if given:
        errors = np.array([row["error"] for row in given])
        sd = np.array([row["sd"] for row in given])
        held = np.array([row["held"] for row in given])
        for k, part in enumerate(("decay", "frequency")):
            table[part] = {
                "rms_error_1_s": float(f"{np.sqrt(np.mean(errors[:, k] ** 2)):.3g}"),
                "rms_sd_1_s": float(f"{np.sqrt(np.mean(sd[:, k] ** 2)):.3g}"),
                "rms_error_over_sd": round(float(np.sqrt(np.mean((errors[:, k] / sd[:, k]) ** 2))), 3),
                "covered": share(int(held[:, k].sum()), len(given)),
            }
        table["wrong_and_sure"] = sum(row["wrong_and_sure"] for row in given)
    return table


def run(
    *, out: Path, seed: int, rides: int = 40, restless: int = 20, none: int = 20, duration: float = 300.0,
    workers: int = 1,
) -> dict[str, Any]:  # fmt: skip
    """Judge ``rides`` of ``duration`` s with wobble, ``restless`` ones, and rides with ``none``."""
    kept = KeptCases(out / "ride_wobble_cases.jsonl", ("seed", "duration", "cell", "number"))
    counts = dict(zip(CELLS, (rides, restless, none), strict=True))
    jobs = [(seed, duration, cell, number) for cell in CELLS for number in range(counts[cell])]
    rows = kept.computed(jobs, one_ride, workers=workers, what="rides")
    cells = {cell: summary([row for row in rows if row["cell"] == cell]) for cell in CELLS}
    return {"targets": TARGETS, "cells": cells}
