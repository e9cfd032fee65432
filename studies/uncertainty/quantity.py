"""One uncertain result: value, linear standard deviation, what causes it, and Monte Carlo samples."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bicycle.critical.critical_speed import CrossingIdentity
from tyre.base.arrays import Array


@dataclass(frozen=True, eq=False)
class Quantity:
    """One result with its uncertainty.

    ``shares`` is the part of the linear variance each measurement causes; ``samples`` are the Monte Carlo values, NaN
    where the quantity does not exist or its root cannot be told from another. ``crossing`` says of a critical speed
    which one it is.
    """

    name: str
    unit: str
    value: float
    gradient: Array  # per standard normal number
    shares: Mapping[str, float]
    samples: Array
    crossing: CrossingIdentity | None = None

    @property
    def linear_sd(self) -> float:
        """Standard deviation by linear propagation."""
        return float(np.linalg.norm(self.gradient))

    @property
    def lost(self) -> int:
        """Number of samples without this quantity."""
        return int(np.isnan(self.samples).sum())

    @property
    def kept(self) -> Array:
        """The samples that have it."""
        return self.samples[~np.isnan(self.samples)]

    @property
    def sampled_mean(self) -> float:
        """Mean of the samples that have it; NaN where none has."""
        return float(self.kept.mean()) if len(self.kept) else float("nan")

    @property
    def sampled_sd(self) -> float:
        """Standard deviation of the samples that have it."""
        return float(self.kept.std(ddof=1)) if len(self.kept) > 1 else float("nan")

    def band(self, share: float = 0.95) -> tuple[float, float]:
        """Central interval, in the unit of the quantity, that holds a part ``share`` (0 to 1, no unit) of the samples.

        NaN where no sample has it.
        """
        if not len(self.kept):
            return float("nan"), float("nan")
        low, high = np.nanquantile(self.samples, [(1 - share) / 2, (1 + share) / 2])
        return float(low), float(high)
