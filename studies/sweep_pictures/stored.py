"""The result of a sweep as figures need it: rows of bicycles, what is varied, and which bicycles are possible."""

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

from bicycle.effect import effect_class
from bicycle.parameters import UNITS
from studies.sweeps.spec import SPEED, TYRE_UNITS, Axis, Normal, Sweep, Uniform
from tyre.base.arrays import Array
from tyre.base.errors import InputError

MOST_BICYCLES = 200_000
"""Of a larger sample the first of each cell are drawn: they are as random as the rest."""

SAMPLE = "sample"
LETTER = 0.083  # inches, of the letters of a title


@dataclass(frozen=True, eq=False)
class Stored:
    """A finished sweep.

    Attributes
    ----------
    path : Path
    data : xarray.Dataset
        Opened, not read.
    sweep : Sweep
        As it was computed.
    made_of : mapping
        What the fingerprint held then; empty of results of old versions.
    fingerprint : str
    samples : int
        Number of samples of each cell that are looked at.
    """

    path: Path
    data: Any
    sweep: Sweep
    made_of: Mapping[str, str]
    fingerprint: str
    samples: int

    @property
    def reduced(self) -> bool:
        """Whether the samples were reduced to quantiles."""
        return self.sweep.quantiles is not None

    @property
    def cells(self) -> int:
        """Number of cells of the grid, without the speed."""
        return self.sweep.items // self.sweep.samples

    @property
    def bicycles(self) -> int:
        """Number of bicycles looked at."""
        return self.cells * self.samples

    @cached_property
    def possible(self) -> NDArray[np.bool_]:
        """Which bicycles are possible, (cells, samples); of a reduced result not known."""
        if "impossible" not in self.data:
            return np.ones((self.cells, self.samples), bool)
        return self.rows("impossible") == 0

    def rows(self, name: str, **place: Any) -> Array:
        """An output, cells and samples as the first two axes.

        Parameters
        ----------
        name : str
            Of the variable.
        **place : object
            Labels along further dimensions.

        Returns
        -------
        ndarray, shape (cells, samples, ...)
        """
        with _undamaged(self.path):
            found = self.data[name].sel(**place)
            if SAMPLE in found.dims:
                found = found.isel({SAMPLE: slice(self.samples)})
            values = np.asarray(found.values)
            outer = len(self.sweep.axes) + (SAMPLE in found.dims)
            return values.reshape(self.cells, self.samples, *values.shape[outer:])

    def reduced_rows(self, name: str, **place: Any) -> Array:
        """A variable of a reduced result, the cells as the first axis; arguments as :meth:`rows`."""
        with _undamaged(self.path):
            values = np.asarray(self.data[name].sel(**place).values)
            return values.reshape(self.cells, *values.shape[len(self.sweep.axes) :])

    def unit(self, name: str) -> str:
        """The unit of the parameter ``name`` that can be varied; empty for a ratio or a name."""
        whole = name.removesuffix(".rear").removesuffix(".front")
        unit = self._units.get(whole, "")
        return "" if unit == "1" else unit

    @cached_property
    def _units(self) -> dict[str, str]:
        found: dict[str, str] = dict(UNITS) | TYRE_UNITS | {SPEED: "m/s"}
        for name in self.sweep.model.get("effects", {}):
            found |= {f"{name}.{one.name}": one.unit for one in effect_class(name).parameters}
        return found

    @property
    def cell_names(self) -> list[str]:
        """What distinguishes each cell, in words; the names of bicycles and tyres alone speak for themselves."""
        shape = self.sweep.shape[:-1]
        found = []
        for cell in range(self.cells):
            place = np.unravel_index(cell, shape) if shape else ()
            words = [_level(axis, axis.values[int(k)]) for axis, k in zip(self.sweep.axes, place, strict=True)]
            alone = "the samples" if self.sweep.samples > 1 else "the bicycle"
            found.append(", ".join(words) or alone)
        return found

    @property
    def whose(self) -> str:
        """The bicycles that are looked at, in words for a title."""
        drawn, every = self.bicycles, self.sweep.items
        words = f"{drawn} bicycles" if drawn > 1 else "one bicycle"
        if drawn < every:
            words = f"{drawn} of {every} bicycles (the first {self.samples} samples of each combination)"
        if self.sweep.random and self.cells > 1:
            words += f", {self.cells} combinations of {', '.join(axis.name for axis in self.sweep.axes)}"
        return words

    @cached_property
    def extrapolated(self) -> int:
        """How many bicycles have a tyre outside its measured loads and pressures."""
        if self.reduced:
            name = "tyre_extrapolated_above_zero"
            return int(self.reduced_rows(name).sum()) if name in self.data else 0
        return int(np.nansum(self.rows("tyre_extrapolated"))) if "tyre_extrapolated" in self.data else 0

    def title(self, text: str, width: float) -> str:
        """The words above a figure: its own ``text``, and what is true of all figures of the result.

        Parameters
        ----------
        text : str
        width : float
            Number of inches that a line may take.
        """
        every = self.sweep.items if self.reduced else self.bicycles
        text += f"\nTyre values extrapolated: {self.extrapolated} of {every}" if self.extrapolated else ""
        return "\n".join(wrapped(line, int(width / LETTER)) for line in text.splitlines())


