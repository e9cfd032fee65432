"""Derivatives of eigenvalues and critical speeds, and the uncertainty that follows."""
