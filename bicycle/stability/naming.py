"""Names of eigenvalues by their character, at each speed by itself: weave, wobble, capsize, castering, tyres, joints.

Every root is judged by the share of the states of each role in it, |left times right eigenvector|, which has no unit,
and by how much of its motion is steering. The pairs of one point are given the names that fit best together; real
roots are named by their order on the axis and by their shares. A pair whose next best name fits nearly as well carries
both. Roles after Sharp (1971), Meijaard et al. (2007) and Pacejka, Tire and Vehicle Dynamics, ch. 11.
"""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bicycle.effects.effect import Effect
from bicycle.effects.effect_registry import packaged_effects, registry
from bicycle.equations.declarations import BASE_MODES, Mode, State
from bicycle.equations.speed_polynomial import SpeedPolynomial
from bicycle.model.eigen import BATCH, Participation, kernel, participation_at, spectra
from bicycle.model.state_space import LinearModel
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError, refuse_unknown

Whole = NDArray[np.intp]
Mask = NDArray[np.bool_]
WEAVE, WOBBLE, CAPSIZE, CASTERING = range(4)  # places in Rules.names
CORE = CAPSIZE  # row of the weights
NONE = -1
FULL = -np.inf
CORE_NAMES = np.array(
    [[WEAVE, WEAVE, CAPSIZE, CASTERING], [WEAVE, WEAVE, NONE, NONE], [CAPSIZE, NONE, NONE, NONE], [NONE] * 4]
)
"""Names of real roots of lean and steer from the right: by themselves, with capsize and castering as a pair, with
weave, with both."""
BORN_NAMES = np.array(
    [[WEAVE, WEAVE, CAPSIZE, CASTERING], [CAPSIZE, WEAVE, WEAVE, CASTERING], [CAPSIZE, CASTERING, WEAVE, WEAVE]]
)
"""Names of four such roots by how many of them stay real to the right of the weave when it is born."""


@dataclass(frozen=True)
class Limits:
    """Numbers that decide names; shares and scores have no unit."""

    doubt: float = 0.08  # a pair whose next best name lacks less than this carries both
    lean: float = 3.0  # weight of the share of lean in weave
    yaw: float = 0.5  # of yaw in weave
    slowness: float = 9.0  # of 1 / (1 + |lambda| / (slow sqrt(g / w))) in weave
    slow: float = 10.0  # of sqrt(g / w), about 30 1/s
    still: float = 4.0  # of sqrt(g / w), about 12 1/s: capsize and castering that are a pair are slower
    core: float = 0.5  # a root of lean, steer and yaw has at least this share of them
    weave: float = 0.3  # a pair that is weave has at least this share of them
    first: float = 1.0  # what being such a root counts for weave
    steer: float = 1.5  # weight of the share of steer in wobble
    steering: float = 0.5  # of the steer angle among all angles in wobble
    node: float = 0.15  # of sqrt(g w): speeds at which the birth of weave is looked for
    nodes: int = 13  # of these
    slowest: float = 1e-4  # of sqrt(g w), about 0.3 mm/s: slip without relaxation divides by the speed
    fastest: float = 320.0  # of sqrt(g w), about 1000 m/s
    stiffest: float = 1e8  # of sqrt(g / w): with roots faster than that, slow ones have no digits left
    walking: float = 1.5  # of sqrt(g w), about 5 m/s: stiffness is judged there


LIMITS = Limits()


def known_modes() -> Mapping[str, Mode]:
    """The modes of every model and of every effect (:mod:`bicycle.effects`), in the order of tables."""
    return _by_name(registry().values())


def packaged_modes() -> Mapping[str, Mode]:
    """Modes of the package alone, in the order of tables."""
    return _by_name(packaged_effects().values())


def _by_name(effects: Iterable[type[Effect]]) -> Mapping[str, Mode]:
    mode_by_name = {mode.name: mode for mode in (*BASE_MODES, *(mode for effect in effects for mode in effect.modes))}
    return dict(sorted(mode_by_name.items(), key=lambda item: (item[1].place, item[0])))


