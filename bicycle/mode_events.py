"""What happens to the modes on the way: meetings of roots, exchange of character, jumps at a switch speed."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bicycle.mode_names import MARK, Naming, state_shares
from bicycle.tracking import Meeting, Stretch

SAME_ROOT = 1e-6  # of the largest root: a smaller jump at a switch speed is none
CLEARLY = 1.2  # how much better the other's role must be played to speak of an exchange


@dataclass(frozen=True)
class ModeEvent:
    """Something happens to named modes at a speed (m/s).

    ``kind``: ``merge`` (two real roots become a pair as the speed grows), ``split`` (a pair becomes two real roots),
    ``exchange`` (two pairs take over each other's character) or ``switch`` (the equations change and roots jump).
    ``eigenvalue`` is the double root of a meeting (1/s), NaN otherwise.
    """

    speed: float
    kind: str
    modes: tuple[str, ...]
    eigenvalue: float = float("nan")

    def __str__(self) -> str:
        said = {
            "merge": "two real roots of {} become a pair",
            "split": "the pair of {} becomes two real roots",
            "exchange": "{} exchange character",
            "switch": "the equations switch and the roots of {} jump",
        }[self.kind]
        return f"{self.speed:.3f} m/s: {said.format(' and '.join(self.modes))}"


def mode_events(
    states: tuple[str, ...], stretches: Sequence[Stretch], meetings: Sequence[Meeting], naming: Naming
) -> tuple[ModeEvent, ...]:
    """All events of tracked branches, by speed."""
    events = [
        ModeEvent(m.speed, m.kind, tuple(dict.fromkeys(sorted(naming.names[i] for i in m.branches))), m.eigenvalue)
        for m in meetings
    ]
    for below, above in pairwise(stretches):
        jump = np.abs(above.values[0] - below.values[-1]) > SAME_ROOT * np.abs(below.values[-1]).max()
        if jump.any():
            jumped = sorted({naming.names[i] for i in np.flatnonzero(jump)})
            events.append(ModeEvent(float(above.speeds[0]), "switch", tuple(jumped)))
    return tuple(sorted(events + _exchanges(states, stretches, naming), key=lambda e: (e.speed, e.kind, e.modes)))


def _exchanges(states: tuple[str, ...], stretches: Sequence[Stretch], naming: Naming) -> list[ModeEvent]:
    """Pairs that, going away from the anchor, play each other's role better than their own."""
    speeds = np.concatenate([s.speeds for s in stretches])
    values = np.concatenate([s.values for s in stretches])
    share = state_shares(states, np.concatenate([s.participation for s in stretches]))
    start = int(np.abs(speeds - naming.anchor).argmin())
    pairs = [i for i in np.flatnonzero(values[start].imag > 0) if naming.names[i] in MARK]
    found = []
    for number, i in enumerate(pairs):
        for j in pairs[:number]:
            mine, yours = share[MARK[naming.names[i]]], share[MARK[naming.names[j]]]
            swapped = (mine[:, j] > CLEARLY * mine[:, i]) & (yours[:, i] > CLEARLY * yours[:, j])
            swapped &= (values[:, i].imag != 0) & (values[:, j].imag != 0)
            names = tuple(sorted((naming.names[i], naming.names[j])))
            for away in (_changes(swapped[start:]) + start, start - _changes(swapped[start::-1])):
                found += [ModeEvent(float(speeds[k]), "exchange", names) for k in away]
    return found


def _changes(flags: NDArray[np.bool_]) -> NDArray[np.intp]:
    return np.asarray(np.flatnonzero(flags[1:] & ~flags[:-1]) + 1)
