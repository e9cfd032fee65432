"""Draws of uncertain parameters."""
