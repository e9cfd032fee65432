"""One recorded run of a bicycle: equidistant samples in SI units."""

from collections.abc import Mapping
from dataclasses import dataclass

from tyre.base.arrays import Array
from tyre.channels.mounting import Mounting


@dataclass(frozen=True)
class Run:
    """One run: equidistant samples ``time`` (s), measured ``channels`` and known ``inputs`` by column name, SI.

    ``mountings`` are the rotations of sensors that were applied, each with its uncertainty; ``notes`` tell what was
    done to the recording. A run that is ``held_out`` is never fitted, only predicted.
    """

    name: str
    speed: float
    time: Array
    channels: Mapping[str, Array]
    inputs: Mapping[str, Array]
    group: str = ""
    mountings: tuple[Mounting, ...] = ()
    notes: tuple[str, ...] = ()
    held_out: bool = False

    @property
    def step(self) -> float:
        """Sample time, s."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))
