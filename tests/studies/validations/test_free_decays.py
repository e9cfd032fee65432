"""The study of free decays: its generator by other means, a small run, and the committed result."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from studies.validations._decay_generator import STEP, Cell, make
from studies.validations.free_decays import CELLS, KINDS, TARGET, by_realization, of_one_test, scattered, summary

ALONE, SETS, TOLD = KINDS.values()
DATA = Path(__file__).parents[3] / "data" / "validation"
COUNTS = {
    "free_decays.json": (ALONE,), "free_decays_again.json": (ALONE, TOLD), "free_decays_sets.json": (ALONE, SETS, TOLD),
}  # fmt: skip
BEYOND = {ALONE: "", SETS: "_in_sets", TOLD: "_where_driving_is_told"}


def test_the_generator_without_noise_obeys_its_eigenvalues():
    """Samples of two modes satisfy the linear recursion whose roots are e^(lambda h): Prony's equation."""
    made = make(Cell(second=0.5, noise=0.0), np.random.default_rng(1))
    steps = np.exp(STEP * np.array([z for root in made.roots for z in (root, root.conjugate())]))
    recursion = np.poly(steps).real
    for x in made.run.channels.values():
        left = np.convolve(x, recursion, mode="valid")
        assert np.abs(left).max() < 1e-9 * np.abs(x).max()


def test_the_ratio_of_the_generator_is_that_of_its_channels():
    made = make(Cell(noise=0.0), np.random.default_rng(2))
    wave = np.exp(made.roots[0] * made.run.time)
    basis = np.stack([wave.real, wave.imag], 1)
    roll, steer = (np.linalg.lstsq(basis, x, rcond=None)[0] @ [1, -1j] for x in made.run.channels.values())
    assert steer / roll == pytest.approx(made.ratio, rel=1e-6)


def test_the_peer_finds_the_root_without_noise():
    made = make(Cell(noise=1e-6), np.random.default_rng(3))
    assert by_realization(made.run, made.roots[0]) == pytest.approx(made.roots[0], rel=1e-3)


@pytest.mark.parametrize("name", ["offset, 1.1 to 1.4 cycles", "capsize that dies out, 1.0 to 1.4 cycles"])
def test_a_small_run(name):
    """10 decays: fewer than 8 within their interval would be a chance of 1.2e-2 at 95 %."""
    found = summary(of_one_test((name, 1, range(10))))
    assert found["refused"] <= 1
    assert found["coverage_percent"]["real"] >= 78
    assert found["coverage_percent"]["imaginary"] >= 78
    assert found["median_error_percent"] < 1.3 * found["median_error_of_realization_percent"]


@pytest.mark.parametrize(("file", "kinds"), COUNTS.items())
def test_the_committed_results(file, kinds):
    result = json.loads((DATA / file).read_text())
    assert result["target_percent"] == list(TARGET)
    for kind in kinds:
        beyond = [
            f"{name}: {part}"
            for name, cell in result["cells"].items()
            for part in ("real", "imaginary")
            if not TARGET[0] <= cell[kind][part] <= TARGET[1]
        ]
        assert result["beyond_target" + BEYOND[kind]] == beyond
    seed, draws = result["seed"], result["draws_per_cell"]
    assert result["repeats"]["scatter alone"] == scattered(seed, draws, outlier=False)
    assert result["repeats"]["one outlier"] == scattered(seed, draws, outlier=True)


def test_all_cells_are_counted_and_the_page_says_what_came_out():
    before, again, now = (json.loads((DATA / file).read_text()) for file in COUNTS)
    assert before["draws_per_cell"] >= 400
    assert set(before["cells"]) < set(again["cells"])
    assert set(now["cells"]) == set(CELLS)
    page = " ".join((DATA.parents[1] / "docs" / "measurement_files.md").read_text(encoding="utf-8").split())
    shares = {kind: {name: [cell[kind][part] for part in ("real", "imaginary")] for name, cell in now["cells"].items()}
              for kind in COUNTS["free_decays_sets.json"]}  # fmt: skip
    still = [share for name, both in shares[ALONE].items() if "driven" not in name for share in both]
    assert f"hold the truth in {math.floor(min(still))} to {math.ceil(max(still))} % where nothing drives it" in page
    driven = [share for name, both in shares[ALONE].items() if "driven" in name for share in both]
    assert f"in {math.floor(min(driven))} to {math.ceil(max(driven))} % where the ground does" in page
    for kind, words in ((SETS, "of runs that are given in sets of ten"), (TOLD, "where either is told")):
        every = [share for both in shares[kind].values() for share in both]
        assert f"in {math.floor(min(every))} to {math.ceil(max(every))} % {words}" in page
