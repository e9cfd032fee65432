"""Files are written completely or not at all; TOML files and folders that are refused; ends of paths."""

import errno
import os
import resource
import stat
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.shared.refusals import refuses
from tyre.ground import (
    InputError,
    files_below,
    left_by_a_killed_run,
    make_folder,
    named_folder,
    own_ends,
    read_toml,
    slugs,
    write_bytes,
    write_text,
)

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


def test_a_file_that_cannot_be_begun_is_named_as_asked(tmp_path):
    target = tmp_path / "missing" / "t.csv"
    with pytest.raises(FileNotFoundError) as found:
        write_text(target, NEW)
    assert found.value.filename == str(target)  # not the hidden part of it


def test_a_file_on_a_read_only_disk_is_named_as_asked(tmp_path, monkeypatch):
    """Such a disk refuses to write a file, and to remove one even where there is none."""

    def refuses_to(path, *args, **settings):
        raise OSError(errno.EROFS, "Read-only file system", str(path))

    for action in ("open", "unlink"):
        monkeypatch.setattr(Path, action, refuses_to)
    target = tmp_path / "t.csv"
    with pytest.raises(OSError, match="Read-only") as found:
        write_text(target, NEW)
    assert found.value.filename == str(target)  # not the hidden part of it


def test_a_killed_process_leaves_the_old_file(tmp_path):
    (target := tmp_path / "t.csv").write_text(OLD)
    script = (
        "import os, sys\nfrom tyre.ground.files import replacing\n"
        "with replacing(sys.argv[1]) as part:\n    part.write_text('half'); os.kill(os.getpid(), 9)\n"
    )
    done = subprocess.run([sys.executable, "-c", script, target], cwd=Path(__file__).parents[3], check=False)
    assert done.returncode == -9
    assert target.read_text() == OLD
    assert [left_by_a_killed_run(name) for name in sorted(os.listdir(tmp_path))] == [True, False]


@pytest.mark.parametrize("below", ["", "below/it"])
def test_a_folder_for_results_where_a_file_or_a_dead_link_is(tmp_path, below):
    (tmp_path / "file").write_text(OLD)
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    refuses("file is a file; give a folder for the results", make_folder, tmp_path / "file" / below)
    for name in ("link", "loop"):
        refuses(f"{name} is a link that leads nowhere; give a folder", make_folder, tmp_path / name / below)
    (tmp_path / "real").mkdir()
    (tmp_path / "way").symlink_to(tmp_path / "real")
    make_folder(tmp_path / "way" / "a" / below)
    assert (tmp_path / "real" / "a" / below).is_dir()


def test_permissions_stay(tmp_path):
    (target := tmp_path / "t.csv").write_text(OLD)
    target.chmod(0o640)
    write_bytes(target, NEW.encode())
    assert target.read_text() == NEW
    assert stat.S_IMODE(target.stat().st_mode) == 0o640


@pytest.mark.parametrize("missing", [False, True])
def test_a_link_is_replaced_and_what_it_names_stays(tmp_path, missing):
    target = tmp_path / "precious.csv"
    if not missing:
        target.write_text(OLD)
    (link := tmp_path / "link.csv").symlink_to(target)
    write_text(link, NEW)
    assert not link.is_symlink()
    assert link.read_text() == NEW
    assert (target.read_text() == OLD) if target.exists() else missing


def test_standard_output_sent_to_a_file_is_written_through(tmp_path):
    script = "from tyre.ground.files import write_text\nwrite_text('/dev/stdout', 'new')\n"
    with (tmp_path / "t.txt").open("wb") as output:
        subprocess.run([sys.executable, "-c", script], cwd=Path(__file__).parents[3], check=True, stdout=output)
    assert (tmp_path / "t.txt").read_text() == "new"
    assert Path("/dev/stdout").is_symlink()


def test_a_device_is_written_and_not_replaced():
    write_text("/dev/null", NEW)
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)


def test_a_folder_and_a_missing_folder_are_named(tmp_path):
    for folder in (tmp_path, "/", "."):
        with pytest.raises(IsADirectoryError, match="is a folder; give a file"):
            write_text(folder, NEW)
    with pytest.raises(FileNotFoundError, match="there is no folder .*no_folder; make it first: .*no_folder/t.csv"):
        write_text(tmp_path / "no_folder" / "t.csv", NEW)


