"""Claims of the paper, each tested on the numbers of its own tables (Dell'Orto, Ballo, Mastinu & Gobbi).

A number holds within one unit of its last digit (2.5 for a multiple of five, which is how a rounded number is written),
is partly true within a quarter of itself, and fails beyond. A statement about several conditions holds if it is true of
all of them, is partly true if of some, and fails if of none. Numbers are named after their unit: ``rise_percent``.
"""

from collections.abc import Callable
from csv import DictReader
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from tyre.ground import Array
from tyre.laws import normalised_lateral_force_slope
from tyre.maps import TyreMap

Verdict = Literal["holds", "partly", "fails"]
UNITS = {
    "percent": "%", "N_per_mm": "N/mm", "N_per_deg": "N/deg", "N_per_rad": "N/rad", "per_rad": "1/rad", "mm": "mm",
    "bar": "bar", "s": "s",
}  # fmt: skip
SPEED = 9.3 / 3.6  # m/s, the paper's section 3.2
LAG_SHARE = 100 * (1 - np.exp(-1))  # % of the steady force, after one time constant


@dataclass(frozen=True, eq=False)
class Grid:
    """One tyre on one surface: arrays of shape (loads, pressures), both ascending, in the units of the tables."""

    loads: Array
    pressures: Array
    C: Array
    length: Array

    @property
    def K(self) -> Array:
        """Lateral stiffness: cornering stiffness in N/rad over relaxation length in mm, N/mm."""
        return np.asarray(np.degrees(self.C) / self.length)


@dataclass(frozen=True, eq=False)
class Tables:
    """Tables of Dell'Orto et al.: ``tyre1`` on flat track and drum, ``tyre2`` and ``tyre3`` on flat track."""

    tyre1: Grid
    drum: Grid
    tyre2: Grid
    tyre3: Grid

    @property
    def length(self) -> Array:
        """Relaxation lengths (mm) of all tables, in their order."""
        return np.array([grid.length for grid in (self.tyre1, self.drum, self.tyre2, self.tyre3)])


def load_tables() -> Tables:
    """Read the tables from the packaged data."""
    grids = []
    for tyre, surface in (("Tyre1", "flat"), ("Tyre1", "drum"), ("Tyre2", "flat"), ("Tyre3", "flat")):
        table = TyreMap.load(tyre, surface=surface).table
        cornering = table.pivot(index="load_N", columns="pressure_bar", values="cornering_stiffness_N_per_deg")
        length = table.pivot(index="load_N", columns="pressure_bar", values="relaxation_length_mm")
        numbers = (cornering.index, cornering.columns, cornering, length)
        grids.append(Grid(*(one.to_numpy(dtype=np.float64) for one in numbers)))
    return Tables(*grids)


@dataclass(frozen=True)
class Outcome:
    """Answer of the tables to a claim: the numbers as shown, the verdict, and the numbers behind it."""

    computed: str
    verdict: Verdict
    values: dict[str, Any]


def judge_number(computed: float, claimed: float) -> Verdict:
    """Compare a number with a whole number ``claimed`` in the text by the rule of this module."""
    if abs(computed - claimed) <= (2.5 if claimed % 5 == 0 else 1.0):
        return "holds"
    return "partly" if abs(computed - claimed) <= abs(claimed) / 4 else "fails"


def judge_all(true: ArrayLike) -> Verdict:
    """Judge that something is ``true`` everywhere: it fails if nowhere, else it is partly true."""
    conditions = np.asarray(true, dtype=bool)
    if conditions.all():
        return "holds"
    return "partly" if conditions.any() else "fails"


def _shown(values: dict[str, Any]) -> str:
    """Print numbers by their names, with their units; of many the least and the greatest."""
    found = []
    for name, value in values.items():
        unit = next((unit for unit in UNITS if name.endswith(f"_{unit}")), "")
        some = np.atleast_1d(value)
        numbers = ", ".join(f"{x:.4g}" for x in some) if some.size < 5 else f"{some.min():.4g} to {some.max():.4g}"
        words = f"{name.removesuffix(f'_{unit}').replace('_', ' ')} {numbers}"
        found.append(f"{words} {UNITS[unit]}" if unit else words)
    return "; ".join(found)


