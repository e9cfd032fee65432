"""Eigenvalues of many small matrices."""
