"""Words and rows of the wobble of a ride, for ``velotyre modal --ride``."""

from collections.abc import Iterator, Sequence

from bicycle.identification import Wobble
from bicycle.model.eigen import frequency_hz
from tyre.ground.number_with_sd import with_sd

HEADERS = ("ride", "speed m/s", "real 1/s", "imaginary rad/s", "Hz", "orders", "seconds", "judgement")
WEAVE = (
    "weave is not estimated from a ride without an impulse; it needs a model: `velotyre diagnose` with kind = "
    '"ride_spectra"'
)
AS_RIDDEN = "wobble is that of the bicycle as ridden, with the rider's hands"


def wobble_cells(wobble: Wobble) -> list[object]:
    """Cells of a printed row: ride, speed (m/s), eigenvalue ± sd (1/s, rad/s), Hz, orders, duration (s), judgement."""
    judgement = wobble.rejected or "ok"
    duration = round(wobble.duration)
    if not wobble.orders:
        return [wobble.run, wobble.speed, "", "", "", "", duration, judgement]
    pole = wobble.eigenvalue
    return [
        wobble.run,
        wobble.speed,
        with_sd(pole.real, wobble.sd[0]),
        with_sd(pole.imag, wobble.sd[1]),
        f"{float(frequency_hz(pole)):.2f}",
        f"{len(wobble.orders)} from {wobble.orders[0]} to {wobble.orders[-1]}",
        duration,
        judgement,
    ]


def notes_of_wobble(wobbles: Sequence[Wobble]) -> Iterator[str]:
    """Notes on what a row is, and on weave."""
    if any(not wobble.rejected for wobble in wobbles):
        yield AS_RIDDEN
    yield WEAVE