def holds(true: ArrayLike, /, **values: ArrayLike) -> Outcome:
    """Judge that something is ``true`` everywhere, and show how often it is and the ``values`` behind it."""
    plain = {name: np.ravel(value).tolist() if np.ndim(value) else float(value) for name, value in values.items()}  # type: ignore[arg-type]
    count = f"{int(np.sum(true))} of {np.size(true)}: " if np.size(true) > 1 else ""
    return Outcome(count + _shown(plain), judge_all(true), plain)


def near(claimed: float, /, **values: ArrayLike) -> Outcome:
    """Judge the first of the ``values`` against the number ``claimed`` in the text."""
    found = holds(True, **values)
    return Outcome(found.computed, judge_number(next(iter(found.values.values())), claimed), found.values)


def above(limit: float, /, **values: ArrayLike) -> Outcome:
    """Judge that the first of the ``values`` is above a ``limit`` everywhere."""
    return holds(np.asarray(next(iter(values.values()))) > limit, **values)


def below(limit: float, /, **values: ArrayLike) -> Outcome:
    """Judge that the first of the ``values`` is below a ``limit`` everywhere."""
    return holds(np.asarray(next(iter(values.values()))) < limit, **values)


def same(within: float, /, **values: ArrayLike) -> Outcome:
    """Judge that the first of the ``values``, a difference, is smaller than ``within`` everywhere."""
    return holds(np.abs(next(iter(values.values()))) < within, **values)


def excess(one: Array, other: Array) -> Array:
    """Excess of ``one`` over ``other``, %."""
    return np.asarray(100 * (one / other - 1))


def spread(values: Array, axis: int) -> Array:
    """Excess of the largest over the smallest value along an ``axis``, %."""
    return excess(values.max(axis=axis), values.min(axis=axis))


def r_squared(data: Array, model: Array) -> float:
    """Coefficient of determination, eq. (6)."""
    return 1 - float(((data - model) ** 2).sum() / ((data - data.mean()) ** 2).sum())


def correlation(data: Array, model: Array) -> Outcome:
    """Compare the coefficient of determination of two tables with their correlation coefficient."""
    one, other = r_squared(data, model), np.corrcoef(data, model)[0, 1]
    return holds(np.isclose(one, other), r_squared=one, correlation=other)


def lowest_length(t: Tables) -> Outcome:
    """Compare the claimed place with the lowest of all tables, of the flat track, and of the two that are cited."""
    lowest, claimed = [t.length[rows].min() for rows in ([0, 1, 2, 3], [0, 2, 3], [2, 3])], t.tyre2.length[2, 1]
    return holds(lowest == claimed, lowest_mm=lowest, claimed_place_mm=claimed)


def exponent_of_equation_2(t: Tables) -> Outcome:
    """Evaluate the printed and the corrected exponent after one time constant."""
    length = t.tyre1.length[0, 0] / 1e3
    printed, corrected = (100 * (1 - np.exp(-ratio * length / SPEED)) for ratio in (length / SPEED, SPEED / length))
    return holds(np.isclose(printed, LAG_SHARE), printed_share_percent=printed, corrected_share_percent=corrected)


def time_divided_by_speed(t: Tables) -> Outcome:
    """Multiply and divide the time to 63 % by the speed, in SI units."""
    length = t.tyre1.length[0, 0] / 1e3
    time = length / SPEED
    return holds(
        np.isclose(time / SPEED, length), time_s=time, time_times_speed_mm=1e3 * time * SPEED,
        time_over_speed_in_s2_over_m=time / SPEED,
    )  # fmt: skip


def load_missing_in_equation_5(t: Tables) -> Outcome:
    """Compare B C D of a curve through the measured slope with that slope: any C and D will do."""
    load, measured = t.tyre1.loads[0], np.degrees(t.tyre1.C[0, 0])
    curve = {"stiffness_factor": measured / (1.3 * load), "shape_factor": 1.3, "peak_factor": 1.0}
    slope = normalised_lateral_force_slope(0.0, curvature_factor=0.0, **curve)
    return holds(np.isclose(slope, measured), product_per_rad=slope, stiffness_N_per_rad=slope * load)


