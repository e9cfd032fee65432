"""Outputs: numbers of a model, each declared once for sweeps, charts, uncertainty and figures.

>>> @output("time_to_half", unit="s", label="Time to half of the slowest motion", source=ROOTS)
... def time_to_half(roots):
...     return np.log(2) / -roots.real.max(-1)
>>> OUTPUTS.pop("time_to_half").unit
's'
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from bicycle.model.eigen import frequency_hz, min_damping_ratio, pair_damping_ratio
from bicycle.model.model import Model
from bicycle.model.model_family import ModelFamily
from bicycle.model.state_space import LinearModel
from bicycle.motion.limit_cycles import find_limit_cycles
from bicycle.stability.critical import CriticalSpeed, critical_speeds_of_many
from bicycle.stability.naming import every_mode, packaged_modes
from bicycle.stability.propagation import damping_ratio_gradient
from bicycle.stability.sensitivity import sensitivities
from studies.model_space.lasting_motions import largest_wobble, motion_at
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError, unknown

ROOTS, MODE, MODEL, PARAMETERS = "roots", "mode", "model", "parameters"
CHANGES = ("destabilising", "stabilising")
OTHER = "other"  # place of the critical speeds of modes without a name
OCCURRENCES = 4  # critical speeds of one mode in one direction
HIGHEST = 60.0  # m/s: at least up to here motions are followed, which may begin above the speeds asked for


@dataclass(frozen=True, eq=False)
class Output:
    """A number of a model."""

    name: str  # key in files
    unit: str  # SI, Hz or deg, in which values are; "1": none
    label: str  # name in figures
    # argument of ``function``: ROOTS, eigenvalues (..., n) in 1/s; MODE, the two roots (...) of a named mode; MODEL,
    # a model, speeds (k,) and the highest speed in m/s; PARAMETERS, none
    source: str
    function: Callable[..., Any]  # gives (...), (...), (k, *dims) or, not by speed, (*dims,)
    by_speed: bool = True  # a value for each speed
    dims: tuple[str, ...] = ()  # further dimensions, labelled by :data:`DIMENSIONS`
    complex_valued: bool = False  # True: values are complex numbers
    reducible: bool = True  # quantiles over samples mean something
    unstable: int = 0  # 1 or -1 if values above or below 0 are unstable, which figures shade
    # derivative of a MODE output from an oscillating root and the root's derivatives; by differences without
    gradient: Callable[[Any, Any], Any] | None = None
    # a MODEL output of many bicycles: its function takes family, parameters, their number and the highest speed in
    # m/s, and gives also why some have none, by place
    at_once: bool = False

    @property
    def scalar(self) -> bool:
        """One real number for each bicycle (and speed)."""
        return not self.dims and not self.complex_valued and self.source in (ROOTS, MODEL)

    @property
    def along(self) -> str:
        """Figure along the speed that shows it: ``stability`` or ``modes``; empty for none."""
        if self.source == MODE:
            return "" if self.complex_valued else "modes"
        return "stability" if self.scalar and self.by_speed else ""

    def of_pair(self, first: Complex, second: Complex) -> Any:
        """Values (any shape) of a MODE output from the two roots of a mode; NaN where it has none."""
        return np.where(np.isnan(first), np.nan, self.function(first, second))

    def of_root(self, root: Any) -> Any:
        """A MODE output from oscillating roots (any shape)."""
        return self.of_pair(root, np.full_like(root, np.nan))

    def root_gradient(self, root: complex, slope: Complex) -> Array:
        """Derivatives (k,) of a MODE output from an oscillating root and its derivatives (k,)."""
        if self.gradient is not None:
            return np.asarray(self.gradient(root, slope))
        h = 1e-6 * abs(root)
        ends = self.of_root(np.array([root + h, root - h, root + 1j * h, root - 1j * h]))
        return np.asarray((ends[0] - ends[1]) * slope.real + (ends[2] - ends[3]) * slope.imag) / (2 * h)

    @property
    def title(self) -> str:
        """Label with the unit, if it has one."""
        return self.label if self.unit == "1" else f"{self.label}, {self.unit}"


OUTPUTS: dict[str, Output] = {}


def output(name: str, *, unit: str, label: str, source: str, **more: Any) -> Callable[[Callable[..., Any]], Any]:
    """Declare a function as an output."""
    if source == MODE:
        more["dims"] = ("mode",)

    def declare(function: Callable[..., Any]) -> Callable[..., Any]:
        OUTPUTS[name] = Output(name, unit, label, source, function, **more)
        return function

    return declare


def scalar_output(name: str) -> Output:
    """The output of a name, if it is one number of a bicycle (at a speed)."""
    output = OUTPUTS.get(name)
    if output is None or not output.scalar:
        raise InputError(unknown("output", name, [declared.name for declared in OUTPUTS.values() if declared.scalar]))
    return output


@output(
    "eigenvalues", unit="1/s", label="Eigenvalues", source=ROOTS, dims=("root",), complex_valued=True, reducible=False
)
def _eigenvalues(roots: Complex) -> Complex:
    return roots


@output("max_growth_rate", unit="1/s", label="Maximum growth rate", source=ROOTS, unstable=1)
def _max_growth_rate(roots: Complex) -> Array:
    return np.asarray(roots.real.max(-1))


output("min_damping_ratio", unit="1", label="Minimum damping ratio", source=ROOTS, unstable=-1)(min_damping_ratio)


@output("modes", unit="1/s", label="Eigenvalue", source=MODE, complex_valued=True, reducible=False)
def _first_root(first: Complex, second: Complex) -> Complex:
    return first


@output("frequencies", unit="Hz", label="frequency", source=MODE, gradient=lambda root, slope: frequency_hz(slope))
def _frequency(first: Complex, second: Complex) -> Array:
    return frequency_hz(first)


output("damping_ratios", unit="1", label="damping ratio", source=MODE, unstable=-1, gradient=damping_ratio_gradient)(
    pair_damping_ratio
)


@output(
    "sensitivities",
    unit="1/s per SI unit of the parameter",
    label="Sensitivity",
    source=MODEL,
    dims=("root", "free_parameter"),
    complex_valued=True,
    reducible=False,
)
def _sensitivities(model: Model, speeds: Array, max_speed: float) -> Complex:
    slopes = sensitivities(model, speeds)
    return np.stack([slopes.of(key) for key in slopes.parameters], -1)


def _table_crossings(modes: Sequence[str], crossings: Sequence[CriticalSpeed], max_speed: float) -> Array:
    names = (*modes, OTHER)
    result = np.full((len(names), len(CHANGES), OCCURRENCES), np.nan)
    for crossing in crossings:
        name = crossing.mode if crossing.mode in names else OTHER
        row = result[names.index(name), CHANGES.index(crossing.direction)]
        free = np.flatnonzero(np.isnan(row))
        if not free.size:
            raise InputError(
                f"{crossing.mode} has more than {OCCURRENCES} {crossing.direction} critical speeds up to "
                f"{max_speed:g} m/s; lower max_speed_m_s"
            )
        row[free[0]] = crossing.speed
    return result


@output(
    "critical_speeds",
    unit="m/s",
    label="Critical speed",
    source=MODEL,
    by_speed=False,
    dims=("crossing_mode", "as_speed_grows", "occurrence"),
    at_once=True,
)
def _critical_speeds(
    family: ModelFamily, values: Mapping[str, Any], count: int, max_speed: float
) -> tuple[Array, dict[int, str]]:
    crossings_of_items, impossible = critical_speeds_of_many(family, values, count, max_speed=max_speed)
    names = mode_names(family.model.linear_model())
    result = np.full((count, len(names) + 1, len(CHANGES), OCCURRENCES), np.nan)
    for number, crossings in enumerate(crossings_of_items):
        try:
            result[number] = _table_crossings(names, crossings, max_speed)
        except InputError as error:
            impossible[number] = str(error)
    return result, impossible


@output("wobble_amplitude", unit="deg", label="Steer amplitude of wobble", source=MODEL)
def _wobble_amplitude(model: Model, speeds: Array, max_speed: float) -> Array:
    cycles = find_limit_cycles(model, max_speed=max(max_speed, HIGHEST))
    return np.array([motion_at(cycles, speed) for speed in np.asarray(speeds).tolist()])


@output("largest_wobble_amplitude", unit="deg", label="Maximum steer amplitude of wobble", source=MODEL, by_speed=False)
def _largest_wobble_amplitude(model: Model, speeds: Array, max_speed: float) -> float:
    return largest_wobble(find_limit_cycles(model, max_speed=max_speed))


@output(
    "parameters",
    unit="SI unit of the parameter",
    label="Parameter",
    source=PARAMETERS,
    by_speed=False,
    dims=("parameter",),
    reducible=False,
)
def _parameters(values: Mapping[str, Any]) -> Mapping[str, Any]:
    return values


def mode_names(linear: LinearModel) -> tuple[str, ...]:
    """Names of modes: those of the package, so that sweeps can be compared, then further ones of the model."""
    packaged = packaged_modes()
    return (*packaged, *(mode.name for mode in every_mode(linear) if mode.name not in packaged))


DIMENSIONS: Mapping[str, Callable[[Model], Sequence[Any]]] = MappingProxyType(
    {
        "root": lambda model: range(model.linear_model().order),
        "free_parameter": lambda model: sensitivities(model, [1.0]).parameters,
        "parameter": lambda model: tuple(model.parameters),
        "mode": lambda model: mode_names(model.linear_model()),
        "crossing_mode": lambda model: (*mode_names(model.linear_model()), OTHER),
        "as_speed_grows": lambda model: CHANGES,
        "occurrence": lambda model: range(1, OCCURRENCES + 1),
    }
)
"""Labels along each further dimension of outputs, of a model."""
