"""What effects see of the model: joint angles, a steer motor, and the contacts with what a tyre feels and returns."""

from dataclasses import dataclass, field
from typing import Any, Protocol

import sympy as sp

Expression = Any  # sympy.Expr; the library carries no types
Builder = Any  # bicycle.derivation.builder.ModelBuilder, which stands on this file


@dataclass(frozen=True)
class Coordinate:
    """A joint angle and its rate, as symbols."""

    name: str
    angle: Expression
    rate: Expression


@dataclass(eq=False)
class Wheel:
    """A contact port: what a tyre sees (slip, camber) and the force and moments it returns.

    ``slip_velocity`` (m/s) is the lateral velocity of the contact point relative to the wheel's heading,
    ``camber`` (rad) the lean of the wheel plane, ``yaw_rate`` (rad/s) its turning about the vertical, ``side_force``
    (N, > 0 to the right) what the contact law gives.
    """

    name: str
    body: str
    x: Expression
    radius: Expression
    slip_velocity: Expression
    camber: Expression
    yaw_rate: Expression
    side_force: Expression
    static_load: Expression
    crown_radius: Expression = sp.S.Zero  # m, of the cross-section
    series_compliance: Expression = sp.S.Zero  # m/N, of rim and spokes in series with the tyre
    lagged_camber_force: Expression = sp.S.Zero  # N
    direct_camber_force: Expression = sp.S.Zero  # N
    moment: Expression = sp.S.Zero  # N m about the vertical
    contact_line: "ContactLine | None" = None  # None: a point, as long as no effect gives the contact a length

    def add_moment(self, moment: Expression) -> None:
        """Add a moment about the vertical (N m, > 0 turns the wheel to the right).

        Parameters
        ----------
        moment : expression, N m
        """
        self.moment += moment

    def add_crown_radius(self, radius: Expression) -> None:
        """Round the cross-section of the tyre by a radius (m): leaning shifts the contact sideways.

        Parameters
        ----------
        radius : expression, m
        """
        self.crown_radius += radius

    def add_series_compliance(self, compliance: Expression) -> None:
        """Add a lateral compliance (m/N) between hub and tyre; a contact law with a lag takes it into account.

        Parameters
        ----------
        compliance : expression, m/N
        """
        self.series_compliance += compliance

    def add_camber_force(self, force: Expression, *, lag_share: Expression = 1) -> None:
        """Add a side force of camber (N, > 0 to the right); ``lag_share`` (0 .. 1) of it builds up as the slip force.

        The contact law takes both parts into its side force; under rolling without slip they act on nothing.

        Parameters
        ----------
        force : expression
            N, > 0 to the right.
        lag_share : expression
            Share that lags, 0 .. 1.
        """
        self.lagged_camber_force += lag_share * force
        self.direct_camber_force += (1 - lag_share) * force

    def lengthen_contact(self, line: "ContactLine") -> None:
        """Let ``line`` say how rolling renews the force of a contact that is longer than a point.

        Parameters
        ----------
        line : ContactLine

        Raises
        ------
        ValueError
            Another effect has done so; give both effects one ``slot``.
        """
        if self.contact_line is not None:
            raise ValueError(f"two effects give the contact of the {self.body} a length; declare one slot for both")
        self.contact_line = line


@dataclass(eq=False)
class Motor:
    """A motor between rear frame and steering: what controllers tell it to give, and what arrives (N m).

    ``command`` is a symbol for all that it is told; ``torque``, what acts on the steering, equals it unless an effect
    says otherwise.
    """

    command: Expression = field(default_factory=lambda: sp.Symbol("steer motor command"))
    told: Expression = sp.S.Zero
    _torque: Expression | None = None

    def tell(self, torque: Expression) -> None:
        """Add to the commanded torque (N m, > 0 to the right), in terms of coordinates, rates and speed.

        Parameters
        ----------
        torque : expression, N m
        """
        self.told += torque

    @property
    def torque(self) -> Expression:
        """What acts on the steering, N m."""
        return self.command if self._torque is None else self._torque

    def give(self, torque: Expression) -> None:
        """Let the motor give ``torque`` (N m) instead of its command.

        Parameters
        ----------
        torque : expression, N m

        Raises
        ------
        ValueError
            Another effect has done so.
        """
        if self._torque is not None:
            raise ValueError("two effects say what the steer motor gives; declare one slot for both")
        self._torque = torque


class ContactLine(Protocol):
    """How rolling renews the side force of a contact that is longer than a point."""

    def renewed_force(
        self, model: Builder, wheel: Wheel, *, force: Expression,
        cornering_stiffness: Expression, relaxation_length: Expression,
    ) -> Expression:  # fmt: skip
        """Force (N) that rolling straight on takes away per relaxation length; of a point all of ``force``.

        ``force`` is the lagged side force less what camber holds up; stiffness and length are those of the tyre alone.

        Parameters
        ----------
        model : ModelBuilder
        wheel : Wheel
        force : expression
            Lagged side force less what camber holds up, N.
        cornering_stiffness, relaxation_length : expressions
            Of the tyre alone, N/rad and m.
        """


class ContactLaw(Protocol):
    """What closes the two contacts: gives the side force of a wheel, or holds its slip at zero."""

    holds_contact: bool

    def side_force(self, model: Builder, wheel: Wheel) -> Expression:
        """Side force in terms of slip velocity, camber and states of its own.

        Parameters
        ----------
        model : ModelBuilder
        wheel : Wheel
            Where the force acts, N, > 0 to the right.
        """
