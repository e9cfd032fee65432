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
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bicycle.derivation.declarations import BASE_MODES, Mode, State
from bicycle.linear_model import LinearModel
from bicycle.modal.anchor import MOSTLY, WALKING, Cores, Unit, core_at, find_anchor, units_at
from bicycle.modal.cast import named_by_role
from bicycle.modal.doubts import NO_ANCHOR, NO_HEIR, NOT_CLEAR, SHORT_PAIR, SURE
from bicycle.modal.identity import APART, conjugate_index, regions
from bicycle.modal.tracking import STEP, TrackedRange, given
from tyre.base.arrays import Array, Complex

LOWEST = 0.3  # of sqrt(g w), about 1 m/s: always tracked from here (from rest where a model allows it)
FAST = 8.0  # about 25 m/s: the roles of tyres and joints are judged from walking speed up to here
HIGHEST = 20.0  # about 60 m/s: always tracked up to here
NEAR_REST = 8.0  # the discriminant of two roots may change so many times as fast below the first node as above
SHORT = 0.1  # about 0.3 m/s: as wide as a step of the track
OVERDAMPED = 0.3  # wobble is an oscillation: steering by a real root counts so much

BY_SIZE = ("weave", "capsize", "castering")  # named at the anchor; the other modes are named by their share

Shares = Mapping[str, Array]  # (m, n) each: share of the states of a role in each branch


@dataclass(frozen=True)
class Naming:
    """``labels[cases[k]][i]``: names of branch i at node k of the track; several where identity is lost.

    ``chance[k]`` where rounding decides between two names. ``names`` are all that the model has, each plain at the
    ``anchor`` speed. ``doubt`` says why other nodes might lead to others (:mod:`bicycle.modal.doubts`).
    """

    names: tuple[str, ...]
    labels: tuple[tuple[tuple[str, ...], ...], ...]
    cases: NDArray[np.intp]
    chance: NDArray[np.bool_]
    anchor: float
    doubt: int


def speed_unit(model: LinearModel) -> float:
    """sqrt(g w), about 3 m/s.

    Parameters
    ----------
    model : LinearModel
    """
    return float(np.sqrt(model.parameters["g"] * model.parameters["w"]))


@dataclass(frozen=True)
class Rules:
    """What names go by, of all models of one kind: states, roles of ``joints`` and ``played`` modes, heaviest first.

    ``singular`` where the models divide by the speed.
    """

    states: tuple[State, ...]
    joints: tuple[str, ...]
    played: tuple[Mode, ...]
    singular: bool

    @classmethod
    def of(cls, model: LinearModel) -> "Rules":
        """Those of a ``model``."""
        states = tuple(model.declared.states)
        joints = tuple(sorted({state.role for state in states if state.joint}))
        return cls(states, joints, roles(model), bool(model.singular_at_rest))

    def window(self, unit: float) -> tuple[float, float]:
        """Speeds (m/s) that are always tracked, where ``unit`` is sqrt(g w) in m/s."""
        return (LOWEST * unit if self.singular else 0.0), HIGHEST * unit


class Evidence(NamedTuple):
    """What names go by at m nodes of n branches; of one model or of many of one kind.

    Attributes
    ----------
    values : complex ndarray, shape (m, n)
        1/s.
    mate : ndarray of int, shape (m, n)
        The other half of each pair, itself of a real root.
    cores : Cores
        Roots of weave, capsize and castering where an anchor may be.
    part : ndarray, shape (m, r, n)
        How far each root plays each of the r modes that are named so.
    share : mapping of str to ndarray, shape (m, n)
        Of the states of each role in each root.
    """

    values: Complex
    mate: NDArray[np.intp]
    cores: Cores
    part: Array
    share: Shares

    @classmethod
    def of(cls, rules: Rules, speeds: Array, values: Complex, participation: Array) -> "Evidence":
        """Of tracked branches.

        Parameters
        ----------
        rules : Rules
        speeds : ndarray, shape (m,)
            In units of sqrt(g w).
        values : complex ndarray, shape (m, n)
            1/s.
        participation : ndarray, shape (m, n, n)
            Of each state (second axis) in each branch.
        """
        share = state_shares(rules.states, participation)
        mate = conjugate_index(values)
        cores = Cores.of(speeds, values, mate, share["lean"] + share["steer"] + share["yaw"])
        form = np.where(values.imag != 0, 1.0, OVERDAMPED)
        part = np.zeros((len(values), len(rules.played), values.shape[1]))
        for r, role in enumerate(rules.played):
            if share[role.marks[0]].any():
                part[:, r] = sum(share[mark] for mark in role.marks) * (form if role.oscillation else 1.0)
        return cls(values, mate, cores, part, share)

    def at(self, nodes: slice) -> "Evidence":
        """Of some ``nodes``."""
        share = {role: each[nodes] for role, each in self.share.items()}
        return Evidence(self.values[nodes], self.mate[nodes], self.cores.at(nodes), self.part[nodes], share)


def name_branches(model: LinearModel, tracked: Sequence[TrackedRange]) -> Naming:
    """Name every branch at every node; those without a role are other_1, other_2 ... from slow to fast.

    Parameters
    ----------
    model : LinearModel
    tracked : sequence of TrackedRange
        Its tracked branches, one for each speed range.
    """
    unit, rules = speed_unit(model), Rules.of(model)
    speeds = np.concatenate([s.speeds for s in tracked])
    values = np.concatenate([s.values for s in tracked])
    participation = np.concatenate([s.participation for s in tracked])
    weight = np.gradient(speeds / unit) * ((speeds / unit >= WALKING) & (speeds / unit <= FAST))
    return name_nodes(rules, unit, speeds, Evidence.of(rules, speeds / unit, values, participation), weight)


