"""Results of sweeps as tests read them."""

from pathlib import Path
from typing import Any


def load(path: Path) -> Any:
    """The whole result as an xarray data set."""
    import xarray as xr

    with xr.open_zarr(path, consolidated=False) if path.is_dir() else xr.open_dataset(path, engine="netcdf4") as found:
        return found.load()


def identical(first: Path, second: Path) -> bool:
    """True if two results hold the same numbers to the last bit, labels and attributes."""
    return bool(load(first).identical(load(second)))
