"""Files written completely or not at all, notes folded by subject, progress on terminals, how far a map reaches."""

import io
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

from tyre import TyreMap
from tyre.base.files import replacing, write_text
from tyre.base.notes import Note, extrapolated, folded
from tyre.base.progress import progress_bar, progress_told
from tyre.tyre_source import out_of_reach

ROOT = Path(__file__).parents[3]


def interrupted(target: Path) -> None:
    with replacing(target) as part:
        part.write_text("half of the n")
        raise KeyboardInterrupt


def test_an_interrupted_write_leaves_the_old_file(tmp_path):
    target = tmp_path / "result.csv"
    write_text(target, "old\n")
    with pytest.raises(KeyboardInterrupt):
        interrupted(target)
    assert target.read_text() == "old\n"
    assert [path.name for path in tmp_path.iterdir()] == ["result.csv"]
    write_text(target, "new °\n")
    assert target.read_bytes() == "new °\n".encode()


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(OSError, match="none/result.csv"):
        write_text(tmp_path / "none" / "result.csv", "x")
    with pytest.raises(IsADirectoryError, match="is a folder; give a file"):
        write_text(tmp_path, "x")


def test_the_ending_is_kept_for_writers_that_go_by_it(tmp_path):
    with replacing(tmp_path / "figure.svg") as part:
        assert part.suffix == ".svg"
        part.write_text("<svg/>")
    assert (tmp_path / "figure.svg").read_text() == "<svg/>"


def test_notes_on_one_subject_are_one_line():
    notes = [
        Note("T (rear): a", "T", "rear 400 N, measured"), "plain", Note("T (rear): b", "T", "rear 400 N, measured"),
        Note("U: c", "U", "front"), "plain",
    ]  # fmt: skip
    assert folded(notes) == ["T (rear 400 N, measured): 2 notes, --verbose shows them", "plain", "U: c", "plain"]
    assert folded([]) == []


def test_a_note_is_a_sentence_that_keeps_its_subject():
    note = Note("Tyre1: none is assumed", "Tyre1", "rear", inside=False)
    changed = note.replace("none", "2 %")
    assert changed == "Tyre1: 2 % is assumed"
    assert (changed.subject, changed.headline, changed.inside) == ("Tyre1", "rear", False)
    again = pickle.loads(pickle.dumps(note))
    assert (again, again.subject, again.inside) == (note, "Tyre1", False)
    assert extrapolated(["plain", note])
    assert not extrapolated(["extrapolated", Note("extrapolated", "T", "extrapolated")])  # said, not parsed


def test_no_progress_bar_where_standard_error_is_no_terminal(monkeypatch):
    silent = io.StringIO()
    monkeypatch.setattr(sys, "stderr", silent)
    assert list(progress_bar(range(3), desc="work")) == [0, 1, 2]
    assert silent.getvalue() == ""

    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    for show in (True, False):
        screen = Terminal()
        monkeypatch.setattr(sys, "stderr", screen)
        assert list(progress_bar(range(3), desc="work", show=show)) == [0, 1, 2]
        assert ("work" in screen.getvalue()) == show


def test_a_progress_bar_tells_who_listens_in_place_of_a_terminal(monkeypatch):
    screen, told = io.StringIO(), []
    monkeypatch.setattr(sys, "stderr", screen)
    with progress_told(told.append):
        with progress_bar(desc="work", unit=" fits", mininterval=0) as bar:
            bar.set_postfix_str("damper", refresh=False)
            bar.update(3)
        assert list(progress_bar(range(2), show=False)) == [0, 1]
    assert [(one["prefix"], one["n"], one["unit"]) for one in told][-1] == ("work", 3, " fits")
    assert told[-1]["postfix"] == "damper"
    count = len(told)
    assert list(progress_bar(range(2), desc="after")) == [0, 1]
    assert (len(told), screen.getvalue()) == (count, "")


def test_every_progress_bar_is_that_one():
    shown = subprocess.run(
        ["grep", "-rlE", "import tqdm|from tqdm", "--include=*.py", "tyre", "bicycle", "studies"],
        capture_output=True, text=True, cwd=ROOT,
    ).stdout  # fmt: skip
    assert shown.split() == ["tyre/base/progress.py"]


@pytest.mark.parametrize(
    ("load", "bar", "words"),
    [
        (340.0, 5.5, None),
        (190.0, 5.5, None),  # 340 - (490 - 340)
        (
            189.0,
            5.5,
            "189 N is farther outside the 340-490 N at which Tyre1 on flat was measured than that range is wide",
        ),
        (640.0, 11.5, None),
        (641.0, 5.5, "641 N"),
        (400.0, 11.6, "11.6 bar is farther outside the 3.5-7.5 bar"),
        (400.0, 0.1, None),  # 3.4 bar below, within 4 bar
    ],
)
def test_out_of_reach_is_farther_outside_than_the_range_is_wide(load, bar, words):
    said = out_of_reach(TyreMap.load("Tyre1"), load=load, pressure=bar * 1e5)
    assert (said is None) == (words is None)
    assert words is None or words in str(said)