def every_mode(model: LinearModel) -> tuple[Mode, ...]:
    """The modes that a model may have by name, in the order of tables; others are ``other_1`` ..."""
    return tuple(sorted((*BASE_MODES, *model.declared.modes), key=lambda mode: (mode.place, mode.name)))


def refuse_impossible_mode(name: str, effects: Iterable[Effect], *, where: str = "") -> None:
    """Refuse a name that no root of a model with some effects can have; this needs no equations."""
    if not re.fullmatch(r"other_\d+", name):
        refuse_unknown("mode", [name], _by_name(type(effect) for effect in effects), where=where)


def speed_unit(model: LinearModel) -> float:
    """sqrt(g w) of a model, about 3 m/s."""
    return float(np.sqrt(model.parameters["g"] * model.parameters["w"]))


@dataclass(frozen=True)
class Rules:
    """Rules of names, the same in all models with the same states."""

    # weave, wobble, capsize, castering, the modes that effects declare, other_1 ...; a name is given by its place
    names: tuple[str, ...]
    # (5 + declared, n), what each state counts for weave, wobble, the core (lean, steer and yaw), castering, each
    # declared mode, and for none (states without a role)
    weights: Array
    # (3, n), steer, the angles and the yaw rate among the states: steer over all angles is how much a root steers, the
    # yaw angle being its rate over |lambda|
    ratio: Array
    slips: bool  # whether contacts slip: else there is no wobble

    @classmethod
    def of(cls, model: LinearModel) -> "Rules":
        """Naming rules for the states of a ``model``."""
        states = tuple(model.declared.states) or tuple(State(name, "") for name in model.states)
        return _rules_of(states, tuple(mode for mode in every_mode(model) if mode not in BASE_MODES))

    @cached_property
    def usual(self) -> tuple[str, ...]:
        """Names that every such model has a place for, without other_1 ...; none where no state has a role."""
        skipped = () if self.slips else (WOBBLE,)
        places = [k for k in range(len(self.weights) - 1) if k not in skipped]
        return tuple(self.names[k] for k in places) if self.weights[:-1].any() else ()

    @property
    def declared(self) -> range:
        """Places of the modes that effects declare."""
        return range(4, len(self.weights) - 1)

    def name(self, first: int, second: int = NONE) -> str:
        """The name with the place ``first``, or both names of a root in doubt, as in "wobble+weave"."""
        return self.names[first] if second == NONE else f"{self.names[first]}+{self.names[second]}"


@lru_cache(maxsize=64)
def _rules_of(states: tuple[State, ...], declared: tuple[Mode, ...]) -> Rules:
    """Naming rules for a model with these ``states`` and the modes that its effects have ``declared``."""
    contact = ("rear", "front")
    weights: list[dict[str, float]] = [
        {"lean": LIMITS.lean, "yaw": LIMITS.yaw},
        {"steer": LIMITS.steer},
        {"lean": 1.0, "steer": 1.0, "yaw": 1.0},
        {"steer": 1.0},
    ]
    for mode in declared:
        marks = contact if mode.marks[0] in contact else mode.marks
        weights.append(dict.fromkeys(marks, 1.0))
    weights.append({"": 1.0})
    ratio = [
        [s.name == "steer" for s in states],
        [s.unit == "rad" for s in states],
        [s.name == "yaw_rate" for s in states],
    ]
    return Rules(
        names=tuple(mode.name for mode in (*BASE_MODES, *declared))
        + tuple(f"other_{number}" for number in range(1, len(states) + 1)),
        weights=np.array([[row.get(state.role, 0.0) for state in states] for row in weights]),
        ratio=np.array(ratio, float),
        slips=any(state.role in contact for state in states),
    )


class Named(NamedTuple):
    """Roots (k, n) in 1/s, and the places of their names in ``Rules.names``."""

    values: Complex  # (k, n), 1/s
    first: Whole  # (k, n), place of the name
    second: Whole  # (k, n), place of a second name: of a pair in doubt, of capsize and castering as a pair; else NONE
    clear: Mask  # (k,); False: four real core roots, whose names follow from the next speed at which weave is a pair

    def take(self, points: slice) -> "Named":
        """Take some of the points."""
        parts: tuple[Any, ...] = self
        return Named(*(part[points] for part in parts))


