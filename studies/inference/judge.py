"""The search: from a forward model to a verdict. It knows neither bicycles nor rigs.

>>> judgement = judge(forward)  # doctest: +SKIP
>>> judgement.verdict.verdict, judgement.final.name  # doctest: +SKIP
('named', 'damper')
"""

from dataclasses import dataclass

import numpy as np

from studies.inference.acceptance import accept
from studies.inference.account import account
from studies.inference.arrays import Array
from studies.inference.checks import HeldOut
from studies.inference.evidence import Hypotheses
from studies.inference.fit import Fit
from studies.inference.forward import Forward
from studies.inference.identifiability import similarity
from studies.inference.search import Progress, again, search, singles
from studies.inference.verdict import Verdict

MOST_SIMILAR = 10  # single effects that are compared


@dataclass(frozen=True, eq=False, kw_only=True)
class Judgement:
    """A verdict with everything a report shows.

    Attributes
    ----------
    forward : Forward
        With its noise as it was estimated.
    verdict : Verdict
    hypotheses : Hypotheses
        All that were fitted.
    final : Fit
        With what was named; the null where nothing was.
    nominal : ndarray, shape (n,)
        Whitened residual of the base model as it stands.
    held_out : dict
        ``nuisance_only`` and ``final``.
    similar : tuple
        Names of the best single effects and the cosines (k, k) of what they do to the data.
    """

    forward: Forward
    verdict: Verdict
    hypotheses: Hypotheses
    final: Fit
    nominal: Array
    held_out: dict[str, HeldOut]
    similar: tuple[tuple[str, ...], Array]


def judge(forward: Forward, *, progress: Progress | None = None) -> Judgement:
    """Search, accept or refuse, and say what was decided.

    Parameters
    ----------
    forward : Forward
        The base model with its nuisances, candidates and data.
    progress : callable, optional
        Called with the name of each hypothesis before it is fitted.

    Returns
    -------
    Judgement
        Its ``verdict`` has the result.

    Raises
    ------
    ValueError
        Data without a row, or two candidates of one identifier.
    """
    _check(forward)
    advance = progress or (lambda what: None)
    known = singles(forward, advance)
    better = forward.refined(known.best()[0] if known.fits else known.null)
    if better is not forward:
        forward = better
        known = again(forward, known, advance)
    forward, known, leader = search(forward, known, advance)
    acceptance = accept(forward, known, leader)
    nominal, _ = forward.residual((), np.array([u.centre for u in forward.nuisances]))
    fits = _comparable(known)[:MOST_SIMILAR]
    return Judgement(
        forward=forward, verdict=account(forward, known, acceptance, nominal), hypotheses=known,
        final=acceptance.final, nominal=nominal, held_out=dict(acceptance.held_out),
        similar=(tuple(f.name for f in fits), similarity(forward, known.null, fits) if fits else np.zeros((0, 0))),
    )  # fmt: skip


def _check(forward: Forward) -> None:
    if not len(forward.rows.where):
        raise ValueError("no data: rows.where is empty; give at least one residual")
    names = [candidate.identifier for candidate in forward.candidates]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{names.count(name)} candidates are called {name!r}; give each an identifier of its own")


def _comparable(known: Hypotheses) -> list[Fit]:
    """Single effects that may be named; all that could be computed where none may."""
    finite = [f for f in known.best(1) if np.isfinite(f.objective)]
    return [f for f in finite if f.admissible] or finite
