"""What an audited claim of a paper is: a statement, the number in the text, and a function of the tables that tests it.

The verdicts follow one rule. A number holds within one unit of its last digit (2.5 for a multiple of five, which is how
a rounded number is written), is partly true within a quarter of itself, and fails beyond. A statement about several
conditions holds if it is true of all of them, is partly true if of some, and fails if of none.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from tyre.base.arrays import Array
from tyre.maps.tyre_map import TyreMap

Verdict = Literal["holds", "partly", "fails"]


@dataclass(frozen=True, eq=False)
class Grid:
    """One tyre on one surface: arrays of shape (loads, pressures), both ascending, in the units of the tables."""

    loads: Array
    pressures: Array
    cornering_stiffness: Array
    relaxation_length: Array

    @property
    def lateral_stiffness(self) -> Array:
        """Cornering stiffness in N/rad over relaxation length in mm, N/mm."""
        return np.asarray(np.degrees(self.cornering_stiffness) / self.relaxation_length)

    def row(self, load: float) -> int:
        """Index of a ``load``, N."""
        return int(np.flatnonzero(np.isclose(self.loads, load))[0])

    def column(self, pressure: float) -> int:
        """Index of a ``pressure``, bar."""
        return int(np.flatnonzero(np.isclose(self.pressures, pressure))[0])


@dataclass(frozen=True, eq=False)
class PaperTables:
    """The tables of Dell'Orto et al.: ``tyre1`` on flat track and drum, ``tyre2`` and ``tyre3`` on flat track."""

    tyre1: Grid
    tyre1_drum: Grid
    tyre2: Grid
    tyre3: Grid

    @property
    def all(self) -> dict[str, Grid]:
        """Every table by the name a reader knows."""
        return {
            "Tyre1 flat": self.tyre1,
            "Tyre1 drum": self.tyre1_drum,
            "Tyre2 flat": self.tyre2,
            "Tyre3 flat": self.tyre3,
        }


def load_paper_tables() -> PaperTables:
    """Read the tables from the packaged data."""
    return PaperTables(_grid("Tyre1", "flat"), _grid("Tyre1", "drum"), _grid("Tyre2", "flat"), _grid("Tyre3", "flat"))


def _grid(tyre: str, surface: str) -> Grid:
    table = TyreMap.load(tyre, surface=surface).table
    cornering = table.pivot(index="load_N", columns="pressure_bar", values="cornering_stiffness_N_per_deg")
    length = table.pivot(index="load_N", columns="pressure_bar", values="relaxation_length_mm")
    return Grid(
        loads=cornering.index.to_numpy(dtype=np.float64),
        pressures=cornering.columns.to_numpy(dtype=np.float64),
        cornering_stiffness=cornering.to_numpy(dtype=np.float64),
        relaxation_length=length.to_numpy(dtype=np.float64),
    )


@dataclass(frozen=True)
class Outcome:
    """What the tables say to a claim: in words, the verdict, and the numbers behind it."""

    computed: str
    verdict: Verdict
    values: dict[str, float] = field(default_factory=dict)
    remark: str = ""


Test = Callable[[PaperTables], Outcome]


@dataclass(frozen=True)
class Claim:
    """A claim of the paper: its section, what it says (paraphrased), the number it gives, and its test."""

    name: str
    section: str
    statement: str
    text: str
    test: Test


def claim(*, section: str, statement: str, text: str) -> Callable[[Test], Claim]:
    """Turn a function of the tables into a `Claim` that carries the function's name.

    Parameters
    ----------
    section : str
        Of the paper.
    statement : str
        What the paper says, in our words.
    text : str
        The number as the paper prints it.
    """

    def make(test: Test) -> Claim:
        return Claim(test.__name__.replace("_", " "), section, statement, text, test)

    return make


def judge_number(computed: float, claimed: float) -> Verdict:
    """Compare a number ``computed`` with a whole number ``claimed`` in the text by the rule of this module."""
    tolerance = 2.5 if claimed % 5 == 0 else 1.0
    if abs(computed - claimed) <= tolerance:
        return "holds"
    return "partly" if abs(computed - claimed) <= abs(claimed) / 4 else "fails"


def judge_all(true: ArrayLike) -> Verdict:
    """Holds if ``true`` (any shape) everywhere, fails if nowhere, else partly."""
    conditions = np.asarray(true, dtype=bool)
    if conditions.all():
        return "holds"
    return "partly" if conditions.any() else "fails"


def counted(true: ArrayLike) -> str:
    """``8 of 9``: the number of conditions that are ``true``."""
    conditions = np.asarray(true, dtype=bool)
    return f"{int(conditions.sum())} of {conditions.size}"


def percent_above(one: Array, other: Array) -> Array:
    """How much larger ``one`` is than ``other``, %."""
    return np.asarray(100 * (one / other - 1))


def signed(values: ArrayLike, digits: int = 1) -> str:
    """Numbers ``values`` with their sign, comma separated, to a number ``digits`` of decimals."""
    return ", ".join(f"{value:+.{digits}f}" for value in np.atleast_1d(np.asarray(values, dtype=np.float64)))


def plain(values: ArrayLike, digits: int = 1) -> str:
    """Numbers ``values``, comma separated, to a number ``digits`` of decimals."""
    return ", ".join(f"{value:.{digits}f}" for value in np.atleast_1d(np.asarray(values, dtype=np.float64)))
