"""Fit tyre properties, or simulate rig recordings."""

EXAMPLE = ("velotyre tyre simulate campaign --seed 1", "velotyre tyre fit campaign --out fit")
