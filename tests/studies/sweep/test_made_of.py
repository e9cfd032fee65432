"""A result belongs to its sweep, its tyre data and the source that computed it; what has changed is said."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from sweep_examples import MEASURED, MODEL, RANDOM, write_file

pytest.importorskip("zarr")
pytest.importorskip("xarray")

from studies.sweep import (
    build_sweep,
    compute,
    open_parts,
    read_sweep,
    run_sweep,
    source_digests,
)
from tyre.errors import InputError
from tyre.tyre_map import TyreMap

TYRES = Path(__file__).parents[3] / "data" / "tyres"
SPECIFICATION = "studies.sweep.specification"
SMALL = {"outputs": ["largest_growth_rate"], "grid": {"speed_m_s": [3.0], "c": [0.06, 0.08]}}


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package of two files in place of those that compute."""
    folder = tmp_path / "package"
    (folder / "inner").mkdir(parents=True)
    (folder / "one.py").write_text("A = 1\n")
    (folder / "inner" / "two.py").write_text("B = 2\n")
    (folder / "notes.txt").write_text("nothing")
    monkeypatch.setattr(f"{SPECIFICATION}.SOURCES", ("bicycle",))
    monkeypatch.setattr(f"{SPECIFICATION}.files_of", lambda name: folder)
    monkeypatch.setattr(f"{SPECIFICATION}.source_digests", source_digests.__wrapped__)
    return folder


def edit_nothing(folder):
    (folder / "notes.txt").write_text("else")
    (folder / "data").mkdir()
    (folder / "data" / "__init__.py").write_text("")
    (folder / "one.py").write_bytes(b"A = 1\r\n")


def edit_value(folder):
    (folder / "inner" / "two.py").write_text("B = 3\n")


def rename(folder):
    (folder / "one.py").rename(folder / "three.py")


@pytest.mark.parametrize(("edit", "same"), [(edit_nothing, True), (edit_value, False), (rename, False)])
def test_an_edited_package_does_not_continue_an_old_result(package, tmp_path, edit, same):
    content, out = {"model": MODEL, **SMALL}, tmp_path / "a.zarr"
    sweep = build_sweep(content)
    open_parts(out, sweep).write((0, 1), compute(sweep, 0, 1))
    whole = run_sweep(sweep, tmp_path / "whole.zarr")
    edit(package)
    again = build_sweep(content)
    if same:
        assert again.fingerprint == sweep.fingerprint
        return
    with pytest.raises(InputError, match=r"changed since: the source of bicycle\. To start anew, remove that folder"):
        run_sweep(again, out)
    with pytest.raises(InputError, match=r"\(changed since: the source of bicycle\); remove it or choose another"):
        run_sweep(again, whole)


def test_every_file_that_computes_is_read():
    found = source_digests()
    assert {f"the source of {name}" for name in ("bicycle", "tyre", "studies.outputs", "studies.sweep.worker")} < set(
        found
    )
    assert len(set(found.values())) == len(found)
    assert found.items() <= build_sweep({"model": MODEL, **SMALL}).made_of.items()


@pytest.mark.parametrize("given", ["Tyre3", "own"])
@pytest.mark.parametrize("suffix", ["csv", "toml"])
def test_an_edited_tyre_does_not_continue_an_old_result(tmp_path, monkeypatch, given, suffix):
    shutil.copytree(TYRES, tmp_path / "tyres")
    monkeypatch.setattr(f"{SPECIFICATION}.data_root", lambda: tmp_path)
    file = tmp_path / "tyres" / f"Tyre3_flat.{suffix}"
    if given == "own":
        TyreMap.load("Tyre3").to_file(tmp_path / "own.csv")
        file, given = tmp_path / f"own.{suffix}", "own.csv"
    tyre = {"tyre": given, "pressure_bar": 5.5}
    content = {"model": {"bicycle": "benchmark", "effects": {"relaxation_length": tyre}}, **SMALL}
    written, out = write_file(tmp_path, content), tmp_path / "a.zarr"
    sweep = read_sweep(written)
    open_parts(out, sweep).write((0, 1), compute(sweep, 0, 1))
    other = tmp_path / "tyres" / "Tyre1_flat.csv"
    other.write_bytes(other.read_bytes() + b"\n")
    assert read_sweep(written).fingerprint == sweep.fingerprint  # of a tyre that is not used
    file.write_bytes(file.read_bytes() + b"\n")
    with pytest.raises(InputError, match=rf"changed since: the tyre .*{given}\. To start anew"):
        run_sweep(read_sweep(written), out)


def test_what_has_changed_is_named(tmp_path):
    content, out = {"model": MEASURED, **SMALL}, tmp_path / "a.zarr"
    sweep = build_sweep(content)
    open_parts(out, sweep).write((0, 1), compute(sweep, 0, 1))
    changes = {
        "the sweep": {"grid": {"speed_m_s": [3.0], "c": [0.06, 0.09]}},
        "the model": {"model": MEASURED | {"bicycle": "pista_charlie_drops"}},
        "the model, the tyre Tyre2, the tyre Tyre1": {
            "model": {"bicycle": "benchmark", "effects": {"relaxation_length": {"tyre": "Tyre2", "pressure_bar": 4.0}}}
        },
    }
    for words, change in changes.items():
        with pytest.raises(InputError, match=rf"changed since: {words}\. To start"):
            run_sweep(build_sweep(content | change), out)
    mark = out.with_name("a.zarr.parts") / "sweep.json"
    old = json.loads(mark.read_text())
    mark.write_text(json.dumps(old | {"fingerprint": "", "made_of": old["made_of"] | {"numpy": "1.0"}}))
    with pytest.raises(InputError, match=r"changed since: numpy \(1\.0 before, .* now\)\. To start"):
        run_sweep(sweep, out)
    for text in ("{", "[]", json.dumps({"fingerprint": sweep.fingerprint})):
        mark.write_text(text)
        with pytest.raises(InputError, match="changed since: nobody knows what, as no record of it can be read"):
            run_sweep(sweep, out)


def test_a_part_of_another_place_or_sweep_is_not_taken(tmp_path):
    content = RANDOM | {"outputs": ["largest_growth_rate"]}
    sweep, other = build_sweep(content), build_sweep(content | {"seed": 8})
    parts, others = open_parts(tmp_path / "a.zarr", sweep), open_parts(tmp_path / "b.zarr", other)
    for one in (parts, others):
        one.write((0, 3), {"x": np.arange(3.0)})
    assert parts.has((0, 3))
    shutil.copy(parts.file((0, 3)), parts.file((3, 6)))
    assert not parts.has((3, 6))
    shutil.copy(others.file((0, 3)), parts.file((0, 3)))
    assert not parts.has((0, 3))
