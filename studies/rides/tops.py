"""Several sets of disturbances that explain the spectra of a ride about equally well, each with its probability.

A torque that was not recorded may be none, or large where another one makes nearly the same motion. An estimate that is
linearised about one such set is too sure. Probabilities are Laplace's, exp(-objective / 2) over the root of the
determinant of the precision (Kass & Raftery 1995, Journal of the American Statistical Association 90, 773-795).
"""

import numpy as np

from studies.diagnosis.ride_model import FEW_TURNS, Fitted, Gains, Rides
from tyre.ground.arrays import Array

SAME = 1.0  # sd between two sets, below which they are one
IMPROBABLE = 1e-3  # share of the most probable set, below which another does not count


def tops_of(rides: Rides, gains: Gains, best: Array) -> tuple[Array, Array]:
    """Sets of disturbances (t, k) of one ride with its ``gains``, and their probabilities (t,).

    They are ``best`` (k,) and what the search finds where each input in turn begins at its usual spectrum.
    """
    starts = rides.disturbances.with_usual_inputs(best)
    many, same = rides.repeated(len(starts)), gains.repeated(len(starts))
    settled = many.settle(same, starts, turns=FEW_TURNS)
    fitted = Fitted(many, same, settled)
    slopes = fitted.disturbance_slopes
    precision = slopes.swapaxes(1, 2) @ slopes + np.eye(settled.shape[1])
    logarithm = -fitted.objective / 2 - np.linalg.slogdet(precision)[1] / 2
    kept: list[int] = []
    for k in np.argsort(-logarithm):
        apart = [settled[k] - settled[other] for other in kept]
        if all(gap @ precision[k] @ gap > SAME**2 for gap in apart):
            kept.append(int(k))
    weights = np.exp(logarithm[kept] - logarithm[kept[0]])
    chosen = weights > IMPROBABLE
    return settled[kept][chosen], weights[chosen] / weights[chosen].sum()
