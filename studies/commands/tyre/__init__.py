"""``velotyre tyre ...``: from rig recordings and measured tables to tyre properties."""
