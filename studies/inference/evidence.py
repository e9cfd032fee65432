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
MOST_TRIED = 4  # candidates that are fitted beside a parent
WORTH_A_FIT = 4.0  # promised decrease of the objective below which they are not
CLEAR_ODDS = 20.0  # of a hypothesis with one more effect against its parent
Progress = Callable[[str], None]
"""Called with the name of each hypothesis before it is fitted."""


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """The null fit ("parameters only") and all fits with effects, singles first.

    Attributes
    ----------
    null : Fit
    fits : tuple of Fit
    library : int
        Number of candidates that were tried alone; at least 1.
    """

    null: Fit
    fits: tuple[Fit, ...]
    library: int

    def log_posterior(self, hypothesis: Fit) -> float:
        """Log evidence of a ``hypothesis`` plus log prior.

        Half for nothing, half of the rest for each further effect, shared equally.
        """
        k, m = len(hypothesis.candidates), self.library
        return hypothesis.log_evidence + math.log(0.5) - (k > 0) * math.log(2 ** (k - 1) * math.comb(m, k))

    @property
    def probabilities(self) -> list[tuple[Fit, float]]:
        """Each hypothesis with its probability, most probable first."""
        every = (self.null, *self.fits)
        logs = np.array([self.log_posterior(hypothesis) for hypothesis in every])
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
        """Posterior odds of the ``first`` against the ``second``."""
        return math.exp(min(self.log_posterior(first) - self.log_posterior(second), 700.0))


def singles(forward: Forward, progress: Progress) -> Hypotheses:
    """Fit nothing and each candidate of ``forward`` alone; ``progress`` is told of each."""
    progress("parameters only")
    null = fit(forward)
    fits = []
    for candidate in forward.candidates:
        progress(candidate.identifier)
        starts = _beside(null, candidate)
        if forward.thorough:
            nominal = np.array([u.centre for u in forward.nuisances])
            starts += [np.concatenate([nominal, start]) for start in candidate.starts[1:]]
        fits.append(fit(forward, (candidate,), starts=starts))
    return Hypotheses(null, tuple(fits), max(len(forward.candidates), 1))


def expand(forward: Forward, known: Hypotheses, parents: Iterable[Fit], progress: Progress) -> Hypotheses:
    """Add one more candidate to each parent: those whose first step promises most.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
        What is fitted already and not fitted again.
    parents : iterable of Fit
    progress : callable
        Told of each fit.
    """
    done = {f.identifiers for f in known.fits}
    fits = list(known.fits)
    for parent in parents:
        promising: list[tuple[float, int, Candidate]] = []
        for candidate in (*forward.candidates, *forward.enabled_by(parent.candidates)):
            names = parent.identifiers | {candidate.identifier}
            if names in done or len(names) == len(parent.candidates):
                continue
            if forward.compatible((*parent.candidates, candidate)):
                promising.append((outlook(forward, parent, candidate), len(promising), candidate))
        for promised, _, candidate in sorted(promising)[:MOST_TRIED]:
            if not promised < parent.objective - WORTH_A_FIT and candidate.unknowns:
                continue
            done.add(parent.identifiers | {candidate.identifier})
            joined = (*parent.candidates, candidate)
            progress("+".join(c.identifier for c in joined))
            fits.append(fit(forward, joined, starts=_beside(parent, candidate)))
    return Hypotheses(known.null, tuple(fits), known.library)


def _beside(parent: Fit, candidate: Candidate) -> list[Array]:
    return [np.concatenate([parent.theta, start]) for start in candidate.first_starts]
