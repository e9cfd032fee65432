"""What do spectra of rides hold of tyres and front frame? SYNTHETIC rides of Kane's bicycle at two speeds.

Cells: "known" (the bicycle is the file's, the tyres and the front frame are off by 15 and 20 %), "default" (the bicycle
is off by its default uncertainty too), and of the latter "damper" and "compliance" (hidden), "none" and "outside"
(something that no library knows). The bound is that of Cramer and Rao (``ride_bounds``) for rides of which all but the
asked parameters, the inputs' spectra, the rider and the noise are known; in "default" the bicycle is unknown within its
uncertainty. An estimate is judged by its error over the bound and by whether its 95 % interval holds the truth.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bicycle import load_bicycle
from tests.validation.blind.hidden import uncertainty
from tests.validation.cases import KeptCases, Row, attempted
from tests.validation.ride_bicycle import OUTSIDE
from tests.validation.ride_bounds import FRONT, TYRES, relative_bounds
from tests.validation.ride_generator import Leg, Ride, draw_legs, ride

BICYCLES = ("benchmark", "rigid_rider")
SPEEDS = (6.0, 9.0)  # m/s
OFF = {"tyre_sd": 0.15, "front_sd": 0.2}
CELLS: Mapping[str, Mapping[str, Any]] = {  # see draw_bicycle
    "known": {"spread": 0.0, **OFF},
    "default": {"spread": 1.0, **OFF},
    "damper": {"spread": 1.0, **OFF, "damper": "hidden"},
    "compliance": {"spread": 1.0, **OFF, "compliance": "hidden"},
    "none": {"spread": 1.0, **OFF},
    "outside": {"spread": 1.0, **OFF},
}
ASKED = (*TYRES, *FRONT)
TARGETS = {
    "error_over_bound": 1.5,  # rms of C, relaxation length and front stiffness, bicycle known
    "covered": (0.93, 0.97), "found": 0.8, "named_without": 1 / 60, "named_outside": 0.07,
}  # fmt: skip


@dataclass(frozen=True)
class Case:
    """Rides of one bicycle, one a speed."""

    cell: str
    rides: tuple[Ride, ...]

    @property
    def legs(self) -> list[Leg]:
        """Bicycle, rider and inputs at each speed."""
        return [taken.leg for taken in self.rides]

    @property
    def truth(self) -> dict[str, float]:
        """True values of what is asked, SI."""
        return {key: self.legs[0].bicycle.values[key] for key in ASKED}


def draw_case(cell: str, seed: int, number: int, *, duration: float = 300.0, speeds: Sequence[float] = SPEEDS) -> Case:
    """A case of a cell: bicycles take turns, and in "outside" what no library knows; a ride of ``duration`` s each."""
    rng = np.random.default_rng([seed, [*CELLS].index(cell), number])
    beyond = OUTSIDE[number // 2 % len(OUTSIDE)] if cell == "outside" else ""
    legs = draw_legs(rng, speeds, base=BICYCLES[number % 2], outside=beyond, **CELLS[cell])
    return Case(cell, tuple(ride(leg, rng, duration=duration) for leg in legs))


def bound(case: Case, *, duration: float = 300.0, count: int = 600) -> dict[str, float]:
    """Relative Cramer-Rao bounds of what is asked, by the cell's knowledge of the bicycle."""
    base = case.legs[0].bicycle.base
    prior = {} if case.cell == "known" else uncertainty(load_bicycle(base))
    return relative_bounds(case.legs, asked=ASKED, prior_sd=prior, duration=duration, count=count)


def judge(truth: Mapping[str, float], least: Mapping[str, float], values: Row, sd: Row) -> Row:
    """Errors over bounds, and whether intervals hold the truth, by parameter.

    ``truth`` and estimates (``values``, ``sd``) are in SI units, the bounds ``least`` are shares of the truth.
    """
    errors = {key: values[key] - truth[key] for key in values}
    ratios = {key: error / (least[key] * abs(truth[key])) for key, error in errors.items()}
    return {"over_bound": ratios, "held": {key: abs(error) <= 1.96 * sd[key] for key, error in errors.items()}}


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Root mean squares of errors over bounds, and shares held, by parameter."""
    keys = [*rows[0]["over_bound"]] if rows else []
    return {
        key: {
            "error_over_bound": round(float(np.sqrt(np.mean([row["over_bound"][key] ** 2 for row in rows]))), 3),
            "held": round(float(np.mean([row["held"][key] for row in rows])), 4),
        }
        for key in keys
    }


def one_bound(seed: int, cell: str, number: int) -> Row:
    """Bounds of a case, of both rides and of each alone."""
    row: Row = {"seed": seed, "cell": cell, "number": number}

    def work(_: Path, row: Row) -> None:
        case = draw_case(cell, seed, number, duration=1.0)
        row["bounds"] = {"both": bound(case)}
        for taken in case.rides:
            row["bounds"][f"{taken.leg.speed:g} m/s"] = bound(Case(cell, (taken,)))

    return attempted(row, work)


def run(*, out: Path, seed: int, bicycles: int = 10, workers: int = 1) -> dict[str, Any]:
    """Median bounds (% of the value) of a number of ``bicycles``, each known and with its default uncertainty."""
    kept = KeptCases(out / "ride_spectra_bounds.jsonl", ("seed", "cell", "number"))
    cells = ("known", "default")
    jobs = [(seed, cell, number) for cell in cells for number in range(bicycles)]
    rows = kept.computed(jobs, one_bound, workers=workers, what="bounds")
    errors = [row["error"] for row in rows if row["error"]]
    tables = {cell: median_bounds([row for row in rows if row["cell"] == cell and not row["error"]]) for cell in cells}
    return {"targets": TARGETS, "errors": errors, "bounds_percent": tables}


def median_bounds(rows: Sequence[Row]) -> dict[str, dict[str, float]]:
    """Medians in % by speeds and parameter."""
    tables: dict[str, dict[str, float]] = {}
    for speeds in rows[0]["bounds"] if rows else ():
        some = [row["bounds"][speeds] for row in rows]
        tables[speeds] = {key: float(f"{100 * np.median([one[key] for one in some]):.3g}") for key in ASKED}
    return tables
