"""The modes of a model along speed: every eigenvalue under the name that it has at that speed.

>>> from bicycle import Model, load_bicycle
>>> found = modes(Model(load_bicycle("benchmark")).linear_model(), [4.0, 5.0])
>>> found.frequency("weave").round(3), found.damping_ratio("weave").round(3)
(array([0.49 , 0.711]), array([-0.133,  0.171]))
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bicycle.model.eigen import decompose, eigensystem, frequency_hz, pair_damping_ratio
from bicycle.model.model import Model, as_linear
from bicycle.model.state_space import LinearModel
from bicycle.stability import naming
from bicycle.stability.tracking import Branches, Nodes, assign_sets, follow, meetings
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError
from tyre.ground.progress import optional_module

if TYPE_CHECKING:
    import pandas as pd

UNITS = {
    "speed_m_s": "m/s", "mode": "", "real_1_s": "1/s", "imaginary_rad_s": "rad/s", "frequency_Hz": "Hz",
    "damping_ratio": "1",
}  # fmt: skip
"""Columns of :meth:`Modes.to_dataframe`."""

STEP = 0.1  # of the speeds at which events are looked for, in units of sqrt(g w): about 0.3 m/s
COMPONENTS = ("lean", "steer", "yaw", "lateral")


@dataclass(frozen=True)
class ModeEvent:
    """Something happens to named modes at a speed (m/s)."""

    speed: float  # m/s
    kind: str  # merge, split, exchange or switch
    modes: tuple[str, ...]  # names of the modes that it happens to
    eigenvalue: float = float("nan")  # 1/s, the double real root of a merge or split; else NaN
    pair: tuple[str, ...] = ()  # name of the pair that is born or split, both names if it is in doubt

    def __str__(self) -> str:
        sentence = {
            "merge": "two real roots of {modes} meet at {root:.4g} 1/s and become the pair {pair}",
            "split": "the pair {pair} splits at {root:.4g} 1/s into two real roots of {modes}",
            "exchange": "{modes} veer; their labels swap",
            "switch": "the equations switch and the roots of {modes} jump",
        }[self.kind]
        message = sentence.format(modes=" and ".join(self.modes), root=self.eigenvalue, pair="+".join(self.pair))
        return f"{self.speed:.3f} m/s: {message}"


@dataclass(frozen=True)
class ModeShape:
    """Phasors (m, n) of ``components`` at m speeds: lean, steer, yaw (rad), lateral displacement of the rear contact
    (m) and the model's further joint angles (rad)."""

    phasors: Complex  # (m, 4 + joints), rad and m, the largest angle of each row being 1 rad, lean with phase 0
    components: tuple[str, ...] = COMPONENTS

    @property
    def magnitude(self) -> dict[str, Array]:
        """Component -> (m,), rad or m for 1 rad of the largest angle."""
        sizes = np.abs(self.phasors)
        largest = np.delete(sizes, 3, axis=1).max(1, keepdims=True)  # 1 but for the rounding of the phasors
        return dict(zip(self.components, (sizes / largest).T, strict=True))

    @property
    def phase(self) -> dict[str, Array]:
        """Component -> (m,), rad, ahead of lean."""
        return dict(zip(self.components, np.angle(self.phasors).T, strict=True))


