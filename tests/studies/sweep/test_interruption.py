"""A sweep that is killed, or whose disk is full, loses nothing and ends with the same bits."""

import os
import signal
import sys
import warnings
from importlib import import_module
from multiprocessing import get_all_start_methods, get_context

import numpy as np
import pytest
from sweep_examples import RANDOM, write_file
from sweep_results import tree

from studies.cli import main
from studies.sweep import build_sweep, in_loop, in_processes, in_threads, open_parts, pieces, read_sweep, run_sweep
from tests.shared.refusals import refuses
from tyre.ground import InputError


def pieces_of(content):
    return list(pieces(build_sweep(content)))


@pytest.fixture(scope="module")
def fresh():
    """Fresh processes, forked from one that has imported what a sweep needs."""
    if "forkserver" not in get_all_start_methods():
        pytest.skip("needs kill -9, and limits of the operating system")
    context = get_context("forkserver")
    context.set_forkserver_preload(["studies.cli", "studies.sweep.file", "studies.sweep.run", "zarr", "netCDF4"])
    return context


def kill(fresh, file, out, place, number):
    """Run a sweep in a process with ``kill -9`` right after call ``number`` of a function at a ``place``."""
    here, there = fresh.Pipe()
    process = fresh.Process(target=run_and_wait, args=(file, out, place, number, there), daemon=True)
    process.start()
    assert here.poll(60)
    process.kill()
    process.join()
    assert process.exitcode == -signal.SIGKILL


def run_and_wait(file, out, place, number, told):
    module, owner, name = place
    owner = getattr(import_module(module), owner) if owner else import_module(module)
    work, calls = getattr(owner, name), []

    def slowly(*arguments, **settings):
        made = work(*arguments, **settings)
        calls.append(name)
        if len(calls) == number:
            told.send("now")
            signal.pause()
        return made

    setattr(owner, name, slowly)
    run_sweep(read_sweep(file), out)


def test_killed_it_continues_and_ends_with_the_same_bits(fresh, reference, tmp_path):
    content = RANDOM | {"points_per_part": 300}
    file, out = write_file(tmp_path, content), tmp_path / "result.zarr"
    kill(fresh, file, out, ("studies.sweep", "Parts", "write"), 1)
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
    refuses("part is missing or damaged", parts.read, (0, 3))


QUANTILES = RANDOM | {"outputs": ["largest_growth_rate"], "reduce": {"quantiles": [0.1, 0.9]}}


def without(arrays, name):
    return {key: array for key, array in arrays.items() if key != name}


DAMAGES = {
    "an array is missing": lambda a: without(a, next(iter(a))),
    "an array too many": lambda a: a | {"more": np.zeros(3)},
    "rows are missing": lambda a: a | {next(iter(a)): next(iter(a.values()))[:-1]},
    "another shape": lambda a: a | {next(iter(a)): next(iter(a.values()))[..., None]},
    "words": lambda a: a | {next(iter(a)): next(iter(a.values())).astype(str)},
    "nothing": lambda a: {},
}


