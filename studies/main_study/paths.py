"""Modes along speed as figures draw them: fine where two roots meet, so that no curve ends before its meeting."""

import numpy as np

from bicycle.modal.named_modes import Modes, modes
from studies.main_study.solve import Result
from tyre.base.arrays import Array

MEETINGS = ("merge", "split")
CLOSE = np.concatenate([[1e-9], np.geomspace(1e-4, 1.0, 13)])  # of the step between two speeds


def paths(result: Result, speeds: Array) -> Modes:
    """Modes of a result at ``speeds`` (m/s, rising) and, ever closer, on both sides of every meeting of roots."""
    step = float(np.max(np.diff(speeds)))
    meetings = [event.speed for event in result.modes.events if event.kind in MEETINGS]
    near = [meeting + sign * step * CLOSE for meeting in meetings for sign in (-1, 1)]
    every = np.unique(np.concatenate([speeds, *near]))
    return modes(result.modes.model, every[(every >= speeds[0]) & (every <= speeds[-1])])
