"""Mode-shape ratios of free decays: what one channel does over what another does, with their sd."""

import math
from collections.abc import Sequence

import numpy as np

from bicycle.identification.decay_least_squares import Linear
from bicycle.identification.decay_posterior import Posterior
from tyre.base.arrays import Array

RATIOS = {
    "steer_over_lean": ("steer_rate_rad_s", "roll_rate_rad_s"),
    "yaw_over_lean": ("yaw_rate_rad_s", "roll_rate_rad_s"),
}
ANGLES = {"steer_rate_rad_s": "steer_rad", "roll_rate_rad_s": "lean_rad"}


def mode_ratios(
    found: Sequence[Posterior], amplitudes: Sequence[Linear], kinds: Array, number: int
) -> dict[str, tuple[complex, float]]:
    """Ratios of one mode by law of total variance over its posterior; a rate not recorded is lambda times its angle.

    Parameters
    ----------
    found : sequence of Posterior
        One of each kind of drift.
    amplitudes : sequence of Linear
        At the points of each.
    kinds : ndarray, shape (k,)
        Probabilities of the kinds.
    number : int
        Of the mode.

    Returns
    -------
    dict
        Ratio of rates -> its value and its 1-sigma, one for both parts.
    """
    channels = found[0].evidence.window.channels
    scale = found[0].evidence.window.scale
    columns = {rate: (rate if rate in channels else ANGLES.get(rate, "")) for pair in RATIOS.values() for rate in pair}
    values: dict[str, list[Array]] = {name: [] for name in RATIOS}
    spreads: dict[str, list[Array]] = {name: [] for name in RATIOS}
    turn = np.array([1, -1j])
    for p, linear in zip(found, amplitudes, strict=True):
        root = p.modes[:, number, 0] + 1j * p.modes[:, number, 1]
        two = slice(2 * number, 2 * number + 2)
        of_mode = linear.covariance[:, :, two][..., two]  # (points, channels, 2, channels, 2)
        spread = np.einsum("pciej,i,j->pce", of_mode, turn, turn.conj())
        phasors = linear.mean[:, :, two] @ turn
        known = {rate: column for rate, column in columns.items() if column in channels}
        places = {rate: channels.index(column) for rate, column in known.items()}
        turned = {rate: scale[places[rate]] * (1.0 if known[rate] == rate else root) for rate in known}
        for name, (over, under) in RATIOS.items():
            if over in known and under in known:
                a, b = places[over], places[under]
                value = turned[over] * phasors[:, a] / (turned[under] * phasors[:, b])
                seen = phasors[:, a] / phasors[:, b]
                miss = (
                    spread[:, a, a] + np.abs(seen) ** 2 * spread[:, b, b] - 2 * np.real(seen.conj() * spread[:, a, b])
                )
                values[name].append(value)
                spreads[name].append(np.real(miss) / np.abs(phasors[:, a]) ** 2 * np.abs(value) ** 2 / 2)
    weights = np.concatenate([kind * p.weights for kind, p in zip(kinds, found, strict=True)])
    ratios = {}
    for name in RATIOS:
        if values[name]:
            value, spread = np.concatenate(values[name]), np.concatenate(spreads[name])
            mean = complex(weights @ value)
            ratios[name] = (mean, math.sqrt(float(weights @ (spread + np.abs(value - mean) ** 2 / 2))))
    return ratios
