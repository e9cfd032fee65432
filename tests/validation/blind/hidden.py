"""What the blind test hides: sizes of effects, causes that users have, things that no library knows. All synthetic.

Imports nothing of the fitter. Bicycles are measured ones with every parameter perturbed by its stated uncertainty; the
files give the unperturbed ones, as a laboratory would.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bicycle import Bicycle, load_bicycle
from tests.validation.blind.closing import Machine, build
from tests.validation.blind.machine import Extras
from tests.validation.blind.motion import Sensor
from tyre.ground import InputError

UNRIDDEN = ("kooijman2008", "browser", "pista", "crescendo", "fisher", "benchmark")
RIDDEN = ("rigid_rider",)
TRIES = 100
RELATIVE = {"m": 0.005, "I": 0.03}
ABSOLUTE = {"w": 0.002, "c": 0.002, "lam": 0.006, "rR": 0.001, "rF": 0.001, "xB": 0.006, "zB": 0.006}
ABSOLUTE |= {"xH": 0.006, "zH": 0.006}
Range = tuple[float, float]
Tables = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Hidden:
    """An effect to hide: the base it needs, the bicycles it makes sense on, and how its parameters are drawn."""

    base: str  # "rolling" (no slip), "static" (side slip) or "tyre" (relaxation and camber thrust)
    bicycles: tuple[str, ...]
    draw: Mapping[str, Range]  # log-uniform
    speeds: Range = (3.0, 8.0)
    by_load: tuple[str, ...] = ()
    place: Mapping[str, Range] = field(default_factory=dict)  # uniform


HIDDEN: Mapping[str, Hidden] = {
    "steer_damper": Hidden("rolling", UNRIDDEN, {"damping": (0.3, 2.0)}),
    "steer_spring": Hidden("rolling", UNRIDDEN, {"stiffness": (1.0, 8.0)}),
    "pneumatic_trail": Hidden("rolling", UNRIDDEN, {"trail": (0.01, 0.03)}),
    "crown_radius": Hidden("rolling", UNRIDDEN, {"crown_radius": (0.015, 0.03)}),
    "twisting_torque": Hidden("tyre", UNRIDDEN, {"twisting_stiffness": (0.7, 3.0)}, (4.0, 12.0)),
    "camber_thrust": Hidden("slipping", UNRIDDEN, {"camber_stiffness": (0.5, 1.0)}, (4.0, 12.0), ("camber_stiffness",)),
    "front_compliance": Hidden(
        "tyre", ("benchmark",), {"stiffness": (1500.0, 5000.0), "damping": (5.0, 20.0)}, (5.0, 15.0),
        place={"joint_x": (0.75, 0.95), "joint_z": (-0.9, -0.7)},
    ),
    "relaxation_length": Hidden("static", ("benchmark",), {"relaxation_length": (0.08, 0.2)}, (8.0, 20.0)),
    "rider_lean": Hidden(
        "rolling", RIDDEN,
        {"mass": (30, 50), "Ixx": (1.0, 2.5), "Izz": (0.6, 1.5), "stiffness": (600, 2500), "damping": (20, 120)},
        place={"x": (0.28, 0.38), "z": (-1.4, -1.25), "joint_z": (-1.0, -0.8)},
    ),
}  # fmt: skip
"""What is hidden one at a time, with sizes that occur on bicycles (physics of each effect's own page)."""

UNUSUAL: Mapping[str, Hidden] = {
    "front_compliance": Hidden(
        "slipping", UNRIDDEN, {"stiffness": (150.0, 600.0), "damping": (1.0, 8.0)}, (3.2, 8.5),
        place={"joint_x": (0.75, 0.95), "joint_z": (-0.85, -0.65)},
    ),
    "steer_spring": Hidden("rolling", UNRIDDEN, {"stiffness": (25.0, 60.0)}, (4.0, 9.0)),
    "steer_damper": Hidden("rolling", ("kooijman2008", "benchmark"), {"damping": (5.5, 8.0)}, (5.0, 10.0)),
    "pneumatic_trail": Hidden("rolling", UNRIDDEN, {"trail": (0.035, 0.06)}),
    "crown_radius": Hidden("rolling", UNRIDDEN, {"crown_radius": (0.045, 0.09)}),
    "twisting_torque": Hidden("tyre", UNRIDDEN, {"twisting_stiffness": (5.0, 12.0)}, (4.0, 12.0)),
}  # fmt: skip
"""Sizes 1.5 to 4 times outside what occurs: softer fronts, stiffer springs and dampers, longer trails, wider tyres."""


@dataclass(frozen=True)
class Cause:
    """What is otherwise than the file says, beside effects of the library."""

    told: Tables = field(default_factory=dict)
    extras: Extras = field(default_factory=Extras)
    shifts: Mapping[str, float] = field(default_factory=dict)
    stated: str = ""
    speed_offset: float = 0.0
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    friction: float = 0.0


AS_STATED = Cause()


@dataclass(frozen=True)
class Truth:
    """What was hidden: identifier -> {parameter: value}, and how the case was made."""

    effects: Tables = field(default_factory=dict)
    cell: str = ""
    seed: int = 0
    noise: float = 1.0
    weave: float | None = None


def perturbed(bicycle: Bicycle, sd: Mapping[str, float], rng: np.random.Generator) -> Bicycle:
    """A bicycle drawn (by ``rng``) around another with ``sd`` by key, SI; drawn again until its bodies can exist."""
    for _ in range(TRIES):
        try:
            drawn = bicycle.replace(**{key: bicycle[key] + s * rng.standard_normal() for key, s in sd.items()})
        except InputError:
            continue
        if bodies_exist(drawn):
            return drawn
    raise InputError(f"no physical bicycle near {bicycle.name!r}")


def bodies_exist(bicycle: Bicycle) -> bool:
    """Wheels are at least flat (Iyy <= 2 Ixx), frames have positive principal moments in their plane."""
    wheels = all(bicycle[f"I{wheel}yy"] <= 2 * bicycle[f"I{wheel}xx"] for wheel in "RF")
    return wheels and all(
        bicycle[f"I{frame}xx"] * bicycle[f"I{frame}zz"] > bicycle[f"I{frame}xz"] ** 2 for frame in "BH"
    )


def uncertainty(bicycle: Bicycle) -> dict[str, float]:
    """1-sigma of a carefully measured bicycle."""
    sd = dict(ABSOLUTE)
    for key in bicycle.values:
        if key[0] in RELATIVE and key not in ("IByy", "IHyy"):
            sd[key] = RELATIVE[key[0]] * abs(bicycle[key])
    for part in ("B", "H"):
        sd[f"I{part}xz"] = RELATIVE["I"] * math.sqrt(bicycle[f"I{part}xx"] * bicycle[f"I{part}zz"])
    return sd


def base_effects(kind: str, loads: tuple[float, float], rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    """Effects that the file declares, as a model file has them."""

    def by_load(factor: float) -> dict[str, float]:
        return {"rear": round(factor * loads[0], 2), "front": round(factor * loads[1], 2)}

    stiffness: dict[str, Any] = {"cornering_stiffness": by_load(rng.uniform(10, 16))}
    tyre: dict[str, dict[str, Any]] = {
        "relaxation_length": {**stiffness, "relaxation_length": round(rng.uniform(0.08, 0.15), 3)}
    }
    camber = {"camber_thrust": {"camber_stiffness": by_load(rng.uniform(0.6, 1.0))}}
    static: dict[str, dict[str, Any]] = {"side_slip": stiffness}
    bases: dict[str, dict[str, dict[str, Any]]] = {
        "rolling": {}, "static": static | camber, "slipping": tyre, "tyre": tyre | camber
    }  # fmt: skip
    return bases[kind]


def draw_effect(hidden: Hidden, bicycle: Bicycle, rng: np.random.Generator) -> dict[str, Any]:
    """Random parameters of a ``hidden`` effect on a ``bicycle``, from ``rng``."""
    values: dict[str, Any] = {
        key: float(np.exp(rng.uniform(math.log(low), math.log(high)))) for key, (low, high) in hidden.draw.items()
    }
    for key in hidden.by_load:
        values[key] = dict(zip(("rear", "front"), (values[key] * load for load in bicycle.static_loads), strict=True))
    return values | {key: float(rng.uniform(*span)) for key, span in hidden.place.items()}


def true_machine(bicycle: Bicycle, effects: Tables, hidden: Tables, cause: Cause = AS_STATED) -> Machine:
    """The bicycle as it is."""
    whole = {name: dict(table) for name, table in {**effects, **hidden}.items()}
    if "relaxation_length" in hidden and "side_slip" in effects:
        whole["relaxation_length"]["cornering_stiffness"] = effects["side_slip"]["cornering_stiffness"]
    values = {key: value + cause.shifts.get(key, 0.0) for key, value in bicycle.values.items()}
    if "rider_lean" in hidden:
        check_rest(bicycle, hidden["rider_lean"])
    return build(values, whole, cause.extras)


def check_rest(bicycle: Bicycle, rider: Mapping[str, float]) -> None:
    """Refuse a ``rider`` (parameters in SI) whose removal leaves no physical frame of the ``bicycle``."""
    rest = bicycle["mB"] - rider["mass"]
    if rest > 0:
        x = (bicycle["mB"] * bicycle["xB"] - rider["mass"] * rider["x"]) / rest
        z = (bicycle["mB"] * bicycle["zB"] - rider["mass"] * rider["z"]) / rest
        spread = rider["mass"] * bicycle["mB"] / rest  # parallel axes of both parts about the common mass centre
        dx, dz = rider["x"] - bicycle["xB"], rider["z"] - bicycle["zB"]
        xx = bicycle["IBxx"] - rider["Ixx"] - spread * dz * dz
        zz = bicycle["IBzz"] - rider["Izz"] - spread * dx * dx
        xz = bicycle["IBxz"] - rider.get("Ixz", 0.0) + spread * dx * dz
        if z < 0 and -1 < x < 2 and min(xx, zz) > 0 and xx * zz > xz * xz:
            return
    raise InputError(f"{bicycle.name!r} cannot hold rider_lean")


def hide(
    names: tuple[str, ...], nominal: Bicycle, real: Bicycle, effects: Tables, rng: np.random.Generator,
    cause: Cause = AS_STATED, sizes: Mapping[str, Hidden] = HIDDEN,
) -> tuple[dict[str, dict[str, Any]], Machine]:  # fmt: skip
    """Draw the effects to hide, again until the bicycle can hold them; their values and the machine as it is."""
    for _ in range(TRIES):
        drawn = {name: draw_effect(sizes[name], nominal, rng) for name in names}
        try:
            return drawn, true_machine(real, effects, drawn, cause)
        except InputError:
            continue
    raise InputError(f"{nominal.name!r} cannot hold {', '.join(names)}")


def pick(bicycles: tuple[str, ...], rng: np.random.Generator) -> Bicycle:
    """One of some packaged ``bicycles``, drawn by ``rng``."""
    return load_bicycle(str(rng.choice(bicycles)))
