"""Published Pacejka-89 fits as tyres: side force and aligning moment over slip, load and pressure, with sanity checks.

Magic Formula of Bakker, Pacejka & Lidner (SAE 890087) in the coefficient order of mechmotum/Magic-Formula-89: vertical
load Fz in kN, slip and camber in degrees (old sets: slip in rad), X = slip + Sh,
Y = D sin{C atan[B X - E (B X - atan(B X))]} + Sv with B = BCD / (C D). Signs are adapted SAE: side force grows with
slip, the aligning moment falls.
"""

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tyre.base.errors import InputError
from tyre.base.paths import data_root

KIND = "pacejka89"
_DEGREE = np.pi / 180.0
_SLIP_UNITS = {"deg": _DEGREE, "rad": 1.0}
_LATERAL, _ALIGNING = 14, 18
_KEYS = {"kind", "tyre", "surface", "load_max_N", "slip_unit", "source", "licence", "note", "set"}
_SET_KEYS = {"pressure_kPa", "label", "side_force", "aligning_moment"}
# limits of check_coefficients, far beyond what is measured: C/Fz is 0.2 to 0.3 per degree in Dell'Orto et al.
_STIFFNESS_PER_LOAD = (0.03, 1.0)
_LARGEST_FRICTION = 1.5
_TRAIL = (0.0, 0.1)
_CHECK_SLIPS = np.array([-10.0, -4.0, 4.0, 10.0]) * _DEGREE
_CHECK_LOADS = (200.0, 300.0, 400.0, 600.0, 800.0, 1000.0)

Values = NDArray[np.float64]


@dataclass(frozen=True)
class _Formula:
    """Magic Formula at one load and camber, in the units of the coefficients."""

    shape: Values
    peak: Values
    slope: Values
    curvature: Values
    shift: Values
    offset: Values

    def value(self, slip: Values) -> Values:
        x = self._stretched(slip)
        return self.peak * np.sin(self.shape * np.arctan(x - self.curvature * (x - np.arctan(x)))) + self.offset

    def gradient(self, slip: Values) -> Values:
        x = self._stretched(slip)
        inner = x - self.curvature * (x - np.arctan(x))
        inner_slope = 1.0 - self.curvature * x**2 / (1.0 + x**2)
        return self.slope * np.cos(self.shape * np.arctan(inner)) * inner_slope / (1.0 + inner**2)

    def _stretched(self, slip: Values) -> Values:
        return self.slope / (self.shape * self.peak) * (slip + self.shift)


@dataclass(frozen=True)
class Pacejka89:
    """One fit: a tyre at one inflation pressure.

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
    """

    label: str
    pressure: float
    load_max: float
    side_force_coefficients: tuple[float, ...]
    aligning_moment_coefficients: tuple[float, ...] | None = None
    slip_unit: str = "deg"

    def side_force(self, *, slip_angle: ArrayLike, load: ArrayLike, camber: ArrayLike = 0.0) -> Values:
        """Side force, N, shape of the broadcast arguments (rad, N, rad; > 0 to the right)."""
        return self._lateral(load, camber).value(self._slip(slip_angle))

    def aligning_moment(self, *, slip_angle: ArrayLike, load: ArrayLike, camber: ArrayLike = 0.0) -> Values:
        """Aligning moment, N m, shape of the broadcast arguments; negative for positive slip at a positive trail."""
        return self._aligning(load, camber).value(self._slip(slip_angle))

    def cornering_stiffness(self, *, load: ArrayLike, camber: ArrayLike = 0.0) -> Values:
        """Slope of the side force at zero slip, N/rad (BCD is its value at X = 0, up to 2 % larger in these sets)."""
        return self._lateral(load, camber).gradient(np.asarray(0.0)) / _SLIP_UNITS[self.slip_unit]

    def aligning_stiffness(self, *, load: ArrayLike, camber: ArrayLike = 0.0) -> Values:
        """C_M = -dMz/d(slip) at zero slip, N m/rad, > 0 for a tyre that turns back."""
        return -self._aligning(load, camber).gradient(np.asarray(0.0)) / _SLIP_UNITS[self.slip_unit]

    def pneumatic_trail(self, *, load: ArrayLike) -> Values:
        """Trail t = C_M / C_Fy of small slip, m."""
        return self.aligning_stiffness(load=load) / self.cornering_stiffness(load=load)

    def camber_stiffness(self, *, load: ArrayLike) -> Values:
        """Slope of the side force over camber at zero slip and camber, N/rad, mean of both sides."""
        a, fz = self.side_force_coefficients, self._kilonewton(load)
        per_degree = self._lateral(load, 0.0).gradient(np.asarray(0.0)) * a[8] + a[11] * fz
        return per_degree / _DEGREE

    def _slip(self, slip_angle: ArrayLike) -> Values:
        return np.asarray(slip_angle, dtype=np.float64) / _SLIP_UNITS[self.slip_unit]

    def _kilonewton(self, load: ArrayLike) -> Values:
        force = np.asarray(load, dtype=np.float64)
        if not ((force > 0.0) & (force <= self.load_max)).all():
            raise InputError(
                f"{self.label}: load of {np.min(force):g} to {np.max(force):g} N is outside of the fit, which holds "
                f"above 0 and up to {self.load_max:g} N"
            )
        return force / 1e3

    def _lateral(self, load: ArrayLike, camber: ArrayLike) -> _Formula:
        a, fz = self.side_force_coefficients, self._kilonewton(load)
        lean = np.asarray(camber, dtype=np.float64) / _DEGREE
        return _Formula(
            shape=np.asarray(a[0]),
            peak=a[1] * fz**2 + a[2] * fz,
            slope=a[3] * np.sin(2.0 * np.arctan(fz / a[4])) * (1.0 - a[5] * np.abs(lean)),
            curvature=a[6] * fz + a[7],
            shift=a[8] * lean + a[9] * fz + a[10],
            offset=a[11] * fz * lean + a[12] * fz + a[13],
        )

    def _aligning(self, load: ArrayLike, camber: ArrayLike) -> _Formula:
        if self.aligning_moment_coefficients is None:
            raise InputError(f"{self.label}: the set has no aligning moment")
        c, fz = self.aligning_moment_coefficients, self._kilonewton(load)
        lean = np.asarray(camber, dtype=np.float64) / _DEGREE
        return _Formula(
            shape=np.asarray(c[0]),
            peak=c[1] * fz**2 + c[2] * fz,
            slope=(c[3] * fz**2 + c[4] * fz) * (1.0 - c[6] * np.abs(lean)) * np.exp(-c[5] * fz),
            curvature=(c[7] * fz**2 + c[8] * fz + c[9]) * (1.0 - c[10] * np.abs(lean)),
            shift=c[11] * lean + c[12] * fz + c[13],
            offset=(c[14] * fz**2 + c[15] * fz) * lean + c[16] * fz + c[17],
        )


