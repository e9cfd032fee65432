"""A finished sweep that others are compared with."""

from pathlib import Path

import pytest
from sweep_examples import RANDOM


@pytest.fixture(scope="session")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The random sweep in a plain loop."""
    from studies.sweep import build_sweep, run_sweep

    return run_sweep(build_sweep(RANDOM), tmp_path_factory.mktemp("reference") / "result.zarr")


@pytest.fixture(scope="session", autouse=True)
def extras() -> None:
    """Skip all where the packages of the extra are missing."""
    pytest.importorskip("zarr")
    pytest.importorskip("xarray")
