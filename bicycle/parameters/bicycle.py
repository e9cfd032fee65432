"""The bicycle as data: Meijaard's parameter set, checked once, with static wheel loads."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from bicycle.parameters.parameter_covariance import ParameterCovariance
from bicycle.parameters.rigid_bodies import Body, Joint, mass_matrix
from tyre.ground.errors import InputError, is_number, refuse_unknown, shown
from tyre.measured.plausible import LARGEST, Doubt, doubt

LIGHTEST_RIDDEN = 30.0  # kg of a rear frame that may hold a rider

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

TYPICAL: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "w": (0.6, 2.2), "c": (-0.05, 0.2), "lam": (0.0, 0.6), "g": (9.76, 9.84),
        "rR": (0.12, 0.48), "mR": (0.4, 9.0), "IRxx": (0.003, 0.3), "IRyy": (0.006, 0.6),
        "xB": (0.0, 1.3), "zB": (-1.5, -0.2), "mB": (2.0, 300.0),
        "IBxx": (0.03, 40.0), "IBzz": (0.02, 60.0), "IBxz": (-10.0, 10.0),
        "xH": (0.4, 2.1), "zH": (-1.3, -0.3), "mH": (0.5, 20.0),
        "IHxx": (0.005, 2.0), "IHzz": (0.001, 1.0), "IHxz": (-0.5, 0.5),
        "rF": (0.12, 0.48), "mF": (0.4, 6.0), "IFxx": (0.003, 0.3), "IFyy": (0.006, 0.6),
    }
)  # fmt: skip
"""Where the values of real bicycles lie: the packaged sets, measured with and without rider, with room for a child's
12-inch bicycle at the one end, a tandem or loaded cargo bicycle of 300 kg and 36-inch wheels at the other; gravity on
the Earth's surface (Hirt et al. 2013, Geophys. Res. Lett. 40: 9.764 to 9.834 m/s^2)."""

KINDS: Mapping[str, tuple[Mapping[str, tuple[float, float]], float]] = MappingProxyType(
    {
        "bicycle": (TYPICAL, 1.0),
        "motorcycle": (
            {
                **TYPICAL,
                "w": (1.1, 1.8), "lam": (0.3, 0.7), "rR": (0.2, 0.4), "mR": (5.0, 40.0), "IRxx": (0.1, 1.0),
                "IRyy": (0.2, 2.0), "mB": (80.0, 500.0), "IBxx": (3.0, 80.0), "IBzz": (3.0, 100.0),
                "IBxz": (-20.0, 20.0), "xH": (0.9, 1.8), "mH": (8.0, 60.0), "IHxx": (0.3, 8.0), "IHzz": (0.1, 5.0),
                "IHxz": (-3.0, 3.0), "rF": (0.2, 0.4), "mF": (5.0, 30.0), "IFxx": (0.1, 1.0), "IFyy": (0.2, 2.0),
            },
            20.0,
        ),
    }
)  # fmt: skip
"""Kind of vehicle -> :data:`TYPICAL` of it, and how far above a bicycle's its effects may reach: frames and tyres of
motorcycles are up to twenty times as stiff (sets of Sharp 1971, 1994 and Sharp, Evangelou & Limebeer 2004)."""


def of_kind(kind: str) -> tuple[Mapping[str, tuple[float, float]], float]:
    """Typical ranges (SI) of a ``kind``, and how many times those of a bicycle's effects; another is refused."""
    refuse_unknown("kind of vehicle", [kind], KINDS)
    return KINDS[kind]


POSITIVE = ("w", "rR", "rF", "g")
BOUNDS: Mapping[str, tuple[float, float]] = MappingProxyType(
    dict.fromkeys(UNITS, (-math.inf, math.inf))
    | {key: (0.0, math.inf) for key in UNITS if key in POSITIVE or key[0] == "m" or key[2:] in ("xx", "yy", "zz")}
    | {"lam": (-math.pi / 2, math.pi / 2)}
)
"""Physically possible values of each key by itself; what is not bounded has either sign."""

UNUSED = ("IByy", "IHyy")
"""Keys of the published sets that do not enter the lateral motion; accepted and kept."""

