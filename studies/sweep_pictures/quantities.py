"""What the figures show of a result: critical speeds by name, growth rates and modes along the speed."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.oscillation import damping_ratio, frequency_hz, least_damping_ratio
from bicycle.modal.known_modes import known_modes
from studies.sweep_pictures.stored import Stored, speeds_of
from studies.sweeps.chunk import CHANGES
from tyre.base.arrays import Array

CRITICAL = "critical_speeds"


@dataclass(frozen=True, eq=False)
class Limits:
    """Critical speeds of one mode in one direction.

    Attributes
    ----------
    mode, change : str
        Name, and ``destabilising`` or ``stabilising``.
    speeds : ndarray, shape (cells, samples, 4)
        m/s, ascending, NaN where there is none.
    possible : ndarray of bool, shape (cells, samples)
        Bicycles that are possible; the others have no critical speeds and do not count.
    """

    mode: str
    change: str
    speeds: Array
    possible: NDArray[np.bool_]

    @cached_property
    def number(self) -> NDArray[np.intp]:
        """How many there are of each possible bicycle."""
        return np.asarray(np.isfinite(self.speeds).sum(-1)[self.possible])

    @property
    def words(self) -> str:
        """What happens there as speed grows."""
        name = self.mode.replace("_", " ")
        end = "unstable" if self.change == CHANGES[0] else "stable"
        return f"{'unnamed modes' if self.mode == 'other' else name}: {end} above"

    def share_words(self) -> str:
        """How many bicycles have none, one or several, in words."""
        count, without = len(self.number), int((self.number == 0).sum())
        several = int((self.number > 1).sum())
        said = f"{without} of {count} have none" if without else f"all {count} have one or more"
        return said + (f", {several} several" if several else "")


def limits(stored: Stored) -> Iterator[Limits]:
    """Critical speeds by mode and direction, main modes first; only those that some bicycle has."""
    for mode in _main_first([str(name) for name in stored.data["crossing_mode"].values]):
        for change in CHANGES:
            speeds = stored.rows(CRITICAL, crossing_mode=mode, as_speed_grows=change)
            if np.isfinite(speeds).any():
                yield Limits(mode, change, speeds, stored.possible)


def any_limit(stored: Stored) -> bool:
    """Whether any bicycle has a critical speed."""
    if stored.reduced:
        return bool((stored.reduced_rows(f"{CRITICAL}_count") > 0).any())
    return any(True for _ in limits(stored))


def without_limits(stored: Stored) -> int:
    """How many possible bicycles have no critical speed at all."""
    found = np.zeros((stored.cells, stored.samples), bool)
    for one in limits(stored):
        found |= np.isfinite(one.speeds).any(-1)
    return int((stored.possible & ~found).sum())


def growth_rates(stored: Stored) -> Array | None:
    """Largest growth rates (1/s), (cells, samples, speeds); None where the result does not tell."""
    if "largest_growth_rate" in stored.data:
        found = stored.rows("largest_growth_rate")
    elif "eigenvalues" in stored.data:
        found = stored.rows("eigenvalues").real.max(-1)
    else:
        return None
    return found if found.ndim == 3 else found[..., None]


def smallest_damping(stored: Stored) -> Array | None:
    """Smallest damping ratios, (cells, samples, speeds), no unit; None where the result does not tell."""
    if "smallest_damping_ratio" in stored.data:
        found = stored.rows("smallest_damping_ratio")
    elif "eigenvalues" in stored.data:
        found = least_damping_ratio(stored.rows("eigenvalues"))
    else:
        return None
    return found if found.ndim == 3 else found[..., None]


@dataclass(frozen=True, eq=False)
class ModeRows:
    """One mode along the speed: ``frequency`` (Hz) and ``damping`` (no unit), (cells, samples, speeds) or None."""

    mode: str
    frequency: Array | None
    damping: Array | None

    @property
    def present(self) -> Array:
        """Share of the bicycles that have it at each speed, 0 to 1."""
        held = self.damping if self.damping is not None else self.frequency
        assert held is not None
        return np.asarray(np.isfinite(held).mean((0, 1)))


def mode_rows(stored: Stored) -> Iterator[ModeRows]:
    """The named modes that some bicycle has, main modes first."""
    if not speeds_of(stored).size or "mode" not in stored.data:
        return
    for mode in _main_first([str(name) for name in stored.data["mode"].values]):
        frequency = stored.rows("frequencies", mode=mode) if "frequencies" in stored.data else None
        damping = stored.rows("damping_ratios", mode=mode) if "damping_ratios" in stored.data else None
        if "modes" in stored.data:
            root = stored.rows("modes", mode=mode)
            frequency = frequency_hz(root) if frequency is None else frequency
            damping = np.where(root.imag == 0, np.nan, damping_ratio(root)) if damping is None else damping
        found = ModeRows(mode, frequency, damping)
        if (frequency is not None or damping is not None) and (found.present > 0).any():
            yield found


def _main_first(names: list[str]) -> list[str]:
    known = known_modes()
    return sorted(names, key=lambda name: not (name in known and known[name].main))
