"""Measured frequency responses: the table, its forward model, its sensors, its figure."""
