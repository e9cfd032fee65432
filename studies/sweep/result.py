"""The labelled result of a sweep: put together from its parts by dask and xarray, written as zarr or netCDF, opened."""

import errno
import json
import math
import shutil
import warnings
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.parameters.parameter_covariance import ParameterKey
from studies.model_space.axes import unit_of
from studies.model_space.outputs import OUTPUTS
from studies.sweep.labels import coordinates, inner_of, outer_of
from studies.sweep.parts import Parts, describe_rows, pieces
from studies.sweep.sampler import stiffness_warnings
from studies.sweep.specification import SAMPLE, Sweep, software

CHUNK = "4MB"  # of a variable in a zarr store


def label_rows(sweep: Sweep, rows: Mapping[str, Any]) -> Any:
    """Data set of arrays (items, ...) by name, numpy or dask, along the grid, the samples and further dimensions."""
    import xarray as xr

    labels, outer = coordinates(sweep), outer_of(sweep)
    shape = tuple(len(labels[dim]) for dim in outer)
    variables = {}
    for name, array in rows.items():
        unit = OUTPUTS[name].unit if name in OUTPUTS else "1"
        variables[name] = ((*outer, *inner_of(name, sweep)), _fold(array, shape), {"units": unit})
    units = {dim: unit_of(str(ParameterKey.parse(dim).whole)) for dim in labels}
    return xr.Dataset(variables, {dim: (dim, np.array(label), {"units": units[dim]}) for dim, label in labels.items()})


def _fold(rows: Any, shape: tuple[int, ...]) -> Any:
    """Rows (items, ...) as (*shape, ...) in C order.

    dask's own reshape joins all that lies along the trailing axes into one chunk: beyond a chunk of ``rows`` the first
    axis is stacked, so that memory stays that of a few parts.
    """
    if not shape:
        return rows[0]
    inner = math.prod(shape[1:])
    if isinstance(rows, np.ndarray) or inner <= rows.chunksize[0]:
        return rows.reshape((*shape, *rows.shape[1:]))
    if len(shape) == 1:
        return rows

    import dask.array as da

    return da.stack([_fold(rows[k * inner : (k + 1) * inner], shape[1:]) for k in range(shape[0])])


def open_rows(sweep: Sweep, parts: Parts) -> dict[str, Any]:
    """Dask arrays (items, ...) by name, read from all parts when they are needed."""
    import dask
    import dask.array as da

    @dask.delayed
    def read(piece: tuple[int, int], name: str) -> Any:
        return parts.read(piece, name)[name]

    rows = {}
    for name, (inner, kind) in describe_rows(sweep).items():
        blocks = [
            da.from_delayed(read((start, stop), name), (stop - start, *inner), kind)
            for start, stop in pieces(sweep, parts.items)
        ]
        rows[name] = da.concatenate(blocks)
    return rows


def reduce_samples(data: Any, quantiles: tuple[float, ...]) -> Any:
    """Quantiles, extremes and counts over the samples, in place of the samples; NaN where no sample has the quantity.

    A quantile is the smallest value with at least that share of the samples at or below it.
    """
    reduced: dict[str, Any] = {}
    for name, whole in data.data_vars.items():
        values = whole.chunk({dim: -1 if dim == SAMPLE else "auto" for dim in whole.dims})
        has = values.notnull()
        has_any = has.any(SAMPLE)
        by_quantile = values.quantile(list(quantiles), SAMPLE, method="inverted_cdf", keep_attrs=True)
        reduced |= {
            f"{name}_quantiles": by_quantile.transpose(..., "quantile"),
            f"{name}_min": values.min(SAMPLE, keep_attrs=True),
            f"{name}_max": values.max(SAMPLE, keep_attrs=True),
        }
        counts = {
            "min_sample": values.fillna(np.inf).argmin(SAMPLE).where(has_any),
            "max_sample": values.fillna(-np.inf).argmax(SAMPLE).where(has_any),
            "count": has.sum(SAMPLE).astype(float),
            "above_zero": (values > 0).sum(SAMPLE).astype(float),
        }
        reduced |= {f"{name}_{statistic}": numbers.assign_attrs(units="1") for statistic, numbers in counts.items()}
    result = data.drop_vars([*data.data_vars, SAMPLE]).assign(reduced)
    result["quantile"].attrs["units"] = "1"
    return result


