"""Tests of one room run in one process; and a simulated rig campaign with its fit, which several rooms look at."""

from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from tyre.campaigns.campaign import Campaign

settings.register_profile("untimed", deadline=None)  # a machine that does something else fails no test
settings.load_profile("untimed")


def pytest_configure(config: pytest.Config) -> None:
    """Compile the kernels, on two cores, before several processes would each do it."""
    several = getattr(config.option, "numprocesses", None) and not hasattr(config, "workerinput")
    if several and find_spec("numba"):
        from bicycle import Model, load_bicycle
        from bicycle.critical.critical_speeds import critical_speeds

        model = Model(load_bicycle("benchmark")).linear_model()
        critical_speeds(model, 10.0, fast=True)
        model.eigenvalues(np.linspace(1.0, 9.0, 1000))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Whole rooms go to one process: what they share (models derived, campaigns fitted, kernels) is made once."""
    from xdist.scheduler import LoadScopeScheduling

    class ByRoom(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return nodeid.partition("::")[0].rpartition("/")[0]

    return ByRoom(config, log)


@pytest.fixture
def two_variants(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stability table judges the first two of its variants only; each is a diagnosis."""
    from studies.inference import stability

    every = stability.variants
    monkeypatch.setattr(stability, "variants", lambda *given: islice(every(*given), 2))


@pytest.fixture(scope="session")
def rig_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings (synthetic) of one tyre on flat track and drum, in mixed formats, with their truth file."""
    from tyre.rig.campaign import CampaignPlan, default_effects, write_campaign_files

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
    from tyre.campaigns.campaign import fit_campaign

    cache = tmp_path_factory.mktemp("fits") / "cache"
    return fit_campaign(rig_folder, cache_folder=cache, jobs=1, progress=False), cache
