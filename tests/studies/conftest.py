"""What tests of several rooms of the studies use."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture
def canvases(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The figures that are drawn, instead of files."""
    from matplotlib.figure import Figure

    drawn: list[Any] = []

    @contextmanager
    def drawing(target: Path, *, width: float, height: float) -> Iterator[Any]:
        drawn.append(Figure(figsize=(width, height)))
        yield drawn[-1]

    monkeypatch.setattr("studies.reporting.plotting.drawing", drawing)
    return drawn
