"""A human body as rigid solids, from measurements (Yeadon 1990)."""

import contextlib
import io
import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib.resources.abc import Traversable
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any

import numpy as np

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, unknown
from tyre.ground.files import data_root
from tyre.ground.number_with_sd import read_key_values
from tyre.ground.progress import missing_package_text


@dataclass(frozen=True)
class RigidBody:
    """Mass (kg), mass centre (3,) in m and inertia tensor (3, 3) about it in kg m^2; x forward, y right, z down.

    Off-diagonal entries are tensor entries, Ixz = -sum m x z, as Meijaard et al. (2007) tabulate them.
    """

    mass: float  # kg
    centre: Array  # (3,), m
    inertia: Array  # (3, 3), kg m^2, about the centre


def join(bodies: Sequence[RigidBody]) -> RigidBody:
    """One rigid body of several ``bodies``."""
    mass = sum(body.mass for body in bodies)
    centre = sum((body.mass * body.centre for body in bodies), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for body in bodies:
        arm = body.centre - centre
        inertia += body.inertia + body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return RigidBody(mass, centre, inertia)


def rear_frame(p: Mapping[str, float], part: str = "B") -> RigidBody:
    """The rear frame of a parameter set ``p`` (SI), or the front one, ``part`` H; IByy is NaN where it is not known."""
    xx, yy, zz, xz = (p.get(f"I{part}{axes}", np.nan) for axes in ("xx", "yy", "zz", "xz"))
    centre = np.array([p[f"x{part}"], 0.0, p[f"z{part}"]])
    return RigidBody(p[f"m{part}"], centre, np.array([[xx, 0, xz], [0, yy, 0], [xz, 0, zz]]))


def as_rear_frame(body: RigidBody, part: str = "B") -> dict[str, float]:
    """Meijaard's keys (SI) of a ``body`` symmetric to the plane y = 0 as this ``part``; without IByy where unknown."""
    x, _, z = body.centre
    values = {f"x{part}": x, f"z{part}": z, f"m{part}": body.mass}
    values |= {f"I{part}{'xyz'[i]}{'xyz'[j]}": body.inertia[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 2))}
    return {key: float(value) for key, value in values.items() if not np.isnan(value)}


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
POINTS, WEIGHTS = (_NODES + 1) / 2, _WEIGHTS / 2
"""Places from 0 to 1 along the axis, and their weights."""


ARM = ("2L", "3L", "4L", "5L", "6L", "7L", *(f"{n}p" for n in range(8)), "4w", "5w", "6w", "7w")
LEG = ("1L", "3L", "4L", "5L", "6L", "8L", "9L", *(f"{n}p" for n in range(1, 10)), "8w", "9w", "6d")
TRUNK_LENGTHS = tuple(f"Ls{n}L" for n in range(1, 9))
TRUNK_GIRTHS = ("Ls0p", "Ls1p", "Ls2p", "Ls3p", "Ls0w", "Ls1w", "Ls2w", "Ls3w", "Ls4w", "Ls4d")
HEAD_GIRTHS = ("Ls5p", "Ls6p", "Ls7p")
SIDES = (("La", "Lb", ARM), ("Lj", "Lk", LEG))  # left and right limb, with what is measured on both

KEYS = (
    *TRUNK_LENGTHS,
    *TRUNK_GIRTHS,
    *HEAD_GIRTHS,
    *(side + k for *pair, keys in SIDES for side in pair for k in keys),
)
"""The 95 measurements, named as in the Python package ``yeadon``: L length, p perimeter, w width, d depth."""


GROUPS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "lengths of trunk and head": TRUNK_LENGTHS,
        "girth of the trunk": TRUNK_GIRTHS,
        "girth of neck and head": HEAD_GIRTHS,
    }
    | {
        f"{what} of the {limb}": tuple(
            side + k for side in pair for k in keys if k.endswith("L") is (what == "lengths")
        )
        for what in ("lengths", "girth")
        for limb, (*pair, keys) in zip(("arms", "legs"), SIDES, strict=True)
    }
)
"""Measurements that are uncertain together: a tape held too tight or a joint centre felt too low shifts a group."""


