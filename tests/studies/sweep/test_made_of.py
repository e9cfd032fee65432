"""A result belongs to its sweep, the user's files and the versions that computed it; what has changed is said."""

import json

import pytest
from sweep_examples import MEASURED, write_file

from studies.sweep import build_sweep, compute, open_parts, read_sweep, run_sweep
from tests.shared.refusals import refuses
from tyre.ground import InputError
from tyre.maps import TyreMap

SMALL = {"outputs": ["max_growth_rate"], "grid": {"speed_m_s": [3.0], "c": [0.06, 0.08]}}


@pytest.mark.parametrize("suffix", ["csv", "toml"])
def test_an_edited_tyre_file_does_not_continue_an_old_result(tmp_path, suffix):
    TyreMap.load("Tyre3").to_file(tmp_path / "own.csv")
    TyreMap.load("Tyre3").to_file(tmp_path / "other.csv")
    tyre = {"tyre": "own.csv", "pressure_bar": 5.5}
    content = {"model": {"bicycle": "benchmark", "effects": {"relaxation_length": tyre}}, **SMALL}
    written, out = write_file(tmp_path, content), tmp_path / "a.zarr"
    sweep = read_sweep(written)
    open_parts(out, sweep).write((0, 1), compute(sweep, 0, 1))
    edit(tmp_path / "other.csv")
    assert read_sweep(written).fingerprint == sweep.fingerprint  # of a tyre that is not used
    edit(tmp_path / f"own.{suffix}")
    with pytest.raises(InputError, match=r"changed since: the tyre .*own\.csv\. To restart"):
        run_sweep(read_sweep(written), out)


def edit(file):
    file.write_bytes(file.read_bytes() + b"\n")


def test_what_has_changed_is_named(tmp_path):
    content, out = {"model": MEASURED, **SMALL}, tmp_path / "a.zarr"
    sweep = build_sweep(content)
    open_parts(out, sweep).write((0, 1), compute(sweep, 0, 1))
    changes = {
        "the sweep": {"grid": {"speed_m_s": [3.0], "c": [0.06, 0.09]}},
        "the model": {"model": MEASURED | {"bicycle": "pista_charlie_drops"}},
    }
    for words, change in changes.items():
        with pytest.raises(InputError, match=rf"changed since: {words}\. To restart"):
            run_sweep(build_sweep(content | change), out)
    mark = out.with_name("a.zarr.parts") / "sweep.json"
    old = json.loads(mark.read_text())
    mark.write_text(json.dumps(old | {"fingerprint": "", "made_of": old["made_of"] | {"numpy": "1.0"}}))
    refuses(r"changed since: numpy \(1\.0 before, .* now\)\. To restart", run_sweep, sweep, out)
    for text in ("{", "[]", json.dumps({"fingerprint": sweep.fingerprint})):
        mark.write_text(text)
        refuses("changed since: unknown, as its record cannot be read", run_sweep, sweep, out)
