"""One set of data among several, and what its unknowns are called among theirs."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studies.inference.arrays import Array
from studies.inference.forward import Forward, ProposedMeasurement
from studies.inference.parameter import Candidate, UncertainParameter

OF = "/"  # between a part, or a thing, and what is its own


@dataclass(frozen=True)
class Part:
    """One set of data.

    Attributes
    ----------
    name : str
        As it is called in words and before its own candidates.
    forward : Forward
    own : frozenset of str
        Identifiers of candidates that are mistakes of this part alone: its sensors, its clock, its speed.
    thing : str
        What it was measured of, where that is another thing than the first: its nuisances and candidates are its own
        and called ``THING/NAME``. Parts of one thing share them.
    common : frozenset of str
        Of such a part: names of nuisances and identifiers of candidates that it shares with all others.
    """

    name: str
    forward: Forward
    own: frozenset[str] = frozenset()
    thing: str = ""
    common: frozenset[str] = frozenset()

    def called(self, name: str) -> str:
        """What a candidate or nuisance with this ``name`` here is called in the whole."""
        if name in self.own:
            return f"{self.name}{OF}{name}"
        return f"{self.thing}{OF}{name}" if self.thing and name not in self.common else name

    def here(self, whole: str) -> str | None:
        """What a candidate called so in the ``whole`` is called here; None where it is of another part or thing."""
        owner, _, name = whole.rpartition(OF)
        if owner:
            return name if owner in (self.name, self.thing) else None
        return None if self.thing and whole not in self.common else whole

    def candidate(self, c: Candidate) -> Candidate:
        """The candidate ``c`` of this part as one of the whole."""
        identifier = self.called(c.identifier)
        owner = identifier.rpartition(OF)[0]
        words = f"{c.signature} ({owner})" if owner and c.signature else c.signature
        return replace(
            c, identifier=identifier, signature=words, unknowns=tuple(self._unknown(u, owner) for u in c.unknowns)
        )

    def nuisance(self, u: UncertainParameter) -> UncertainParameter:
        """The nuisance ``u`` of this part as one of the whole."""
        name = self.called(u.name)
        return replace(self._unknown(u, name.rpartition(OF)[0]), name=name)

    def _unknown(self, u: UncertainParameter, owner: str) -> UncertainParameter:
        """Of another thing it sets numbers of that thing, never those of the first."""
        return (
            replace(u, sets={f"{owner}{OF}{key}": f for key, f in u.sets.items()})
            if owner and owner == self.thing
            else u
        )


@dataclass(frozen=True, eq=False)
class FromPart(ProposedMeasurement):
    """A ``proposal`` of the part with this ``number``."""

    number: int
    proposal: ProposedMeasurement


def widened(slopes: Array, places: NDArray[np.intp], width: int) -> Array:
    """The ``slopes`` (m, q) of a part at their ``places`` (q,) among all coordinates, as many as ``width`` says."""
    wide = np.zeros((len(slopes), width))
    wide[:, places] = slopes
    return wide
