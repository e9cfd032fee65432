"""The name of the mode that crosses along a boundary: asked at some points, and between where they differ."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bicycle.modal.named_modes import modes
from studies.stability_charts.boundary import Boundary
from studies.stability_charts.plane import Plane

ASKED = 9  # points of a boundary at which names are asked at least
FAR = 1e-3  # of the largest root: a named root so far from the crossing one is another


@dataclass(frozen=True)
class Names:
    """``names`` of the mode at each point (m); where it was ``asked`` (m,), not taken from both sides."""

    names: tuple[str, ...]
    asked: NDArray[np.bool_]

    @property
    def distinct(self) -> tuple[str, ...]:
        """Every name along the boundary, in order."""
        return tuple(dict.fromkeys(self.names))


def named(plane: Plane, boundary: Boundary) -> Names:
    """Names along a boundary; where neighbours that were asked differ, all between are asked by halving.

    Parameters
    ----------
    plane : Plane
    boundary : Boundary
    """
    count = len(boundary)
    found: dict[int, str] = {}

    def ask(k: int) -> str:
        if k not in found:
            found[k] = _name(plane, boundary, k)
        return found[k]

    nodes = np.unique(np.linspace(0, count - 1, min(ASKED, count)).round().astype(int)).tolist()
    open_ = list(pairwise(nodes))
    ask(nodes[0])
    while open_:
        a, b = open_.pop()
        if ask(a) != ask(b) and b - a > 1:
            middle = (a + b) // 2
            open_ += [(a, middle), (middle, b)]
    known = np.array(sorted(found))
    before = known[np.searchsorted(known, np.arange(count), side="right") - 1]
    asked = np.isin(np.arange(count), known)
    return Names(tuple(found[int(k)] for k in before), asked)


def _name(plane: Plane, boundary: Boundary, k: int) -> str:
    """The name that a list of modes gives to the root that crosses at point number k; of two modes joined by a plus."""
    share, root = boundary.shares[k : k + 1], 1j * abs(boundary.roots[k].imag)
    speed = float(plane.speeds(share)[0])
    listed = modes(plane.space.linear_at(plane.x(share)[0]), [speed])
    near = [
        (abs(value - root), name)
        for name, branch in listed.branches.items() for value in branch[0] if not np.isnan(value)
    ]  # fmt: skip
    away, name = min(near)
    return name if away < FAR * float(boundary.sizes[k]) + 1e-6 else ""