@dataclass(frozen=True, eq=False)
class Modes:
    """Eigenvalues along speed, named at each speed by their character.

    Attributes
    ----------
    speeds : ndarray, shape (m,)
        In the order they were asked for, m/s.
    eigenvalues : ndarray, shape (m, n)
        1/s, at each speed sorted by real then imaginary part.
    branches : mapping of str to ndarray, shape (m, 2)
        Name -> values at each speed: one with im > 0 for a pair, two real ones after it has split (the larger first),
        NaN where there is none. A pair in doubt is listed under both names, the better one first: "wobble+weave"; so
        is the pair that capsize and castering form. Such a branch may need more than two columns.
    anchor : float
        A walking speed, 1.5 sqrt(g w), at which modes are plain, m/s.
    """

    speeds: Array
    eigenvalues: Complex
    branches: Mapping[str, Complex]
    anchor: float
    model: LinearModel = field(repr=False)  # whose eigenvalues they are

    def __repr__(self) -> str:
        many = len(self.speeds)
        at = f"{many} speeds {self.speeds.min():g}-{self.speeds.max():g}" if many > 1 else f"{self.speeds[0]:g}"
        growth = {name: values.real.max() for name, values in self.branches.items() if (values.real > 0).any()}
        unstable = ", ".join(name for name in self.names if name in growth) or "none"
        return (
            f"<Modes at {at} m/s: {', '.join(self.names)}\n"
            f" unstable at one of them: {unstable}; largest real part {np.nanmax(self.eigenvalues.real):.3g} 1/s>"
        )

    @cached_property
    def events(self) -> tuple[ModeEvent, ...]:
        """Real roots that merge to a pair or come from one, pairs that exchange names, jumps at a switch speed.

        Of the speeds between the lowest and the highest; computed when they are first asked for.
        """
        return mode_events(self.model, float(self.speeds.min()), float(self.speeds.max()))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the modes that occur."""
        return tuple(self.branches)

    def branch(self, name: str) -> Complex:
        """Values (m, 2) of the mode called ``name``, 1/s.

        Raises
        ------
        InputError
            The model has no such mode.
        """
        if name not in self.branches:
            raise InputError(f"unknown mode {name!r}; this model has {', '.join(self.branches)}")
        return self.branches[name]

    def frequency(self, name: str) -> Array:
        """Damped frequency Im/(2 pi) of the mode ``name`` in Hz, shape (m,).

        0 where the roots are real, NaN where there is no such mode.
        """
        return frequency_hz(self.branch(name)[:, 0])

    def damping_ratio(self, name: str) -> Array:
        """Damping ratio of the mode ``name``, shape (m,).

        -Re/|lambda| of a pair, -(a + b) / (2 sqrt(a b)) of two real roots of one sign (above 1 in size), otherwise
        (one real root, roots of both signs, no such mode) NaN.
        """
        return pair_damping_ratio(*self.branch(name)[:, :2].T)

    def shape(self, name: str) -> ModeShape:
        """Magnitude and phase of lean, steer, yaw and lateral motion, of the first value of the branch ``name``."""
        return mode_shape(self.model, self.speeds, self.branch(name)[:, 0])

    def plot(self, axes: Any = None) -> tuple[Any, Any]:
        """Draw frequency and real part along speed on two ``axes`` of matplotlib, or on new ones; figure and axes."""
        from bicycle.stability.mode_figure import draw_modes

        return draw_modes(self, axes)

    def to_xarray(self) -> Any:
        """``xarray.Dataset``: eigenvalue (mode, speed, root) in 1/s, frequency in Hz, damping ratio (mode, speed).

        ``root`` counts the values of a mode at one speed (two after a pair has split); NaN where there is none.

        Raises
        ------
        ImportError
            xarray is not installed.
        """
        xarray = optional_module("xarray", extra="xarray")
        width = max(values.shape[1] for values in self.branches.values())
        values = np.full((len(self.names), len(self.speeds), width), np.nan, complex)
        for row, branch in zip(values, self.branches.values(), strict=True):
            row[:, : branch.shape[1]] = branch
        hertz, ratio = (np.array([of(name) for name in self.names]) for of in (self.frequency, self.damping_ratio))
        dimensions = ("mode", "speed")
        return xarray.Dataset(
            {
                "eigenvalue": ((*dimensions, "root"), values, {"units": "1/s"}),
                "frequency": (dimensions, hertz, {"units": "Hz", "long_name": "damped frequency"}),
                "damping_ratio": (dimensions, ratio, {"units": "1"}),
            },
            {"mode": [*self.names], "speed": ("speed", self.speeds, {"units": "m/s", "long_name": "forward speed"})},
            {"anchor_speed_m_s": self.anchor, "effects": ", ".join(self.model.effects)},
        )

    def to_dataframe(self) -> "pd.DataFrame":
        """A row per speed, mode and root; ``attrs["units"]`` has the unit of every column.

        Columns: ``speed_m_s``, ``mode``, ``real_1_s``, ``imaginary_rad_s``, ``frequency_Hz`` (damped, 0 for a real
        root), ``damping_ratio`` (as :meth:`damping_ratio`). A mode that has split into two real roots has two rows.
        """
        import pandas as pd

        ratios = {name: self.damping_ratio(name) for name in self.branches}
        rows = [
            (speed, name, z.real, z.imag, abs(float(frequency_hz(z))), ratios[name][k])
            for k, speed in enumerate(self.speeds)
            for name, values in self.branches.items()
            for z in values[k][~np.isnan(values[k])].tolist()
        ]
        table = pd.DataFrame(rows, columns=[*UNITS])
        table.attrs = {"units": dict(UNITS), "anchor_speed_m_s": self.anchor, "effects": list(self.model.effects)}
        return table

    def to_dict(self) -> dict[str, list[list[list[float]] | None]]:
        """JSON form: name -> for each speed a list of [re, im] in 1/s, or None where the mode is not there."""
        return {
            name: [[[z.real, z.imag] for z in row[~np.isnan(row)].tolist()] or None for row in values]
            for name, values in self.branches.items()
        }


def modes(model: Model | LinearModel, speeds: ArrayLike) -> Modes:
    """Eigenvalues and their names at speeds in any order.

    A root is named at each speed by its character there (:mod:`bicycle.stability.naming`), so its name does not
    depend on the other speeds asked for. Where two branches exchange character, so do their names.

    Parameters
    ----------
    model : Model or LinearModel
    speeds : array_like, shape (m,)
        Forward speeds, m/s.

    Raises
    ------
    InputError
        No speeds, a speed that the model does not allow or that is too high (or, for a model singular at rest, too
        low), or a model too stiff to be computed.
    """
    model = as_linear(model)
    v = np.atleast_1d(model.check_speeds(speeds))
    if v.ndim != 1 or not v.size:
        raise InputError(f"speeds have shape {v.shape}; give one or more speeds in a row")
    naming.check_trackable(model, v)
    rules = naming.Rules.of(model)
    named = naming.name_along(model, rules, v)
    anchor = naming.LIMITS.walking * naming.speed_unit(model)
    return Modes(v, np.sort_complex(named.values), _branches(rules, named), anchor, model)


def _branches(rules: naming.Rules, named: naming.Named) -> dict[str, Complex]:
    """Values under each name, those that the model always has first; a pair is shown by its upper half."""
    upper = named.values.imag >= 0
    code = named.first * (len(rules.names) + 1) + named.second + 1
    branches: dict[str, Complex] = {name: np.full((len(upper), 2), np.nan, complex) for name in rules.usual}
    for label in np.unique(code[upper]).tolist():
        first, second = divmod(label, len(rules.names) + 1)
        places = upper & (code == label)
        most = int(places.sum(1).max())
        values = np.full((len(upper), max(most, 2)), np.nan, complex)
        if most == 1:
            values[places.any(1), 0] = named.values[places]
        else:
            roots = np.where(places, named.values, np.nan)
            order = np.lexsort((-roots.real, -roots.imag), axis=1)[:, :most]
            values[:, :most] = np.take_along_axis(roots, order, 1)
        branches[rules.name(first, second - 1)] = values
    table = [*rules.usual, *rules.names]

    def rank(name: str) -> tuple[int, int, str]:
        return name.count("+"), table.index(name) if name in table else len(table), name

    return {name: branches[name] for name in sorted(branches, key=rank)}


def mode_shape(model: LinearModel, speeds: Array, eigenvalues: Complex) -> ModeShape:
    """Shapes of the modes with ``eigenvalues`` (m,), 1/s, at ``speeds`` (m,), m/s; NaN where there is none.

    Yaw and lateral displacement are integrals of the model's yaw rate r and lateral velocity V of the rear contact: psi
    = r / lambda and y = (V + v psi) / lambda.
    """
    joints = tuple(s for s in model.states if f"{s}_rate" in model.states and s not in ("lean", "steer"))
    phasors = np.full((len(speeds), 4 + len(joints)), np.nan, complex)
    rows = [model.outputs.index(name) for name in ("lean", "steer", "yaw_rate", "rear_lateral_velocity", *joints)]
    with_root = np.flatnonzero(~np.isnan(eigenvalues))
    for number, places in model.by_range(speeds[with_root]):
        k = with_root[places]
        v, root = speeds[k], eigenvalues[k, None]
        values, vectors, _ = eigensystem(model.state_matrix(v))
        nearest = np.abs(values - root).argmin(1)
        states = model.scale * np.take_along_axis(vectors, nearest[:, None, None], 2)[..., 0]
        outputs = (model.ranges[number].matrices.output_matrix(v)[:, rows] @ states[..., None])[..., 0]
        lean, steer, yaw_rate, lateral, *joint_angles = outputs.T[..., None]
        with np.errstate(divide="ignore", invalid="ignore"):  # a root at exactly zero: a steady turn without end
            shape = np.hstack(
                [lean * root**2, steer * root**2, yaw_rate * root, lateral * root + v[:, None] * yaw_rate]
                + [angle * root**2 for angle in joint_angles]
            )
            angles = np.abs(np.delete(shape, 3, axis=1)).max(1, keepdims=True)
            phase = np.where(shape[:, :1] == 0, 1, shape[:, :1] / np.abs(shape[:, :1]))
            phasors[k] = shape / (angles * phase)
    return ModeShape(phasors, (*COMPONENTS, *joints))


def mode_events(model: LinearModel, low: float, high: float) -> tuple[ModeEvent, ...]:
    """Everything that happens to the modes between two speeds (m/s), by speed; looked for on a fixed grid."""
    rules = naming.Rules.of(model)
    unit = naming.speed_unit(model)
    events: list[ModeEvent] = []
    ends: list[tuple[float, Complex, Complex, list[str]]] = []
    for number, at in enumerate(model.ranges):
        lower = max(at.lower, low)
        upper = min(at.upper, high)
        if upper < lower:
            continue
        polynomial = model.coefficients[number]

        def compute(v: Array, polynomial: Any = polynomial) -> Nodes:
            return Nodes(v, *decompose(polynomial, v))

        nodes = np.unique(np.clip(event_grid(lower, upper, unit, singular=-1 in polynomial), at.lower, at.upper))
        nodes_followed, branches = follow(compute(nodes), compute, unit * STEP * 2.0**-22)
        owner, gravity = np.zeros(len(nodes_followed.v), np.intp), model.parameters["g"]
        named = naming.name_points(
            rules, naming.stack_of_one(model, number), np.array([unit]), gravity, owner, nodes_followed.v
        )
        first, second = (np.take_along_axis(x, branches.order, 1) for x in named[1:3])
        events += _meetings(rules, branches, first, second)
        events += _exchanges(model, rules, branches, first)
        label = [rules.name(place) for place in first[-1].tolist()]
        ends.append((at.lower, branches.values[0], branches.values[-1], label))
    for (_, _, before, label), (speed, after, _, _) in pairwise(ends):
        after = after[assign_sets(before[None], after[None])[0]]
        jumped = np.flatnonzero(np.abs(after - before) > 1e-6 * np.abs(before).max())
        if jumped.size:
            events.append(ModeEvent(float(speed), "switch", tuple(sorted({label[i] for i in jumped}))))
    within = (event for event in events if low <= event.speed <= high)
    return tuple(sorted(within, key=lambda event: (event.speed, event.kind, event.modes)))


def event_grid(low: float, high: float, unit: float, *, singular: bool) -> Array:
    """Speeds of a fixed sequence that cover [low, high] (m/s): even steps, geometric towards 0 for a singular model."""
    step = unit * STEP
    nodes = step * np.arange(max(np.floor(low / step), 0), np.ceil(high / step) + 1)
    if singular:
        nodes = nodes[nodes > 0]
        halvings = int(np.ceil(2 * max(np.log2(step / low), 0))) if low > 0 else 0
        nodes = np.concatenate([step * 2.0 ** (-np.arange(halvings, 0, -1) / 2), nodes])
    return nodes


def _meetings(
    rules: naming.Rules, branches: Branches, first: NDArray[np.intp], second: NDArray[np.intp]
) -> Iterator[ModeEvent]:
    for meeting in meetings(branches):
        sides = []
        for k in (meeting.step, meeting.step + 1):
            places = {*first[k, list(meeting.branches)].tolist(), *second[k, list(meeting.branches)].tolist()}
            sides.append(tuple(sorted(rules.names[place] for place in places - {naming.NONE})))
        real, pair = sides if meeting.kind == "merge" else sides[::-1]
        yield ModeEvent(meeting.at, meeting.kind, real, meeting.value, pair)


def _exchanges(model: LinearModel, rules: naming.Rules, branches: Branches, first: NDArray[np.intp]) -> list[ModeEvent]:
    """Pairs whose name changes from one node to the next, and where."""
    pair = (branches.values[:-1].imag > 0) & (branches.values[1:].imag > 0) & branches.smooth[:, None]
    k, i = np.nonzero(pair & (first[:-1] != first[1:]))
    low, high = branches.v[k], branches.v[k + 1]
    before, after = branches.values[k, i], branches.values[k + 1, i]
    for _ in range(12 if len(k) else 0):  # names at the middle, of the root nearest to the line between the ends
        middle = (low + high) / 2
        named = naming.name_along(model, rules, middle)
        share = (middle - branches.v[k]) / (branches.v[k + 1] - branches.v[k])
        nearest = np.abs(named.values - ((1 - share) * before + share * after)[:, None]).argmin(1)
        same_name = named.first[np.arange(len(k)), nearest] == first[k, i]
        low, high = np.where(same_name, middle, low), np.where(same_name, high, middle)
    exchanges: dict[Any, ModeEvent] = {}
    for speed, step, branch in zip(high.tolist(), k.tolist(), i.tolist(), strict=True):
        names = tuple(sorted(rules.names[first[at, branch]] for at in (step, step + 1)))
        exchanges.setdefault((step, names), ModeEvent(speed, "exchange", names))
    return list(exchanges.values())
