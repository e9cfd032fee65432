"""The study of killed commands: the committed result, a small run, and what counts as half a file."""

import json
from pathlib import Path

import pytest

from studies.validations import killed_commands
from studies.validations._killed_inputs import COMMANDS
from studies.validations.killed_commands import LONGEST, _differences, _judge_starved, _not_whole, kept, run
from tyre.base.errors import InputError

COMMITTED = Path(__file__).parents[3] / "data" / "validation"


@pytest.mark.parametrize("name", ["killed_commands", "killed_commands_more"])
def test_the_committed_result(name):
    result = json.loads((COMMITTED / f"{name}.json").read_text())
    assert set(result["by_command"]) <= set(COMMANDS)
    for found in ("half_files", "unnamed"):
        assert result["met"][found]
    for row in result["by_command"].values():
        assert row["kills"] >= row["killed_at_work"] > 0
        assert row["reruns"] > 0


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="needs /proc")
def test_a_small_run(tmp_path, monkeypatch):
    monkeypatch.setattr(killed_commands, "prepare", lambda folder: None)  # which only others need
    result = run(out=tmp_path, seed=1, kills=2, interrupts=1, only="simulate")
    row = result["by_command"]["simulate"]
    assert (row["kills"], row["reruns"], row["interrupts"], row["starved"]) == (2, 1, 1, 3)
    assert row["found"] == []
    assert all(result["met"][key] for key in result["met"] if key != "late")  # how long it takes is no test


@pytest.mark.parametrize("folder", ["/home/me/lib/", "C:\\Users\\me\\", ""])
def test_what_is_kept_of_a_message_names_no_folder(folder):
    said = f'Traceback\n  File "{folder}inspect.py", line 865, in getdoc\n    return cleandoc(doc)\nKeyboardInterrupt\n'
    bare = said.replace(folder, "")
    assert kept(said) == bare
    last = kept("x" * 90 + "\n" + said * 20)
    assert len(last) <= LONGEST
    assert last.endswith("    return cleandoc(doc)\nKeyboardInterrupt\n")
    assert set(last.splitlines()) <= set(bare.splitlines())  # whole lines


def test_it_needs_fork(tmp_path, monkeypatch):
    monkeypatch.delattr(killed_commands.os, "fork", raising=False)
    with pytest.raises(InputError, match="needs a system with fork"):
        run(out=tmp_path, seed=1)


@pytest.mark.parametrize(
    ("name", "whole", "half"),
    [
        ("a.svg", b"<svg></svg>\n", b"<svg>"), ("a.html", b"<html></html>", b"<html>"), ("a.csv", b"a\n1\n", b"a\n1"),
        ("a.json", b'{"a": 1}', b'{"a": '), ("a.png", b"x\x00IEND\xaeB`\x82", b"x"), ("a.md", b"# a\n", b"# a\nb"),
    ],
)  # fmt: skip
def test_half_files_are_seen(tmp_path, name, whole, half):
    (tmp_path / name).write_bytes(whole)
    assert _not_whole(tmp_path / name) == ""
    (tmp_path / name).write_bytes(half)
    assert name in _not_whole(tmp_path / name)
    other = tmp_path / f".{name.split('.')[0]}.part12.{name.split('.')[1]}"
    other.write_bytes(half)
    assert _not_whole(other) == ""


def test_results_that_differ_are_named():
    assert _differences({"a": b"1", "b": b"2"}, {"a": b"1", "c": b"2"}) == ["b", "c"]


@pytest.mark.parametrize(
    ("way", "code", "said", "fault"),
    [
        ("full disk", 2, "velotyre: /a/b: File too large", ""), ("full disk", 2, "velotyre: File too large", "unnamed"),
        ("full disk", 1, "Traceback (most recent call last)", "tracebacks"), ("full disk", 0, "", "unnamed"),
        ("no home", 0, "", ""), ("no home", 2, "velotyre: out: no", "unnamed"),
    ],
)  # fmt: skip
def test_starved_commands_are_judged(way, code, said, fault):
    row = {"tracebacks": 0, "unnamed": 0, "found": []}
    _judge_starved(way, code, said, row)
    assert [key for key in ("tracebacks", "unnamed") if row[key]] == [fault] * bool(fault)
