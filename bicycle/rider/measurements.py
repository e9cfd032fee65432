"""A person's body as 95 lengths, perimeters, widths and depths (Yeadon 1990), from a file or scaled from another."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.resources.abc import Traversable
from pathlib import Path
from types import MappingProxyType

from tyre.base.errors import InputError, unknown
from tyre.base.key_value import read_key_values
from tyre.base.paths import data_root

ARM = ("2L", "3L", "4L", "5L", "6L", "7L", *(f"{n}p" for n in range(8)), "4w", "5w", "6w", "7w")
LEG = ("1L", "3L", "4L", "5L", "6L", "8L", "9L", *(f"{n}p" for n in range(1, 10)), "8w", "9w", "6d")
TRUNK_LENGTHS = tuple(f"Ls{n}L" for n in range(1, 9))
TRUNK_GIRTHS = ("Ls0p", "Ls1p", "Ls2p", "Ls3p", "Ls0w", "Ls1w", "Ls2w", "Ls3w", "Ls4w", "Ls4d")
HEAD_GIRTHS = ("Ls5p", "Ls6p", "Ls7p")
SIDES = (("La", "Lb", ARM), ("Lj", "Lk", LEG))
"""Left and right limb, with what is measured on both."""

KEYS = (
    *TRUNK_LENGTHS,
    *TRUNK_GIRTHS,
    *HEAD_GIRTHS,
    *(side + k for *pair, keys in SIDES for side in pair for k in keys),
)
"""The 95 measurements, named as in the Python package ``yeadon``: L length, p perimeter, w width, d depth."""


def _limb(sides: str, keys: tuple[str, ...], *, lengths: bool) -> tuple[str, ...]:
    return tuple(f"L{side}{key}" for side in sides for key in keys if key.endswith("L") is lengths)


GROUPS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "lengths of trunk and head": TRUNK_LENGTHS,
        "lengths of the arms": _limb("ab", ARM, lengths=True),
        "lengths of the legs": _limb("jk", LEG, lengths=True),
        "girth of the trunk": TRUNK_GIRTHS,
        "girth of neck and head": HEAD_GIRTHS,
        "girth of the arms": _limb("ab", ARM, lengths=False),
        "girth of the legs": _limb("jk", LEG, lengths=False),
    }
)
"""What is uncertain together: a tape held too tight or a joint centre felt too low shifts a group."""

MEASURED_SD = 0.02
"""Relative sd of a group of a measured rider: the median difference of left and right limbs of six measured people,
over the root of two, is 2 to 3 % for lengths and 2 % for perimeters."""

SCALED_SD = 0.05
"""Relative sd of a group of a scaled rider: six measured people scaled to one height and mass differ by an sd of
7 % (trunk), 2 % (legs), 4 % (arms) in length, and by 7 % in their moments of inertia in one posture."""

MASS_SD = 2.0
"""kg; clothes, helmet, shoes and the day."""

VOLUME_MASS_SD = 0.05
"""Relative sd of a mass that follows from volume and mean densities: 4, 7 and 0 % off for three people who were
weighed."""

PACKAGED = "moorepants/BicycleParameters, data/riders, BSD-2-Clause"
"""Where the packaged riders come from."""

REFERENCE = "jason"
"""The packaged rider whose shape :func:`scaled_rider` takes."""

CONVERSION, TOTAL = "measurementconversionfactor", "totalmass"
LOWEST, TALLEST = 0.5, 2.6  # m; outside, the unit of the lengths is wrong
SHORTEST = 1e-3  # m; no part of a body is thinner
LIGHTEST, HEAVIEST = 8.0, 300.0  # kg


@dataclass(frozen=True)
class RiderMeasurements:
    """A measured body.

    Attributes
    ----------
    name : str
    lengths : mapping
        Every key of :data:`KEYS`, m; the two sides are equal (averaged on reading).
    mass : float or None
        Total mass, kg; None: as volume and mean densities give it.
    relative_sd : float
        One sd of every group of :data:`GROUPS` over its value.
    mass_sd : float
        One sd of the mass, kg.
    source : str
        Where the body comes from, in words.
    notes : tuple of str
        What must be told of it.
    """

    name: str
    lengths: Mapping[str, float]
    mass: float | None
    relative_sd: float
    mass_sd: float
    source: str
    notes: tuple[str, ...] = ()

    @property
    def height(self) -> float:
        """Heels to top of head of the straight body, m: trunk, neck and head, leg."""
        m = self.lengths
        return m["Ls5L"] + m["Ls8L"] + m["Lj5L"] + m["Lj6L"]

    @property
    def leg(self) -> float:
        """Hip joint centre to heel, m."""
        return self.lengths["Lj5L"] + self.lengths["Lj6L"]

    def scaled(self, group: str, factor: float) -> "RiderMeasurements":
        """The same body with one ``group`` of :data:`GROUPS` multiplied by ``factor`` (no unit)."""
        changed = {key: self.lengths[key] * factor for key in GROUPS[group]}
        return replace(self, lengths=MappingProxyType({**self.lengths, **changed}))

    def weighing(self, mass: float) -> "RiderMeasurements":
        """The same body with another total ``mass`` (kg)."""
        return replace(self, mass=_mass("mass", mass))


def available_riders() -> tuple[str, ...]:
    """Names of the packaged measured riders."""
    return tuple(sorted(f.name.removesuffix(".txt") for f in _folder().iterdir() if f.name.endswith(".txt")))


def read_rider(name_or_path: str | Path) -> RiderMeasurements:
    """A packaged rider by name, or a measurement file of the package ``yeadon``: ``key : value`` a line.

    Besides the 95 lengths the file holds ``measurementconversionfactor`` (metres per unit) and, if known, ``totalmass``
    (kg). What follows # is not read. Left and right are averaged.

    Parameters
    ----------
    name_or_path : str or Path

    Raises
    ------
    InputError
        No such rider or file, an unknown, missing or repeated key, a value that is no positive number, lengths whose
        unit cannot be right, or a perimeter that does not go with its width.
    """
    path: Traversable | Path = Path(name_or_path)
    packaged = str(name_or_path) in available_riders()
    if packaged:
        path = _folder().joinpath(f"{name_or_path}.txt")
    elif not path.is_file():
        if Path(name_or_path).suffix:
            raise InputError(f"{name_or_path}: no such rider file; packaged riders: {', '.join(available_riders())}")
        raise InputError(f"{unknown('rider', name_or_path, available_riders())}; or give a measurement file")
    numbers, _ = read_key_values(path, (*KEYS, CONVERSION, TOTAL), kind="measurement")
    unit = numbers.pop(CONVERSION, None)
    if unit is None or unit <= 0:
        raise InputError(f"{path}: {CONVERSION} is missing or not positive; give metres per unit, 0.01 for cm")
    mass = numbers.pop(TOTAL, None)
    missing = [key for key in KEYS if key not in numbers]
    if missing:
        raise InputError(
            f"{path}: {len(missing)} of {len(KEYS)} measurements missing: {', '.join(missing[:8])}"
            + (", ..." if len(missing) > 8 else "")
        )
    for key, value in numbers.items():
        if value <= 0:
            raise InputError(f"{path}: {key} = {value:g} must be a positive length")
    lengths = {key: numbers[key] * unit for key in KEYS}
    notes = []
    if mass is None or mass <= 0:
        mass = None
        notes.append("was not weighed: the mass follows from volume and mean densities (give --mass if known)")
    else:
        _mass(f"{path}: {TOTAL}", mass)
    rider = RiderMeasurements(
        path.name.removesuffix(".txt"), _symmetric(lengths), mass, MEASURED_SD, MASS_SD,
        f"measured ({PACKAGED})" if packaged else f"measured, file {path.name}", tuple(notes),
    )  # fmt: skip
    if not LOWEST < rider.height < TALLEST:
        raise InputError(
            f"{path}: heels to top of head would be {rider.height:.3g} m, allowed {LOWEST:g} to {TALLEST:g}; "
            f"is {CONVERSION} = {unit:g} right (metres per unit, 0.01 for cm)?"
        )
    for key, value in numbers.items():
        if value * unit < SHORTEST:
            raise InputError(f"{path}: {key} = {value:g} is {value * unit:.3g} m; give {SHORTEST:g} m or more")
    _check_sections(path, rider.lengths)
    return rider


def scaled_rider(*, height: float, mass: float) -> RiderMeasurements:
    """A body of given ``height`` (m) and ``mass`` (kg): lengths of a measured rider scaled by height, girths by volume.

    Perimeters, widths and depths take the factor sqrt(mass ratio / height ratio), so that the density stays.
    """
    if not math.isfinite(height) or not LOWEST < height < TALLEST:
        raise InputError(f"height = {height:g} must lie between {LOWEST:g} and {TALLEST:g} m (metres, not centimetres)")
    _mass("mass", mass)
    rider = read_rider(REFERENCE)
    assert rider.mass is not None
    tall = height / rider.height
    thick = math.sqrt(mass / rider.mass / tall)
    for group in GROUPS:
        rider = rider.scaled(group, tall if group.startswith("lengths") else thick)
    return replace(
        rider, name=f"scaled_{height:g}m_{mass:g}kg", mass=float(mass), relative_sd=SCALED_SD,
        source=f"scaled from the measured rider {REFERENCE} by height and mass, not measured",
        notes=("is scaled from another person's measurements by height and mass",),
    )  # fmt: skip


def _folder() -> Traversable:
    return data_root().joinpath("riders")


def _mass(where: str, mass: float) -> float:
    if not math.isfinite(mass) or not LIGHTEST <= mass <= HEAVIEST:
        raise InputError(f"{where} = {mass:g} must lie between {LIGHTEST:g} and {HEAVIEST:g} kg")
    return float(mass)


def _symmetric(lengths: Mapping[str, float]) -> Mapping[str, float]:
    averaged = dict(lengths)
    for left, right, keys in SIDES:
        for key in keys:
            averaged[left + key] = averaged[right + key] = (lengths[left + key] + lengths[right + key]) / 2
    return MappingProxyType(averaged)


def _check_sections(path: object, m: Mapping[str, float]) -> None:
    """A section is a stadium: its perimeter lies between twice (flat) and pi times (round) its longer side."""
    for key, width in m.items():
        perimeter = m.get(f"{key[:-1]}p")
        if key[-1] in "wd" and perimeter is not None and not 2 * width < perimeter <= math.pi * width:
            raise InputError(
                f"{path}: perimeter {key[:-1]}p and {'width' if key[-1] == 'w' else 'depth'} {key} have the ratio "
                f"{perimeter / width:.3f} (left and right averaged); it must lie between 2 (flat) and 3.14 (round)"
            )
    if m["Ls4d"] >= m["Ls4w"]:
        raise InputError(f"{path}: depth Ls4d must be smaller than width Ls4w")
