"""Tests of one room run in one process; and a simulated rig campaign with its fit, which several rooms look at."""

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
