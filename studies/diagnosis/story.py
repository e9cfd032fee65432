"""Misfit step by step: with the named effect alone, with re-estimated parameters, without the effect; and where."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from studies.diagnosis.diagnose import Diagnosis
from studies.diagnosis.residual import Residual
from studies.inference import Judgement, Moved, compare_nuisances, held_out

LOUD = 2.0  # sd, from which a value is off


@dataclass(frozen=True)
class Gap:
    """chi^2 of each step; None of a step that does not exist, or where nothing could be held out."""

    base: float | None  # of the base model as stated
    effect_alone: float | None  # of the named effect, with the parameters as stated
    adjusted: float | None  # of the final hypothesis, its parameters re-estimated
    with_torque: float | None  # of the model file, if an unmodelled torque is kept in it
    without_effect: float | None  # of the parameters re-estimated without the effect
    without_effect_moved_sd: float  # by how many prior sd the parameter that went farthest then moved
    noise: float  # expected of noise alone: the number of data points

    @property
    def steps(self) -> dict[str, float]:
        """Steps that are known, in their order."""
        names = ("base", "effect_alone", "adjusted", "with_torque", "without_effect")
        return {name: x for name in names if (x := getattr(self, name)) is not None}

    @property
    def misfits(self) -> dict[str, float]:
        """Steps that are known, each with its chi^2 per data point: 1 is noise."""
        return {name: chi2 / self.noise for name, chi2 in self.steps.items()}

    def remaining_share(self, step: str) -> float | None:
        """Share of the base model's discrepancy sqrt(chi^2/n - 1) that remains at a ``step``; None if there is none."""
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
    measured: float  # of the measured values there: the mean if all have one sign, else the root mean square
    measured_one_sign: bool  # all measured values there have one sign
    shown_series: str  # series as readers know it
    shown_unit: str  # unit in which ``by`` is shown
    factor: float = 1.0  # from ``unit`` to ``shown_unit``
    logarithm: bool = False  # ``by`` is of natural logarithms

    @property
    def shown_by(self) -> float:
        """Absolute value of ``by`` in its shown unit; a difference of logarithms in percent."""
        return 100 * abs(math.expm1(self.by)) if self.logarithm else self.factor * abs(self.by)

    @property
    def shown_measured(self) -> float | None:
        """Measured value in the shown unit; None of a logarithm."""
        return None if self.logarithm else self.factor * self.measured

    def to_dict(self) -> dict[str, Any]:
        """Numbers for JSON, in SI units."""
        names = ("series", "speeds", "axis", "by", "unit", "one_sign", "measured", "measured_one_sign")
        return {name: getattr(self, name) for name in names}

    @property
    def axis_name(self) -> str:
        """Quantity along which the places lie, without its unit."""
        return self.axis.partition(", ")[0]

    @property
    def axis_unit(self) -> str:
        """Unit of the places; empty if they are counted."""
        return self.axis.partition(", ")[2]


@dataclass(frozen=True)
class LookAlikes:
    """Shares of the base model's discrepancy that remain with effects and re-estimated parameters, if none is named."""

    unseen: bool  # on held-out runs; else on the fitted data
    adjusted: float  # of the parameters alone
    nearest: str  # hypothesis that comes closest to explaining the data; "" if none does
    left: float  # share that remains with it
    # hypotheses of one effect with at most twice that share and less than the parameters alone, the best first
    singles: tuple[tuple[str, float], ...]
    best_single: tuple[str, float] | None  # of all hypotheses of one effect
    tried: int  # how many of these there are

    @property
    def other_singles(self) -> tuple[tuple[str, float], ...]:
        """Single effects and what each leaves, without the nearest."""
        return tuple((name, share) for name, share in self.singles if name != self.nearest)

    @property
    def nearest_is_single(self) -> bool:
        """The nearest is one of ``singles``."""
        return len(self.other_singles) < len(self.singles)

    @property
    def others_tried(self) -> int:
        """Number of hypotheses of one effect that were tried in addition to the nearest."""
        return self.tried - (len(self.singles) - len(self.other_singles))

    @property
    def parameters_do_alike(self) -> bool:
        """The share of the parameters alone is at most twice that of the nearest, and so is that of every effect."""
        return self.adjusted <= 2 * self.left