@dataclass(frozen=True)
class Limits:
    """Standard deviations of a rider, and sizes beyond which a unit is wrong."""

    # relative, of a group: the median difference of left and right limbs of six measured people, over the root of two,
    # is 2 to 3 % for lengths and 2 % for perimeters
    measured_sd: float = 0.02
    # relative: six measured people scaled to one height and mass differ by an sd of 7 % (trunk), 2 % (legs), 4 % (arms)
    # in length, and by 7 % in their moments of inertia in one posture
    scaled_sd: float = 0.05
    mass_sd: float = 2.0  # kg; clothes, helmet, shoes and the day
    volume_mass_sd: float = 0.05  # relative, of volume and mean densities: 4, 7 and 0 % off for three weighed people
    height: tuple[float, float] = (0.5, 2.6)  # m
    shortest: float = 1e-3  # m; no part of a body is thinner
    mass: tuple[float, float] = (8.0, 300.0)  # kg


LIMITS = Limits()
REFERENCE = "jason"  # the packaged rider whose shape :func:`scaled_rider` takes


CONVERSION, TOTAL = "measurementconversionfactor", "totalmass"  # keys of a measurement file


@dataclass(frozen=True)
class RiderMeasurements:
    """A measured body."""

    name: str  # packaged rider, file without its ending, or scaled_HEIGHTm_MASSkg
    lengths: Mapping[str, float]  # every key of :data:`KEYS`, m; the two sides are equal (averaged on reading)
    mass: float | None  # total mass, kg; None: as volume and mean densities give it
    relative_sd: float  # one sd of every group of :data:`GROUPS` over its value
    mass_sd: float  # one sd of the mass, kg
    source: str  # where the body comes from, in words
    notes: tuple[str, ...] = ()  # what must be told of it

    @property
    def height(self) -> float:
        """Heels to top of head of the straight body, m: trunk, neck and head, leg."""
        return self.lengths["Ls5L"] + self.lengths["Ls8L"] + self.leg

    @property
    def leg(self) -> float:
        """Hip joint centre to heel, m."""
        return self.lengths["Lj5L"] + self.lengths["Lj6L"]

    def scaled(self, group: str, factor: float) -> "RiderMeasurements":
        """A body with one ``group`` of :data:`GROUPS` multiplied by ``factor`` (no unit)."""
        changed = {key: self.lengths[key] * factor for key in GROUPS[group]}
        return replace(self, lengths=MappingProxyType({**self.lengths, **changed}))

    def weighing(self, mass: float) -> "RiderMeasurements":
        """A body of this shape with another total ``mass`` (kg)."""
        return replace(self, mass=_mass("mass", mass))


def available_riders() -> tuple[str, ...]:
    """Names of the packaged measured riders."""
    return tuple(sorted(f.name.removesuffix(".txt") for f in _folder().iterdir() if f.name.endswith(".txt")))