def name_points(
    rules: Rules, polynomial: SpeedPolynomial, unit: Array, gravity: float | Array, owner: Whole, speeds: Array
) -> Named:
    """Roots and names at k points: bicycle ``owner`` (k,) at ``speeds`` (k,), m/s, with sqrt(g w) = ``unit`` (m,)."""

    def name_batches(owner: Whole, speeds: Array) -> Named:
        parts = []
        for start in range(0, max(len(speeds), 1), BATCH):
            batch, v = owner[start : start + BATCH], speeds[start : start + BATCH]
            at = participation_at(polynomial.take(batch), v, rules.weights, rules.ratio)
            parts.append(name_roots(rules, (gravity / unit)[batch], at))
        return parts[0] if len(parts) == 1 else Named(*(np.concatenate(part) for part in zip(*parts, strict=True)))

    births = LIMITS.node * np.arange(1, LIMITS.nodes)
    slow = owner[speeds < births[3] * unit[owner]]
    slow = np.unique(slow) if slow.size else slow  # weave is mostly born within the first four: they are named along
    many = np.repeat(slow, 4)
    named_points = name_batches(
        np.concatenate([owner, many]), np.concatenate([speeds, unit[many] * np.tile(births[:4], len(slow))])
    )
    at_points, at_nodes = named_points.take(slice(len(owner))), named_points.take(slice(len(owner), None))
    open_ = np.flatnonzero(~at_points.clear)
    early = speeds[open_] < births[3] * unit[owner[open_]]
    if early.any():
        place = np.searchsorted(slow, owner[open_[early]])
        undecided = _name_by_birth(at_points, open_[early], place, speeds, unit[slow, None] * births[:4], at_nodes)
        open_ = np.concatenate([undecided, open_[~early]])
    if open_.size:
        bicycles, place = np.unique(owner[open_], return_inverse=True)
        nodes = unit[bicycles, None] * births[4:]
        at_nodes = name_batches(np.repeat(bicycles, nodes.shape[1]), nodes.ravel())
        _name_by_birth(at_points, open_, place, speeds, nodes, at_nodes)
    return at_points


def name_stack(rules: Rules, polynomial: SpeedPolynomial, unit: Array, gravity: float | Array, speeds: Array) -> Named:
    """Roots of many bicycles and their names at ``speeds`` (m, k), m/s: arrays (m, k, n), roots sorted."""
    m, k = speeds.shape
    named = name_points(rules, polynomial, unit, gravity, np.repeat(np.arange(m), k), speeds.ravel())
    order = np.lexsort((named.values.imag, named.values.real), axis=1)
    parts: list[Any] = [np.take_along_axis(part, order, 1).reshape(m, k, -1) for part in named[:3]]
    return Named(parts[0], parts[1], parts[2], named.clear.reshape(m, k))


def name_along(model: LinearModel, rules: Rules, speeds: Array) -> Named:
    """Roots of one model and their names at ``speeds`` (k,), m/s; where equations switch, those that hold there."""
    unit = np.array([speed_unit(model)])
    count = len(speeds)
    shape = (count, model.order)
    named_roots = Named(
        np.empty(shape, complex), np.empty(shape, np.intp), np.empty(shape, np.intp), np.empty(count, bool)
    )
    for number, places in model.by_range(speeds):
        first_bicycle = np.zeros(len(places), np.intp)
        part = name_points(
            rules, stack_of_one(model, number), unit, model.parameters["g"], first_bicycle, speeds[places]
        )
        for whole, part_of_range in zip(named_roots, part, strict=True):
            whole[places] = part_of_range
    return named_roots


def stack_of_one(model: LinearModel, number: int) -> SpeedPolynomial:
    """The state matrix of the speed range ``number`` of a model as that of a single bicycle of a stack, (1, n, n)."""
    polynomial = model.coefficients[number]
    n = model.order
    return SpeedPolynomial({power: matrix[None] for power, matrix in polynomial.items()}, shape=(1, n, n))


