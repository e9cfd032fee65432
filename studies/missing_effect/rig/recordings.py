"""Recordings of a rig and what was known of their tyre, checked against each other."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from bicycle.model import Model
from studies.inference.fit import Fit
from studies.missing_effect.rig.reference import Reference
from tyre.base.errors import InputError
from tyre.estimate import Calibration
from tyre.recordings.recording import PullTest, RigRun

WHEEL_RADIUS = 0.34  # m


class TyreMeasurement:
    """What the measurements of a tyre answer alike: they have no bicycle."""

    def on(self, model: Model) -> Self:
        """Refuse a bicycle ``model``.

        Raises
        ------
        InputError
            Always.
        """
        raise InputError("a measurement of a tyre has a reference tyre, no bicycle model; leave the model out")

    def model_with(self, final: Fit) -> None:
        """None, whatever is in the ``final`` fit."""


@dataclass(frozen=True, eq=False)
class RigRecordings(TyreMeasurement):
    """Recordings of one tyre and the reference they are compared with, SI units.

    Attributes
    ----------
    name : str
        The file's name.
    reference : Reference
        What was known of the tyre.
    sweeps, pulls : tuples
        (name, recording); slip steps are not used, which ``notes`` says.
    includes : tuple of str
        Rig effects that the base model contains.
    pull_displacement : str
        ``tyre`` (plate minus rim) or ``plate``.
    wheel_radius : float
        m, for the drum's curvature.
    calibration : Calibration
        How well the rig is known, relative.
    description, source : str
    notes : tuple of str
        What was assumed or left out in reading; shown in the report.
    """

    name: str
    reference: Reference
    sweeps: tuple[tuple[str, RigRun], ...] = ()
    pulls: tuple[tuple[str, PullTest], ...] = ()
    includes: tuple[str, ...] = ()
    pull_displacement: str = "tyre"
    wheel_radius: float = WHEEL_RADIUS
    calibration: Calibration = Calibration()  # noqa: RUF009 - frozen
    description: str = ""
    source: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.sweeps and not self.pulls:
            raise InputError("no slip sweep and no pull test among the recordings; nothing can be compared")
        conditions = [run.condition for _, run in self.sweeps] + [test.condition for _, test in self.pulls]
        tyres = sorted({c.tyre for c in conditions})
        if len(tyres) > 1:
            raise InputError(f"recordings of {len(tyres)} tyres, {', '.join(tyres)}; diagnose one tyre at a time")
        if self.reference.tyre is not None and self.reference.tyre != tyres[0]:
            raise InputError(
                f"the recordings are of {tyres[0]!r}, the reference is of {self.reference.tyre!r}; give one tyre"
            )
        for condition in conditions:
            self.reference.at(condition.load, condition.pressure)
        _refuse_repeats([(n, (run.slip_angle, run.side_force)) for n, run in self.sweeps])
        _refuse_repeats([(n, (test.side_force, test.plate_displacement)) for n, test in self.pulls])

    @property
    def synthetic(self) -> bool:
        """Whether any recording was computed."""
        return any(run.synthetic for _, run in self.sweeps) or any(test.synthetic for _, test in self.pulls)


def _refuse_repeats(recordings: list[tuple[str, tuple[Any, Any]]]) -> None:
    for number, (name, channels) in enumerate(recordings):
        for other, theirs in recordings[:number]:
            if all(np.array_equal(a, b, equal_nan=True) for a, b in zip(channels, theirs, strict=True)):
                raise InputError(f"{name}: the same recording as {other}; keep one, or it counts twice")
