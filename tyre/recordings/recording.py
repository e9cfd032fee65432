"""Rig recordings in SI units and one sign convention (x forward, y right, z down; side force grows with slip)."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Channel = NDArray[np.float64]


@dataclass(frozen=True)
class Condition:
    """Under which condition a recording was made; SI units, None where the lab did not say.

    ``load`` is the nominal vertical load (N), ``pressure`` in Pa, ``surface`` is ``flat`` or ``drum`` (then with
    ``drum_radius`` in m), ``speed`` m/s, ``temperature`` degrees Celsius, ``camber`` rad (> 0 leaning right).
    """

    tyre: str
    load: float
    pressure: float
    surface: str
    drum_radius: float | None = None
    rim: str | None = None
    speed: float | None = None
    temperature: float | None = None
    camber: float = 0.0


SIMULATED_NOTE = "synthetic: computed by the rig simulator, not measured"
COMPUTED_NOTE = "synthetic: computed by a simulation, not measured"
SYNTHETIC_NOTES = (SIMULATED_NOTE, COMPUTED_NOTE)
"""What a file of a synthetic recording notes for its reader; ``synthetic`` of the recording says it already."""


@dataclass(frozen=True)
class RigRun:
    """One slip-sweep (or slip-step) recording of a rolling tyre.

    Every channel has shape (n,): ``time`` s, ``slip_angle`` rad, ``side_force`` N (> 0 to the right),
    ``vertical_load`` N (> 0), and where recorded ``aligning_moment`` N m, ``inclination`` rad, ``speed`` m/s,
    ``temperature`` degrees Celsius. Missing samples are NaN. ``axes`` is the convention declared in the file
    (``ISO``, ``SAE`` or ``adapted SAE``); the channels here are already in adapted SAE. ``kind`` tells a sweep of
    slip from a step; ``notes`` holds what a reader must be told (an assumption, a channel left out).
    """

    condition: Condition
    axes: str
    time: Channel
    slip_angle: Channel
    side_force: Channel
    vertical_load: Channel
    aligning_moment: Channel | None = None
    inclination: Channel | None = None
    speed: Channel | None = None
    temperature: Channel | None = None
    source: Path | None = None
    synthetic: bool = False
    kind: Literal["slip_sweep", "slip_step"] = "slip_sweep"
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class PullTest:
    """One static lateral pull: ``side_force`` N over ``plate_displacement`` and ``rim_displacement`` m, shape (n,).

    The tyre's own deflection is plate minus rim (Dell'Orto et al., eq. 8).
    """

    condition: Condition
    axes: str
    side_force: Channel
    plate_displacement: Channel
    rim_displacement: Channel
    time: Channel | None = None
    source: Path | None = None
    synthetic: bool = False
    notes: tuple[str, ...] = ()

    @property
    def tyre_deflection(self) -> Channel:
        """Lateral deflection of the tyre alone, m."""
        return self.plate_displacement - self.rim_displacement

    @property
    def complete(self) -> NDArray[np.bool_]:
        """Which readings have a force and both displacements, shape (n,): the others are not fitted."""
        return np.isfinite(self.side_force) & np.isfinite(self.tyre_deflection)