def name_roots(rules: Rules, rate: Array, at: Participation) -> Named:
    """Names of the roots of k matrices, each by itself; ``rate`` (k,) is sqrt(g / w), 1/s."""
    values, share, steering = at
    size = np.abs(values)
    first, second = (np.full(values.shape, NONE) for _ in range(2))
    is_core = share[:, CORE] >= LIMITS.core
    pairs = values.imag > 0
    count = int(pairs.sum(1).max(initial=0))
    if count:
        upper = np.argsort(~pairs, axis=1, kind="stable")[:, :count]
        joined = _capsize_and_castering(rules, rate, values, size, is_core)
        slowness = 1 / (1 + size / (LIMITS.slow * rate[:, None]))
        weave = share[:, WEAVE] + LIMITS.slowness * slowness + LIMITS.first * is_core
        weave[(share[:, CORE] < LIMITS.weave) | _behind_the_core(values, size, is_core, joined)] = FULL
        played = [weave, *(share[:, k] for k in rules.declared)]
        places = [WEAVE, *rules.declared, NONE]
        if rules.slips:
            played.append(share[:, WOBBLE] + LIMITS.steering * steering)
            places.insert(-1, WOBBLE)
        rows = np.arange(len(values))[:, None]
        is_pair = (pairs & ~joined)[rows, upper]
        score = np.where(is_pair, np.stack(played)[:, rows, upper], FULL)
        for names, chosen in zip((first, second), assign_pairs(score), strict=True):
            names[rows, upper] = np.where(is_pair, np.array(places)[chosen], NONE)
        first[joined], second[joined] = CAPSIZE, CASTERING
    clear = _name_real(rules, values, share, is_core, first)
    _number_nameless(rules, size, values.imag >= 0, first)
    lower = values.imag < 0  # it stands next to the upper half
    for names in (first, second):
        names[:, 1:][lower[:, 1:]] = names[:, :-1][lower[:, 1:]]
    return Named(values, first, second, clear)


def _capsize_and_castering(rules: Rules, rate: Array, values: Complex, size: Array, is_core: Mask) -> Mask:
    """Pairs that capsize and castering form: slow, stable, with exactly two roots of the core to their right."""
    slow = is_core & (size < LIMITS.still * rate[:, None]) if rules.slips else is_core
    joint_pairs = (values.imag > 0) & slow
    if rules.slips:
        joint_pairs &= values.real < 0
    k = np.flatnonzero(joint_pairs.any(1))
    if k.size:
        core = np.where(slow[k], values.real[k], -np.inf)
        count_right = (core[:, None, :] > values.real[k, :, None] + 1e-9 * size[k, :, None]).sum(2)
        joint_pairs[k] &= count_right == 2
    return joint_pairs


def _behind_the_core(values: Complex, size: Array, is_core: Mask, joined: Mask) -> Mask:
    """Roots faster than four roots of the core that are real or capsize and castering: weave is two of those then."""
    behind = np.zeros(values.shape, bool)
    whole = is_core & ((values.imag == 0) | joined | np.roll(joined, 1, axis=1))
    k = np.flatnonzero(whole.sum(1) > 3)
    if k.size:
        slower = np.where(whole[k], size[k], np.inf)[:, None, :] < size[k][:, :, None]
        behind[k] = slower.sum(2) > 3
    return behind


