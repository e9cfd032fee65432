"""The symbolic lateral model: effects add to a :class:`ModelBuilder`, which closes to E x' = F(v) x + B(v) u.

Base: four coordinates (lateral velocity of the rear contact, yaw rate, lean, steer) and two contact ports. The
equations of motion are

    M (du/dt + v r e_V) + v H u = -K q + Q,        u = [V, r, rates of the joints],  q = joint angles,

with M the kinetic-energy form, H the gyroscopic coupling of the spinning wheels, K the Hessian of
V2 = -g sum m_i z_i + sum N_k z_k, and Q what effects add. V = dy/dt - v psi replaces y and psi. Derived for a chain
of bodies (:mod:`bicycle.rigid_bodies`); with both contacts held it gives the equations of Meijaard et al. (2007).
"""

import sympy as sp

from bicycle.derivation.closing import SymbolicModel
from bicycle.derivation.declarations import Mode, State, check_modes
from bicycle.derivation.equations import equations
from bicycle.derivation.ports import ContactLaw, Coordinate, Expression, Motor, Wheel
from bicycle.parameters import UNITS, bodies
from bicycle.rigid_bodies import Body, Joint, displacement_row, with_guests
from tyre.base.errors import InputError, unknown

SPEED = sp.Symbol("v", real=True)
STEERED = frozenset(("front frame", "front wheel"))
OF_CONTACT = {"slip": "rad", "side_force": "N"}  # what is put in or read off at each contact, and its unit


