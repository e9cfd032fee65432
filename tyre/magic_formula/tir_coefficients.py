"""What a .tir file holds of a tyre near straight running: coefficients and the linear properties they give.

MF-Tyre 6.1/6.2: the laws of :mod:`tyre.magic_formula.mf61` with FNOMIN' = LFZO FNOMIN and LKY Kya, and
sigma_y = abs(Kya / Cy) (Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, eqs. 4.E25 and A3.9-A3.10).

MF-Tyre 5.2 (PAC2002) has no pressure: Kya without its PPY terms and with PKY4 = 2, and

    sigma_alpha = PTY1 sin{2 atan[Fz / (PTY2 FNOMIN')]} (1 - PKY3 abs(camber)) R0 LFZO LSGAL
    K = abs(Kya) / sigma_alpha

Signs are ISO: PKY1 < 0. The functions here return Kya as C_Fy > 0 (side force grows with slip, adapted SAE).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tyre.base.arrays import Array
from tyre.magic_formula import mf61


@dataclass(frozen=True)
class MF61Lateral:
    """Coefficients of MF-Tyre 6.1/6.2 that hold C_Fy and K_y over load and pressure.

    ``fnomin`` N, ``nompres`` Pa, ``lateral_stiffness`` N/m, the rest without unit; ``pky1`` < 0 (ISO). ``load_range``
    (N) and ``pressure_range`` (Pa) are FZMIN, FZMAX, PRESMIN, PRESMAX; ``lateral_stiffness`` is NaN in a file without.
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

    def cornering_stiffness(self, *, load: ArrayLike, pressure: ArrayLike) -> Array:
        """C_Fy, N/rad.

        Parameters
        ----------
        load, pressure : array_like
            N and Pa, broadcast.
        """
        return mf61.cornering_stiffness(
            load, pressure, PKY1=-self.lky * self.pky1, PKY2=self.pky2, PPY1=self.ppy1, PPY2=self.ppy2,
            PKY4=self.pky4, FNOMIN=self.lfzo * self.fnomin, NOMPRES=self.nompres,
        )  # fmt: skip

    def lateral_stiffness_at(self, *, load: ArrayLike, pressure: ArrayLike) -> Array:
        """K_y, N/m.

        Parameters
        ----------
        load, pressure : array_like
            N and Pa, broadcast.
        """
        return mf61.lateral_stiffness(
            load, pressure, LATERAL_STIFFNESS=self.lateral_stiffness, PCFY1=self.pcfy1, PCFY2=self.pcfy2,
            PCFY3=self.pcfy3, FNOMIN=self.lfzo * self.fnomin, NOMPRES=self.nompres,
        )  # fmt: skip

    def relaxation_length(self, *, load: ArrayLike, pressure: ArrayLike) -> Array:
        """sigma_y = |Kya / Cy|, m.

        Parameters
        ----------
        load, pressure : array_like
            N and Pa, broadcast.
        """
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

    def cornering_stiffness(self, *, load: ArrayLike, camber: ArrayLike = 0.0) -> Array:
        """C_Fy, N/rad.

        Parameters
        ----------
        load, camber : array_like
            N and rad, broadcast.
        """
        shape = mf61.saturation(self._relative(load) / self.pky2)
        lean = 1.0 - self.pky3 * np.abs(np.asarray(camber, dtype=np.float64))
        return -self.lky * self.pky1 * self.lfzo * self.fnomin * shape * lean

    def relaxation_length(self, *, load: ArrayLike, camber: ArrayLike = 0.0) -> Array:
        """sigma_alpha, m.

        Parameters
        ----------
        load, camber : array_like
            N and rad, broadcast.
        """
        shape = mf61.saturation(self._relative(load) / self.pty2)
        lean = 1.0 - self.pky3 * np.abs(np.asarray(camber, dtype=np.float64))
        return self.pty1 * shape * lean * self.unloaded_radius * self.lfzo * self.lsgal

    def lateral_stiffness_at(self, *, load: ArrayLike) -> Array:
        """K_y = C_Fy / sigma_alpha, N/m.

        Parameters
        ----------
        load : array_like
            N.
        """
        return self.cornering_stiffness(load=load) / self.relaxation_length(load=load)

    def _relative(self, load: ArrayLike) -> Array:
        return np.asarray(load, dtype=np.float64) / (self.lfzo * self.fnomin)
