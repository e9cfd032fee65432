"""The result of a sweep as figures need it: rows of bicycles, which are possible, and the outputs in it."""

import itertools
import json
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bicycle.effects.effect_registry import effect_class
from bicycle.stability.naming import known_modes
from studies.model_space.axes import unit_of
from studies.model_space.outputs import CHANGES, OTHER, OUTPUTS, ROOTS, Output
from studies.sweep.result import open_data
from studies.sweep.specification import BICYCLE, SAMPLE, SPEED, GridAxis, Normal, Sweep, Uniform
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, refuse_unknown

MOST_BICYCLES = 200_000  # bicycles of a larger sample that are drawn: the first of each cell, as random as the rest

CRITICAL = "critical_speeds"
LABELS = {"mode", "crossing_mode", "as_speed_grows"}  # dimensions whose labels numbers are looked up by


class Stored:
    """A finished sweep: its data set, the sweep as it was computed, what made it then, and what is looked at of it.

    ``possible`` (cells, samples) marks possible bicycles; of a reduced result, which has one sample, it is not known.
    ``speeds`` are m/s, empty if outputs are not given along them; ``whose`` names the bicycles in a title.
    """

    def __init__(self, path: Path, data: Any, sweep: Sweep) -> None:
        self.path, self.data, self.sweep = path, data, sweep
        self.fingerprint, self.made_of = str(data.attrs.get("fingerprint", "")), dict[str, str]()
        with suppress(KeyError, ValueError):
            self.made_of = json.loads(data.attrs["made_of"])
        self.reduced = sweep.quantiles is not None
        self.cells = sweep.items // sweep.samples
        self.samples = 1 if self.reduced else min(sweep.samples, max(MOST_BICYCLES // self.cells, 1))
        self.bicycles = self.cells * self.samples
        self.number = sweep.items if self.reduced else self.bicycles
        self.speeds = np.asarray(sweep.speeds, float) if SPEED in data.dims else np.empty(0)
        all_possible = np.ones((self.cells, self.samples), bool)
        self.possible = self.rows("impossible") == 0 if "impossible" in data else all_possible
        extrapolated = "tyre_extrapolated_above_zero" if self.reduced else "tyre_extrapolated"
        self.extrapolated = int(np.nansum(self.rows(extrapolated))) if extrapolated in data else 0
        only_cell = "the samples" if sweep.samples > 1 else "the bicycle"
        levels = [[_level(axis, value) for value in axis.values] for axis in sweep.axes]
        self.cell_names = [", ".join(words) or only_cell for words in itertools.product(*levels)]
        self.whose = f"{self.bicycles} bicycles" if self.bicycles > 1 else "one bicycle"
        if self.reduced:
            self.whose = f"{sweep.samples} bicycles in each of {self.cells} combinations"
        elif self.bicycles < sweep.items:
            first = f"the first {self.samples} samples of each combination"
            self.whose = f"{self.bicycles} of {sweep.items} bicycles ({first})"
        if sweep.random and self.cells > 1 and not self.reduced:
            self.whose += f", {self.cells} combinations of {', '.join(axis.name for axis in sweep.axes)}"

    def rows(self, name: str, **place: Any) -> Array:
        """A variable (cells, samples, ...) at labels along further dimensions; of a reduced result (cells, 1, ...)."""
        with _refuse_damaged(self.path):
            chosen = self.data[name].sel(**place).isel({SAMPLE: slice(self.samples)}, missing_dims="ignore")
            values = np.asarray(chosen.values)
            outer = len(self.sweep.axes) + (SAMPLE in chosen.dims)
            return values.reshape(self.cells, self.samples, *values.shape[outer:])

    def scalar(self, output: Output) -> Array | None:
        """Values (cells, samples, speeds) of an output of one number; None if the result does not hold it."""
        if output.name not in self.data and not (output.source == ROOTS and "eigenvalues" in self.data):
            return None
        values = self.rows(output.name) if output.name in self.data else output.function(self.rows("eigenvalues"))
        return values if values.ndim == 3 else values[..., None]

    @cached_property
    def limits(self) -> "tuple[Limits, ...]":
        """Critical speeds by mode and direction, main modes first; only those that some bicycle has."""
        if CRITICAL not in self.data:
            return ()
        limits = []
        for mode, change in itertools.product(self.modes("crossing_mode"), CHANGES):
            speeds = self.rows(CRITICAL, crossing_mode=mode, as_speed_grows=change)
            by_occurrence = [
                occurrence[np.isfinite(occurrence)]
                for occurrence in speeds[self.possible].T
                if np.isfinite(occurrence).any()
            ]
            if np.isfinite(speeds).any():
                limits.append(Limits(mode, change, speeds, by_occurrence, limit_words(mode, change)))
        return tuple(limits)

    @cached_property
    def named(self) -> dict[str, dict[str, Array]]:
        """The named modes that some bicycle has, main modes first: values (cells, samples, speeds) by output."""
        if not self.speeds.size or "mode" not in self.data:
            return {}
        named = {}
        outputs = [output for output in OUTPUTS.values() if output.along == "modes"]
        for mode in self.modes("mode"):
            roots = self.rows("modes", mode=mode) if "modes" in self.data else None
            values = {
                output.name: self.rows(output.name, mode=mode)
                if output.name in self.data
                else np.asarray(output.of_root(roots))
                for output in outputs
                if output.name in self.data or roots is not None
            }
            if any(np.isfinite(value).any() for value in list(values.values())[-1:]):
                named[mode] = values
        return named

    def modes(self, dimension: str) -> list[str]:
        """Names along a dimension of modes, main modes first."""
        declared, names = known_modes(), [str(name) for name in self.data[dimension].values]
        return sorted(names, key=lambda name: not (name in declared and declared[name].main))

    def unit(self, name: str) -> str:
        """The unit of a parameter that can be varied; empty for a ratio or a name."""
        unit = unit_of(name)
        return "" if unit == "1" else unit


def _level(axis: GridAxis, value: Any) -> str:
    if not isinstance(value, str):
        return f"{axis.name} = {value:.6g}"
    return Path(value).name if axis.name in (BICYCLE, "tyre") else f"{axis.name} {Path(value).name}"


def read_result(path: str | Path) -> Stored:
    """Open a ``.zarr`` folder or ``.nc`` file of ``velotyre sweep``; InputError if it is none, or not finished."""
    path = Path(path)
    if not path.exists():
        parts = path.with_name(f"{path.name}.parts")
        how = "give the folder (.zarr) or file (.nc) that 'velotyre sweep --out' has written"
        if parts.is_dir():
            how = f"it is not finished: {parts.as_posix()} holds parts; run the same 'velotyre sweep' again"
        raise InputError(f"{path.as_posix()}: there is no such result; {how}")
    with _refuse_damaged(path):
        data = open_data(path)
        for name in LABELS & data.indexes.keys():
            if not data.indexes[name].is_unique:  # a chunk of labels that is missing is read as empty ones
                raise ValueError(f"labels of {name} are alike")
    names = [str(name).removesuffix("_imag") for name in data if str(name).endswith("_imag") and not path.is_dir()]
    data = data.assign({name: data[f"{name}_real"] + 1j * data[f"{name}_imag"] for name in names})
    try:
        sweep = _sweep(json.loads(data.attrs["sweep"]))
    except (KeyError, TypeError, ValueError, AttributeError, RecursionError, OverflowError) as error:
        raise InputError(
            f"{path.as_posix()} is not a result of 'velotyre sweep'; give one that it has written"
        ) from error
    for name in sweep.model.get("effects", {}):
        effect_class(name)  # one of the user's own may not be known: said before anything is drawn
    refuse_unknown("output", sweep.outputs, OUTPUTS, where=path.as_posix())
    return Stored(path, data, sweep)


@contextmanager
def _refuse_damaged(path: Path) -> Iterator[None]:
    """Refuse a damaged result whatever its libraries raise of it; numbers in it may be anything then."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except Exception as error:
        said = f"{type(error).__name__}: {' '.join(str(error).split())[:120]}"
        raise InputError(
            f"{path.as_posix()} cannot be read as the result of a sweep ({said}); give a .zarr folder or .nc file of "
            "'velotyre sweep', undamaged"
        ) from error


def _sweep(content: Mapping[str, Any]) -> Sweep:
    def tuples(value: Any) -> Any:
        return tuple(map(tuples, value)) if isinstance(value, list) else value

    fields = {**content, **{name: tuples(content[name]) for name in ("speeds", "outputs", "quantiles")}}
    for name, kind in (("axes", GridAxis), ("normals", Normal), ("uniforms", Uniform)):
        fields[name] = tuple(kind(**{key: tuples(value) for key, value in one.items()}) for one in content[name])
    return Sweep(**fields, points_per_part=65536)


class Limits(NamedTuple):
    """Critical speeds (cells, samples, occurrences) of one mode in one direction, m/s, ascending, NaN for none.

    ``by_occurrence`` are those of the possible bicycles that have them; ``words`` say what happens there.
    """

    mode: str  # name, or OTHER
    change: str  # one of CHANGES: what the mode does as speed grows
    speeds: Array
    by_occurrence: list[Array]
    words: str


def limit_words(mode: str, change: str) -> str:
    """Words on a mode and what happens to it as speed grows."""
    words = "unnamed modes" if mode == OTHER else mode.replace("_", " ")
    return f"{words}: {'unstable' if change == CHANGES[0] else 'stable'} above"