def caption_of_table_7(t: Tables) -> Outcome:
    """Compare the lateral stiffness by Table 7, with the C of flat track or of the drum, with Tables 2 and 6."""
    flat, drum = (100 * np.abs(np.degrees(C) / t.drum.length / t.tyre1.K - 1).max() for C in (t.tyre1.C, t.drum.C))
    return holds(flat < drum, off_with_table_2_percent=flat, off_with_table_3_percent=drum)


# loads are 340, 400 and 490 N (rows), pressures 3.5, 5.5 and 7.5 bar (columns)
# test of each claim, by the name that it has in tests/published/data/paper_claims.csv
TESTS: dict[str, Callable[[Tables], Outcome]] = {
    # lateral stiffness, Figs. 5 and 6
    "tyre1 lateral stiffness over pressure":
        lambda t: holds(np.diff(t.tyre1.K.mean(axis=0)) > 0, mean_N_per_mm=t.tyre1.K.mean(axis=0)),
    "tyre1 lateral stiffness over load at low pressure":
        lambda t: below(5, spread_percent=spread(t.tyre1.K[:, :2], 0)),
    "tyre1 lateral stiffness over load at 7 5 bar":
        lambda t: near(10, spread_percent=spread(t.tyre1.K, 0)[2], drum_percent=spread(t.drum.K, 0)[2],
                       common_N_per_mm=(t.tyre1.K + t.drum.K).mean(axis=0) / 2),
    "tyre2 lateral stiffness over load and pressure":
        lambda t: above(5, spread_percent=np.append(spread(t.tyre2.K, 0), spread(t.tyre2.K, 1))),
    "lateral stiffness of tyre2 against tyre1 at 3 5 bar":
        lambda t: same(5, change_percent=excess(t.tyre2.K, t.tyre1.K)[:, 0]),
    "tyre2 lateral stiffness from 340 to 400 newton":
        lambda t: near(20, rise_percent=excess(t.tyre2.K[1], t.tyre2.K[0])[0], K_N_per_mm=t.tyre2.K[:, 0]),
    "tyre2 lateral stiffness over load at 5 5 bar":
        lambda t: holds(np.diff(t.tyre2.K[:, 1]) > 0, K_N_per_mm=t.tyre2.K[:, 1]),
    "tyre2 lateral stiffness at 5 5 against 7 5 bar":
        lambda t: holds(t.tyre2.K[:, 1].max() > t.tyre2.K[:, 2].max(),
                        change_percent=excess(t.tyre2.K[:, 1], t.tyre2.K[:, 2])),
    "lateral stiffness of tyre2 against tyre1 at 7 5 bar":
        lambda t: near(-25, mean_percent=excess(t.tyre2.K, t.tyre1.K)[:, 2].mean()),
    "lateral stiffness of tyre2 against tyre3": lambda t: above(0, change_percent=excess(t.tyre2.K, t.tyre3.K)),
    "tyre3 lateral stiffness at 5 5 against 7 5 bar":
        lambda t: above(0, at_490_N_percent=excess(t.tyre3.K[2, 1], t.tyre3.K[2, 2]),
                        at_400_N_percent=excess(t.tyre3.K[1, 1], t.tyre3.K[1, 2])),
    # cornering stiffness, Tables 2 to 5
    "cornering stiffness flat over drum": lambda t: near(15, mean_percent=excess(t.tyre1.C, t.drum.C).mean()),
    "cornering stiffness at 3 5 bar is lowest":
        lambda t: holds(t.tyre1.C.argmin(axis=1) == 0, lowest_bar=t.tyre1.pressures[t.tyre1.C.argmin(axis=1)]),
    "drum cornering stiffness over pressure at 340 newton":
        lambda t: holds(np.diff(t.drum.C[0]) < 0, C_N_per_deg=t.drum.C[0]),
    "tyre1 cornering stiffness over load": lambda t: above(0, step_N_per_deg=np.diff(t.tyre1.C[:, 1:], axis=0)),
    "tyre1 cornering stiffness above 400 newton":
        lambda t: holds(-5 < 100 * (t.tyre1.C[2, 0] / t.tyre1.C[1, 0] - 1) < 0,
                        change_percent=excess(t.tyre1.C[2, 0], t.tyre1.C[1, 0])),
    "tyre1 cornering stiffness at 340 newton":
        lambda t: holds(t.tyre1.C[0, 2] < t.tyre1.C[0, :2], C_N_per_deg=t.tyre1.C[0]),
    "tyre1 peak cornering stiffness at 490 newton":
        lambda t: holds(t.tyre1.C[2].argmax() == 2, C_N_per_deg=t.tyre1.C[2]),
    "drum cornering stiffness over load": lambda t: above(0, step_N_per_deg=np.diff(t.drum.C, axis=0)),
    "drum cornering stiffness at low load": lambda t: below(0, step_N_per_deg=np.diff(t.drum.C[:2], axis=1)),
    "drum cornering stiffness at 3 5 against 7 5 bar":
        lambda t: near(15, change_percent=excess(t.drum.C[0, 0], t.drum.C[0, 2])),
    "drum peak cornering stiffness at 490 newton":
        lambda t: holds(t.drum.C[2].argmax() == 1, C_N_per_deg=t.drum.C[2]),
    "influence of load on cornering stiffness":
        lambda t: holds(t.tyre1.C[2] / t.tyre1.C[0] < t.drum.C[2] / t.drum.C[0],
                        flat_percent=excess(t.tyre1.C[2], t.tyre1.C[0]), drum_percent=excess(t.drum.C[2], t.drum.C[0])),
    "cornering stiffness of tyre1 against tyre2": lambda t: above(0, change_percent=excess(t.tyre1.C, t.tyre2.C)),
    "pressures of the peaks at 490 newton":
        lambda t: holds([t.tyre1.C[2].argmax() == 2, t.tyre2.C[2].argmax() == 0],
                        tyre1_N_per_deg=t.tyre1.C[2], tyre2_N_per_deg=t.tyre2.C[2]),
    "tyre2 cornering stiffness over load": lambda t: above(0, step_N_per_deg=np.diff(t.tyre2.C, axis=0)),
    "cornering stiffness of tyre2 at 490 newton": lambda t: same(1, change_percent=excess(t.tyre2.C, t.tyre1.C)[2]),
    "tyre1 saturation at 490 newton": lambda t: below(0, change_percent=excess(t.tyre1.C[2], t.tyre1.C[1])),
    "cornering stiffness of tyre3 against tyre2": lambda t: above(0, change_percent=excess(t.tyre3.C, t.tyre2.C)),
    "cornering stiffness of tyre2 and tyre3 up to 490 newton":
        lambda t: above(0, step_N_per_deg=np.diff([t.tyre2.C, t.tyre3.C], axis=1)),
    "mean difference of tyre3 and tyre2": lambda t: near(8, mean_N_per_deg=(t.tyre3.C - t.tyre2.C).mean()),
    "mean ratio of tyre3 and tyre2": lambda t: near(6, mean_percent=excess(t.tyre3.C, t.tyre2.C).mean()),
    # relaxation length, Tables 6 to 9
    "relaxation length flat over drum": lambda t: near(15, mean_percent=excess(t.tyre1.length, t.drum.length).mean()),
    "relaxation length flat over drum at 7 5 bar":
        lambda t: near(11, mean_percent=excess(t.tyre1.length, t.drum.length)[:, 2].mean(),
                       at_3_5_bar_percent=excess(t.tyre1.length, t.drum.length)[:, 0].mean()),
    "relaxation length is lower on the drum":
        lambda t: below(0, change_percent=excess(t.drum.length, t.tyre1.length)),
    "relaxation length follows cornering stiffness on the drum":
        lambda t: same(0.5, gap_of_ratios_percent=excess(t.tyre1.length, t.drum.length) - excess(t.tyre1.C, t.drum.C)),
    "tyre1 relaxation length over load": lambda t: above(0, step_mm=np.diff(t.length[:2], axis=1)),
    "relaxation length over load": lambda t: above(0, step_mm=np.diff(t.length, axis=1)),
    "direction of pressure dependence":
        lambda t: below(0, tyre1_step_mm=np.diff(t.length[:2], axis=2), others_step_mm=np.diff(t.length[2:], axis=2)),
    "almost doubled": lambda t: above(1.8, factor=t.length[:2, :, 0] / t.length[:2, :, 2]),
    "direction of the doubling":
        lambda t: above(0, change_percent=excess(t.length[:2, :, 2], t.length[:2, :, 0])),
    "sensitivity to load of tyre2 against tyre1":
        lambda t: holds(spread(t.tyre2.length, 0) > spread(t.tyre1.length, 0),
                        tyre1_spread_percent=spread(t.tyre1.length, 0), tyre2_spread_percent=spread(t.tyre2.length, 0)),
    "shift of tyre2 at 7 5 bar": lambda t: near(13, mean_percent=excess(t.tyre2.length, t.tyre1.length)[:, 2].mean()),
    "peak of tyre2 at 3 5 bar":
        lambda t: near(24 if t.tyre2.length[:, 0].argmax() == 2 else np.nan,
                       change_percent=excess(t.tyre2.length[2, 0], t.tyre1.length[2, 0])),
    "lowest relaxation length": lowest_length,
    "relaxation length of tyre3 against tyre2":
        lambda t: above(0, change_percent=excess(t.tyre3.length, t.tyre2.length)),
    "relaxation length at 7 5 against 5 5 bar":
        lambda t: above(0, change_percent=excess(t.length[2:, :, 2], t.length[2:, :, 1]),
                        mean_percent=excess(t.length[2:, :, 2], t.length[2:, :, 1]).mean()),
    "explanation by slip between layers": lambda t: below(0, step_mm=t.length[2:, 1:, 2] - t.length[2:, 1:, 1]),
    "sensitivity to pressure against load":
        lambda t: holds(spread(t.tyre1.length, 1).min() > 2 * spread(t.tyre1.length, 0).max(),
                        over_pressure_percent=spread(t.tyre1.length, 1), over_load_percent=spread(t.tyre1.length, 0)),
    "values against reference 30": lambda t: above(60, lowest_mm=t.length.min()),
    # formulas and captions
    "share of the steady force": lambda t: holds(abs(LAG_SHARE - 63) < 0.5, share_percent=LAG_SHARE),
    "exponent of equation 2": exponent_of_equation_2,
    "time divided by speed": time_divided_by_speed,
    "load missing in equation 5": load_missing_in_equation_5,
    "caption of table 7": caption_of_table_7,
    "r squared is no correlation coefficient":
        lambda t: correlation(t.tyre1.length.ravel(), t.drum.length.ravel()),
    "range of r squared":
        lambda t: holds(0 <= r_squared(t.tyre1.C, t.drum.C) <= 1, r_squared=r_squared(t.tyre1.C, t.drum.C)),
}  # fmt: skip


