"""The bicycle as data: Meijaard's parameter set, checked once, with static wheel loads."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from bicycle.chain import Body, Joint, mass_matrix
from tyre.errors import InputError, is_number, shown, unknown

UNITS: Mapping[str, str] = MappingProxyType(
    {
        "w": "m", "c": "m", "lam": "rad", "g": "m/s^2",
        "rR": "m", "mR": "kg", "IRxx": "kg m^2", "IRyy": "kg m^2",
        "xB": "m", "zB": "m", "mB": "kg", "IBxx": "kg m^2", "IBzz": "kg m^2", "IBxz": "kg m^2",
        "xH": "m", "zH": "m", "mH": "kg", "IHxx": "kg m^2", "IHzz": "kg m^2", "IHxz": "kg m^2",
        "rF": "m", "mF": "kg", "IFxx": "kg m^2", "IFyy": "kg m^2",
    }
)  # fmt: skip
"""Keys and units of the parameters that enter the lateral motion (lam is the steer axis tilt)."""

UNUSED = ("IByy", "IHyy")
"""Keys of the published sets that do not enter the lateral motion; accepted and kept."""


@dataclass(frozen=True)
class Bicycle:
    """A bicycle in the parameters of Meijaard et al. (2007), table 1, SI units.

    Attributes
    ----------
    name : str
        Name used in figures and reports.
    values : mapping
        Every key of :data:`UNITS`; ``IByy`` and ``IHyy`` may be present and are not used.
    sd : mapping
        One standard deviation of the keys whose uncertainty is known.
    description, source : str
        What it is and where the numbers come from.
    notes : tuple of str
        What was left out on reading, shown with the warnings.

    Raises
    ------
    InputError
        A key is missing or unknown, a value is not a finite number, or the set is not a physical bicycle.
    """

    name: str
    values: Mapping[str, float]
    sd: Mapping[str, float] = field(default_factory=dict)
    description: str = ""
    source: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", MappingProxyType(_checked(self.name, self.values, complete=True)))
        object.__setattr__(self, "sd", MappingProxyType(_checked(self.name, self.sd, complete=False)))
        _check_physics(self)

    def __getitem__(self, key: str) -> float:
        return self.values[key]

    def __reduce__(self) -> tuple[object, ...]:  # a mapping proxy does not pickle
        return type(self), (self.name, dict(self.values), dict(self.sd), self.description, self.source, self.notes)

    @property
    def static_loads(self) -> tuple[float, float]:
        """Vertical load (N) of the rear and front wheel at rest on level ground."""
        rear, front = static_loads(bodies(self.values), self["w"], self["g"])
        return float(rear), float(front)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is odd but computable: a violated triangle inequality, a massless wheel with spin inertia."""
        return (*self.notes, *_oddities(self))

    def replace(self, **changes: float) -> "Bicycle":
        """The same bicycle with some parameters changed."""
        return Bicycle(self.name, {**self.values, **changes}, self.sd, self.description, self.source, self.notes)


def bodies(p: Mapping[str, float]) -> tuple[Body, Body, Body, Body]:
    """Rear frame, rear wheel, front frame and front wheel of a parameter set (floats or symbols)."""
    return (
        Body("rear frame", p["mB"], p["xB"], p["zB"], p["IBxx"], p["IBzz"], p["IBxz"]),
        Body("rear wheel", p["mR"], 0, -p["rR"], p["IRxx"], p["IRxx"], 0, p["IRyy"], p["rR"]),
        Body("front frame", p["mH"], p["xH"], p["zH"], p["IHxx"], p["IHzz"], p["IHxz"]),
        Body("front wheel", p["mF"], p["w"], -p["rF"], p["IFxx"], p["IFxx"], 0, p["IFyy"], p["rF"]),
    )


def static_loads(parts: tuple[Body, ...], wheelbase: float, gravity: float) -> tuple[float, float]:
    """Static vertical load of the rear and front contact, from the moments about the rear contact."""
    front = gravity * sum(body.mass * body.x for body in parts) / wheelbase
    return gravity * sum(body.mass for body in parts) - front, front


def _checked(name: str, given: Mapping[str, float], *, complete: bool) -> dict[str, float]:
    for key in given:
        if key not in UNITS and key not in UNUSED:
            raise InputError(f"bicycle {name!r}: {unknown('key', key, [*UNITS, *UNUSED])}")
    missing = [key for key in UNITS if key not in given]
    if complete and missing:
        raise InputError(
            f"bicycle {name!r}: missing {', '.join(missing)}; give every parameter of Meijaard et al. (2007), table 1"
        )
    values = {}
    for key, value in given.items():
        if not is_number(value) or not math.isfinite(value):
            raise InputError(f"bicycle {name!r}: {key} = {shown(value)} must be a finite number in SI units")
        if not complete and value < 0:
            raise InputError(f"bicycle {name!r}: the standard deviation of {key} is {value!r}; it must be >= 0")
        values[key] = float(value)
    return values


