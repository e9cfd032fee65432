"""A model tracked and named once: answers at any speeds inside, whatever else is asked."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.decomposition import decompose, doubtful
from bicycle.linear_model import LinearModel
from bicycle.modal.doubts import SURE
from bicycle.modal.events import ModeEvent, mode_events
from bicycle.modal.identity import conjugate_index
from bicycle.modal.naming import Naming, Rules, name_branches, speed_unit
from bicycle.modal.tracking import Meeting, TrackedRange, track
from tyre.base.arrays import Array, Complex


@dataclass(frozen=True)
class Tracker:
    """A model tracked once over a range of speeds and named; answers for any speeds inside, whatever else is asked."""

    model: LinearModel
    tracked: tuple[TrackedRange, ...]
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
        low, high = Rules.of(model).window(speed_unit(model))
        tracked, meetings = track(model, min(lowest, low), max(highest, high), sparse=sparse)
        return cls(model, tracked, meetings, name_branches(model, tracked))

    @cached_property
    def events(self) -> tuple[ModeEvent, ...]:
        """What happens to the modes on the way, by speed."""
        return mode_events(self.model, self.tracked, self.meetings, self.naming)

    def ordered(self, speeds: Array) -> Complex:
        """Eigenvalues (m, n), 1/s, at ``speeds`` (m,), m/s; one column a branch."""
        values = self.model.eigenvalues(speeds)
        for number, places in self.model.by_range(speeds):
            again = places[doubtful(values[places])]
            if again.size:
                values[again] = decompose(self.model.coefficients[number], speeds[again]).values
            order = self._in_range(number).follow(speeds[places], values[places])
            values[places] = np.take_along_axis(values[places], order, 1)
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
        mate = conjugate_index(ordered)
        for number, places in self.model.by_range(speeds):
            nodes, start, v = self._in_range(number).speeds, self._start(number), speeds[places]
            right = start + np.clip(np.searchsorted(nodes, v), 0, len(nodes) - 1)
            left = start + np.clip(np.searchsorted(nodes, v, side="right") - 1, 0, len(nodes) - 1)
            up = v >= self.naming.anchor
            inner, outer = np.where(up, left, right), np.where(up, right, left)
            like_outer = (mate[places] == conjugate_index(self._values[outer])).all(1)
            index[places] = self.naming.cases[np.where(like_outer, outer, inner)]
        # next to a meeting neither node need have the pairs of this speed: a pair has one name
        key, inverse = np.unique(np.column_stack([index, mate]), axis=0, return_inverse=True)
        return inverse.reshape(-1), tuple(_joint(self.naming.labels[case[0]], case[1:]) for case in key)

    def sure(self, speeds: Array) -> bool:
        """Whether more nodes would not change any name at ``speeds`` (m,), m/s: nothing happens in the steps around."""
        for number, places in self.model.by_range(speeds):
            own, start = self._in_range(number), self._start(number)
            right = np.clip(np.searchsorted(own.speeds, speeds[places]), 1, len(own.speeds) - 1)
            cases, chance = (x[start : start + len(own.speeds)] for x in (self.naming.cases, self.naming.chance))
            same = (cases[right] == cases[right - 1]) & ~chance[right]
            if not (own.smooth[right - 1] & same).all():
                return False
        return self.naming.doubt == SURE

    @cached_property
    def _values(self) -> Complex:
        return np.concatenate([own.values for own in self.tracked])

    @cached_property
    def _first(self) -> int:
        """Number of the first speed range that is tracked."""
        ((number, _),) = self.model.by_range(self.tracked[0].speeds[-1])
        return number

    def _start(self, number: int) -> int:
        """Number of the first node of a speed range among all nodes."""
        return sum(len(own.speeds) for own in self.tracked[: number - self._first])

    def _in_range(self, number: int) -> TrackedRange:
        return self.tracked[number - self._first]

    def within(self, number: int) -> TrackedRange | None:
        """The roots tracked in the speed range with index ``number`` of the model, None where none are."""
        at = number - self._first
        return self.tracked[at] if 0 <= at < len(self.tracked) else None


def _joint(label: tuple[tuple[str, ...], ...], mate: NDArray[np.intp]) -> tuple[str, ...]:
    return tuple("+".join(sorted({*label[i], *label[int(j)]})) for i, j in enumerate(mate))