def name_nodes(rules: Rules, unit: float, speeds: Array, seen: Evidence, weight: Array) -> Naming:
    """Name every branch of one model at every node.

    Parameters
    ----------
    rules : Rules
    unit : float
        sqrt(g w), m/s.
    speeds : ndarray, shape (m,)
        Rising, m/s.
    seen : Evidence
        At these.
    weight : ndarray, shape (m,)
        Of each speed where the roles of tyres and joints are judged.
    """
    always = rules.window(unit)
    anchor, anchored = find_anchor(speeds / unit, seen.mate, seen.cores)
    units = units_at(seen.values[anchor], seen.mate[anchor])
    lean, steer = seen.share["lean"][anchor], seen.share["steer"][anchor]
    core = core_at(units, seen.cores.core[anchor], lean, steer)
    modes, plain = _modes(speeds, seen, units, anchor, core, rules.joints, always)
    castering = [name for name, _ in modes].index("castering") if "castering" in core else -1
    branches = [branches for _, branches in modes]
    certain = given(speeds / unit, singular=rules.singular)
    found = regions(speeds, seen.values, seen.mate, branches, castering, anchor, always, certain, STEP * unit)
    names, clear = named_by_role(weight, seen.part, [name for name, _ in modes], found, rules.played)
    labels = tuple(tuple(tuple(sorted(names[m] for m in label)) for label in case) for case in found.labels)
    clear = clear and not found.chance[weight > 0].any()
    reasons = {NO_ANCHOR: anchored, SHORT_PAIR: plain, NO_HEIR: found.clear, NOT_CLEAR: clear}
    doubt = next((reason for reason, sure in reasons.items() if not sure), SURE)
    return Naming(tuple(sorted(names)), labels, found.cases, found.chance, float(speeds[anchor]), doubt)


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


def _modes(
    speeds: Array, seen: Evidence, units: Sequence[Unit], anchor: int, core: dict[str, Unit], joints: Sequence[str],
    always: tuple[float, float],
) -> tuple[list[tuple[str, Unit]], bool]:  # fmt: skip
    """The core and everything else at the anchor; real roots that are a pair at another speed are one mode.

    What happens outside the speeds ``always`` tracked does not count, whatever else is asked for. Also says whether it
    is clear: False where such a pair lasts so shortly that other nodes might step over it.
    """
    named = {i for unit in core.values() for i in unit}
    units = [unit for unit in units if not named & set(unit)]
    single = [unit[0] for unit in units if len(unit) == 1]
    inside = (speeds >= always[0]) & (speeds <= always[1])
    mate = seen.mate[inside]
    distance = np.abs(speeds[inside] - speeds[anchor])
    meet = sorted(
        (float(distance[mate[:, i] == j].min()), i, j)
        for number, i in enumerate(single) for j in single[:number] if (mate[:, i] == j).any()
    )  # fmt: skip
    plain = True
    for joint in joints:  # an overdamped one
        own = [i for i in single if seen.share[joint][anchor, i] > MOSTLY]
        met = {*own} & {i for _, *two in meet for i in two}
        plain = plain and (len(own) < 2 or (len(own) == 2 and not met))
        meet += [(np.inf, i, j) for i, j in zip(own[1::2], own[::2], strict=False)]
    joined: set[int] = set()
    short = SHORT * (always[1] / HIGHEST)
    for far, i, j in meet:
        if not joined & {i, j}:
            plain = plain and not any(  # of another couple that meets nearly as near
                0 <= other - far < 2 * short and len({i, j, *two}) == 3 and not joined & {*two} for other, *two in meet
            )
            joined |= {i, j}
            units.append((j, i))
            paired = speeds[inside][mate[:, i] == j]
            plain = plain and not (paired.size and np.ptp(paired) < short)
    units = [unit for unit in units if len(unit) == 2 or unit[0] not in joined]
    units.sort(key=lambda unit: abs(seen.values[anchor, unit[0]]))
    alone = [i for i in single if i not in joined]
    twin = {i: j for unit in (*core.values(), *units) if len(unit) == 2 for i, j in (unit, unit[::-1])}
    plain = plain and not (always[0] < speeds[0] and _meet_at_rest(speeds, seen.values, alone, twin))
    return [*core.items(), *(("", unit) for unit in units)], plain


def _meet_at_rest(speeds: Array, values: Complex, alone: Sequence[int], twin: Mapping[int, int]) -> bool:
    """Whether two real roots may be a pair below the first node that is one mode, or blurs names above it."""
    # one mode: those that are ``alone``; ``twin`` is the other root of a mode of two
    far = NEAR_REST * speeds[0] / (speeds[1] - speeds[0])
    at, above = values[0].tolist(), values[1].tolist()

    def near(i: int, j: int) -> float:
        return abs(at[i] - at[j]) / (abs(at[i]) + abs(at[j]) + 1e-300)

    def blurred(i: int, j: int) -> bool:
        return i in twin and near(i, j) < min(APART, near(i, twin[i]))

    if len(alone) > 1 and any(at[i].imag for i in alone):
        return True
    for i, j in combinations([i for i, root in enumerate(at) if not root.imag], 2):
        if {i, j} <= {*alone} or (twin.get(i) != j and (blurred(i, j) or blurred(j, i))):
            first, second = ((roots[i] - roots[j]) ** 2 for roots in (at, above))
            if not first.real > far * abs((second - first).real):
                return True
    return False
