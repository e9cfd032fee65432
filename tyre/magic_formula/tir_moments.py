"""Camber force and moments of a .tir file near straight running: what camber and slip do besides C_Fy and K_y.

Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, at small slip and camber, shifts (ply steer, conicity) left out, with
dfz = (Fz - FNOMIN') / FNOMIN' and dpi = (p - NOMPRES) / NOMPRES. MF-Tyre 6.1/6.2:

    Kyg0 = Fz (PKY6 + PKY7 dfz) (1 + PPY5 dpi) LKYC                                            (4.E30)
    t    = Dt0 = Fz (R0 / FNOMIN') (QDZ1 + QDZ2 dfz) (1 - PPZ1 dpi) LTR                        (4.E42)
    Kzg0 = Fz R0 (QDZ8 + QDZ9 dfz) (1 + PPZ2 dpi) LKZC LMUY - t Kyg0                           (4.E49)
    Mx/g = -Fz R0 {QSX2 (1 + PPMX1 dpi) - QSX4 QSX7 cos[QSX5 atan((QSX6 Fz/FNOMIN')^2)]
                   - QSX10 atan(QSX11 Fz/FNOMIN')} LMX                        (4.E69, no side force)

MF-Tyre 5.2 (PAC2002): Kyg0 = {PHY3 Kya + Fz (PVY3 + PVY4 dfz) LMUY} LGAY, no pressure, LGAZ for LKZC, QSX2 alone.

Kzg0 is dMz/d(camber). Its part -t Kyg0 is that of the camber force behind the contact centre, which the effect
pneumatic_trail brings (Mz = -t F on the whole force); the rest turns the wheel into the lean (twisting_torque). Mx
says that the load acts beside the wheel plane by R0 QSX2 per radian: on a round tread of radius rho by rho.

Axes of a file with PKY1 < 0 are ISO-W (x forward, y left, z up): slip and camber have the signs used here (lean to the
right > 0), side force and Mz the opposite ones, Mx the same. With PKY1 > 0 (adapted SAE) all are as here.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array

NAMES = (
    "PKY6", "PKY7", "PPY5", "LKYC", "PHY3", "PVY3", "PVY4", "LGAY", "LMUY", "QDZ1", "QDZ2", "PPZ1", "LTR", "QDZ8",
    "QDZ9", "PPZ2", "LKZC", "LGAZ", "QSX2", "QSX4", "QSX5", "QSX6", "QSX7", "QSX10", "QSX11", "PPMX1", "LMX",
)  # fmt: skip
"""Coefficients that are read, all dimensionless; those beginning with L are scale factors, 1 where missing."""


@dataclass(frozen=True)
class TirMoments:
    """Camber force and moments of a file.

    Attributes
    ----------
    coefficients : mapping of str to float
        Those of ``NAMES`` that the file has.
    nominal_load : float
        FNOMIN' = LFZO FNOMIN, N.
    nominal_pressure : float or None
        NOMPRES, Pa; None for MF-Tyre 5.2, which has no pressure.
    unloaded_radius : float or None
        R0, m; None where the file has none, which leaves the moments out.
    iso_signs : bool
        Whether PKY1 < 0.
    """

    coefficients: Mapping[str, float]
    nominal_load: float
    nominal_pressure: float | None
    unloaded_radius: float | None
    iso_signs: bool

    def linear(self, *, load: Array, pressure: Array, cornering_stiffness: Array) -> dict[str, Array]:
        """Return what the file holds, by the name of a field of `TyreProperties`.

        A quantity whose coefficients are missing or all zero was not fitted, and is left out.

        Parameters
        ----------
        load, pressure : ndarray, shape (n,)
            N and Pa.
        cornering_stiffness : ndarray, shape (n,)
            C_Fy > 0, N/rad, for MF-Tyre 5.2.

        Returns
        -------
        dict of str to ndarray, shape (n,)
            SI units, signs of the fields.
        """
        c, side = self._value, -1.0 if self.iso_signs else 1.0
        dfz = load / self.nominal_load - 1
        dpi = np.zeros_like(load) if self.nominal_pressure is None else pressure / self.nominal_pressure - 1
        old = self.nominal_pressure is None
        held: dict[str, Array] = {}
        if old and self._has("PHY3", "PVY3", "PVY4"):
            upright = side * load * (c("PVY3") + c("PVY4") * dfz) * c("LMUY")
            held["camber_stiffness"] = c("LGAY") * (c("PHY3") * cornering_stiffness + upright)
        if not old and self._has("PKY6", "PKY7"):
            held["camber_stiffness"] = side * load * (c("PKY6") + c("PKY7") * dfz) * (1 + c("PPY5") * dpi) * c("LKYC")
        if self.unloaded_radius is None:
            return held
        arm = load * self.unloaded_radius
        if self._has("QDZ1", "QDZ2"):
            held["pneumatic_trail"] = (
                arm / self.nominal_load * (c("QDZ1") + c("QDZ2") * dfz) * (1 - c("PPZ1") * dpi) * c("LTR")
            )
        if self._has("QDZ8", "QDZ9"):
            scale = c("LMUY") * c("LGAZ" if old else "LKZC")
            held["twisting_stiffness"] = side * arm * (c("QDZ8") + c("QDZ9") * dfz) * (1 + c("PPZ2") * dpi) * scale
        if self._has("QSX2", "QSX4", "QSX10"):
            relative = load / self.nominal_load
            share = c("QSX2") * (1 + c("PPMX1") * dpi) - c("QSX10") * np.arctan(c("QSX11") * relative)
            share -= c("QSX4") * c("QSX7") * np.cos(c("QSX5") * np.arctan((c("QSX6") * relative) ** 2))
            held["overturning_stiffness"] = arm * share * c("LMX")
        return held

    def _value(self, name: str) -> float:
        return self.coefficients.get(name, 1.0 if name.startswith("L") else 0.0)

    def _has(self, *names: str) -> bool:
        return any(self._value(name) for name in names)
