"""What the fits did to the parameters that may move: how far each went, in standard deviations of its prior."""

from dataclasses import dataclass

import numpy as np

from studies.inference.fit import Fit


@dataclass(frozen=True)
class Moved:
    """A nuisance before and after the fit.

    Attributes
    ----------
    name, unit : str
    prior, prior_sd : float
        Its value and standard deviation as stated, in ``unit``.
    value, sd : float
        The same after the final fit.
    alone : float
        How far it went where nothing but nuisances floats, in prior sd.
    shift : float
        How far it went in the final fit, in prior sd.
    """

    name: str
    unit: str
    prior: float
    prior_sd: float
    value: float
    sd: float
    alone: float
    shift: float


def moved(null: Fit, final: Fit) -> tuple[Moved, ...]:
    """How far each nuisance went, the farthest in the final fit first.

    Parameters
    ----------
    null : Fit
        Nuisances only.
    final : Fit
        With what was named; the null itself where nothing was.
    """
    found = []
    spread = np.sqrt(np.maximum(final.covariance.diagonal(), 0.0))
    for k, u in enumerate(final.unknowns[: final.effect_columns.start]):
        x, start = float(final.theta[k]), float(null.theta[k])
        found.append(
            Moved(
                u.name, u.unit, float(u.value(np.asarray(u.centre))), u.slope(u.centre) * u.scale,
                float(u.value(np.asarray(x))), u.slope(x) * float(spread[k]),
                (start - u.centre) / u.scale, (x - u.centre) / u.scale,
            )
        )  # fmt: skip
    return tuple(sorted(found, key=lambda one: -abs(one.shift)))


def share_closed(nominal: float, adjusted: float) -> float:
    """Share of the ``nominal`` chi^2 that goes where only the nuisances move and ``adjusted`` is left."""
    return 1.0 - adjusted / nominal if nominal > 0 else 0.0
