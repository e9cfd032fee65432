"""The model of a slip-sweep fit: nine parameters, which of them are free, where they start, their bounds."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tyre.base.errors import InputError
from tyre.fits.sweep_branches import Blocks
from tyre.fits.sweep_curve import lagged_magic_formula
from tyre.recordings.recording import Channel

BOUNDS = {
    "cornering_stiffness": (0.2, 5.0),  # of the slope near zero slip
    "peak": (0.7, 6.0),  # of the largest force
    "shape": (0.5, 2.5),
    "curvature": (-10.0, 1.0),
    "horizontal_shift": (-0.05, 0.05),  # rad
    "lag": (-0.3, 1.5),  # s
    "hysteresis": (-0.02, 0.02),  # rad
    "vertical_shift": (-5.0, 5.0),  # of the largest force
    "drift": (-5.0, 5.0),  # likewise, over the recording
}
"""Fitted numbers and the values they may have; forces and the stiffness in units of a first look at the sweep."""

NAMES = tuple(BOUNDS)
LOW, HIGH = (np.array([limits[end] for limits in BOUNDS.values()]) for end in (0, 1))
_AT = {name: place for place, name in enumerate(NAMES)}
_TWO_RATES = 1.5  # rates in one recording that differ by this factor separate lag from rate-independent hysteresis
_LAG_LENGTH = 0.1  # m, where the fitted lag starts
_SPEED = 2.5  # m/s, for that start where the speed is unknown


@dataclass(frozen=True)
class SweepModel:
    """Side force of the settled blocks of a sweep as a function of the scaled parameters ``NAMES``.

    Attributes
    ----------
    blocks : Blocks
    free : ndarray of bool, shape (9,)
        Which parameters are fitted; the others stay at ``start``.
    start : ndarray, shape (9,)
        Scaled parameters.
    stiffness : float
        Unit of the cornering stiffness, N/rad.
    force_scale : float
        Unit of the forces, N.
    """

    blocks: Blocks
    free: NDArray[np.bool_]
    start: Channel
    stiffness: float
    force_scale: float

    @property
    def units(self) -> Channel:
        """Physical over scaled parameters, shape (9,)."""
        units = dict.fromkeys(NAMES, 1.0) | {"cornering_stiffness": self.stiffness}
        units |= dict.fromkeys(("peak", "vertical_shift", "drift"), self.force_scale)
        return np.array(list(units.values()))

    def expanded(self, values: Channel) -> Channel:
        """All nine scaled parameters.

        Parameters
        ----------
        values : ndarray, shape (p,)
            The free ones.
        """
        full = self.start.copy()
        full[self.free] = values
        return full

    def residuals(self, scaled: Channel) -> tuple[Channel, NDArray[np.float64]]:
        """Computed minus measured side force and its derivatives.

        Parameters
        ----------
        scaled : ndarray, shape (9,)

        Returns
        -------
        residuals : ndarray, shape (m,)
            N, of the settled blocks.
        jacobian : ndarray, shape (m, 9)
        """
        blocks, used = self.blocks, self.blocks.settled
        named = dict(zip(NAMES, scaled, strict=True))
        middle = 0.5 * (blocks.time[0] + blocks.time[-1])
        clock = (blocks.time[used] - middle) / (blocks.time[-1] - blocks.time[0])
        force, part = lagged_magic_formula(
            time=blocks.time[used],
            slip_time=blocks.time,
            slip=blocks.slip,
            direction=np.sign(blocks.rate[used]),
            cornering_stiffness=named["cornering_stiffness"] * self.stiffness,
            peak=named["peak"] * self.force_scale,
            **{name: named[name] for name in ("shape", "curvature", "horizontal_shift", "lag", "hysteresis")},
        )
        part[0] *= self.stiffness
        part[1] *= self.force_scale
        jacobian = np.column_stack([*part, np.full_like(clock, self.force_scale), self.force_scale * clock])
        zero = self.force_scale * (named["vertical_shift"] + named["drift"] * clock)
        return force + zero - blocks.force[used], jacobian


def sweep_model(
    blocks: Blocks, *, lag_correction: bool, relaxation_length: float | None, notes: list[str], where: str
) -> SweepModel:
    """The model of a sweep with what its blocks can determine left free.

    Parameters
    ----------
    blocks : Blocks
    lag_correction : bool
        False holds the lag at zero.
    relaxation_length : float or None
        Known relaxation length, m: holds the lag at it.
    notes : list of str
        Gets what must be told.
    where : str
        Name of the recording, for messages.

    Raises
    ------
    InputError
        A known relaxation length without a speed, too few blocks, no slip at zero, or a force that falls with slip.
    """
    free = _free_parameters(blocks, relaxation_length, notes, where, lag_correction=lag_correction)
    if blocks.settled.sum() < 2 * free.sum():
        raise InputError(
            f"{where}: only {blocks.settled.sum()} tenths of a degree of slip are left after the lag has settled; "
            "sweep more slowly, further or more often"
        )
    slope, level = _line_near_zero(blocks, where)
    force_scale = float(np.max(np.abs(blocks.force - level)))
    start = dict.fromkeys(NAMES, 0.0) | {"cornering_stiffness": 1.05, "peak": 1.2, "shape": 1.3}
    start["vertical_shift"] = level / force_scale
    if relaxation_length is not None and blocks.speed is not None:
        start["lag"] = relaxation_length / blocks.speed
    elif free[_AT["lag"]]:
        start["lag"] = _LAG_LENGTH / (blocks.speed or _SPEED)
    within = np.clip(np.array(list(start.values())), LOW + 1e-6, HIGH - 1e-6)
    return SweepModel(blocks, free, within, slope, force_scale)


def _free_parameters(
    blocks: Blocks, relaxation_length: float | None, notes: list[str], where: str, *, lag_correction: bool
) -> NDArray[np.bool_]:
    rates = blocks.branch_rates[np.unique(blocks.branch[blocks.settled])]
    both = bool((rates > 0.0).any() and (rates < 0.0).any())
    pace = np.abs(rates)
    if relaxation_length is not None and blocks.speed is None:
        raise InputError(f"{where}: a known relaxation length needs the speed; give speed_km_h in the sidecar")
    if not both and relaxation_length is None and lag_correction:
        notes.append("only one direction of sweep: the lag cannot be told from the offset Sh and is not removed")
    free = dict.fromkeys(NAMES, True)
    free["lag"] = lag_correction and both and relaxation_length is None
    free["hysteresis"] = bool(lag_correction and both and pace.max() > _TWO_RATES * pace.min())
    free["drift"] = both and rates.size >= 3
    return np.array(list(free.values()))


def _line_near_zero(blocks: Blocks, where: str) -> tuple[float, float]:
    """Slope (N/rad) and force (N) of a straight line through the blocks near zero slip."""
    near = np.abs(blocks.slip) < max(np.deg2rad(1.5), 0.25 * float(np.abs(blocks.slip).max()))
    if near.sum() < 5:
        raise InputError(f"{where}: the sweep does not cross zero slip; its slope there cannot be measured")
    slope, level = np.polyfit(blocks.slip[near], blocks.force[near], 1)
    if slope <= 0.0:
        raise InputError(
            f"{where}: the side force falls with slip ({np.deg2rad(slope):.3g} N/deg after conversion from "
            "the declared axes); check axes = ISO / SAE / adapted SAE"
        )
    return float(slope), level
