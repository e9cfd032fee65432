"""Lateral stiffness of the Magic Formula tyre models over load and pressure: what a .tir file says of C, K, sigma.

MF-Tyre 6.1/6.2 (Besselink, Schmeitz & Pacejka 2010, doi 10.1080/00423111003748088; Pacejka, Tire and Vehicle
Dynamics, 3rd ed. 2012, eqs. 4.E25 and A3.9-A3.10) at zero camber, with dfz = (Fz - FNOMIN') / FNOMIN',
dpi = (p - NOMPRES) / NOMPRES and FNOMIN' = LFZO FNOMIN:

    Kya = LKY PKY1 FNOMIN' (1 + PPY1 dpi) sin{PKY4 atan[Fz / (PKY2 (1 + PPY2 dpi) FNOMIN')]}
    Cy  = LATERAL_STIFFNESS (1 + PCFY1 dfz + PCFY2 dfz^2) (1 + PCFY3 dpi)
    sigma_y = abs(Kya / Cy)

MF-Tyre 5.2 (PAC2002) has no pressure: Kya as above without its PPY terms and with PKY4 = 2, and

    sigma_alpha = PTY1 sin{2 atan[Fz / (PTY2 FNOMIN')]} (1 - PKY3 abs(camber)) R0 LFZO LSGAL
    K = abs(Kya) / sigma_alpha

Signs are ISO: PKY1 < 0. The functions here return Kya as C_Fy > 0 (side force grows with slip, adapted SAE).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Values = NDArray[np.float64]


@dataclass(frozen=True)
class MF61Lateral:
    """Coefficients of MF-Tyre 6.1/6.2 that hold C_Fy and K_y over load and pressure.

    ``fnomin`` N, ``nompres`` Pa, ``lateral_stiffness`` N/m, the rest without unit; ``pky1`` < 0 (ISO). ``load_range``
    (N) and ``pressure_range`` (Pa) are FZMIN, FZMAX, PRESMIN, PRESMAX.
    """

    fnomin: float
    nompres: float
    pky1: float
    pky2: float
    ppy1: float
    ppy2: float
    lateral_stiffness: float
    pcfy1: float
    pcfy2: float
    pcfy3: float
    load_range: tuple[float, float]
    pressure_range: tuple[float, float]
    pky4: float = 2.0
    lfzo: float = 1.0
    lky: float = 1.0

    def cornering_stiffness(self, *, load: ArrayLike, pressure: ArrayLike) -> Values:
        """C_Fy, N/rad, at load (N) and pressure (Pa), broadcast."""
        dpi = (np.asarray(pressure, dtype=np.float64) - self.nompres) / self.nompres
        fz = np.asarray(load, dtype=np.float64) / (self.lfzo * self.fnomin)
        angle = np.arctan(fz / (self.pky2 * (1.0 + self.ppy2 * dpi)))
        return -self.lky * self.pky1 * self.lfzo * self.fnomin * (1.0 + self.ppy1 * dpi) * np.sin(self.pky4 * angle)

    def lateral_stiffness_at(self, *, load: ArrayLike, pressure: ArrayLike) -> Values:
        """K_y, N/m, at load (N) and pressure (Pa), broadcast."""
        dpi = (np.asarray(pressure, dtype=np.float64) - self.nompres) / self.nompres
        dfz = np.asarray(load, dtype=np.float64) / (self.lfzo * self.fnomin) - 1.0
        return self.lateral_stiffness * (1.0 + self.pcfy1 * dfz + self.pcfy2 * dfz**2) * (1.0 + self.pcfy3 * dpi)

    def relaxation_length(self, *, load: ArrayLike, pressure: ArrayLike) -> Values:
        """sigma_y = |Kya / Cy|, m."""
        stiffness = self.cornering_stiffness(load=load, pressure=pressure)
        return np.abs(stiffness / self.lateral_stiffness_at(load=load, pressure=pressure))


@dataclass(frozen=True)
class MF52Lateral:
    """Coefficients of MF-Tyre 5.2 (PAC2002) that hold C_Fy and the relaxation length over load.

    ``pressure`` (Pa) is the one pressure of the file, NaN where it states none; ``unloaded_radius`` m; units and signs
    of the rest as in ``MF61Lateral``.
    """

    fnomin: float
    pressure: float
    unloaded_radius: float
    pky1: float
    pky2: float
    pty1: float
    pty2: float
    load_range: tuple[float, float]
    pky3: float = 0.0
    lfzo: float = 1.0
    lky: float = 1.0
    lsgal: float = 1.0

    def cornering_stiffness(self, *, load: ArrayLike, camber: ArrayLike = 0.0) -> Values:
        """C_Fy, N/rad, at load (N) and camber (rad)."""
        shape = np.sin(2.0 * np.arctan(self._relative(load) / self.pky2))
        lean = 1.0 - self.pky3 * np.abs(np.asarray(camber, dtype=np.float64))
        return -self.lky * self.pky1 * self.lfzo * self.fnomin * shape * lean

    def relaxation_length(self, *, load: ArrayLike, camber: ArrayLike = 0.0) -> Values:
        """sigma_alpha, m, at load (N) and camber (rad)."""
        shape = np.sin(2.0 * np.arctan(self._relative(load) / self.pty2))
        lean = 1.0 - self.pky3 * np.abs(np.asarray(camber, dtype=np.float64))
        return self.pty1 * shape * lean * self.unloaded_radius * self.lfzo * self.lsgal

    def lateral_stiffness_at(self, *, load: ArrayLike) -> Values:
        """K_y = C_Fy / sigma_alpha, N/m."""
        return self.cornering_stiffness(load=load) / self.relaxation_length(load=load)

    def _relative(self, load: ArrayLike) -> Values:
        return np.asarray(load, dtype=np.float64) / (self.lfzo * self.fnomin)
