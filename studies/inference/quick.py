"""The quick search: plain least squares over single effects, and Schwarz's criterion (BIC).

What the criterion calls alike is one class: a difference of two is "not worth more than a bare mention" (Kass & Raftery
1995, J. Am. Stat. Ass. 90, 773-795). Nothing is held out, no two effects are tried together, and no rule of the full
search but bounds and sizes is asked.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from studies.inference.evidence import HeldOut
from studies.inference.fit import Fit, default_starts, fit
from studies.inference.judge import Acceptance, Judgement, verdict_of
from studies.inference.kind import Kind
from studies.inference.rules import RULES
from studies.inference.search import Hypotheses, Progress
from studies.inference.starts import select_starts
from studies.inference.verdict import Reason

TURNS = (8, 8)
"""Most iterations of a fit."""


@dataclass(frozen=True, eq=False)
class Singles(Hypotheses):
    """Fits of single effects, weighed by Schwarz (1978), Annals of Statistics 6, 461-464."""

    @cached_property
    def _halves(self) -> dict[frozenset[str], float]:
        """Minus half the criterion: chi^2, the penalty, ln det of what is marginalised, and k ln n of k unknowns."""
        halves = {}
        for f in (self.null, *self.fits):
            unknowns = len(f.theta) - f.effect_columns.start
            log_det = self.kind.log_determinant(f.candidates, f.theta) if math.isfinite(f.objective) else 0.0
            halves[f.identifiers] = -(f.objective + log_det + unknowns * math.log(len(f.residual))) / 2
        return halves

    def log_posterior(self, hypothesis: Fit) -> float:
        return self._halves[hypothesis.identifiers]


def judge_quickly(kind: Kind, *, progress: Progress | None = None) -> Judgement:
    """Judge single effects of a ``kind``, of much data in a part of them."""
    advance = progress or (lambda step: None)
    kind = kind.with_candidates(
        tuple(c for c in kind.candidates if not c.absorbs)
    )  # these are for what nothing else explains
    singles = _fit_singles(kind.thin(RULES.quick), None, advance)
    better = singles.kind.estimate_noise(singles.rank()[0] if singles.fits else singles.null)
    if better is not singles.kind:
        singles = _fit_singles(better, singles, advance)
    acceptance, kind = _accept(singles), singles.kind
    nominal, _ = kind.residual((), np.array([u.centre for u in kind.nuisances]))
    return Judgement(
        kind=kind,
        verdict=verdict_of(singles, acceptance, nominal),
        hypotheses=singles,
        final=acceptance.final,
        nominal=nominal,
        held_out={},
        quick=True,
    )


def _fit_singles(kind: Kind, earlier: Singles | None, advance: Progress) -> Singles:
    """Fit the null and each candidate alone; if some are ``earlier``, refit their leaders from where they ended."""
    advance("parameters only")
    null = fit(kind, starts=[earlier.null.theta] if earlier else None, turns=TURNS)
    fits = [] if earlier is None else [_refit(kind, f, advance) for f in earlier.rank()[: RULES.polished]]
    if earlier is None:
        for c in kind.candidates:
            advance(c.identifier)
            starts = [np.concatenate([null.theta, start]) for start in c.starts[:2]] + default_starts(kind, (c,))[:2]
            fits.append(fit(kind, (c,), starts=select_starts(kind, (c,), starts, 1), turns=TURNS))
    return Singles(null, tuple(fits), kind)


def _refit(kind: Kind, f: Fit, advance: Progress) -> Fit:
    advance(f.name)
    return fit(kind, f.candidates, starts=[f.theta], turns=TURNS)


def _accept(singles: Singles) -> Acceptance:
    """Name the best by the criterion and all about as good, unless it does not fit or the null is about as good."""

    def behind(f: Fit, rival: Fit) -> float:
        return 2 * (singles.log_posterior(rival) - singles.log_posterior(f))

    able = [f for f in singles.rank() if math.isfinite(f.objective) and not f.effects_too_small()]
    able = [f for f in able if not f.sizes_at_bound() and not f.sizes_beyond_usual()]
    close = [f for f in able if behind(f, able[0]) < RULES.bare]
    members = {f: Reason("close", odds=singles.odds(able[0], f), unusual="") for f in close}
    leader = able[0] if able and behind(singles.null, able[0]) > RULES.bare else None
    final = leader if leader and leader.fits_data else singles.null
    scores = {"nuisance_only": HeldOut(0.0, singles.null.residual), "final": HeldOut(0.0, final.residual)}
    if not final.candidates:
        word = "none" if leader is None and singles.null.fits_data else "unknown"
        return Acceptance(word, final, scores, able[0] if able else None)
    word = "named" if len({f.family for f in close}) == 1 else "class"
    return Acceptance(word, final, scores, leader, {**members, final: Reason("leads")})
