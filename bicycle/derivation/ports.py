"""What effects see of the model: joint angles, and the two contacts with what a tyre feels and returns."""

from dataclasses import dataclass
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
    crown_radius: Expression = sp.S.Zero
    series_compliance: Expression = sp.S.Zero  # m/N, of rim and spokes in series with the tyre
    lagged_camber_force: Expression = sp.S.Zero
    direct_camber_force: Expression = sp.S.Zero
    moment: Expression = sp.S.Zero
    contact_line: "ContactLine | None" = None  # None: a point, as long as no effect gives the contact a length

    def add_moment(self, moment: Expression) -> None:
        """Add a moment about the vertical (N m, > 0 turns the wheel to the right)."""
        self.moment += moment


class ContactLine(Protocol):
    """How rolling renews the side force of a contact that is longer than a point."""

    def renewed_force(
        self, model: Builder, wheel: Wheel, *, force: Expression,
        cornering_stiffness: Expression, relaxation_length: Expression,
    ) -> Expression:  # fmt: skip
        """Force (N) that rolling straight on takes away per relaxation length; of a point all of ``force``.

        ``force`` is the lagged side force less what camber holds up; stiffness and length are those of the tyre alone.
        """


class ContactLaw(Protocol):
    """What closes the two contacts: gives the side force of a wheel, or holds its slip at zero."""

    holds_contact: bool

    def side_force(self, model: Builder, wheel: Wheel) -> Expression:
        """Side force in terms of slip velocity, camber and states of its own."""
