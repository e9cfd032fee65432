"""Bicycles, models and effects as text; results as labelled arrays."""
