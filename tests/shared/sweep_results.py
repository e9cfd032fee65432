"""Results of sweeps as tests read them."""

from pathlib import Path
from typing import Any


def load(path: Path) -> Any:
    """The whole result as an xarray data set."""
    import xarray as xr

    with xr.open_zarr(path, consolidated=False) as found:
        return found.load()


def tree(folder: Path) -> dict[str, bytes]:
    """Every file of a result by its place in it."""
    return {file.relative_to(folder).as_posix(): file.read_bytes() for file in folder.rglob("*") if file.is_file()}
