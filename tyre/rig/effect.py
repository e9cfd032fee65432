"""A rig effect: what the simulated rig adds to, or takes from, the tyre it measures, and how a fit sees it.

One effect a file of :mod:`tyre.rig.effects`, found and not listed; one of another package is made known by
:func:`register`. An effect changes the tyre as it runs on the rig (``on_tyre``), the channels of a rolling recording
(``on_rolling``) or those of a pull test (``on_pull``); a campaign declares a tuple of them and they act in its order.
Its ``terms`` are what a diagnosis of recordings may miss: written anew from the same physics, so that a simulated
effect is a test of its term.
"""

import importlib
import pkgutil
import re
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError, is_number, shown
from tyre.recordings.recording import Condition
from tyre.rig.regression import RigParameter, Term
from tyre.rig.tyre import RigTyre

Channels = dict[str, Array]
HOOKS = ("on_tyre", "on_rolling", "on_pull")
OUTSIDE: dict[str, type["RigEffect"]] = {}
"""Effects of other packages by identifier; see :func:`register`."""


def declared(parameter: RigParameter, default: float) -> Any:
    """A field of an effect: the ``parameter`` with the ``default`` (in its unit) of a fair laboratory."""
    return field(default=default, metadata={"parameter": parameter})


@dataclass(frozen=True)
class RigEffect:
    """Base of all rig effects: does nothing.

    Raises
    ------
    InputError
        A parameter outside its bounds.
    """

    terms: ClassVar[tuple[Term, ...]] = ()

    def __post_init__(self) -> None:
        for p, name in ((f.metadata["parameter"], f.name) for f in fields(self) if "parameter" in f.metadata):
            value, (low, high) = getattr(self, name), p.bounds
            if not is_number(value) or not low <= value <= high:
                raise InputError(
                    f"effect {self.identifier()}: {name} = {shown(value)} must be a number from {low:g} to {high:g} "
                    f"({p.unit})"
                )

    @classmethod
    def identifier(cls) -> str:
        """``load_cell_drift`` of ``LoadCellDrift``."""
        return re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()

    @classmethod
    def simulated(cls) -> bool:
        """Whether the simulator knows it."""
        return any(getattr(cls, hook) is not getattr(RigEffect, hook) for hook in HOOKS)

    def on_tyre(self, tyre: RigTyre, condition: Condition, rng: np.random.Generator) -> RigTyre:
        """Return the ``tyre`` as it behaves on the rig in this recording at a ``condition``; ``rng`` for scatter."""
        return tyre

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        """Change the ``channels`` (n,) of a slip sweep or step in place (SI, adapted SAE); ``rng`` for noise."""

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        """Change the ``channels`` (n,) of a pull test in place (SI, adapted SAE); ``rng`` for noise."""


def register(effect: type[RigEffect]) -> type[RigEffect]:
    """Make an ``effect`` of another package known; a decorator.

    Raises
    ------
    InputError
        Its identifier, or that of one of its terms, is taken.
    """
    others = [other for other in rig_effects().values() if other is not effect]
    taken = {other.identifier() for other in others} | {term.identifier for other in others for term in other.terms}
    for name in (effect.identifier(), *(term.identifier for term in effect.terms)):
        if name in taken:
            raise InputError(f"a rig effect or term {name!r} exists already; give {effect.__name__} another name")
    OUTSIDE[effect.identifier()] = effect
    return effect


def rig_effects() -> dict[str, type[RigEffect]]:
    """Every rig effect by its identifier, sorted."""
    package = importlib.import_module("tyre.rig.effects")
    known = dict(OUTSIDE)
    for info in pkgutil.iter_modules(package.__path__):
        module = importlib.import_module(f"{package.__name__}.{info.name}")
        own = (thing for thing in vars(module).values() if isinstance(thing, type) and issubclass(thing, RigEffect))
        known |= {effect.identifier(): effect for effect in own if effect.__module__ == module.__name__}
    return dict(sorted(known.items()))


def simulated_effects() -> dict[str, type[RigEffect]]:
    """Those that the simulator knows."""
    return {name: effect for name, effect in rig_effects().items() if effect.simulated()}


def rig_terms() -> tuple[Term, ...]:
    """What a diagnosis of recordings may miss."""
    return tuple(term for effect in rig_effects().values() for term in effect.terms)
