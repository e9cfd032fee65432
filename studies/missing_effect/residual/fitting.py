"""The residual torque of a diagnosis: fitted on top of what was named, sparse, with the covariance of everything.

The parameters of the bicycle and of the named effects float under their priors. Terms are chosen on the linearised
problem (:mod:`.selection`), fitted with the full model, and chosen anew about that fit until they stay.

The covariance is that about the fit, times the misfit where chi^2 remains too large (Birge 1932, Phys. Rev. 40), and
averaged over how large the terms may be that were not chosen: each has a normal prior about zero whose width, common to
all in units of their usual sizes, is integrated out. So what was left out is zero within what the data leave open.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from studies.inference.acceptance import leaves_more
from studies.inference.checks import HeldOut, goodness_of_fit, held_out
from studies.inference.fit import Fit, fit
from studies.inference.forward import Forward
from studies.inference.joint import JointForward
from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.forced.forward import FrequencyForward
from studies.missing_effect.motion.bicycle_forward import BicycleForward
from studies.missing_effect.motion.canonical_forward import CanonicalForward
from studies.missing_effect.motion.history_forward import HistoryForward
from studies.missing_effect.motion.measurements import BicycleMeasurement
from studies.missing_effect.motion.modal_forward import ModalForward
from studies.missing_effect.residual.linear import first_of, is_torque, linearised
from studies.missing_effect.residual.selection import Linear, Selector
from studies.missing_effect.residual.terms import (
    PAIRS,
    Degrees,
    Pair,
    SpeedScale,
    candidate,
    check_absent,
    keys,
    name_of,
)
from tyre.base.arrays import Array
from tyre.base.errors import InputError

MOST_MISFIT = 4.0  # chi^2 a number; beyond it the torque leaves more than twice the noise
ROUNDS = 4  # of choosing terms and fitting them
WIDTHS = np.array([0.1, 0.3, 1.0])
"""Of the terms that were not chosen, in usual sizes; from 0.003 on, intervals of blind cases were too narrow."""


@dataclass(frozen=True, eq=False)
class Residual:
    """A residual torque beside a diagnosis; it is never a name.

    Attributes
    ----------
    fit : Fit
        The named model with the residual torque.
    beside : Fit
        The named model without it.
    degrees : mapping
        Number of terms by pair of torque and state.
    scale : SpeedScale
    covariance : ndarray, shape (p + q, p + q)
        Of the p coordinates of ``fit``, then of the q terms that were not chosen.
    before, after : HeldOut
        Held-out prediction without and with it.
    gains : mapping
        Of each term: the log evidence and the held-out log score that it gains.
    misfit : float
        Factor on the variances: chi^2 over n of the fit, at least 1.
    p : float
        P(chi^2 larger) of the fit.
    """

    fit: Fit
    beside: Fit
    degrees: Degrees
    scale: SpeedScale
    covariance: Array
    before: HeldOut
    after: HeldOut
    gains: Mapping[str, tuple[float, float]]
    misfit: float
    p: float

    @property
    def kept(self) -> tuple[str, ...]:
        """Parameters of the effect that were fitted."""
        return tuple(name_of(*key) for key in keys(self.degrees))

    @property
    def dropped(self) -> tuple[str, ...]:
        """Those that were not chosen: zero within the covariance."""
        full = dict.fromkeys(PAIRS, self.scale.most)
        return tuple(name for name in (name_of(*key) for key in keys(full)) if name not in self.kept)

    @property
    def values(self) -> dict[str, float]:
        """Coefficients that were fitted, N m/rad or N m s/rad."""
        return dict(zip(self.kept, self.fit.theta[self._columns].tolist(), strict=True))

    @property
    def sd(self) -> dict[str, float]:
        """One standard deviation of every coefficient, chosen or not."""
        first = self._columns.start
        spread = np.sqrt(self.covariance.diagonal()[first:])
        return dict(zip((*self.kept, *self.dropped), spread.tolist(), strict=True))

    @property
    def sd_alone(self) -> dict[str, float]:
        """The same of those that were fitted, were all others zero."""
        spread = np.sqrt(self.misfit * self.fit.covariance.diagonal()[self._columns])
        return dict(zip(self.kept, spread.tolist(), strict=True))

    @property
    def describes(self) -> bool:
        """Whether what the torque leaves is small enough for it to be what the data show."""
        return self.misfit <= MOST_MISFIT

    @property
    def _columns(self) -> slice:
        return self.fit.columns(self.fit.candidates[-1])

    def gains_at(self, speeds: Array) -> tuple[Array, Array]:
        """Torque over state (k, 2, 4) at ``speeds`` (k,), m/s, and its standard deviation; torques and states in the
        order of :mod:`.terms`.
        """
        names = (*self.kept, *self.dropped)
        values = np.array([*self.values.values(), *[0.0] * len(self.dropped)])
        spread = self.covariance[self._columns.start :, self._columns.start :]
        powers = self.scale.powers(speeds)
        mean, sd = np.zeros((2, len(speeds), len(PAIRS)))
        for column, pair in enumerate(PAIRS):
            row = np.zeros((len(speeds), len(names)))
            for degree in range(self.scale.most):
                row[:, names.index(name_of(pair, degree))] = powers[:, degree]
            mean[:, column] = row @ values
            sd[:, column] = np.sqrt(np.maximum(np.einsum("ki,ij,kj->k", row, spread, row), 0.0))
        shape = (len(speeds), 2, 4)
        return mean.reshape(shape), sd.reshape(shape)


def speeds_of(forward: Forward) -> Array:
    """Measured speeds (n,) of a ``forward`` model of bicycle motion, m/s.

    Raises
    ------
    InputError
        Data without motion: a bench test, the tyre on a rig.
    """
    if isinstance(forward, JointForward):
        return np.concatenate([speeds_of(part.forward) for part in forward.parts])
    if isinstance(forward, ModalForward):
        return np.array([point.speed for point in forward.points])
    if isinstance(forward, HistoryForward):
        return np.array([run.speed for run in forward.runs])
    if isinstance(forward, FrequencyForward):
        return forward.wanted.speed
    if isinstance(forward, CanonicalForward):
        return np.array(forward.table.speeds, float)
    raise InputError("a torque over state and speed is fitted to motion alone, not to a bench test or a tyre on a rig")


def base_of(forward: Forward) -> BicycleForward:
    """The first ``forward`` model of a bicycle among the parts, or itself."""
    part = forward.parts[0].forward if isinstance(forward, JointForward) else forward
    assert isinstance(part, BicycleForward)
    return part


@np.errstate(over="ignore", invalid="ignore")  # trial steps that run away are refused
def fit_residual(diagnosis: Diagnosis) -> Residual | None:
    """The residual torque of a finished ``diagnosis``; None where no more than noise is left, or a tyre was measured.

    Raises
    ------
    InputError
        The data cannot carry one: a single run, a part without motion, no term that improves the held-out score, a
        base model with one.
    """
    if not leaves_more(diagnosis.verdict) or not isinstance(diagnosis.measurement, BicycleMeasurement):
        return None
    forward, beside = diagnosis.forward, diagnosis.final
    check_absent(base_of(forward).base.effects)
    if len(np.unique(forward.rows.fold)) < 2:
        raise InputError("all data are of one run: none can be left out to tell a torque from a good fit")
    scale = SpeedScale.of(speeds_of(forward))
    start: dict[Pair, int] = {}
    best, degrees, tried = beside, start, [start]
    for _ in range(ROUNDS):
        degrees = _selector(linearised(forward, best, scale), first_of(best), scale).select(degrees)
        if degrees in tried:
            break
        tried.append(degrees)
        found = _fitted(forward, best, degrees, scale)
        if found.objective >= best.objective and len(found.theta) >= len(best.theta):
            break
        best = found
    degrees = _degrees(best, scale)
    if not degrees:
        raise InputError("no torque that is linear in the state improves the prediction of data left out")
    before = held_out(forward, beside)
    while True:  # whether the full model keeps what the linearised problem promised
        linear = linearised(forward, best, scale)
        selector = _selector(linear, first_of(best), scale)
        gains, fewer = selector.gains(degrees), selector.without_useless(degrees)
        if fewer == degrees:
            after = held_out(forward, best)
            if after.log_score > before.log_score and after.chi2 < before.chi2:
                break
            fewer = selector.without_weakest(degrees)
        if not fewer:
            raise InputError("a torque that is linear in the state does not improve the prediction of data left out")
        degrees = fewer
        best = _fitted(forward, best, degrees, scale)
    if not best.theta[best.columns(best.candidates[-1])].any():
        raise InputError("fitted to all data, the torque that the data left out would ask for is zero")
    misfit = max(1.0, best.objective / len(best.residual))
    selector = Selector(linear.louder(math.sqrt(misfit)), first_of(best), scale)
    covariance = _covariance(best, selector, degrees)
    p = goodness_of_fit(forward, best)
    told = {name_of(*key): gain for key, gain in gains.items()}
    return Residual(best, beside, degrees, scale, covariance, before, after, told, misfit, p)


def _degrees(found: Fit, scale: SpeedScale) -> dict[Pair, int]:
    if not found.candidates or found.candidates[-1].effect is None:
        return {}
    names = {u.name for u in found.unknowns[found.columns(found.candidates[-1])]}
    counts = {pair: sum(name_of(pair, k) in names for k in range(scale.most)) for pair in PAIRS}
    return {pair: count for pair, count in counts.items() if count}


def _fitted(forward: Forward, last: Fit, degrees: Degrees, scale: SpeedScale) -> Fit:
    """The full model with the terms of ``degrees``, from where the ``last`` fit ended."""
    named = tuple(c for c in last.candidates if not is_torque(c.identifier))
    joined = (*named, candidate(degrees, scale))
    known = dict(zip((u.name for u in last.unknowns[first_of(last) :]), last.theta[first_of(last) :], strict=True))
    start = np.concatenate([last.theta[: first_of(last)], [known.get(u.name, 0.0) for u in joined[-1].unknowns]])
    return fit(forward, joined, starts=[start])


def _selector(linear: Linear, floating: int, scale: SpeedScale) -> Selector:
    """A search in which the noise is as loud as all terms together must have it."""
    noise = max(1.0, linear.misfit(np.arange(linear.jacobian.shape[1])))
    return Selector(linear.louder(math.sqrt(noise)), floating, scale)


def _covariance(best: Fit, selector: Selector, degrees: Degrees) -> Array:
    """Second moment about the fit of its coordinates and of the terms that were not chosen, in their units."""
    chosen = selector.columns(degrees)
    every = np.array([*chosen, *sorted({*selector.columns(selector.full)} - {*chosen})], dtype=np.intp)
    full = candidate(selector.full, selector.scale)
    own = {u.name: u.scale for u in full.unknowns}
    names = [name_of(*key) for key in keys(selector.full)]
    sd = np.array([*(u.scale for u in best.unknowns[: selector.floating]),
                   *(own[names[k - selector.floating]] for k in every[selector.floating :])])  # fmt: skip
    linear, kept = selector.linear, len(chosen)
    about, _ = linear.posterior(chosen)
    means, spreads, logs = [], [], []
    for width in WIDTHS:
        widths = np.array([1.0] * kept + [width] * (len(every) - kept))
        mean, spread = linear.posterior(every, widths)
        away = mean - np.concatenate([about, np.zeros(len(every) - kept)])
        means.append(away)
        spreads.append(spread)
        logs.append(linear.evidence(every, widths))
    weights = np.exp(np.array(logs) - max(logs))
    weights /= weights.sum()
    moment = sum(w * (s + np.outer(m, m)) for w, s, m in zip(weights, spreads, means, strict=True))
    return np.asarray(moment * np.outer(sd, sd))
