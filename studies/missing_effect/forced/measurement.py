"""Measured frequency responses as a measurement of a bicycle."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studies.inference.parameter import Candidate
from studies.missing_effect.forced.figure import BODE
from studies.missing_effect.forced.forward import FrequencyForward
from studies.missing_effect.forced.sensors import sensor_candidates, sensors_refused
from studies.missing_effect.forced.table import Accelerometer, ResponsePoint, read_responses
from studies.missing_effect.gap_figures import GAP
from studies.missing_effect.interface import Figure
from studies.missing_effect.motion.measurements import DRY, BicycleMeasurement


@dataclass(frozen=True, kw_only=True)
class FrequencyMeasurement(BicycleMeasurement):
    """Frequency responses at several speeds: ``points``, with the place of the ``accelerometer`` where there is one."""

    points: tuple[ResponsePoint, ...]
    accelerometer: Accelerometer | None = None

    def sensors(self) -> tuple[Candidate, ...]:
        """Speed, and gain, delay and low-pass of the signals."""
        return sensor_candidates(self._sorted)

    def impossible(self) -> dict[str, str]:
        """Dry friction, an offset of a single speed, and errors of an input that look like those of its output."""
        return DRY | sensors_refused(self._sorted)

    def assumptions(self) -> tuple[str, ...]:
        """That the response is the bicycle's own, where something must have held it."""
        linear = self.model.linear_model()
        speeds = sorted({p.speed for p in self.points})
        held = [v for v in speeds if linear.eigenvalues(v).real.max() > 0]
        found = ["the noise of different frequencies, outputs and speeds counts as independent"]
        if held:
            found.append(
                f"unstable at {', '.join(f'{v:g}' for v in held)} m/s: something held the bicycle there. Output over "
                "input is the bicycle's own response all the same, if the recorded input is all that acted; noise that "
                "the rider or controller answers biases it, unless a reference signal was used (see the documentation)"
            )
        return tuple(found)

    def forward(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> FrequencyForward:
        """See :meth:`BicycleMeasurement.forward` for ``without`` and ``also``."""
        return FrequencyForward(
            points=self._sorted, accelerometer=self.accelerometer, **self._library(without, also)
        )  # fmt: skip

    def figures(self) -> dict[str, Figure]:
        """The gap, and gain and phase."""
        return {"gap": GAP, "before_after": BODE}

    @property
    def _sorted(self) -> tuple[ResponsePoint, ...]:
        return tuple(sorted(self.points, key=lambda p: (p.input, p.output, p.speed, p.frequency)))


def read_frequency_response(
    content: Mapping[str, Any], folder: Path, common: Mapping[str, Any]
) -> FrequencyMeasurement:
    """The measurement of the table ``[frequency_response]``.

    Parameters
    ----------
    content : mapping
        The table.
    folder : Path
        Where the file that it names is.
    common : mapping
        Fields of :class:`.BicycleMeasurement`.

    Raises
    ------
    InputError
        See :func:`.read_responses`.
    """
    points, accelerometer, notes = read_responses(content, folder)
    return FrequencyMeasurement(
        **{**common, "notes": (*common.get("notes", ()), *notes)}, points=points, accelerometer=accelerometer
    )  # fmt: skip
