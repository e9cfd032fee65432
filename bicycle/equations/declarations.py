"""Coordinates, states, modes and wheels that a model declares, and the ports of its contacts."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from tyre.ground.door import library

sp = library("sympy")


@dataclass(frozen=True)
class State:
    """A state of the model."""

    name: str  # such as ``lean_rate``
    unit: str  # SI, such as ``rad/s`` or ``N m``
    role: str = ""  # group by whose share in a motion a :class:`Mode` is recognised
    joint: bool = False  # true of the angle and the rate of a joint that an effect adds

    @property
    def forcelike(self) -> bool:
        """True if the unit is a force times something: N, N m ..."""
        return self.unit.split("/")[0].split(" ")[0] == "N"


@dataclass(frozen=True)
class Mode:
    """A mode of vibration that an effect brings to a model.

    Attributes
    ----------
    name : str
        Name in tables, figures and files: small letters and underscores.
    marks : tuple of str
        Roles of the states by whose share in the motion the mode is recognised; the first is its own and must be there,
        the others count where they are. By default the role that is called as the mode, which is the role of the joint
        of that name.
    place : int
        Position among the modes of a table; those without come last, by name.
    look : int, optional
        Number of the look in figures (:data:`bicycle.stability.mode_figure.LOOKS`); without one, it follows from the
        name.
    main : bool
        Whether figures choose their window so that the mode is seen.
    """

    name: str
    marks: tuple[str, ...] = ()
    place: int = 100
    look: int | None = None
    main: bool = False

    def __post_init__(self) -> None:
        if not self.marks:
            object.__setattr__(self, "marks", (self.name,))


BASE_MODES = (
    Mode("weave", marks=("lean",), place=0, look=0, main=True),
    Mode("wobble", marks=("steer",), place=1, look=2, main=True),
    Mode("capsize", marks=("lean",), place=2, look=3, main=True),
    Mode("castering", marks=("steer",), place=3, look=4),
)
"""The modes of every model: weave, capsize and castering are the slow roots of lean and steer, wobble is a role."""


@dataclass(frozen=True)
class Declarations:
    """States, modes and units that a model declares."""

    states: tuple[State, ...] = ()  # in the order of the model's states
    modes: tuple[Mode, ...] = ()  # those of the effects; weave, wobble, capsize and castering are of every model
    units: Mapping[str, str] = field(default_factory=dict)  # SI unit of every state, input and output by name


Expression = Any  # sympy.Expr; the library carries no types


def _zero() -> Expression:
    return sp.S.Zero


Builder = Any  # bicycle.equations.lateral.ModelBuilder, which stands on this file


@dataclass(frozen=True)
class Coordinate:
    """A joint angle and its rate, as symbols."""

    name: str  # of the joint
    angle: Expression  # rad
    rate: Expression  # rad/s


@dataclass(eq=False)
class Wheel:
    """A contact port: what a tyre sees (slip, camber) and the force and moments it returns."""

    name: str  # ``rear`` or ``front``
    body: str  # name of its rigid body, such as ``rear wheel``
    x: Expression  # m, of the contact, forward of the rear one
    radius: Expression  # m
    # m/s, of the contact across the wheel, positive to the right; slip angle = -slip velocity / v
    slip_velocity: Expression
    camber: Expression  # rad, positive leaning to the right
    yaw_rate: Expression  # rad/s, positive to the right
    offset: Expression  # m, of the place where it touches the road, as :meth:`.ModelBuilder.lateral_offset`
    lateral_force: Expression  # N, on the tyre, positive to the right
    static_load: Expression  # N, positive
    crown_radius: Expression = field(default_factory=_zero)  # m, of the cross-section
    series_compliance: Expression = field(default_factory=_zero)  # m/N, of rim and spokes in series with the tyre
    lagged_camber_force: Expression = field(default_factory=_zero)  # N
    direct_camber_force: Expression = field(default_factory=_zero)  # N
    moment: Expression = field(default_factory=_zero)  # N m about the vertical
    forward_force: Expression = field(default_factory=_zero)  # N, along the wheel
    contact_line: Any = None  # effect that gives the contact a length (:meth:`lengthen_contact`); None: a point

    def add_moment(self, moment: Expression) -> None:
        """Add a moment about the vertical (N m, > 0 turns the wheel to the right)."""
        self.moment += moment

    def add_crown_radius(self, radius: Expression) -> None:
        """Round the cross-section of the tyre by a radius (m): leaning shifts the contact sideways."""
        self.crown_radius += radius

    def add_series_compliance(self, compliance: Expression) -> None:
        """Add a lateral compliance (m/N) between hub and tyre; a contact law with a lag takes it into account."""
        self.series_compliance += compliance

    def add_camber_force(self, force: Expression, *, lag_share: Expression = 1) -> None:
        """Add a lateral force of camber (N); ``lag_share`` (0 .. 1) of it builds up as the slip force."""
        self.lagged_camber_force += lag_share * force
        self.direct_camber_force += (1 - lag_share) * force

    def lengthen_contact(self, line: Any) -> None:
        """Let ``line.renewed_force(model, wheel, force=..)`` (N) be what rolling straight on takes of a force.

        Of a point it is all of ``force``, per relaxation length.
        """
        if self.contact_line is not None:
            raise ValueError(f"two effects give the contact of the {self.body} a length; declare one slot for both")
        self.contact_line = line


@dataclass(eq=False)
class Motor:
    """A motor, or a rider's arms, between rear frame and steering: its command and the torque that acts (N m)."""

    # N m, to the right: symbol of what it is to give
    command: Expression = field(default_factory=lambda: sp.Symbol("steer motor command"))
    commanded: Expression = field(default_factory=_zero)  # N m, to the right: sum of what effects command
    _torque: Expression | None = None  # N m, to the right: what arrives; None: the command

    def tell(self, torque: Expression) -> None:
        """Add to the commanded torque (N m, > 0 to the right), in terms of coordinates, rates and speed."""
        self.commanded += torque

    @property
    def torque(self) -> Expression:
        """Torque that acts on the steering, N m."""
        return self.command if self._torque is None else self._torque

    def give(self, torque: Expression) -> None:
        """Let the motor give ``torque`` (N m) instead of its command."""
        if self._torque is not None:
            raise ValueError(f"two effects set what the {self.command} gives; declare one slot for both")
        self._torque = torque


class ContactLaw(Protocol):
    """Effect that closes the two contacts: gives the lateral force of a wheel, or holds its slip at zero."""

    holds_contact: bool

    def lateral_force(self, model: Builder, wheel: Wheel) -> Expression:
        """Lateral force in terms of slip velocity, camber and states of its own."""
