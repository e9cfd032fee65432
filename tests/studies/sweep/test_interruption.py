"""A sweep that is killed, or whose disk is full, loses nothing and ends with the same bits."""

import os
import signal
import subprocess
import sys
import warnings

import numpy as np
import pytest
from sweep_examples import RANDOM, write_file
from sweep_results import tree

from studies.sweep import build_sweep, in_loop, in_processes, in_threads, open_parts, pieces, read_sweep, run_sweep
from tyre.errors import InputError

KILLED = """
import sys
from studies.sweep import Parts
from studies.sweep import run_sweep
from studies.sweep import read_sweep
write, written = Parts.write, []
def slowly(self, piece, arrays):
    write(self, piece, arrays)
    written.append(piece)
    print(len(written), flush=True)
    if len(written) == int(sys.argv[3]):
        sys.stdin.read()  # wait for the kill
Parts.write = slowly
run_sweep(read_sweep(sys.argv[1]), sys.argv[2])
"""


def pieces_of(content):
    return list(pieces(build_sweep(content)))


def kill(program, *arguments):
    """Start a program with ``kill -9`` at the first line that it writes."""
    if not hasattr(signal, "SIGKILL"):
        pytest.skip("needs kill -9")
    command = [sys.executable, "-c", program, *map(str, arguments)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL


def test_killed_it_continues_and_ends_with_the_same_bits(reference, tmp_path):
    content = RANDOM | {"points_per_part": 300}
    file, out = write_file(tmp_path, content), tmp_path / "result.zarr"
    kill(KILLED, file, out, 1)
    parts = tmp_path / "result.zarr.parts"
    finished = {part: part.stat().st_mtime_ns for part in parts.glob("*.part")}
    assert len(finished) == 1
    assert not out.exists()
    damaged = parts / f"{pieces_of(content)[1][0]:012d}-{pieces_of(content)[1][1]:012d}.part"
    damaged.write_bytes(next(iter(finished)).read_bytes()[:500])  # what a crash of the machine may leave
    (parts / "000000000000-000000000001.tmp").write_bytes(b"half")
    seen = []
    engine = in_loop()
    run_sweep(read_sweep(file), out, engine=lambda work, todo: engine(work, [seen.append(p) or p for p in todo]))
    assert seen == pieces_of(content)[1:]
    assert tree(out) == tree(reference)
    assert not parts.exists()


@pytest.mark.parametrize("damage", [lambda b: b[:-1], lambda b: b[:200] + bytes([b[200] ^ 1]) + b[201:], lambda b: b""])
def test_a_damaged_part_is_not_taken(tmp_path, damage):
    parts = open_parts(tmp_path / "a.zarr", build_sweep(RANDOM))
    parts.write((0, 3), {"x": np.arange(3.0)})
    assert parts.has((0, 3))
    file = parts.file((0, 3))
    file.write_bytes(damage(file.read_bytes()))
    assert not parts.has((0, 3))
    with pytest.raises(InputError, match="part is missing or damaged"):
        parts.read((0, 3))


@pytest.mark.parametrize("ending", ["zarr", "nc"])
def test_killed_in_the_middle_of_putting_together(tmp_path, ending):
    """The kill comes after the second part is written into the store, and after the first array of a netCDF file."""
    pytest.importorskip("netCDF4")
    file, out = write_file(tmp_path, RANDOM | {"points_per_part": 300}), tmp_path / f"result.{ending}"
    kill(KILLED_LATER, file, out, ending)
    assert not out.exists()
    assert (tmp_path / f"result.{ending}.partial").exists()
    run_sweep(read_sweep(file), out, engine=in_threads(2))
    other = run_sweep(read_sweep(file), tmp_path / f"other.{ending}")
    assert [tree(path) for path in (out, other)] == [tree(out)] * 2
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([file.name, out.name, other.name])


KILLED_LATER = """
import sys
import netCDF4
from studies.sweep import read_sweep, result, run_sweep
module, name = {"zarr": (result, "write_rows"), "nc": (netCDF4.Dataset, "createVariable")}[sys.argv[3]]
work, calls = getattr(module, name), []
def slowly(*arguments, **settings):
    made = work(*arguments, **settings)
    calls.append(name)
    if len(calls) == 2:
        print("now", flush=True)
        sys.stdin.read()  # wait for the kill
    return made
setattr(module, name, slowly)
run_sweep(read_sweep(sys.argv[1]), sys.argv[2])
"""


def test_interrupted_it_says_what_is_kept(reference, tmp_path, capsys):
    def interrupted(work, todo):
        yield todo[0], work(*todo[0])
        raise KeyboardInterrupt

    sweep, out = build_sweep(RANDOM), tmp_path / "result.zarr"
    with pytest.raises(KeyboardInterrupt):
        run_sweep(sweep, out, engine=interrupted)
    assert "682 of 1400 bicycles are finished and kept in" in capsys.readouterr().err
    assert tree(run_sweep(sweep, out)) == tree(reference)


FULL = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[3]),) * 2)  # the operating system refuses to write more
from studies.cli import main
main(["sweep", sys.argv[1], "--out", sys.argv[2], "--workers", "1"])
"""


def refused_on_a_full_disk(file, out, size):
    """What is said last where the operating system lets no file have more than ``size`` bytes."""
    if not hasattr(os, "fork"):
        pytest.skip("needs limits of the operating system")
    command = [sys.executable, "-c", FULL, str(file), str(out), str(size)]
    process = subprocess.run(command, capture_output=True, text=True, check=False)
    assert process.returncode == 2, process.stderr
    return process.stderr.strip().splitlines()[-1]


def test_a_full_disk_is_reported_and_loses_nothing(reference, tmp_path):
    content = RANDOM | {"points_per_part": 4000}
    file, out = write_file(tmp_path, content), tmp_path / "result.zarr"
    last = pieces_of(content)[-1]
    assert last[1] - last[0] < pieces_of(content)[0][1]  # the last part is small and fits
    line = refused_on_a_full_disk(file, out, 300_000)
    assert "File too large: cannot write to" in line
    done, _, rest = line.partition("; ")[2].partition(" of ")
    assert int(done) in (0, last[1] - last[0])  # the last part may be written before the first one fails, or not
    assert rest.startswith(f"{build_sweep(content).items} bicycles are finished and kept in")
    assert "run the same command again to continue" in line
    assert not list(tmp_path.glob("*/*.tmp"))
    assert tree(run_sweep(read_sweep(file), out)) == tree(reference)


def test_a_disk_too_full_for_netcdf_is_reported_and_loses_nothing(tmp_path):
    pytest.importorskip("netCDF4")
    content = RANDOM | {"points_per_part": 300, "outputs": ["eigenvalues"]}
    file, out = write_file(tmp_path, content), tmp_path / "result.nc"
    line = refused_on_a_full_disk(file, out, 450_000)
    assert "as it does when the disk is full: cannot write to" in line
    assert "1400 of 1400 bicycles are finished and kept in" in line
    assert sorted(path.name for path in tmp_path.iterdir()) == ["result.nc.parts", "sweep.toml"]
    run_sweep(read_sweep(file), out, engine=lambda work, todo: iter(()))  # nothing is left to compute
    assert out.read_bytes() == run_sweep(read_sweep(file), tmp_path / "other.nc").read_bytes()


def test_a_lost_worker_is_reported_and_loses_nothing(reference, tmp_path):
    sweep, out = build_sweep(RANDOM), tmp_path / "result.zarr"

    def dying(work, todo):
        for number, result in enumerate(in_loop()(work, todo)):
            yield result
            if number == 0:
                yield from in_processes(1)(die, todo[1:])

    with pytest.raises(InputError, match=r"a worker process died .*; 682 of 1400 bicycles are finished and kept in"):
        run_sweep(sweep, out, engine=dying)
    assert tree(run_sweep(sweep, out)) == tree(reference)


def die(start, stop):
    os._exit(1)


def test_a_second_sweep_into_the_same_result_is_refused_while_the_first_runs(reference, tmp_path):
    import xarray as xr

    pytest.importorskip("fcntl")
    file, out = write_file(tmp_path, RANDOM), tmp_path / "result.zarr"
    refused = []

    def interrupting(work, todo):
        for found in in_loop()(work, todo):
            with pytest.raises(InputError, match=rf"parts: process {os.getpid()} of .* is computing this result; wait"):
                run_sweep(read_sweep(file), out)
            other = build_sweep(RANDOM | {"seed": 99})  # nor may another sweep take its folder
            with pytest.raises(InputError, match="is computing this result"):
                run_sweep(other, out)
            refused.append(found)
            yield found

    assert tree(run_sweep(read_sweep(file), out, engine=interrupting)) == tree(reference)
    assert refused
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        xr.open_zarr(out).close()  # as a user opens it
    assert sorted(path.name for path in tmp_path.iterdir()) == ["result.zarr", "sweep.toml"]