@dataclass(frozen=True)
class Pacejka89Tyre:
    """A tyre fitted at several pressures; between them values are linear in pressure, beyond them refused."""

    tyre: str
    surface: str
    sets: tuple[Pacejka89, ...]
    source: str
    notes: tuple[str, ...] = ()

    def side_force(self, *, slip_angle: ArrayLike, load: ArrayLike, pressure: float, camber: ArrayLike = 0.0) -> Values:
        """Side force, N, at slip (rad), load (N), pressure (Pa) and camber (rad)."""
        return self._at(pressure, lambda fit: fit.side_force(slip_angle=slip_angle, load=load, camber=camber))

    def aligning_moment(
        self, *, slip_angle: ArrayLike, load: ArrayLike, pressure: float, camber: ArrayLike = 0.0
    ) -> Values:
        """Aligning moment, N m."""
        return self._at(pressure, lambda fit: fit.aligning_moment(slip_angle=slip_angle, load=load, camber=camber))

    def cornering_stiffness(self, *, load: ArrayLike, pressure: float) -> Values:
        """Slope of the side force at zero slip, N/rad."""
        return self._at(pressure, lambda fit: fit.cornering_stiffness(load=load))

    def aligning_stiffness(self, *, load: ArrayLike, pressure: float) -> Values:
        """C_M = -dMz/d(slip) at zero slip, N m/rad."""
        return self._at(pressure, lambda fit: fit.aligning_stiffness(load=load))

    def pneumatic_trail(self, *, load: ArrayLike, pressure: float) -> Values:
        """C_M / C_Fy, m."""
        return self.aligning_stiffness(load=load, pressure=pressure) / self.cornering_stiffness(
            load=load, pressure=pressure
        )

    def camber_stiffness(self, *, load: ArrayLike, pressure: float) -> Values:
        """Slope of the side force over camber, N/rad."""
        return self._at(pressure, lambda fit: fit.camber_stiffness(load=load))

    def _at(self, pressure: float, evaluate: Callable[[Pacejka89], Values]) -> Values:
        pressures = np.array([fit.pressure for fit in self.sets])
        if not pressures[0] <= pressure <= pressures[-1]:
            raise InputError(
                f"{self.tyre}: pressure {pressure / 1e5:g} bar is outside of the fitted {pressures[0] / 1e5:g} to "
                f"{pressures[-1] / 1e5:g} bar"
            )
        upper = int(np.searchsorted(pressures, pressure))
        if pressures[upper] == pressure:
            return evaluate(self.sets[upper])
        share = (pressure - pressures[upper - 1]) / (pressures[upper] - pressures[upper - 1])
        return (1.0 - share) * evaluate(self.sets[upper - 1]) + share * evaluate(self.sets[upper])


