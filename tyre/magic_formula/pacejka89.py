"""One published Pacejka-89 fit: side force and aligning moment of a tyre at one pressure over slip, load and camber.

Magic Formula of Bakker, Pacejka & Lidner (SAE 890087) in the coefficient order of mechmotum/Magic-Formula-89: vertical
load Fz in kN, slip and camber in degrees (old sets: slip in rad), X = slip + Sh, Y = D times the Magic Formula of
B X, plus Sv, with B = BCD / (C D). Signs are adapted SAE: side force grows with slip, the aligning moment falls.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.plausible import LARGEST
from tyre.magic_formula.mf61 import saturation
from tyre.magic_formula.side_force import magic_formula, magic_formula_derivatives

DEGREE = np.pi / 180.0
SLIP_UNITS = {"deg": DEGREE, "rad": 1.0}


@dataclass(frozen=True)
class _Formula:
    """Magic Formula at one load and camber, in the units of the coefficients."""

    shape: Array
    peak: Array
    slope: Array
    curvature: Array
    shift: Array
    offset: Array

    def value(self, slip: Array) -> Array:
        curve = magic_formula(self._reduced(slip), shape_factor=self.shape, curvature_factor=self.curvature)
        return np.asarray(self.peak * curve + self.offset)

    @property
    def gradient(self) -> Array:
        """At zero slip."""
        curve = magic_formula_derivatives(self._reduced(0.0), shape_factor=self.shape, curvature_factor=self.curvature)
        return np.asarray(self.slope / self.shape * curve.by_slip)

    def _reduced(self, slip: Array | float) -> Array:
        return np.asarray(self.slope / (self.shape * self.peak) * (slip + self.shift))


@dataclass(frozen=True)
class Pacejka89:
    """One fit: a tyre at one inflation pressure.

    Loads are in N, above 0 and up to ``load_max``; slip and camber in rad, > 0 a lean to the right
    is positive, a side force to the right too.

    Attributes
    ----------
    label : str
        What the authors call the set.
    pressure : float
        Pa.
    load_max : float
        Largest vertical load (N) for which the authors use the set.
    side_force_coefficients : tuple of float
        a0 ... a13, side force in N.
    aligning_moment_coefficients : tuple of float or None
        c0 ... c17, aligning moment in N m.
    slip_unit : {"deg", "rad"}
        Unit of slip inside the formula.
    lateral_stiffness : float or None
        K_y of a pull test at this pressure, N/m, which no formula of slip holds; None where not known.
    """

    label: str
    pressure: float
    load_max: float
    side_force_coefficients: tuple[float, ...]
    aligning_moment_coefficients: tuple[float, ...] | None = None
    slip_unit: str = "deg"
    lateral_stiffness: float | None = None

    def __post_init__(self) -> None:
        for letter, numbers in (("a", self.side_force_coefficients), ("c", self.aligning_moment_coefficients or ())):
            for place, value in enumerate(numbers):
                if not abs(value) <= LARGEST:
                    raise InputError(
                        f"{self.label}: {letter}{place} = {value:g} must be a number up to {LARGEST:g} in size"
                    )

    def side_force(self, *, slip_angle: ArrayLike, load: ArrayLike, camber: ArrayLike = 0.0) -> Array:
        """Side force.

        Parameters
        ----------
        slip_angle, load, camber : array_like
            rad, N, rad, broadcast.

        Returns
        -------
        ndarray
            N, > 0 to the right.
        """
        return self._lateral(self._checked(load), camber).value(self._slip(slip_angle))

    def aligning_moment(self, *, slip_angle: ArrayLike, load: ArrayLike, camber: ArrayLike = 0.0) -> Array:
        """Aligning moment.

        Parameters
        ----------
        slip_angle, load, camber : array_like
            rad, N, rad, broadcast.

        Returns
        -------
        ndarray
            N m, negative for positive slip at a positive trail.
        """
        return self._aligning(self._checked(load), camber).value(self._slip(slip_angle))

    def cornering_stiffness(self, *, load: ArrayLike, camber: ArrayLike = 0.0) -> Array:
        """Slope of the side force at zero slip (BCD is its value at X = 0, up to 2 % larger in published sets).

        Parameters
        ----------
        load, camber : array_like
            N, rad.

        Returns
        -------
        ndarray
            N/rad.
        """
        return self._lateral(self._checked(load), camber).gradient / SLIP_UNITS[self.slip_unit]

    def aligning_stiffness(self, *, load: ArrayLike, camber: ArrayLike = 0.0) -> Array:
        """C_M = -dMz/d(slip) at zero slip.

        Parameters
        ----------
        load, camber : array_like
            N, rad.

        Returns
        -------
        ndarray
            N m/rad, > 0 for a tyre that turns back.
        """
        return -self._aligning(self._checked(load), camber).gradient / SLIP_UNITS[self.slip_unit]

    def pneumatic_trail(self, *, load: ArrayLike) -> Array:
        """Trail t = C_M / C_Fy of small slip.

        Parameters
        ----------
        load : array_like
            N.

        Returns
        -------
        ndarray
            m.
        """
        return self.aligning_stiffness(load=load) / self.cornering_stiffness(load=load)

    def camber_stiffness(self, *, load: ArrayLike) -> Array:
        """Slope of the side force over camber at zero slip and camber, mean of both sides.

        Parameters
        ----------
        load : array_like
            N.

        Returns
        -------
        ndarray
            N/rad.
        """
        return self.linear(load=self._checked(load) * 1e3)["camber_stiffness"]

    def linear(self, *, load: Array) -> dict[str, Array]:
        """Return what the set holds near straight running; the load is not checked.

        The moment of camber, dMz/d(camber), has a part -t Fy of the camber force; what is beside it is the twisting
        stiffness.

        Parameters
        ----------
        load : ndarray
            N.

        Returns
        -------
        dict of str to ndarray
            By the name of a field of `TyreProperties`, SI units.
        """
        fz, unit = load / 1e3, SLIP_UNITS[self.slip_unit]
        a, lateral = self.side_force_coefficients, self._lateral(load / 1e3, 0.0)
        cornering = lateral.gradient / unit
        camber = (lateral.gradient * a[8] + a[11] * fz) / DEGREE
        held = {"cornering_stiffness": cornering, "camber_stiffness": camber}
        if self.lateral_stiffness is not None:
            held["lateral_stiffness"] = np.full(np.shape(load), self.lateral_stiffness)
            held["relaxation_length"] = cornering / self.lateral_stiffness
        if self.aligning_moment_coefficients is not None:
            c, aligning = self.aligning_moment_coefficients, self._aligning(fz, 0.0)
            held["pneumatic_trail"] = -aligning.gradient / unit / cornering
            by_camber = (aligning.gradient * c[11] + c[14] * fz**2 + c[15] * fz) / DEGREE
            held["twisting_stiffness"] = by_camber + held["pneumatic_trail"] * camber
        return held

    def _slip(self, slip_angle: ArrayLike) -> Array:
        return np.asarray(slip_angle, dtype=np.float64) / SLIP_UNITS[self.slip_unit]

    def _checked(self, load: ArrayLike) -> Array:
        """The load in kN."""
        force = np.asarray(load, dtype=np.float64)
        if not ((force > 0.0) & (force <= self.load_max)).all():
            raise InputError(
                f"{self.label}: load of {np.min(force):g} to {np.max(force):g} N is outside of the fit, which holds "
                f"above 0 and up to {self.load_max:g} N"
            )
        return force / 1e3

    def _lateral(self, fz: Array, camber: ArrayLike) -> _Formula:
        a, lean = self.side_force_coefficients, np.asarray(camber, dtype=np.float64) / DEGREE
        return _Formula(
            shape=np.asarray(a[0]),
            peak=a[1] * fz**2 + a[2] * fz,
            slope=a[3] * saturation(fz / a[4]) * (1.0 - a[5] * np.abs(lean)),
            curvature=a[6] * fz + a[7],
            shift=a[8] * lean + a[9] * fz + a[10],
            offset=a[11] * fz * lean + a[12] * fz + a[13],
        )

    def _aligning(self, fz: Array, camber: ArrayLike) -> _Formula:
        if self.aligning_moment_coefficients is None:
            raise InputError(f"{self.label}: the set has no aligning moment")
        c, lean = self.aligning_moment_coefficients, np.asarray(camber, dtype=np.float64) / DEGREE
        return _Formula(
            shape=np.asarray(c[0]),
            peak=c[1] * fz**2 + c[2] * fz,
            slope=(c[3] * fz**2 + c[4] * fz) * (1.0 - c[6] * np.abs(lean)) * np.exp(-c[5] * fz),
            curvature=(c[7] * fz**2 + c[8] * fz + c[9]) * (1.0 - c[10] * np.abs(lean)),
            shift=c[11] * lean + c[12] * fz + c[13],
            offset=(c[14] * fz**2 + c[15] * fz) * lean + c[16] * fz + c[17],
        )
