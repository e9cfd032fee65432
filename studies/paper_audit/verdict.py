"""Tables of Dell'Orto et al., and the rule by which a claim of the text is judged by their values.

A number holds within one unit of its last digit (2.5 for a multiple of five, which is how a rounded number is written),
is partly true within a quarter of itself, and fails beyond. A statement about several conditions holds if it is true of
all of them, is partly true if of some, and fails if of none.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from tyre.arrays import Array
from tyre.tyre_map import TyreMap

Verdict = Literal["holds", "partly", "fails"]


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

    def row(self, load: float) -> int:
        """Index of a ``load``, N."""
        return int(np.flatnonzero(np.isclose(self.loads, load))[0])

    def column(self, pressure: float) -> int:
        """Index of a ``pressure``, bar."""
        return int(np.flatnonzero(np.isclose(self.pressures, pressure))[0])


@dataclass(frozen=True, eq=False)
class Tables:
    """Tables of Dell'Orto et al.: ``tyre1`` on flat track and drum, ``tyre2`` and ``tyre3`` on flat track."""

    tyre1: Grid
    tyre1_drum: Grid
    tyre2: Grid
    tyre3: Grid

    @property
    def all(self) -> dict[str, Grid]:
        """Every table by the name a reader knows."""
        names = ("Tyre1 flat", "Tyre1 drum", "Tyre2 flat", "Tyre3 flat")
        return dict(zip(names, (self.tyre1, self.tyre1_drum, self.tyre2, self.tyre3), strict=True))


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
    values: dict[str, float] = field(default_factory=dict)
    remark: str = ""


Test = Callable[[Tables], Outcome]


def judge_number(computed: float, claimed: float) -> Verdict:
    """Compare a number with a whole number ``claimed`` in the text by the rule of this module."""
    tolerance = 2.5 if claimed % 5 == 0 else 1.0
    if abs(computed - claimed) <= tolerance:
        return "holds"
    return "partly" if abs(computed - claimed) <= abs(claimed) / 4 else "fails"


def judge_all(true: ArrayLike) -> Verdict:
    """Judge that something is ``true`` everywhere: it fails if nowhere, else it is partly true."""
    conditions = np.asarray(true, dtype=bool)
    if conditions.all():
        return "holds"
    return "partly" if conditions.any() else "fails"


def counted(true: ArrayLike) -> str:
    """Count the conditions that are ``true``: ``8 of 9``."""
    return f"{int(np.sum(true))} of {np.size(true)}"


def holds(true: ArrayLike, computed: str, remark: str = "", **values: float) -> Outcome:
    """Judge that something is ``true`` everywhere, by its numbers as ``computed``."""
    return Outcome(computed, judge_all(true), values, remark)


def near(value: float, claimed: float, computed: str, remark: str = "", **values: float) -> Outcome:
    """Judge a ``value`` against the number ``claimed`` in the text."""
    return Outcome(computed, judge_number(value, claimed), values, remark)


def each(true: ArrayLike, what: str, remark: str = "", **values: float) -> Outcome:
    """Judge a statement about several conditions, and count them."""
    return holds(true, f"{counted(true)} {what}", remark, **values)


def percent_above(one: Array, other: Array) -> Array:
    """Excess of ``one`` over ``other``, %."""
    return np.asarray(100 * (one / other - 1))


def spread_over(values: Array, axis: int) -> Array:
    """Excess of the largest over the smallest value along an ``axis``, %."""
    return percent_above(values.max(axis=axis), values.min(axis=axis))


def signed(values: ArrayLike, digits: int = 1) -> str:
    """Print numbers with their sign, comma separated."""
    return ", ".join(f"{value:+.{digits}f}" for value in np.atleast_1d(np.asarray(values, dtype=np.float64)))


def plain(values: ArrayLike, digits: int = 1) -> str:
    """Print numbers, comma separated."""
    return ", ".join(f"{value:.{digits}f}" for value in np.atleast_1d(np.asarray(values, dtype=np.float64)))
