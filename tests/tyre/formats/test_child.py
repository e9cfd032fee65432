"""Foreign files are read in a child: what it gives, what it may take, and how its end is told."""

import os
import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from tyre.formats import Reading, contents, limits, read_signals
from tyre.ground import InputError

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="other systems read in the process itself")
ROOT = Path(__file__).parents[3]


def write_hdf5(path, **columns):
    import h5py

    with h5py.File(path, "w") as file:
        for name, x in columns.items():
            file[name] = x
    return path


def test_numbers_names_and_words_come_back_as_they_are_read_here(tmp_path, monkeypatch):
    x = np.array([1.5, -0.0, np.nan, np.inf, 5e-324, 1.7976931348623157e308])
    path = write_hdf5(tmp_path / "a.h5", größe=x, tail=np.arange(6))
    apart = read_signals(path)
    monkeypatch.setattr("tyre.formats.child.apart", lambda: False)
    here = read_signals(path)
    assert apart.columns == here.columns
    for name, one in here.signals.items():
        assert apart[name].values.tobytes() == one.values.tobytes()
        assert apart[name].values.flags.writeable  # units are converted in place
    assert apart["größe"].values.tobytes() == x.tobytes()


def test_the_first_samples_and_a_path_beside_the_working_folder(tmp_path, monkeypatch):
    write_hdf5(tmp_path / "a.h5", x=np.arange(1000.0))
    monkeypatch.chdir(tmp_path)
    np.testing.assert_array_equal(read_signals("a.h5", most=3)["x"].values, [0, 1, 2])
    (tmp_path / "b").mkdir()
    monkeypatch.chdir(tmp_path / "b")
    with pytest.raises(InputError, match=r"^a\.h5: no such recording"):
        read_signals("a.h5")
    write_hdf5(tmp_path / "b" / "a.h5", x=np.arange(5.0))
    assert read_signals("a.h5")["x"].values.size == 5


def test_a_file_written_anew_is_read_anew(tmp_path):
    path = write_hdf5(tmp_path / "a.h5", x=np.zeros(4))
    found = contents(path)
    os.utime(write_hdf5(path, x=np.ones(4)), ns=(1, 1))
    (one,) = found.load(["x"], None)
    np.testing.assert_array_equal(one.values, np.ones(4))


def begin(code, name="a.h5"):
    """Run ``code`` in a process that is limited as the child is for a small file."""
    script = "from pathlib import Path\nfrom tyre.formats.channel_map import Reading\n"
    script += "from tyre.formats.limits import limit\n"
    script += f"limit(Path({name!r}), Reading())\n{code}"
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT, check=False)


def test_more_memory_than_is_allowed_is_an_error_not_a_swap():
    shown = begin("try:\n    bytearray(900_000_000)\nexcept MemoryError:\n    print('refused')")
    assert shown.stdout == "refused\n"


def test_limits_that_are_lower_already_stay():
    code = "import resource; print(resource.getrlimit(resource.RLIMIT_AS), resource.getrlimit(resource.RLIMIT_FSIZE))"
    script = "import resource\nfor kind in (resource.RLIMIT_AS, resource.RLIMIT_FSIZE):\n"
    script += "    resource.setrlimit(kind, (600_000_000,) * 2)\n"
    script += (
        "from pathlib import Path\nfrom tyre.formats.channel_map import Reading\nfrom tyre.formats import limits\n"
    )
    script += f"limits.MDF = ('.h5',)\nlimits.limit(Path('a.h5'), Reading())\n{code}"
    shown = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT, check=True)
    assert shown.stdout == "(600000000, 600000000) (600000000, 600000000)\n"


def test_what_a_file_may_take_grows_with_its_size(tmp_path):
    small = tmp_path / "a.h5"
    small.write_bytes(b"")
    assert limits.allowance((3, 1e-5, 60), small, Reading()) == 3
    large = tmp_path / "b.dbc"
    large.write_bytes(bytes(1_000_000))
    assert limits.allowance((3, 1e-5, 60), small, Reading(dbc=(large,))) == 13
    assert limits.allowance((3, 1e-5, 5), small, Reading(dbc=(large,))) == 5


