"""Which hypotheses are fitted, and how probable each is: singles, then pairs of the best, from Laplace evidence."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from studies.inference.arrays import Array
from studies.inference.fit import Fit, fit, outlook
from studies.inference.forward import Forward
from studies.inference.parameter import Candidate

BEAM = 2  # hypotheses that are expanded
MOST_EFFECTS = 3
TRIED = 4  # candidates that are fitted beside a parent
WORTH = 4.0  # promised decrease of the objective below which they are not
CLEAR_ODDS = 20.0  # of a hypothesis with one more effect against its parent
Advance = Callable[[str], None]


@dataclass(frozen=True)
class Hypotheses:
    """The null fit ("parameters only") and all fits with effects, singles first."""

    null: Fit
    fits: tuple[Fit, ...]
    library: int

    def log_posterior(self, found: Fit) -> float:
        """Log evidence plus log prior: half for nothing, half of the rest for each further effect, shared equally."""
        k, m = len(found.candidates), self.library
        return found.log_evidence + math.log(0.5) - (k > 0) * math.log(2 ** (k - 1) * math.comb(m, k))

    @property
    def posterior(self) -> dict[str, float]:
        """Probability of each hypothesis, most probable first."""
        every = (self.null, *self.fits)
        logs = np.array([self.log_posterior(one) for one in every])
        weight = np.exp(logs - logs.max())
        share = weight / weight.sum()
        order = np.argsort(-share, kind="stable")
        return {every[k].name: float(share[k]) for k in order}

    @property
    def nothing(self) -> float:
        """P(nothing is missing)."""
        return self.posterior["none"]

    def best(self, effects: int | None = None) -> list[Fit]:
        """Fits with effects (of that number), most probable first."""
        kept = [f for f in self.fits if effects is None or len(f.candidates) == effects]
        return sorted(kept, key=lambda f: -self.log_posterior(f))

    def larger(self, found: Fit) -> list[Fit]:
        """Possible fits with one more effect or more that ``found`` is not clearly more probable than, best first."""
        names = {c.identifier for c in found.candidates}
        more = [f for f in self.best() if names < {c.identifier for c in f.candidates} and f.physical]
        return [f for f in more if self.odds(found, f) < CLEAR_ODDS]

    def odds(self, first: Fit, second: Fit) -> float:
        """Posterior odds."""
        return math.exp(min(self.log_posterior(first) - self.log_posterior(second), 700.0))


def singles(forward: Forward, advance: Advance) -> Hypotheses:
    """Fit nothing and each candidate alone."""
    advance("parameters only")
    null = fit(forward)
    fits = []
    for candidate in forward.candidates:
        advance(candidate.identifier)
        starts = _beside(null, candidate)
        if forward.thorough:
            nominal = np.array([u.centre for u in forward.nuisances])
            starts += [np.concatenate([nominal, start]) for start in candidate.starts[1:]]
        fits.append(fit(forward, (candidate,), starts=starts))
    return Hypotheses(null, tuple(fits), max(len(forward.candidates), 1))


def expand(forward: Forward, known: Hypotheses, parents: Iterable[Fit], advance: Advance) -> Hypotheses:
    """Add one more candidate to each parent: those whose first step promises most."""
    done = {frozenset(c.identifier for c in f.candidates) for f in known.fits}
    fits = list(known.fits)
    for parent in parents:
        promising: list[tuple[float, int, Candidate, frozenset[str]]] = []
        for candidate in (*forward.candidates, *forward.further(parent.candidates)):
            names = frozenset(c.identifier for c in parent.candidates) | {candidate.identifier}
            if names in done or len(names) == len(parent.candidates):
                continue
            if forward.compatible((*parent.candidates, candidate)):
                promising.append((outlook(forward, parent, candidate), len(promising), candidate, names))
        for promised, _, candidate, names in sorted(promising)[:TRIED]:
            if not promised < parent.objective - WORTH and candidate.unknowns:
                continue
            done.add(names)
            joined = (*parent.candidates, candidate)
            advance("+".join(c.identifier for c in joined))
            fits.append(fit(forward, joined, starts=_beside(parent, candidate)))
    return Hypotheses(known.null, tuple(fits), known.library)


def _beside(parent: Fit, candidate: Candidate) -> list[Array]:
    return [np.concatenate([parent.theta, start]) for start in candidate.first_starts]
