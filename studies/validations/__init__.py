"""Studies over half a minute that check velotyre against known truth, one module each: ``velotyre validate NAME``.

A module has a docstring, which is its help, and a function ``run(*, out, seed, ...)`` that returns a JSON-able dict;
further keyword parameters with a default (int, float, bool or str) become options of the command.
"""
