"""A tyre as a bicycle sees it: stiffnesses and relaxation length at a load and pressure, with their covariance."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.units import GRAVITY, PASCAL_PER_BAR
from tyre.measured.tables import CommonCalibration


@dataclass(frozen=True)
class Estimate:
    """One value, its standard uncertainty and the effective degrees of freedom behind that uncertainty."""

    value: float  # in any unit
    sd: float  # standard uncertainty, in the unit of the value
    dof: float = np.inf  # effective ones behind ``sd``; infinite: it is known exactly

    @property
    def ci95(self) -> tuple[float, float]:
        """Lower and upper end of the 95 % interval."""
        from scipy.special import stdtrit  # costs more than the rest of `import tyre`

        half = float(stdtrit(self.dof, 0.975)) * self.sd
        return self.value - half, self.value + half

    def covers(self, truth: float) -> bool:
        """True if the 95 % interval holds a value."""
        low, high = self.ci95
        return low <= truth <= high

    def scaled(self, factor: float) -> "Estimate":
        """Convert to another unit."""
        return Estimate(factor * self.value, abs(factor) * self.sd, self.dof)

    def as_json(self) -> dict[str, object]:
        """``{"value", "sd", "ci95": [lo, hi]}``."""
        return {"value": self.value, "sd": self.sd, "ci95": list(self.ci95)}


def combine_uncertainties(parts: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Root sum of squares of independent parts, with the Welch-Satterthwaite degrees of freedom."""
    total = float(np.sqrt(sum(sd**2 for sd, _ in parts)))
    spent = sum(sd**4 / dof for sd, dof in parts if np.isfinite(dof))
    return total, (np.inf if spent == 0.0 else max(1.0, total**4 / spent))


# degrees of freedom of a stated repeatability: of an sd reliable to 25 %, (1/2) 0.25^-2 (JCGM 100:2008, G.4.2)
REPEATABILITY_DOF = 8.0


def weighed_scatter(stated_sd: float, squares: float, repeats: float) -> tuple[float, float]:
    """Standard deviation of one recording from what is stated and from repeats, with its degrees of freedom.

    sd^2 = (nu0 s0^2 + nu s^2) / (nu0 + nu), for the stated s0 that counts nu0 = :data:`REPEATABILITY_DOF` and the
    scatter s of repeats with nu degrees of freedom: the scaled inverse chi^2 prior after the data (Gelman et al.,
    *Bayesian Data Analysis*, 3rd ed., section 2.6). Repeats that refute the stated one (F test, p < 0.05) stand alone.
    """
    from scipy.special import fdtrc

    if stated_sd == 0.0 or fdtrc(repeats, REPEATABILITY_DOF, squares / repeats / stated_sd**2) < 0.05:
        return float(np.sqrt(squares / repeats)), repeats
    dof = REPEATABILITY_DOF + repeats
    return float(np.sqrt((REPEATABILITY_DOF * stated_sd**2 + squares) / dof)), dof


@dataclass(frozen=True)
class Calibration(CommonCalibration):
    """Relative standard uncertainties that the rig's certificates leave, common to a whole campaign."""

    force: float = 0.003  # gain of the lateral force cell; 0.003 is 0.3 %
    slip: float = 0.003  # gain of the slip-angle sensor
    displacement: float = 0.002  # gain of the dial gauges
    repeatability: float = 0.01  # of a stiffness from one recording to the next

    def estimate(self, value: float, fit_sd: float, dof: float, sensor: float) -> Estimate:
        """A fitted value with its repeatability, and the gains of the load cell and of another sensor, in its sd."""
        gains = float(np.hypot(self.force, sensor)) * value
        parts = [(fit_sd, dof), (self.repeatability * value, REPEATABILITY_DOF), (gains, np.inf)]
        return Estimate(value, *combine_uncertainties(parts))


Origin = Literal["measured", "interpolated", "extrapolated"]


