"""Figures of the result of a sweep and the numbers in them: what it holds decides which."""
