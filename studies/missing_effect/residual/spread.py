"""From coordinates of a fit to parameters of a model: the covariance that the corrected model carries."""

import numpy as np

from bicycle.default_sd import MODEL_FILE
from bicycle.model import Model
from bicycle.parameter_covariance import ParameterCovariance
from bicycle.parameters import UNUSED
from studies.inference.parameter import UncertainParameter
from studies.missing_effect.motion.family import WRONG
from studies.missing_effect.residual.fitting import Residual
from studies.missing_effect.residual.terms import EFFECT
from tyre.base.arrays import Array


def covariance_of(residual: Residual, model: Model) -> ParameterCovariance:
    """Covariance of the parameters of a corrected ``model``, those of its residual torque included, SI.

    To first order where a coordinate is a reciprocal or a logarithm. Errors of the measurement are averaged over.
    """
    rows: dict[str, Array] = {}
    size = len(residual.covariance)
    for column, (u, x) in enumerate(zip(residual.fit.unknowns, residual.fit.theta, strict=True)):
        for key, factor in u.sets.items():
            row = rows.setdefault(key.removeprefix(WRONG), np.zeros(size))
            row[column] += factor * _slope(u, float(x))
    for candidate in residual.fit.candidates:
        rows |= {key: rows[source] for key, source in candidate.ties.items() if source in rows}
    first = len(residual.fit.theta)
    for column, name in enumerate(residual.dropped, first):
        rows[f"{EFFECT}.{name}"] = np.eye(size)[column]
    known = {key for key in model.parameters if key not in model.tied and key not in UNUSED}
    rows |= {f"{EFFECT}.{name}": np.zeros(size) for name in ("middle_speed", "speed_span")}  # exact
    names = tuple(key for key, row in rows.items() if key in known)
    slopes = np.array([rows[key] for key in names])
    matrix = slopes @ residual.covariance @ slopes.T
    return ParameterCovariance(names, (matrix + matrix.T) / 2, origin=MODEL_FILE)


def _slope(u: UncertainParameter, coordinate: float) -> float:
    """d(value)/d(coordinate) with its sign."""
    return -u.slope(coordinate) if u.power < 0 else u.slope(coordinate)