@dataclass(frozen=True, eq=False)
class TyreProperties:
    """Linear lateral force properties of one tyre at one load and pressure, with covariance.

    Attributes
    ----------
    tyre, surface : str
        Name of the tyre; ``flat`` or ``drum``.
    load : float
        Vertical load, N.
    pressure : float
        Inflation pressure, Pa; NaN of a tyre that has none.
    cornering_stiffness : float
        C_alpha = dFy/d(alpha) at zero slip, N/rad.
    lateral_stiffness : float
        K_y = dFy/d(lateral tyre deflection), N/m; NaN where the source holds none.
    relaxation_length : float
        C_alpha / K_y, m (Dell'Orto et al., eq. 3).
    covariance : ndarray, shape (3, 3)
        Of (cornering stiffness, lateral stiffness, relaxation length), SI units.
    origin : {"measured", "interpolated", "extrapolated"}
        How the values came about at this load and pressure.
    lateral_stiffness_origin : str
        How the lateral stiffness of the table came about where no lateral stiffness test on this surface measured it.
    synthetic : bool
        True where no rig measured the tyre.
    cornering_stiffness_sd_stated : bool
        False where the source states none.
    lateral_stiffness_sd_stated : bool
        The same of the lateral stiffness, and so of the relaxation length.
    unstated_sd_assumed : bool
        True where an assumed one is in the covariance in place of one that is not stated.
    surface_stated : bool
        False where the source names no surface and a flat one is taken.
    notes : tuple of str
        What a reader of a result must know (an assumption, a borrowed stiffness, a misfit).
    degrees_of_freedom : ndarray, shape (3,), or None
        Behind the variances of (cornering stiffness, lateral stiffness, relaxation length), infinite where they are
        known well; None where the source states none.
    pneumatic_trail, pneumatic_trail_sd : float or None
        t = -dMz/dFy at zero slip without camber, and one standard deviation, m; None where not known, as below.
    direct_relaxation_lengths : mapping of str to Estimate
        Relaxation length by other routes than C_alpha / K_y, by the name of the route, m.
    camber_stiffness : float or None
        C_gamma = dFy/d(camber) at zero slip, N/rad, > 0 where a lean to the right pushes to the right.
    twisting_stiffness : float or None
        dMz/d(camber) without the moment -t Fy of the camber force, N m/rad, > 0 into the lean.
    overturning_stiffness : float or None
        -dMx/d(camber) about the point where wheel plane and ground meet, without lateral force, N m/rad, > 0 where the
        load moves towards the lean.
    """

    tyre: str
    surface: str
    load: float
    pressure: float
    cornering_stiffness: float
    lateral_stiffness: float
    relaxation_length: float
    covariance: NDArray[np.float64] = field(repr=False)
    origin: Origin
    notes: tuple[str, ...] = ()
    lateral_stiffness_origin: str = "measured"
    synthetic: bool = False
    cornering_stiffness_sd_stated: bool = True
    degrees_of_freedom: NDArray[np.float64] | None = None
    lateral_stiffness_sd_stated: bool = True
    unstated_sd_assumed: bool = False
    pneumatic_trail: float | None = None
    pneumatic_trail_sd: float | None = None
    direct_relaxation_lengths: Mapping[str, Estimate] = field(default_factory=dict)
    camber_stiffness: float | None = None
    twisting_stiffness: float | None = None
    overturning_stiffness: float | None = None
    surface_stated: bool = True

    @property
    def aligning_stiffness(self) -> float | None:
        """C_M = -dMz/d(slip) = t C_alpha at zero slip, N m/rad; None where the trail is not known."""
        return None if self.pneumatic_trail is None else self.pneumatic_trail * self.cornering_stiffness

    @property
    def crown_radius(self) -> float | None:
        """Radius (m) of a round tread on which the load moves as the overturning moment says; None where not known."""
        return None if self.overturning_stiffness is None else self.overturning_stiffness / self.load

    @property
    def inside(self) -> bool:
        """False where the values are extrapolated beyond the measured loads or pressures."""
        return self.origin != "extrapolated"

    @property
    def cornering_stiffness_sd(self) -> float:
        """One standard deviation of C_alpha, N/rad; NaN if it is neither stated nor assumed."""
        return self._sd(0, stated=self.cornering_stiffness_sd_stated)

    @property
    def lateral_stiffness_sd(self) -> float:
        """One standard deviation of K_y, N/m; NaN if it is neither stated nor assumed."""
        return self._sd(1, stated=self.lateral_stiffness_sd_stated)

    @property
    def relaxation_length_sd(self) -> float:
        """One standard deviation of the relaxation length, m; NaN as that of K_y is."""
        return math.nan if math.isnan(self.lateral_stiffness_sd) else float(np.sqrt(self.covariance[2, 2]))

    def _sd(self, place: int, *, stated: bool) -> float:
        """Standard deviation of a stiffness by its ``place`` in the covariance, which may hold that of a law alone."""
        return math.sqrt(self.covariance[place, place]) if stated or self.unstated_sd_assumed else math.nan


