"""The manifest of a folder of results, and what the next command says of a folder that was left half finished."""

import hashlib
import json
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest

from studies.cli import main
from studies.reporting.manifest import inputs, results, unfinished
from tyre.base.errors import InputError

ASKED = ["sensitivity", "benchmark", "--mode", "weave", "--speed", "5", "--out"]


def entry(name, file):
    content = file.read_bytes()
    return {"file": name, "bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}


def test_a_manifest_lists_what_was_written(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "of_the_user.txt").write_text("there before")
    main([*ASKED, str(out)])
    found = json.loads((out / "sensitivity.manifest.json").read_text())
    assert found["command"] == f"velotyre sensitivity benchmark --mode weave --speed 5 --out {out}"
    assert found["finished"] is True
    assert found["versions"]["numpy"] == version("numpy")
    names = ["sensitivity.csv", "tornado.png", "tornado.svg"]
    assert found["files"] == [entry(name, out / name) for name in names]
    first = (out / "sensitivity.manifest.json").read_bytes()
    main([*ASKED, str(out)])
    assert (out / "sensitivity.manifest.json").read_bytes() == first


def test_a_folder_that_a_killed_command_left_is_said(tmp_path, capsys):
    out = tmp_path / "out"
    script = (
        "import os, sys\nfrom studies.cli import main\nimport studies.sensitivity.tornado as tornado\n"
        "from tyre.base.files import replacing\n"
        "def draw(*args, **options):\n"
        "    with replacing(args[1].with_suffix('.png')) as part:\n"
        "        part.write_text('half'); os.kill(os.getpid(), 9)\n"
        "tornado.draw_tornado = draw\nmain(sys.argv[1:])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, *ASKED, out], cwd=Path(__file__).parents[3], check=False, capture_output=True
    )
    assert done.returncode == -9, done.stderr
    left = {file.name for file in out.iterdir()}
    assert {"sensitivity.csv", "sensitivity.manifest.json"} < left
    assert len(left) == 3  # and a half picture under a name of its own
    assert unfinished(out / "sensitivity.manifest.json").startswith("velotyre sensitivity benchmark")

    capsys.readouterr()
    main([*ASKED, str(out)])
    said = capsys.readouterr().err
    assert f"warning: {out}: an earlier velotyre sensitivity benchmark --mode weave" in said
    assert "did not finish; what it left there is replaced file by file" in said
    assert {file.name for file in out.iterdir()} == {
        "sensitivity.csv", "sensitivity.manifest.json", "tornado.png", "tornado.svg"
    }  # fmt: skip
    main([*ASKED, str(out)])
    assert "did not finish" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ('{"command": "velotyre run", "finished": true}', None),
        ('{"command": "velotyre run", "finished": false}', "velotyre run"),
        ("", "command"),
        ("[]", "command"),
        ("{}", "command"),
        ('{"command": "velotyre run", "fin', "command"),
    ],
)
def test_what_a_manifest_says(tmp_path, content, said):
    (manifest := tmp_path / "run.manifest.json").write_text(content)
    assert unfinished(manifest) == said
    assert unfinished(tmp_path / "none.json") is None


def test_inputs_are_followed(tmp_path):
    out = tmp_path / "out"
    for name in (
        "campaign/a.csv",
        "campaign/deep/b.csv",
        "out/old.csv",
        "m.toml",
        "t.csv",
        "t.toml",
        "run.csv",
        "o.toml",
    ):
        (tmp_path / name).parent.mkdir(exist_ok=True, parents=True)
        (tmp_path / name).write_text("")
    (tmp_path / "m.toml").write_text(
        'kind = "modal"\n[modal]\ntable = "t.csv"\n[[part]]\nfile = ["m.toml", "no.csv"]\n'
    )
    arguments = ["diagnose", tmp_path / "m.toml", f"--effects={tmp_path}/o.toml", f"{tmp_path}/run.csv@4.8",
                 tmp_path / "campaign", out / "old.csv", "nul\0", "x" * 5000]  # fmt: skip
    found = [str(file.relative_to(tmp_path)) for file in inputs([str(a) for a in arguments], outside=out)]
    assert found == ["m.toml", "t.csv", "t.toml", "o.toml", "run.csv", "campaign/a.csv", "campaign/deep/b.csv"]


@pytest.mark.parametrize("there", [False, True])
def test_a_command_that_is_refused_before_it_writes_leaves_nothing(tmp_path, there):
    out = tmp_path / "out"
    if there:
        out.mkdir()
        (out / "of_the_user.txt").write_text("there before")
    with pytest.raises(ValueError, match="refused"), results(out):
        raise ValueError("refused")
    assert out.exists() == there
    assert not list(out.glob("*.json"))
    with pytest.raises(UnicodeEncodeError), results(out):
        (out / "half.csv").write_text("1\ud800", encoding="utf-8")
    assert unfinished(out / "velotyre.manifest.json") == "velotyre"


@pytest.mark.parametrize(
    "asked",
    [
        ["look", "ride.csv"],
        ["modal", "ride.csv@5", "--figures"],
        ["chart", "benchmark", "--x", "speed=5:7", "--y", "c=0.07:0.08"],
    ],
)
def test_commands_that_write_several_files_write_a_manifest(tmp_path, monkeypatch, asked):
    monkeypatch.chdir(tmp_path)
    time = np.arange(0, 6, 0.01)
    rows = "".join(f"{t:.2f},{x:.4f}\n" for t, x in zip(time, np.exp(-0.8 * time) * np.cos(6 * time), strict=True))
    Path("ride.csv").write_text(f"time_s,roll_rate_rad_s\n{rows}")
    main([*asked, *(["out"] if asked[-1] == "--figures" else ["--out", "out"])])
    found = json.loads(Path(f"out/{asked[0]}.manifest.json").read_text())
    assert found["finished"] is True
    assert {entry["file"] for entry in found["files"]} == {p.name for p in Path("out").iterdir()} - {
        f"{asked[0]}.manifest.json"
    }


def test_a_file_in_the_place_of_the_folder(tmp_path):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(InputError, match="out is a file; give a folder for the results"), results(tmp_path / "out"):
        pass
