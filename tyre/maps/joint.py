"""Covariance of both stiffnesses and the relaxation length at several conditions, from predictions of each."""

import numpy as np

from tyre.base.arrays import Array
from tyre.joint_properties import JointCovariance
from tyre.maps.prediction import Prediction
from tyre.maps.stiffness_covariance import StiffnessCovariance


def joint_covariance(
    cornering: Prediction,
    lateral: Prediction,
    measured: StiffnessCovariance,
    dof: tuple[Array, Array] | None,
) -> JointCovariance:
    """Covariance of both stiffnesses and their ratio at n conditions.

    The relaxation length enters to first order, d(C/K) = (C/K) (dC/C - dK/K). Repeatability is pooled over a campaign,
    so the scatters of its conditions are known equally badly: their degrees of freedom do not add up.

    Parameters
    ----------
    cornering, lateral : Prediction
        N/rad and N/m at n conditions.
    measured : StiffnessCovariance
        At the N measured conditions.
    dof : (ndarray, ndarray) or None
        Degrees of freedom of the measured C and K, shape (N,) each.
    """
    n = cornering.value.size
    length = cornering.value / lateral.value
    to_properties = np.zeros((3 * n, 2 * n))  # from (C of all, K of all) to (C, K, length) of each
    to_properties[0::3, :n] = np.eye(n)
    to_properties[1::3, n:] = np.eye(n)
    to_properties[2::3, :n] = np.diag(length / cornering.value)
    to_properties[2::3, n:] = np.diag(-length / lateral.value)
    stiffness = np.zeros((2 * n, 2 * n))
    stiffness[:n, :n] = cornering.carry @ measured.cornering @ cornering.carry.T + cornering.error
    stiffness[n:, n:] = lateral.carry @ measured.lateral @ lateral.carry.T + lateral.error
    stiffness[:n, n:] = cornering.carry @ measured.cornering_lateral @ lateral.carry.T
    stiffness[n:, :n] = stiffness[:n, n:].T
    covariance = to_properties @ stiffness @ to_properties.T
    covariance = (covariance + covariance.T) / 2
    if dof is None:
        return JointCovariance(covariance, None)
    spread = []
    for half, prediction, total, own, freedom in (
        (to_properties[:, :n], cornering, measured.cornering, measured.own_cornering, dof[0]),
        (to_properties[:, n:], lateral, measured.lateral, measured.own_lateral, dof[1]),
    ):
        # a stated number of degrees of freedom is that of the whole standard deviation: own^4/dof_own = sd^4/dof
        known = np.diag(own) > 0
        ratio = np.divide(np.diag(total), np.diag(own), out=np.zeros(own.shape[0]), where=known)
        root = np.sqrt(ratio) / freedom**0.25
        scatter = prediction.carry @ (own * np.outer(root, root)) @ prediction.carry.T
        spread += [half @ scatter @ half.T]
        if prediction.error_dof > 0:
            spread += [half @ prediction.error @ half.T / np.sqrt(prediction.error_dof)]
    return JointCovariance(covariance, tuple(spread))
