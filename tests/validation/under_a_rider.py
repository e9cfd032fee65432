"""Is an effect found under a rider who steers? SYNTHETIC modal tables of the Davis bicycle with an identified rider.

The bicycle moves by the equations of tests.validation.blind, the rider by those below, neither of which the fitter
knows. His gains are means of those that Schwab et al. (2013) identified in three rides at each of five speeds (CC BY
3.0); with each he rides at three speeds nearby. The measurement file has the gains as columns, known in each row. One
effect is hidden, or none.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from bicycle import load_bicycle
from tests.validation.blind.closing import Machine, Space
from tests.validation.blind.generator import table_row, write_modal
from tests.validation.blind.hidden import hide, perturbed, uncertainty
from tests.validation.blind.motion import shape_of
from tests.validation.blind.score import judge

BICYCLE, OMEGA = "rigid_rider_joined", 2 * np.pi * 2.17  # rad/s, muscles with a damping ratio of sqrt(1/2)
RIDES = np.array([
    [2.15, 5.17, 27.21, 14.39, -1.92], [2.19, 28.97, 32.85, 29.02, -2.50], [2.19, 24.25, 32.51, 26.44, -2.57],
    [3.19, 22.72, 26.12, 65.92, -3.00], [3.18, 43.23, 30.45, 94.00, -3.21], [3.11, 31.12, 28.46, 71.26, -2.95],
    [4.27, 72.83, 32.44, 211.79, -3.81], [4.25, 41.51, 28.22, 177.45, -3.19], [4.25, 45.43, 28.99, 169.47, -3.60],
    [5.98, 34.19, 23.34, 334.82, -3.52], [6.06, 29.63, 22.83, 322.89, -3.81], [6.07, 28.32, 20.43, 293.30, -3.31],
    [7.32, 37.19, 26.66, 533.49, -5.37], [7.34, 48.65, 29.89, 583.43, -7.05], [7.36, 45.58, 26.97, 617.10, -4.64],
])  # fmt: skip
"""Speed (m/s), gains on roll, roll rate, integral of steer and steer rate (SI)."""
MEANS = RIDES.reshape(5, 3, 5).mean(1).round(2)
NEARBY = (-0.15, 0.0, 0.15)  # m/s
COLUMNS = ("rider_control.roll", "rider_control.roll_rate", "rider_steer_memory.gain", "rider_control.steer_rate")
CAUSES = ("steer_damper", "steer_spring", "pneumatic_trail", "crown_radius")
FASTEST = 35.0  # rad/s, of an oscillation that a recording of a rider shows


@dataclass(frozen=True)
class Ridden:
    """A machine under a rider: his torque T'' + sqrt(2) omega T' + omega^2 T = omega^2 u on the steering."""

    machine: Machine

    def space(self, speed: float, gains: Sequence[float]) -> Space:
        """State space with his memory of steering, torque and its rate behind the machine's states."""
        bare, (roll, roll_rate, memory, steer_rate) = self.machine.space(speed), gains
        size = len(bare.matrix)
        matrix = np.zeros((size + 3, size + 3))
        matrix[:size, :size], matrix[:size, size + 1] = bare.matrix, bare.inputs[:, 0]
        matrix[size, :size] = bare.outputs["steer"]
        matrix[size + 1, size + 2] = 1
        told = roll * bare.outputs["lean"] + roll_rate * bare.outputs["lean_rate"]
        matrix[size + 2, :size] = OMEGA**2 * (told + steer_rate * bare.outputs["steer_rate"])
        matrix[size + 2, size:] = OMEGA**2 * memory, -(OMEGA**2), -np.sqrt(2) * OMEGA
        return replace(bare, matrix=matrix, outputs={name: np.pad(row, (0, 3)) for name, row in bare.outputs.items()})


def rows_of(ridden: Ridden, rng: np.random.Generator) -> list[dict[str, Any]]:
    """A row per ride for his slowest oscillation with lean: what an onlooker would call the weave of the rider."""
    rows = []
    for (middle, *gains), beside in product(MEANS.tolist(), NEARBY):
        speed = round(middle + beside, 3)
        space = ridden.space(speed, gains)
        roots, vectors = np.linalg.eig(space.matrix)
        seen = {name: row @ vectors for name, row in space.outputs.items()}
        waiting = [
            k for k in np.argsort(roots.imag) if 0.5 < roots[k].imag < FASTEST and -roots[k].real < abs(roots[k].imag)
        ]
        if waiting:
            shape = shape_of("weave", roots[waiting[0]], waiting[0], seen)
            rows.append(table_row(speed, shape, 1.0, rng, ratios=True) | dict(zip(COLUMNS, gains, strict=True)))
    return rows


def make(folder: Path, hidden: tuple[str, ...], seed: int) -> Mapping[str, Any]:
    """Write MEASUREMENT.toml and its table; what is hidden."""
    rng, nominal = np.random.default_rng([seed, 48]), load_bicycle(BICYCLE)
    sd = uncertainty(nominal)
    drawn, machine = hide(hidden, nominal, perturbed(nominal, sd, rng), {}, rng)
    effects: dict[str, dict[str, float]] = {}
    for key, value in zip(COLUMNS, MEANS[0, 1:].tolist(), strict=True):
        effect, name = key.split(".")
        effects.setdefault(effect, {})[name] = value
    write_modal(folder, BICYCLE, effects, sd, rows_of(Ridden(machine), rng))
    return drawn


def one_case(folder: Path, hidden: tuple[str, ...], seed: int) -> Mapping[str, Any]:
    """Make, diagnose and judge a case."""
    from studies.diagnosis import diagnose, read_measurement

    truth = {"effects": make(folder, hidden, seed), "noise": 1.0}
    verdict = diagnose(read_measurement(folder / "MEASUREMENT.toml")).verdict.to_dict()
    return judge(verdict, truth) | {"hidden": list(hidden), "verdict": verdict["verdict"], "class": verdict["class"]}


def run(*, out: Path, seed: int, cases: int = 60) -> dict[str, Any]:
    """Count right names among ``cases`` with a hidden effect, and false ones among a third as many without."""
    told = [one_case(out / f"case_{k}", (CAUSES[k % len(CAUSES)],), seed + k) for k in range(cases)]
    none = [one_case(out / f"none_{k}", (), seed + 10_000 + k) for k in range(max(cases // 3, 1))]
    counts = {key: sum(bool(one[key]) for one in told) for key in ("detected", "right", "tentative_right", "misnamed")}
    by_cause = {cause: [sum(one["right"] for one in told if one["hidden"] == [cause]),
                        sum(one["hidden"] == [cause] for one in told)] for cause in CAUSES}  # fmt: skip
    named = sum(bool(one["any_name"]) for one in none)
    return {"cases": cases, **counts, "right_by_cause": by_cause, "without": len(none), "named_without": named}
