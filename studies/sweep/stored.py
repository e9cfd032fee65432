"""The result of a sweep as figures need it: rows of bicycles, which are possible, and the outputs in it."""

import itertools
import json
import re
import textwrap
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.effect_registry import effect_class
from bicycle.naming import known_modes
from studies.axes import unit_of
from studies.outputs import CHANGES, OTHER, OUTPUTS, ROOTS, Output
from studies.sweep.result import open_data
from studies.sweep.specification import BICYCLE, SPEED, GridAxis, Normal, Sweep, Uniform
from tyre.arrays import Array
from tyre.errors import InputError, refuse_unknown

MOST_BICYCLES = 200_000
"""Bicycles of a larger sample that are drawn: the first of each cell, as random as the rest."""

SAMPLE, CRITICAL = "sample", "critical_speeds"


@dataclass(frozen=True, eq=False)
class Stored:
    """A finished sweep: its data set, opened and not read, the sweep as it was computed, and what made it then."""

    path: Path
    data: Any
    sweep: Sweep
    made_of: Mapping[str, str]
    fingerprint: str
    samples: int

    @property
    def reduced(self) -> bool:
        """True if the samples were reduced to quantiles."""
        return self.sweep.quantiles is not None

    @property
    def cells(self) -> int:
        """Number of cells of the grid, without the speed."""
        return self.sweep.items // self.sweep.samples

    @property
    def bicycles(self) -> int:
        """Number of bicycles looked at."""
        return self.cells * self.samples

    @property
    def speeds(self) -> Array:
        """Speeds along which outputs are given, m/s; empty if there is none."""
        return np.asarray(self.sweep.speeds, float) if SPEED in self.data.dims else np.empty(0)

    @cached_property
    def possible(self) -> NDArray[np.bool_]:
        """Possible bicycles, (cells, samples); of a reduced result not known."""
        if "impossible" not in self.data:
            return np.ones((self.cells, self.samples), bool)
        return self.rows("impossible") == 0

    @cached_property
    def extrapolated(self) -> int:
        """Number of bicycles with a tyre outside its measured loads and pressures."""
        if self.reduced:
            name = "tyre_extrapolated_above_zero"
            return int(self.reduced_rows(name).sum()) if name in self.data else 0
        return int(np.nansum(self.rows("tyre_extrapolated"))) if "tyre_extrapolated" in self.data else 0

    def holds(self, output: str) -> bool:
        """True if an output, or its quantiles, stand in the result."""
        return output in self.data or f"{output}_quantiles" in self.data

    def rows(self, name: str, **place: Any) -> Array:
        """A variable (cells, samples, ...) at labels along further dimensions."""
        with _undamaged(self.path):
            found = self.data[name].sel(**place)
            if SAMPLE in found.dims:
                found = found.isel({SAMPLE: slice(self.samples)})
            values = np.asarray(found.values)
            outer = len(self.sweep.axes) + (SAMPLE in found.dims)
            return values.reshape(self.cells, self.samples, *values.shape[outer:])

    def reduced_rows(self, name: str, **place: Any) -> Array:
        """A variable (cells, ...) of a reduced result at labels along further dimensions."""
        with _undamaged(self.path):
            values = np.asarray(self.data[name].sel(**place).values)
            return values.reshape(self.cells, *values.shape[len(self.sweep.axes) :])

    def scalar(self, output: Output) -> Array | None:
        """Values (cells, samples, speeds) of an output of one number; None if the result does not tell."""
        if output.name in self.data:
            found = self.rows(output.name)
        elif output.source == ROOTS and "eigenvalues" in self.data:
            found = output.function(self.rows("eigenvalues"))
        else:
            return None
        return found if found.ndim == 3 else found[..., None]

    def of_mode(self, output: Output, mode: str) -> Array | None:
        """Values (cells, samples, speeds) of an output of a named mode; None if the result does not tell."""
        if output.name in self.data:
            return self.rows(output.name, mode=mode)
        if "modes" not in self.data:
            return None
        return np.asarray(output.of_root(self.rows("modes", mode=mode)))

    def modes(self, dimension: str) -> list[str]:
        """Names along a dimension of modes, main modes first."""
        known, names = known_modes(), [str(name) for name in self.data[dimension].values]
        return sorted(names, key=lambda name: not (name in known and known[name].main))

    def unit(self, name: str) -> str:
        """The unit of a parameter that can be varied; empty for a ratio or a name."""
        unit = unit_of(name.removesuffix(".rear").removesuffix(".front"))
        return "" if unit == "1" else unit

    @property
    def cell_names(self) -> list[str]:
        """Words that distinguish each cell; the names of bicycles and tyres alone speak for themselves."""
        alone = "the samples" if self.sweep.samples > 1 else "the bicycle"
        levels = [[_level(axis, value) for value in axis.values] for axis in self.sweep.axes]
        return [", ".join(words) or alone for words in itertools.product(*levels)]

    @property
    def whose(self) -> str:
        """The bicycles that are looked at, for a title."""
        if self.reduced:
            return f"{self.sweep.samples} bicycles in each of {self.cells} combinations"
        found = f"{self.bicycles} bicycles" if self.bicycles > 1 else "one bicycle"
        if self.bicycles < self.sweep.items:
            every, first = self.sweep.items, self.samples
            found = f"{self.bicycles} of {every} bicycles (the first {first} samples of each combination)"
        if self.sweep.random and self.cells > 1:
            found += f", {self.cells} combinations of {', '.join(axis.name for axis in self.sweep.axes)}"
        return found

    def title(self, text: str, width: float) -> str:
        """Words above a figure in lines of ``width`` inches, with what is true of all figures of the result."""
        if self.extrapolated:
            every = self.sweep.items if self.reduced else self.bicycles
            text += f"\nTyre values extrapolated: {self.extrapolated} of {every}"
        return "\n".join(wrapped(line, int(width / 0.083)) for line in text.splitlines())


