"""Findings beyond the verdict, numbers only: parameter shifts, upper limits, next measurement, stability."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from bicycle.effects.effect_registry import model_workers
from studies.diagnosis.diagnose import Diagnosis
from studies.diagnosis.doubts import doubts
from studies.diagnosis.residual import Residual, fit_residual
from studies.diagnosis.story import LookAlikes, Story, Where, farthest_off, tell
from studies.inference import (
    RULES,
    Candidate,
    Fit,
    Hypotheses,
    Judgement,
    Kind,
    Moved,
    PartAgainstRest,
    Stability,
    UpperLimit,
    WithoutOne,
    compare_nuisances,
    fits,
    parts_against_rest,
    rank_measurements,
    stability,
    upper_limits,
    without_each,
)
from studies.inference.verdict import NOTHING, Separation
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.workers import one_blas_thread

AGAINST_NOTHING = ("nothing_unlikely", "predicts", "wide_priors", "each_alone")  # rules by which nothing may be missing

Found = tuple[tuple[Candidate, ...], Mapping[str, Array]]
"""Candidates that were added, and coordinates: of nuisances by name, of candidates by identifier."""


@dataclass(frozen=True)
class Predicted:
    """Prediction of the held-out runs of one part by each model."""

    part: str  # empty if the measurement has no parts
    runs: tuple[str, ...]  # names of the held-out runs
    numbers: int  # how many are compared
    # by model: nominal, nuisance_only, final, effect_alone if something is named, single_effect (the best of one
    # effect) if unknown, with_torque if one was fitted
    chi2: Mapping[str, float]
    # by channel and model, in the channel's unit: root mean square of measured minus computed
    rms: Mapping[str, Mapping[str, float]]
    # by channel whose noise is not stated but estimated, in its unit: the sd that was taken, and what these runs show
    # of it from sample to sample
    noise: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    single: str = ""  # hypothesis of the single effect

    @property
    def loud(self) -> list[str]:
        """Channels whose estimated noise holds much that is no noise from sample to sample, as what is left does."""
        return [
            n
            for n, (assumed_sd, rough_sd) in self.noise.items()
            if min(assumed_sd, self.rms[n]["final"]) > 2.0 * rough_sd
        ]

    @property
    def gap(self) -> dict[str, float | None]:
        """sqrt(max(0, chi^2/n - 1)) over that of the base model; None if that is zero or not finite."""
        size = {model: math.sqrt(max(0.0, value / self.numbers - 1)) for model, value in self.chi2.items()}
        whole = size["nominal"]
        return {model: root / whole if 0 < whole < math.inf else None for model, root in size.items()}


@dataclass(frozen=True)
class Alternative:
    """The closest alternative to what the verdict names; if it names nothing, the closest to an explanation."""

    name: str  # hypothesis, identifiers joined by +; "none" of no effect
    probability: float  # of the hypothesis among all that were fitted
    misfit: float  # chi^2 per data point that remains with it
    final_misfit: float  # the same of the final hypothesis


@dataclass(frozen=True)
class Findings:
    """Findings of a report beyond the verdict."""

    story: Story | None = None  # the misfit step by step
    where: Where | None = None  # and where it is largest
    alternative: Alternative | None = None  # closest hypothesis to what the verdict names
    moved: tuple[Moved, ...] = ()  # how far each parameter went
    limits: tuple[UpperLimit, ...] = ()  # of effects in addition to the final hypothesis
    # hypotheses that ``further`` distinguishes, the leader first; fewer than two if there are none
    between: tuple[str, ...] = ()
    further: tuple[Separation, ...] = ()  # what to measure next, best first
    doubts: tuple[str, ...] = ()  # statements of the data that are surely wrong, in words
    stability: Stability | None = None  # the verdict in variants, if they were judged
    parts: tuple[PartAgainstRest, ...] = ()  # of joint data: each part against the others
    # what is judged without a part that contradicts the others, or without each if they do not fit together; the part
    # first without which the others fit best
    without: Mapping[str, WithoutOne] = field(default_factory=dict)
    joint_fits: bool = True  # the final hypothesis fits all data together
    predicted: tuple[Predicted, ...] = ()  # of runs that were held out of every fit
    torque: Residual | None = None  # what could not be named, kept as a torque; it is no part of the verdict
    no_torque: str = ""  # why none could be fitted to what the verdict leaves; empty if nothing is left
    failed: Mapping[str, str] = field(default_factory=dict)  # sections that could not be made, and why

    @property
    def odd(self) -> list[WithoutOne]:
        """Parts without which everything else fits clearly, if all together do not fit."""
        return [] if self.joint_fits else [removed for removed in self.without.values() if removed.clear]

    @property
    def odd_names(self) -> list[str]:
        """Names of the odd parts."""
        return [removed.part for removed in self.odd]

    @property
    def all_are_odd(self) -> bool:
        """Every part is odd, so each alone shows nothing of the others."""
        return len(self.odd) >= len(self.parts)

    @property
    def compares_effects(self) -> bool:
        """An effect of some part is sized by this part and by the other parts."""
        return any(part.effects for part in self.parts)

    @property
    def not_compared(self) -> list[tuple[str, str]]:
        """Effects of which a part holds too little information to be compared, each with the name of the part."""
        return [(name, part.part) for part in self.parts for name in part.unseen]

    @property
    def limits_by_data(self) -> list[UpperLimit]:
        """Upper limits that the data narrow."""
        return [limit for limit in self.limits if limit.limited]

    @property
    def ranked(self) -> list[PartAgainstRest]:
        """The parts, first those without which the others fit best."""
        place = {name: k for k, name in enumerate(self.without)}
        return sorted(self.parts, key=lambda part: place.get(part.part, len(place)))


class Attempts:
    """Makes one section after the other; if one fails the others remain, and ``failed`` has the error."""

    def __init__(self) -> None:
        self.failed: dict[str, str] = {}

    def __call__(self, section: str, make: Callable[[], Any], otherwise: Any) -> Any:
        try:
            return make()
        except Exception as error:  # whatever it is, the verdict and the other sections stay
            self.failed[section] = f"{type(error).__name__}: {error}"
            return otherwise


@one_blas_thread()
def find(diagnosis: Diagnosis) -> Findings:
    """All but the variants of a ``diagnosis``, which take as long as it took itself."""
    hypotheses, final, kind, attempt = diagnosis.hypotheses, diagnosis.final, diagnosis.kind, Attempts()
    if diagnosis.quick:
        return Findings(
            story=attempt("story", lambda: tell(diagnosis), None),
            moved=compare_nuisances(hypotheses.null, final),
            where=attempt("where", lambda: farthest_off(diagnosis), None),
            alternative=attempt("closest alternative", lambda: closest_alternative(diagnosis), None),
            failed=attempt.failed,
        )
    torque, no_torque = attempt("unmodelled torque", lambda: _torque(diagnosis), (None, ""))
    fit_of_torque = None if torque is None else torque.fit
    parts = attempt("parts", lambda: parts_against_rest(kind, final), ())
    together = fits(diagnosis.verdict)
    # If all together do not fit, how far a part is from the others is linear about a fit that is wrong: any is left out
    names = [p.part for p in parts if p.contradicts or not together]
    between, separations = attempt("next measurement", lambda: _next(diagnosis), ((), ()))
    alike = attempt("similar effects", lambda: look_alikes(diagnosis), None)
    best = alike.best_single[0] if alike and alike.best_single else ""
    predictions = attempt("held-out runs", lambda: predict_held_out(diagnosis, fit_of_torque, best), ())
    predicted_chi2 = [(prediction.numbers, prediction.chi2) for prediction in predictions]
    return Findings(
        story=attempt("story", lambda: tell(diagnosis, predicted_chi2, torque, alike), None),
        where=attempt("where", lambda: farthest_off(diagnosis), None),
        moved=compare_nuisances(hypotheses.null, final),
        alternative=attempt("closest alternative", lambda: closest_alternative(diagnosis, between), None),
        between=between,
        further=separations,
        parts=parts,
        joint_fits=together,
        limits=attempt("upper limits", lambda: upper_limits(kind, hypotheses, final), ()),
        doubts=attempt("doubts", lambda: doubts(diagnosis, fit_of_torque), ()),
        predicted=predictions,
        without=attempt("parts", lambda: without_each(kind, names, single_out=not together), {}),
        torque=torque,
        no_torque=no_torque,
        failed=attempt.failed,
    )


def _torque(diagnosis: Diagnosis) -> tuple[Residual | None, str]:
    """The unmodelled torque, or why there is none."""
    try:
        return fit_residual(diagnosis), ""
    except InputError as error:
        return None, str(error)


@one_blas_thread()
def with_stability(
    findings: Findings, diagnosis: Diagnosis, progress: Callable[[str], None] | None = None, *, workers: int = 1
) -> Findings:
    """Copy of the ``findings`` with their variants judged by ``workers`` processes; ``progress`` gets each in words."""

    def judged() -> Stability:
        if workers == 1:
            return stability(diagnosis, progress=progress)
        with model_workers(workers) as pool:
            return stability(diagnosis, run=pool.map, progress=progress)

    attempt = Attempts()
    variants = attempt("variants", judged, None)
    return replace(findings, stability=variants, failed={**findings.failed, **attempt.failed})


# ---------------------------------------------------------------------- alternatives, and what distinguishes them


def leading_two(judgement: Judgement) -> tuple[Fit, ...]:
    """The leading hypothesis and its closest alternative; fewer than two if none is within hopeless odds of it."""
    hypotheses, final, word = judgement.hypotheses, judgement.final, judgement.verdict.verdict
    ranked = _able(judgement) if word == "unknown" else [f for f in _rank_all(hypotheses) if f.admissible]
    if word == "none" and len(ranked) < 2:
        ranked = [
            f for f in _rank_all(hypotheses) if f.converged
        ]  # data that limit no size leave it open whether there is one
    if word in ("none", "unknown"):
        return tuple(f for f in ranked[:2] if hypotheses.odds(ranked[0], f) < RULES.hopeless_odds)
    if word == "tentative" and (
        hypotheses.p_nothing >= RULES.nothing or any(c.rule in AGAINST_NOTHING for c in judgement.verdict.failed)
    ):
        return (final, hypotheses.null)
    return (final, *[f for f in ranked if f is not final and hypotheses.odds(final, f) < RULES.hopeless_odds][:1])


def closest_alternative(judgement: Judgement, between: Sequence[str] = ()) -> Alternative | None:
    """The closest alternative: what a next measurement separates from the leader (the two ``between``), else the next.

    If nothing is named it is the hypothesis that comes closest to explaining the data. None if there is no other.
    """
    hypotheses, verdict, final = judgement.hypotheses, judgement.verdict, judgement.final
    if verdict.verdict == "unknown":
        name = verdict.look_alike.name if verdict.look_alike else ""
    elif verdict.verdict == "class":
        name = verdict.rivals[0]
    elif len(between) > 1 and between[1] not in verdict.equivalent:
        name = between[1]
    else:
        able = [f for f in _rank_all(hypotheses) if f is hypotheses.null or f.admissible]
        others = [f for f in able if f is not final and f.name not in verdict.equivalent]
        if final.candidates:  # a hypothesis that contains what is named is no alternative to it
            others = [f for f in others if not f.identifiers >= final.identifiers]
        name = others[0].name if others else ""
    if not name:
        return None
    alternative = hypotheses.null if name == NOTHING else hypotheses.find(frozenset(name.split("+")))
    if alternative is None:
        return None
    n = len(judgement.nominal)
    return Alternative(name, hypotheses.posterior[name], alternative.chi2 / n, final.chi2 / n)


def _rank_all(hypotheses: Hypotheses) -> list[Fit]:
    """Nothing and all hypotheses, most probable first; all may be too improbable for a number, not for a logarithm."""
    return sorted((hypotheses.null, *hypotheses.fits), key=lambda f: -hypotheses.log_posterior(f))


def _able(judgement: Judgement) -> list[Fit]:
    """Hypotheses that fit with sizes that matter, even at a bound."""
    fits_ = [f for f in _rank_all(judgement.hypotheses) if f.converged and not f.effects_too_small()]
    return [f for f in fits_ if f.fits_data]


def _next(diagnosis: Diagnosis) -> tuple[tuple[str, ...], tuple[Separation, ...]]:
    """Names of hypotheses to separate, and measurements that do, best first; of a clear verdict from 1 sd on."""
    verdict, rivals = diagnosis.verdict, leading_two(diagnosis)
    between, separations = verdict.equivalent, verdict.separating_measurements
    if len(between) < 2 or diagnosis.hypotheses.null in rivals:
        between = tuple(f.name for f in rivals)
        separations = tuple(rank_measurements(diagnosis.kind, list(rivals))) if len(rivals) > 1 else ()
    least = 1.0 if verdict.verdict in ("named", "none") else 0.05  # sd
    return between, tuple(s for s in separations if s.gain >= least)


# ---------------------------------------------------------------------- held-out runs


def predict_held_out(diagnosis: Diagnosis, torque: Fit | None = None, single: str = "") -> tuple[Predicted, ...]:
    """Predict the held-out runs by each model, part by part; empty if there are none.

    Also with a residual ``torque``, and by a ``single`` effect, if there are such.
    """
    unseen = diagnosis.kind.held_out_data()
    if unseen is None:
        return ()
    hypotheses = diagnosis.hypotheses
    fits_ = {"nuisance_only": hypotheses.null, "final": diagnosis.final}
    fits_ |= {} if diagnosis.alone is None else {"effect_alone": diagnosis.alone}
    fits_ |= {} if torque is None else {"with_torque": torque}
    best = hypotheses.find(frozenset({single})) if single else None
    fits_ |= {} if best is None else {"single_effect": best}
    predictions = predict(unseen, {model: coordinates_of(f) for model, f in fits_.items()})
    return tuple(replace(prediction, single=single) for prediction in predictions)


def look_alikes(diagnosis: Diagnosis) -> LookAlikes | None:
    """Share of the discrepancy with the closest alternative and single effects; None if there is none, or a name.

    On held-out runs if there are such, else on the fitted data.
    """
    hypotheses, verdict = diagnosis.hypotheses, diagnosis.verdict
    if verdict.verdict != "unknown":
        return None
    usable = [f for f in hypotheses.rank(1) if f.converged and not f.candidates[0].absorbs]
    if (
        diagnosis.kind.held_out_data() is not None
    ):  # a bias is integrated out of each run, of these too: it predicts nothing
        usable = [f for f in usable if f.candidates[0].unknowns]
    nearest = None if verdict.look_alike is None else hypotheses.find(frozenset(verdict.look_alike.name.split("+")))
    fits_ = [hypotheses.null, *usable]
    if nearest is not None:
        fits_.append(nearest)
    gaps, unseen = _gaps(diagnosis, fits_)
    if not gaps:
        return None
    adjusted = gaps[hypotheses.null]
    if nearest is None and usable:
        nearest = min(usable, key=lambda f: gaps[f])
    remaining_share = adjusted if nearest is None else gaps[nearest]
    singles = sorted(((f.name, gaps[f]) for f in usable), key=lambda single: single[1])
    return LookAlikes(
        unseen=unseen,
        adjusted=adjusted,
        nearest=nearest.name if nearest else "",
        left=remaining_share,
        singles=tuple((name, share) for name, share in singles if share <= 2 * remaining_share and share < adjusted),
        best_single=singles[0] if singles else None,
        tried=len(usable),
    )


def _gaps(diagnosis: Diagnosis, fits_: Sequence[Fit]) -> tuple[dict[Fit, float], bool]:
    """Share of the base model's discrepancy with each fit (empty if it has none), and whether on held-out runs."""
    unseen = diagnosis.kind.held_out_data()
    if unseen is None:
        count = len(diagnosis.nominal)
        base = float(diagnosis.nominal @ diagnosis.nominal)
        chi2 = {f: f.chi2 for f in fits_}
    else:
        predictions = predict(unseen, {str(k): coordinates_of(f) for k, f in enumerate(fits_)})
        count = sum(prediction.numbers for prediction in predictions)
        base = sum(prediction.chi2["nominal"] for prediction in predictions)
        chi2 = {f: sum(prediction.chi2[str(k)] for prediction in predictions) for k, f in enumerate(fits_)}
    excess = base / count - 1
    if not 0 < excess < math.inf:
        return {}, unseen is not None
    return {f: math.sqrt(max(0.0, x / count - 1) / excess) for f, x in chi2.items()}, unseen is not None


