"""The unmodelled torque: the unexplained remainder as a torque linear in the state, with its covariance.

The parameters of the bicycle and of the named effects float under their priors. Terms are chosen on the linearised
problem, fitted with the full model, and chosen again about that fit until they stay. The torque is never a name.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bicycle.effects.effect_registry import effect_class
from studies.diagnosis.diagnose import Diagnosis
from studies.inference import Candidate, Fit, HeldOut, Kind, Linear, UncertainParameter, fit, held_out, prior
from studies.inference.parameter import slopes_of, values_of
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError

EFFECT, TORQUE = "unmodelled_torque", "unmodelled torque"
TORQUES = ("steer", "lean")
STATES = ("lean", "steer", "lean_rate", "steer_rate")
DEGREES = ("", "_slope", "_curve")

Pair = tuple[str, str]
Degrees = Mapping[Pair, int]  # terms of each pair of torque and state: 1 constant, 2 linear, 3 quadratic in the speed

PAIRS: tuple[Pair, ...] = tuple((torque, state) for torque in TORQUES for state in STATES)


@dataclass(frozen=True)
class SpeedScale:
    """The coordinate x = (v - middle) / span in which coefficients change with the speed v, m/s."""

    middle: float  # m/s, between the slowest and the fastest measured speed
    span: float  # m/s, half of the range of speeds; a tenth of ``middle`` or more
    most: int  # terms of a pair that the number of distinct speeds allows

    @classmethod
    def of(cls, speeds: ArrayLike) -> "SpeedScale":
        """Scale of measured ``speeds`` (n,), m/s; speeds that lie within a tenth are one."""
        v = np.unique(np.asarray(speeds, float))
        middle = float(v[0] + v[-1]) / 2
        half = float(v[-1] - v[0]) / 2
        least = 0.1
        distinct = 1 + int((np.diff(v) > least / 2 * v[1:]).sum())
        return cls(middle, max(half, least * middle), min(distinct, len(DEGREES)))

    @property
    def ends(self) -> tuple[float, float]:
        """The slowest and the fastest measured speed, m/s."""
        return self.middle - self.span, self.middle + self.span

    @property
    def full(self) -> dict[Pair, int]:
        """All terms that the speeds allow."""
        return dict.fromkeys(PAIRS, self.most)

    def powers(self, speeds: ArrayLike) -> Array:
        """1, x, x^2 at ``speeds`` (..., ), m/s: (..., 3)."""
        x = (np.asarray(speeds, float) - self.middle) / self.span
        return np.stack([np.ones_like(x), x, x**2], -1)


def keys(degrees: Degrees) -> tuple[tuple[Pair, int], ...]:
    """Pair and power of the speed of each term of ``degrees``, in a fixed order."""
    return tuple((pair, k) for pair in PAIRS for k in range(degrees.get(pair, 0)))


def term_names(degrees: Degrees) -> tuple[str, ...]:
    """Parameters of the effect for the terms of ``degrees``."""
    return tuple(f"{torque}_from_{state}{DEGREES[degree]}" for (torque, state), degree in keys(degrees))


def candidate(degrees: Degrees, scale: SpeedScale) -> Candidate:
    """The unmodelled torque with some terms, ready to join a hypothesis."""
    effect = effect_class(EFFECT)
    declared = {p.name: p for p in effect.parameters}
    fixed = {f"{EFFECT}.{name}": 0.0 for name in declared}
    fixed |= {f"{EFFECT}.middle_speed": scale.middle, f"{EFFECT}.speed_span": scale.span}
    unknowns = []
    for name, (_, degree) in zip(term_names(degrees), keys(degrees), strict=True):
        sd = declared[name].typical[1] * (0.5 if degree else 1.0)
        unknowns.append(UncertainParameter(name, declared[name].unit, {f"{EFFECT}.{name}": 1.0}, 0.0, sd, size=True))
    name = f"{TORQUE} ({', '.join(u.name for u in unknowns)})"  # that of the effect is among those never tried
    return Candidate(name, tuple(unknowns), effect=effect, fixed=fixed)


def _named_candidates(fitted: Fit) -> tuple[Candidate, ...]:
    """Candidates of a fit without its unmodelled torque."""
    return tuple(c for c in fitted.candidates if not c.identifier.startswith(TORQUE))


def _count_before_torque(fitted: Fit) -> int:
    """Number of coordinates of a fit before those of its unmodelled torque."""
    return fitted.effect_columns.start + sum(len(c.unknowns) for c in _named_candidates(fitted))


def linearise(kind: Kind, about: Fit, scale: SpeedScale) -> Linear:
    """Linearise the problem about a fit: columns of all other unknowns, then of all terms of the torque."""
    first = _count_before_torque(about)
    joined = (*_named_candidates(about), candidate(scale.full, scale))
    theta = _coordinates(about, joined)
    residual, jacobian = kind.residual(joined, theta)
    centre, sd = prior((*about.unknowns[:first], *joined[-1].unknowns), joined)
    scaled = jacobian * sd
    return Linear(scaled, scaled @ ((theta - centre) / sd) - residual, kind.rows.fold)


def _coordinates(about: Fit, joined: tuple[Candidate, ...]) -> Array:
    """Coordinates of a fit with other terms of the torque, which is the last of the candidates: new ones at zero."""
    first = _count_before_torque(about)
    coordinates = dict(zip((u.name for u in about.unknowns[first:]), about.theta[first:], strict=True))
    return np.concatenate([about.theta[:first], [coordinates.get(u.name, 0.0) for u in joined[-1].unknowns]])


@dataclass(frozen=True, eq=False)
class Selector:
    """Search over the number of terms of each pair; ``floating`` columns of ``linear`` precede the terms."""

    linear: Linear
    floating: int  # how many
    scale: SpeedScale  # of the measured speeds; its ``most`` limits the terms of a pair

    def columns(self, degrees: Degrees) -> NDArray[np.intp]:
        """Columns (q,) of what floats anyway and of the terms of ``degrees``."""
        place = {key: self.floating + k for k, key in enumerate(keys(self.scale.full))}
        return np.array([*range(self.floating), *(place[key] for key in keys(degrees))], dtype=np.intp)

    def score(self, degrees: Degrees) -> float:
        """Held-out log score."""
        return self.linear.held_out(self.columns(degrees))

    def worth(self, degrees: Degrees) -> float:
        """Log evidence, with log odds of 8 against a further pair (of eight) and of 2 against a further power."""
        terms = [count for count in degrees.values() if count]
        price = math.log(8) * len(terms) + math.log(2) * sum(count - 1 for count in terms)
        return self.linear.evidence(self.columns(degrees)) - price

    def select(self, start: Degrees) -> dict[Pair, int]:
        """Terms added, raised, lowered and dropped while the evidence and the held-out score grow."""
        chosen = {pair: count for pair, count in start.items() if count}
        while (better := self._find_better(chosen)) is not None:
            chosen = better
        while chosen:
            best = max((_lower(chosen, pair) for pair in chosen), key=self.score)
            if self.score(best) < self.score(chosen):
                break
            chosen = best
        return chosen

    def _find_better(self, chosen: dict[Pair, int]) -> dict[Pair, int] | None:
        """First move by evidence with more than ``chosen``, and fewer terms or a better held-out score; or None."""
        current = self.worth(chosen)
        score = self.score(chosen)
        moves = sorted(((self.worth(move), k, move) for k, move in enumerate(self._moves(chosen))), reverse=True)
        for worth, _, move in moves:
            if worth <= current:
                return None
            if len(keys(move)) < len(keys(chosen)) or self.score(move) > score:
                return move
        return None

    def _moves(self, chosen: dict[Pair, int]) -> Iterator[dict[Pair, int]]:
        """Choices one move from ``chosen``: a pair alone, or with another number of terms."""
        for pair in PAIRS:
            if len(chosen) > 1:  # several pairs may have come in for one that explains the data alone
                yield {pair: 1}
            terms = chosen.get(pair, 0)
            for count in {terms - 1, terms + 1, terms + 2, 0} - {terms, -1}:
                if count <= self.scale.most:
                    yield {p: n for p, n in (chosen | {pair: count}).items() if n}

    def gains(self, chosen: Degrees) -> dict[Pair, tuple[float, float]]:
        """Gain of the last term of each pair: log evidence, and held-out log score."""
        gains_by_pair, these, linear = {}, self.columns(chosen), self.linear
        for pair in chosen:
            fewer = self.columns(_lower(chosen, pair))
            gains = linear.evidence(these) - linear.evidence(fewer), linear.held_out(these) - linear.held_out(fewer)
            gains_by_pair[pair] = gains
        return gains_by_pair

    def drop_least_useful(self, chosen: Degrees) -> dict[Pair, int]:
        """The terms less one power of the pair whose last term costs the held-out score most, if any does."""
        gains = self.gains(chosen)
        worst = min(gains, key=lambda pair: gains[pair][1])
        return dict(chosen) if gains[worst][1] > 0 else _lower(chosen, worst)


def _lower(chosen: Degrees, pair: Pair) -> dict[Pair, int]:
    return {p: n - (p == pair) for p, n in chosen.items() if n - (p == pair)}


@dataclass(frozen=True)
class Changed:
    """A parameter that the torque moves by more than one sd."""

    name: str  # of the parameter
    unit: str  # of the values and the sd
    effect: str  # whose it is; "" of the bicycle and the measurement
    named: float  # its value without the torque, in ``unit``
    value: float  # with the torque, in ``unit``
    sd: float  # of ``value``, in ``unit``
    replaced: bool  # it is the size of an effect that is no longer significant beside the torque


@dataclass(frozen=True, eq=False)
class Residual:
    """An unmodelled torque, fitted together with the named model of a diagnosis."""

    fit: Fit  # the named model with the unmodelled torque
    named: Fit  # the named model without it
    degrees: Degrees  # number of terms by pair of torque and state
    scale: SpeedScale  # of the measured speeds, which the terms are polynomials of
    covariance: Array  # (p + q, p + q), of the p coordinates of fit, then of the q terms that were not chosen
    before: HeldOut  # prediction of data left out, without
    after: HeldOut  # and with the torque
    gains: Mapping[str, tuple[float, float]]  # log evidence and held-out log score of the last term of each pair
    p: float  # P(chi^2 larger) of the fit

    @property
    def kept(self) -> tuple[str, ...]:
        """Parameters of the effect that were fitted."""
        return term_names(self.degrees)

    @property
    def dropped(self) -> tuple[str, ...]:
        """Parameters that were not chosen: zero within the covariance."""
        return tuple(name for name in term_names(self.scale.full) if name not in self.kept)

    @property
    def values(self) -> dict[str, float]:
        """Coefficients that were fitted, N m/rad or N m s/rad."""
        return dict(zip(self.kept, self.fit.theta[_count_before_torque(self.fit) :].tolist(), strict=True))

    @property
    def units(self) -> dict[str, str]:
        """Unit of every coefficient that was fitted."""
        return {u.name: u.unit for u in self.fit.unknowns[_count_before_torque(self.fit) :]}

    @property
    def sd(self) -> dict[str, float]:
        """One standard deviation of every coefficient, chosen or not."""
        spread = np.sqrt(self.covariance.diagonal()[_count_before_torque(self.fit) :])
        return dict(zip((*self.kept, *self.dropped), spread.tolist(), strict=True))

    @property
    def sd_alone(self) -> dict[str, float]:
        """Standard deviation of those that were fitted, were all others zero."""
        spread = np.sqrt(self.fit.misfit * self.fit.covariance.diagonal()[_count_before_torque(self.fit) :])
        return dict(zip(self.kept, spread.tolist(), strict=True))

    @property
    def describes(self) -> bool:
        """It leaves at most twice the noise, so that it is what the data show."""
        return self.fit.misfit <= 4.0

    def gains_at(self, speeds: Array) -> tuple[Array, Array]:
        """Torque over state (k, 2, 4) at ``speeds`` (k,), m/s, and its standard deviation."""
        names = (*self.kept, *self.dropped)
        values = np.array([*self.values.values(), *[0.0] * len(self.dropped)])
        first = _count_before_torque(self.fit)
        powers = self.scale.powers(speeds)[:, : self.scale.most]
        mean, sd = np.zeros((2, len(speeds), len(PAIRS)))
        for column, pair in enumerate(PAIRS):
            row = np.zeros((len(speeds), len(names)))
            row[:, [names.index(name) for name in term_names({pair: self.scale.most})]] = powers
            mean[:, column] = row @ values
            variance = np.einsum("ki,ij,kj->k", row, self.covariance[first:, first:], row)
            sd[:, column] = np.sqrt(np.maximum(variance, 0.0))
        return mean.reshape(-1, 2, 4), sd.reshape(-1, 2, 4)

    def list_changes(self) -> tuple[Changed, ...]:
        """Parameters more than one sd from the fit without the torque, named effects first."""
        without_torque = self.named
        owner = {
            k: c.identifier
            for c in without_torque.candidates
            for k in range(*without_torque.columns(c).indices(len(without_torque.theta)))
        }
        spread, after = (np.sqrt(np.maximum(c.diagonal(), 0.0)) for c in (without_torque.covariance, self.covariance))
        count = len(without_torque.theta)
        ends = np.stack([without_torque.theta, self.fit.theta[:count]], 1)
        values = values_of(without_torque.unknowns, ends)
        slopes = slopes_of(without_torque.unknowns, ends[:, 1])
        value_sd = np.sqrt(np.maximum(np.diag(slopes @ self.covariance[:count, :count] @ slopes.T), 0.0))
        changes = []
        for k, (u, (before, moved_to)) in enumerate(zip(without_torque.unknowns, ends, strict=True)):
            if abs(moved_to - before) > spread[k]:
                was = abs(before - u.centre) >= 2.0 * spread[k]
                vanishes = bool(u.size and was and abs(moved_to - u.centre) < 2.0 * after[k])
                first, last, sd = (float(x) for x in (*values[k], value_sd[k]))
                for name, factor in u.factors.items():
                    sized = factor * first, factor * last, factor * sd
                    changes.append(Changed(name, u.unit, owner.get(k, ""), *sized, vanishes))
        return tuple(sorted(changes, key=lambda change: not change.effect))


@np.errstate(over="ignore", invalid="ignore")  # trial steps that run away are refused
def fit_residual(diagnosis: Diagnosis) -> Residual | None:
    """The unmodelled torque of a finished ``diagnosis``; None if no more than noise is left, or a tyre was measured."""
    kind, named_fit = diagnosis.kind, diagnosis.final
    if not diagnosis.verdict.leaves_more or kind.model is None:
        return None
    if any(effect.identifier == EFFECT for effect in kind.model.effects):
        raise InputError(f"the base model has [effects.{EFFECT}] already; remove it to fit it again")
    if len(np.unique(kind.rows.fold)) < 2:
        raise InputError("all data are of one run, so none can be held out to test a torque")
    if not len(kind.speeds):
        raise InputError("a torque of state and speed needs motion, not a bench test or a tyre on a rig")
    scale = SpeedScale.of(kind.speeds)
    best = _choose_and_fit(kind, named_fit, scale)
    before = held_out(kind, named_fit)
    degrees = _degrees(best)
    while True:  # until the full model keeps what the linearised problem promised
        if not degrees:
            raise InputError("no torque that is linear in the state improves the prediction of held-out data")
        if degrees != _degrees(best):
            best = _fit_terms(kind, best, degrees, scale)
        linear = linearise(kind, best, scale)
        selector = _selector(linear, best, scale)
        fewer = selector.drop_least_useful(degrees)
        if fewer == degrees:
            after = held_out(kind, best)
            # data left out may ask for a torque that all data refuse
            has_torque = best.theta[_count_before_torque(best) :].any()
            if has_torque and after.log_score > before.log_score and after.chi2 < before.chi2:
                break
            # without the pair whose loss costs the held-out score least
            fewer = max(({p: n for p, n in degrees.items() if p != pair} for pair in degrees), key=selector.score)
        degrees = fewer
    gains = {term_names({pair: degrees[pair]})[-1]: gain for pair, gain in selector.gains(degrees).items()}
    covariance = _covariance(best, Selector(linear.with_noise(best.misfit), _count_before_torque(best), scale), degrees)
    return Residual(best, named_fit, degrees, scale, covariance, before, after, gains, best.goodness)


def _choose_and_fit(kind: Kind, named_fit: Fit, scale: SpeedScale) -> Fit:
    """Terms chosen and fitted in turn until they stay, four times at most."""
    best: Fit = named_fit
    degrees: dict[Pair, int] = {}
    earlier_choices = [degrees]
    for _ in range(4):
        degrees = _selector(linearise(kind, best, scale), best, scale).select(degrees)
        if degrees in earlier_choices:
            break
        earlier_choices.append(degrees)
        trial = _fit_terms(kind, best, degrees, scale)
        if trial.objective >= best.objective and len(trial.theta) >= len(best.theta):
            break
        best = trial
    return best


def _degrees(fitted: Fit) -> dict[Pair, int]:
    """Terms that a fit has."""
    names = {u.name for u in fitted.unknowns[_count_before_torque(fitted) :]}
    counts = {pair: sum(name in names for name in term_names({pair: len(DEGREES)})) for pair in PAIRS}
    return {pair: count for pair, count in counts.items() if count}


def _fit_terms(kind: Kind, last: Fit, degrees: Degrees, scale: SpeedScale) -> Fit:
    """The full model with the terms of ``degrees``, from where the ``last`` fit ended."""
    joined = (*_named_candidates(last), candidate(degrees, scale))
    return fit(kind, joined, starts=[_coordinates(last, joined)])


def _selector(linear: Linear, about: Fit, scale: SpeedScale) -> Selector:
    """A search in which the noise is as loud as all terms together must have it."""
    noise = max(1.0, linear.misfit(np.arange(linear.jacobian.shape[1])))
    return Selector(linear.with_noise(noise), _count_before_torque(about), scale)


def _covariance(best: Fit, selector: Selector, degrees: Degrees) -> Array:
    """Second moment about the fit of its coordinates and of the terms that were not chosen, in their units."""
    linear, floating = selector.linear, selector.floating
    chosen = selector.columns(degrees)
    full = candidate(selector.scale.full, selector.scale)
    columns = np.array([*chosen, *sorted({*selector.columns(selector.scale.full)} - {*chosen})], dtype=np.intp)
    term_sd = [u.scale for u in full.unknowns]
    sd = np.array([*(u.scale for u in best.unknowns[:floating]), *(term_sd[k - floating] for k in columns[floating:])])
    chosen_count = len(chosen)
    about, _ = linear.posterior(chosen)
    moments, logs = [], []
    for width in (0.1, 0.3, 1.0):  # from 0.003 on, intervals of blind cases were too narrow
        widths = np.array([1.0] * chosen_count + [width] * (len(columns) - chosen_count))
        mean, spread = linear.posterior(columns, widths)
        deviation = mean - np.concatenate([about, np.zeros(len(columns) - chosen_count)])
        moments.append(spread + np.outer(deviation, deviation))
        logs.append(linear.evidence(columns, widths))
    weights = np.exp(np.array(logs) - max(logs))
    weights /= weights.sum()
    moment = sum(w * m for w, m in zip(weights, moments, strict=True))
    return np.asarray(moment * np.outer(sd, sd))
