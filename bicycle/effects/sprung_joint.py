"""Effects that are a sprung and damped joint: their parameters, what may replace them, and the bodies they carry."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from bicycle.effects.effect import Effect, Parameter, effect_of
from bicycle.equations.declarations import Coordinate
from bicycle.equations.lateral import ModelBuilder
from bicycle.parameters.front_hinge import critical_damping, hinge_at
from bicycle.parameters.rigid_bodies import Body
from tyre.ground.errors import InputError, is_number, shown
from tyre.measured.plausible import Doubt

DAMPING_RATIO = "damping_ratio"
"""Key of a sprung joint in place of its damping: share of critical damping."""

HEIGHT_ABOVE_HUB = "height_above_hub"
"""Key of the front frame's hinge in place of joint_x and joint_z: m above the front hub, along the steer axis."""

MOST_HEIGHT = 1.5  # m above or below the front hub


class StandIns:
    """Numbers that a model file may give in place of parameters of a joint."""

    damping_ratio = Parameter(
        "1", "damping over critical damping, every other part fixed", bounds=(0.0, 2.0), typical=(0.01, 0.5)
    )
    height_above_hub = Parameter(
        "m",
        "of the hinge, along the steer axis from its point nearest to the front hub",
        bounds=(-MOST_HEIGHT, MOST_HEIGHT),
        typical=(0.2, 0.55),
    )


STAND_INS: dict[str, tuple[Parameter, tuple[str, ...]]] = {
    DAMPING_RATIO: (StandIns.damping_ratio, ("damping",)),
    HEIGHT_ABOVE_HUB: (StandIns.height_above_hub, ("joint_x", "joint_z")),
}
"""Key in place of parameters -> its declaration, the names of these parameters."""


class SprungJoint(Effect):
    """An effect that is a joint with the parameters ``stiffness`` and ``damping``.

    A joint that defines ``carried_inertia`` takes ``damping_ratio`` in place of ``damping``: the share of
    critical damping with every other part fixed.
    """

    stiffness: Any
    damping: Any

    def __init__(self, /, **values: Any) -> None:
        ratio = values.pop(DAMPING_RATIO, None)
        if ratio is None:
            super().__init__(**values)
            return
        where = f"effect {self.identifier!r}"
        if type(self).carried_inertia is SprungJoint.carried_inertia:
            raise InputError(f"{where}: {DAMPING_RATIO} is not possible here; give damping in N m s/rad")
        if "damping" in values:
            raise InputError(f"{where}: damping and {DAMPING_RATIO} say the same; remove one")
        if not is_number(ratio) or not 0 <= ratio <= 2:
            raise InputError(
                f"{where}: {DAMPING_RATIO} = {shown(ratio)} must be between 0 and 2, the share of critical"
            )
        super().__init__(**values)
        del self._given["damping"], self.__dict__["damping"]
        self._given[DAMPING_RATIO] = float(ratio)

    def carried_inertia(self, values: Mapping[str, float]) -> float:
        """Moment of inertia (kg m^2) about the joint of what it carries, every other part fixed.

        ``values`` holds the parameters of the bicycle, and those of the effect under their names, SI.
        """
        raise NotImplementedError

    def values(self, bicycle: Mapping[str, float]) -> dict[str, float]:
        """Every parameter as ``identifier.name``, SI; a ``damping_ratio`` becomes the damping on this ``bicycle``."""
        if DAMPING_RATIO not in self._given:
            return super().values(bicycle)
        numbers: dict[str, float] = {}
        for p in self.parameters:
            tied = p.name not in self._given and p.name != "damping"
            numbers[p.name] = bicycle[str(p.default)] if tied else self._given.get(p.name, math.nan)
        inertia = self.carried_inertia({**bicycle, **numbers})
        numbers["damping"] = float(self._given[DAMPING_RATIO] * critical_damping(self.stiffness, inertia))
        return {f"{self.identifier}.{name}": number for name, number in numbers.items()}

    @property
    def stand_ins(self) -> dict[str, float]:
        """Numbers that were given in place of parameters, such as ``damping_ratio``, SI."""
        entries = {entry for p in self.parameters for entry in p.entries()}
        return {name: number for name, number in self._given.items() if name not in entries}

    @property
    def table(self) -> dict[str, Any]:
        """As of any effect; what was given in place of a parameter stays as it was given."""
        return super().table | self.stand_ins

    def doubts(self, reach: float = 1.0) -> dict[str, Doubt]:
        """As of any effect, also about what was given in place of parameters."""
        doubts = super().doubts(reach)
        for name, number in self.stand_ins.items():
            doubtful = STAND_INS[name][0].doubt(f"{self.identifier}.{name}", number, reach)
            doubts |= {name: doubtful} if doubtful else {}
        return doubts

    def __repr__(self) -> str:
        if not self.stand_ins:
            return super().__repr__()
        numbers = ", ".join(f"{name}={number!r}" for name, number in self._given.items())
        return f"{type(self).__name__}({numbers})"

    def check(self, bicycle: Mapping[str, float]) -> None:
        if math.isinf(self.stiffness):
            raise InputError(f"effect {self.identifier!r}: an infinite stiffness is the rigid bicycle; leave it out")

    def spring(self, model: ModelBuilder, joint: Coordinate) -> None:
        """Let spring and damper act on the joint."""
        model.add_torque(joint, -self.stiffness * joint.angle - self.damping * joint.rate)