@pytest.mark.parametrize("content", [RANDOM, QUANTILES], ids=["rows", "quantiles"])
@pytest.mark.parametrize("damage", DAMAGES)
def test_a_part_that_is_not_what_the_sweep_writes_is_computed_anew_and_said(tmp_path, capsys, content, damage):
    """A part that lacks an array once gave NaN for all its bicycles."""
    content = content | {"points_per_part": 300}
    right = tree(run_sweep(build_sweep(content), tmp_path / "right.zarr"))
    sweep, out = build_sweep(content), tmp_path / "result.zarr"

    def stopped(work, todo):
        yield todo[0], work(*todo[0])
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_sweep(sweep, out, engine=stopped)
    parts = open_parts(out, sweep)
    first = next(iter(pieces(sweep, parts.items)))
    parts.write(first, DAMAGES[damage](parts.read(first)))
    assert tree(run_sweep(sweep, out)) == right
    assert "1 damaged parts in" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("ending", "place"),
    [("zarr", ("studies.sweep.result", "", "write_rows")), ("nc", ("netCDF4", "Dataset", "createVariable"))],
)
def test_killed_in_the_middle_of_putting_together(fresh, tmp_path, ending, place):
    """The kill comes after the second part is written into the store, and after two arrays of a netCDF file."""
    pytest.importorskip("netCDF4")
    file, out = write_file(tmp_path, RANDOM | {"points_per_part": 300}), tmp_path / f"result.{ending}"
    kill(fresh, file, out, place, 2)
    assert not out.exists()
    assert (tmp_path / f"result.{ending}.partial").exists()
    run_sweep(read_sweep(file), out, engine=in_threads(2))
    other = run_sweep(read_sweep(file), tmp_path / f"other.{ending}")
    assert [tree(path) for path in (out, other)] == [tree(out)] * 2
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([file.name, out.name, other.name])


def test_interrupted_it_says_what_is_kept(reference, tmp_path, capsys):
    def interrupted(work, todo):
        yield todo[0], work(*todo[0])
        raise KeyboardInterrupt

    sweep, out = build_sweep(RANDOM), tmp_path / "result.zarr"
    with pytest.raises(KeyboardInterrupt):
        run_sweep(sweep, out, engine=interrupted)
    assert "682 of 1400 bicycles are finished and kept in" in capsys.readouterr().err
    assert tree(run_sweep(sweep, out)) == tree(reference)


def refused_on_a_full_disk(fresh, file, out, size):
    """What is said last where the operating system lets no file have more than ``size`` bytes."""
    said = file.with_suffix(".txt")
    process = fresh.Process(target=sweep_on_a_full_disk, args=(file, out, size, said))
    process.start()
    process.join()
    lines = said.read_text().strip().splitlines()
    said.unlink()
    assert process.exitcode == 2, lines
    return lines[-1]


def sweep_on_a_full_disk(file, out, size, said):
    import resource

    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))  # the operating system refuses to write more
    with said.open("w") as sys.stderr:
        main(["sweep", str(file), "--out", str(out), "--workers", "1"])


def test_a_full_disk_is_reported_and_loses_nothing(fresh, reference, tmp_path):
    content = RANDOM | {"points_per_part": 4000}
    file, out = write_file(tmp_path, content), tmp_path / "result.zarr"
    last = pieces_of(content)[-1]
    assert last[1] - last[0] < pieces_of(content)[0][1]  # the last part is small and fits
    line = refused_on_a_full_disk(fresh, file, out, 300_000)
    assert "File too large: cannot write to" in line
    done, _, rest = line.partition("; ")[2].partition(" of ")
    assert int(done) in (0, last[1] - last[0])  # the last part may be written before the first one fails, or not
    assert rest.startswith(f"{build_sweep(content).items} bicycles are finished and kept in")
    assert "run the same command again to continue" in line
    assert not list(tmp_path.glob("*/*.tmp"))
    assert tree(run_sweep(read_sweep(file), out)) == tree(reference)


def test_a_disk_too_full_for_netcdf_is_reported_and_loses_nothing(fresh, tmp_path):
    pytest.importorskip("netCDF4")
    content = RANDOM | {"points_per_part": 300, "outputs": ["eigenvalues"]}
    file, out = write_file(tmp_path, content), tmp_path / "result.nc"
    line = refused_on_a_full_disk(fresh, file, out, 450_000)
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
            refuses("is computing this result", run_sweep, other, out)
            refused.append(found)
            yield found

    assert tree(run_sweep(read_sweep(file), out, engine=interrupting)) == tree(reference)
    assert refused
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        xr.open_zarr(out).close()  # as a user opens it
    assert sorted(path.name for path in tmp_path.iterdir()) == ["result.zarr", "sweep.toml"]
