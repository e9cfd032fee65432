"""How probable each fitted hypothesis is, from its Laplace evidence and a prior that favours few and usual effects."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from studies.inference.fit import Fit
from studies.inference.parameter import Candidate

CLEAR_ODDS = 20.0  # of a hypothesis with one more effect against its parent
SELDOM = 0.05  # prior share of sizes that seldom occur


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """The null fit ("parameters only") and all fits with effects, singles first.

    Attributes
    ----------
    null : Fit
    fits : tuple of Fit
    library : tuple of Candidate
        What was tried alone.
    """

    null: Fit
    fits: tuple[Fit, ...]
    library: tuple[Candidate, ...]

    def log_posterior(self, hypothesis: Fit) -> float:
        """Log evidence of a ``hypothesis`` plus log prior.

        Half for nothing, half of the rest for each further effect, shared by the weights of the candidates; a size
        that seldom occurs has a twentieth of the prior of its candidate.
        """
        k = len(hypothesis.candidates)
        if not k:
            return hypothesis.log_evidence + math.log(0.5)
        shares = sum(math.log(c.weight) for c in hypothesis.candidates) - math.log(self._together(k))
        seldom = sum(any(u.widened > 1 for u in c.unknowns) for c in hypothesis.candidates)
        return hypothesis.log_evidence + math.log(0.5) + shares - (k - 1) * math.log(2) + seldom * math.log(SELDOM)

    def _together(self, effects: int) -> float:
        """Sum over all sets of a number of ``effects`` of the product of their weights."""
        sums = np.zeros(effects + 1)
        sums[0] = 1.0
        for candidate in self.library:
            sums[1:] += candidate.weight * sums[:-1]
        return float(sums[effects]) or 1.0

    @property
    def probabilities(self) -> list[tuple[Fit, float]]:
        """Each hypothesis with its probability, most probable first."""
        every = (self.null, *self.fits)
        logs = np.array([self.log_posterior(hypothesis) for hypothesis in every])
        if not np.isfinite(logs).any():
            logs = np.where(np.arange(len(logs)) == 0, 0.0, -np.inf)
        weight = np.exp(logs - logs.max())
        share = weight / weight.sum()
        return [(every[k], float(share[k])) for k in np.argsort(-share, kind="stable")]

    @property
    def posterior(self) -> dict[str, float]:
        """Probability by the name of the hypothesis, most probable first."""
        return {hypothesis.name: share for hypothesis, share in self.probabilities}

    @property
    def nothing(self) -> float:
        """P(nothing is missing)."""
        return next(share for hypothesis, share in self.probabilities if hypothesis is self.null)

    def best(self, effects: int | None = None) -> list[Fit]:
        """Fits with effects (a number ``effects`` of them), most probable first."""
        kept = [f for f in self.fits if effects is None or len(f.candidates) == effects]
        return sorted(kept, key=lambda f: -self.log_posterior(f))

    def larger(self, hypothesis: Fit) -> list[Fit]:
        """Possible fits with further effects that ``hypothesis`` is not clearly more probable than, best first."""
        more = [f for f in self.best() if hypothesis.identifiers < f.identifiers and f.physical]
        return [f for f in more if self.odds(hypothesis, f) < CLEAR_ODDS]

    def odds(self, first: Fit, second: Fit) -> float:
        """Posterior odds of the ``first`` against the ``second``; infinite where only the second is impossible."""
        one, other = self.log_posterior(first), self.log_posterior(second)
        if math.isinf(other):
            return math.inf if math.isfinite(one) else 1.0
        return math.exp(min(one - other, 700.0))

    def find(self, identifiers: frozenset[str]) -> Fit | None:
        """The fit of these ``identifiers``; the null of none."""
        return next((f for f in (self.null, *self.fits) if f.identifiers == identifiers), None)

    def replaced(self, better: Sequence[Fit]) -> "Hypotheses":
        """With ``better`` fits in the place of those of the same effects, and further ones."""
        fits = {f.identifiers: f for f in (self.null, *self.fits)} | {f.identifiers: f for f in better}
        null = fits.pop(frozenset())
        return Hypotheses(null, tuple(sorted(fits.values(), key=lambda f: len(f.candidates))), self.library)
