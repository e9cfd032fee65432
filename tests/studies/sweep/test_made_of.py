"""A result belongs to its sweep, its tyre data and the source that computed it; what has changed is said."""

import json
import shutil
from pathlib import Path

import pytest
from sweep_examples import MEASURED, MODEL, write_file

from studies.sweep import build_sweep, compute, open_parts, read_sweep, run_sweep, source_digests
from tests.shared.refusals import refuses
from tyre.ground import InputError
from tyre.maps import TyreMap

TYRES = Path(__file__).parents[3] / "data" / "tyres"
SPECIFICATION = "studies.sweep.specification"
SMALL = {"outputs": ["largest_growth_rate"], "grid": {"speed_m_s": [3.0], "c": [0.06, 0.08]}}


def test_every_file_that_computes_is_read():
    found = source_digests()
    assert {
        f"the source of {name}" for name in ("bicycle", "tyre", "studies.model_space.outputs", "studies.sweep.worker")
    } < set(found)
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
    refuses(r"changed since: numpy \(1\.0 before, .* now\)\. To start", run_sweep, sweep, out)
    for text in ("{", "[]", json.dumps({"fingerprint": sweep.fingerprint})):
        mark.write_text(text)
        refuses("changed since: nobody knows what, as no record of it can be read", run_sweep, sweep, out)