def wrapped(text: str, width: int) -> str:
    """Text in lines of at most a ``width`` (number of letters), names of parameters broken at their dots only.

    Parameters
    ----------
    text : str
    width : int
        Number of letters.
    """
    spaced = re.sub(r"\.(?=[a-z])", ".\t", text)  # a tab is where a name may be broken
    lines = textwrap.wrap(spaced, width, break_long_words=False, expand_tabs=False, replace_whitespace=False)
    return "\n".join(line.replace("\t", "") for line in lines)


def _level(axis: Axis, value: Any) -> str:
    if not isinstance(value, str):
        return f"{axis.name} = {value:.6g}"
    return Path(value).name if axis.name in ("bicycle", "tyre") else f"{axis.name} {Path(value).name}"


def read_result(path: str | Path) -> Stored:
    """Open the result of ``velotyre sweep``.

    Parameters
    ----------
    path : str or Path
        A ``.zarr`` folder or a ``.nc`` file.

    Raises
    ------
    InputError
        There is none, it is not finished, or it is the result of something else.
    """
    path = Path(path)
    if not path.exists():
        parts = path.with_name(f"{path.name}.parts")
        how = (
            f"it is not finished: {parts.as_posix()} holds parts; run the same 'velotyre sweep' again to complete it"
            if parts.is_dir()
            else "give the folder (.zarr) or file (.nc) that 'velotyre sweep --out' has written"
        )
        raise InputError(f"{path.as_posix()}: there is no such result; {how}")
    data = _opened(path)
    try:
        sweep = _sweep(json.loads(data.attrs["sweep"]))
    except (KeyError, TypeError, ValueError, AttributeError, RecursionError, OverflowError) as error:
        raise InputError(
            f"{path.as_posix()} is not a result of 'velotyre sweep'; give one that it has written"
        ) from error
    for name in sweep.model.get("effects", {}):
        effect_class(name)  # one of the user's own may not be known: said before anything is drawn
    try:
        made_of = json.loads(data.attrs["made_of"])
    except (KeyError, ValueError):
        made_of = {}
    cells = sweep.items // sweep.samples
    kept = 1 if sweep.quantiles is not None else min(sweep.samples, max(MOST_BICYCLES // cells, 1))
    return Stored(path, data, sweep, made_of, str(data.attrs.get("fingerprint", "")), kept)


def _opened(path: Path) -> Any:
    import xarray as xr

    with _undamaged(path):
        if path.is_dir():
            return xr.open_zarr(path, consolidated=False)
        found = xr.open_dataset(path, engine="netcdf4")
    for name in [str(name) for name in found if str(name).endswith("_imag")]:
        whole = name.removesuffix("_imag")
        found[whole] = found[f"{whole}_real"] + 1j * found[name]
    return found


@contextmanager
def _undamaged(path: Path) -> Iterator[None]:
    """Say that a result is damaged whatever its libraries raise of it; numbers in it may be anything then."""
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
    given["axes"] = tuple(Axis(one["name"], tuple(one["values"])) for one in given["axes"])
    given["normals"] = tuple(
        Normal(tuple(one["names"]), tuple(one["mean"]), tuple(map(tuple, one["factor"]))) for one in given["normals"]
    )
    given["uniforms"] = tuple(Uniform(**one) for one in given["uniforms"])
    for name in ("speeds", "outputs"):
        given[name] = tuple(given[name])
    given["quantiles"] = None if given["quantiles"] is None else tuple(given["quantiles"])
    return Sweep(**given, points_per_part=65536)


def speeds_of(stored: Stored) -> Array:
    """The speeds along which outputs are given, m/s; empty where there is none."""
    return np.asarray(stored.sweep.speeds, float) if SPEED in stored.data.dims else np.empty(0)