def assign_pairs(score: Array) -> tuple[Whole, Whole]:
    """Best joint naming of the pairs of many points, and the next best name of each pair if it lacks little.

    ``score`` (names, points, pairs); the numbers (points, pairs) of the names are as many as there are for none.
    """
    j, m, p = score.shape
    if kernel is not None and p <= 16 and j <= 6:
        best, second = np.empty((m, p), np.int64), np.empty((m, p), np.int64)
        kernel.assign(p, j, LIMITS.doubt, np.ascontiguousarray(score), best, second)
        return best, second
    score = score.transpose(2, 0, 1)
    cube = (2,) * j  # a set of names is a corner

    def half(sets: Array, name: int, corner: int) -> Array:
        return np.asarray(sets[(slice(None),) * name + (corner,)])

    before = np.full((p + 1, *cube, m), -np.inf)  # best sum of the earlier pairs that take exactly these names
    before[(0,) * (j + 1)] = 0.0
    after = np.zeros((p + 1, *cube, m))  # best sum of the later pairs with these names to choose from
    for sets, steps in (
        (before, [(k, k + 1, k) for k in range(p)]),
        (after, [(k + 1, k, k) for k in range(1, p)][::-1]),
    ):
        for old, new, pair in steps:
            sets[new] = sets[old]
            for name in range(j):
                with_name = half(sets[new], name, 1)
                np.maximum(with_name, half(sets[old], name, 0) + score[pair, name], out=with_name)
    total = np.empty((p, j + 1, m))
    for k in range(p):
        available = after[k + 1][(slice(None, None, -1),) * j]  # indexed by the names that are taken
        total[k, j] = (before[k] + available).reshape(-1, m).max(0)
        for name in range(j):
            together = half(before[k], name, 0) + half(available, name, 1)
            total[k, name] = together.reshape(-1, m).max(0) + score[k, name]
    best = total.argmax(1)
    top = total.max(1)
    np.put_along_axis(total, best[:, None], -np.inf, 1)
    second = total[:, :j].argmax(1)
    close = total[:, :j].max(1) > top - LIMITS.doubt
    return best.T, np.where(close & (best < j), second, j).T


def _name_real(rules: Rules, values: Complex, share: Array, is_core: Mask, first: Whole) -> Mask:
    """Name real roots in place: the core by its order from the right, the others by share; which points are clear."""
    weave = (first == WEAVE).any(1)
    joined = (first == CAPSIZE).any(1)
    real = values.imag == 0
    core = real & is_core
    order = 2 * weave + joined
    for k, most in ((np.flatnonzero(weave), 1), (np.flatnonzero(~weave), 4)):  # beside weave there is one to name
        if not k.size:
            continue
        place = np.where(core[k], -values.real[k], np.inf)
        place = place.argmin(1)[:, None] if most == 1 else place.argsort(1, kind="stable")[:, :most]
        names, rows = CORE_NAMES[order[k], : place.shape[1]], k[:, None]
        first[rows, place] = np.where(core[rows, place], names, first[rows, place])
    _name_by_share(rules, share, real & (first == NONE) & (share[:, -1] < LIMITS.core), first)
    return np.asarray(weave | joined | (core.sum(1) != 4))


def _name_by_share(rules: Rules, share: Array, nameless: Mask, first: Whole) -> None:
    """Give the real roots that are ``nameless`` the modes that still have room, the plainest first, in place."""
    rows = np.flatnonzero(nameless.any(1))
    if not rows.size:
        return
    modes = np.array([CASTERING, *rules.declared, *([WOBBLE] if rules.slips else [])])
    most = np.where(modes == CASTERING, 1, 2)
    named, points = first[rows], np.arange(len(rows))
    room = most - (named[:, :, None] == modes).sum(1) * most  # a pair takes all of it
    room[:, 0] = np.where((named == CAPSIZE).sum(1) > 1, 0, room[:, 0])
    score = share[rows][:, modes]
    score[:, 0] += 0.5  # a declared mode has a root first, then castering; wobble takes what they leave
    score[:, 1 : 1 + len(rules.declared)] += np.where(room[:, 1 : 1 + len(rules.declared)] == 2, 1.0, 0.0)[:, :, None]
    if rules.slips:
        score[:, -1] = 0.4
    score = np.where(nameless[rows][:, None, :], score, FULL)
    for _ in range(int(nameless.sum(1).max())):
        score[room <= 0] = FULL
        mode, root = np.divmod(score.reshape(len(rows), -1).argmax(1), share.shape[2])
        good = score[points, mode, root] > FULL
        k, mode, root = points[good], mode[good], root[good]
        named[k, root] = modes[mode]
        room[k, mode] -= 1
        score[k, :, root] = FULL
        score[k, mode] -= np.where(mode == 0, 0.0, 1.0)[:, None]  # its second root comes after the first of others
    first[rows] = named