def write_result(sweep: Sweep, parts: Parts, target: Path) -> None:
    """Write the result from the parts of all bicycles: netCDF where ``target`` ends in .nc, else a zarr store."""
    import dask

    # one part after the other: memory stays that of a few of them
    with dask.config.set({"scheduler": "synchronous", "array.chunk-size": "32MB"}), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # NaN in all samples; consolidated metadata, which not all of zarr's kin know
        data = label_rows(sweep, open_rows(sweep, parts))
        if sweep.quantiles is not None:
            data = reduce_samples(data, sweep.quantiles)
        data = data.assign_attrs(provenance(sweep))
        words = [dim for dim, label in data.coords.items() if label.dtype.kind == "U"]
        data = data.assign_coords({dim: data[dim].astype(object) for dim in words})  # text of any length in the files
        if target.suffix == ".nc":
            _write_netcdf(data, target)
        else:
            _write_zarr(data, target)


def _write_zarr(data: Any, target: Path) -> None:
    """Write ``data`` as a zarr store with its metadata in one place, without which xarray warns at every opening."""
    from dask.array.core import normalize_chunks

    encoding = {}
    for name, values in data.data_vars.items():
        chunks = normalize_chunks("auto", values.shape, limit=CHUNK, dtype=values.dtype)
        data[name] = values.chunk(dict(zip(values.dims, chunks, strict=True)))
        if values.ndim:
            encoding[name] = {"chunks": tuple(sizes[0] for sizes in chunks)}
    data.to_zarr(target, mode="w", zarr_format=3, consolidated=True, encoding=encoding)


def _write_netcdf(data: Any, target: Path) -> None:
    """Write ``data`` as netCDF; a complex variable becomes ``NAME_real`` and ``NAME_imag``, as netCDF needs."""
    for name, values in list(data.data_vars.items()):
        if values.dtype.kind == "c":
            halves = {f"{name}_real": values.real, f"{name}_imag": values.imag}
            data = data.drop_vars(name).assign({half: part.assign_attrs(values.attrs) for half, part in halves.items()})
    try:
        data.to_netcdf(target, engine="netcdf4")
    except RuntimeError as error:  # HDF5 does not say why
        raise OSError(errno.EIO, f"netCDF reports {str(error)!r}, as it does when the disk is full") from error


def provenance(sweep: Sweep) -> dict[str, str]:
    """Attributes that say what made the numbers."""
    content = asdict(sweep)
    del content["points_per_part"]
    remarks = stiffness_warnings(sweep.nominal.linear_model().warnings, sweep.relative_cornering_stiffness_sd)
    return {
        "title": "velotyre sweep",
        "fingerprint": sweep.fingerprint,
        "made_of": json.dumps(sweep.made_of),
        "software": json.dumps(software()),
        "sweep": json.dumps(content),
        "warnings": "; ".join(remarks),
        "random_numbers": "Philox 4x64 keyed by seed and SHA-256 of the parameter's name; sample i is word i",
    }


def open_data(path: Path) -> Any:
    """The data set of a finished sweep, zarr or netCDF, opened and not read."""
    import xarray as xr

    return xr.open_zarr(path, consolidated=False) if path.is_dir() else xr.open_dataset(path, engine="netcdf4")


def impossible_draws(out: Path) -> int:
    """Number of draws of the finished sweep ``out`` that are impossible."""
    with open_data(out) as data:
        marks = [data[name] for name in ("impossible", "impossible_above_zero") if name in data]
        return sum(int(mark.sum()) for mark in marks)


def remove(path: Path) -> None:
    """Delete the file or folder ``path``, if there is one."""
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
