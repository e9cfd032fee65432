"""The four scripts of docs/python.md run, are short, and tell the truth."""

import re
import shutil

import numpy as np
import pytest
from pages import DOCS, section

pytest.importorskip("xarray")

SCRIPTS = re.findall(r"^```python\n(.*?)^```", section("python", "Scripts"), flags=re.MULTILINE | re.DOTALL)


def run(script):
    found = {}
    exec(script, found)
    return found


def test_each_is_short():
    assert len(SCRIPTS) == 4
    assert max(len([line for line in script.splitlines() if line.strip()]) for script in SCRIPTS) <= 8


def test_the_loop_is_stable_where_the_closed_matrix_is():
    """Eigenvalues by numpy of A + k B C."""
    pytest.importorskip("control")
    found = run(SCRIPTS[0])
    channel = found["plant"]["lean_rate", "steer_torque"]
    gains = -np.linspace(0, 10, 101)
    closed = channel.A[None] - gains[:, None, None] * (channel.B @ channel.C)
    np.testing.assert_array_equal(found["stable"], (np.linalg.eigvals(closed).real < 0).all(1))
    assert found["stable"].any()
    assert not found["stable"].all()


def test_the_plant_has_the_eigenvalues_of_the_model_on_the_fitted_tyre(tmp_path, monkeypatch):
    pytest.importorskip("control")
    (tmp_path / "fit/maps").mkdir(parents=True)
    for ending in ("csv", "toml"):
        table = DOCS / f"examples/measurements/tyre_tables/flat.{ending}"
        shutil.copy(table, tmp_path / f"fit/maps/28-622_A_flat.{ending}")
    monkeypatch.chdir(tmp_path)
    found = run(SCRIPTS[1])
    rear_load, _ = found["model"].bicycle.static_loads
    tyre = found["vt"].read_tyre("fit/maps/28-622_A_flat.csv").at(load=rear_load, pressure=5e5)
    (effect,) = found["model"].effects
    assert effect.cornering_stiffness["rear"] == pytest.approx(tyre.cornering_stiffness, rel=1e-9)
    eigenvalues = found["vt"].modes(found["model"], 5.0).eigenvalues[0]
    np.testing.assert_allclose(np.sort_complex(found["roots"]), np.sort_complex(eigenvalues), rtol=1e-6)


def test_the_sweep_has_the_published_speed_at_the_benchmark():
    found = run(SCRIPTS[2])
    assert found["weave"].dims == ("c", "w")
    assert len(found["lines"]) == 2
    here = found["vt"].critical_speeds("benchmark", trail=0.08).min().item()
    assert here == pytest.approx(4.29238253634111, rel=1e-9)


def test_the_benchmark_passes():
    run(SCRIPTS[3])["test_critical_speeds"]()
