"""What tests of several rooms of the studies use."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture
def unseen(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Leave pictures empty from now on: for tests whose figures differ from those of others in their numbers alone."""

    def at() -> None:
        monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda self, target, **_: Path(target).touch())
        # of matplotlib's class: a function of ours, imported by name meanwhile, would stay replaced for other tests
        monkeypatch.setattr("matplotlib.layout_engine.ConstrainedLayoutEngine.execute", lambda self, figure: None)

    return at


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


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Give the command line these arguments, which it must refuse with exit code 2; what it says of them."""

    def ask(*arguments: object) -> str:
        from studies.cli import main

        with pytest.raises(SystemExit) as stop:
            main([str(one) for one in arguments])
        assert stop.value.code == 2
        return capsys.readouterr().err

    return ask


@pytest.fixture
def printed(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Give the command line these arguments; what is printed by it, and since the last look."""

    def ask(*arguments: str) -> str:
        from studies.cli import main

        main(list(arguments))
        return capsys.readouterr().out

    return ask