def predict(unseen: Kind, fits_by_model: Mapping[str, Found]) -> tuple[Predicted, ...]:
    """Predict by fits, by the name of their model, data that they have not seen, part by part."""
    predictions = []
    for part, part_kind, whole in unseen.split_parts():
        models: dict[str, Found] = {
            "nominal": ((), {u.name: np.array([u.centre]) for u in whole.nuisances}),
            **fits_by_model,
        }
        chi2: dict[str, float] = {}
        rms: dict[str, dict[str, float]] = {}
        residuals: dict[str, Array] = {}
        for model, (candidates, coordinates) in models.items():
            acting, theta = select_concerning(whole, candidates, coordinates)
            if whole is not part_kind:
                acting, places = whole.restrict_to_part(0, acting)
                theta = theta[places]
            residual, _ = part_kind.residual(acting, theta, slopes=False)
            squared = float(residual @ residual)
            chi2[model] = squared if math.isfinite(squared) else math.inf
            residuals = part_kind.residuals_by_channel(acting, theta)
            for name, channel_residual in residuals.items():
                rms.setdefault(name, {})[model] = float(np.sqrt(np.mean(channel_residual**2)))
        count = len(part_kind.rows.places)
        predictions.append(
            Predicted(part, part_kind.recordings, count, chi2, rms, part_kind.channel_noise_sd(residuals))
        )
    return tuple(predictions)


def coordinates_of(hypothesis: Fit) -> Found:
    """The candidates of a fitted ``hypothesis``, and its coordinates by name."""
    floating = {u.name: hypothesis.theta[k : k + 1] for k, u in enumerate(hypothesis.nuisances)}
    sizes = {c.identifier: hypothesis.theta[hypothesis.columns(c)] for c in hypothesis.candidates}
    return hypothesis.candidates, floating | sizes


def select_concerning(
    kind: Kind, candidates: tuple[Candidate, ...], at: Mapping[str, Array]
) -> tuple[tuple[Candidate, ...], Array]:
    """Candidates that concern a ``kind``, and its coordinates among those that :func:`coordinates_of` gives."""
    acting = tuple(c for c in candidates if kind.concerns(c))
    sizes = (at[c.identifier] for c in acting)
    return acting, np.concatenate([*(at[u.name] for u in kind.nuisances), *sizes, np.zeros(0)])