def _number_nameless(rules: Rules, size: Array, upper: Mask, first: Whole) -> None:
    """Number what has no name from slow to fast, in place."""
    nameless = upper & (first == NONE)
    k = np.flatnonzero(nameless.any(1))
    if k.size:
        rank = np.where(nameless[k], size[k], np.inf).argsort(1, kind="stable").argsort(1, kind="stable")
        first[k] = np.where(nameless[k], len(rules.weights) - 1 + rank, first[k])


def _name_by_birth(named: Named, open_: Whole, place: Whole, speeds: Array, nodes: Array, at_nodes: Named) -> Whole:
    """Decide which two of four real core roots become the weave: those that are a pair at the next of fixed speeds.

    ``open_`` are the open points, ``place`` their bicycles among those of the ``nodes`` (bicycles, k), m/s, at which
    the roots are named, ``at_nodes``. Points that are still open are returned.
    """
    weave = (at_nodes.values.imag > 0) & (at_nodes.first == WEAVE)
    pair = np.where(weave, at_nodes.values.real, 0.0).sum(1)
    real = ((at_nodes.first == CAPSIZE) | (at_nodes.first == CASTERING)) & (at_nodes.values.imag == 0)
    count_right = (real & (at_nodes.values.real > pair[:, None])).sum(1).reshape(nodes.shape)
    decided = ((weave.sum(1) == 1) & (real.sum(1) == 2)).reshape(nodes.shape)
    born = decided[place] & (nodes[place] > speeds[open_, None])
    is_born = born.any(1)
    rows, first = open_[is_born], count_right[place, born.argmax(1)][is_born]
    names = named.first[rows]
    core = (names == WEAVE) | (names == CAPSIZE) | (names == CASTERING)
    from_the_right = np.where(core, -named.values[rows].real, np.inf).argsort(1)[:, :4]
    named.first[rows[:, None], from_the_right] = BORN_NAMES[first]
    return open_[~is_born]


def check_trackable(model: LinearModel, speeds: Array, name: str = "speed") -> None:
    """Refuse speeds (m/s) so high or low, and models so stiff, that modes cannot be computed; ``name`` is for
    messages."""
    unit = speed_unit(model)
    low = LIMITS.slowest * unit if model.singular_at_rest else 0.0
    high = LIMITS.fastest * unit
    bad = speeds[(speeds < low) | (speeds > high)]
    if bad.size:
        why = "; slip without relaxation is singular at rest" if low and bad[0] < low else ""
        raise InputError(
            f"{name} = {bad[0]:g} m/s is not allowed{why}: modes are tracked from {low:.3g} to {high:.0f} m/s "
            f"({LIMITS.fastest:g} sqrt(g w)); give a {name} in this range"
        )
    most = LIMITS.stiffest * math.sqrt(model.parameters["g"] / model.parameters["w"])
    speed = LIMITS.walking * unit
    matrix = model.state_matrix(speed)
    with np.errstate(all="ignore"):
        largest = float(np.abs(matrix).sum(1).max(initial=0.0))  # no root is larger
        if not largest <= most:
            largest = float(np.abs(spectra(matrix[None])).max()) if np.isfinite(matrix).all() else math.inf
    if not largest <= most:
        key, value = max(model.parameters.items(), key=lambda item: abs(math.log10(abs(item[1]) or 1.0)))
        raise InputError(
            f"the model is too stiff to be computed: its fastest root is {largest:.3g} 1/s at {speed:.3g} m/s, at most "
            f"{most:.3g} 1/s is allowed; its most extreme parameter is {key} = {value:g}: give a value nearer to 1"
        )


def find_untrackable(polynomial: SpeedPolynomial, gravity: Array, wheelbase: Array, highest: float) -> Mask:
    """Bicycles (m,) that :func:`check_trackable` may refuse up to the ``highest`` speed (m/s)."""
    unit = np.sqrt(gravity * wheelbase)
    low = LIMITS.slowest * unit if -1 in polynomial else 0.0
    with np.errstate(all="ignore"):
        largest = np.abs(polynomial(LIMITS.walking * unit)).sum(2).max(1)
        fine = (low <= highest) & (highest <= LIMITS.fastest * unit)
        return np.asarray(~(fine & (largest <= LIMITS.stiffest * np.sqrt(gravity / wheelbase))))