def test_names_fit_for_files_are_never_alike():
    names = ["a b", "a_b", "A-B", "a/b", "A B", "a b", "a_b_2", ""]
    stems = slugs(names)
    assert list(stems) == list(dict.fromkeys(names))
    assert len({stem.casefold() for stem in stems.values()}) == len(stems)
    assert stems["a b"] == "a_b"
    assert stems["a_b"] == "a_b_2"


def test_a_byte_order_mark_and_windows_lines_are_read(tmp_path):
    path = tmp_path / "a.toml"
    path.write_bytes(b"\xef\xbb\xbfa = 1\r\nb = 2\r\n")
    assert read_toml(path, "model file") == {"a": 1, "b": 2}


@pytest.mark.parametrize(("content", "words"), [
    (None, r"a\.toml: no such model file"),
    (b"a = ", r"a\.toml: not a TOML file: Invalid value \(at end of document\)"),
    (b"a = 1\na = 2", r"a\.toml: not a TOML file: Cannot overwrite a value"),
    (b'a = "\xff"', r"a\.toml: not a TOML file: 'utf-8' codec"),
    (b"a = " + b"9" * 5000, r"a\.toml: not a TOML file: Exceeds the limit .* value has 5000 digits"),
    (b"a = " + b"[" * 5000, r"a\.toml: not a TOML file: maximum recursion depth"),
])  # fmt: skip
def test_what_is_no_toml_file(tmp_path, content, words):
    path = tmp_path / "a.toml"
    if content is not None:
        path.write_bytes(content)
    refuses(words, read_toml, path, "model file")


def test_a_pipe_is_refused_before_it_is_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    with pytest.raises(InputError, match=r"pipe.toml: is a pipe or a device; write what comes out of it to a file"):
        read_toml(tmp_path / "pipe.toml", "model file")
    refuses(r"/dev/zero: is a pipe or a device", read_toml, Path("/dev/zero"), "model file")


PARTS = st.lists(st.sampled_from("abc"), min_size=1, max_size=4).map(lambda parts: Path(*parts))


