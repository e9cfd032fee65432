"""A sweep that is killed, or whose disk is full, goes on from its finished parts and ends with the same numbers."""

import os
import signal
import sys
from multiprocessing import get_all_start_methods, get_context
from threading import Thread

import numpy as np
import pytest
from sweep_examples import RANDOM, write_file
from sweep_results import identical

from studies.cli import main
from studies.sweep import Parts, build_sweep, compute, in_loop, in_processes, open_parts, pieces, read_sweep, run_sweep
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


def kill(fresh, file, out, number):
    """Run a sweep in a process with ``kill -9`` right after it has written part ``number``."""
    here, there = fresh.Pipe()
    process = fresh.Process(target=run_and_wait, args=(file, out, number, there), daemon=True)
    process.start()
    assert here.poll(60)
    process.kill()
    process.join()
    assert process.exitcode == -signal.SIGKILL


def run_and_wait(file, out, number, told):
    write, calls = Parts.write, []

    def slowly(*arguments):
        write(*arguments)
        calls.append(arguments)
        if len(calls) == number:
            told.send("now")
            signal.pause()

    Parts.write = slowly
    run_sweep(read_sweep(file), out)


def test_killed_it_continues_and_ends_with_the_same_numbers(fresh, reference, tmp_path):
    content = RANDOM | {"points_per_part": 300}
    file, out = write_file(tmp_path, content), tmp_path / "result.zarr"
    kill(fresh, file, out, 1)
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
    assert identical(out, reference)
    assert not parts.exists()


@pytest.mark.parametrize("damage", [lambda b: b[:-1], lambda b: b[:200] + bytes([b[200] ^ 1]) + b[201:], lambda b: b""])
def test_a_damaged_part_is_not_taken(tmp_path, damage):
    sweep = build_sweep(RANDOM)
    parts = open_parts(tmp_path / "a.zarr", sweep)
    first = next(pieces(sweep, parts.items))
    parts.write(first, compute(sweep, *first))
    assert parts.drop_damaged(sweep) == 0
    file = parts.file(first)
    file.write_bytes(damage(file.read_bytes()))
    refuses("part is missing or damaged", parts.read, first)
    assert parts.drop_damaged(sweep) == 1
    assert not parts.has(first)


QUANTILES = RANDOM | {"outputs": ["max_growth_rate"], "reduce": {"quantiles": [0.1, 0.9]}}


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
    right = run_sweep(build_sweep(content), tmp_path / "right.zarr")
    sweep, out = build_sweep(content), tmp_path / "result.zarr"

    def stopped(work, todo):
        yield todo[0], work(*todo[0])
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_sweep(sweep, out, engine=stopped)
    parts = open_parts(out, sweep)
    first = next(iter(pieces(sweep, parts.items)))
    parts.write(first, DAMAGES[damage](parts.read(first)))
    assert identical(run_sweep(sweep, out), right)
    assert "1 damaged parts in" in capsys.readouterr().err


def test_interrupted_it_says_what_is_kept(reference, tmp_path, capsys):
    def interrupted(work, todo):
        yield todo[0], work(*todo[0])
        raise KeyboardInterrupt

    sweep, out = build_sweep(RANDOM), tmp_path / "result.zarr"
    with pytest.raises(KeyboardInterrupt):
        run_sweep(sweep, out, engine=interrupted)
    assert "682 of 1400 bicycles are finished and kept in" in capsys.readouterr().err
    assert identical(run_sweep(sweep, out), reference)


def test_two_runs_at_once_into_one_result_compute_it_once(reference, tmp_path, capsys):
    """The second once wrote into what the first put together, or found its parts removed."""
    pytest.importorskip("fcntl")
    sweep, out, second = build_sweep(RANDOM), tmp_path / "result.zarr", []

    def begun_twice(work, todo):
        for piece in todo:
            if not second:
                second.append(Thread(target=run_sweep, args=(sweep, out), kwargs={"engine": never}))
                second[0].start()
                said = ""
                while second[0].is_alive() and not said:
                    second[0].join(0.01)
                    said = capsys.readouterr().err
                assert said == f"warning: {out.as_posix()}: another command computes it; this one waits for its end\n"
            yield piece, work(*piece)

    def never(work, todo):
        pytest.fail("the second run computes something")

    assert identical(run_sweep(sweep, out, engine=begun_twice), reference)
    second[0].join()
    assert identical(out, reference)
    assert [file.name for file in tmp_path.iterdir()] == ["result.zarr"]


def test_a_second_run_goes_on_where_the_first_was_stopped(reference, tmp_path):
    pytest.importorskip("fcntl")
    sweep, out, second = build_sweep(RANDOM), tmp_path / "result.zarr", []

    def stopped(work, todo):
        second.append(Thread(target=run_sweep, args=(sweep, out)))
        second[0].start()
        second[0].join(0.3)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_sweep(sweep, out, engine=stopped)
    second[0].join()
    assert identical(out, reference)


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
    assert identical(run_sweep(read_sweep(file), out), reference)


def test_a_disk_too_full_for_netcdf_is_reported_and_loses_nothing(fresh, tmp_path):
    pytest.importorskip("netCDF4")
    content = RANDOM | {"points_per_part": 300, "outputs": ["eigenvalues"]}
    file, out = write_file(tmp_path, content), tmp_path / "result.nc"
    line = refused_on_a_full_disk(fresh, file, out, 450_000)
    assert "as it does when the disk is full: cannot write to" in line
    assert "1400 of 1400 bicycles are finished and kept in" in line
    assert sorted(path.name for path in tmp_path.iterdir()) == ["result.nc.parts", "sweep.toml"]
    run_sweep(read_sweep(file), out, engine=lambda work, todo: iter(()))  # nothing is left to compute
    assert identical(out, run_sweep(read_sweep(file), tmp_path / "other.nc"))


def test_a_lost_worker_is_reported_and_loses_nothing(reference, tmp_path):
    sweep, out = build_sweep(RANDOM), tmp_path / "result.zarr"

    def dying(work, todo):
        for number, result in enumerate(in_loop()(work, todo)):
            yield result
            if number == 0:
                yield from in_processes(1)(die, todo[1:])

    with pytest.raises(InputError, match=r"a worker process died .*; 682 of 1400 bicycles are finished and kept in"):
        run_sweep(sweep, out, engine=dying)
    assert identical(run_sweep(sweep, out), reference)


def die(start, stop):
    os._exit(1)
