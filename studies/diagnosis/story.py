"""Story of a gap: what the named effect closes alone, what the parameters add, what is left without it, and where."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from studies.diagnosis.diagnose import Diagnosis
from studies.diagnosis.residual import Residual
from studies.inference import Judgement, Moved, compare_nuisances, held_out

LOUD = 2.0  # sd, from which a value is off


@dataclass(frozen=True)
class Gap:
    """chi^2 of each step of the story; None of a step that there is not, or where nothing could be left out."""

    base: float | None  # of the base model as stated
    effect_alone: float | None  # of the named effect, with the parameters as stated
    adjusted: float | None  # of the final hypothesis, its parameters adjusted
    with_torque: float | None  # of the model file, if what could not be named is kept in it as a torque
    without_effect: float | None  # of the parameters adjusted without the effect
    without_effect_moved_sd: float  # by how many prior sd the parameter that went farthest then moved
    noise: float  # what noise alone would leave: the count of the numbers

    @property
    def steps(self) -> dict[str, float]:
        """Steps that are known, in the order of the story."""
        names = ("base", "effect_alone", "adjusted", "with_torque", "without_effect")
        return {name: x for name in names if (x := getattr(self, name)) is not None}

    @property
    def misfits(self) -> dict[str, float]:
        """Steps that are known, each with its chi^2 a number: 1 is noise."""
        return {name: chi2 / self.noise for name, chi2 in self.steps.items()}

    def remaining_share(self, step: str) -> float | None:
        """Share of the gap sqrt(chi^2/n - 1) of the base model that a ``step`` leaves; None if there is none."""
        base, value = self.base, getattr(self, step)
        if base is None or value is None or base <= self.noise:
            return None
        return math.sqrt(max(0.0, value / self.noise - 1) / (base / self.noise - 1))


@dataclass(frozen=True)
class Where:
    """Series in which the base model is farthest off, from which to which place, and by how much."""

    series: str  # channel and quantity
    speeds: tuple[float, float]  # or whatever ``axis`` says
    axis: str  # what ``speeds`` are of, with its unit
    by: float  # measured less computed: the mean if it has one sign, else the root mean square
    unit: str  # of ``by``
    one_sign: bool  # measured lies on one side of computed

    @property
    def axis_name(self) -> str:
        """What the places are of, without its unit."""
        return self.axis.rpartition(", ")[0]

    @property
    def axis_unit(self) -> str:
        """Unit of the places."""
        return self.axis.rpartition(", ")[2]


@dataclass(frozen=True)
class LookAlikes:
    """Shares of the base model's gap that effects leave, each with the parameters adjusted, if nothing was named."""

    unseen: bool  # on runs that were never fitted; else on the data that they were fitted to
    adjusted: float  # of the parameters alone
    nearest: str  # hypothesis that comes nearest to explaining the data; "" if none does
    left: float  # share that it leaves
    # hypotheses of one effect that leave at most twice as much and less than the parameters alone, the best first
    singles: tuple[tuple[str, float], ...]
    best_single: tuple[str, float] | None  # of all hypotheses of one effect
    tried: int  # how many of these there are

    @property
    def other_singles(self) -> tuple[tuple[str, float], ...]:
        """Those of ``singles`` that are not the nearest."""
        return tuple((name, share) for name, share in self.singles if name != self.nearest)

    @property
    def nearest_is_single(self) -> bool:
        """The nearest is one of ``singles``."""
        return len(self.other_singles) < len(self.singles)

    @property
    def others_tried(self) -> int:
        """How many hypotheses of one effect were tried beside the nearest."""
        return self.tried - (len(self.singles) - len(self.other_singles))

    @property
    def parameters_do_alike(self) -> bool:
        """The parameters alone leave at most twice what the nearest leaves, and so does every effect."""
        return self.adjusted <= 2 * self.left


@dataclass(frozen=True)
class Story:
    """Numbers of the first screen; ``far`` has the parameters that must be others without the effect."""

    gap: Gap  # chi^2 of each step on all data
    held_out: Gap | None  # on data that were left out of the fits; None if none could be
    unseen: bool  # what is held out are runs that were never fitted
    far: tuple[Moved, ...]  # at most three, the farthest first
    look_alikes: LookAlikes | None = None  # where nothing is named


