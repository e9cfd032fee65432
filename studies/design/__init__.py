"""The smallest change of a model that keeps named modes stable over a range of speed."""

from studies.design.design import Certainty, Design, Wanted, designed, with_effects
from studies.design.problem import (
    BY_SD,
    RELATIVE,
    Demand,
    Problem,
    base_of,
    cost_of,
    demands,
    expanded,
    grid,
    limits_of,
    solved,
)
from studies.design.report import HEADERS, lines, model_text, record, remarks, rows

__all__ = [
    "BY_SD", "HEADERS", "RELATIVE", "Certainty", "Demand", "Design", "Problem", "Wanted", "base_of",
    "cost_of", "demands", "designed", "expanded", "grid", "limits_of", "lines", "model_text", "record", "remarks",
    "rows", "solved", "with_effects",
]  # fmt: skip
