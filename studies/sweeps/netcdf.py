"""The zarr store of a sweep written as netCDF, for exchange: always in the same order, so that files are the same."""

import errno
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np


def to_netcdf(store: Path, target: Path) -> None:
    """Export ``store`` to ``target``; a complex variable becomes ``name_real`` and ``name_imag``, as netCDF needs.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    import netCDF4
    import zarr

    found = zarr.open_group(store, mode="r")
    arrays: list[tuple[str, Any]] = sorted(found.arrays())
    try:
        with netCDF4.Dataset(target, "w") as file:
            file.setncatts(dict(found.attrs))
            for name, array in arrays:
                if array.metadata.dimension_names == (name,):
                    file.createDimension(name, array.shape[0])
            for name, array in arrays:
                for full, part in _parts(name, array):
                    _copy(file, full, array, part)
    except RuntimeError as error:  # HDF5 does not say why
        raise OSError(errno.EIO, f"netCDF says {str(error)!r}, as it does when the disk is full") from error


def _parts(name: str, array: Any) -> list[tuple[str, str]]:
    complex_valued = np.dtype(_kind(array)).kind == "c"
    return [(f"{name}_{part}", part) for part in ("real", "imag")] if complex_valued else [(name, "")]


def _copy(file: Any, name: str, array: Any, part: str) -> None:
    kind = str if _kind(array) is str else np.zeros(0, _kind(array)).real.dtype.newbyteorder("=")
    options = {"fill_value": np.nan} if np.dtype(kind).kind == "f" else {}
    variable = file.createVariable(name, kind, array.metadata.dimension_names or (), **options)
    variable.setncatts(dict(array.attrs))
    for box in _boxes(array):
        values = np.asarray(array[box])
        variable[box] = values.astype(object) if kind is str else getattr(values, part) if part else values


def _kind(array: Any) -> Any:
    return str if array.dtype.kind in "TUO" else array.dtype


def _boxes(array: Any) -> Iterator[Any]:
    """Slices of the first axis that hold whole stored chunks."""
    if not array.ndim:
        yield ...
        return
    for start in range(0, array.shape[0], array.chunks[0]):
        yield slice(start, start + array.chunks[0])
