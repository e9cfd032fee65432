"""Measurements of a standing bicycle: weights, gauges and taps on its front frame."""

from tyre.ground.door import room

HOME = {"front_file": ("report_front_file",), "plan": ("plan",)}
"""Module -> the names that it gives to other rooms; each is imported when it is first used."""

__getattr__, __dir__ = room(__name__, HOME)
