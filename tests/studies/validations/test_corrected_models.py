"""Whether corrected models are known as well as they say: how cases are counted, and one of each kind."""

import numpy as np
import pytest

from studies.missing_effect.blind.cells import modal_one
from studies.missing_effect.blind.generator import HELD_OUT
from studies.missing_effect.blind.kept import KeptCases
from studies.validations import corrected_models
from studies.validations.corrected_models import INSIDE, NONE, OPEN, OUTSIDE, UNSTABLE, one_case, outcome, summary


def row(value=5.0, sd=0.1, true=5.0, *, left_open=False, error=None):
    weave = None if value is None else {"value": value, "sd": sd}
    return {"error": error, "left_open": left_open, "true": true, "weave": weave, "assumed": weave}


@pytest.mark.parametrize(
    ("case", "ends"),
    [
        (row(true=5.19), INSIDE),
        (row(true=4.81), INSIDE),
        (row(true=5.2), OUTSIDE),
        (row(true=None), UNSTABLE),
        (row(value=None), NONE),
        (row(true=9.0, left_open=True), OPEN),
    ],
)
def test_what_becomes_of_a_case(case, ends):
    """Within 1.96 sd of 0.1 m/s, or no claim."""
    assert outcome(case) == ends


def test_shares_are_of_what_is_claimed():
    found = summary([row(), row(true=5.1, sd=0.2), row(true=6.0), row(value=None), row(error="ValueError")])
    assert (found["cases"], found["errors"]) == (5, 1)
    assert (found["inside_95"]["hits"], found["inside_95"]["of"]) == (2, 3)
    assert found["nothing_claimed"] == {NONE: 1, OPEN: 0, UNSTABLE: 0}
    assert found["median_sd_m_s"] == 0.1
    assert summary([])["inside_95"]["share"] is None


def test_a_case_is_made_diagnosed_corrected_and_read_again():
    """The data tell the speed better than what would be assumed without them."""
    found = one_case("modal-none", 5)
    assert found["error"] is None
    assert found["verdict"] == "none"
    assert outcome(found) in (INSIDE, OUTSIDE)
    assert abs(found["weave"]["value"] - found["true"]) < 4 * found["weave"]["sd"]
    assert found["weave"]["sd"] < found["assumed"]["sd"]
    assert found["weave"]["value"] == pytest.approx(found["assumed"]["value"], rel=1e-9)


def test_what_raises_is_counted(monkeypatch):
    monkeypatch.setattr(corrected_models, "make", lambda *_, **__: 1 / 0)
    assert one_case("modal-one", 1)["error"].startswith("ZeroDivisionError: division by zero (test_corrected_models.py")


def test_a_run_counts_every_cell(tmp_path, monkeypatch):
    monkeypatch.setattr(KeptCases, "computed", lambda self, jobs, one, **_: [one(*job) for job in jobs])  # here
    monkeypatch.setattr(corrected_models, "one_case", lambda cell, seed: {"cell": cell, "seed": seed, **row()})
    found = corrected_models.run(out=tmp_path, seed=3, cases=2, histories=1)
    assert {cell: c["cases"] for cell, c in found["cells"].items()} == {
        "modal-none": 2, "modal-one": 2, "history-one": 1,
    }  # fmt: skip
    assert found["made_by"] == "velotyre validate corrected-models --seed 3 --cases 2 --histories 1"
    assert [r["seed"] for r in found["cases"] if r["cell"] == "modal-one"] == [120000, 120001]


def test_speeds_are_kept_back_from_cells_of_one_effect_too(tmp_path):
    truth, _ = modal_one(tmp_path, np.random.default_rng(1), held_out=2)
    assert (tmp_path / HELD_OUT / "MEASUREMENT.toml").exists()
    assert truth.weave is None or 0 < truth.weave < 30
