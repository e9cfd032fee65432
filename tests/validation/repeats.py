"""Do 95 % intervals hold the truth with few repeats and with many? SYNTHETIC summaries of recordings of known truth.

Each campaign has one laboratory, whose recordings scatter by an unknown amount; the fit is told the default
repeatability of 1 %. Scatter is drawn as that statement means it (scaled inverse chi^2, 8 degrees of freedom), or is a
fixed multiple of it: a laboratory that is twice as bad as it says is covered less often, which the result shows.
Counted: how often the interval of C_alpha of a condition with two sweeps (with no repeats: one) holds the truth.
"""

from pathlib import Path
from typing import Any

import numpy as np

from tyre.fits import Key, RecordingSummary, combine, pooled_repeatability
from tyre.measured import REPEATABILITY_DOF, Calibration
from tyre.recordings import Condition

PAIRS = (0, 1, 3, 30)
SCATTERS = ("as stated", 0.5, 1.0, 1.5, 2.0)
_TRUTH, _FIT_SD = 6000.0, 0.002  # N/rad, and what the residuals say of each fit, relative


def run(*, out: Path, seed: int, campaigns: int = 4000) -> dict[str, Any]:
    """Count the intervals that hold the truth."""
    rng = np.random.default_rng(seed)
    shares = {
        str(scatter): {
            str(pairs): round(100 * float(np.mean([covered(rng, pairs, scatter) for _ in range(campaigns)])), 2)
            for pairs in PAIRS
        }
        for scatter in SCATTERS
    }
    error = round(100 * float(np.sqrt(0.95 * 0.05 / campaigns)), 2)
    return {"standard_error_percent": error, "share_percent": shares}


def covered(rng: np.random.Generator, pairs: int, scatter: str | float) -> bool:
    """Whether the interval of one condition holds the truth."""
    calibration = Calibration()
    drawn = np.sqrt(REPEATABILITY_DOF / rng.chisquare(REPEATABILITY_DOF))
    sd = calibration.repeatability * (float(drawn) if isinstance(scatter, str) else scatter)
    gain = rng.normal(0.0, np.hypot(calibration.force, calibration.slip))
    each = 2 if pairs else 1
    noise = rng.normal(0.0, np.hypot(sd, _FIT_SD), (max(pairs, 1), each)) + gain
    groups = [[_summary(_TRUTH * (1.0 + error), number) for number, error in enumerate(row)] for row in noise]
    floor = calibration.repeatability
    result = combine(
        Key("Synthetic", "flat", 400.0, 5e5), groups[0], borrowed=[], calibration=calibration,
        sweep_repeatability=pooled_repeatability(groups, floor=floor),
        pull_repeatability=pooled_repeatability([], floor=floor),
    )  # fmt: skip
    assert result.cornering_stiffness is not None
    return result.cornering_stiffness.covers(_TRUTH)


def _summary(value: float, number: int) -> RecordingSummary:
    condition = Condition(tyre="Synthetic", load=400.0, pressure=5e5, surface="flat")
    return RecordingSummary(
        file=f"sweep_{number}", kind="slip_sweep", condition=condition, synthetic=True, value=value,
        fit_sd=_FIT_SD * value, r_squared=0.999,
    )  # fmt: skip
