"""Which root of the model a measured mode is compared with: the nearest, whatever it is called."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from bicycle.model.model import Model
from bicycle.model.model_family import ModelFamily
from bicycle.stability.named_modes import modes
from tyre.ground.arrays import Array, Complex

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
class OtherRoot:
    """Rows of one mode that a model is compared with at a root of another name."""

    mode: str
    rows: int  # of those below
    of: int  # rows of this mode
    slowest: float  # m/s, of the rows
    fastest: float  # m/s, of the rows
    lies_on: tuple[str, ...]  # what the model calls these roots
    # how much larger chi^2 of the eigenvalues is with the roots of the name; None if the model has no such root there
    more_chi2: float | None

    def __str__(self) -> str:
        ends = dict.fromkeys((f"{self.slowest:.3g}", f"{self.fastest:.3g}"))
        return f"{self.rows} of {self.of} rows called {self.mode} (at {' to '.join(ends)} m/s)"


SAME = 1e-6  # of a root, within which two are one


def compared_with_another(points: Sequence["ModalPoint"], roots: Complex, model: Model) -> list[OtherRoot]:
    """Modes of which some ``points`` are compared with ``roots`` (m,) that a ``model`` calls otherwise."""
    found = []
    lying = [_names_at(point, root, model) for point, root in zip(points, roots.tolist(), strict=True)]
    for mode in dict.fromkeys(point.mode for point in points):
        every = [k for k, point in enumerate(points) if point.mode == mode]
        other = [k for k in every if mode not in lying[k][0]]
        if not other:
            continue
        more = [_more_chi2(points[k], complex(roots[k]), lying[k][1]) for k in other]
        speeds = [points[k].speed for k in other]
        names = dict.fromkeys(name for k in other for name in lying[k][0])
        found.append(
            OtherRoot(
                mode=mode,
                rows=len(other),
                of=len(every),
                slowest=min(speeds),
                fastest=max(speeds),
                lies_on=tuple(names),
                more_chi2=None if None in more else sum(x for x in more if x is not None),
            )
        )
    return found


def _names_at(point: "ModalPoint", root: complex, model: Model) -> tuple[list[str], complex | None]:
    """What a ``model`` calls a ``root`` at the speed of a ``point``, and its nearest root of the point's name."""
    here = ModelFamily(model).with_values(dict(point.settings)) if point.settings else model
    table = modes(here.linear_model(), [point.speed])
    branches = {name: table.branch(name)[0] for name in table.names}
    names = [name for name, branch in branches.items() if (abs(branch - root) < SAME * (1 + abs(root))).any()]
    own = branches.get(point.mode, np.zeros(0))
    own = own[np.isfinite(own)]
    return names, complex(own[np.argmin(abs(own - root))]) if len(own) else None


def _more_chi2(point: "ModalPoint", root: complex, named: complex | None) -> float | None:
    """How much larger chi^2 of one eigenvalue is with the root of its name than with the one that is nearest."""
    if named is None:
        return None
    sums = []
    for computed in (named, root):
        off = point.eigenvalue - computed
        parts = ((off.real, point.sd[0]), (off.imag, point.sd[1]))
        sums.append(sum((part / sd) ** 2 for part, sd in parts if sd > 0 and np.isfinite(part)))
    return float(sums[0] - sums[1])


@dataclass(frozen=True)
class Wanted:
    """Modes (m,) to be predicted: their recorded speeds, names, and eigenvalues ``near`` which they lie."""

    speed: Array  # (m,), m/s
    mode: tuple[str, ...]  # (m,)
    near: Complex  # (m,), 1/s

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
