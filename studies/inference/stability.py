"""Whether the verdict stands when what it rests on is a little different: noise, priors, a speed or a channel less.

Each variant is judged anew on the same data, with the candidates of the leading hypotheses only. Their prior stays that
of the whole library. The noise is that of the first judgement, times the variant's factor.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.inference.arrays import Array
from studies.inference.forward import Forward, ProposedMeasurement, Residual, Rows
from studies.inference.judge import Judgement, judge
from studies.inference.parameter import Candidate, UncertainParameter

NOISE_FACTORS = (0.8, 1.3)
PRIOR_FACTORS = (0.5, 2.0)
LEADING = 6  # hypotheses whose candidates are tried again
FEWEST_FOLDS = 3  # of which one can go: of what is left, one is held out
MOST_PLACES = 4  # that are listed

Run = Callable[[Callable[["Variant"], "Outcome"], Iterable["Variant"]], Iterable["Outcome"]]
"""How variants are gone through: ``map``, or that of worker processes."""


@dataclass(frozen=True, eq=False)
class Variant:
    """A forward model seen a little differently (a :class:`studies.inference.forward.Forward` itself).

    Attributes
    ----------
    what : str
        In words.
    inner : Forward
    candidates : tuple of Candidate
        Those that are tried.
    kept : ndarray of bool, shape (n,)
        Rows that are used.
    noise, prior : float
        Factors on the sd of the noise and on those of the nuisances.
    """

    what: str
    inner: Forward
    candidates: tuple[Candidate, ...]
    kept: NDArray[np.bool_]
    noise: float = 1.0
    prior: float = 1.0
    refused: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def thorough(self) -> bool:
        """As the model that it stands for."""
        return self.inner.thorough

    @cached_property
    def nuisances(self) -> tuple[UncertainParameter, ...]:
        """With their prior sd changed."""
        return tuple(replace(u, scale=u.scale * self.prior) for u in self.inner.nuisances)

    @cached_property
    def rows(self) -> Rows:
        """Those that are kept."""
        rows, kept = self.inner.rows, np.flatnonzero(self.kept)
        return replace(
            rows, where=tuple(rows.where[k] for k in kept), series=tuple(rows.series[k] for k in kept),
            abscissa=rows.abscissa[kept], fold=rows.fold[kept],
            inputs=None if rows.inputs is None else rows.inputs[kept],
        )  # fmt: skip

    def residual(self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """Of the rows that are kept. Arguments as :meth:`.Forward.residual`."""
        residual, jacobian = self.inner.residual(candidates, theta, slopes=slopes)
        return residual[self.kept] / self.noise, jacobian[self.kept] / self.noise

    @property
    def varied(self) -> bool:
        """Whether what is kept is of several conditions."""
        return self.inner.varied and len(np.unique(self.rows.fold)) > 1

    @property
    def library(self) -> tuple[Candidate, ...]:
        """What the prior is shared by: those that are not tried again count too."""
        return self.inner.library

    def log_determinant(self, candidates: tuple[Candidate, ...], theta: Array) -> float:
        """The share of the rows that are kept, with ``candidates`` at ``theta`` (p,)."""
        return float(self.kept.mean()) * self.inner.log_determinant(candidates, theta)

    def marginalised(self, candidates: tuple[Candidate, ...], theta: Array, white: Array) -> Array:
        """Of the rows that are kept. Arguments as :meth:`.Forward.marginalised`: ``white`` (n, draws)."""
        every = np.zeros((len(self.kept), white.shape[1]))
        every[self.kept] = white
        return self.inner.marginalised(candidates, theta, every)[self.kept]

    def easier(self) -> tuple[Forward, ...]:
        """None: the judgement has shown the way."""
        return ()

    def proposed(self) -> tuple[ProposedMeasurement, ...]:
        """None: what to measure next is asked once."""
        return ()

    def predict(
        self, proposal: ProposedMeasurement, candidates: tuple[Candidate, ...], theta: Array
    ) -> tuple[Array, Array]:
        """As the model it stands for. Arguments as :meth:`.Forward.predict`."""
        return self.inner.predict(proposal, candidates, theta)

    def loose(
        self, proposal: ProposedMeasurement, candidates: tuple[Candidate, ...], theta: Array
    ) -> tuple[Array, Array] | None:
        """As the model it stands for. Arguments as :meth:`.Forward.loose`."""
        return self.inner.loose(proposal, candidates, theta)

    def compatible(self, candidates: tuple[Candidate, ...]) -> bool:
        """Whether these ``candidates`` make a model together."""
        return self.inner.compatible(candidates)

    def enabled_by(self, candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
        """What these ``candidates`` make possible, among those that are tried."""
        names = {c.identifier for c in self.candidates}
        return tuple(c for c in self.inner.enabled_by(candidates) if c.identifier in names)

    def phenomenological(self) -> tuple[Candidate, ...]:
        """None: what would mimic the rest is asked once."""
        return ()

    def directions(self) -> tuple[Candidate, ...]:
        """As the model it stands for."""
        return self.inner.directions()

    def refined(self, best: Residual) -> "Variant":
        """Itself, whatever the residual of ``best``: its noise is known."""
        return self


@dataclass(frozen=True)
class Outcome:
    """What a variant says.

    Attributes
    ----------
    what : str
        The variant in words.
    verdict : str
    names : tuple of str
        The hypotheses of the class, the leader first; empty where nothing is named.
    nothing : float
        P(nothing is missing).
    same : bool
        The same word, led by the hypothesis that leads or by a member of its class.
    """

    what: str
    verdict: str
    names: tuple[str, ...]
    nothing: float
    same: bool = False


@dataclass(frozen=True)
class Stability:
    """The verdict in all variants.

    Attributes
    ----------
    outcomes : tuple of Outcome
    tried : tuple of str
        Candidates that were tried again.
    library : int
        How many there are.
    """

    outcomes: tuple[Outcome, ...]
    tried: tuple[str, ...]
    library: int

    @property
    def sentence(self) -> str:
        """In how many variants the verdict holds, and what the others say."""
        n, holds = len(self.outcomes), sum(one.same for one in self.outcomes)
        if holds == n:
            return f"The verdict holds in all {n} variants." if n > 1 else "The verdict holds in the one variant."
        counted: dict[str, int] = {}
        for one in self.outcomes:
            if not one.same:
                leader = " + ".join(sorted(_effects(one.names[0]))) if one.names else ""
                words = f"{one.verdict} ({leader})" if leader else one.verdict
                counted[words] = counted.get(words, 0) + 1
        others = ", ".join(f"{words} in {count}" for words, count in sorted(counted.items(), key=lambda c: -c[1]))
        return f"The verdict holds in {holds} of {n} variants; the others say {others}."

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "sentence": self.sentence, "candidates": list(self.tried), "library": self.library,
            "variants": [{**vars(one), "names": list(one.names)} for one in self.outcomes],
        }  # fmt: skip


def stability(judgement: Judgement, *, run: Run = map, progress: Callable[[str], None] | None = None) -> Stability:
    """Judge every variant.

    Parameters
    ----------
    judgement : Judgement
        The verdict that is to stand.
    run : callable
        ``map`` or one like it.
    progress : callable, optional
        Told the words of each variant that is done.
    """
    tried = leading(judgement)
    verdict, outcomes = judgement.verdict, []
    for one in run(outcome, variants(judgement.forward, tried)):
        members = {_effects(name) for name in verdict.equivalent}
        same = one.verdict == verdict.verdict and (_effects(one.names[0]) in members if one.names else not members)
        outcomes.append(replace(one, same=same))
        if progress:
            progress(one.what)
    names = tuple(c.identifier for c in tried)
    return Stability(tuple(outcomes), names, len(judgement.forward.candidates))


def _effects(name: str) -> frozenset[str]:
    """Effects of a hypothesis called ``name``, whatever their order."""
    return frozenset(name.split("+"))


def leading(judgement: Judgement) -> tuple[Candidate, ...]:
    """Candidates of the leading hypotheses of a ``judgement`` and of its class, in the order of the library."""
    members = set(judgement.verdict.equivalent)
    wanted = set(judgement.final.identifiers)
    known = judgement.hypotheses
    for f in (*known.best()[:LEADING], *(f for f in known.fits if f.name in members)):
        wanted |= f.identifiers
    return tuple(c for c in judgement.forward.candidates if c.identifier in wanted)


def variants(forward: Forward, tried: tuple[Candidate, ...]) -> Iterator[Variant]:
    """Every variant of a ``forward`` model with the candidates ``tried``."""
    rows = forward.rows
    every = np.ones(len(rows.where), bool)
    for factor in NOISE_FACTORS:
        yield Variant(f"noise sd x {factor:g}", forward, tried, every, noise=factor)
    for factor in PRIOR_FACTORS if forward.nuisances else ():
        yield Variant(f"sd of the parameters x {factor:g}", forward, tried, every, prior=factor)
    left_out = [rows.fold == number for number in np.unique(rows.fold)]
    words = [_places(rows, out) for out in left_out]
    for out, places in zip(left_out, words, strict=True) if len(words) >= FEWEST_FOLDS else ():
        of = f" ({', '.join(dict.fromkeys(rows.channels[out].tolist()))})" if words.count(places) > 1 else ""
        yield Variant(f"without {places}{of}", forward, tried, ~out)
    names = list(dict.fromkeys(rows.channels.tolist()))
    for name in names if len(names) > 1 else ():
        yield Variant(f"without {name}", forward, tried, rows.channels != name)


def _places(rows: Rows, out: NDArray[np.bool_]) -> str:
    """What is left out, in words: its conditions, or its places along the abscissa."""
    places = np.unique(rows.abscissa[out])
    if rows.condition:
        return ", ".join(rows.condition[int(x)] for x in places)
    axes = {rows.show(name).axis or rows.axis for name in rows.series}
    if len(axes) > 1:  # recordings of several kinds: whole ones, or a part of each
        series = np.array(rows.series)
        whole = [name for name in dict.fromkeys(rows.series) if out[series == name].all()]
        folds = np.unique(rows.fold).tolist()
        return ", ".join(whole) or f"part {folds.index(int(rows.fold[out][0])) + 1} of {len(folds)} of each recording"
    quantity, _, unit = (part.strip() for part in axes.pop().partition(","))
    shown = ", ".join(dict.fromkeys(f"{x:.3g}" for x in places[:MOST_PLACES]))
    more = f" and {len(places) - MOST_PLACES} more" if len(places) > MOST_PLACES else ""
    return f"{quantity or 'place'} {shown}{f' {unit}' if unit else ''}{more}"


def outcome(variant: Variant) -> Outcome:
    """The judgement of a ``variant``, in short."""
    found = judge(variant)
    verdict = found.verdict
    return Outcome(variant.what, verdict.verdict, verdict.equivalent, found.hypotheses.nothing)
