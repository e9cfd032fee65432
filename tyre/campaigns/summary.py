"""What a campaign keeps of one fitted recording, and the settings of a fit."""

from dataclasses import dataclass, field
from pathlib import Path

from tyre.base.errors import InputError
from tyre.estimate import Calibration
from tyre.recordings.preflight import LOAD_TOLERANCE
from tyre.recordings.recording import Condition


@dataclass(frozen=True)
class FitSettings:
    """What decides a fit besides the file.

    Attributes
    ----------
    calibration : Calibration
        Of the rig.
    lag_correction : bool
        Whether the lag is taken out.
    load_tolerance : float
        Largest distance of the measured load from the declared one, relative to the latter; beyond, a file is refused.
    """

    calibration: Calibration = field(default_factory=Calibration)
    lag_correction: bool = True
    load_tolerance: float = LOAD_TOLERANCE

    def __post_init__(self) -> None:
        if not 0.0 < self.load_tolerance <= 1.0:
            raise InputError(
                f"load tolerance = {self.load_tolerance:g} must be above 0 and at most 1 of the declared load"
            )


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