def test_no_file_grows_but_those_of_mdf(tmp_path):
    code = "with open({!r}, 'wb', 0) as file:\n    file.write(b'x')"
    begin(code.format(str(tmp_path / "a")))
    begin(code.format(str(tmp_path / "b")), name="a.mf4")
    assert {one.name: one.stat().st_size for one in tmp_path.iterdir()} == {"a": 0, "b": 1}


def children(parent=None):
    """Processes below a ``parent``, by default this one, that read files."""
    found = []
    for status in Path("/proc").glob("[0-9]*/status"):
        with suppress(OSError):  # one that ended meanwhile
            if f"PPid:\t{parent or os.getpid()}\n" in status.read_text():
                found += [int(status.parent.name)] * (b"child.serve" in (status.parent / "cmdline").read_bytes())
    return sorted(found)


def test_a_child_that_was_killed_between_two_files_is_replaced(tmp_path):
    path = write_hdf5(tmp_path / "a.h5", x=np.zeros(4))
    contents(path)
    before = children()
    assert before
    for one in before:
        os.kill(one, signal.SIGKILL)
        os.waitid(os.P_PID, one, os.WEXITED | os.WNOWAIT)  # its threads end after it
    assert contents(path).columns[0].name == "x"
    assert not set(before) & set(children())


@pytest.mark.parametrize(("ending", "words"), [
    ("while True: pass", r"a\.h5: cannot be read: it takes more than 1 s, or more memory than there is; is it"),
    ("import os; os.abort()", r"a\.h5: cannot be read: its library failed \(SIGABRT\); is it damaged"),
    ("import os; os._exit(3)", r"a\.h5: cannot be read: its library failed \(code 3\)"),
    ("raise MemoryError", r"a\.h5: takes more memory than is allowed; map fewer channels or cut the file"),
    ("print('{}'); raise OSError('bad file')", r"cannot be read as \.h5 \(OSError: bad file\).*damaged, cut off, or"),
])  # fmt: skip
def test_a_library_that_fails_ends_in_one_line(tmp_path, ending, words):
    """With a library h5py of our own, in a process of its own."""
    (tmp_path / "h5py").mkdir()
    (tmp_path / "h5py" / "__init__.py").write_text(f"def File(*rest):\n    {ending}\n")
    (tmp_path / "a.h5").write_bytes(b"")
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n"
        "from tyre.formats import child, contents\n"
        "from tyre.ground.errors import InputError\n"
        "try:\n    contents('a.h5')\nexcept InputError as error:\n    print(error)\n"
    )
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    if "while" in ending:
        code = code.replace("\ntry", "\nchild.CLOCK = 1.0; child.PROCESSOR = (1, 0, 1)\ntry")
    shown = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True,
                           env=environment)  # fmt: skip
    (line,) = shown.stdout.splitlines()
    assert shown.stderr == ""
    assert re.search(words, line)


def test_a_child_at_work_ends_with_the_process_that_asked(tmp_path):
    (tmp_path / "h5py").mkdir()
    (tmp_path / "h5py" / "__init__.py").write_text("def File(*rest):\n    while True: pass\n")
    (tmp_path / "a.h5").write_bytes(b"")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r})\nfrom tyre.formats import contents; contents('a.h5')"
    with subprocess.Popen(
        [sys.executable, "-c", code], cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)}
    ) as one:
        while not (found := children(one.pid)):
            time.sleep(0.05)
        time.sleep(0.5)
        one.kill()
    for _ in range(100):
        if not any(Path(f"/proc/{pid}").exists() for pid in found):
            return
        time.sleep(0.1)
    pytest.fail("the child went on")


def test_a_folder_of_files_is_read_by_one_child_in_little_time(tmp_path):
    paths = [write_hdf5(tmp_path / f"{k}.h5", x=np.arange(1000.0)) for k in range(20)]
    read_signals(paths[0])
    before, start = children(), time.process_time()
    for path in paths:
        read_signals(path)
    assert children() == before
    assert before
    assert time.process_time() - start < 0.1 * len(paths)  # of this process
