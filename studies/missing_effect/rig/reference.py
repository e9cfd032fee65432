"""What was known of a tyre before its recordings are diagnosed: stiffness and curve at one or more conditions."""

import math
from dataclasses import dataclass, replace

import numpy as np

from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR

LENGTH_SD = 0.1  # relative: the static C/K and the lag of a rolling tyre are not the same thing
PEAK, SHAPE, CURVATURE = 1.05, 1.4, 0.0  # of the curve where only its slope is known; the peak in loads
FARTHEST = 3.0  # times a load of the reference is from what it still serves
ALIKE = 0.02  # relative difference of loads, or of pressures, that are the same condition

Value = tuple[float, float]


@dataclass(frozen=True)
class Curve:
    """The tyre at one condition, SI: (value, sd) of C, K and relaxation length, and the Magic Formula's coefficients.

    ``drum_radius`` is None on a flat track; ``peak`` in N.
    """

    load: float
    pressure: float
    cornering_stiffness: Value | None = None
    lateral_stiffness: Value | None = None
    relaxation_length: Value | None = None
    peak: float | None = None
    shape: float = SHAPE
    curvature: float = CURVATURE
    drum_radius: float | None = None

    @property
    def length(self) -> Value | None:
        """Relaxation length as given, else C/K; its sd holds what C/K leaves open."""
        if self.relaxation_length is not None:
            value, sd = self.relaxation_length
            return value, sd
        if self.cornering_stiffness is None or self.lateral_stiffness is None:
            return None
        (c, c_sd), (k, k_sd) = self.cornering_stiffness, self.lateral_stiffness
        return c / k, c / k * math.sqrt((c_sd / c) ** 2 + (k_sd / k) ** 2 + LENGTH_SD**2)


@dataclass(frozen=True)
class Reference:
    """Curves of one tyre; ``origin`` says in words where they come from."""

    curves: tuple[Curve, ...]
    origin: str
    tyre: str | None = None

    def at(self, load: float, pressure: float) -> Curve:
        """The curve for a ``load`` (N) and ``pressure`` (Pa): its own, else between loads, else of the nearest load.

        Its ``load`` is the load for which its numbers hold.

        Raises
        ------
        InputError
            For a pressure that the reference does not have, or a load far from all of its loads.
        """
        near = [c for c in self.curves if abs(c.pressure / pressure - 1) < ALIKE]
        if not near:
            have = ", ".join(f"{p / PASCAL_PER_BAR:g}" for p in sorted({c.pressure for c in self.curves}))
            raise InputError(
                f"the reference ({self.origin}) has nothing at {pressure / PASCAL_PER_BAR:g} bar (it has {have} bar); "
                "stiffness is not extrapolated over pressure"
            )
        near.sort(key=lambda c: c.load)
        best = min(near, key=lambda c: abs(math.log(c.load / load)))
        below, above = [c for c in near if c.load < load], [c for c in near if c.load > load]
        if (apart := max(best.load / load, load / best.load)) > FARTHEST and not (below and above):
            raise InputError(
                f"the reference ({self.origin}) at {best.load:g} N says nothing of a recording at {load:g} N, "
                f"{apart:.3g} times apart (at most {FARTHEST:g}); give one near that load, or mend the load's unit"
            )
        if abs(best.load / load - 1) < ALIKE or not below or not above:
            return best
        low, high = below[-1], above[0]
        share = math.log(load / low.load) / math.log(high.load / low.load)

        def between(a: Value | None, b: Value | None) -> Value | None:
            if a is None or b is None:
                return None
            value = math.exp((1 - share) * math.log(a[0]) + share * math.log(b[0]))
            return value, value * max(a[1] / a[0], b[1] / b[0])

        peak = None if low.peak is None or high.peak is None else (1 - share) * low.peak + share * high.peak
        return replace(
            low, load=load, peak=peak, cornering_stiffness=between(low.cornering_stiffness, high.cornering_stiffness),
            lateral_stiffness=between(low.lateral_stiffness, high.lateral_stiffness),
            relaxation_length=between(low.relaxation_length, high.relaxation_length),
        )  # fmt: skip

    def load_exponent(self, pressure: float) -> float | None:
        """d(ln C)/d(ln load) at a ``pressure`` (Pa); None with fewer than two loads."""
        near = [c for c in self.curves if abs(c.pressure / pressure - 1) < ALIKE and c.cornering_stiffness]
        loads = np.log([c.load for c in near])
        if len(near) < 2 or np.ptp(loads) < ALIKE:
            return None
        return float(np.polyfit(loads, np.log([c.cornering_stiffness[0] for c in near if c.cornering_stiffness]), 1)[0])