CLAIMS = Path(__file__).parent / "data" / "paper_claims.csv"
COLUMNS = ("section", "claim", "text", "computed", "verdict", "remark")


def audit(tables: Tables | None = None) -> list[dict[str, Any]]:
    """Test every claim on the packaged tables, or on others (without remarks); a record each, sorted by section."""
    tested = tables or load_tables()
    with CLAIMS.open(encoding="utf-8", newline="") as stream:
        claims = sorted(DictReader(stream), key=lambda claim: (claim["section"][0].isdigit(), claim["section"]))
    records = []
    for claim in claims:
        record: dict[str, Any] = {key: claim[key] for key in ("section", "claim", "text", "name")}
        record |= vars(TESTS[claim["name"]](tested))
        record["remark"] = claim["remark"] if tables is None else ""
        records.append(record)
    return records


def as_markdown(records: list[dict[str, Any]]) -> str:
    """Write the rule of the verdicts, their counts and a table with a row a claim."""
    verdicts = [record["verdict"] for record in records]
    counts = ", ".join(f"{verdicts.count(verdict)} {verdict}" for verdict in ("holds", "partly", "fails"))
    rows = ["| " + " | ".join(str(record[key]) for key in COLUMNS) + " |" for record in records]
    header = [
        "| section | claim of the text | text | from the tables | verdict | remark |",
        "|---|---|---|---|---|---|",
    ]
    rule = (
        "A number holds within one unit of its last digit (2.5 for a multiple of five, which is how a rounded number "
        "is written), is partly true within a quarter of itself, and fails beyond. A statement about several "
        "conditions holds if it is true of all of them, is partly true if of some, and fails if of none."
    )
    return "\n".join([rule, "", f"{len(records)} claims: {counts}.", "", *header, *rows]) + "\n"
