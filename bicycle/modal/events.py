"""What happens to the modes on the way: meetings of roots, exchange of character, jumps at a switch speed."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bicycle.linear_model import LinearModel
from bicycle.modal.naming import Naming, every_mode, state_shares
from bicycle.modal.tracking import Meeting, TrackedRange
from tyre.base.arrays import Array, Complex

SAME_ROOT = 1e-6  # of the largest root: a smaller jump at a switch speed is none
CLEARLY = 1.2  # how much better the other's role must be played to speak of an exchange


@dataclass(frozen=True)
class ModeEvent:
    """Something happens to named modes at a speed (m/s).

    ``kind``: ``merge`` (two real roots become a pair as the speed grows), ``split`` (a pair becomes two real roots),
    ``exchange`` (two pairs take over each other's character) or ``switch`` (the equations change and roots jump).
    ``eigenvalue`` is the double root of a meeting (1/s), NaN otherwise; ``modes`` are those of its real roots, ``pair``
    is what the pair is called (several names where its identity is lost).
    """

    speed: float
    kind: str
    modes: tuple[str, ...]
    eigenvalue: float = float("nan")
    pair: tuple[str, ...] = ()

    def __str__(self) -> str:
        said = {
            "merge": "two real roots of {modes} meet at {root:.4g} 1/s and become the pair {pair}",
            "split": "the pair {pair} splits at {root:.4g} 1/s into two real roots of {modes}",
            "exchange": "{modes} exchange character",
            "switch": "the equations switch and the roots of {modes} jump",
        }[self.kind]
        found = said.format(modes=" and ".join(self.modes), root=self.eigenvalue, pair="+".join(self.pair))
        return f"{self.speed:.3f} m/s: {found}"


def mode_events(
    model: LinearModel, tracked: Sequence[TrackedRange], meetings: Sequence[Meeting], naming: Naming
) -> tuple[ModeEvent, ...]:
    """All events of tracked branches, by speed.

    Parameters
    ----------
    model : LinearModel
    tracked : sequence of TrackedRange
        One for each speed range that was tracked.
    meetings : sequence of Meeting
        Where two real roots meet.
    naming : Naming
        Of all nodes of the ranges.
    """
    speeds = np.concatenate([s.speeds for s in tracked])
    events = [
        ModeEvent(m.speed, m.kind, real, m.eigenvalue, pair)
        for m in meetings
        for real, pair in [_met(m, speeds, naming)]
    ]
    start = 0
    for below, above in pairwise(tracked):
        start += len(below.speeds)
        jump = np.abs(above.values[0] - below.values[-1]) > SAME_ROOT * np.abs(below.values[-1]).max()
        if jump.any():
            label = naming.labels[naming.cases[start - 1]]
            jumped = sorted({name for i in np.flatnonzero(jump) for name in label[i]})
            events.append(ModeEvent(float(above.speeds[0]), "switch", tuple(jumped)))
    return tuple(sorted(events + _exchanges(model, tracked, naming), key=lambda e: (e.speed, e.kind, e.modes)))


def _met(meeting: Meeting, speeds: Array, naming: Naming) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of two real roots next to where they meet, and of their pair."""
    left = int(np.searchsorted(speeds, meeting.speed, side="right")) - 1
    sides = (naming.labels[naming.cases[k]] for k in (left, min(left + 1, len(speeds) - 1)))
    below, above = (tuple(sorted({name for i in meeting.branches for name in label[i]})) for label in sides)
    return (below, above) if meeting.kind == "merge" else (above, below)


def _exchanges(model: LinearModel, tracked: Sequence[TrackedRange], naming: Naming) -> list[ModeEvent]:
    """Where two pairs begin to play each other's role better than their own, or their own again."""
    speeds = np.concatenate([s.speeds for s in tracked])
    values = np.concatenate([s.values for s in tracked])
    share = state_shares(model.declared.states, np.concatenate([s.participation for s in tracked]))
    mark = {mode.name: mode.marks[0] for mode in every_mode(model)}
    at = {name: _branch_of(name, values, naming) for name in mark}
    names = [name for name, branch in at.items() if (branch >= 0).any()]
    rows = np.arange(len(speeds))
    found = []
    for number, a in enumerate(names):
        for b in names[:number]:
            i, j = at[a], at[b]
            mine, yours = share[mark[a]], share[mark[b]]
            own = (mine[rows, i] > CLEARLY * mine[rows, j]) & (yours[rows, j] > CLEARLY * yours[rows, i])
            swapped = (mine[rows, j] > CLEARLY * mine[rows, i]) & (yours[rows, i] > CLEARLY * yours[rows, j])
            clear = np.flatnonzero((own | swapped) & (i >= 0) & (j >= 0))
            changed = np.flatnonzero(np.diff(swapped[clear].astype(int)))
            found += [ModeEvent(float(speeds[clear[k + 1]]), "exchange", tuple(sorted((a, b)))) for k in changed]
    return found


def _branch_of(name: str, values: Complex, naming: Naming) -> NDArray[np.intp]:
    """At each node the branch that is the upper half of the pair ``name``, -1 where there is none."""
    own = np.array([[label == (name,) for label in case] for case in naming.labels])[naming.cases] & (values.imag > 0)
    return np.asarray(np.where(own.any(1), own.argmax(1), -1))