def wrapped(text: str, width: int) -> str:
    """Text in lines of at most ``width`` letters, names of parameters broken at their dots only."""
    spaced = re.sub(r"\.(?=[a-z])", ".\t", text)  # a tab is where a name may be broken
    lines = textwrap.wrap(spaced, width, break_long_words=False, expand_tabs=False, replace_whitespace=False)
    return "\n".join(line.replace("\t", "") for line in lines)


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
    with _undamaged(path):
        data = open_data(path)
    for name in [str(name) for name in data if str(name).endswith("_imag")] if not path.is_dir() else []:
        whole = name.removesuffix("_imag")
        data[whole] = data[f"{whole}_real"] + 1j * data[name]
    try:
        sweep = _sweep(json.loads(data.attrs["sweep"]))
    except (KeyError, TypeError, ValueError, AttributeError, RecursionError, OverflowError) as error:
        raise InputError(
            f"{path.as_posix()} is not a result of 'velotyre sweep'; give one that it has written"
        ) from error
    for name in sweep.model.get("effects", {}):
        effect_class(name)  # one of the user's own may not be known: said before anything is drawn
    refuse_unknown("output", sweep.outputs, OUTPUTS, where=path.as_posix())
    try:
        made_of = json.loads(data.attrs["made_of"])
    except (KeyError, ValueError):
        made_of = {}
    cells = sweep.items // sweep.samples
    kept = 1 if sweep.quantiles is not None else min(sweep.samples, max(MOST_BICYCLES // cells, 1))
    return Stored(path, data, sweep, made_of, str(data.attrs.get("fingerprint", "")), kept)


@contextmanager
def _undamaged(path: Path) -> Iterator[None]:
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
    given = dict(content)
    given["axes"] = tuple(GridAxis(one["name"], tuple(one["values"])) for one in given["axes"])
    given["normals"] = tuple(
        Normal(tuple(one["names"]), tuple(one["mean"]), tuple(map(tuple, one["factor"]))) for one in given["normals"]
    )
    given["uniforms"] = tuple(Uniform(**one) for one in given["uniforms"])
    for name in ("speeds", "outputs"):
        given[name] = tuple(given[name])
    given["quantiles"] = None if given["quantiles"] is None else tuple(given["quantiles"])
    return Sweep(**given, points_per_part=65536)


@dataclass(frozen=True, eq=False)
class Limits:
    """Critical speeds (cells, samples, occurrences) of one mode in one direction, m/s, ascending, NaN for none."""

    mode: str
    change: str
    speeds: Array
    possible: NDArray[np.bool_]

    @property
    def held(self) -> list[Array]:
        """Critical speeds of the possible bicycles that have them, by occurrence, m/s."""
        return [one[np.isfinite(one)] for one in self.speeds[self.possible].T if np.isfinite(one).any()]

    @property
    def words(self) -> str:
        """The mode and what happens to it as speed grows."""
        return limit_words(self.mode, self.change)


def limit_words(mode: str, change: str) -> str:
    """Words on a mode and what happens to it as speed grows."""
    words = "unnamed modes" if mode == OTHER else mode.replace("_", " ")
    return f"{words}: {'unstable' if change == CHANGES[0] else 'stable'} above"


def limits(stored: Stored) -> Iterator[Limits]:
    """Critical speeds by mode and direction, main modes first; only those that some bicycle has."""
    for mode in stored.modes("crossing_mode"):
        for change in CHANGES:
            speeds = stored.rows(CRITICAL, crossing_mode=mode, as_speed_grows=change)
            if np.isfinite(speeds).any():
                yield Limits(mode, change, speeds, stored.possible)


def any_limit(stored: Stored) -> bool:
    """True if any bicycle has a critical speed."""
    if stored.reduced:
        return bool((stored.reduced_rows(f"{CRITICAL}_count") > 0).any())
    return any(True for _ in limits(stored))


@dataclass(frozen=True, eq=False)
class ModeRows:
    """One mode along the speed: values (cells, samples, speeds) by name of the output."""

    mode: str
    values: Mapping[str, Array]


def mode_rows(stored: Stored) -> Iterator[ModeRows]:
    """The named modes that some bicycle has, main modes first."""
    if not stored.speeds.size or "mode" not in stored.data:
        return
    shown = [one for one in OUTPUTS.values() if one.along == "modes"]
    for mode in stored.modes("mode"):
        held = {one.name: stored.of_mode(one, mode) for one in shown}
        values = {name: value for name, value in held.items() if value is not None}
        if any(np.isfinite(value).any() for value in list(values.values())[-1:]):
            yield ModeRows(mode, values)
