"""Blind test, second edition: the motion of a chain of bodies, from other equations than those of the fitter."""
