"""One recorded run of a bicycle: equidistant samples in SI units."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.channels.mounting import Mounting


@dataclass(frozen=True)
class Run:
    """One run: equidistant samples ``time`` (s), measured ``channels`` and known ``inputs`` by column name, SI.

    ``mountings`` are the rotations of sensors that were applied, each with its uncertainty; ``notes`` tell what was
    done to the recording. A run that is ``held_out`` is never fitted, only predicted. ``between`` says how its torques
    go from sample to sample: ``held`` or ``linear``; empty where nobody said so.
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
    between: str = ""

    @property
    def step(self) -> float:
        """Sample time, s."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))


def refuse_copies(runs: Sequence[Run]) -> None:
    """Refuse a recording that stands twice among ``runs``: it would count as two.

    Raises
    ------
    InputError
        Two runs with the same samples.
    """
    seen: dict[tuple[tuple[str, bytes], ...], Run] = {}
    for run in runs:
        samples = tuple((name, run.channels[name].tobytes()) for name in sorted(run.channels))
        if (other := seen.setdefault(samples, run)) is not run:
            raise InputError(f"{run.name}: the same recording as {other.name}; keep one, or it counts twice")
