"""A model tracked and named once: answers at any speeds inside, whatever else is asked."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bicycle.linear_model import LinearModel
from bicycle.mode_events import ModeEvent, mode_events
from bicycle.mode_names import Naming, name_branches, window
from bicycle.mode_regions import mates
from bicycle.tracking import Array, Complex, Stretch, settle, track


@dataclass(frozen=True)
class Tracker:
    """A model tracked once over a range of speeds and named; answers for any speeds inside, whatever else is asked."""

    model: LinearModel
    stretches: tuple[Stretch, ...]
    naming: Naming
    events: tuple[ModeEvent, ...]

    @classmethod
    def over(cls, model: LinearModel, lowest: float, highest: float) -> "Tracker":
        """Track from ``lowest`` to ``highest`` and through the speeds at which names are given."""
        low, high = window(model)
        stretches, meetings = track(model, min(lowest, low), max(highest, high))
        naming = name_branches(model, stretches)
        return cls(model, stretches, naming, mode_events(model.states, stretches, meetings, naming))

    def ordered(self, speeds: Array) -> Complex:
        """Eigenvalues (m, n) at speeds (m,), one column a branch."""
        values = settle(self.model.eigenvalues(speeds))
        for part, stretch in self._parts(speeds):
            values[part] = np.take_along_axis(values[part], stretch.follow(speeds[part], values[part]), 1)
        return values

    def labels(self, speeds: Array, ordered: Complex) -> tuple[NDArray[np.intp], tuple[tuple[str, ...], ...]]:
        """Names of the branches at each speed: an index (m,) into a tuple of name tuples."""
        index = np.empty(len(speeds), np.intp)
        start = 0
        mate = mates(ordered)
        for part, stretch in self._parts(speeds):
            nodes = np.arange(start, start + len(stretch.speeds))
            right = nodes[np.clip(np.searchsorted(stretch.speeds, speeds[part]), 0, len(nodes) - 1)]
            left = nodes[np.clip(np.searchsorted(stretch.speeds, speeds[part], side="right") - 1, 0, len(nodes) - 1)]
            up = speeds[part] >= self.naming.anchor
            inner, outer = np.where(up, left, right), np.where(up, right, left)
            like_outer = (mate[part] == mates(self._values[outer])).all(1)
            index[part] = self.naming.cases[np.where(like_outer, outer, inner)]
            start += len(stretch.speeds)
        # next to a meeting neither node need have the pairs of this speed: a pair has one name
        key, inverse = np.unique(np.column_stack([index, mate]), axis=0, return_inverse=True)
        return inverse.reshape(-1), tuple(_joint(self.naming.labels[case[0]], case[1:]) for case in key)

    @property
    def _values(self) -> Complex:
        return np.concatenate([s.values for s in self.stretches])

    def _parts(self, speeds: Array) -> list[tuple[NDArray[np.intp], Stretch]]:
        """Which speeds lie in which stretch; a switch speed belongs to the range below it."""
        uppers = np.array([piece.upper for piece in self.model.ranges])
        first = int(np.searchsorted(uppers, self.stretches[0].speeds[-1]))
        at = np.searchsorted(uppers, speeds) - first
        return [(np.flatnonzero(at == k), stretch) for k, stretch in enumerate(self.stretches)]


def _joint(label: tuple[tuple[str, ...], ...], mate: NDArray[np.intp]) -> tuple[str, ...]:
    return tuple("+".join(sorted({*label[i], *label[int(j)]})) for i, j in enumerate(mate))
