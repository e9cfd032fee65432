"""Eigenvalues followed along speed and named: weave, wobble, capsize."""
