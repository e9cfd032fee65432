"""Which root of the model a measured mode is compared with: the nearest, whatever it is called."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from bicycle.model import Model
from bicycle.named_modes import modes
from tyre.arrays import Array, Complex

if TYPE_CHECKING:
    from studies.diagnosis.modal import ModalPoint


def misnamed(points: Sequence["ModalPoint"], model: Model) -> list[str]:
    """Notes on names of modes that the base model contradicts: all rows lie on another mode, five times nearer."""
    notes = []
    for name in dict.fromkeys(point.mode for point in points):
        rows = sorted((p for p in points if p.mode == name and not p.settings), key=lambda p: p.speed)
        speeds = sorted({p.speed for p in rows})
        if len(speeds) < 2:
            continue
        found = modes(model.linear_model(), speeds)
        roots = np.array([p.eigenvalue for p in rows])
        at = np.searchsorted(speeds, [p.speed for p in rows])
        away = {other: np.nan_to_num(abs(found.branch(other)[at, 0] - roots), nan=np.inf) for other in found.names}
        named = away.pop(name, np.full(len(rows), np.inf))
        clear = [other for other, distance in away.items() if (5 * distance < named).all()]
        if clear:
            lies = f"{named.min():.3g} 1/s or more" if np.isfinite(named).all() else "not there"
            notes.append(
                f"every row called {name} lies on the {clear[0]} of the base model (up to {away[clear[0]].max():.3g} "
                f"1/s away; its {name}: {lies}) and is compared with that root; if the name is wrong, correct it"
            )
    return notes


@dataclass(frozen=True)
class Wanted:
    """Modes (m,) to be predicted: their recorded speeds, names, and eigenvalues ``near`` which they lie."""

    speed: Array
    mode: tuple[str, ...]
    near: Complex

    @cached_property
    def crowded(self) -> list[list[NDArray[np.intp]]]:
        """Points of each mode at the speeds at which several modes are wanted."""
        names, found = np.array(self.mode), []
        for speed in np.unique(self.speed):
            here = self.speed == speed
            found.append([np.flatnonzero(here & (names == name)) for name in np.unique(names[here])])
        return [together for together in found if len(together) > 1]


def root_of(wanted: Wanted, speeds: Array, values: Complex) -> NDArray[np.intp]:
    """Index (m,) of each wanted mode among the eigenvalues ``values`` (S, n) at sorted ``speeds`` (S,)."""
    at = np.searchsorted(speeds, wanted.speed)
    near, here = wanted.near[:, None], values[at]
    cost = np.abs(here - near)
    oscillates = np.abs(here.imag) > 1e-9 * np.abs(here).max(1, keepdims=True)
    cost[oscillates != (np.abs(near.imag) > 1e-6 * np.abs(near))] *= 3.0
    cost[here.imag < 0] = 1e6
    found = cost.argmin(1)
    for together in wanted.crowded:  # no two modes at one speed have the same root
        total = np.nan_to_num([cost[points].sum(0) for points in together], nan=1e9, posinf=1e9)
        for points, root in zip(together, scipy.optimize.linear_sum_assignment(total)[1], strict=True):
            found[points] = root
    return np.asarray(found)