# fields of `TyreProperties` that a tyre may hold beside its stiffnesses, and the properties that follow from them
MEASURED_BESIDE = ("pneumatic_trail", "camber_stiffness", "twisting_stiffness", "overturning_stiffness")
FOLLOWS_FROM = {"aligning_stiffness": "pneumatic_trail", "crown_radius": "overturning_stiffness"}
QUANTITIES = ("cornering_stiffness", "lateral_stiffness", "relaxation_length")  # in the order of every covariance


def parameters_of_effects(values: Mapping[str, Any], *, load: Any) -> dict[str, Any]:
    """Add the properties of `TyreProperties` that follow from its fields, as far as those are there."""
    parameters = dict(values)
    if "pneumatic_trail" in values:
        parameters["aligning_stiffness"] = values["pneumatic_trail"] * values["cornering_stiffness"]
    if "overturning_stiffness" in values:
        parameters["crown_radius"] = values["overturning_stiffness"] / load
    return parameters


def stiffness_note(relative_sd: float, quantity: str = "cornering") -> str:
    """Return the note on a source that states no uncertainty of a stiffness, for the assumed ``relative_sd``."""
    assumption = "none is assumed, so it is treated as exact where it was measured"
    if relative_sd:
        assumption = "assumed: {:g} % (one standard uncertainty)"
    return UNSTATED.format(quantity) + assumption.format(100 * relative_sd)


UNSTATED = "the source states no uncertainty of the {} stiffness; "


@dataclass(frozen=True, eq=False)
class JointCovariance:
    """Covariance of numbers whose errors are correlated, as those of one measured tyre do."""

    names: tuple[str, ...] = ()  # p of them
    matrix: Array = field(default_factory=lambda: np.zeros((0, 0)))  # (p, p), SI units
    # (p, p), parts Q of the covariance that were estimated each by itself, over the root of their degrees of
    # freedom: the variance g' S g of a result with gradient g has (g' S g)^2 / sum (g' Q g)^2 degrees of freedom
    variance_spread: tuple[Array, ...] = ()

    def __post_init__(self) -> None:
        size = len(self.names)
        if len(set(self.names)) < size:
            raise InputError(f"covariance of {', '.join(self.names)}: a parameter is given twice; keep one")
        for matrix in (self.matrix, *self.variance_spread):
            if np.shape(matrix) != (size, size):
                raise InputError(
                    f"covariance of {', '.join(self.names) or 'no parameter'} has the shape {np.shape(matrix)}; "
                    f"it must be {size} x {size}"
                )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, JointCovariance) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    @property
    def _content(self) -> tuple[object, ...]:
        matrices = (self.matrix, *self.variance_spread)
        return (self.names, *(tuple(np.asarray(matrix, float).ravel().tolist()) for matrix in matrices))

    @property
    def sd(self) -> dict[str, float]:
        """One standard deviation of each."""
        return dict(zip(self.names, np.sqrt(np.diag(self.matrix)).tolist(), strict=True))

    def among(self, names: Sequence[str]) -> Array:
        """The covariance among other numbers, zero for those it says nothing of, shape (q, q)."""
        return self._submatrix(self.matrix, names)

    def _submatrix(self, matrix: Array, names: Sequence[str]) -> Array:
        places = [self.names.index(name) if name in self.names else -1 for name in names]
        whole = np.zeros((len(self.names) + 1,) * 2)  # the last row is that of all others
        whole[:-1, :-1] = matrix
        return whole[np.ix_(places, places)]

    def degrees_of_freedom(self, names: Sequence[str], gradient: ArrayLike, covariance: Array) -> float:
        """Effective ones behind the variance g' S g of a result (Welch-Satterthwaite; JCGM 100:2008, G.2b), >= 1."""
        g = np.asarray(gradient, float)
        spent = sum(float(g @ self._submatrix(part, names) @ g) ** 2 for part in self.variance_spread)
        return max(1.0, float(g @ covariance @ g) ** 2 / spent) if spent > 0.0 else np.inf

    def dof(self, name: str) -> float:
        """Effective degrees of freedom behind one standard deviation."""
        return self.degrees_of_freedom([name], [1.0], self.among([name]))

    def renamed(self, names: Mapping[str, str]) -> "JointCovariance":
        """Part of the covariance under other names (own name -> new one)."""
        own_names = tuple(names)
        spread = tuple(self._submatrix(part, own_names) for part in self.variance_spread)
        return JointCovariance(tuple(names.values()), self.among(own_names), spread)

    def and_also(self, other: "JointCovariance") -> Self:
        """This and the covariance of numbers that have nothing in common with it."""
        names = (*self.names, *other.names)
        spread = tuple(
            covariance._submatrix(part, names) for covariance in (self, other) for part in covariance.variance_spread
        )
        return replace(self, names=names, matrix=self.among(names) + other.among(names), variance_spread=spread)


