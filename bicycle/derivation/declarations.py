"""What an effect says of the states and modes that it brings: unit, role, and how a mode is recognised and shown."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from tyre.base.errors import InputError

FORCE = "N"
LAST = 100  # place of a mode that declares none


@dataclass(frozen=True)
class State:
    """A state of the model.

    Attributes
    ----------
    name, unit : str
        Name in results, and SI unit such as ``rad/s`` or ``N m``.
    role : str
        Group of states that it belongs to: a :class:`Mode` is recognised by the share of a group in its motion. States
        of both contacts have the role ``rear`` or ``front``, those of the base model ``lean``, ``steer`` or ``yaw``.
        Empty: it marks no mode.
    joint : bool
        Whether it is the angle or the rate of a joint that an effect adds.
    """

    name: str
    unit: str
    role: str = ""
    joint: bool = False

    @property
    def forcelike(self) -> bool:
        """Whether its unit is a force times something: N, N m ... (scaled by the weight of the bicycle)."""
        return self.unit.split("/")[0].split(" ")[0] == FORCE


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
    weight : float
        What the share counts where several modes claim the same root, on the mean over a range of speed. Wobble, which
        steering marks, has 4: by default a joint's mode has its name before wobble, also where weave comes close to it
        and the two exchange character. A tyre or a joint that makes the wobble has 1.
    oscillation : bool
        Whether a real root plays the role less well than a pair.
    place : int
        Position among the modes of a table; those without come last, by name.
    look : int, optional
        Number of the look in figures (:data:`bicycle.modal.looks.LOOKS`); without, one that follows from the name.
    main : bool
        Whether figures choose their window so that the mode is seen.
    """

    name: str
    marks: tuple[str, ...] = ()
    weight: float = 8.0
    oscillation: bool = False
    place: int = LAST
    look: int | None = None
    main: bool = False

    def __post_init__(self) -> None:
        if not self.marks:
            object.__setattr__(self, "marks", (self.name,))


BASE_MODES = (
    Mode("weave", marks=("lean",), place=0, look=0, main=True),
    Mode("wobble", marks=("steer",), weight=4.0, oscillation=True, place=1, look=2, main=True),
    Mode("capsize", marks=("lean",), place=2, look=3, main=True),
    Mode("castering", marks=("steer",), place=3, look=4),
)
"""The modes of every model: weave, capsize and castering are the slow roots of lean and steer, wobble is a role."""


@dataclass(frozen=True)
class Declarations:
    """What is declared of one model.

    Attributes
    ----------
    states : tuple of State
        In the order of the model's states.
    modes : tuple of Mode
        Those that the effects bring; weave, wobble, capsize and castering are of every model.
    units : mapping of str to str
        SI unit of every state, input and output by name.
    """

    states: tuple[State, ...] = ()
    modes: tuple[Mode, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)


def check_modes(modes: Iterable[Mode], states: Iterable[State]) -> None:
    """Refuse a mode that no state marks.

    Parameters
    ----------
    modes : iterable of Mode
        What the effects of a model bring.
    states : iterable of State
        Those of the model.

    Raises
    ------
    InputError
        Naming the mode, and the roles that there are.
    """
    roles = {state.role for state in states if state.role}
    for mode in modes:
        if mode.marks[0] not in roles:
            raise InputError(
                f"the mode {mode.name!r} is marked by states of the role {mode.marks[0]!r}, and there are none: "
                f"the roles are {', '.join(sorted(roles))}; give a joint or a state of the effect that role"
            )
