"""From coordinates of a fit to parameters of a model: the covariance that the corrected model carries."""

from collections.abc import Iterable, Sequence

import numpy as np

from bicycle.default_sd import MODEL_FILE
from bicycle.model import Model
from bicycle.parameter_covariance import ParameterCovariance
from bicycle.parameters import UNUSED
from studies.inference.fit import Fit
from studies.inference.parameter import UncertainParameter
from studies.missing_effect.motion.family import WRONG
from studies.missing_effect.residual.terms import EFFECT
from tyre.base.arrays import Array


def covariance_of(
    fit: Fit, covariance: Array, model: Model, *, dropped: Sequence[str] = (), exact: Iterable[str] = ()
) -> ParameterCovariance:
    """Covariance of the parameters of a corrected ``model``, SI.

    To first order where a coordinate is a reciprocal or a logarithm. Errors of the measurement are averaged over.

    Parameters
    ----------
    fit : Fit
        Whose values the model has.
    covariance : ndarray, shape (p + q, p + q)
        Of its p coordinates and of what was dropped.
    model : Model
    dropped : sequence of str
        The q coefficients of a residual torque that are held at zero.
    exact : iterable of str
        Parameters that are known exactly.
    """
    rows: dict[str, Array] = {}
    size = len(covariance)
    for column, (u, x) in enumerate(zip(fit.unknowns, fit.theta, strict=True)):
        for key, factor in u.sets.items():
            row = rows.setdefault(key.removeprefix(WRONG), np.zeros(size))
            row[column] += factor * _slope(u, float(x))
    for candidate in fit.candidates:
        rows |= {key: rows[source] for key, source in candidate.ties.items() if source in rows}
    for column, name in enumerate(dropped, len(fit.theta)):
        rows[f"{EFFECT}.{name}"] = np.eye(size)[column]
    held = (*exact, *(f"{EFFECT}.{name}" for name in ("middle_speed", "speed_span")))
    rows |= {key: np.zeros(size) for key in held if key not in rows}
    known = {key for key in model.parameters if key not in model.tied and key not in UNUSED}
    names = tuple(key for key in rows if key in known)
    slopes = np.array([rows[key] for key in names]).reshape(len(names), size)
    matrix = slopes @ covariance @ slopes.T
    return ParameterCovariance(names, (matrix + matrix.T) / 2, origin=MODEL_FILE)


def _slope(u: UncertainParameter, coordinate: float) -> float:
    """d(value)/d(coordinate) with its sign."""
    return -u.slope(coordinate) if u.power < 0 else u.slope(coordinate)
