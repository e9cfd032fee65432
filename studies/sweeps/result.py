"""Finished parts put together: a labelled zarr store with units and provenance, or netCDF for exchange."""

import json
import math
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.parameter_key import ParameterKey
from bicycle.parameters import UNITS
from studies.sweeps.chunk import CHANGES, OCCURRENCES, OTHER, free_parameters, mode_names, parameter_names, stored
from studies.sweeps.parts import Parts
from studies.sweeps.points import Sampler
from studies.sweeps.sketch import EXTREMES, Merged
from studies.sweeps.spec import BY_SPEED, OUTPUTS, SPEED, TYRE_UNITS, Sweep, software
from studies.sweeps.tyre_table import said_of_stiffness

CHUNK_BYTES = 4_000_000
TOGETHER_BYTES = 16 * CHUNK_BYTES  # written at once: a chunk that is written in two goes is compressed twice
Labels = dict[str, Sequence[Any]]


@dataclass(frozen=True)
class Variable:
    """One array of the result: dimensions, lengths, unit; the first ``leading`` dimensions count items or cells."""

    name: str
    dims: tuple[str, ...]
    shape: tuple[int, ...]
    leading: int
    dtype: str
    unit: str


def assemble(sweep: Sweep, parts: Parts, pieces: Iterable[tuple[int, int]], store: Path) -> None:
    """Write the zarr ``store`` from the parts of all ``pieces`` (numbers of items); few are in memory at a time."""
    import zarr

    labels = coordinates(sweep)
    group = zarr.open_group(store, mode="w", zarr_format=3)
    group.attrs.update(provenance(sweep))
    for name, values in labels.items():
        array = np.asarray(values)
        kind: Any = {"U": str, "f": "float64"}.get(array.dtype.kind, "int64")
        created = group.create_array(name, shape=array.shape, dtype=kind, dimension_names=(name,))
        created[:] = array
        created.attrs["units"] = _unit(name, sweep)
    targets = {
        variable.name: _create(group, variable) for name in stored(sweep) for variable in variables(sweep, labels, name)
    }
    if sweep.quantiles is None:
        for start, arrays in parts.groups(pieces, most_bytes=TOGETHER_BYTES):
            for name, rows in arrays.items():
                write_rows(targets[name], sweep_shape(sweep), start, rows)
        return
    merged = {name: Merged(sweep.quantiles) for name in stored(sweep)}
    for piece in pieces:
        part = parts.read(piece)
        for name, one in merged.items():
            _write_reduced(targets, sweep, name, one.add(part, name))
    for name, one in merged.items():
        _write_reduced(targets, sweep, name, one.finish())


def coordinates(sweep: Sweep) -> Labels:
    """Every dimension and its labels."""
    sampler = Sampler(sweep)
    labels: Labels = {axis.name: axis.values for axis in sweep.axes}
    if sweep.speeds:
        labels[SPEED] = sweep.speeds
    if sweep.samples > 1 and sweep.quantiles is None:
        labels["sample"] = range(sweep.samples)
    if sweep.quantiles is not None:
        labels["quantile"] = sweep.quantiles
    if "eigenvalues" in sweep.outputs:
        labels["root"] = range(sampler.model.linear_model().order)
    if "sensitivities" in sweep.outputs:
        labels["root"] = range(sampler.model.linear_model().order)
        labels["free_parameter"] = free_parameters(sampler)
    if "parameters" in sweep.outputs:
        labels["parameter"] = parameter_names(sampler)
    if {"modes", "frequencies", "damping_ratios"} & set(sweep.outputs):
        labels["mode"] = mode_names(sampler.model.linear_model())
    if "critical_speeds" in sweep.outputs:
        crossing = (*mode_names(sampler.model.linear_model()), OTHER)
        labels |= {"crossing_mode": crossing, "as_speed_grows": CHANGES, "occurrence": range(1, OCCURRENCES + 1)}
    return labels


TRAILING = {
    "eigenvalues": ("root",), "modes": ("mode",), "frequencies": ("mode",), "damping_ratios": ("mode",),
    "sensitivities": ("root", "free_parameter"), "parameters": ("parameter",),
    "critical_speeds": ("crossing_mode", "as_speed_grows", "occurrence"),
}  # fmt: skip


