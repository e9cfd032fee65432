"""Which tracked branch is weave, wobble, capsize ...: decided by participation factors, at an anchor speed.

The participation of a state in a mode is left times right eigenvector; it has no unit and does not depend on the
scaling of the states. Speeds are judged in units of sqrt(g w), so that names do not depend on the system of units.
Roles after Sharp (1971), Meijaard et al. (2007) and Pacejka, Tire and Vehicle Dynamics, ch. 11.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from bicycle.linear_model import LinearModel
from bicycle.tracking import Array, Complex, Stretch

WALKING = 1.5  # in units of sqrt(g w): about 4.7 m/s, above walking speed
RIDING = 4.0  # about 12.5 m/s: weave, capsize, castering and rider are plain below it
FAST = 8.0  # about 25 m/s: the wobble of a rigid front is plain only near it
FAINT = 0.02  # a role played with less than this share earns no name


@dataclass(frozen=True)
class Naming:
    """``names[i]`` of branch i; two branches that are a pair at the ``anchor`` speed share a name."""

    names: tuple[str, ...]
    anchor: float


def window(model: LinearModel) -> tuple[float, float]:
    """Speeds in which modes are judged, in the model's unit of speed."""
    unit = float(np.sqrt(model.parameters["g"] * model.parameters["w"]))
    return WALKING * unit, FAST * unit


def name_branches(model: LinearModel, stretches: Sequence[Stretch]) -> Naming:
    """Name every branch; those without a role are other_1, other_2 ... from slow to fast."""
    low, high = window(model)
    v = np.concatenate([s.speeds for s in stretches])
    keep = (v >= low) & (v <= high)
    speeds = v[keep]
    values = np.concatenate([s.values for s in stretches])[keep]
    share = state_shares(model.states, np.concatenate([s.participation for s in stretches])[keep])
    evidence = _evidence(values, share, speeds <= low * RIDING / WALKING)

    best, k = (-1.0, -1.0), 0
    units: list[tuple[int, ...]] = []
    taken: dict[int, str] = {}
    for node, row in enumerate(values):
        found = _units(row)
        score = _scores(found, evidence)
        rows, columns = linear_sum_assignment(-score)
        merit = (round(float(score[rows, columns].sum()), 9), _separation(row, found))
        if merit > best:
            best, k, units = merit, node, found
            taken = {int(u): ROLES[r][0] for r, u in zip(rows, columns, strict=True) if score[r, u] > 0}
    others = sorted(
        (u for u in range(len(units)) if u not in taken), key=lambda u: float(np.abs(values[k, units[u][0]]))
    )
    labels = taken | {u: f"other_{number}" for number, u in enumerate(others, 1)}
    label_of = {branch: labels[u] for u, unit in enumerate(units) for branch in unit}
    return Naming(tuple(label_of[branch] for branch in range(values.shape[1])), float(speeds[k]))


ROLES: tuple[tuple[str, float, tuple[str, ...]], ...] = (
    # name, how much its proper place counts, forms it can have
    ("weave", 5.0, ("pair",)),
    ("capsize", 5.0, ("real",)),
    ("wobble", 4.0, ("pair",)),
    ("rider", 3.0, ("pair", "real")),
    ("castering", 2.0, ("real",)),
    ("front_compliance", 1.0, ("pair", "real")),
    ("rear_tyre", 1.0, ("pair", "real")),
)

MARK = {
    "weave": "lean", "capsize": "lean", "wobble": "steer", "castering": "steer", "rider": "rider",
    "front_compliance": "compliance", "rear_tyre": "rear",
}  # fmt: skip
"""The group of states that marks each role."""

Shares = dict[str, Array]  # (m, n) each: share of a group of states in each branch


def state_shares(states: tuple[str, ...], participation: Array) -> Shares:
    """Share of groups of states in each branch, from participation (m, states, n)."""
    groups = {
        "lean": ("lean", "lean_rate"), "steer": ("steer", "steer_rate"), "yaw": ("yaw_rate",),
        "compliance": ("front_compliance", "front_compliance_rate"), "rider": ("rider_lean", "rider_lean_rate"),
        "rear": ("rear_lateral_velocity", "rear_side_force"), "front": ("front_side_force",),
    }  # fmt: skip
    return {
        group: participation[:, [i for i, state in enumerate(states) if state in members], :].sum(1)
        for group, members in groups.items()
    }


def _evidence(values: Complex, share: Shares, riding: NDArray[np.bool_]) -> Shares:
    """For each role the share (n,) with which a branch plays it where it plays it best."""
    pair, real = values.imag != 0, values.imag == 0
    frequency = np.where(pair & (share["rider"] < 0.5), np.abs(values.imag), np.inf)
    lowest = pair & (frequency == frequency.min(1, keepdims=True))
    mainly_steer = np.all([share["steer"] >= other for other in share.values()], axis=0)
    everywhere = np.ones_like(pair)
    front = share["compliance"] + share["front"]

    def clearest(where: NDArray[np.bool_], what: Any) -> Array:
        return np.asarray(np.where(where, what, 0.0).max(0, initial=0.0))

    return {
        "weave": (lowest & riding[:, None]).sum(0) / max(riding.sum(), 1),
        "capsize": clearest(real & riding[:, None], share["lean"]),
        "wobble": clearest(pair, share["steer"]),
        "rider": clearest(riding[:, None], share["rider"]),
        "castering": clearest(real & (values.real < 0) & riding[:, None] & mainly_steer, share["steer"]),
        "front_compliance": clearest(everywhere, front) * bool(share["compliance"].any()),
        "rear_tyre": clearest(everywhere, share["rear"]) * bool(share["rear"].any()),
    }


def _units(values: Complex) -> list[tuple[int, ...]]:
    """Pairs and single real roots as tuples of branches, slow first."""
    units: list[tuple[int, ...]] = []
    for i in np.argsort(np.abs(values), kind="stable"):
        if values[i].imag == 0:
            units.append((int(i),))
        elif values[i].imag > 0:
            units.append((int(i), int(np.flatnonzero(values == values[i].conj())[0])))
    return units


def _scores(units: list[tuple[int, ...]], evidence: Shares) -> Array:
    """Score (roles, units): how well the branches of a unit play each role; a pair that is whole counts twice."""
    score = np.zeros((len(ROLES), len(units)))
    for r, (name, weight, forms) in enumerate(ROLES):
        for u, unit in enumerate(units):
            played = evidence[name][list(unit)]
            if ("pair" if len(unit) == 2 else "real") in forms and played.mean() >= FAINT:
                score[r, u] = weight * played.sum()
    return score


def _separation(values: Complex, units: list[tuple[int, ...]]) -> float:
    """Smallest distance of two modes over their size."""
    root = values[[unit[0] for unit in units]]
    gap = np.abs(root[:, None] - root) / (np.abs(root[:, None]) + np.abs(root) + 1e-300)
    pair = np.array([len(unit) == 2 for unit in units])
    gap[np.diag_indices(len(root))] = np.where(pair, np.abs(root.imag) / (np.abs(root) + 1e-300), 1.0)
    return float(gap.min())