def read_rider(name_or_path: str | Path) -> RiderMeasurements:
    """A packaged rider by name, or a measurement file of the package ``yeadon``: ``key : value`` a line."""
    path: Traversable | Path = Path(name_or_path)
    packaged = str(name_or_path) in available_riders()
    if packaged:
        path = _folder().joinpath(f"{name_or_path}.txt")
    elif not path.is_file():
        if Path(name_or_path).suffix:
            raise InputError(f"{name_or_path}: no such rider file; packaged riders: {', '.join(available_riders())}")
        raise InputError(f"{unknown('rider', name_or_path, available_riders())}; or give a measurement file")
    numbers, _ = read_key_values(path, (*KEYS, CONVERSION, TOTAL), kind="measurement")
    unit, mass = numbers.pop(CONVERSION, None), numbers.pop(TOTAL, None)
    if unit is None or unit <= 0:
        raise InputError(f"{path}: {CONVERSION} is missing or not positive; give metres per unit, 0.01 for cm")
    missing = [key for key in KEYS if key not in numbers]
    if missing:
        some = ", ".join(missing[:8]) + (", ..." if len(missing) > 8 else "")
        raise InputError(f"{path}: {len(missing)} of {len(KEYS)} measurements missing: {some}")
    for key, value in numbers.items():
        if value <= 0:
            raise InputError(f"{path}: {key} = {value:g} must be a positive length")
    lengths = {key: numbers[key] * unit for key in KEYS}
    for left, right, keys in SIDES:
        for key in keys:
            lengths[left + key] = lengths[right + key] = (lengths[left + key] + lengths[right + key]) / 2
    notes: tuple[str, ...] = ()
    if mass is None or mass <= 0:
        mass = None
        notes = ("was not weighed: the mass follows from volume and mean densities (give --mass if known)",)
    else:
        _mass(f"{path}: {TOTAL}", mass)
    source = "measured (moorepants/BicycleParameters, data/riders, BSD-2-Clause)"
    rider = RiderMeasurements(
        path.name.removesuffix(".txt"),
        MappingProxyType(lengths),
        mass,
        LIMITS.measured_sd,
        LIMITS.mass_sd,
        source if packaged else f"measured, file {path.name}",
        notes,
    )
    lowest, tallest = LIMITS.height
    if not lowest < rider.height < tallest:
        raise InputError(
            f"{path}: heels to top of head would be {rider.height:.3g} m, allowed {lowest:g} to {tallest:g}; "
            f"is {CONVERSION} = {unit:g} right (metres per unit, 0.01 for cm)?"
        )
    for key, value in numbers.items():
        if value * unit < LIMITS.shortest:
            raise InputError(f"{path}: {key} = {value:g} is {value * unit:.3g} m; give {LIMITS.shortest:g} m or more")
    _check_sections(path, rider.lengths)
    return rider


def scaled_rider(*, height: float, mass: float) -> RiderMeasurements:
    """A body of given ``height`` (m) and ``mass`` (kg): lengths of a measured rider scaled, girths by volume."""
    lowest, tallest = LIMITS.height
    if not lowest < height < tallest:
        raise InputError(f"height = {height:g} must lie between {lowest:g} and {tallest:g} m (metres, not centimetres)")
    _mass("mass", mass)
    rider = read_rider(REFERENCE)
    assert rider.mass is not None
    tall = height / rider.height
    thick = math.sqrt(mass / rider.mass / tall)
    for group in GROUPS:
        rider = rider.scaled(group, tall if group.startswith("lengths") else thick)
    return replace(
        rider,
        name=f"scaled_{height:g}m_{mass:g}kg",
        mass=float(mass),
        relative_sd=LIMITS.scaled_sd,
        source=f"scaled from the measured rider {REFERENCE} by height and mass, not measured",
        notes=("is scaled from another person's measurements by height and mass",),
    )


def _folder() -> Traversable:
    return data_root().joinpath("riders")


def _mass(where: str, mass: float) -> float:
    lightest, heaviest = LIMITS.mass
    if not lightest <= mass <= heaviest:
        raise InputError(f"{where} = {mass:g} must lie between {lightest:g} and {heaviest:g} kg")
    return float(mass)


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


DENSITY_SETS = ("Dempster", "Chandler", "Clauser")
"""Densities of the segments from three sources (Yeadon 1990); the first is used, the spread is an uncertainty."""