def variables(sweep: Sweep, labels: Labels, name: str) -> list[Variable]:
    """The arrays that hold the output ``name``: itself, or what its reduction over the samples gives."""
    inner = ((SPEED,) if name in BY_SPEED and sweep.speeds else ()) + TRAILING.get(name, ())
    grid = tuple(axis.name for axis in sweep.axes)
    dtype = "complex128" if name in ("eigenvalues", "modes", "sensitivities") else "float64"
    unit = OUTPUTS.get(name, "1")

    def variable(full: str, dims: tuple[str, ...], leading: int, unit: str) -> Variable:
        return Variable(full, dims, tuple(len(labels[d]) for d in dims), leading, dtype, unit)

    if sweep.quantiles is None:
        outer = (*grid, "sample") if sweep.samples > 1 else grid
        return [variable(name, (*outer, *inner), len(outer), unit)]
    found = [variable(f"{name}_quantiles", (*grid, *inner, "quantile"), len(grid), unit)]
    for field in EXTREMES:
        found.append(variable(f"{name}_{field}", (*grid, *inner), len(grid), unit if field in ("min", "max") else "1"))
    return found


def impossible_draws(out: Path) -> int:
    """How many draws of the finished sweep ``out`` make no bicycle."""
    import xarray as xr

    opened = xr.open_zarr(out, consolidated=False) if out.is_dir() else xr.open_dataset(out, engine="netcdf4")
    with opened as found:
        marks = [found[name] for name in ("impossible", "impossible_above_zero") if name in found]
        return sum(int(mark.sum()) for mark in marks)


def provenance(sweep: Sweep) -> dict[str, Any]:
    """What made the numbers; neither time nor machine, so that equal sweeps give equal files."""
    content = asdict(sweep)
    del content["points_per_part"]
    said = said_of_stiffness(sweep.nominal.linear_model().warnings, sweep.relative_cornering_stiffness_sd)
    return {
        "title": "velotyre sweep", "fingerprint": sweep.fingerprint, "made_of": json.dumps(sweep.made_of),
        "software": json.dumps(software()),
        "sweep": json.dumps(content), "warnings": "; ".join(said),
        "random_numbers": "Philox 4x64 keyed by seed and SHA-256 of the parameter's name; sample i is word i",
        "quantile_accuracy": "exact extremes; quantiles to 2**-11 of their value" if sweep.quantiles else "",
    }  # fmt: skip


def sweep_shape(sweep: Sweep) -> tuple[int, ...]:
    """Lengths of the item dimensions as they are stored: without samples where there is one only."""
    return sweep.shape if sweep.samples > 1 else sweep.shape[:-1]


def write_rows(target: Any, shape: Sequence[int], start: int, rows: NDArray[Any], at: tuple[int, ...] = ()) -> None:
    """Write rows of the C-ordered leading dimensions of an array, box by box.

    Parameters
    ----------
    target : zarr or numpy array
    shape : sequence of int
        Leading dimensions that the rows run through (a shape).
    start : int
        Index of the first row.
    rows : ndarray, shape (k, ...)
    at : tuple of int
        Indices before these dimensions.
    """
    if not shape:
        target[(*at, ...)] = rows[0]
        return
    inner = math.prod(shape[1:])
    while len(rows):
        first, offset = divmod(start, inner)
        whole = len(rows) // inner if offset == 0 else 0
        if whole:
            used = whole * inner
            target[(*at, slice(first, first + whole), ...)] = rows[:used].reshape(whole, *shape[1:], *rows.shape[1:])
        else:
            used = min(inner - offset, len(rows))
            write_rows(target, shape[1:], offset, rows[:used], (*at, first))
        start, rows = start + used, rows[used:]


def _write_reduced(targets: dict[str, Any], sweep: Sweep, name: str, cells: list[Any]) -> None:
    shape = sweep.shape[:-1]
    for cell, quantiles, extremes in cells:
        for full, values in (
            (f"{name}_quantiles", quantiles),
            *((f"{name}_{field}", extremes[:, k]) for k, field in enumerate(EXTREMES)),
        ):
            target = targets[full]
            write_rows(target, shape, cell, values.reshape(1, *target.shape[len(shape) :]))


def _create(group: Any, variable: Variable) -> Any:
    chunks, size = [], np.dtype(variable.dtype).itemsize
    for length in reversed(variable.shape):
        chunks.append(max(1, min(length, CHUNK_BYTES // size)))
        size *= chunks[-1]
    array = group.create_array(
        variable.name, shape=variable.shape, chunks=tuple(reversed(chunks)) or "auto", dtype=variable.dtype,
        fill_value=math.nan, dimension_names=variable.dims,
    )  # fmt: skip
    array.attrs["units"] = variable.unit
    return array


def _unit(name: str, sweep: Sweep) -> str:
    base = str(ParameterKey.parse(name).whole)
    if base == SPEED:
        return "m/s"
    units = {f"{e.identifier}.{p.name}": p.unit for e in sweep.nominal.effects for p in e.parameters}
    return (dict(UNITS) | TYRE_UNITS | units).get(base, "1" if base == "quantile" else "")


def remove(path: Path) -> None:
    """Delete the file or folder ``path``, if there is one."""
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
