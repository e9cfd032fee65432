"""Usual values of bicycle tyres: a value outside its band gets a note, one that no tyre can have is refused.

The bands reach beyond the published values (Dell'Orto et al., tables 2 to 9, and the Schwalbe 28 x 1.75 of
mechmotum/bicycle-kickplate-model; see data/SOURCES.md): fat, cargo and hand-cycle tyres exist.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tyre.arrays import Array
from tyre.errors import InputError
from tyre.plausible import Doubt, doubt

GRAVITY = 9.80665
POUND = 0.45359237 * GRAVITY  # N in a pound-force


@dataclass(frozen=True)
class Band:
    """A quantity of a tyre and the values that are usual."""

    words: str  # its name in messages
    unit: str  # SI
    typical: tuple[float, float]  # lowest and highest usual value
    published: tuple[float, float]  # lowest and highest value of the sources
    # units that it may be in by mistake, beside those of :mod:`tyre.plausible`, each with its factor to ``unit``
    slips: tuple[tuple[float, str], ...] = ()


_FORCES = (
    (1 / GRAVITY, "load in kg"), (GRAVITY, "side force in kg"), (1e-3, "load in kN"), (1e3, "side force in kN"),
    (1 / POUND, "load in lbf"), (POUND, "side force in lbf"),
)  # fmt: skip
_PULLS = (GRAVITY, "force in kg"), (POUND, "force in lbf"), (1e3, "N/mm or force in kN"), (1 / 25.4, "N/inch")
BANDS: Mapping[str, Band] = {
    "cornering_stiffness_per_load": Band("cornering stiffness over load", "1/rad", (4.0, 40.0), (10.2, 18.0), _FORCES),
    "lateral_stiffness": Band("lateral stiffness", "N/m", (8e3, 3e5), (31.6e3, 75.4e3), _PULLS),
    "relaxation_length": Band("relaxation length", "m", (0.015, 0.6), (0.061, 0.199)),
    "pneumatic_trail": Band("pneumatic trail", "m", (-0.02, 0.1), (0.012, 0.021)),
    # of sweeps whose slip reaches 1 to 15 degrees
    "largest_force_per_load": Band("largest side force over load", "N/N", (0.01, 1.8), (0.0, 1.2), _FORCES),
}


def doubts(values: Mapping[str, float | None], *, at: str = "") -> tuple[Doubt, ...]:
    """Return a doubt for every unusual value of a tyre."""
    found = []
    for name, band in BANDS.items():
        value = values.get(name)
        if value is not None and np.isfinite(value):
            said = doubt(band.words + at, float(value), unit=band.unit, typical=band.typical, slips=band.slips)
            found += [said] if said else []
    return tuple(found)


def table_doubts(
    load: Array, values: Mapping[str, Array], *, where: str, places: Sequence[str] = ()
) -> tuple[str, ...]:
    """Return one note a quantity that is unusual at some of many conditions; refuse the impossible."""
    every = {name: np.asarray(value, float) for name, value in values.items() if name in BANDS}
    if "cornering_stiffness" in values:
        every["cornering_stiffness_per_load"] = np.asarray(values["cornering_stiffness"]) / load
    notes = []
    for name, column in every.items():
        found = [
            (said, place)
            for place, (value, force) in enumerate(zip(column, load, strict=True))
            for said in doubts({name: float(value)}, at=f" at {force:g} N")
        ]
        for said, place in found:
            if said.absurd:
                row = f", {places[place]}" if len(places) else ""
                raise InputError(f"{where}{row}: {said.text}; no tyre has that, correct the value or its unit")
        if found:
            more = f" (and {len(found) - 1} more conditions)" if len(found) > 1 else ""
            notes.append(f"{found[0][0].text}{more}")
    return tuple(notes)
