"""How well are lateral forces and slip angles of a ride known? SYNTHETIC rides of Kane's bicycle.

Two bicycles at two speeds, three gyros, straight ahead, in a slalom or with other inputs and another rider
(``other_rides``), in cells that differ in what the file gets
wrong: nothing ("known"), the tyres and the front frame ("tyre": 15 and 20 %, 1 standard uncertainty), and the whole
bicycle too ("all"). Counted: how often 95 % bands hold the truth, the rms error, and how far the sum of both forces is
from m a_y of the mass centre less the side force, as a share of m a_y; where an estimator gives the side force, also
how far the sum of all three is from m a_y.

The estimator "ideal" is the best that any can do: it knows the true bicycle, the rider and the spectra of the inputs.
"stated" does the same with the bicycle of the file, as if that were exact. "engine" is ``velotyre.ride_forces``, which
knows the file of the ride, the bicycle of the file and its standard uncertainties.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.linalg import solve_discrete_are, solve_discrete_lyapunov

import velotyre as vt
from bicycle import load_bicycle
from tests.validation.blind.hidden import uncertainty
from tests.validation.cases import KeptCases, Row, attempted
from tests.validation.other_rides import draw_other_rides
from tests.validation.ride_generator import SAMPLE, Loop, Real, Ride, close_loop, draw_legs, ride, write_ride
from tyre.ground import InputError

BICYCLES = ("benchmark", "rigid_rider")
SPEEDS = (6.0, 9.0)  # m/s
CELLS: Mapping[str, Mapping[str, float]] = {  # what is off, see draw_bicycle
    "known": {"spread": 0.0},
    "tyre": {"spread": 0.0, "tyre_sd": 0.15, "front_sd": 0.2},
    "all": {"spread": 1.0, "tyre_sd": 0.15, "front_sd": 0.2},
}
JUDGED = ("rear_lateral_force", "front_lateral_force", "rear_slip_angle", "front_slip_angle")
FORCES = JUDGED[:2]
SIDE_FORCE = "side_force"
OTHER = "other"  # style of the rides of ``other_rides``, whose inputs no state-space model has
TARGETS = {"covered": (0.93, 0.97), "sum_error_share": 0.03}
RUN_IN = 80.0  # s at both ends of a ride, in which the steady filter of "ideal" has not yet forgotten its start


@dataclass(frozen=True)
class Estimate:
    """What an estimator says of a ride: values and standard uncertainties (samples,) by the names of ``JUDGED``.

    Values of the side force on the frame (N) may be there too.
    """

    values: Mapping[str, Real]
    sd: Mapping[str, Real]
    run_in: int = 0  # samples at both ends that do not count
    of_fit: Mapping[str, float] = field(default_factory=dict)  # chi^2 for each number, probability of a larger one


def ideal(taken: Ride, _: str = "") -> Estimate:
    """The smoother that knows all but the noise: the least error that is possible."""
    return smooth(taken, taken.leg.loop)


def stated(taken: Ride, _: str = "") -> Estimate:
    """The same with the bicycle of the file in place of the true one."""
    leg = taken.leg
    bicycle = replace(leg.bicycle, values={**leg.bicycle.values, **leg.bicycle.stated})
    return smooth(taken, close_loop(bicycle.motion(leg.speed), leg.colours, leg.rider))


def smooth(taken: Ride, loop: Loop) -> Estimate:
    """Steady Kalman filter of a loop, and a backward pass over its innovations (Bryson & Frazier 1963).

    The smoothed state is the predicted one plus P r, r = C' S^-1 e + L' r of the next sample, L = A - A K C; its
    covariance is P - P N P with N = C' S^-1 C + L' N L.
    """
    once, added = loop.sampled(SAMPLE)
    rows, noise = taken.sensors.rows(loop.outputs), taken.sensors.noise_factor(taken.leg.bicycle.values["lam"])
    p = solve_discrete_are(once.T, rows.T, added, noise @ noise.T)
    weight = rows.T @ np.linalg.inv(rows @ p @ rows.T + noise @ noise.T)
    gain = once @ p @ weight
    left = once - gain @ rows
    seen = np.array([taken.recorded[channel] for channel in taken.sensors.channels]).T
    states, surprises, x = np.empty((len(seen), len(once))), np.empty_like(seen), np.zeros(len(once))
    for k, y in enumerate(seen):
        states[k], surprises[k] = x, y - rows @ x
        x = once @ x + gain @ surprises[k]
    r = np.zeros(len(once))
    for k in range(len(seen) - 1, -1, -1):
        r = weight @ surprises[k] + left.T @ r
        states[k] += p @ r
    spread = p - p @ solve_discrete_lyapunov(left.T, weight @ rows) @ p
    asked = np.array([loop.outputs[name] for name in (*JUDGED, SIDE_FORCE)])
    sd = np.sqrt(np.einsum("ij,jk,ik->i", asked, spread, asked))
    values = dict(zip((*JUDGED, SIDE_FORCE), (states @ asked.T).T, strict=True))
    bands = {name: np.full(len(seen), s) for name, s in zip(JUDGED, sd[:-1], strict=True)}
    return Estimate(values, bands, round(RUN_IN / SAMPLE))


def engine(taken: Ride, cell: str) -> Estimate:
    """What ``velotyre.ride_forces`` says of the file of the ride, with the bicycle of the file and its uncertainty."""
    bicycle = taken.leg.bicycle
    model = vt.build_model({"bicycle": bicycle.base, "effects": bicycle.stated_effects()})
    with TemporaryDirectory() as folder:
        file = Path(folder) / "ride.csv"
        write_ride(file, taken)
        forces = vt.ride_forces(model, (file, taken.stated_speed), turns=True, uncertainty=stated_sd(taken, cell))
    (segment,) = forces.segments
    signals = [*segment.force, *segment.slip]
    sds = [*segment.force_sd, *segment.slip_sd]
    return Estimate(
        {**dict(zip(JUDGED, signals, strict=True)), SIDE_FORCE: segment.push},
        dict(zip(JUDGED, sds, strict=True)),
        of_fit={"misfit": forces.misfit, "goodness": forces.goodness},
    )


def stated_sd(taken: Ride, cell: str) -> dict[str, float]:
    """Standard uncertainties by which the true bicycle was drawn about that of the file, by the cell of the ride."""
    of_cell, base = CELLS[cell], load_bicycle(taken.leg.bicycle.base)
    exact = dict.fromkeys(set(base.values) - {"IByy", "IHyy", "g", "v"}, 0.0)
    sd = exact | {key: of_cell["spread"] * value for key, value in uncertainty(base).items() if key in exact}
    for key, value in taken.leg.bicycle.stated.items():
        effect, *rest = key.split(".")
        if rest:
            of_front = of_cell.get("front_sd", 0.0) if rest[0] in ("stiffness", "damping") else 0.0
            share = of_cell.get("tyre_sd", 0.0) if effect == "relaxation_length" else of_front
            sd[key] = sd["lam"] if rest[0] == "axis_tilt" else share * abs(value)
    return sd


ESTIMATORS: Mapping[str, Callable[[Ride, str], Estimate]] = {"ideal": ideal, "stated": stated, "engine": engine}


def draw_ride(cell: str, style: str, seed: int, number: int, duration: float) -> Ride:
    """A ride of a count: bicycles and speeds take turns."""
    rng = np.random.default_rng([seed, [*CELLS].index(cell), number])
    base, speed = BICYCLES[number % 2], SPEEDS[number // 2 % 2]
    if style == OTHER:
        return draw_other_rides(rng, [speed], base=base, duration=duration, **CELLS[cell])[0]
    leg = draw_legs(rng, [speed], base=base, style=style, **CELLS[cell])[0]
    return ride(leg, rng, duration=duration)


def judge(taken: Ride, estimate: Estimate) -> Row:
    """Shares held, rms errors, and the sum of the forces against the acceleration of the mass centre."""
    truth = taken.truth
    inner = slice(estimate.run_in, len(taken.time) - estimate.run_in)
    row: Row = dict(estimate.of_fit)
    for name in JUDGED:
        error = (estimate.values[name] - truth[name])[inner]
        sd = estimate.sd[name][inner]
        row[f"held.{name}"] = float(np.mean(np.abs(error) <= 1.96 * sd))
        row[f"error.{name}"] = _rms(error)
        row[f"sd.{name}"] = _rms(sd)
        row[f"size.{name}"] = _rms(truth[name][inner])
    mass = taken.leg.bicycle.motion(taken.leg.speed).mass
    inertial = mass * truth["mass_centre_acceleration"]
    whole = sum(estimate.values[name] for name in FORCES)
    row["sum_error_share"] = _rms((whole - inertial + truth["side_force"])[inner]) / _rms(inertial[inner])
    if SIDE_FORCE in estimate.values:
        whole = whole + estimate.values[SIDE_FORCE]
        row["whole_error_share"] = _rms((whole - inertial)[inner]) / _rms(inertial[inner])
    return row


def _rms(signal: Real) -> float:
    return float(np.sqrt(np.mean(signal**2)))


def one_ride(seed: int, estimator: str, style: str, duration: float, cell: str, number: int) -> Row:
    """Make, estimate and judge one ride."""
    row: Row = {
        "seed": seed, "estimator": estimator, "style": style, "duration": duration, "cell": cell, "number": number,
    }  # fmt: skip

    def work(_: Path, row: Row) -> None:
        taken = draw_ride(cell, style, seed, number, duration)
        row |= judge(taken, ESTIMATORS[estimator](taken, cell))

    return attempted(row, work)


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Pooled shares with their standard error over rides, and medians of the rest."""
    judged = [row for row in rows if not row["error"]]
    table: dict[str, Any] = {"rides": len(judged), "errors": [row["error"] for row in rows if row["error"]]}
    if not judged:
        return table
    for name in JUDGED:
        held = np.array([row[f"held.{name}"] for row in judged])
        table[name] = {
            "held": round(float(held.mean()), 4),
            "held_standard_error": round(float(held.std() / np.sqrt(len(held))), 4),
            **{key: float(f"{_rms(np.array([row[f'{key}.{name}'] for row in judged])):.4g}")
               for key in ("error", "sd", "size")},
        }  # fmt: skip
    for key in ("sum_error_share", "whole_error_share", "misfit"):
        shares = [row[key] for row in judged if key in row]
        table[key] = round(float(np.median(shares)), 4) if shares else None
    return table


def run(
    *, out: Path, seed: int, rides: int = 40, estimator: str = "ideal", style: str = "straight",
    duration: float = 300.0, workers: int = 1,
) -> dict[str, Any]:  # fmt: skip
    """Judge an ``estimator`` on ``rides`` of ``duration`` s a cell."""
    if style == OTHER and estimator != "engine":
        raise InputError(f"the estimator {estimator!r} needs inputs of known spectra; use style straight or slalom")
    keys = ("seed", "estimator", "style", "duration", "cell", "number")
    kept = KeptCases(out / "ride_forces_cases.jsonl", keys)
    jobs = [(seed, estimator, style, duration, cell, number) for cell in CELLS for number in range(rides)]
    rows = kept.computed(jobs, one_ride, workers=workers, what="rides")
    cells = {cell: summary([row for row in rows if row["cell"] == cell]) for cell in CELLS}
    return {"targets": TARGETS, "cells": cells}
