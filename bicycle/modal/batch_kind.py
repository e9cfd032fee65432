"""What the bicycles of a batch have in common, as the numbers that the kernels use; needs numba (extra ``fast``)."""

from dataclasses import dataclass

import numpy as np

from bicycle.linear_model import LinearModel
from bicycle.modal.anchor_kernel import Roles
from bicycle.modal.naming import roles as roles_of


@dataclass(frozen=True)
class BatchKind:
    """What the bicycles of a batch have in common: states, modes, ``names`` by number, and ``gravity``, m/s^2."""

    roles: Roles
    names: tuple[str, ...]
    singular: bool
    gravity: float

    @classmethod
    def of(cls, model: LinearModel) -> "BatchKind":
        """That of a ``model``."""
        states = model.declared.states
        of_state = [state.role for state in states] or [""] * model.order  # matrices without a bicycle declare none
        known = [*dict.fromkeys(("lean", "steer", "yaw", *of_state))]
        played = roles_of(model)
        present = {state.role for state in states}
        joints = {state.role for state in states if state.joint}
        roles = Roles(
            of_state=np.array([known.index(role) for role in of_state], np.int64),
            lean=0, steer=1, yaw=2, number=len(known),
            joint=np.array([role in joints for role in known], np.int64),
            mark=np.array([[role in mode.marks for role in known] for mode in played], float).reshape(-1, len(known)),
            first=np.array([0 if mode.marks[0] in present else -1 for mode in played], np.int64),
            weight=np.array([mode.weight for mode in played], float),
            oscillation=np.array([mode.oscillation for mode in played], np.int64),
            singular=bool(model.singular_at_rest),
        )  # fmt: skip
        others = [f"other_{number}" for number in range(1, model.order + 1)]
        names = ("weave", "capsize", "castering", *(mode.name for mode in played), *others)
        return cls(roles, names, bool(model.singular_at_rest), float(model.parameters["g"]))
