"""A channel that was not recorded, in the same runs: what their starts leave open of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from bicycle.identification.recording import Run
from studies.inference.forward import ProposedMeasurement
from studies.inference.parameter import Candidate
from studies.missing_effect.motion.history_candidates import slow_errors
from studies.missing_effect.motion.initial_states import Marginal
from tyre.base.arrays import Array


@dataclass(frozen=True, eq=False)
class FurtherChannel(ProposedMeasurement):
    """A ``channel`` that was not recorded, in the same runs."""

    channel: str


def starts_in(
    proposal: FurtherChannel, runs: Sequence[Run], candidates: tuple[Candidate, ...], found: Marginal, white: Array,
    free: Array, states: int,
) -> tuple[Array, Array]:  # fmt: skip
    """How the starts of ``runs``, and errors that change slowly, move a further channel: see :meth:`.Forward.loose`.

    Without them two hypotheses that explain the recorded channels with other starts seem far apart in the new one,
    though starts between would serve both.

    Parameters
    ----------
    proposal : FurtherChannel
    runs : sequence of Run
        R of them.
    candidates : tuple of Candidate
        Of the hypothesis.
    found : Marginal
        Its m unknown starts and slow errors.
    white : ndarray, shape (R, C T, p)
        Derivatives of the recorded channels, whitened, the starts held.
    free : ndarray, shape (R, T, n + uncertain)
        The new channel after starts of one prior sd.
    states : int
        Number n of states; other starts stand behind those of filters of the recorded channels, which it lacks.

    Returns
    -------
    follow : ndarray, shape (samples, p)
    columns : ndarray, shape (samples, k)
        Both in the sd of the new channel.
    """
    uncertain, last = free.shape[-1] - states, found.start.shape[1]
    places = [*range(states), *range(last - uncertain, last)]
    follow, spread = -found.follows(white)[:, places], found.spread[:, places]
    slow = slow_errors(runs, free.shape[1], (proposal.channel,), candidates)[:, 0]
    lengths = [len(run.time) for run in runs]
    each = [np.hstack([f[:n] @ s, e[:n]]) for f, s, e, n in zip(free, spread, slow, lengths, strict=True)]
    followed = np.vstack([f[:n] @ s for f, s, n in zip(free, follow, lengths, strict=True)])
    return followed / proposal.sd[:, None], block_diag(*each) / proposal.sd[:, None]
