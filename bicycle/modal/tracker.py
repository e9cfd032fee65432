"""A model tracked and named once: answers at any speeds inside, whatever else is asked."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bicycle.linear_model import LinearModel
from bicycle.modal.events import ModeEvent, mode_events
from bicycle.modal.identity import conjugate_index
from bicycle.modal.matching import doubtful, eigen
from bicycle.modal.naming import Naming, name_branches, window
from bicycle.modal.tracking import Meeting, TrackedRange, track
from tyre.base.arrays import Array, Complex


@dataclass(frozen=True)
class Tracker:
    """A model tracked once over a range of speeds and named; answers for any speeds inside, whatever else is asked."""

    model: LinearModel
    stretches: tuple[TrackedRange, ...]
    meetings: tuple[Meeting, ...]
    naming: Naming

    @classmethod
    def over(cls, model: LinearModel, lowest: float, highest: float, *, sparse: bool = False) -> "Tracker":
        """Track between two speeds and through the speeds at which names are given.

        Parameters
        ----------
        model : LinearModel
        lowest, highest : float
            m/s.
        sparse : bool
            Save nodes: names are the same where they are :meth:`sure`, events are given coarsely.
        """
        low, high = window(model)
        stretches, meetings = track(model, min(lowest, low), max(highest, high), sparse=sparse)
        return cls(model, stretches, meetings, name_branches(model, stretches))

    @cached_property
    def events(self) -> tuple[ModeEvent, ...]:
        """What happens to the modes on the way, by speed."""
        return mode_events(self.model.states, self.stretches, self.meetings, self.naming)

    def ordered(self, speeds: Array) -> Complex:
        """Eigenvalues (m, n), 1/s, at ``speeds`` (m,), m/s; one column a branch."""
        values = self.model.eigenvalues(speeds)
        for number, (part, stretch) in enumerate(self._parts(speeds), self._first):
            again = part[doubtful(values[part])]
            if again.size:
                values[again] = eigen(self.model.coefficients[number], speeds[again])[0]
            values[part] = np.take_along_axis(values[part], stretch.follow(speeds[part], values[part]), 1)
        return values

    def labels(self, speeds: Array, ordered: Complex) -> tuple[NDArray[np.intp], tuple[tuple[str, ...], ...]]:
        """Names of the branches at each speed: an index (m,) into a tuple of name tuples.

        Parameters
        ----------
        speeds : ndarray, shape (m,)
            m/s.
        ordered : complex ndarray, shape (m, n)
            Their eigenvalues (1/s) as :meth:`ordered` gives them.
        """
        index = np.empty(len(speeds), np.intp)
        start = 0
        mate = conjugate_index(ordered)
        for part, stretch in self._parts(speeds):
            nodes = np.arange(start, start + len(stretch.speeds))
            right = nodes[np.clip(np.searchsorted(stretch.speeds, speeds[part]), 0, len(nodes) - 1)]
            left = nodes[np.clip(np.searchsorted(stretch.speeds, speeds[part], side="right") - 1, 0, len(nodes) - 1)]
            up = speeds[part] >= self.naming.anchor
            inner, outer = np.where(up, left, right), np.where(up, right, left)
            like_outer = (mate[part] == conjugate_index(self._values[outer])).all(1)
            index[part] = self.naming.cases[np.where(like_outer, outer, inner)]
            start += len(stretch.speeds)
        # next to a meeting neither node need have the pairs of this speed: a pair has one name
        key, inverse = np.unique(np.column_stack([index, mate]), axis=0, return_inverse=True)
        return inverse.reshape(-1), tuple(_joint(self.naming.labels[case[0]], case[1:]) for case in key)

    def sure(self, speeds: Array) -> bool:
        """Whether more nodes would not change any name at ``speeds`` (m,), m/s: nothing happens in the steps around."""
        start = 0
        for part, stretch in self._parts(speeds):
            right = np.clip(np.searchsorted(stretch.speeds, speeds[part]), 1, len(stretch.speeds) - 1)
            cases = self.naming.cases[start : start + len(stretch.speeds)]
            if part.size and not (stretch.smooth[right - 1] & (cases[right] == cases[right - 1])).all():
                return False
            start += len(stretch.speeds)
        return self.naming.clear

    @cached_property
    def _values(self) -> Complex:
        return np.concatenate([s.values for s in self.stretches])

    @cached_property
    def _first(self) -> int:
        """Number of the first speed range that is tracked."""
        return int(np.searchsorted([piece.upper for piece in self.model.ranges], self.stretches[0].speeds[-1]))

    def within(self, number: int) -> TrackedRange | None:
        """The stretch in the speed range with index ``number`` of the model, None where it is not tracked."""
        at = number - self._first
        return self.stretches[at] if 0 <= at < len(self.stretches) else None

    def _parts(self, speeds: Array) -> list[tuple[NDArray[np.intp], TrackedRange]]:
        """Which speeds lie in which stretch; a switch speed belongs to the range below it."""
        at = np.searchsorted([piece.upper for piece in self.model.ranges], speeds) - self._first
        return [(np.flatnonzero(at == k), stretch) for k, stretch in enumerate(self.stretches)]


def _joint(label: tuple[tuple[str, ...], ...], mate: NDArray[np.intp]) -> tuple[str, ...]:
    return tuple("+".join(sorted({*label[i], *label[int(j)]})) for i, j in enumerate(mate))