def tell(
    diagnosis: Diagnosis,
    predicted: Sequence[tuple[int, Mapping[str, float]]] = (),
    torque: Residual | None = None,
    look_alikes: LookAlikes | None = None,
) -> Story:
    """Story of a finished ``diagnosis``, held out by runs that were ``predicted`` (count, chi^2 by model) if any."""
    null, final, effect_alone = diagnosis.hypotheses.null, diagnosis.final, diagnosis.alone
    n = float(len(diagnosis.nominal))
    is_named = bool(final.candidates and null.nuisances)
    went = compare_nuisances(null, null)
    far = tuple(m for m in went[:3] if abs(m.shift) > LOUD)
    most = max((abs(m.shift) for m in went), default=0.0)
    fitted: dict[str, float | None] = {
        "nominal": float(diagnosis.nominal @ diagnosis.nominal),
        "effect_alone": effect_alone.chi2 if effect_alone else None,
        "final": final.chi2,
        "with_torque": torque.fit.chi2 if torque else None,
        "nuisance_only": null.chi2,
    }
    if predicted:
        models = {name: sum(chi2.get(name, np.nan) for _, chi2 in predicted) for name in predicted[0][1]}
        count = float(sum(numbers for numbers, _ in predicted))
    else:
        models = {name: score.chi2 for name, score in diagnosis.held_out.items() if score.possible}
        count = n if "final" in models else 0.0
        models |= {"nominal": float(diagnosis.nominal @ diagnosis.nominal)}
        if effect_alone and count:
            models["effect_alone"] = held_out(diagnosis.kind, effect_alone).chi2
        if torque and count:
            models["with_torque"] = torque.after.chi2
    gap = _gap(fitted, most, n, is_named=is_named)
    held_out_gap = _gap(models, most, count, is_named=is_named) if count else None
    return Story(gap, held_out_gap, bool(predicted), far, look_alikes)


def _gap(chi2: Mapping[str, float | None], most: float, count: float, *, is_named: bool) -> Gap:
    """The gap from ``chi2`` by model; how far parameters went without the effect at ``most``, in sd."""
    of = {name: None if x is None else _number(x) for name, x in chi2.items()}
    without_effect = of.get("nuisance_only") if is_named else None
    return Gap(
        base=of.get("nominal"),
        effect_alone=of.get("effect_alone"),
        adjusted=of.get("final"),
        with_torque=of.get("with_torque"),
        without_effect=without_effect,
        without_effect_moved_sd=most,
        noise=count,
    )


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def farthest_off(diagnosis: Judgement) -> Where | None:
    """The series whose gap of the base model is largest; None if none is beyond noise."""
    kind = diagnosis.kind
    if kind.parts:  # the series of each part have their own units
        views = [(part.name, kind.view_part(diagnosis, k)) for k, part in enumerate(kind.parts)]
        name, worst_part = max(views, key=lambda view: float(view[1].nominal @ view[1].nominal) - len(view[1].nominal))
        worst_of_part = farthest_off(worst_part)
        return worst_of_part and replace(worst_of_part, series=f"{name}: {worst_of_part.series}")
    gap, rows = diagnosis.nominal, kind.rows
    displays = [rows.show(name) for name in rows.series]
    labels = np.array([f"{display.channel}, {display.quantity}, {display.axis}" for display in displays])
    excess = {name: float(((gap**2)[labels == name] - 1).sum()) for name in dict.fromkeys(labels.tolist())}
    worst = max(excess, key=lambda name: excess[name])
    if not (excess[worst] > 0 and np.isfinite(gap).all()):
        return None
    indices = np.flatnonzero(labels == worst)
    display = displays[indices[0]]
    deviation = kind.residuals_by_channel((), np.array([u.centre for u in kind.nuisances]))[display.channel]
    deviation = deviation[(labels == worst)[rows.channels == display.channel]]
    loud = np.abs(gap[indices]) > LOUD if (np.abs(gap[indices]) > LOUD).any() else np.ones(len(indices), bool)
    deviation, places = deviation[loud], rows.abscissa[indices][loud]
    size = float(np.sqrt(np.mean(deviation**2)))
    one_sign = bool(abs(deviation.mean()) > 0.8 * size)
    quantity, _, unit = display.quantity.partition(", ")
    series = ", ".join(dict.fromkeys(word for word in (display.channel, quantity) if word))
    ends = float(places.min()), float(places.max())
    by = float(deviation.mean()) if one_sign else size
    return Where(series, ends, display.axis or rows.axis, by, unit or unit_of_column(display.channel), one_sign)


def unit_of_column(name: str) -> str:
    """SI unit at the end of the name of a column; empty if there is none."""
    ends = {"_rad_s": "rad/s", "_rad": "rad", "_m_s2": "m/s^2", "_N_m": "N m"}
    return next((unit for end, unit in ends.items() if name.endswith(end)), "")
