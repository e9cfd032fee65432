"""What numba compiled is kept safely: killed, on a full disk, damaged, after a change of the source."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("numba")

from numba.core.caching import IndexDataCacheFile

from bicycle.eigenvalues import compilation

MODULE = """
from bicycle.eigenvalues.compilation import compiled

@compiled
def shifted(x):
    return x + {shift}
"""


def run(folder: Path) -> tuple[float, int]:
    """The answer of the module as it is on disk, and how many compiled functions it found."""
    content = {"__name__": "own"}
    exec(compile((folder / "own.py").read_text(), folder / "own.py", "exec"), content)
    return content["shifted"](1.0), sum(content["shifted"].stats.cache_hits.values())


def kept(folder: Path) -> list[Path]:
    return sorted((folder / "__pycache__").glob("own.shifted*.nbc"))


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "own.py").write_text(MODULE.format(shift=1))
    assert run(tmp_path) == (2.0, 0)
    return tmp_path


def test_it_is_compiled_once(folder):
    assert run(folder) == (2.0, 1)
    assert len(kept(folder)) == 1


def test_a_changed_source_of_the_same_size_and_date_is_compiled_anew_and_the_old_is_removed(folder):
    source, old = folder / "own.py", kept(folder)
    date = source.stat().st_mtime_ns
    source.write_text(MODULE.format(shift=7))
    os.utime(source, ns=(date, date))
    assert run(folder) == (8.0, 0)
    assert run(folder) == (8.0, 1)
    assert len(kept(folder)) == 1
    assert kept(folder) != old


def test_killed_between_index_and_file_nothing_old_is_taken(folder, monkeypatch):
    """numba writes the index first: the file that an index names must never be one of an older source."""

    def killed(*_):
        raise KeyboardInterrupt

    (old,) = kept(folder)
    (folder / "own.py").write_text(MODULE.format(shift=20))
    with monkeypatch.context() as patched:
        patched.setattr(IndexDataCacheFile, "_save_data", killed)
        with pytest.raises(KeyboardInterrupt):
            run(folder)
    assert old.exists()
    assert run(folder) == (21.0, 0)


FULL = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (400, 400))  # the operating system refuses to write more
sys.path.insert(0, sys.argv[1])
import own
print(own.shifted(1.0))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs limits of the operating system")
def test_a_full_disk_costs_no_result(tmp_path):
    (tmp_path / "own.py").write_text(MODULE.format(shift=1))
    done = subprocess.run([sys.executable, "-c", FULL, str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "2.0", done.stderr
    assert kept(tmp_path) == []
    assert [run(tmp_path) for _ in range(2)] == [(2.0, 0), (2.0, 1)]


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("size", [0, 20])
def test_a_cut_file_is_compiled_anew(folder, ending, size):
    (file,) = (folder / "__pycache__").glob(f"own.shifted*.{ending}")
    file.write_bytes(file.read_bytes()[:size])
    assert [run(folder) for _ in range(2)] == [(2.0, 0), (2.0, 1)]


def test_kernels_are_compiled_anew_together(monkeypatch, tmp_path):
    """One kernel calls another across files: what is kept of both goes by the text of both."""
    (tmp_path / "eigenvalues").mkdir()
    (tmp_path / "modal").mkdir()
    one, other = tmp_path / "modal" / "a_kernel.py", tmp_path / "eigenvalues" / "b_kernel.py"
    one.write_text("x = 1")
    other.write_text("y = 1")
    monkeypatch.setattr(compilation, "__file__", str(tmp_path / "eigenvalues" / "compilation.py"))
    stamps = [compilation._kernels.__wrapped__()]
    for file in (one, other):
        file.write_text("z = 2")
        stamps.append(compilation._kernels.__wrapped__())
    assert len(set(stamps)) == 3


WITHIN = """
from bicycle.eigenvalues.compilation import compiled, compiled_within

@compiled_within
def shifted(x):
    return x + 1

@compiled
def doubled(x):
    return 2 * shifted(x)
"""


def test_what_is_compiled_for_kernels_is_called_by_them_and_refused_to_python(tmp_path):
    (tmp_path / "own.py").write_text(WITHIN)
    for hits in (0, 1):
        content = {"__name__": "own"}
        exec(compile(WITHIN, tmp_path / "own.py", "exec"), content)
        assert content["doubled"](1.0) == 4.0
        assert sum(content["doubled"].stats.cache_hits.values()) == hits
        with pytest.raises(TypeError, match="shifted is compiled for other compiled functions; Python cannot call it"):
            content["shifted"](1.0)


def test_a_caller_that_is_compiled_later_takes_in_what_others_did(tmp_path):
    source = WITHIN + "\n@compiled\ndef tripled(x):\n    return 3 * shifted(x)\n"
    (tmp_path / "own.py").write_text(source)
    for callers in ({"doubled": 4.0}, {"tripled": 6.0}, {"doubled": 4.0, "tripled": 6.0}):
        content = {"__name__": "own"}
        exec(compile(source, tmp_path / "own.py", "exec"), content)
        assert {caller: content[caller](1.0) for caller in callers} == callers
    assert [sum(content[name].stats.cache_hits.values()) for name in ("doubled", "tripled")] == [1, 1]


def test_what_is_compiled_for_kernels_is_not_loaded_by_itself(tmp_path):
    """Else it takes the place of the copy that a caller has optimised: twice the time until the next start."""
    (tmp_path / "own.py").write_text(WITHIN)
    content = {"__name__": "own"}
    exec(compile(WITHIN, tmp_path / "own.py", "exec"), content)
    content["doubled"](1.0)
    for name, loaded in (("shifted", False), ("doubled", True)):
        (result,) = content[name].overloads.values()
        assert bool(result.library.get_pointer_to_function(result.fndesc.llvm_func_name)) == loaded
