"""What the residual torque does to the numbers that were named: they float beside it and may end elsewhere."""

from dataclasses import dataclass

import numpy as np

from studies.inference.account import factors
from studies.missing_effect.residual.fitting import Residual

FAR = 1.0  # sd of the named fit, beyond which a number is told anew
SIGNIFICANT = 2.0  # sd from where an effect is absent


@dataclass(frozen=True)
class Changed:
    """A named parameter, or one of the bicycle or the measurement, that the residual torque moves by more than one sd.

    Attributes
    ----------
    name, unit : str
    effect : str
        What was named, whose parameter it is; empty of the bicycle and of the measurement.
    named : float
        Its value in the fit that is named, in ``unit``.
    value, sd : float
        The same in the fit with the torque, and its standard deviation there.
    replaced : bool
        It measures the size of the effect, which with the torque is no longer significant.
    """

    name: str
    unit: str
    effect: str
    named: float
    value: float
    sd: float
    replaced: bool


def changed(residual: Residual) -> tuple[Changed, ...]:
    """What differs by more than one sd of the named fit between it and the fit with the torque, named effects first.

    Parameters
    ----------
    residual : Residual
    """
    beside, beyond = residual.beside, residual.fit
    owner = {k: c.identifier for c in beside.candidates for k in range(*beside.columns(c).indices(len(beside.theta)))}
    spread = np.sqrt(np.maximum(beside.covariance.diagonal(), 0.0))
    after = np.sqrt(np.maximum(residual.covariance.diagonal(), 0.0))
    found = []
    for k, (u, before, now) in enumerate(zip(beside.unknowns, beside.theta, beyond.theta, strict=False)):
        if abs(now - before) > FAR * spread[k]:
            was = abs(before - u.centre) >= SIGNIFICANT * spread[k]
            gone = u.size and was and abs(now - u.centre) < SIGNIFICANT * after[k]
            first, last = float(u.value(before)), float(u.value(now))
            sd = u.slope(float(now)) * float(after[k])
            found += [
                Changed(name, u.unit, owner.get(k, ""), factor * first, factor * last, factor * sd, bool(gone))
                for name, factor in factors(u).items()
            ]
    return tuple(sorted(found, key=lambda one: not one.effect))
