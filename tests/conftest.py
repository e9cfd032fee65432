"""Tests of one file run in one process; and a simulated rig campaign with its fit, which several rooms look at."""

import gc
import os
import sys
from collections.abc import Callable
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from tyre.fits import Campaign

os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # where it is set, every process of a test compiles all modules anew
sys.dont_write_bytecode = False

settings.register_profile("untimed", deadline=None)  # a machine that does something else fails no test
settings.load_profile("untimed")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Whole files go to one process: what their tests share (a study, a fitted campaign) is made once."""
    from xdist.scheduler import LoadFileScheduling

    config.option.loadscopereorder = False  # by number of tests; the order is that of their length, below
    return LoadFileScheduling(config, log)


LONG = ("golden/", "docs/", "explorer/", "validation/", "house/", "main_study/", "identification/", "diagnosis/")
"""Folders whose files take longest: they begin first, so that no process ends with one of them alone."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the files of long tests first."""
    items.sort(key=lambda item: next((k for k, part in enumerate(LONG) if part in item.nodeid), len(LONG)))


def pytest_collection_finish(session: pytest.Session) -> None:
    """Leave what is imported and collected, millions of objects, out of every later collection of garbage."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 10, 10)


@pytest.fixture
def two_variants(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stability table judges the first two of its variants only; each is a diagnosis."""
    stability = import_module("studies.inference.stability")  # the door exports a function of this name
    every = stability.variants
    monkeypatch.setattr(stability, "variants", lambda *given: islice(every(*given), 2))


@pytest.fixture
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures stay empty where only numbers are compared: drawing takes half of the time."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    monkeypatch.setattr(Figure, "savefig", lambda figure, target, **options: Path(target).write_text("<svg/>"))
    monkeypatch.setattr(ConstrainedLayoutEngine, "execute", lambda engine, figure: None)


@pytest.fixture(scope="session")
def rig_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings (synthetic) of one tyre on flat track and drum, in mixed formats, with their truth file."""
    from tyre.rig import CampaignPlan, default_effects, write_campaign_files

    plan = CampaignPlan(
        loads=(350.0, 450.0), pressures=(4e5,), surfaces=("flat", "drum"), pulls=2, steps=1, file_format="mixed",
        rates=(float(np.deg2rad(2.0)), float(np.deg2rad(4.0))), axes="ISO",
    )  # fmt: skip
    place = tmp_path_factory.mktemp("rig")
    rng = np.random.default_rng(11)
    write_campaign_files(place, plan=plan, effects=default_effects(rng), rng=rng, seed=11)
    return place


@pytest.fixture(scope="session")
def rig_campaign(rig_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple["Campaign", Path]:
    """The fit of the folder, and the folder of its cache."""
    from tyre.fits import fit_campaign

    cache = tmp_path_factory.mktemp("fits") / "cache"
    return fit_campaign(rig_folder, cache_folder=cache, jobs=1, progress=False), cache


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

    def ask(*arguments: object) -> str:
        from studies.cli import main

        main([str(one) for one in arguments])
        return capsys.readouterr().out

    return ask
