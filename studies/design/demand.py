"""What is asked of a mode: to be stable, or to have a least damping ratio, over a range of speed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.linear_model import LinearModel
from bicycle.modal.named_modes import modes
from tyre.base.arrays import Array, Complex
from tyre.base.errors import InputError

STABLE = "stable"
EVERY = "all"
GRID = 0.4  # m/s between the speeds at which a mode is looked at, at most
FEWEST = 41


@dataclass(frozen=True)
class Demand:
    """A mode that is to keep ``Re z + ratio |z| <= 0``: stable with ratio 0, else with that damping ratio at least."""

    mode: str
    ratio: float = 0.0

    def __str__(self) -> str:
        return f"{self.mode} stable" if not self.ratio else f"{self.mode} with a damping ratio of {self.ratio:g}"

    def excess(self, roots: Any) -> Any:
        """By how much ``roots`` (1/s, any shape) miss it: ``Re z + ratio |z|``, 1/s."""
        return roots.real + self.ratio * np.abs(roots)

    def slope(self, root: Complex, change: Complex) -> Array:
        """Derivative of the excess from that of a root.

        Parameters
        ----------
        root : ndarray of complex, shape (k,)
            1/s.
        change : ndarray of complex, shape (k, d)
            Its derivatives.
        """
        turned = (root.conj() / np.maximum(np.abs(root), 1e-300))[:, None] * change
        return np.asarray(change.real + self.ratio * turned.real)


def demands(keep: Sequence[tuple[str, str]], ratio: float | None = None) -> tuple[Demand, ...]:
    """Demands as they are written.

    Parameters
    ----------
    keep : sequence of (str, str)
        Mode, and ``stable`` or a least damping ratio.
    ratio : float, optional
        Least damping ratio (no unit) of all that say ``stable``.

    Raises
    ------
    InputError
        A word that is neither, a ratio outside 0 to 1, or a mode that is named twice.
    """
    found: dict[str, Demand] = {}
    for mode, word in keep:
        try:
            number = (ratio or 0.0) if word == STABLE else float(word)
        except ValueError:
            number = np.nan
        if not 0 <= number < 1:
            raise InputError(
                f"--keep {mode} {word if word != STABLE else number}: give {STABLE}, or a least damping ratio "
                "from 0 to below 1"
            )
        if mode in found:
            raise InputError(f"--keep {mode} is given twice; keep one")
        found[mode] = Demand(mode, number)
    return tuple(found.values())


def expanded(asked: Sequence[Demand], linear: LinearModel, speeds: Array) -> tuple[Demand, ...]:
    """Demands with ``all`` in place of every mode that a model has at speeds (m,), m/s.

    Parameters
    ----------
    asked : sequence of Demand
    linear : LinearModel
    speeds : ndarray, shape (m,)

    Raises
    ------
    InputError
        A mode that the model does not have, with those that it has.
    """
    names = [name for name in modes(linear, speeds).names if "+" not in name]
    every = next((one for one in asked if one.mode == EVERY), None)
    found = {one.mode: one for one in asked if one.mode != EVERY}
    for name in found:
        if name not in names:
            raise InputError(
                f"--keep {name}: the model has no such mode between {speeds.min():g} and {speeds.max():g} m/s; it has "
                f"{', '.join(names)} ({EVERY} is every one)"
            )
    if every is not None:
        found = {name: found.get(name, Demand(name, every.ratio)) for name in names}
    return tuple(found.values())


def grid(low: float, high: float) -> Array:
    """Speeds (m,) at which modes are looked at from ``low`` to ``high``, m/s."""
    return np.linspace(low, high, max(FEWEST, int(np.ceil((high - low) / GRID)) + 1))


def members(branches: Mapping[str, Complex], mode: str) -> Complex:
    """Roots (m, k) in 1/s that are, or may be, of a mode; NaN where there are fewer.

    Parameters
    ----------
    branches : mapping of str to ndarray, shape (m, 2)
        Of a :class:`bicycle.modal.named_modes.Modes`, 1/s.
    mode : str
        Where modes have met and share a name, what they share counts.
    """
    own = [values for name, values in branches.items() if mode in name.split("+")]
    count = len(next(iter(branches.values())))
    return np.concatenate(own, 1) if own else np.full((count, 1), complex(np.nan, np.nan))


def worst(demand: Demand, roots: Complex) -> tuple[Complex, NDArray[np.bool_]]:
    """At each speed the root that misses a demand most (m,), and whether there is one (m,).

    Parameters
    ----------
    demand : Demand
    roots : ndarray of complex, shape (m, k)
        1/s; NaN where there is none.
    """
    excess = np.where(np.isnan(roots), -np.inf, demand.excess(np.nan_to_num(roots)))
    at = excess.argmax(1)
    row = np.arange(len(roots))
    return roots[row, at], np.isfinite(excess[row, at])
