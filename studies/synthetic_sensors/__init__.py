"""Sensors of a simulated ride: what a logger would have written of a motion that was computed."""
