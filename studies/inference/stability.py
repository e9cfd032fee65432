"""Stability of a verdict under small changes: noise, priors, a speed or a channel less.

Each variant is judged again on the same data, with the candidates of the leading hypotheses only. Their prior is
that of the full library. The noise is that of the first judgement, times the variant's factor.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.inference.judge import Judgement, decide
from studies.inference.kind import Kind, Rows
from studies.inference.parameter import Array, Candidate, UncertainParameter
from studies.inference.rules import RULES

UNCHANGED = ("thorough", "library", "compatible", "directions")
"""Attributes of a kind that no variant changes."""

Run = Callable[[Callable[["Variant"], "Outcome"], Iterable["Variant"]], Iterable["Outcome"]]
"""Maps a function over variants: ``map``, or that of worker processes."""


@dataclass(frozen=True, eq=False)
class Variant(Kind):
    """A kind with some of its rows, or other sd of noise or priors; everything else is as the ``inner`` kind has it."""

    what: str  # in words
    inner: Kind
    candidates: tuple[Candidate, ...]  # those that are tried
    used: NDArray[np.bool_]  # (n,), rows that are used
    noise: float = 1.0  # factor on the sd of the noise
    prior: float = 1.0  # factor on the sd of the nuisances
    refused: Mapping[str, str] = field(default_factory=dict)  # effect -> why it cannot be tried; none in a variant

    def __getattribute__(self, name: str) -> Any:
        return getattr(self.inner, name) if name in UNCHANGED else super().__getattribute__(name)

    @cached_property
    def nuisances(self) -> tuple[UncertainParameter, ...]:  # type: ignore[override]
        """Nuisances with their prior sd changed."""
        return tuple(replace(u, scale=u.scale * self.prior) for u in self.inner.nuisances)

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """Rows that are used."""
        rows, indices = self.inner.rows, np.flatnonzero(self.used)
        return replace(
            rows,
            places=tuple(rows.places[k] for k in indices),
            series=tuple(rows.series[k] for k in indices),
            abscissa=rows.abscissa[indices],
            fold=rows.fold[indices],
            inputs=None if rows.inputs is None else rows.inputs[indices],
        )

    @property
    def varied(self) -> bool:
        """True if the rows that are used have several folds."""
        return self.inner.varied and len(np.unique(self.rows.fold)) > 1

    def residual(self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """Whitened residuals (n,) of the rows that are used, and their derivatives (n, p)."""
        residual, jacobian = self.inner.residual(candidates, theta, slopes=slopes)
        return residual[self.used] / self.noise, jacobian[self.used] / self.noise

    def log_determinant(self, candidates: tuple[Candidate, ...], theta: Array) -> float:
        """ln of the determinant as the ``inner`` kind has it, times the share of the rows that are used."""
        return float(self.used.mean()) * self.inner.log_determinant(candidates, theta)

    def marginalise_noise(self, candidates: tuple[Candidate, ...], theta: Array, white: Array) -> Array:
        """Noise (n, draws) of the rows that are used, from ``white`` noise (n, draws)."""
        full_noise = np.zeros((len(self.used), white.shape[1]))
        full_noise[self.used] = white
        return self.inner.marginalise_noise(candidates, theta, full_noise)[self.used]

    def enabled_by(self, candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
        """Candidates that these make possible, among those that are tried."""
        names = {c.identifier for c in self.candidates}
        return tuple(c for c in self.inner.enabled_by(candidates) if c.identifier in names)


@dataclass(frozen=True)
class Outcome:
    """Verdict of a variant."""

    what: str  # the variant in words
    verdict: str  # as :class:`studies.inference.verdict.Verdict`
    names: tuple[str, ...]  # the hypotheses of the class, the leader first; empty if nothing is named
    nothing: float  # P(nothing is missing)
    same: bool = False  # the same word, led by the hypothesis that leads or by a member of its class


@dataclass(frozen=True)
class Stability:
    """The verdict in all variants: ``outcomes``, candidates ``tried`` again, and the size of the ``library``."""

    outcomes: tuple[Outcome, ...]
    tried: tuple[str, ...]
    library: int

    @property
    def differing(self) -> list[Outcome]:
        """Variants with another verdict."""
        return [judged for judged in self.outcomes if not judged.same]

    @property
    def holds(self) -> int:
        """Number of variants in which the verdict holds."""
        return sum(judged.same for judged in self.outcomes)

    def to_dict(self) -> dict[str, Any]:
        """The outcomes for JSON, without their sentence."""
        variants = [{**vars(judged), "names": list(judged.names)} for judged in self.outcomes]
        return {"candidates": list(self.tried), "library": self.library, "variants": variants}


def stability(judgement: Judgement, *, run: Run = map, progress: Callable[[str], None] | None = None) -> Stability:
    """Judge every variant; of much data in a part of them."""
    candidates = leading(judgement)
    kind = judgement.kind.thin(RULES.thinned)
    verdict, outcomes = judgement.verdict, []
    members = {_effects(name) for name in verdict.equivalent}
    for judged in run(outcome, variants(kind, candidates)):
        agrees = judged.verdict == verdict.verdict and (
            _effects(judged.names[0]) in members if judged.names else not members
        )
        outcomes.append(replace(judged, same=agrees))
        if progress:
            progress(judged.what)
    names = tuple(c.identifier for c in candidates)
    return Stability(tuple(outcomes), names, len(judgement.kind.candidates))


def _effects(name: str) -> frozenset[str]:
    """Effects of a hypothesis called ``name``, whatever their order."""
    return frozenset(name.split("+"))


def leading(judgement: Judgement) -> tuple[Candidate, ...]:
    """Candidates of the six leading hypotheses of a ``judgement`` and of its class, in the order of the library."""
    members = set(judgement.verdict.equivalent)
    identifiers = set(judgement.final.identifiers)
    hypotheses = judgement.hypotheses
    for f in (*hypotheses.rank()[:6], *(f for f in hypotheses.fits if f.name in members)):
        identifiers |= f.identifiers
    return tuple(c for c in judgement.kind.candidates if c.identifier in identifiers)


def variants(kind: Kind, candidates: tuple[Candidate, ...]) -> Iterator[Variant]:
    """Every variant of a ``kind`` with these ``candidates``."""
    rows = kind.rows
    all_rows = np.ones(len(rows.places), bool)
    for factor in (0.8, 1.3):
        yield Variant(f"noise sd x {factor:g}", kind, candidates, all_rows, noise=factor)
    if kind.nuisances:
        for factor in (0.5, 2.0):
            yield Variant(f"parameter uncertainties x {factor:g}", kind, candidates, all_rows, prior=factor)
    left_out = [rows.fold == number for number in np.unique(rows.fold)]
    words = [_places(rows, mask) for mask in left_out]
    if len(words) > 2:  # of what is left, one is held out
        for mask, places in zip(left_out, words, strict=True):
            of = f" ({', '.join(dict.fromkeys(rows.channels[mask].tolist()))})" if words.count(places) > 1 else ""
            yield Variant(f"without {places}{of}", kind, candidates, ~mask)
    names = list(dict.fromkeys(rows.channels.tolist()))
    if len(names) > 1:
        for name in names:
            yield Variant(f"without {name}", kind, candidates, rows.channels != name)


def _places(rows: Rows, left_out: NDArray[np.bool_], most: int = 4) -> str:
    """Rows that are left out, in words: their conditions, or ``most`` of their places along the abscissa."""
    places = np.unique(rows.abscissa[left_out])
    if rows.condition:
        return ", ".join(rows.condition[int(x)] for x in places)
    axes = {rows.show(name).axis or rows.axis for name in rows.series}
    if len(axes) > 1:  # recordings of several kinds: whole ones, or a part of each
        series = np.array(rows.series)
        whole = [name for name in dict.fromkeys(rows.series) if left_out[series == name].all()]
        folds = np.unique(rows.fold).tolist()
        return ", ".join(whole) or f"part {folds.index(int(rows.fold[left_out][0])) + 1} of {len(folds)}"
    quantity, _, unit = (part.strip() for part in axes.pop().partition(","))
    first_places = ", ".join(dict.fromkeys(f"{x:.3g}" for x in places[:most]))
    more = f" and {len(places) - most} more" if len(places) > most else ""
    return f"{quantity or 'place'} {first_places}{f' {unit}' if unit else ''}{more}"


def outcome(variant: Variant) -> Outcome:
    """Judge a ``variant``: its verdict, class and P(nothing is missing)."""
    hypotheses, acceptance = decide(variant)
    return Outcome(variant.what, acceptance.verdict, tuple(f.name for f in acceptance.members), hypotheses.p_nothing)
