"""What do spectra of rides hold of tyres and front frame? SYNTHETIC rides of Kane's bicycle at two speeds.

Cells: "known" (the bicycle is the file's, the tyres and the front frame are off by 15 and 20 %), "default" (the bicycle
is off by its default uncertainty too), and of the latter "damper" and "compliance" (hidden), "none" and "outside"
(something that no library knows). The bound is that of Cramer and Rao (``ride_bounds``) for rides of which all but the
asked parameters, the inputs' spectra, the rider and the noise are known; in "default" the bicycle is unknown within its
uncertainty. What the file states of tyres and front frame counts as known beforehand, for the bound as for the fit.
An estimate is judged by its error over the bound and by whether its 95 % interval holds the truth.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bicycle import load_bicycle
from studies.diagnosis import Diagnosis, Kind, diagnose, read_measurement
from studies.inference import fit
from tests.validation.blind.hidden import uncertainty
from tests.validation.cases import KeptCases, Row, attempted, share_of
from tests.validation.other_rides import draw_other_rides
from tests.validation.ride_bicycle import OUTSIDE
from tests.validation.ride_bounds import FRONT, TYRES, relative_bounds
from tests.validation.ride_generator import Leg, Ride, draw_legs, ride, write_ride
from tyre.ground import write_text

BICYCLES = ("benchmark", "rigid_rider")
SPEEDS = (6.0, 9.0)  # m/s
OTHER = "other"
OFF = {"tyre_sd": 0.15, "front_sd": 0.2}
CELLS: Mapping[str, Mapping[str, Any]] = {  # see draw_bicycle
    "known": {"spread": 0.0, **OFF},
    "default": {"spread": 1.0, **OFF},
    "damper": {"spread": 1.0, **OFF, "damper": "hidden"},
    "compliance": {"spread": 1.0, **OFF, "compliance": "hidden"},
    "none": {"spread": 1.0, **OFF},
    "outside": {"spread": 1.0, **OFF},
    OTHER: {"spread": 0.0, **OFF},
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

    @property
    def stated(self) -> dict[str, float]:
        """Values of what is asked before a ride: those of the file, of a hidden front frame the true ones."""
        return {**self.truth, **{k: v for k, v in self.legs[0].bicycle.stated.items() if k in ASKED}}


def draw_case(cell: str, seed: int, number: int, *, duration: float = 300.0, speeds: Sequence[float] = SPEEDS) -> Case:
    """A case of a cell: bicycles take turns, and in "outside" what no library knows; a ride of ``duration`` s each."""
    rng = np.random.default_rng([seed, [*CELLS].index(cell), number])
    if cell == OTHER:
        rides = draw_other_rides(rng, speeds, base=BICYCLES[number % 2], duration=duration, **CELLS[cell])
        return Case(cell, tuple(rides))
    beyond = OUTSIDE[number // 2 % len(OUTSIDE)] if cell == "outside" else ""
    legs = draw_legs(rng, speeds, base=BICYCLES[number % 2], outside=beyond, **CELLS[cell])
    return Case(cell, tuple(ride(leg, rng, duration=duration) for leg in legs))


def bound(case: Case, *, duration: float = 300.0, count: int = 600) -> dict[str, float]:
    """Relative Cramer-Rao bounds of what is asked, by the cell's knowledge of the bicycle."""
    base = case.legs[0].bicycle.base
    prior = {} if not CELLS[case.cell]["spread"] else dict(uncertainty(load_bicycle(base)))
    prior |= {key: OFF["tyre_sd" if key in TYRES else "front_sd"] * case.stated[key] for key in ASKED}
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


