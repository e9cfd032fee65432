"""Laws of MF-Tyre 5.2, 6.1/6.2 and of motorcycle tyres: lateral force and aligning moment from the coefficients of a
file.

Sources: Pacejka, Tire and Vehicle Dynamics, 3rd ed. (2012), section 4.3.2 (6.1) and chapter 11 (motorcycle tyres); 2nd
ed. (2006), section 4.3.2 (5.2). Pure side slip, no turn slip, forward motion.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, nan
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.laws import magic_formula as mf61

Version = Literal["5.2", "6.1", "motorcycle"]
FORCE = ("PCY1", "PDY1", "PDY2", "PDY3", "PEY1", "PEY2", "PEY3", "PEY4", "PKY1", "PKY2", "PKY3", "PHY1", "LFZO", "LKY",
         "LCY", "LMUY", "LEY", "LHY")  # fmt: skip
MOMENT = ("QBZ1", "QBZ2", "QBZ3", "QBZ4", "QBZ5", "QBZ9", "QBZ10", "QCZ1", "QDZ1", "QDZ2", "QDZ3", "QDZ4", "QDZ6",
          "QDZ7", "QDZ8", "QDZ9", "QEZ1", "QEZ2", "QEZ3", "QEZ4", "QEZ5", "QHZ1", "QHZ2", "QHZ3", "QHZ4", "QSX2",
          "LTR", "LRES", "LMX")  # fmt: skip
SHIFTS = ("PHY2", "PVY1", "PVY2", "PVY3", "PVY4", "LVY")
PRESSURE = ("PPY1", "PPY2", "PPY3", "PPY4")
OVER_PRESSURE = (*PRESSURE, "PPY5", "PPZ1", "PPZ2", "PPMX1", "PCFY3")  # of 6.1: all that go with the pressure
# coefficients that each law takes; those that begin with L are scale factors
TAKEN: Mapping[Version, tuple[str, ...]] = {
    "5.2": (*FORCE, *MOMENT, *SHIFTS, *PRESSURE, "PHY3", "PTY1", "PTY2", "LSGAL", "LGAY", "LGAZ", "LATERAL_STIFFNESS"),
    "6.1": (*FORCE, *MOMENT, *SHIFTS, *PRESSURE, "PKY4", "PKY5", "PKY6", "PKY7", "PEY5", "PPY5", "PPZ1", "PPZ2",
            "QDZ10", "QDZ11", "QSX4", "QSX5", "QSX6", "QSX7", "QSX10", "QSX11", "PPMX1", "LKYC", "LKZC",
            "PCFY1", "PCFY2", "PCFY3", "LATERAL_STIFFNESS"),
    "motorcycle": (*FORCE, "PCY2", "PKY4", "PKY5", "PKY6", "PKY7", "PEY5", "LCC", "LKC", "LATERAL_STIFFNESS"),
}  # fmt: skip
POSITIVE = ("FNOMIN", "NOMPRES", "LATERAL_STIFFNESS", "PKY2", "PTY2", "LFZO", "LKY", "LSGAL")
DEFAULTS = {"PTY2": 1.0, "LATERAL_STIFFNESS": nan, "UNLOADED_RADIUS": nan, "NOMPRES": nan}


@dataclass(frozen=True)
class Coefficients:
    """Coefficients by their names in a .tir file, SI, and their ranges; ISO signs with PKY1 < 0, else adapted SAE."""

    values: Mapping[str, float]  # by name, such as PKY1
    version: Version  # law that the coefficients belong to
    load_range: tuple[float, float]  # N, lowest and highest vertical load
    pressure_range: tuple[float, float] = (0.0, inf)  # Pa, lowest and highest
    # the book's moment of a leaning tyre is -t F with the camber force in F, that of the software is without it
    camber_in_trail: bool = False

    def __getitem__(self, name: str) -> float:
        return self.values.get(name, DEFAULTS.get(name, 1.0 if name.startswith("L") else 0.0))

    def has(self, *names: str) -> bool:
        """True if one of the coefficients is there and not zero."""
        return any(self.values.get(name, 0.0) for name in names)

    @cached_property
    def by_pressure(self) -> bool:
        """True if the coefficients hold over pressure: those of 6.1, and of 5.2 with PPY1 and a nominal pressure."""
        return self["NOMPRES"] > 0 and (self.version == "6.1" or self.has(*PRESSURE))

    @cached_property
    def old(self) -> bool:
        """MF-Tyre 5.2."""
        return self.version == "5.2"

    @cached_property
    def side(self) -> float:
        """Factor from the axes of the file to adapted SAE."""
        return -1.0 if self["PKY1"] < 0 else 1.0

    @property
    def nominal_load(self) -> float:
        """FNOMIN' = LFZO FNOMIN, N."""
        return self["LFZO"] * self["FNOMIN"]

    def _relative(self, load: ArrayLike, pressure: ArrayLike) -> tuple[Array, Array, Array]:
        """Load, its relative change from the nominal one, and that of the pressure (0 without a law of pressure)."""
        force = np.asarray(load, dtype=np.float64)
        dpi = np.zeros(np.shape(load))
        if self.by_pressure:
            dpi = np.asarray(pressure, dtype=np.float64) / self["NOMPRES"] - 1
        return force, force / self.nominal_load - 1, dpi

    def cornering_stiffness(self, *, load: ArrayLike, pressure: ArrayLike, camber: ArrayLike = 0.0) -> Array:
        """C_alpha, N/rad, > 0 whatever the signs of the file (4.E25; chapter 11 for motorcycle tyres)."""
        force, _, dpi = self._relative(load, pressure)
        lean = np.asarray(camber, dtype=np.float64)
        height = self["LKY"] * abs(self["PKY1"]) * self.nominal_load
        if self.version == "motorcycle":
            relative = force / ((self["PKY3"] + self["PKY4"] * lean**2) * self.nominal_load)
            return height * mf61.saturation(relative, exponent=self["PKY2"]) / (1 + self["PKY5"] * lean**2)
        bend = 0.0 if self.old else self["PKY5"] * np.sin(lean) ** 2
        lean = np.abs(lean) * self["LGAY"] if self.old else np.abs(np.sin(lean))
        relative = force / ((self["PKY2"] + bend) * (1 + self["PPY2"] * dpi) * self.nominal_load)
        shape = mf61.saturation(relative, exponent=2.0 if self.old else self.values.get("PKY4", 2.0))
        return np.asarray(height * (1 + self["PPY1"] * dpi) * (1 - self["PKY3"] * lean) * shape)

    def lateral_stiffness(self, *, load: ArrayLike, pressure: ArrayLike) -> Array:
        """K_y, N/m; NaN if the coefficients do not hold it."""
        stiffness = self["LATERAL_STIFFNESS"]
        if self.version == "6.1":
            nominal = self["NOMPRES"] if self.by_pressure else 1.0
            return mf61.lateral_stiffness(
                load,
                pressure if self.by_pressure else nominal,
                LATERAL_STIFFNESS=stiffness,
                FNOMIN=self.nominal_load,
                NOMPRES=nominal,
                **{name: self[name] for name in ("PCFY1", "PCFY2", "PCFY3")},
            )
        if not (self.old and self["PTY1"] > 0):
            return np.full(np.shape(load), stiffness)
        relative = np.asarray(load, dtype=np.float64) / self.nominal_load
        length = self["PTY1"] * mf61.saturation(relative / self["PTY2"]) * self["UNLOADED_RADIUS"]
        cornering = self.cornering_stiffness(load=load, pressure=pressure)
        return cornering / (length * self["LFZO"] * self["LSGAL"])

    def _camber_stiffness(self, load: ArrayLike, pressure: ArrayLike) -> Array:
        """Lateral force per camber at zero slip in the axes of the file (K_y gamma 0), N/rad."""
        force, dfz, dpi = self._relative(load, pressure)
        if self.old:
            slope = self.cornering_stiffness(load=load, pressure=pressure) * self.side
            upright = force * (self["PVY3"] + self["PVY4"] * dfz) * self["LMUY"]
            return np.asarray(self["LGAY"] * (self["PHY3"] * slope + upright))
        scale = self["LKYC"] if self.version == "6.1" else self["LKC"]
        return np.asarray(force * (self["PKY6"] + self["PKY7"] * dfz) * (1 + self["PPY5"] * dpi) * scale)

    def linear(self, *, load: Array, pressure: Array) -> dict[str, Array]:
        """Return what the coefficients hold at small slip and camber, by the name of a field of `TyreProperties`."""
        cornering = self.cornering_stiffness(load=load, pressure=pressure)
        lateral = self.lateral_stiffness(load=load, pressure=pressure)
        quantities = {"cornering_stiffness": cornering}
        if self["LATERAL_STIFFNESS"] > 0 or (self.old and self["PTY1"] > 0):
            quantities |= {"lateral_stiffness": lateral, "relaxation_length": cornering / lateral}
        force, dfz, dpi = self._relative(load, pressure)
        relative = force / self.nominal_load
        if self.has(*(("PHY3", "PVY3", "PVY4") if self.old else ("PKY6", "PKY7"))):
            quantities["camber_stiffness"] = self.side * self._camber_stiffness(load, pressure)
        if self.version == "motorcycle" or not self["UNLOADED_RADIUS"] > 0:
            return quantities
        arm = force * self["UNLOADED_RADIUS"]
        if self.has("QDZ1", "QDZ2"):
            by_load = arm / self.nominal_load * (self["QDZ1"] + self["QDZ2"] * dfz)
            quantities["pneumatic_trail"] = by_load * (1 - self["PPZ1"] * dpi) * self["LTR"]
        trail_of_camber = quantities.get("pneumatic_trail", 0.0) * quantities.get(
            "camber_stiffness", np.zeros_like(force)
        )
        if self.has("QDZ8", "QDZ9"):
            scale = self["LMUY"] * self["LGAZ" if self.old else "LKZC"]
            by_load = arm * (self["QDZ8"] + self["QDZ9"] * dfz)
            quantities["twisting_stiffness"] = self.side * by_load * (1 + self["PPZ2"] * dpi) * scale
            if not (self.old or self.camber_in_trail):
                quantities["twisting_stiffness"] = quantities["twisting_stiffness"] + trail_of_camber
        if self.has("QSX2", "QSX4", "QSX10"):
            share = self["QSX2"] * (1 + self["PPMX1"] * dpi) - self["QSX10"] * np.arctan(self["QSX11"] * relative)
            share -= self["QSX4"] * self["QSX7"] * np.cos(self["QSX5"] * np.arctan((self["QSX6"] * relative) ** 2))
            quantities["overturning_stiffness"] = arm * share * self["LMX"]
        return quantities

    @property
    def curved(self) -> bool:
        """True if the file holds the full curve of the lateral force, not only its slope."""
        shaped = self["PCY2"] > 0 or self.version != "motorcycle"
        return self["PCY1"] > 0 and self["PDY1"] > 0 and shaped

    def lateral_force(
        self, *, slip_angle: ArrayLike, load: ArrayLike, pressure: ArrayLike, camber: ArrayLike = 0.0
    ) -> Array:
        """Lateral force, N, adapted SAE (> 0 to the right for a slip angle > 0); slip angle and camber in rad."""
        return np.asarray(self.side * self._force(slip_angle, load, pressure, camber).value)

    def aligning_moment(
        self, *, slip_angle: ArrayLike, load: ArrayLike, pressure: ArrayLike, camber: ArrayLike = 0.0
    ) -> Array:
        """Aligning moment, N m, adapted SAE (> 0 turns the wheel to the right); 4.E31 to 4.E49."""
        if self.version == "motorcycle" or not (self.has("QDZ1", "QDZ2") and self["UNLOADED_RADIUS"] > 0):
            raise InputError("it holds no aligning moment (QDZ1, UNLOADED_RADIUS)")
        slip = np.asarray(slip_angle, dtype=np.float64)
        whole = self._force(slip, load, pressure, camber)
        with_camber = self.old or self.camber_in_trail
        force = whole.value if with_camber else self._force(slip, load, pressure, 0.0).value
        load, dfz, dpi = self._relative(load, pressure)
        lean = np.asarray(camber, dtype=np.float64) * self["LGAZ"] if self.old else np.sin(camber)
        at = whole.slip + self["QHZ1"] + self["QHZ2"] * dfz + (self["QHZ3"] + self["QHZ4"] * dfz) * lean
        ratio, squares = self["LKY"] / self["LMUY"], dfz * dfz
        factor = (self["QBZ1"] + self["QBZ2"] * dfz + self["QBZ3"] * squares) * ratio
        factor = factor * (1 + self["QBZ4"] * lean + self["QBZ5"] * np.abs(lean))
        curvature = self["QEZ1"] + self["QEZ2"] * dfz + self["QEZ3"] * squares
        bend = 2 / np.pi * np.arctan(factor * self["QCZ1"] * at)
        curvature = np.minimum(curvature * (1 + (self["QEZ4"] + self["QEZ5"] * lean) * bend), 1)
        arm = load * self["UNLOADED_RADIUS"]
        trail = arm / self.nominal_load * (self["QDZ1"] + self["QDZ2"] * dfz) * (1 - self["PPZ1"] * dpi) * self["LTR"]
        trail = trail * (1 + self["QDZ3"] * lean + self["QDZ4"] * lean**2)
        trail = trail * np.cos(_angle(factor * at, self["QCZ1"], curvature)) * np.cos(slip)
        by_camber = (self["QDZ8"] + self["QDZ9"] * dfz) * (1 + self["PPZ2"] * dpi)
        by_camber = (by_camber + (self["QDZ10"] + self["QDZ11"] * dfz) * np.abs(lean)) * lean
        residual = (self["QDZ6"] + self["QDZ7"] * dfz) * self["LRES"] + by_camber * (1 if self.old else self["LKZC"])
        width = self["QBZ9"] * ratio + self["QBZ10"] * whole.slope / whole.peak
        residual = arm * residual * self["LMUY"] * np.cos(np.arctan(width * whole.away)) * np.cos(slip)
        return np.asarray(self.side * (residual - trail * force))

    def _force(self, slip_angle: ArrayLike, load: ArrayLike, pressure: ArrayLike, camber: ArrayLike) -> "_Force":
        """Evaluate the lateral force in the axes of the file: 4.E19 to 4.E30, for motorcycle tyres chapter 11."""
        if not self.curved:
            names = "PCY1, PDY1, PCY2" if self.version == "motorcycle" else "PCY1, PDY1"
            raise InputError(f"it holds no curve of the lateral force ({names}), only its slope")
        motorcycle, new = self.version == "motorcycle", self.version == "6.1"
        slope = self.side * self.cornering_stiffness(load=load, pressure=pressure, camber=camber)
        by_camber = self._camber_stiffness(load, pressure)
        load, dfz, dpi = self._relative(load, pressure)
        slip, lean = np.asarray(slip_angle, dtype=np.float64), np.asarray(camber, dtype=np.float64)
        slip, lean = (np.tan(slip), np.sin(lean)) if new else (slip, lean * (1 if motorcycle else self["LGAY"]))
        if motorcycle:
            friction = self["PDY1"] * np.exp(self["PDY2"] * dfz) / (1 + self["PDY3"] * lean**2)
        else:
            friction = (self["PDY1"] + self["PDY2"] * dfz) * (1 - self["PDY3"] * lean**2)
            friction = friction * (1 + self["PPY3"] * dpi + self["PPY4"] * dpi**2)
        peak, shape = friction * self["LMUY"] * load, self["PCY1"] * self["LCY"]
        across = (self["PHY1"] + self["PHY2"] * dfz) * self["LHY"]
        up = load * (self["PVY1"] + self["PVY2"] * dfz) * self["LVY"] * self["LMUY"]
        up_by_camber = load * (self["PVY3"] + self["PVY4"] * dfz) * lean * self["LMUY"] * self["LKYC"]
        if new:
            across = across + (by_camber * lean - up_by_camber) / slope
        elif self.old:
            across = across + self["PHY3"] * lean
        x, up = slip + across, up + up_by_camber
        curvature = self["PEY1"] + self["PEY2"] * (lean**2 if motorcycle else dfz)
        sign = np.sign(x)
        if motorcycle:
            curvature = curvature + (self["PEY3"] + self["PEY4"] * lean) * sign
        else:
            curvature = curvature * (1 + self["PEY5"] * lean**2 - (self["PEY3"] + self["PEY4"] * lean) * sign)
        angle = _angle(slope / (shape * peak) * x, shape, np.minimum(curvature * self["LEY"], 1))
        if motorcycle:  # camber stands inside the formula
            shape = self["PCY2"] * self["LCC"]
            angle = angle + _angle(by_camber / (shape * peak) * lean, shape, self["PEY5"])
        return _Force(peak * np.sin(angle) + up, slip, x + up / slope, slope, peak)

    @property
    def change_by_shifts(self) -> tuple[float, float]:
        """Relative change of C_alpha and of the moment of camber by the shifts of the curve; NaN without a curve."""
        at = {"load": np.array([self.nominal_load]), "pressure": np.array([self["NOMPRES"]])}
        shifts = ("PHY1", "PHY2", "PVY1", "PVY2", "QHZ1", "QHZ2", "QDZ6", "QDZ7")
        straight, changes = replace(self, values={k: v for k, v in self.values.items() if k not in shifts}), []
        for curve, angle in (("lateral_force", "slip_angle"), ("aligning_moment", "camber")):
            slopes = []
            for law in (self, straight):
                try:
                    ends = [getattr(law, curve)(**{"slip_angle": 0.0, angle: step}, **at)[0] for step in (1e-5, -1e-5)]
                except InputError:
                    ends = [nan, nan]
                slopes.append(ends[0] - ends[1])
            changes.append(slopes[0] / slopes[1] - 1 if slopes[1] else nan)
        return changes[0], changes[1]


@dataclass(frozen=True)
class _Force:
    """A lateral force in the axes of the file, and what the moment takes from it."""

    value: Array  # N, the lateral force
    slip: Array  # rad; its tangent under 6.1
    away: Array  # slip from where the lateral force is zero
    slope: Array  # N/rad, at zero slip
    peak: Array  # N, D of the formula


def _angle(reduced_slip: Array, shape: float, curvature: ArrayLike) -> Array:
    """C atan[u - E (u - atan u)]."""
    bent = reduced_slip - np.asarray(curvature) * (reduced_slip - np.arctan(reduced_slip))
    return np.asarray(shape * np.arctan(bent))
