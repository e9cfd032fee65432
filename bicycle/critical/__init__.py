"""Speeds at which a root crosses the imaginary axis, all of them."""
