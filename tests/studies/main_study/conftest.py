"""Studies that several files of tests look at; each is computed once."""

import pytest
from small_study import chosen, small

from studies.main_study import Study, run_study


@pytest.fixture(scope="session")
def racing() -> Study:
    """A rider in the drops within the tyre tests' loads; unstable wobble on every tyre with a flexible front."""
    settings = small()
    return run_study(settings, cases=chosen(settings, {"Tyre1 flat": (3.5, 5.5, 7.5), "Tyre3 flat": (3.5, 7.5)}))


@pytest.fixture(scope="session")
def heavy() -> Study:
    """A bicycle whose wheel loads lie outside the measured ones; no unstable wobble."""
    settings = small("benchmark", fronts=4)
    return run_study(settings, cases=chosen(settings, {"Tyre1 flat": (3.5, 7.5)}, ["Tyre9 flat at 3.5 bar: gone"]))


@pytest.fixture
def results_alone(monkeypatch) -> None:
    """Leave out what is compared with the results: hinges, contact models."""
    for comparison in ("hinges", "contact_models"):
        monkeypatch.setattr(f"studies.main_study.compare.{comparison}", lambda *_: ())
