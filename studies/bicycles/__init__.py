"""Bicycles from a few numbers, and what a rider adds."""