@dataclass(frozen=True, eq=False)
class JointProperties:
    """Properties at n conditions with their joint covariance."""

    properties: tuple[TyreProperties, ...]  # in the order asked for
    # of QUANTITIES and measured trails at each, as ``cornering_stiffness.0`` of the first condition
    joint: JointCovariance

    @property
    def covariance(self) -> Array:
        """Covariance of (C_alpha, K_y, relaxation length) of each, SI units, shape (3 n, 3 n)."""
        return self.joint.among(stiffness_names(range(len(self.properties))))


def stiffness_names(rows: Iterable[int]) -> tuple[str, ...]:
    """Names of the QUANTITIES of conditions in their joint covariance."""
    return tuple(f"{quantity}.{row}" for row in rows for quantity in QUANTITIES)


class TyreSource(ABC):
    """A tyre on one surface, to be asked at any load and pressure.

    Attributes
    ----------
    tyre, surface : str
        Its name; ``flat`` or ``drum``.
    label : str
        ``tyre on surface``, for messages.
    description, source : str
        What it is, and where its numbers come from.
    notes : tuple of str
        What a reader of any value must know.
    synthetic : bool
        True where no rig measured it.
    width : float or None
        m.
    loads, pressures : ndarray
        Conditions worth looking at, N and Pa, ascending.
    load_range, pressure_range : (float, float)
        Where it holds, N and Pa; (0, inf) where that is not stated.
    range_kind : str
        What the ranges are, in words that follow them: ``at which Tyre1 on flat was measured``.
    surface_stated : bool
        False where its source names no surface and a flat one is taken.
    default_pressure : float or None
        Pressure (Pa) where none is given: the only one at which it holds, NaN if none is stated; None if it matters.
    """

    tyre: str
    surface: str
    label: str
    description: str
    source: str
    notes: tuple[str, ...]
    synthetic: bool
    width: float | None
    loads: Array
    pressures: Array
    load_range: tuple[float, float]
    pressure_range: tuple[float, float]
    range_kind: str
    surface_stated: bool = True
    default_pressure: float | None = None

    def at(self, *, load: float, pressure: float | None = None, extrapolate: bool = False) -> TyreProperties:
        """Return the properties at one vertical load and inflation pressure.

        Parameters
        ----------
        load, pressure : float
            N and Pa; the pressure may be left out where it changes nothing (``default_pressure``).
        extrapolate : bool
            Allow a load or pressure more than one range width outside its range.

        Raises
        ------
        InputError
            A condition so far outside, with the unit that may have been meant, or one at which the tyre says nothing.
        """
        pressure = self.default_pressure if pressure is None else pressure
        if pressure is None:
            raise InputError(f"{self.label}: give a pressure (Pa), {stated_range(self)} {self.range_kind}")
        properties = self.jointly([(load, pressure)]).properties[0]
        refusal = None if extrapolate else out_of_reach(self, load=load, pressure=pressure)
        low, high = POSSIBLE_PRESSURE
        if refusal is None and not extrapolate and not low <= pressure <= high and pressure == pressure:
            refusal = f"a pressure of {pressure:g} Pa is no tyre's"
        if refusal is None:
            return properties
        condition = (("pressure", pressure, "Pa", PRESSURE_SLIPS), ("load", load, "N", LOAD_SLIPS))
        meant = [
            f"is the {name} in {unit}? give {value * factor:g} {si}"
            for name, value, si, slips in condition
            for unit, factor in slips
            if _usual(self, name, value * factor) and not _usual(self, name, value)
        ]
        raise InputError(f"{self.label}: {'; '.join([refusal, *meant[:1]])}; extrapolate=True takes it as it is")

    def joint(self, conditions: Sequence[tuple[float, float]]) -> tuple[tuple[TyreProperties, ...], Array]:
        """Return the properties at ``conditions`` (load N, pressure Pa) and their covariance, (3 n, 3 n)."""
        joint = self.jointly(conditions)
        return joint.properties, joint.covariance

    @abstractmethod
    def jointly(self, conditions: Sequence[tuple[float, float]]) -> JointProperties:
        """Return the properties at ``conditions`` (load N, pressure Pa), with their joint covariance."""

    def origin(self, *, load: float, pressure: float) -> Origin:
        """Return how values come about at a ``load`` (N) and ``pressure`` (Pa)."""
        for value, (low, high) in ((load, self.load_range), (pressure, self.pressure_range)):
            if value < low * (1 - 1e-9) or value > high * (1 + 1e-9):
                return "extrapolated"
        return "interpolated"

    def _columns(self, conditions: Sequence[tuple[float, float]]) -> tuple[Array, Array]:
        """Loads (N) and pressures (Pa) of ``conditions``, each finite, positive and covered by the tyre."""
        if not conditions:
            raise InputError(f"{self.label}: no condition asked for; give at least one (load N, pressure Pa).")
        for load, pressure in conditions:
            for name, value, unit in (("load", load, "N"), ("pressure", pressure, "Pa")):
                free = name == "pressure" and np.isnan(value) and self.default_pressure is not None
                if not (np.isfinite(value) and value > 0) and not free:
                    raise InputError(f"{self.label}: {name} is {value:g} {unit}; it must be finite and > 0.")
        load, pressure = np.array(conditions, dtype=np.float64).T
        if self.pressures.size == 1:
            (only,) = self.pressures
            pressure = np.where(np.abs(pressure - only) <= SAME_PRESSURE * only, only, pressure)
        for one_load, one_pressure in zip(load.tolist(), pressure.tolist(), strict=True):
            self._refuse(one_load, one_pressure)
        return load, pressure

    def _refuse(self, load: float, pressure: float) -> None:  # noqa: B027 (most tyres refuse none)
        """Refuse a condition of which the tyre says nothing."""

    @abstractmethod
    def linear(self, *, load: Array, pressure: Array) -> Mapping[str, Array]:
        """Values by the name of a field of `TyreProperties`, for ``load`` (N) and ``pressure`` (Pa), (n,) each.

        The conditions are not checked. Quantities that the tyre does not hold are left out.
        """

    @abstractmethod
    def assuming(self, relative_sd: float, /) -> Self:
        """Return the same tyre with ``relative_sd`` as standard deviation wherever its source states none."""