class SteerAxisHinge(SprungJoint):
    """A sprung joint at (``joint_x``, ``joint_z``) that takes ``height_above_hub`` in their place.

    The height (m) is measured along the steer axis, from its point nearest to the front hub.
    """

    def __init__(self, /, **values: Any) -> None:
        height = values.pop(HEIGHT_ABOVE_HUB, None)
        if height is None:
            super().__init__(**values)
            return
        where = f"effect {self.identifier!r}: {HEIGHT_ABOVE_HUB}"
        twice = [name for name in ("joint_x", "joint_z") if name in values]
        if twice:
            raise InputError(f"{where} and {' and '.join(twice)} say the same; remove one")
        if not is_number(height) or not -MOST_HEIGHT <= height <= MOST_HEIGHT:
            raise InputError(f"{where} = {shown(height)} must be between -{MOST_HEIGHT} and {MOST_HEIGHT} m")
        super().__init__(**values, joint_x=0.0, joint_z=0.0)
        for name in ("joint_x", "joint_z"):  # they follow from the height once the bicycle is known
            del self._given[name], self.__dict__[name]
        self._given[HEIGHT_ABOVE_HUB] = float(height)

    def values(self, bicycle: Mapping[str, float]) -> dict[str, float]:
        """Every parameter as ``identifier.name``, SI; a height above the hub becomes a place on the steer axis."""
        if HEIGHT_ABOVE_HUB not in self._given:
            return super().values(bicycle)
        numbers = {name: number for name, number in self.table.items() if name != HEIGHT_ABOVE_HUB}
        joint_x, joint_z = hinge_at(bicycle, self._given[HEIGHT_ABOVE_HUB])
        return type(self)(**numbers, joint_x=joint_x, joint_z=joint_z).values(bicycle)


SHARES = {"mass_share": {"mass"}, "inertia_share": {"Ixx", "Izz", "Ixz"}}
"""Parameter of a moving body -> what it is a share of."""


class MovingBody(SprungJoint):
    """A sprung joint that carries a body of a rider, which is taken out of what holds it.

    ``mass`` (kg), mass centre ``x``, ``z`` (m) and the inertias ``Ixx``, ``Izz``, ``Ixz`` (kg m^2) about it. Where the
    effect has the parameters ``mass_share`` and ``inertia_share``, the body has that share of mass and inertias.
    """

    mass: Any
    x: Any
    z: Any
    Ixx: Any
    Izz: Any
    Ixz: Any

    def __init__(self, /, **values: Any) -> None:
        declared = {p.name for p in self.parameters}
        for share, keys in SHARES.items():
            if share in declared and keys & values.keys():
                values = {share: 1.0} | values  # a stated number is the body's own
        super().__init__(**values)

    @property
    def moving(self) -> tuple[Any, Any, Any, Any]:
        """Mass (kg), Ixx, Izz and Ixz (kg m^2) of the body, symbols inside ``apply``."""
        of_mass, of_inertia = (getattr(self, share, 1) for share in SHARES)
        return of_mass * self.mass, of_inertia * self.Ixx, of_inertia * self.Izz, of_inertia * self.Ixz

    def holder(self, bicycle: Mapping[str, float]) -> tuple[str, tuple[str, ...], tuple[float, ...]]:
        """Name what holds the body, with keys and numbers of its mass, x, z, Ixx, Izz and Ixz."""
        keys = ("mB", "xB", "zB", "IBxx", "IBzz", "IBxz")
        return "rear frame", keys, tuple(bicycle[key] for key in keys)

    def check(self, bicycle: Mapping[str, float]) -> None:
        """Refuse a body without which its holder cannot exist."""
        super().check(bicycle)
        where = f"effect {self.identifier!r}"
        body: Any = effect_of(type(self), self.values(bicycle))  # with the numbers of the bicycle where none was given
        (mass, Ixx, Izz, Ixz), x, z = body.moving, body.x, body.z
        holder, keys, (whole, x_whole, z_whole, *whole_inertias) = self.holder(bicycle)
        if whole <= mass:
            raise InputError(
                f"{where}: mass = {mass:g} kg must be below {whole:g} kg, the mass of the {holder} that contains the "
                f"moving body ({keys[0]} = {whole:g} kg)"
            )
        dx, dz, reduced = x_whole - x, z_whole - z, whole * mass / (whole - mass)
        xx, zz, xz = whole_inertias
        frame, inertia = np.array([[xx, xz], [xz, zz]]), np.array([[Ixx, Ixz], [Ixz, Izz]])
        rest = frame - inertia - reduced * np.array([[dz * dz, -dx * dz], [-dx * dz, dx * dx]])
        for part, tensor in (("the moving body", inertia), (f"what remains of the {holder}", rest)):
            smallest = np.linalg.eigvalsh(tensor)[0]
            if smallest < -1e-12 * np.trace(frame):
                raise InputError(
                    f"{where}: {part} has a negative principal inertia {smallest:.4g} kg m^2 in the x-z plane; "
                    f"check mass, x, z, Ixx, Izz, Ixz against the {holder} ({', '.join(keys[3:])})"
                )

    def move_body(self, model: ModelBuilder, name: str) -> None:
        """Take the body called ``name`` out of what holds a rider; a joint is to carry it."""
        mass, *inertias = self.moving
        model.add_body(Body(name, mass, self.x, self.z, *inertias))
        taken_out = (-mass, self.x, self.z, *(-inertia for inertia in inertias))
        model.add_body(Body(f"{name} in the rear frame", *taken_out, fixed_to=model.rider_body))