TO_BICYCLE = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Axes of ``yeadon`` (x left, y back, z up) to x forward, y right, z down, and back."""


@dataclass(frozen=True)
class Segment:
    """A rigid part of the body on the bicycle, and sections along it for a drawing."""

    name: str  # as ``yeadon`` calls it, such as Right upper arm
    body: RigidBody  # mass, mass centre and inertia on the bicycle
    sections: Array  # (k, 3), m: centres of both ends of each solid
    wide: Array  # (k, 3), m: from a centre half the width of its section sideways
    deep: Array  # (k, 3), m: from a centre half the depth of its section


@lru_cache(maxsize=8)
def _human(yeadon: ModuleType, lengths: tuple[tuple[str, float], ...], densities: str) -> Any:
    """A body of ``yeadon``, whose shape most of what a posture is asked for leaves as it is."""
    return yeadon.Human(dict(lengths), density_set=densities)


def segments(
    rider: RiderMeasurements, configuration: Mapping[str, float], hip: Array, *, densities: str = DENSITY_SETS[0]
) -> tuple[Segment, ...]:
    """The eleven segments of a rider with joint angles (rad) and the hip joint centre at (x, z) on the bicycle."""
    with quiet_yeadon():
        human = _human(yeadon_module(), tuple(rider.lengths.items()), densities)
        human.set_CFG_dict(dict(configuration))
    factor = 1.0 if rider.mass is None else rider.mass / sum(s.mass for s in human.segments)
    origin = np.array([hip[0], 0.0, hip[1]])
    parts = []
    for part in human.segments:
        turn = TO_BICYCLE @ np.asarray(part.rot_mat, dtype=float)
        bodies, sections, half = [], [], []
        for solid in part.solids:
            start, end = (origin + TO_BICYCLE @ np.ravel(place) for place in (solid.pos, solid.end_pos))
            body, widths = _solid(solid, factor, start, end, turn)
            bodies.append(body)
            sections += [start, end]
            half += widths
        wide, deep = (np.array([size[k] * turn[:, k] for size in half]) for k in (0, 1))
        name = str(part.label).partition(": ")[2]
        parts.append(Segment(name, join(bodies), np.array(sections), wide, deep))
    return tuple(parts)


def _solid(
    solid: Any, factor: float, start: Array, end: Array, turn: Array
) -> tuple[RigidBody, list[tuple[float, float]]]:
    """A solid on the bicycle, its density times ``factor``, and half width and half depth at both ends.

    It is a stack of slices at :data:`POINTS`: stadia with half lengths t and radii r, or the half ellipsoid of
    revolution of a head (t = 0).
    """
    if hasattr(solid, "stads"):
        sizes = [(float(stadium.thickness), float(stadium.radius)) for stadium in solid.stads]
        t, r = (first + POINTS * (last - first) for first, last in zip(*sizes, strict=True))
        halves = [(first + second, second) for first, second in sizes]
    else:
        radius = float(solid.radius)
        t, r = np.zeros_like(POINTS), radius * np.sqrt(1 - POINTS**2)
        halves = [(radius, radius), (0.0, 0.0)]
    area = 4 * r * t + math.pi * r**2
    spread_y = 4 * t * r**3 / 3 + math.pi * r**4 / 4
    spread_x = 4 * r * t**3 / 3 + math.pi * r**2 * t**2 + 8 * r**3 * t / 3 + math.pi * r**4 / 4
    if getattr(solid, "alignment", "") == "AP":  # the long side lies forward
        spread_x, spread_y, halves = spread_y, spread_x, [half[::-1] for half in halves]
    height = float(np.linalg.norm(end - start))
    weight = factor * float(solid.density) * height * WEIGHTS
    mass = float(weight @ area)
    middle = float(weight @ (area * POINTS)) / mass
    xx, yy = float(weight @ spread_x), float(weight @ spread_y)
    zz = height**2 * float(weight @ (area * (POINTS - middle) ** 2))
    local = np.diag([yy + zz, xx + zz, xx + yy])
    return RigidBody(mass, start + middle * (end - start), turn @ local @ turn.T), halves


def yeadon_version() -> str:
    """Version of the installed ``yeadon``."""
    return str(yeadon_module().__version__)


def yeadon_module() -> ModuleType:
    try:
        with quiet_yeadon():
            import yeadon
    except ImportError as error:
        raise InputError(f"a rider's body needs yeadon: {missing_package_text('yeadon', extra='rider')}") from error
    return yeadon


@contextlib.contextmanager
def quiet_yeadon() -> Iterator[None]:
    """Keep what ``yeadon`` prints and warns from the user; what matters is checked on reading."""
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
