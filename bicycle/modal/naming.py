"""Which root is weave, wobble, capsize ...: decided where the modes are plain, then carried along speed.

At low riding speed the four roots of lean and steer (weave, capsize, castering) are the slowest of all, because a
tyre that hardly moves forward is a stiff spring: there, at the anchor speed, they are named by size and by the
participation of lean, steer and yaw. The pairs that remain are named by the participation of the states that mark a
mode, as the effects declare it (:class:`Mode`), averaged over a range of speed. Participation (left times right
eigenvector) has no unit and speeds are judged in units of sqrt(g w), so that names do not depend on the units.
Roles after Sharp (1971), Meijaard et al. (2007) and Pacejka, Tire and Vehicle Dynamics, ch. 11.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from bicycle.derivation.declarations import BASE_MODES, Mode, State
from bicycle.linear_model import LinearModel
from bicycle.modal.identity import Regions, conjugate_index, regions
from bicycle.modal.tracking import TrackedRange
from tyre.base.arrays import Array, Complex

LOWEST = 0.3  # of sqrt(g w), about 1 m/s: always tracked from here (from rest where a model allows it)
SLOW, QUICK = 0.7, 3.0  # about 2 to 9 m/s: the anchor lies between
WALKING, FAST = 1.5, 8.0  # about 5 to 25 m/s: the roles of tyres and joints are judged between
HIGHEST = 20.0  # about 60 m/s: always tracked up to here
MOSTLY = 0.5  # a root of lean, steer and yaw has at least this share of them
FAINT = 0.02  # a role played with less than this share earns no name
MARGIN = 0.1  # by which a role is clearly played
SHORT = 0.1  # about 0.3 m/s: as wide as a step of the track
OVERDAMPED = 0.3  # wobble is an oscillation: steering by a real root counts so much

BY_SIZE = ("weave", "capsize", "castering")  # named at the anchor; the other modes are named by their share

Unit = tuple[int, ...]  # branches of a pair or of a single real root
Shares = Mapping[str, Array]  # (m, n) each: share of the states of a role in each branch


@dataclass(frozen=True)
class Naming:
    """``labels[cases[k]][i]``: names of branch i at node k of the track; several where identity is lost.

    ``names`` are all that the model has, each plain at the ``anchor`` speed. ``clear`` where other nodes would not lead
    to others.
    """

    names: tuple[str, ...]
    labels: tuple[tuple[tuple[str, ...], ...], ...]
    cases: NDArray[np.intp]
    anchor: float
    clear: bool


def window(model: LinearModel) -> tuple[float, float]:
    """Speeds that are always tracked, in the model's unit of speed.

    Parameters
    ----------
    model : LinearModel
    """
    unit = speed_unit(model)
    return (LOWEST * unit if model.singular_at_rest else 0.0), HIGHEST * unit


def speed_unit(model: LinearModel) -> float:
    """sqrt(g w), about 3 m/s.

    Parameters
    ----------
    model : LinearModel
    """
    return float(np.sqrt(model.parameters["g"] * model.parameters["w"]))


def name_branches(model: LinearModel, tracked: Sequence[TrackedRange]) -> Naming:
    """Name every branch at every node; those without a role are other_1, other_2 ... from slow to fast.

    Parameters
    ----------
    model : LinearModel
    tracked : sequence of TrackedRange
        Its tracked branches, one for each speed range.
    """
    unit = speed_unit(model)
    speeds = np.concatenate([s.speeds for s in tracked])
    values = np.concatenate([s.values for s in tracked])
    share = state_shares(model.declared.states, np.concatenate([s.participation for s in tracked]))

    anchor, core = _anchor(speeds / unit, values, share)
    joints = sorted({state.role for state in model.declared.states if state.joint})
    modes, plain = _modes(speeds, values, share, anchor, core, joints, window(model))
    castering = [name for name, _ in modes].index("castering") if "castering" in core else -1
    found = regions(speeds, values, [branches for _, branches in modes], castering, anchor, window(model))
    names, clear = _roles(speeds / unit, values, share, modes, found, roles(model))
    labels = tuple(tuple(tuple(sorted(names[m] for m in label)) for label in case) for case in found.labels)
    return Naming(tuple(sorted(names)), labels, found.cases, float(speeds[anchor]), clear and plain and found.clear)


def every_mode(model: LinearModel) -> tuple[Mode, ...]:
    """The modes that a model may have by name, in the order of tables; others are ``other_1`` ...

    Parameters
    ----------
    model : LinearModel
    """
    return tuple(sorted((*BASE_MODES, *model.declared.modes), key=lambda mode: (mode.place, mode.name)))


def roles(model: LinearModel) -> tuple[Mode, ...]:
    """Those of :func:`every_mode` that are named by the share of states in their motion, the heaviest first.

    Parameters
    ----------
    model : LinearModel
    """
    found = (mode for mode in every_mode(model) if mode.name not in BY_SIZE)
    return tuple(sorted(found, key=lambda mode: (-mode.weight, mode.name)))


def state_shares(states: Sequence[State], participation: Array) -> Shares:
    """Share of the states of each role in each branch.

    Parameters
    ----------
    states : sequence of State
        Those of the model, n of them.
    participation : ndarray, shape (m, n, n)
        Of each state (second axis) in each branch (third) at m speeds.

    Returns
    -------
    mapping of str to ndarray, shape (m, n)
        By role; zero for a role that no state has.
    """
    nothing = np.zeros((len(participation), participation.shape[2]))
    found: defaultdict[str, Array] = defaultdict(lambda: nothing)
    for role in {state.role for state in states}:
        found[role] = participation[:, [i for i, state in enumerate(states) if state.role == role], :].sum(1)
    return found


def units_of(values: Complex) -> list[list[Unit]]:
    """At each node the pairs and single real roots of the branches (m, n) as tuples of branches, slow first.

    Parameters
    ----------
    values : ndarray, shape (m, n)
        Eigenvalues, 1/s, a column a branch.
    """
    mate, upper = conjugate_index(values), values.imag > 0
    shown = (upper | (mate == np.arange(values.shape[1]))).tolist()
    order = np.argsort(np.abs(values), axis=1, kind="stable").tolist()
    return [
        [(i,) if of[i] == i else (i, of[i]) for i in slow_first if here[i]]
        for of, here, slow_first in zip(mate.tolist(), shown, order, strict=True)
    ]


def _anchor(speeds: Array, values: Complex, share: Shares) -> tuple[int, dict[str, Unit]]:
    """Node at which weave, capsize and castering are plainest, and their branches there."""
    nodes = np.flatnonzero((speeds >= SLOW) & (speeds <= QUICK))
    moving = (share["lean"] + share["steer"] + share["yaw"])[nodes] >= MOSTLY
    roots = values[nodes]
    size = np.where(moving & (roots.imag >= 0), np.abs(roots), np.inf)
    slowest = np.argsort(size, axis=1, kind="stable")[:, :3]
    is_core = np.isfinite(np.take_along_axis(size, slowest, 1))
    pair = np.take_along_axis(roots.imag, slowest, 1) > 0
    both_real = (is_core & ~pair).sum(1, keepdims=True) == 2
    is_core &= np.where(pair, np.cumsum(pair, axis=1) == 1, both_real)
    found = is_core.sum(1)
    if not found.any():
        return int(np.abs(speeds - WALKING).argmin()), {}
    core = np.zeros(roots.shape, bool)
    np.put_along_axis(core, slowest, is_core, 1)
    best = np.where(found == found.max(), _plainness(roots, core).round(9), -1.0).argmax()
    k = nodes[best]
    return int(k), _core(units_of(values[[k]])[0], core[best], share["lean"][k], share["steer"][k])


def _core(units: Sequence[Unit], core: NDArray[np.bool_], lean: Array, steer: Array) -> dict[str, Unit]:
    """A pair and two real roots, where these are the slowest of lean, steer and yaw; else what there is of them."""
    found: dict[str, Unit] = {}
    pairs, reals = ([unit for unit in units if core[unit[0]] and len(unit) == length] for length in (2, 1))
    if pairs:
        found["weave"] = pairs[0]
    if reals:
        leaning = [lean[i] / (lean[i] + steer[i] + 1e-300) for (i,) in reals]
        found["capsize"], found["castering"] = reals if leaning[0] >= leaning[1] else reals[::-1]
    return found


def _plainness(values: Complex, core: NDArray[np.bool_]) -> Array:
    """How far the core is from meeting, at each node: among itself, of the pair with itself, and with other modes."""
    size = np.abs(values)
    gap = np.abs(values[:, :, None] - values[:, None, :]) / (size[:, :, None] + size[:, None, :] + 1e-300)
    other = core[:, :, None] & (values.imag >= 0)[:, None, :] & ~np.eye(values.shape[1], dtype=bool)
    own = np.where(core & (values.imag > 0), values.imag / np.maximum(size, 1e-300), np.inf)
    return np.asarray(np.minimum(np.where(other, gap, np.inf).min((1, 2)), own.min(1)))


Branches = tuple[str, Unit]  # name ("" as long as it has none) and branches


def _modes(
    speeds: Array, values: Complex, share: Shares, anchor: int, core: dict[str, Unit], joints: Sequence[str],
    always: tuple[float, float],
) -> tuple[list[Branches], bool]:  # fmt: skip
    """The core and everything else at the anchor; real roots that are a pair at another speed are one mode.

    What happens outside the speeds ``always`` tracked does not count, whatever else is asked for. Also says whether it
    is clear: False where such a pair lasts so shortly that other nodes might step over it.
    """
    named = {i for unit in core.values() for i in unit}
    units = [unit for unit in units_of(values[[anchor]])[0] if not named & set(unit)]
    single = [unit[0] for unit in units if len(unit) == 1]
    inside = (speeds >= always[0]) & (speeds <= always[1])
    mate = conjugate_index(values[inside])
    distance = np.abs(speeds[inside] - speeds[anchor])
    meet = sorted(
        (float(distance[mate[:, i] == j].min()), i, j)
        for number, i in enumerate(single) for j in single[:number] if (mate[:, i] == j).any()
    )  # fmt: skip
    for joint in joints:  # an overdamped one
        own = [i for i in single if share[joint][anchor, i] > MOSTLY]
        meet += [(np.inf, i, j) for i, j in zip(own[1::2], own[::2], strict=False)]
    joined: set[int] = set()
    plain = True
    for _, i, j in meet:
        if not joined & {i, j}:
            joined |= {i, j}
            units.append((j, i))
            seen = speeds[inside][mate[:, i] == j]
            plain = plain and not (seen.size and np.ptp(seen) < SHORT * (always[1] / HIGHEST))
    units = [unit for unit in units if len(unit) == 2 or unit[0] not in joined]
    units.sort(key=lambda unit: float(np.abs(values[anchor, unit[0]])))
    return [*core.items(), *(("", unit) for unit in units)], plain


def _roles(
    speeds: Array, values: Complex, share: Shares, modes: list[Branches], found: Regions, played: Sequence[Mode]
) -> tuple[list[str], bool]:
    """Name the modes of tyres and joints by their mean share over a range of speed; and whether that is clear."""
    weight = np.gradient(speeds) * ((speeds >= WALKING) & (speeds <= FAST))
    own = np.array([[[label == (m,) for label in case] for m in range(len(modes))] for case in found.labels])
    weight = weight[:, None, None] * own[found.cases]  # (nodes, modes, branches)
    total = weight.sum((0, 2)) + 1e-300
    form = np.where(values.imag != 0, 1.0, OVERDAMPED)
    mean, factors = np.zeros((len(played), len(modes))), np.array([[role.weight] for role in played])
    for r, role in enumerate(played):
        if share[role.marks[0]].any():
            part = sum(share[mark] for mark in role.marks) * (form if role.oscillation else 1.0)
            mean[r] = np.einsum("kmi,ki->m", weight, part) / total
    names = [name for name, _ in modes]
    free = [m for m, name in enumerate(names) if not name]
    cast, clear = _cast(mean[:, free], factors)
    for row, column in cast:
        names[free[column]] = played[row].name
    others = [m for m in free if not names[m]]
    for number, m in enumerate(others, 1):
        names[m] = f"other_{number}"
    return names, clear


def _cast(mean: Array, factors: Array) -> tuple[set[tuple[int, int]], bool]:
    """Roles and modes that belong together by their mean share (roles, modes); and whether by a clear margin."""

    def best(least: float) -> tuple[Array, set[tuple[int, int]]]:
        played = factors * np.where(mean >= least, mean, 0.0)
        rows, columns = linear_sum_assignment(-played)
        return played, {(int(r), int(c)) for r, c in zip(rows, columns, strict=True) if played[r, c] > 0}

    played, cast = best(FAINT)
    whole = sum(played[pair] for pair in cast)
    clear = best(FAINT / (1 + MARGIN))[1] == best(FAINT * (1 + MARGIN))[1] == cast
    for pair in cast:
        without = played.copy()
        without[pair] = 0
        rows, columns = linear_sum_assignment(-without)
        clear = clear and bool(without[rows, columns].sum() < (1 - MARGIN) * whole)
    return cast, clear
