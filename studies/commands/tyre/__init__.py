"""From rig recordings and measured tables to tyre properties."""

EXAMPLE = ("velotyre tyre simulate campaign --seed 1", "velotyre tyre fit campaign --out fit")
