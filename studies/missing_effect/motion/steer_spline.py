"""A prescribed steer angle smoothed, with what is uncertain of it and of its first two derivatives.

The angle is a spline. Its coefficients' differences of order m are independent and normal, so it is white noise that
was integrated m times. How large they are, m, the number of knots, and the sd of the record's noise are those that
make the record most probable (:mod:`.steer_likelihood`; such splines: Eilers & Marx 1996).
A record often begins where a torque sets in: what then dies away is rougher than the rest of the run, and is free. So
is the jump of the acceleration where the recorded torque jumps within a run (:mod:`.steer_jumps`).
The covariance then holds both what noise does to the coefficients and what smoothing takes from the angle. That of a
least-squares spline has no room for the second: motion that noise hides in the angle stands out in its acceleration.
"""

from dataclasses import dataclass

import numpy as np

from bicycle.identification.recording import STEER, STEER_TORQUE, Run
from studies.missing_effect.motion.friction import third_difference_noise
from studies.missing_effect.motion.steer_functions import DEGREE, DYING, Functions
from studies.missing_effect.motion.steer_jumps import torque_jumps
from studies.missing_effect.motion.steer_likelihood import Likelihood, likelihoods, most_likely
from tyre.base.arrays import Array

FEWEST, SPANS, MORE = 6, 100, 2.0  # spans: at least, to begin with, and by which factor there are more
MOST_SHARE = 0.5  # coefficients a sample, beyond which nothing is smoothed
LEFT = 1.05  # times the noise, that a spline may leave
GAIN = 1.0  # of the log evidence, below which more knots are not worth it
DROPPED = 1e-3  # of the variance of the acceleration, which may be left out
ORDERS = 3  # the angle and two derivatives


@dataclass(frozen=True)
class SteerSpline:
    """A smoothed steer angle with C coefficients.

    Attributes
    ----------
    functions : Functions
        What it is made of.
    coefficients : ndarray, shape (C,)
        rad.
    spread : ndarray, shape (C, K)
        What one standard deviation of each of K independent combinations does to the coefficients, rad.
    smoothing : ndarray, shape (T, T)
        From an acceleration at the samples to what the spline shows of it.
    """

    functions: Functions
    coefficients: Array
    spread: Array
    smoothing: Array

    @classmethod
    def of_run(cls, run: Run, noise: float | None) -> "SteerSpline":
        """Smooth the steer angle of a ``run``, whose ``noise`` (sd, rad) is estimated where it is not given.

        A record that scatters by more than the noise that is given has the noise that it shows.
        """
        recorded = run.inputs[STEER]
        white = third_difference_noise(recorded)
        allowed = LEFT * (white if noise is None else min(white, noise))
        most = max(FEWEST, int(MOST_SHARE * len(recorded)) - DEGREE - len(DYING))
        torque = run.channels.get(STEER_TORQUE)
        jumps = () if torque is None else torque_jumps(run.time, torque)
        functions = Functions(run.time, min(most, SPANS), jumps)
        tried = likelihoods(functions, recorded, noise)
        while functions.spans < most:
            finer = functions._replace(spans=min(most, int(np.ceil(MORE * functions.spans))))
            others, now = likelihoods(finer, recorded, noise), most_likely(tried)
            gained = most_likely(others).likely.evidence - now.likely.evidence
            if _left(now) <= allowed and gained <= GAIN:
                break
            functions, tried = finer, others
        best = most_likely(tried)
        shapes, likely = best.shapes, best.likely
        shown = likely.share * best.seen
        acceleration = functions.at(run.time, 2) @ shapes.coefficients
        twice = np.tril(np.ones((len(recorded),) * 2)) * run.step
        smoothing = (acceleration * likely.share) @ (shapes.motions.T @ (twice @ twice))
        variance = np.cumsum((np.sum(acceleration**2, axis=0) * likely.share)[shapes.free :])
        # the roughest are left out, never the smooth ones, which lean the bicycle however little they accelerate
        kept = shapes.free + 1 + int(np.sum(variance < (1 - DROPPED) * variance[-1]))
        spread = likely.noise * shapes.coefficients[:, :kept] * np.sqrt(likely.share[:kept])
        return cls(functions, shapes.coefficients @ shown, spread, smoothing)

    def at(self, later: float = 0.0) -> tuple[Array, Array]:
        """Angle and two derivatives (T, 3) at times ``later`` by so many s, and what is uncertain of them (T, 3, K).

        Outside the record it is the cubic that the spline is at the end.
        """
        time = self.functions.time
        inside = np.clip(time + later, time[0], time[-1])
        dt = (time + later - inside)[:, None]
        angle, rate, acceleration, jerk = (self.functions.at(inside, k) for k in range(ORDERS + 1))
        shapes = np.stack([
            angle + dt * (rate + dt / 2 * (acceleration + dt / 3 * jerk)),
            rate + dt * (acceleration + dt / 2 * jerk),
            acceleration + dt * jerk,
        ], 1)  # fmt: skip
        return shapes @ self.coefficients, shapes @ self.spread


def _left(found: Likelihood) -> float:
    """Sd of what the spline leaves of a record, by its degrees of freedom."""
    likely = found.likely
    left = found.recorded - found.shapes.motions @ (likely.share * found.seen)
    return float(np.sqrt(left @ left / max(len(left) - likely.share.sum(), 1.0)))
