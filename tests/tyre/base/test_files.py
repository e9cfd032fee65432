"""Files are written completely or not at all, whatever stops the writing."""

import os
import resource
import stat
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from tyre.base.files import left_by_a_killed_run, replacing, slugs, write_bytes, write_text

OLD, NEW = "the old one\n", "a new one\n" * 1000


@contextmanager
def files_no_longer_than(size):
    """As on a full disk: what is written beyond ``size`` (bytes) fails, with an error that names no file."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_disk_that_fills_up_leaves_the_old_file_and_is_named(tmp_path):
    (target := tmp_path / "t.csv").write_text(OLD)
    with pytest.raises(OSError, match="t.csv") as found, files_no_longer_than(100):
        write_text(target, NEW)
    assert found.value.filename == str(target)
    assert target.read_text() == OLD
    assert list(tmp_path.iterdir()) == [target]


def test_a_killed_process_leaves_the_old_file(tmp_path):
    (target := tmp_path / "t.csv").write_text(OLD)
    script = (
        "import os, sys\nfrom tyre.base.files import replacing\n"
        "with replacing(sys.argv[1]) as part:\n    part.write_text('half'); os.kill(os.getpid(), 9)\n"
    )
    done = subprocess.run([sys.executable, "-c", script, target], cwd=Path(__file__).parents[3], check=False)
    assert done.returncode == -9
    assert target.read_text() == OLD
    assert [left_by_a_killed_run(name) for name in sorted(os.listdir(tmp_path))] == [True, False]


@pytest.mark.parametrize("name", ["t.csv", ".hidden", "part1.csv", ".partial.csv", ".part12"])
def test_files_of_others_are_not_taken_for_leftovers(name):
    assert not left_by_a_killed_run(name)


def test_a_link_stays_a_link_and_permissions_stay(tmp_path):
    (target := tmp_path / "t.csv").write_text(OLD)
    target.chmod(0o640)
    (link := tmp_path / "link.csv").symlink_to(target)
    write_bytes(link, NEW.encode())
    assert link.is_symlink()
    assert target.read_text() == NEW
    assert stat.S_IMODE(target.stat().st_mode) == 0o640


def test_a_device_is_written_and_not_replaced():
    write_text("/dev/null", NEW)
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)


def test_a_full_device_is_named():
    with pytest.raises(OSError, match="/dev/full"):
        write_text("/dev/full", NEW)


def test_an_error_of_the_writer_leaves_nothing(tmp_path):
    def write():
        with replacing(tmp_path / "t.csv") as part:
            part.write_text("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        write()
    assert list(tmp_path.iterdir()) == []


def test_a_folder_and_a_missing_folder_are_named(tmp_path):
    with pytest.raises(IsADirectoryError, match="is a folder; give a file"):
        write_text(tmp_path, NEW)
    with pytest.raises(FileNotFoundError, match="no_folder/t.csv"):
        write_text(tmp_path / "no_folder" / "t.csv", NEW)


def test_names_fit_for_files_are_never_alike():
    names = ["a b", "a_b", "A-B", "a/b", "A B", "a b", "a_b_2", ""]
    stems = slugs(names)
    assert list(stems) == list(dict.fromkeys(names))
    assert len({stem.casefold() for stem in stems.values()}) == len(stems)
    assert stems["a b"] == "a_b"
    assert stems["a_b"] == "a_b_2"