@dataclass(frozen=True)
class Story:
    """Numbers of the first screen; ``far`` has the parameters that must be others without the effect."""

    gap: Gap  # chi^2 of each step on all data
    held_out: Gap | None  # on held-out data; None if none could be
    unseen: bool  # whole runs are held out of every fit
    far: tuple[Moved, ...]  # at most three, the farthest first
    look_alikes: LookAlikes | None = None  # where nothing is named


def tell(
    diagnosis: Diagnosis,
    predicted: Sequence[tuple[int, Mapping[str, float]]] = (),
    torque: Residual | None = None,
    look_alikes: LookAlikes | None = None,
) -> Story:
    """Steps of a finished ``diagnosis``; the held-out ones are of ``predicted`` runs (count, chi^2 by model) if any."""
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
    """Steps from ``chi2`` by model; how far parameters went without the effect at ``most``, in sd."""
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
    """The series with the largest excess of the base model's chi^2; None if none exceeds noise."""
    kind = diagnosis.kind
    if kind.parts:  # the series of each part have their own units
        views = [(part.name, kind.view_part(diagnosis, k)) for k, part in enumerate(kind.parts)]
        name, worst_part = max(views, key=lambda view: float(view[1].nominal @ view[1].nominal) - len(view[1].nominal))
        worst_of_part = farthest_off(worst_part)
        if worst_of_part is None:
            return None
        names = f"{name}: {worst_of_part.series}", f"{name}: {worst_of_part.shown_series}"
        return replace(worst_of_part, series=names[0], shown_series=names[1])
    residual, rows = diagnosis.nominal, kind.rows
    displays = [rows.show(name) for name in rows.series]
    labels = np.array([f"{display.channel}, {display.quantity}, {display.axis}" for display in displays])
    excess = {name: float(((residual**2)[labels == name] - 1).sum()) for name in dict.fromkeys(labels.tolist())}
    worst = max(excess, key=lambda name: excess[name])
    if not (excess[worst] > 0 and np.isfinite(residual).all()):
        return None
    indices = np.flatnonzero(labels == worst)
    display = displays[indices[0]]
    deviation = kind.residuals_by_channel((), np.array([u.centre for u in kind.nuisances]))[display.channel]
    of_series = (labels == worst)[rows.channels == display.channel]
    loud = np.abs(residual[indices]) > LOUD
    if not loud.any():
        loud[:] = True
    measured = kind.measured_by_channel()[display.channel][of_series][loud]
    deviation, places = deviation[of_series][loud], rows.abscissa[indices][loud]
    size = float(np.sqrt(np.mean(deviation**2)))
    one_sign = bool(abs(deviation.mean()) > 0.8 * size)
    quantity, _, unit = display.quantity.partition(", ")
    series = ", ".join(dict.fromkeys(word for word in (display.channel, quantity) if word))
    ends = float(places.min()), float(places.max())
    by = float(deviation.mean()) if one_sign else size
    unit = unit or unit_of_column(display.channel)
    shown, _, shown_unit = display.shown.partition(", ")
    shown_series = f"{display.channel} {shown}" if shown else display.channel if display.logarithm else series
    measured_one_sign = bool((measured > 0).all() or (measured < 0).all())
    return Where(
        series=series,
        speeds=ends,
        axis=display.axis or rows.axis,
        by=by,
        unit=unit,
        one_sign=one_sign,
        measured=float(measured.mean()) if measured_one_sign else float(np.sqrt(np.mean(measured**2))),
        measured_one_sign=measured_one_sign,
        shown_series=shown_series,
        shown_unit="%" if display.logarithm else shown_unit or unit,
        factor=display.factor,
        logarithm=display.logarithm,
    )


def unit_of_column(name: str) -> str:
    """SI unit at the end of the name of a column; empty if there is none."""
    ends = {"_rad_s": "rad/s", "_rad": "rad", "_m_s2": "m/s^2", "_N_m": "N m"}
    return next((unit for end, unit in ends.items() if name.endswith(end)), "")