SAME_PRESSURE = 0.02  # a rig sets a pressure within this share: a tyre of one pressure has it there
POSSIBLE_PRESSURE = (0.2e5, 25e5)  # Pa, of a tyre
PRESSURE_SLIPS = (("bar", PASCAL_PER_BAR), ("kPa", 1e3), ("psi", 6894.757293168))
LOAD_SLIPS = (("kg", GRAVITY), ("kN", 1e3))


def _usual(tyre: TyreSource, name: str, value: float) -> bool:
    """True if a tyre is valid at this load or pressure; without a stated range, if a tyre can have it."""
    low, high = tyre.load_range if name == "load" else tyre.pressure_range
    least, most = POSSIBLE_PRESSURE if name == "pressure" else (0.0, np.inf)
    return bool(max(low, least) * 0.5 <= value <= min(high, most) * 2)


def stated_range(tyre: TyreSource) -> str:
    """The loads and pressures where a tyre holds, for messages."""
    ends = (*tyre.load_range, *(end / PASCAL_PER_BAR for end in tyre.pressure_range))
    return "{:g}-{:g} N and {:g}-{:g} bar".format(*ends)


def out_of_reach(tyre: TyreSource, *, load: float, pressure: float) -> str | None:
    """Name which of load and pressure lies more than one range width outside the range where a tyre holds."""
    bars = tuple(end / PASCAL_PER_BAR for end in tyre.pressure_range)
    for value, (low, high), unit in ((load, tyre.load_range, "N"), (pressure / PASCAL_PER_BAR, bars, "bar")):
        outside = max(low - value, value - high)
        if low < high and outside > (high - low) * (1 + 1e-9):  # of a single one the tyre says nothing anyway
            reach = f"{low:g}-{high:g} {unit} {tyre.range_kind}"
            return f"{value:.4g} {unit} is more than one range width outside the {reach}"
    return None


def wheel_properties(tyres: Sequence[TyreSource], conditions: Sequence[tuple[float, float]]) -> JointProperties:
    """Properties of the tyre of each wheel; what wheels with one tyre have in common is in their covariance."""
    if len({(tyre.tyre, tyre.surface) for tyre in tyres}) == 1:
        return tyres[0].jointly(conditions)
    parts = [tyre.jointly([at]) for tyre, at in zip(tyres, conditions, strict=True)]
    joint = JointCovariance()  # the errors of different tyres have nothing in common
    for row, part in enumerate(parts):
        joint = joint.and_also(
            part.joint.renamed({name: f"{name.removesuffix('0')}{row}" for name in part.joint.names})
        )
    return JointProperties(tuple(part.properties[0] for part in parts), joint)
