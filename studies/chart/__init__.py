"""Stability charts: where a root lies on the imaginary axis, as exact curves over two numbers of a model."""

from tyre.ground.door import room

FILES = {
    "chart": ("NamedBoundary", "StabilityChart", "Uncertain", "along_axes", "contour_values",
              "describe_check", "headers", "record", "rows", "spread", "stability_chart", "title"),
    "curve": ("CLOSED", "DOUBLE_ZERO", "EDGE", "Boundary"), "figure": ("draw_chart",),
    "plane": ("Look", "Plane", "marks", "split_range", "usual_range"),
    "search": ("all_boundaries", "complete_boundaries"),
}  # fmt: skip
__getattr__, __dir__ = room(__name__, FILES)