def _check_physics(bicycle: Bicycle) -> None:
    p, where = bicycle.values, f"bicycle {bicycle.name!r}"
    for key in ("mB", "mR", "mH", "mF", "IRyy", "IFyy"):
        if p[key] < 0:
            raise InputError(f"{where}: {key} = {p[key]:g} {UNITS[key]} must not be negative")
    total = p["mB"] + p["mR"] + p["mH"] + p["mF"]
    if total <= 0:
        raise InputError(f"{where}: total mass is {total:g} kg (mB + mR + mH + mF); it must be positive")
    for key in ("w", "rR", "rF", "g"):
        if p[key] <= 0:
            raise InputError(f"{where}: {key} = {p[key]:g} {UNITS[key]} must be positive")
    if not -math.pi / 2 < p["lam"] < math.pi / 2:
        raise InputError(
            f"{where}: lam = {p['lam']:g} rad is out of range; the steer axis tilt must lie between -pi/2 and pi/2 "
            "(degrees must be converted to radians)"
        )
    for part, xx, zz, xz in (("rear frame", "IBxx", "IBzz", "IBxz"), ("front frame", "IHxx", "IHzz", "IHxz")):
        smallest = np.linalg.eigvalsh([[p[xx], p[xz]], [p[xz], p[zz]]])[0]
        if smallest < 0:
            raise InputError(
                f"{where}: the {part} has a negative principal inertia {smallest:.4g} kg m^2 in the x-z plane; "
                f"need {xx} >= 0, {zz} >= 0 and {xx} {zz} >= {xz}^2"
            )
    for key in ("IRxx", "IFxx"):
        if p[key] < 0:
            raise InputError(f"{where}: {key} = {p[key]:g} kg m^2 must not be negative")
    for wheel, load in zip(("rear", "front"), bicycle.static_loads, strict=True):
        if load <= 0:
            raise InputError(
                f"{where}: the static load of the {wheel} wheel is {load:.4g} N; it must be positive, "
                "so move the mass centre between the wheels (xB, xH) or check the wheelbase w"
            )
    parts = bodies(p)
    names = frozenset(body.name for body in parts)
    lean = Joint("lean", 1.0, 0.0, 0.0, 0.0, names)
    steer = Joint(
        "steer", math.sin(p["lam"]), math.cos(p["lam"]), p["w"] + p["c"], 0.0, frozenset(("front frame", "front wheel"))
    )
    smallest = np.linalg.eigvalsh(mass_matrix(parts, (lean, steer)).astype(float))[0]
    if smallest <= 0:
        raise InputError(
            f"{where}: the 4x4 mass matrix of lateral motion, yaw, lean and steer is not positive definite "
            f"(smallest eigenvalue {smallest:.4g}); a mass or moment of inertia is missing or has the wrong sign"
        )


def _oddities(bicycle: Bicycle) -> list[str]:
    p, found = bicycle.values, []
    for part, xx, yy, zz, xz in (
        ("rear frame", "IBxx", "IByy", "IBzz", "IBxz"),
        ("front frame", "IHxx", "IHyy", "IHzz", "IHxz"),
    ):
        if yy not in p:
            continue
        low, high = np.linalg.eigvalsh([[p[xx], p[xz]], [p[xz], p[zz]]])
        a, b, c = sorted((low, high, p[yy]))
        if c > (a + b) * (1 + 1e-9):
            found.append(
                f"the principal inertias of the {part} ({low:.4g}, {p[yy]:.4g}, {high:.4g} kg m^2) violate the "
                "triangle inequality: no rigid body has them (measurement error?)"
            )
    for part, key, mass in (("rear frame", "zB", "mB"), ("front frame", "zH", "mH")):
        if p[key] > 0 and p[mass] > 0:
            found.append(
                f"the mass centre of the {part} lies below the ground ({key} = {p[key]:g} m): z points down, so "
                "heights are negative (wrong sign?)"
            )
    for wheel, xx, yy, mass in (("rear", "IRxx", "IRyy", "mR"), ("front", "IFxx", "IFyy", "mF")):
        if p[mass] == 0 and p[yy] > 0:
            found.append(
                f"the {wheel} wheel has spin inertia {yy} = {p[yy]:g} kg m^2 but no mass "
                "(its mass is taken to be part of the frame)"
            )
        elif p[yy] > 2 * p[xx] * (1 + 1e-9):
            found.append(
                f"the {wheel} wheel violates the triangle inequality: {yy} = {p[yy]:g} > 2 {xx} = {2 * p[xx]:g}"
            )
    return found
