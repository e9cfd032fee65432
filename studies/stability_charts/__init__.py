"""Stability charts: where a root lies on the imaginary axis, as exact curves over two numbers of a model."""