@given(st.lists(PARTS, max_size=6))
def test_no_two_are_alike_and_each_is_the_end_of_its_path(files):
    ends = own_ends(files)
    assert set(ends) == set(files)
    assert len(set(ends.values())) == len(ends)
    assert all(file.as_posix().endswith(end) for file, end in ends.items())


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A project of three folders beside something that is none of its business, and the working folder elsewhere."""
    for folder in ("project/measurements/runs", "project/fit", "elsewhere", "other"):
        (tmp_path / folder).mkdir(parents=True)
    for file in ("project/measurements/runs/a.csv", "project/fit/b.csv", "elsewhere/secret.csv"):
        (tmp_path / file).write_text("x\n1\n")
    monkeypatch.chdir(tmp_path / "other")
    (tmp_path / "project/measurements/link.csv").symlink_to(tmp_path / "elsewhere/secret.csv")
    (tmp_path / "project/measurements/way").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "project/measurements/near.csv").symlink_to(tmp_path / "project/fit/b.csv")
    return tmp_path / "project/measurements/m.toml"


def name_in(file, text):
    file.write_text(f"[a]\nb = [{{file = '{text}'}}]\n")
    return read_toml(file, "measurement file")


OUTSIDE = [
    "../../elsewhere/secret.csv", "/etc/passwd", "/etc", "/etc/*", "link.csv", "way/secret.csv", "way/*.csv",
    "runs/../../../elsewhere/secret.csv", "*/../../../elsewhere/*.csv", "../../none.csv", "runs/../../..",
]  # fmt: skip


@pytest.mark.parametrize("text", OUTSIDE)
def test_a_file_names_nothing_outside(project, text):
    refuses(r"m\.toml: names '.*', which lies outside its folder and the one above; copy", name_in, project, text)


@pytest.mark.parametrize("text", [
    "runs/a.csv", "runs", "../fit/b.csv", "near.csv", "runs/*.csv", "none.csv", "/", "..", ".", "1/s", "", "a" * 5000,
    "/no/such/file", "a / b", "../fit/../fit/b.csv",
])  # fmt: skip
def test_what_belongs_to_a_project_and_what_is_no_file_may_be_named(project, text):
    assert name_in(project, text) == {"a": {"b": [{"file": text}]}}


@pytest.mark.parametrize("how", ["working folder", "environment"])
def test_a_folder_that_the_user_names_is_open(project, monkeypatch, how):
    if how == "working folder":
        monkeypatch.chdir(project.parents[2])
    else:
        monkeypatch.setenv("VELOTYRE_FOLDER", str(project.parents[2] / "elsewhere"))
    for text in ("../../elsewhere/secret.csv", "link.csv", str(project.parents[2] / "elsewhere")):
        assert name_in(project, text)
    refuses("names '/etc/passwd'", name_in, project, "/etc/passwd")


@pytest.mark.parametrize("wide", ["home", "root"])
def test_neither_home_nor_root_become_open_by_lying_above(project, monkeypatch, wide):
    above = project.parent.parent
    monkeypatch.setenv("HOME", str(above))
    monkeypatch.chdir(above if wide == "home" else "/")
    refuses(r"names '\.\./fit/b\.csv'", name_in, project, "../fit/b.csv")


def test_words_on_a_file_itself_may_hold_any_path(project):
    project.write_text('source = "/etc/passwd"\n[x]\nnote = ["/etc/passwd"]\n')
    assert read_toml(project, "sidecar")["source"] == "/etc/passwd"


def test_a_variable_names_a_folder_that_is_not_left(project, monkeypatch):
    monkeypatch.setenv("RUNS", str(project.parent))
    assert named_folder("$RUNS/runs", project.parent) == project.parent / "runs"
    monkeypatch.setenv("HOME", str(project.parent))
    for text in ("$HOME/runs", "$RUNS/runs"):  # its own folder is a home now
        refuses("the variable must name a folder, not a home or a disk", named_folder, text, project.parent)
    monkeypatch.setenv("RUNS", str(project.parent / "runs"))
    refuses("the variable must name a folder", named_folder, "$RUNS/../../../elsewhere", project.parent)


@pytest.mark.parametrize(("text", "words"), [
    ("a = " + "[" * 49 + "]" * 49, ""),
    ("[" + ".".join(["a"] * 60) + "]", "lists or tables are more than 50 deep"),
    ("a." + ".".join(["a"] * 5000) + " = 1", "lists or tables are more than 50 deep"),
    ("#" * 1_000_001, "1000001 bytes are no model file, which holds at most 1000000"),
    ("#" * 1_000_000, ""),
])  # fmt: skip
def test_files_that_no_one_writes_are_refused(text, words, tmp_path):
    (tmp_path / "m.toml").write_text(text)
    if not words:
        read_toml(tmp_path / "m.toml", "model file")
        return
    refuses(words, read_toml, tmp_path / "m.toml", "model file")


def test_a_folder_of_too_many_files_is_refused(tmp_path):
    for name in "cab":
        (tmp_path / name).touch()
    assert [path.name for path in files_below(tmp_path, most=3)] == ["a", "b", "c"]
    with pytest.raises(InputError, match="holds more than 2 files and folders; give a folder of what is meant alone"):
        files_below(tmp_path, most=2)


def test_a_row_of_a_table_behind_a_symbolic_link_is_outside_too(tmp_path, monkeypatch):
    """``two.csv#A`` names the file two.csv, which may be a link to anywhere."""
    (tmp_path / "secret").mkdir()
    (tmp_path / "secret" / "two.csv").write_text("x")
    folder = tmp_path / "project" / "models"
    folder.mkdir(parents=True)
    (folder / "two.csv").symlink_to(tmp_path / "secret" / "two.csv")
    monkeypatch.chdir(folder)
    for name in ("two.csv", "two.csv#A"):
        (folder / "model.toml").write_text(f'tyre = "{name}"\n')
        refuses("names 'two.csv', which lies outside its folder", read_toml, folder / "model.toml", "model file")
