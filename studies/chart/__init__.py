"""Stability charts: where a root lies on the imaginary axis, as exact curves over two numbers of a model."""

from studies.chart.chart import (
    NamedBoundary,
    StabilityChart,
    Uncertain,
    along_axes,
    checked,
    contour_values,
    headers,
    record,
    rows,
    spread,
    stability_chart,
    title,
)
from studies.chart.curve import CLOSED, DOUBLE_ZERO, EDGE, Boundary
from studies.chart.figure import draw_chart
from studies.chart.plane import Look, Plane, marks, split_range, usual_range
from studies.chart.search import all_boundaries, completed

__all__ = [
    "CLOSED", "DOUBLE_ZERO", "EDGE", "Boundary", "Look", "NamedBoundary", "Plane",
    "StabilityChart", "Uncertain", "all_boundaries", "along_axes", "checked", "completed", "contour_values",
    "draw_chart", "headers", "marks", "record", "rows", "split_range", "spread", "stability_chart", "title",
    "usual_range",
]  # fmt: skip