def check_coefficients(fit: Pacejka89) -> None:
    """Refuse a set that describes no tyre, such as a fit broken off half way.

    Looks at loads of 200 to 1000 N (as far as the set goes): cornering stiffness over load, sign of the side force at
    4 degrees, side force over load up to 10 degrees, and the pneumatic trail.

    Raises
    ------
    InputError
        Naming the load, the value and the allowed range.
    """
    for load in (force for force in _CHECK_LOADS if force <= fit.load_max):
        stiffness = float(fit.cornering_stiffness(load=load)) * _DEGREE
        lowest, highest = (limit * load for limit in _STIFFNESS_PER_LOAD)
        if not lowest <= stiffness <= highest:
            raise InputError(
                f"{fit.label}: cornering stiffness at {load:g} N is {stiffness:.4g} N/deg, a tyre has {lowest:g} to "
                f"{highest:g} N/deg; the fit is not usable"
            )
        forces = fit.side_force(slip_angle=_CHECK_SLIPS, load=load)
        if not (forces[1] < 0.0 < forces[2]):
            raise InputError(
                f"{fit.label}: side force at {load:g} N is {forces[1]:.4g} N at -4 deg, {forces[2]:.4g} N at +4 deg; "
                "its sign must follow the slip"
            )
        friction = float(np.abs(forces).max()) / load
        if not friction <= _LARGEST_FRICTION:
            raise InputError(
                f"{fit.label}: side force at {load:g} N reaches {friction:.3g} times the load, allowed is "
                f"{_LARGEST_FRICTION:g}"
            )
        if fit.aligning_moment_coefficients is not None:
            trail = float(fit.pneumatic_trail(load=load))
            if not _TRAIL[0] < trail < _TRAIL[1]:
                raise InputError(
                    f"{fit.label}: pneumatic trail at {load:g} N is {trail * 1e3:.3g} mm, allowed are "
                    f"{_TRAIL[0] * 1e3:g} to {_TRAIL[1] * 1e3:g} mm"
                )


def read_pacejka89(source: str | Path | Traversable) -> Pacejka89Tyre:
    """Read a tyre of kind ``pacejka89`` and check its coefficients.

    Parameters
    ----------
    source : str, Path or Traversable
        A TOML file, or the stem of one in ``data/tyres``.

    Returns
    -------
    Pacejka89Tyre

    Raises
    ------
    InputError
        When the file is missing, has unknown or missing keys, or a set fails ``check_coefficients``.
    """
    if isinstance(source, str) and not source.endswith(".toml"):
        source = data_root() / "tyres" / f"{source}.toml"
    file = Path(source) if isinstance(source, str) else source
    try:
        table = tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{source}: cannot be read ({error.strerror})") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{source}: is not valid TOML: {error}") from None
    return _interpret(table, str(source))


def _interpret(table: Mapping[str, Any], where: str) -> Pacejka89Tyre:
    if table.get("kind") != KIND:
        raise InputError(f"{where}: kind = {table.get('kind')!r}, expected {KIND!r}")
    _refuse_keys(table, _KEYS, _KEYS - {"note", "slip_unit"}, where)
    if table.get("slip_unit", "deg") not in _SLIP_UNITS:
        raise InputError(f"{where}: slip_unit = {table['slip_unit']!r} is neither 'deg' nor 'rad'")
    sets = []
    for entry in table["set"]:
        _refuse_keys(entry, _SET_KEYS, _SET_KEYS - {"aligning_moment"}, f"{where}, set")
        aligning = entry.get("aligning_moment")
        fit = Pacejka89(
            label=f"{table['tyre']}, {entry['label']}",
            pressure=entry["pressure_kPa"] * 1e3,
            load_max=float(table["load_max_N"]),
            side_force_coefficients=_numbers(entry["side_force"], _LATERAL, f"{where}, side_force"),
            aligning_moment_coefficients=(
                None if aligning is None else _numbers(aligning, _ALIGNING, f"{where}, aligning_moment")
            ),
            slip_unit=table.get("slip_unit", "deg"),
        )
        check_coefficients(fit)
        sets.append(fit)
    note = table.get("note", [])
    return Pacejka89Tyre(
        tyre=table["tyre"],
        surface=table["surface"],
        sets=tuple(sorted(sets, key=lambda fit: fit.pressure)),
        source=table["source"],
        notes=(note,) if isinstance(note, str) else tuple(note),
    )


def _refuse_keys(table: Mapping[str, Any], known: set[str], required: set[str], where: str) -> None:
    for key in sorted(set(table) - known):
        raise InputError(f"{where}: key {key!r} is unknown (known: {', '.join(sorted(known))})")
    for key in sorted(required - set(table)):
        raise InputError(f"{where}: key {key!r} is missing")


def _numbers(values: Any, count: int, where: str) -> tuple[float, ...]:
    if not isinstance(values, list) or len(values) != count or not all(isinstance(v, int | float) for v in values):
        raise InputError(f"{where}: must be a list of {count} numbers")
    return tuple(float(value) for value in values)
