"""Tyre properties over load and pressure from measured tables."""
