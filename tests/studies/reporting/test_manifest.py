"""The manifest of a folder of results, and what the next command says of a folder that was left half finished."""

import hashlib
import json
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from threading import Timer

import pytest

from studies.cli import main
from studies.reporting import inputs, results, unfinished_command
from tyre.ground import InputError

ASKED = ["simulate", "benchmark", "--speed", "5", "--initial", "lean=0.02", "--duration", "0.1", "--out"]
WRITTEN = ["response.png", "response.svg", "response_linear.csv"]


def entry(name, file):
    content = file.read_bytes()
    return {"file": name, "bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}


def test_a_manifest_lists_what_was_written(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "of_the_user.txt").write_text("there before")
    main([*ASKED, str(out)])
    found = json.loads((out / "simulate.manifest.json").read_text())
    assert found["command"] == f"velotyre {' '.join(ASKED)} {out}"
    assert found["finished"] is True
    assert found["versions"]["numpy"] == version("numpy")
    assert found["files"] == [entry(name, out / name) for name in WRITTEN]
    first = (out / "simulate.manifest.json").read_bytes()
    main([*ASKED, str(out)])
    assert (out / "simulate.manifest.json").read_bytes() == first


def test_a_folder_that_a_killed_command_left_is_said(tmp_path, capsys):
    out = tmp_path / "out"
    script = (
        "import os, sys\nfrom studies.cli import main\nimport studies.reporting.output\n"
        "from tyre.ground.files import replacing\n"
        "def write(frame, file):\n"
        "    file.with_name('first.csv').write_text('whole')\n"
        "    with replacing(file) as part:\n"
        "        part.write_text('half'); os.kill(os.getpid(), 9)\n"
        "studies.reporting.output.write_csv = write\nmain(sys.argv[1:])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, *ASKED, out], cwd=Path(__file__).parents[3], check=False, capture_output=True
    )
    assert done.returncode == -9, done.stderr
    left = {file.name for file in out.iterdir()}
    assert {"first.csv", "simulate.manifest.json"} < left
    assert len(left) == 3  # and half a table under a name of its own
    assert unfinished_command(out / "simulate.manifest.json").startswith("velotyre simulate")

    capsys.readouterr()
    main([*ASKED, str(out)])
    said = capsys.readouterr().err
    assert f"warning: {out}: an earlier velotyre simulate" in said
    assert "did not finish; what it left there is replaced file by file" in said
    assert {file.name for file in out.iterdir()} == {"first.csv", "simulate.manifest.json", *WRITTEN}
    main([*ASKED, str(out)])
    assert "did not finish" not in capsys.readouterr().err


def test_a_command_waits_for_another_that_writes_into_the_same_folder(tmp_path, capsys):
    fcntl = pytest.importorskip("fcntl")
    other = os.open(tmp_path, os.O_RDONLY)
    fcntl.flock(other, fcntl.LOCK_EX)
    (tmp_path / "simulate.manifest.json").write_text('{"command": "velotyre simulate", "finished": false}')
    (part := tmp_path / ".a.part7.csv").touch()  # of the other one

    def finish():
        part.rename(tmp_path / "a.csv")
        (tmp_path / "simulate.manifest.json").write_text('{"command": "velotyre simulate", "finished": true}')
        os.close(other)

    (later := Timer(0.3, finish)).start()
    main([*ASKED, str(tmp_path)])
    later.join()
    _, said = capsys.readouterr().err.splitlines()  # the first line tells which model it is
    assert said == f"warning: {tmp_path}: another command is writing there; this one waits for its end"
    assert (tmp_path / "a.csv").exists()
    found = json.loads((tmp_path / "simulate.manifest.json").read_text())
    assert [one["file"] for one in found["files"]] == WRITTEN


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ('{"command": "velotyre run", "finished": true}', None),
        ('{"command": "velotyre run", "finished": false}', "velotyre run"), ("", "command"), ("[]", "command"),
        ("{}", "command"), ('{"command": "velotyre run", "fin', "command"),
    ],
)  # fmt: skip
def test_what_a_manifest_says(tmp_path, content, said):
    (manifest := tmp_path / "run.manifest.json").write_text(content)
    assert unfinished_command(manifest) == said
    assert unfinished_command(tmp_path / "none.json") is None


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
        f'kind = "modal"\ntext = "{"x" * 300}"\n[modal]\ntable = "t.csv"\n[[part]]\nfile = ["m.toml", "no.csv"]\n'
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
    assert unfinished_command(out / "velotyre.manifest.json") == "velotyre"


def test_a_file_in_the_place_of_the_folder(tmp_path):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(InputError, match="out is a file; give a folder for the results"), results(tmp_path / "out"):
        pass
