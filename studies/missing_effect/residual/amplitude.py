"""Whether the damping of the steering falls with the amplitude, as dry friction does; of time histories.

The runs are cut into pieces, each with a start of its own. In each the torque against the steer rate that fits best
beside the residual torque is a single number: its equivalent damping. Dry friction T gives 4 T / (pi A) at an amplitude
A of the steer rate (Den Hartog 1931, Trans. ASME 53), so the dampings are regressed on that.
"""

import math
from dataclasses import dataclass

import numpy as np

from studies.inference.fit import Fit
from studies.inference.forward import Forward
from studies.inference.joint import JointForward
from studies.missing_effect.motion.family import feedback_key
from studies.missing_effect.motion.history_forward import HistoryForward
from studies.missing_effect.motion.phenomenological_terms import feedback_terms
from studies.missing_effect.residual.fitting import Residual
from studies.missing_effect.residual.terms import PAIRS
from tyre.base.arrays import Array

FEWEST, LEAST_RATIO = 6, 2.0  # pieces, and their largest amplitude over the smallest
SURE = 3.0  # sd
RELATIVE_SD = 20.0  # of the best piece: what is known worse says nothing


@dataclass(frozen=True, eq=False)
class Amplitude:
    """Equivalent damping of the steering over amplitude.

    Attributes
    ----------
    rate : ndarray, shape (m,)
        Amplitude of the steer rate in each piece, rad/s.
    damping, sd : ndarray, shape (m,)
        N m s/rad, beyond what the model without the residual torque has.
    viscous, dry : tuple of float, shape (2,)
        Damping (N m s/rad) and dry friction (N m) that fit them, each with its standard deviation.
    """

    rate: Array
    damping: Array
    sd: Array
    viscous: tuple[float, float]
    dry: tuple[float, float]

    @property
    def falls(self) -> bool:
        """Whether the damping surely falls with the amplitude."""
        return self.dry[0] > SURE * self.dry[1]

    @property
    def rises(self) -> bool:
        """Whether it surely rises, as dry friction never lets it."""
        return self.dry[0] < -SURE * self.dry[1]


def amplitude_of(forward: Forward, found: Fit, residual: Residual | None = None) -> Amplitude | None:
    """Equivalent dampings of the pieces of time histories; None of other data, or where amplitudes are too alike.

    Parameters
    ----------
    forward : Forward
    found : Fit
        The model beside which they are fitted.
    residual : Residual, optional
        The torque that ``found`` holds.
    """
    if isinstance(forward, JointForward) or not isinstance(forward, HistoryForward):
        return None
    pieces = (*forward.easier(), forward)[0]
    (term,) = (t for t in feedback_terms() if feedback_key("steer_rate", "steer_torque") in t.unknowns[0].sets)
    joined, theta = (*found.candidates, term), np.append(found.theta, 0.0)
    r, j = pieces.residual(joined, theta)
    moved = pieces.simulated(joined, theta, ("steer_rate_rad_s",), theta[None])[0, :, 0]
    speeds = np.array([run.speed for run in pieces.runs])
    gains = np.zeros((len(speeds), len(PAIRS))) if residual is None else residual.gains_at(speeds)[0]
    fitted = gains.reshape(len(speeds), -1)[:, PAIRS.index(("steer", "steer_rate"))]
    rates, dampings, sds, start = [], [], [], 0
    misfit = math.sqrt(max(1.0, found.objective / len(found.residual)))
    for k, run in enumerate(pieces.runs):
        rows = slice(start, start + len(run.time) * len(pieces.noise))
        start = rows.stop
        own, rest = j[rows, -1], r[rows]
        square = float(own @ own)
        if not (np.isfinite(square) and square > 0 and np.isfinite(rest).all()):
            continue
        rates.append(math.sqrt(2 * float((moved[k, : len(run.time)] ** 2).mean())))
        dampings.append(float(own @ rest) / square - fitted[k])
        sds.append(1 / math.sqrt(square))
    return _regressed(np.array(rates), np.array(dampings), np.array(sds) * misfit)


def _regressed(rate: Array, damping: Array, sd: Array) -> Amplitude | None:
    known = sd < RELATIVE_SD * sd.min(initial=np.inf)
    rate, damping, sd = rate[known], damping[known], sd[known]
    if len(rate) < FEWEST or rate.max() < LEAST_RATIO * rate.min():
        return None
    design = np.stack([np.ones_like(rate), 4 / (np.pi * rate)], 1) / sd[:, None]
    spread = np.linalg.inv(design.T @ design)
    best = spread @ (design.T @ (damping / sd))
    left = damping / sd - design @ best
    spread *= max(1.0, float(left @ left) / (len(rate) - 2))  # Birge (1932)
    errors = np.sqrt(spread.diagonal())
    return Amplitude(
        rate, damping, sd, (float(best[0]), float(errors[0])), (float(best[1]), float(errors[1]))
    )  # fmt: skip