def write_case(case: Case, folder: Path) -> Path:
    """Write rides and measurement file of a case, with the standard uncertainties by which it was drawn."""
    bicycle = case.legs[0].bicycle
    lines = ['kind = "ride_spectra"', f'bicycle = "{bicycle.base}"']
    for effect, table in bicycle.stated_effects().items():
        lines.append(f"[effects.{effect}]")
        for key, value in table.items():
            wheels = ", ".join(f"{k} = {v}" for k, v in value.items()) if isinstance(value, dict) else ""
            lines.append(f"{key} = {{ {wheels} }}" if wheels else f"{key} = {value}")
    lines += ["[uncertainty]", *(f'"{key}" = {sd}' for key, sd in stated_sd(case).items()), "[ride_spectra]"]
    for taken in case.rides:
        name = f"ride_{taken.leg.speed:g}.csv"
        write_ride(folder / name, taken)
        lines += ["[[ride_spectra.rides]]", f'file = "{name}"', f"speed_m_s = {taken.stated_speed}"]
    return write_lines(folder / "measurement.toml", lines)


def write_lines(file: Path, lines: Sequence[str]) -> Path:
    """Write ``lines`` and return their file."""
    write_text(file, "\n".join(lines) + "\n")
    return file


def stated_sd(case: Case) -> dict[str, float]:
    """Standard uncertainties by which the true bicycle was drawn about that of the file."""
    bicycle, spread = case.legs[0].bicycle, CELLS[case.cell]["spread"]
    base = load_bicycle(bicycle.base)
    own = {key: spread * value for key, value in uncertainty(base).items() if key in base.values}
    sd = dict.fromkeys(set(base.values) - {"IByy", "IHyy", "g", "v"}, 0.0) | own
    for key, value in bicycle.stated.items():
        if key in ASKED:
            sd[key] = OFF["tyre_sd" if key in TYRES else "front_sd"] * abs(value)
        elif key == "front_compliance.axis_tilt":
            sd[key] = sd["lam"]
        elif key.startswith("front_compliance."):
            sd[key] = 0.0
    return sd


def estimate(measurement: Kind, row: Row) -> None:
    """Fit a measurement; what is asked (value, standard uncertainty, SI) and how well it fits go to ``row``."""
    final = fit(measurement, (), patient=True)
    row["goodness"], row["misfit"] = final.goodness, final.objective / len(final.residual)
    row["values"], row["sd"] = {}, {}
    for k, unknown in enumerate(measurement.nuisances):
        if unknown.name in ASKED:
            row["values"][unknown.name] = float(unknown.value(final.theta[k]))
            row["sd"][unknown.name] = float(np.sqrt(final.covariance[k, k]) * unknown.slope(final.theta[k]))


def named(found: Diagnosis) -> list[str]:
    """Identifiers of the effects that a diagnosis names."""
    verdict = found.verdict
    return [effect.identifier for effect in verdict.effects] if verdict.verdict in ("named", "partial") else []


def one_case(seed: int, job: str, cell: str, number: int) -> Row:
    """Judge one case: ``job`` "fit" estimates what is asked, "names" looks for what is missing."""
    row: Row = {"seed": seed, "job": job, "cell": cell, "number": number}

    def work(folder: Path, row: Row) -> None:
        case = draw_case(cell, seed, number)
        measurement = read_measurement(str(write_case(case, folder)))
        if job == "names":
            found = diagnose(measurement)
            row["verdict"], row["named"] = found.verdict.verdict, named(found)
            return
        estimate(measurement.prepare(), row)
        own = {key: row["sd"][key] / abs(true) for key, true in case.truth.items()}
        row["bounds"] = own if cell == OTHER else bound(case, count=300)
        row |= judge(case.truth, row["bounds"], row["values"], row["sd"])

    return attempted(row, work)


def one_bound(seed: int, cell: str, number: int) -> Row:
    """Bounds of a case, of both rides and of each alone."""
    row: Row = {"seed": seed, "cell": cell, "number": number}

    def work(_: Path, row: Row) -> None:
        case = draw_case(cell, seed, number, duration=1.0)
        row["bounds"] = {"both": bound(case)}
        for taken in case.rides:
            row["bounds"][f"{taken.leg.speed:g} m/s"] = bound(Case(cell, (taken,)))

    return attempted(row, work)