Z_UP = "z_up"
"""Key of a file whose z axis points up: true turns the signs of :data:`ODD_IN_Z`."""
ODD_IN_Z = ("zB", "zH", "IBxz", "IHxz")
"""Parameters that change their sign when z is turned, with y so that the axes stay right-handed."""

ALIASES: Mapping[str, str] = MappingProxyType(
    {"wheelbase": "w", "trail": "c", "steer_axis_tilt": "lam", "lambda": "lam"}
)
"""Everyday names of parameters, allowed wherever their keys are."""

HEAD_ANGLE = "head_angle"
"""Everyday number in place of lam: degrees from the horizontal, allowed where numbers are given, not where they run."""


def canonical(key: str) -> str:
    """The key of a parameter that may be called by its everyday name."""
    if key == HEAD_ANGLE:
        raise InputError(
            "head_angle stands for steer_axis_tilt (lam, rad) only where a number is given; here give steer_axis_tilt, "
            "(90 - head_angle) pi / 180"
        )
    return ALIASES.get(key, key)


def by_key(named_values: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers or arrays by key (lam in rad), some of them named in everyday words (head_angle in degrees)."""
    values: dict[str, Any] = {}
    for name, value in named_values.items():
        key = "lam" if name == HEAD_ANGLE else canonical(name)
        if key in values or (key != name and key in named_values):
            raise InputError(f"{name} is {key}, which is given, too; keep one")
        values[key] = np.radians(90 - np.asarray(value, float)) if name == HEAD_ANGLE else value
    return values


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
    covariance : ParameterCovariance
        Joint covariance of parameters that were not measured one by one; ``sd`` holds their standard deviations too.
    unusual : bool
        Values far from those of other bicycles are meant: no warning.
    kind : str
        ``bicycle`` or ``motorcycle``: what its values, and those of its effects, are compared with.
    without_slip : tuple of str
        Reasons why only wheels that cannot slip hold it, as a skate without load behind; empty for most.

    Raises
    ------
    InputError
        A key is missing or unknown, a value is not a finite number, or the set is not a physical bicycle.
    """

    name: str
    values: Mapping[str, float]
    sd: Mapping[str, float] = field(default_factory=dict)
    description: str = field(default="", compare=False)
    source: str = field(default="", compare=False)
    notes: tuple[str, ...] = field(default=(), compare=False)
    covariance: ParameterCovariance = field(default_factory=ParameterCovariance)
    unusual: bool = field(default=False, compare=False)
    kind: str = field(default="bicycle", compare=False)
    without_slip: tuple[str, ...] = field(init=False, compare=False)

    def __post_init__(self) -> None:
        of_kind(self.kind)
        object.__setattr__(self, "values", MappingProxyType(_check_numbers(self.name, self.values, complete=True)))
        object.__setattr__(
            self, "sd", MappingProxyType(_check_numbers(self.name, {**self.sd, **self.covariance.sd}, complete=False))
        )
        object.__setattr__(self, "without_slip", _check_physics(self))

    def __hash__(self) -> int:  # a mapping does not hash
        return hash((self.name, self.covariance, *(frozenset(of.items()) for of in (self.values, self.sd))))

    def __repr__(self) -> str:
        mass = sum(self[key] for key in ("mR", "mB", "mH", "mF"))
        rear, front = self.static_loads
        sd_note = f", sd of {len(self.sd)} parameters" if self.sd else ""
        return (
            f"<Bicycle {self.name!r}: {self.description or 'no description'}\n"
            f" {mass:.4g} kg, wheelbase {self['w']:.4g} m, trail {self['c']:.4g} m, steer axis tilt "
            f"{math.degrees(self['lam']):.3g}°, wheel loads {rear:.4g} N rear, {front:.4g} N front{sd_note}>"
        )

    def __getitem__(self, key: str) -> float:
        return self.values[canonical(key)]

    def __reduce__(self) -> tuple[object, ...]:  # a mapping proxy does not pickle
        words, more = (self.description, self.source, self.notes), (self.covariance, self.unusual, self.kind)
        return type(self), (self.name, dict(self.values), dict(self.sd), *words, *more)

    @property
    def table(self) -> dict[str, Any]:
        """Values as the table of a model file (SI), with the kind of what is not a bicycle."""
        return ({} if self.kind == "bicycle" else {"kind": self.kind}) | dict(self.values)

    @property
    def static_loads(self) -> tuple[float, float]:
        """Vertical load (N) of the rear and front wheel at rest on level ground."""
        rear, front = static_loads(bodies(self.values), self["w"], self["g"])
        return float(rear), float(front)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings of what is odd but computable: values far from other bicycles, inertias that no rigid body has."""
        below_ground = {key for key in ("zB", "zH") if self[key] > 0}  # _oddities says it
        doubts = doubts_about({k: value for k, value in self.values.items() if k not in below_ground}, self.kind)
        far = [] if self.unusual else [doubt.text for doubt in doubts]
        slip_notes = [f"{text}: only wheels that cannot slip (no_slip) hold it" for text in self.without_slip]
        return (*self.notes, *far, *_oddities(self.values, self.kind), *slip_notes)

    def replace(self, *, allow_unusual: bool = False, **changes: float) -> "Bicycle":
        """A bicycle with some parameters changed: ``changes`` are Meijaard's keys in SI units, lam in rad.

        Raises
        ------
        InputError
            As for a new bicycle, and for values far from those of other bicycles unless ``allow_unusual``.
        """
        changes = by_key(changes)
        unusual = self.unusual or allow_unusual
        if not unusual:
            refuse_unlikely(changes, {}, "give allow_unusual=True", self.kind)
        return replace(self, values={**self.values, **changes}, unusual=unusual)


NAME_THE_UNIT = "write its unit behind the number (lam = 18.3 deg; TOML: in quotes) or in a table units (TOML, YAML)"


def refuse_unlikely(values: Mapping[str, Any], sd: Mapping[str, Any], way_out: str, kind: str = "bicycle") -> None:
    """Refuse what is surely another unit or sign: several lengths usual in one, heights upwards, large deviations."""
    doubts, (typical, _) = doubts_about(values, kind), of_kind(kind)
    meant = f"or {way_out} if it is meant so"
    lengths = [doubt for doubt in doubts if UNITS[doubt.key] == "m"]
    for word, unit, metres in (("millimetres", "mm", 1e-3), ("centimetres", "cm", 1e-2), ("inches", "in", 0.0254)):
        usual = [typical[doubt.key][0] <= metres * values[doubt.key] <= typical[doubt.key][1] for doubt in lengths]
        if len(usual) >= 3 and all(usual):  # fewer are a slip of one of them
            raise InputError(
                f'{lengths[0].outside} ({word}?); give it in SI units, write length = "{unit}" in a table units (TOML, '
                f"YAML), as {len(lengths)} lengths look like {word}, {meant}"
            )
    upwards = [doubt.key for doubt in doubts if doubt.key in ("zB", "zH") and values[doubt.key] > 0]
    if upwards:
        heights = ", ".join(f"{key} = {values[key]:g} m" for key in upwards)
        turned = upwards
        z_up = ""
        if set(ODD_IN_Z) <= set(values) and all(values[key] >= 0 for key in ("zB", "zH")):
            turned = list(ODD_IN_Z)
            z_up = f"{Z_UP} = true if z points up here (it turns {', '.join(ODD_IN_Z)}), or all these signs: "
        signs = ", ".join(f"{key} = {0.0 - values[key]:g}" for key in turned)
        raise InputError(
            f"{heights}: below the ground, as z points down; heights are negative: write {z_up}{signs}, {meant}"
        )
    for d in doubts:
        if d.absurd:
            raise InputError(f"{d.text}; give it in SI units, {NAME_THE_UNIT}, {meant}")
    for key, spread in sd.items():
        low, high = typical.get(key, (0.0, math.inf))
        if is_number(spread) and spread > high - low:
            guess = {"m": " (millimetres?)", "rad": " (degrees?)", "kg": " (grams?)"}.get(UNITS[key], "")
            raise InputError(
                f"the standard deviation of {key} is {spread:g} {UNITS[key]}, more than its usual values {low:g} .. "
                f"{high:g} {UNITS[key]} differ{guess}; {NAME_THE_UNIT}, {meant}"
            )


def doubts_about(values: Mapping[str, Any], kind: str = "bicycle") -> list[Doubt]:
    """Doubts about values outside those typical of a ``kind`` in a parameter set (SI, lam in rad), complete or not."""
    typical, _ = of_kind(kind)
    numbers = {key: float(values[key]) for key in UNITS if is_number(values.get(key))}
    doubts = [doubt(key, value, unit=UNITS[key], typical=typical[key]) for key, value in numbers.items()]
    listed = [d for d in doubts if d]
    for number, d in enumerate(listed):
        tilt = math.pi / 2 - numbers[d.key]
        if d.key == "lam" and typical["lam"][0] < tilt <= typical["lam"][1]:  # usual if from the horizontal
            why = f" (head angle? lam is the tilt from the vertical, {math.degrees(tilt):.3g} deg then)"
            listed[number] = replace(d, why=why)
    return listed


def bodies(p: Mapping[str, float]) -> tuple[Body, Body, Body, Body]:
    """Rear frame, rear wheel, front frame and front wheel of a parameter set ``p``: Meijaard's keys, SI or symbols."""
    return (
        Body("rear frame", p["mB"], p["xB"], p["zB"], p["IBxx"], p["IBzz"], p["IBxz"]),
        Body("rear wheel", p["mR"], 0, -p["rR"], p["IRxx"], p["IRxx"], 0, p["IRyy"], p["rR"]),
        Body("front frame", p["mH"], p["xH"], p["zH"], p["IHxx"], p["IHzz"], p["IHxz"]),
        Body("front wheel", p["mF"], p["w"], -p["rF"], p["IFxx"], p["IFxx"], 0, p["IFyy"], p["rF"]),
    )


def static_loads(parts: tuple[Body, ...], wheelbase: float, gravity: float) -> tuple[float, float]:
    """Static vertical load (N) of the rear and front contact, from the moments about the rear contact."""
    front = gravity * sum(body.mass * body.x for body in parts) / wheelbase
    return gravity * sum(body.mass for body in parts) - front, front


def _check_numbers(name: str, numbers: Mapping[str, float], *, complete: bool) -> dict[str, float]:
    refuse_unknown("key", numbers, [*UNITS, *UNUSED], where=f"bicycle {name!r}")
    missing = [key for key in UNITS if key not in numbers]
    if complete and missing:
        raise InputError(
            f"bicycle {name!r}: missing {', '.join(missing)}; give every parameter of Meijaard et al. (2007), table 1"
        )
    values = {}
    for key, value in numbers.items():
        if not is_number(value) or not abs(value) <= LARGEST:
            most = f", at most {LARGEST:g} in size" * (is_number(value) and math.isfinite(value))
            raise InputError(f"bicycle {name!r}: {key} = {shown(value)} must be a finite number in SI units{most}")
        if not complete and value < 0:
            raise InputError(f"bicycle {name!r}: the standard deviation of {key} is {value!r}; it must be >= 0")
        values[key] = float(value)
    return values


def _check_physics(bicycle: Bicycle) -> tuple[str, ...]:
    """Refuse what is no rigid bicycle; reasons why only wheels that cannot slip hold it, empty for most."""
    p, where = bicycle.values, f"bicycle {bicycle.name!r}"
    for key in ("mB", "mR", "mH", "mF", "IRyy", "IFyy", "IRxx", "IFxx", *POSITIVE):
        if p[key] < 0 or (key in POSITIVE and p[key] == 0):
            must = "must be positive" if key in POSITIVE else "must not be negative"
            raise InputError(f"{where}: {key} = {p[key]:g} {UNITS[key]} {must}")
    total = p["mB"] + p["mR"] + p["mH"] + p["mF"]
    if total <= 0:
        raise InputError(f"{where}: total mass is {total:g} kg (mB + mR + mH + mF); it must be positive")
    if not BOUNDS["lam"][0] < p["lam"] < BOUNDS["lam"][1]:
        raise InputError(
            f"{where}: lam = {p['lam']:g} rad is out of range; the steer axis tilt must lie between -pi/2 and pi/2 "
            "(degrees must be converted to radians)"
        )
    for part, letter in (("rear frame", "B"), ("front frame", "H")):
        xx, zz, xz = (f"I{letter}{axes}" for axes in ("xx", "zz", "xz"))
        smallest = np.linalg.eigvalsh([[p[xx], p[xz]], [p[xz], p[zz]]])[0]
        if smallest < 0:
            raise InputError(
                f"{where}: the {part} has a negative principal inertia {smallest:.4g} kg m^2 in the x-z plane; "
                f"need {xx} >= 0, {zz} >= 0 and {xx} {zz} >= {xz}^2"
            )
    reasons = tuple(_ungrounded_reasons(bicycle))
    wheels = any(p[key] for key in ("mR", "mF", "IRyy", "IFyy")) or not all(map(math.isfinite, bicycle.static_loads))
    if reasons and wheels:  # a skate whose wheels are nothing may be what no tyre would hold
        raise InputError(f"{where}: {reasons[0]}")
    return reasons


def _ungrounded_reasons(bicycle: Bicycle) -> Iterator[str]:
    """Reasons why no tyre would hold a bicycle: a wheel without load, motion without inertia."""
    p, parts = bicycle.values, bodies(bicycle.values)
    for wheel, load in zip(("rear", "front"), bicycle.static_loads, strict=True):
        if not 0 < load < math.inf:
            yield (
                f"the static load of the {wheel} wheel is {load:.4g} N; it must be positive, "
                "so move the mass centre between the wheels (xB, xH) or check the wheelbase w"
            )
    lean = Joint("lean", 1.0, 0.0, 0.0, 0.0, frozenset(body.name for body in parts))
    axis = (math.sin(p["lam"]), math.cos(p["lam"]), p["w"] + p["c"], 0.0)
    steer = Joint("steer", *axis, frozenset(("front frame", "front wheel")))
    smallest, *_, total = np.linalg.eigvalsh(mass_matrix(parts, (lean, steer)).astype(float))
    if smallest <= 1e-12 * total:
        yield (
            f"the 4x4 mass matrix of lateral motion, yaw, lean and steer is not positive definite "
            f"(smallest eigenvalue {smallest:.4g}); a mass or moment of inertia is missing or has the wrong sign"
        )


def _oddities(p: Mapping[str, float], kind: str) -> list[str]:
    oddities = []
    for part, letter in (("rear frame", "B"), ("front frame", "H")):
        yy = p.get(f"I{letter}yy")
        xx, zz, xz = (p[f"I{letter}{axes}"] for axes in ("xx", "zz", "xz"))
        low, high = np.linalg.eigvalsh([[xx, xz], [xz, zz]])
        if yy is None:
            continue
        *smaller, largest = sorted((low, high, yy))
        if largest > sum(smaller) * (1 + 1e-9):
            oddities.append(
                f"the principal inertias of the {part} ({low:.4g}, {yy:.4g}, {high:.4g} kg m^2) violate the "
                "triangle inequality: no rigid body has them (measurement error?)"
            )
    for part, key, mass in (("rear frame", "zB", "mB"), ("front frame", "zH", "mH")):
        if p[key] > 0 and p[mass] > 0:
            oddities.append(
                f"the mass centre of the {part} lies below the ground ({key} = {p[key]:g} m): z points down, so "
                "heights are negative (wrong sign? if z points up, IBxz and IHxz have the other sign too)"
            )
    for wheel, across, spin, mass in (("rear", "IRxx", "IRyy", "mR"), ("front", "IFxx", "IFyy", "mF")):
        if p[mass] == 0 and p[spin] > 0 and kind == "bicycle":  # published motorcycles put it so
            oddities.append(
                f"the {wheel} wheel has spin inertia {spin} = {p[spin]:g} kg m^2 but no mass "
                "(its mass is taken to be part of the frame)"
            )
        elif p[mass] > 0 and p[spin] > 2 * p[across] * (1 + 1e-9):
            oddities.append(
                f"the {wheel} wheel violates the triangle inequality: {spin} = {p[spin]:g} > 2 {across} = "
                f"{2 * p[across]:g}"
            )
    return oddities
