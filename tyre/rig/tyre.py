"""The tyre of the simulated rig: a truth that is known."""

from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array
from tyre.magic_formula.side_force import magic_formula


@dataclass(frozen=True)
class RigTyre:
    """The truth of one tyre at one load and pressure (SI units).

    Steady side force Sv + D times the Magic Formula of B x, with x = slip + Sh and B = cornering_stiffness / (C D);
    aligning moment -t (F - Sv) with t = pneumatic_trail / (1 + (x / trail_slip)^2).

    Attributes
    ----------
    cornering_stiffness : float
        N/rad.
    lateral_stiffness : float
        N/m.
    peak_force : float
        D, N.
    shape, curvature : float
        C and E.
    pneumatic_trail : float
        At zero slip, m.
    trail_slip : float
        Slip at which the trail has halved, rad.
    offset_force, offset_slip : float
        Sv in N, Sh in rad.
    rim_stiffness : float
        N/m; inf for a rigid rim.
    relaxation : bool
        Whether the force of the rolling tyre lags.
    softening : float
        Share by which a pull is softer at its end (see :func:`tyre.rig.simulator.simulate_pull`).
    """

    cornering_stiffness: float
    lateral_stiffness: float
    peak_force: float
    shape: float = 1.4
    curvature: float = 0.0
    pneumatic_trail: float = 0.018
    trail_slip: float = 0.08
    offset_force: float = 0.0
    offset_slip: float = 0.0
    rim_stiffness: float = np.inf
    relaxation: bool = True
    softening: float = 0.0

    @property
    def relaxation_length(self) -> float:
        """C / K_y of tyre (and rim in series), m."""
        return self.cornering_stiffness * (1.0 / self.lateral_stiffness + 1.0 / self.rim_stiffness)

    def steady_force(self, slip: Array) -> Array:
        """Side force of the steadily rolling tyre, N (n,), at ``slip`` (n,), rad."""
        u = self.cornering_stiffness / (self.shape * self.peak_force) * (slip + self.offset_slip)
        curve = magic_formula(u, shape_factor=self.shape, curvature_factor=self.curvature)
        return np.asarray(self.offset_force + self.peak_force * curve)
