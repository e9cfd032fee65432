"""Pairing of measured modes with roots of the model: each with the nearest, whatever it is called."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
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


def note_misnamed_modes(points: Sequence["ModalPoint"], model: Model) -> list[str]:
    """Notes on modes whose ``points`` all lie five times nearer to another mode of the ``model`` than to their own."""
    notes = []
    for name in dict.fromkeys(point.mode for point in points):
        rows = sorted((p for p in points if p.mode == name and not p.settings), key=lambda p: p.speed)
        speeds = sorted({p.speed for p in rows})
        if len(speeds) < 2:
            continue
        table = modes(model.linear_model(), speeds)
        roots = np.array([p.eigenvalue for p in rows])
        at = np.searchsorted(speeds, [p.speed for p in rows])
        distances = {  # 1/s, of each row from each mode of the model
            mode: np.nan_to_num(abs(table.branch(mode)[at, 0] - roots), nan=np.inf) for mode in table.names
        }
        own_distance = distances.pop(name, np.full(len(rows), np.inf))
        nearer = [mode for mode, distance in distances.items() if (5 * distance < own_distance).all()]
        if nearer:
            lies = f"{own_distance.min():.3g} 1/s or more" if np.isfinite(own_distance).all() else "not there"
            nearer_mode, farthest = nearer[0], distances[nearer[0]].max()
            notes.append(
                f"every row called {name} lies on the {nearer_mode} of the base model (up to {farthest:.3g} "
                f"1/s away; its {name}: {lies}) and is compared with that root; if the name is wrong, correct it"
            )
    return notes


@dataclass(frozen=True)
class OtherRoot:
    """Rows of one mode that a model is compared with at a root of another name."""

    mode: str  # name of the mode in the table
    rows: int  # number of its rows that are compared with a root of another name
    of: int  # number of all its rows
    slowest: float  # m/s, of the rows
    fastest: float  # m/s, of the rows
    lies_on: tuple[str, ...]  # what the model calls these roots
    # how much larger chi^2 of the eigenvalues is with the roots of the name; None if the model has no such root there
    more_chi2: float | None

    def __str__(self) -> str:
        ends = dict.fromkeys((f"{self.slowest:.3g}", f"{self.fastest:.3g}"))
        return f"{self.rows} of {self.of} rows called {self.mode} (at {' to '.join(ends)} m/s)"


SAME = 1e-6  # of a root, within which two are one


def find_other_roots(points: Sequence["ModalPoint"], roots: Complex, model: Model) -> list[OtherRoot]:
    """Modes with ``points`` whose ``roots`` (m,), 1/s, a ``model`` calls otherwise, and how many points they are."""
    other_roots = []
    named_roots = [_name_root(point, root, model) for point, root in zip(points, roots.tolist(), strict=True)]
    for mode in dict.fromkeys(point.mode for point in points):
        rows = [k for k, point in enumerate(points) if point.mode == mode]
        elsewhere = [k for k in rows if mode not in named_roots[k][0]]
        if not elsewhere:
            continue
        more = [_more_chi2(points[k], complex(roots[k]), named_roots[k][1]) for k in elsewhere]
        speeds = [points[k].speed for k in elsewhere]
        names = dict.fromkeys(chain.from_iterable(named_roots[k][0] for k in elsewhere))
        other_roots.append(
            OtherRoot(
                mode=mode,
                rows=len(elsewhere),
                of=len(rows),
                slowest=min(speeds),
                fastest=max(speeds),
                lies_on=tuple(names),
                more_chi2=None if None in more else sum(x for x in more if x is not None),
            )
        )
    return other_roots


def _name_root(point: "ModalPoint", root: complex, model: Model) -> tuple[list[str], complex | None]:
    """Names of a ``root`` (1/s) in the ``model`` at a ``point``'s speed, and the model's nearest root of its mode.

    The second is None if the model has no such mode there.
    """
    if point.settings:
        model = ModelFamily(model).with_values(dict(point.settings))
    table = modes(model.linear_model(), [point.speed])
    branches = {name: table.branch(name)[0] for name in table.names}
    names = [name for name, branch in branches.items() if (abs(branch - root) < SAME * (1 + abs(root))).any()]
    same_name = branches.get(point.mode, np.zeros(0))
    same_name = same_name[np.isfinite(same_name)]
    nearest = complex(same_name[np.argmin(abs(same_name - root))]) if len(same_name) else None
    return names, nearest


def _more_chi2(point: "ModalPoint", root: complex, named: complex | None) -> float | None:
    """Increase of chi^2 of one eigenvalue if ``named`` takes the place of ``root``; None if ``named`` is None."""
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
    """The m modes to be predicted."""

    speed: Array  # (m,), m/s, as recorded
    mode: tuple[str, ...]  # (m,), names
    near: Complex  # (m,), 1/s, measured eigenvalues, near which their roots are looked for

    @cached_property
    def speeds(self) -> Array:
        """Speeds (S,), m/s, each once, in order."""
        return np.unique(self.speed)

    @cached_property
    def at(self) -> NDArray[np.intp]:
        """Number (m,) of the speed of each mode among :attr:`speeds`."""
        return np.searchsorted(self.speeds, self.speed)

    @cached_property
    def crowded(self) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """Groups of the modes of one name at one speed, where several names are wanted: all of them, one after another.

        Indices of the modes (c,), where each group begins among them (g,), and the number of its speed (g,).
        """
        names = np.array(self.mode)
        groups: list[NDArray[np.intp]] = []
        places = []
        for place, speed in enumerate(self.speeds):
            at_speed = self.speed == speed
            by_name = [np.flatnonzero(at_speed & (names == name)) for name in np.unique(names[at_speed])]
            if len(by_name) > 1:
                groups += by_name
                places += [place] * len(by_name)
        ends = np.cumsum([len(group) for group in groups], dtype=int)
        members = np.concatenate([np.zeros(0, int), *groups])
        return members, np.append(0, ends[:-1])[: len(groups)], np.array(places, int)


def match_roots(sought: Wanted, values: Complex) -> NDArray[np.intp]:
    """Index (m,) of the nearest root of each wanted mode in ``values`` (S, n), 1/s, at its speeds (S,)."""
    measured, roots = sought.near[:, None], values[sought.at]
    cost = np.abs(roots - measured)
    oscillates = np.abs(roots.imag) > 1e-9 * np.abs(roots).max(1, keepdims=True)
    cost[oscillates != (np.abs(measured.imag) > 1e-6 * np.abs(measured))] *= 3.0
    cost[roots.imag < 0] = 1e6
    index = cost.argmin(1)
    members, starts, places = sought.crowded
    if len(members):
        total = np.nan_to_num(np.add.reduceat(cost[members], starts), nan=1e9, posinf=1e9)  # (g, n)
        sizes = np.diff(np.append(starts, len(members)))
        index[members] = np.repeat(_assign_roots(total, places), sizes)
    return np.asarray(index)


def _assign_roots(cost: Array, places: NDArray[np.intp]) -> NDArray[np.intp]:
    """Root (g,) of each group by its ``cost`` (g, n): the least in all, no two groups of one of ``places`` (g,) alike.

    The nearest roots of all groups are such an assignment unless two of one place have the same.
    """
    roots = cost.argmin(1)
    count = cost.shape[1]
    uses = np.bincount(places * count + roots, minlength=(places[-1] + 1) * count).reshape(-1, count)
    clashes = np.flatnonzero(uses.max(1) > 1)
    bounds = np.searchsorted(places, [clashes, clashes + 1]).T.tolist()
    for begin, end in bounds:
        roots[begin:end] = scipy.optimize.linear_sum_assignment(cost[begin:end])[1]
    return np.asarray(roots)
