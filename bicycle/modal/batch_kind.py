"""What the bicycles of a batch have in common, also as the numbers that the kernels use."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bicycle.linear_model import LinearModel
from bicycle.modal.naming import Rules
from tyre.base.arrays import Array

Whole = NDArray[np.int64]


class Roles(NamedTuple):
    """The roles of states and the modes they mark, as numbers."""

    of_state: Whole  # (n,), number of the role of each state
    lean: int  # numbers of roles
    steer: int
    yaw: int
    number: int  # of roles
    joint: Whole  # (roles,), 1 where it is the role of a joint
    mark: Array  # (played, roles), 1 where a role marks a mode
    first: Whole  # (played,), the role that must be there
    weight: Array  # (played,)
    oscillation: Whole  # (played,)
    singular: bool  # the models divide by the speed


@dataclass(frozen=True)
class BatchKind:
    """What the bicycles of a batch have in common: states, modes, ``names`` by number, and ``gravity``, m/s^2."""

    rules: Rules
    roles: Roles
    names: tuple[str, ...]
    gravity: float

    @property
    def singular(self) -> bool:
        """Whether the models divide by the speed."""
        return self.rules.singular

    @classmethod
    def of(cls, model: LinearModel) -> "BatchKind":
        """That of a ``model``."""
        rules = Rules.of(model)
        of_state = [state.role for state in rules.states] or [""] * model.order  # matrices alone declare none
        known = [*dict.fromkeys(("lean", "steer", "yaw", *of_state))]
        present = {state.role for state in rules.states}
        roles = Roles(
            of_state=np.array([known.index(role) for role in of_state], np.int64),
            lean=0, steer=1, yaw=2, number=len(known),
            joint=np.array([role in rules.joints for role in known], np.int64),
            mark=np.array([[role in mode.marks for role in known] for mode in rules.played], float).reshape(
                -1, len(known)
            ),
            first=np.array([0 if mode.marks[0] in present else -1 for mode in rules.played], np.int64),
            weight=np.array([mode.weight for mode in rules.played], float),
            oscillation=np.array([mode.oscillation for mode in rules.played], np.int64),
            singular=rules.singular,
        )  # fmt: skip
        others = [f"other_{number}" for number in range(1, model.order + 1)]
        names = ("weave", "capsize", "castering", *(mode.name for mode in rules.played), *others)
        return cls(rules, roles, names, float(model.parameters["g"]))
