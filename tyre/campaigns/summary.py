"""What a campaign keeps of one fitted recording, and the settings of a fit."""

from dataclasses import dataclass, field
from pathlib import Path

from tyre.estimate import Calibration
from tyre.recordings.recording import Condition


@dataclass(frozen=True)
class FitSettings:
    """What decides a fit besides the file: calibration of the rig and whether the lag is taken out."""

    calibration: Calibration = field(default_factory=Calibration)
    lag_correction: bool = True


@dataclass(frozen=True)
class RecordingSummary:
    """One fitted recording, SI units; ``kind`` is ``slip_sweep``, ``slip_step`` or ``pull_test``.

    ``value`` and ``fit_sd`` are C_Fy (N/rad), relaxation length (m) or K_y (N/m) with the standard deviation from this
    recording's residuals alone. ``details`` holds further numbers by name and unit.
    """

    file: str
    kind: str
    condition: Condition
    synthetic: bool
    value: float
    fit_sd: float
    r_squared: float
    rate: float = 0.0
    speed: float | None = None
    half_gap: float = 0.0
    half_gap_sd: float = 0.0
    details: dict[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    cache: Path | None = None