def run(
    *,
    out: Path,
    seed: int,
    known: int = 40,
    default: int = 30,
    other: int = 0,
    names: int = 0,
    bicycles: int = 0,
    workers: int = 1,
) -> dict[str, Any]:
    """Fit ``known``, ``default`` and ``other`` cases, judge ``names`` a cell, and find bounds of ``bicycles``."""
    fitted = {"known": known, "default": default, OTHER: other}
    kept = KeptCases(out / "ride_spectra_cases.jsonl", ("seed", "job", "cell", "number"))
    jobs = [(seed, "fit", cell, k) for cell, count in fitted.items() for k in range(count)]
    jobs += [(seed, "names", cell, k) for k in range(names) for cell in ("damper", "compliance", "none", "outside")]
    rows = kept.computed(jobs, one_case, workers=workers, what="cases")
    kept = KeptCases(out / "ride_spectra_bounds.jsonl", ("seed", "cell", "number"))
    jobs = [(seed, cell, number) for cell in ("known", "default") for number in range(bicycles)]
    bound_rows = kept.computed(jobs, one_bound, workers=workers, what="bounds")
    errors = [row["error"] for row in (*rows, *bound_rows) if row["error"]]
    fits = {cell: [row for row in rows if row["job"] == "fit" and row["cell"] == cell and not row["error"]]
            for cell in fitted}  # fmt: skip
    return {
        "targets": TARGETS,
        "errors": errors,
        "estimates": {cell: estimates(some) for cell, some in fits.items() if some},
        "names": {cell: verdicts([row for row in rows if row["job"] == "names" and row["cell"] == cell])
                  for cell in CELLS if names and cell not in fits},
        "bounds_percent": {
            cell: median_bounds([row for row in bound_rows if row["cell"] == cell and not row["error"]])
            for cell in ("known", "default")
        },
    }  # fmt: skip


def estimates(rows: Sequence[Row]) -> dict[str, Any]:
    """Errors over bounds, shares held, what remains (median sd in % of the value), and how often the model fits."""
    remaining = {key: np.median([row["sd"][key] / abs(row["values"][key]) for row in rows]) for key in ASKED}
    typical = {key: np.median([abs(row["over_bound"][key]) for row in rows]) for key in ASKED}
    table = summary(rows)
    for key, row in table.items():
        row["sd_percent"] = round(100 * float(remaining[key]), 2)
        row["median_error_over_bound"] = round(float(typical[key]), 3)
    held = [flag for row in rows for flag in row["held"].values()]
    fitting = [row for row in rows if row["goodness"] > 0.01]
    return {
        "cases": len(rows),
        "by_parameter": table,
        "held": share_of(held),
        "fits": share_of([row["goodness"] > 0.01 for row in rows]),
        "held_where_it_fits": share_of([flag for row in fitting for flag in row["held"].values()]),
    }


def verdicts(rows: Sequence[Row]) -> dict[str, Any]:
    """How often something, and the hidden effect, is named."""
    judged = [row for row in rows if not row["error"]]
    hidden = {"damper": "steer_damper", "compliance": "front_compliance"}
    return {
        "names": [row["named"] for row in judged],
        "something_named": share_of([bool(row["named"]) for row in judged]),
        "found": share_of([row["named"] == [hidden.get(row["cell"], "")] for row in judged]),
    }


def median_bounds(rows: Sequence[Row]) -> dict[str, dict[str, float]]:
    """Medians in % by speeds and parameter."""
    tables: dict[str, dict[str, float]] = {}
    for speeds in rows[0]["bounds"] if rows else ():
        some = [row["bounds"][speeds] for row in rows]
        tables[speeds] = {key: float(f"{100 * np.median([one[key] for one in some]):.3g}") for key in ASKED}
    return tables
