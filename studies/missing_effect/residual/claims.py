"""What is said of the critical speeds of a corrected model, and where nothing can be.

A coefficient is a parabola over speed that is extrapolated beyond the measured speeds, where its band widens. So a
critical speed is told as all speeds at which zero lies within the band of the real part, a crossing of the model itself
only where all of these were measured; and nothing where the torque does not describe the data.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from bicycle.critical.critical_speed import CriticalSpeed
from bicycle.critical.critical_speeds import critical_speeds
from bicycle.model import Model
from bicycle.sensitivity.critical_intervals import CriticalInterval, critical_intervals
from studies.missing_effect.residual.fitting import Residual

REACH = 1.5  # from the slowest measured speed over it to the fastest times it, critical speeds are looked for
STEP = 0.1  # m/s
YES, IN_PART, NO = "yes", "in part", "no: extrapolated"


@dataclass(frozen=True)
class Critical:
    """Speeds at which a mode of the corrected model may change its stability.

    Attributes
    ----------
    interval : CriticalInterval
        95 %, m/s; infinite at the end of the speeds that are looked at, or at which the mode is of its kind.
    crossings : tuple of CriticalSpeed
        Of the model itself, within; none unless all of the interval was measured.
    measured : str
        Whether speeds were measured there: all, in part or none.
    """

    interval: CriticalInterval
    crossings: tuple[CriticalSpeed, ...]
    measured: str


@dataclass(frozen=True)
class Claims:
    """Critical speeds of a corrected model.

    Attributes
    ----------
    slowest, fastest : float
        Between which they are looked for, m/s.
    withheld : str
        Why none is told, in words; empty where they are.
    found : tuple of Critical
        From slow to fast.
    """

    slowest: float
    fastest: float
    withheld: str = ""
    found: tuple[Critical, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """For JSON: limits are null where there is none."""
        return {
            "looked_for_m_s": [self.slowest, self.fastest], "withheld": self.withheld,
            "found": [
                {
                    "mode": one.interval.mode, "kind": one.interval.kind, "told": one.interval.told,
                    "low_m_s": one.interval.low if np.isfinite(one.interval.low) else None,
                    "high_m_s": one.interval.high if np.isfinite(one.interval.high) else None,
                    "crossings": [{"speed_m_s": c.speed, "direction": c.direction} for c in one.crossings],
                    "measured": one.measured,
                }
                for one in self.found
            ],
        }  # fmt: skip


def claims(residual: Residual, model: Model) -> Claims:
    """What can be said of the critical speeds of the corrected ``model`` with its covariance.

    Parameters
    ----------
    residual : Residual
        The torque that it holds.
    model : Model
    """
    low, high = residual.scale.ends
    slowest, fastest = low / REACH, high * REACH
    if not residual.describes:
        why = f"χ² is {residual.misfit:.3g} a number, so the torque does not describe the data"
        return Claims(slowest, fastest, why)
    every = critical_speeds(model, max_speed=fastest)
    steps = 1 + round((fastest - slowest) / STEP)
    found = []
    for interval in critical_intervals(model, np.linspace(slowest, fastest, steps)):
        ends = np.clip([interval.low, interval.high], slowest, fastest)
        if low <= ends[0] and ends[1] <= high:
            own = tuple(c for c in every if _same(c, interval) and interval.holds(c.speed))
            found.append(Critical(interval, own, YES))
        else:
            found.append(Critical(interval, (), NO if ends[1] < low or ends[0] > high else IN_PART))
    return Claims(slowest, fastest, "", tuple(sorted(found, key=lambda one: (one.interval.low, one.interval.high))))


def _same(crossing: CriticalSpeed, interval: CriticalInterval) -> bool:
    return (crossing.mode, crossing.kind) == (interval.mode, interval.kind)
