"""The speed table: what it compares gives equal results, and what cannot be measured is said."""

import json

import numpy as np
import pytest
from eigenvalue_sets import assert_same_eigenvalues

from bicycle.critical.critical_speeds import critical_speeds
from bicycle.eigenvalues.solvers import lapack
from studies.cli import main
from studies.validations import _speed_of_eigenvalues as of_eigenvalues
from studies.validations import _speed_of_studies as of_studies
from studies.validations import _speed_timing as timing
from studies.validations import speed


@pytest.mark.parametrize("order", [8, 12])
def test_the_grid_of_the_comparison_finds_the_same_crossings(order):
    linear = timing.tyre_model(order).linear_model()
    assert linear.order == order
    exact = [crossing.speed for crossing in critical_speeds(linear)]
    np.testing.assert_allclose(sorted(of_studies.grid_crossings(linear)), exact, rtol=1e-6)


@pytest.mark.parametrize("path", timing.SOLVERS)
def test_all_crossings_of_the_grid_are_found(path):
    if path == "fast":
        pytest.importorskip("numba")
    row = speed._critical(8, timing.SOLVERS[path], None, 1)
    assert row["note"].endswith("ms; 3 crossings on the grid, 3 found and named")
    assert row["met"] == (row["seconds"][0] > row["seconds"][1])


def test_lapack_called_directly_gives_the_same_eigenvalues():
    pytest.importorskip("numba")
    stack = timing.tyre_model(8).linear_model().state_matrix([1.0, 5.0, 20.0])
    real, imag = of_eigenvalues._dgeev_loop()(stack)
    assert_same_eigenvalues(real + 1j * imag, lapack(stack), rtol=1e-9)


def test_table(monkeypatch, tmp_path, capsys):
    def missing():
        raise ImportError("No module named 'peer'")

    rows = [
        ("ours against theirs", ">= 10 x", speed._faster(10, 4, lambda: (2.0, 0.1))),
        ("slower than allowed", "<= 1.3", speed._slower(1.3, 4, lambda: (1.0, 2.0))),
        ("with a peer", "", missing),
    ]
    monkeypatch.setattr(speed, "_rows", lambda quick: rows)
    main(["validate", "speed", "--quick", "--out", str(tmp_path), "--table", str(tmp_path / "table.md"), "--json", "-"])
    found = json.loads(capsys.readouterr().out)["rows"]
    assert [row["met"] for row in found] == [True, False, None]
    text = (tmp_path / "table.md").read_text(encoding="utf-8")
    lines = [" ".join(line.split()) for line in text.splitlines()]
    assert "| ours against theirs | >= 10 x | 20 x | yes | 5e+05 and 2.5e+04 µs each |" in lines
    assert "| slower than allowed | <= 1.3 | 2 | no | 2.5e+05 and 5e+05 µs each |" in lines
    assert "| with a peer | - | - | - | not measured: ImportError: No module named 'peer' |" in lines
    assert "A quick run with small sizes: indicative only." in text
    assert timing.machine()["processor"] in text


def test_rows_that_were_measured_outlive_an_interruption(monkeypatch, tmp_path):
    def interrupted():
        raise KeyboardInterrupt

    rows = [("ours against theirs", "", speed._faster(None, 4, lambda: (2.0, 0.1))), ("the next", "", interrupted)]
    monkeypatch.setattr(speed, "_rows", lambda quick: rows)
    with pytest.raises(KeyboardInterrupt):
        speed.run(out=tmp_path, table=str(tmp_path / "table.md"))
    text = (tmp_path / "benchmarks.md").read_text(encoding="utf-8")
    assert "| ours against theirs |" in " ".join(text.split())
    assert "the next" not in text
    assert not (tmp_path / "table.md").exists()
