"""What bicycle tyres have: published bands that fitted, tabulated and formula values are held against.

A value outside its band is unusual and is said so, with the unit it may be in; it is refused only where it is so far
beyond that no tyre can have it (:mod:`tyre.base.plausible`). The bands reach well beyond what was published, for a fat,
cargo or hand-cycle tyre is no mistake. What was published: Dell'Orto et al., *Racing bicycle tyres: experimental indoor
evaluation of relaxation length*, tables 2 to 9 (26 and 28 mm, 340 to 490 N, 3.5 to 7.5 bar, also on a drum), and the
Schwalbe 28 x 1.75 of mechmotum/bicycle-kickplate-model, 3 to 5 bar; data/SOURCES.md says where they are kept.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.plausible import Doubt, doubt

GRAVITY = 9.80665
POUND = 0.45359237 * GRAVITY
"""N in a pound-force."""


@dataclass(frozen=True)
class Band:
    """A quantity of a tyre and the values that are usual.

    Attributes
    ----------
    words, unit : str
        Its name in messages and its SI unit.
    typical : tuple of float
        Lowest and highest usual value, in ``unit``.
    published : tuple of float
        Lowest and highest value of the sources above, in ``unit``.
    slips : tuple of (float, str)
        Units it may be in by mistake, beside those of :mod:`tyre.base.plausible`, each with the factor to ``unit``.
    """

    words: str
    unit: str
    typical: tuple[float, float]
    published: tuple[float, float]
    slips: tuple[tuple[float, str], ...] = ()


_FORCES = (
    (1 / GRAVITY, "load in kg"), (GRAVITY, "side force in kg"), (1e-3, "load in kN"), (1e3, "side force in kN"),
    (1 / POUND, "load in lbf"), (POUND, "side force in lbf"),
)  # fmt: skip
BANDS = MappingProxyType(
    {
        "cornering_stiffness_per_load": Band(
            "cornering stiffness over load", "1/rad", (4.0, 40.0), (10.2, 18.0), _FORCES
        ),
        "lateral_stiffness": Band(
            "lateral stiffness", "N/m", (8e3, 3e5), (31.6e3, 75.4e3),
            ((GRAVITY, "force in kg"), (POUND, "force in lbf"), (1e3, "N/mm or force in kN"), (1 / 25.4, "N/inch")),
        ),
        "relaxation_length": Band("relaxation length", "m", (0.015, 0.6), (0.061, 0.199)),
        "pneumatic_trail": Band("pneumatic trail", "m", (-0.02, 0.1), (0.012, 0.021)),
        "largest_force_per_load": Band(
            "largest side force over load", "N/N", (0.01, 1.8), (0.0, 1.2), _FORCES
        ),
    }
)  # fmt: skip
"""Bands by quantity; that of the side force is of sweeps whose slip reaches 1 to 15 degrees."""


def doubts(values: Mapping[str, float | None], *, at: str = "") -> tuple[Doubt, ...]:
    """What is unusual of the values of a tyre.

    Parameters
    ----------
    values : mapping of str to float or None
        By the name of a band, SI units; others, missing values (NaN, None) and infinity are passed over.
    at : str
        Where they hold, for the message: `` at 400 N``.
    """
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
    """What is unusual of the values of a tyre at many conditions: one note a quantity, the worst of it.

    Parameters
    ----------
    load : ndarray, shape (n,)
        N.
    values : mapping of str to ndarray, shape (n,)
        By the name of a field of :class:`tyre.properties.TyreProperties`, SI units.
    where : str
        File, for messages.
    places : sequence of str, shape (n,)
        Where in the file each condition stands, for messages.

    Raises
    ------
    InputError
        A value that no tyre can have.
    """
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