class ModelBuilder:
    """The open model that effects extend in ``apply``. Everything added must be linear in the motion."""

    def __init__(self) -> None:
        self.speed = SPEED
        self.bicycle = p = {key: sp.Symbol(key, real=True) for key in UNITS}
        self.bodies: list[Body] = list(bodies(p))
        self.lean = Coordinate("lean", sp.Symbol("lean"), sp.Symbol("lean_rate"))
        self.steer = Coordinate("steer", sp.Symbol("steer"), sp.Symbol("steer_rate"))
        self.lateral_velocity, self.yaw_rate = sp.symbols("rear_lateral_velocity yaw_rate")
        self.torques = {"steer_torque": self.steer, "lean_torque": self.lean}
        self.motor = Motor()
        self.contact_law: ContactLaw | None = None
        self.switches: dict[Expression, Expression] = {}
        self.extra_inertia: dict[tuple[str, str], Expression] = {}
        self._frame_joints: list[tuple[Joint, Coordinate]] = []
        self.coordinate_forces: list[tuple[Coordinate, Expression]] = []
        self.yaw_moments: list[tuple[str, Expression]] = []
        self.rates: dict[Expression, Expression | None] = {}  # extra state -> its rate of change
        self.states: dict[str, State] = {}
        self.modes: dict[str, Mode] = {}
        self.load_transfer: Expression = sp.S.Zero  # N, from the front contact to the rear
        self.drive_force: Expression = sp.S.Zero  # N, forward at the rear contact
        self.wheels = (self._wheel("rear", sp.S.Zero, p["rR"]), self._wheel("front", p["w"], p["rF"]))
        self._declare("rear_lateral_velocity", "m/s", "rear")
        self._declare("yaw_rate", "rad/s", "yaw")
        for coordinate in (self.lean, self.steer):
            self._declare_angle(coordinate.name, coordinate.name, joint=False)

    def add_body(self, body: Body) -> None:
        """Add a rigid body to the rear frame, or to what it is ``fixed_to`` (a joint may carry it); it has weight.

        Parameters
        ----------
        body : Body

        Raises
        ------
        InputError
            There is a body of that name, or none that it could be fixed to.
        """
        names = [other.name for other in self.bodies]
        if body.fixed_to and body.fixed_to not in names:
            raise InputError(f"the body {body.name!r} is fixed to an {unknown('body', body.fixed_to, names)}")
        if body.name in names:
            raise InputError(f"two bodies are called {body.name!r}; give the effect's body a name of its own")
        self.bodies.append(body)

    def add_joint(
        self, name: str, *, axis: tuple[Expression, Expression], point: tuple[Expression, Expression],
        carries: set[str], role: str = "",
    ) -> Coordinate:  # fmt: skip
        """Add a hinge after the lean and before the steer axis.

        Parameters
        ----------
        name : str
            Of its angle (rad); its rate (rad/s) is ``NAME_rate``. Both are states and outputs of the model.
        axis : two expressions
            Direction (x, z) of the axis, a unit vector; x forward, z down.
        point : two expressions
            A point (x, z) of the axis, m from the rear contact.
        carries : set of str
            Names of the bodies that turn with it.
        role : str
            Group of states that marks a mode (:class:`bicycle.derivation.declarations.Mode`); by default ``name``.

        Returns
        -------
        Coordinate
            Angle and rate, to put torques on.

        Raises
        ------
        InputError
            There is a state of that name, or no such body.
        """
        for body in sorted(carries - {body.name for body in self.bodies}):
            raise InputError(f"the joint {name!r} carries {unknown('body', body, [b.name for b in self.bodies])}")
        self._declare_angle(name, role or name, joint=True)
        coordinate = Coordinate(name, sp.Symbol(name), sp.Symbol(f"{name}_rate"))
        self._frame_joints.append((Joint(name, *axis, *point, frozenset(carries)), coordinate))
        return coordinate

    def add_torque(self, coordinate: Coordinate, torque: Expression) -> None:
        """Add a torque (N m) that acts on a joint angle, in terms of coordinates, rates, speed and states.

        Parameters
        ----------
        coordinate : Coordinate
            ``model.lean``, ``model.steer`` or what :meth:`add_joint` gave.
        torque : expression
            N m, in terms of coordinates, rates, speed and states.
        """
        self.coordinate_forces.append((coordinate, torque))

    def add_inertia(self, coordinate: Coordinate, inertia: Expression) -> None:
        """Add a moment of inertia (kg m^2) that moves with one joint angle only.

        Parameters
        ----------
        coordinate : Coordinate
        inertia : expression
            kg m^2.
        """
        key = (coordinate.name, coordinate.name)
        self.extra_inertia[key] = self.extra_inertia.get(key, sp.S.Zero) + inertia

    def add_yaw_moment(self, body: str, moment: Expression) -> None:
        """Add an external moment about the vertical (N m) on a body.

        Parameters
        ----------
        body : str
            Name of a body.
        moment : expression
            N m, > 0 to the right.
        """
        self.yaw_moments.append((body, moment))

    def add_drive_force(self, force: Expression) -> None:
        """Add a force forward at the rear contact (N), for example what balances a drag.

        Parameters
        ----------
        force : expression, N
        """
        self.drive_force += force

    def add_load_transfer(self, force: Expression) -> None:
        """Move vertical load (N) from the front contact to the rear.

        Parameters
        ----------
        force : expression, N
        """
        self.load_transfer += force

    def set_contact_law(self, law: ContactLaw) -> None:
        """Let ``law`` close both contacts; its effect declares ``slot = "contact law"``.

        Parameters
        ----------
        law : ContactLaw
        """
        self.contact_law = law

    def lateral_offset(self, body: str, x: Expression, z: Expression) -> Expression:
        """Lateral displacement (m) of a point of a body out of the plane through the rear contact along the heading.

        Parameters
        ----------
        body : str
            Name of a body.
        x, z : expressions
            The point, m; x forward, z down.
        """
        row = displacement_row(self.joints(), body, x, z)[2:]
        return sum((a * c.angle for a, c in zip(row, self.coordinates(), strict=True)), sp.S.Zero)

    def add_state(self, name: str, *, unit: str, role: str = "") -> Expression:
        """Add a first-order state; :meth:`set_rate` says how it changes.

        Parameters
        ----------
        name, unit : str
            Name in results, and SI unit such as ``N`` or ``rad/s``.
        role : str
            ``rear`` or ``front`` of a side force, or a group of the effect's own that marks its mode; empty: none.

        Returns
        -------
        expression
            The symbol of the state.

        Raises
        ------
        InputError
            There is a state of that name.
        """
        self._declare(name, unit, role)
        state = sp.Symbol(name)
        self.rates[state] = None
        return state

    def set_rate(self, state: Expression, rate: Expression) -> None:
        """Say how a state of :meth:`add_state` changes, in its unit per second and linear in the motion.

        Parameters
        ----------
        state : expression
            Its symbol.
        rate : expression
            In the unit of the state per second.
        """
        self.rates[state] = rate

    def add_mode(self, mode: Mode) -> None:
        """Declare a mode (what an effect lists in ``modes``); two effects may bring the same.

        Parameters
        ----------
        mode : Mode
        """
        if self.modes.setdefault(mode.name, mode) != mode:
            raise InputError(f"two effects declare the mode {mode.name!r} differently; give one of them another name")

    def below(self, speed: Expression) -> Expression:
        """Return a symbol that is 1 at speeds below ``speed`` and 0 above.

        Parameters
        ----------
        speed : expression
            m/s, of parameters only.
        """
        indicator = sp.Symbol(f"below_{len(self.switches)}")
        self.switches[indicator] = speed
        return indicator

    # ------------------------------------------------------------------ closing

    def close(self) -> SymbolicModel:
        """Assemble the matrices once every effect has been applied.

        Raises
        ------
        InputError
            A state without a rate of change, or a mode that no state marks.
        """
        if self.contact_law is None:
            raise ValueError("no contact law has been applied")
        forces = {wheel: self.contact_law.side_force(self, wheel) for wheel in self.wheels}
        check_modes(self.modes.values(), self.states.values())
        for state, rate in self.rates.items():
            if rate is None:
                raise InputError(f"the state {str(state)!r} has no rate of change; give it one with model.set_rate")
        return equations(self, forces)

    def input_names(self) -> tuple[str, ...]:
        """Inputs of the model: the two torques, a side force at the rear frame's mass centre, imposed slip angles."""
        slips = () if self.contact_law is not None and self.contact_law.holds_contact else ("rear_slip", "front_slip")
        return (*self.torques, "lateral_force", *slips)

    def joints(self) -> list[Joint]:
        """Lean, the joints of the effects and steer, from the ground outward."""
        p = self.bicycle
        lean = Joint("lean", 1, 0, 0, 0, frozenset(body.name for body in self.bodies))
        steer = Joint("steer", sp.sin(p["lam"]), sp.cos(p["lam"]), p["w"] + p["c"], 0, STEERED)
        return [lean, *(with_guests(joint, self.bodies) for joint in (*(j for j, _ in self._frame_joints), steer))]

    def coordinates(self) -> list[Coordinate]:
        """Angle and rate of each of :meth:`joints`."""
        return [self.lean, *(coordinate for _, coordinate in self._frame_joints), self.steer]

    def units(self) -> dict[str, str]:
        """SI unit of every state, input and output by name."""
        at_contacts = {f"{wheel.name}_{what}": unit for wheel in self.wheels for what, unit in OF_CONTACT.items()}
        states = {state.name: state.unit for state in self.states.values()}
        return {**dict.fromkeys(self.torques, "N m"), "lateral_force": "N", **at_contacts, **states}

    def _declare(self, name: str, unit: str, role: str, *, joint: bool = False) -> None:
        if name in self.states:
            raise InputError(f"two states are called {name!r}; give the effect's state a name of its own")
        self.states[name] = State(name, unit, role, joint)

    def _declare_angle(self, name: str, role: str, *, joint: bool) -> None:
        self._declare(name, "rad", role, joint=joint)
        self._declare(f"{name}_rate", "rad/s", role, joint=joint)

    @staticmethod
    def _wheel(name: str, x: Expression, radius: Expression) -> Wheel:
        seen = ("slip_velocity", "camber", "yaw_rate", "side_force", "static_load")
        return Wheel(name, f"{name} wheel", x, radius, **{what: sp.Symbol(f"{name} {what}") for what in seen})
