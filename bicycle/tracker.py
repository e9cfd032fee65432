"""A model tracked and named once: answers at any speeds inside, whatever else is asked."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bicycle.linear_model import LinearModel
from bicycle.mode_events import ModeEvent, mode_events
from bicycle.mode_names import Naming, name_branches, window
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
        """Track from ``lowest`` to ``highest`` and through the window of speeds where names are given."""
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
        mixed = np.zeros((len(speeds), len(self._modes), len(self._modes)), bool)
        at_end = self._mixed_outward
        for (part, stretch), nodes in zip(self._parts(speeds), at_end, strict=True):
            right = np.clip(np.searchsorted(stretch.speeds, speeds[part]), 0, len(stretch.speeds) - 1)
            left = np.clip(np.searchsorted(stretch.speeds, speeds[part], side="right") - 1, 0, len(stretch.speeds) - 1)
            mixed[part] = nodes[np.where(speeds[part] >= self.naming.anchor, left, right)]
        mixed |= self._mixed(ordered)
        cases, index = np.unique(mixed.reshape(len(speeds), -1), axis=0, return_inverse=True)
        return index.reshape(-1), tuple(self._joint_names(case.reshape(mixed.shape[1:])) for case in cases)

    @cached_property
    def _modes(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(sorted(self.naming.names)))

    @cached_property
    def _mode_of(self) -> NDArray[np.intp]:
        return np.array([self._modes.index(name) for name in self.naming.names])

    def _parts(self, speeds: Array) -> list[tuple[NDArray[np.intp], Stretch]]:
        """Which speeds lie in which stretch; a switch speed belongs to the range below it."""
        uppers = np.array([piece.upper for piece in self.model.ranges])
        first = int(np.searchsorted(uppers, self.stretches[0].speeds[-1]))
        at = np.searchsorted(uppers, speeds) - first
        return [(np.flatnonzero(at == k), stretch) for k, stretch in enumerate(self.stretches)]

    def _mixed(self, ordered: Complex) -> NDArray[np.bool_]:
        """Which modes (m, modes, modes) share a pair."""
        count = len(self._modes)
        mixed = np.zeros((len(ordered), count, count), bool)
        k, i, j = np.nonzero((ordered[:, :, None] == ordered[:, None, :].conj()) & (ordered.imag != 0)[:, :, None])
        a, b = self._mode_of[i], self._mode_of[j]
        mixed[k[a != b], a[a != b], b[a != b]] = True
        return mixed

    @cached_property
    def _mixed_outward(self) -> list[NDArray[np.bool_]]:
        """The same at every node, with what was lost between it and the anchor."""
        speeds = np.concatenate([s.speeds for s in self.stretches])
        mixed = self._mixed(np.concatenate([s.values for s in self.stretches]))
        above = speeds >= self.naming.anchor
        mixed[above] = np.logical_or.accumulate(mixed[above])
        mixed[~above] = np.logical_or.accumulate(mixed[~above][::-1])[::-1]
        return np.split(mixed, np.cumsum([len(s.speeds) for s in self.stretches])[:-1])

    def _joint_names(self, mixed: NDArray[np.bool_]) -> tuple[str, ...]:
        joined = mixed | np.eye(len(mixed), dtype=bool)
        for _ in range(len(mixed)):
            joined = joined @ joined
        joint = ["+".join(np.array(self._modes)[row]) for row in joined]
        return tuple(joint[mode] for mode in self._mode_of)
