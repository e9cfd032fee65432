"""Conversions between SI units inside and the units of the field at the edges."""

PASCAL_PER_BAR = 1e5
