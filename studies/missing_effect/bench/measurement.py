"""Bench tests of the steering as a measurement of a bicycle."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studies.inference.parameter import Candidate
from studies.missing_effect.bench.candidates import bench_candidates, bench_refused, unseen
from studies.missing_effect.bench.forward import BenchForward
from studies.missing_effect.bench.table import Reading, read_bench
from studies.missing_effect.motion.measurements import BicycleMeasurement


@dataclass(frozen=True, kw_only=True)
class BenchMeasurement(BicycleMeasurement):
    """Torques at the bar of a bicycle at rest: ``readings`` in the order of the table."""

    readings: tuple[Reading, ...]

    def sensors(self) -> tuple[Candidate, ...]:
        """Scale, zero and lever arm of the balance, zero of the angle; dry friction, and that of the contact patch."""
        return bench_candidates(self._sorted)

    def impossible(self) -> dict[str, str]:
        """Whatever needs a rolling tyre, a rider or a motor, and what takes more readings; nothing of the base."""
        base = {effect.identifier for effect in self.model.effects}
        return {name: why for name, why in bench_refused(self._sorted).items() if name not in base}

    def assumptions(self) -> tuple[str, ...]:
        """What of the base model has no part in the tests, and how the bicycle was held."""
        gone = [e.identifier for e in self.model.effects if e.identifier != "no_slip" and unseen(type(e))]
        found = ["the rear frame was held upright, at the pitch at which it rides"]
        if gone:
            found.append(f"{', '.join(gone)} of the base model: without effect at rest")
        return tuple(found)

    def forward(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> BenchForward:
        """See :meth:`BicycleMeasurement.forward` for ``without`` and ``also``."""
        return BenchForward.of_readings(self._sorted, **self._library(without, also))

    @property
    def _sorted(self) -> tuple[Reading, ...]:
        return tuple(
            sorted(self.readings, key=lambda r: (r.test, r.condition, -r.direction * (not r.rate), r.rate, r.steer))
        )


def read_bench_measurement(content: Mapping[str, Any], folder: Path, common: Mapping[str, Any]) -> BenchMeasurement:
    """The measurement of the table ``[bench]``.

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
        See :func:`.read_bench`.
    """
    readings, notes = read_bench(content, folder)
    return BenchMeasurement(**common, readings=readings, notes=notes)
