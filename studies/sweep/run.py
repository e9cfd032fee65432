"""Run of a sweep: its pieces are handed out, kept and put together; an interrupted run continues."""

import contextlib
import json
import os
import sys
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from studies.model_space.sampling import left_out
from studies.sweep.engines import Engine, in_loop
from studies.sweep.parts import Parts, open_parts, parts_folder, pieces
from studies.sweep.result import open_data, remove, write_result
from studies.sweep.sampler import Sampler
from studies.sweep.specification import ImpossibleItem, Sweep, differences
from studies.sweep.worker import compute
from tyre.ground.errors import InputError
from tyre.ground.files import hold_folder, make_folder
from tyre.ground.progress import progress_bar

CONTINUE = "run the same command again to continue"


def run_sweep(sweep: Sweep, out: str | Path, *, engine: Engine | None = None, progress: bool = False) -> Path:
    """Compute a sweep into ``out``, a zarr store, or netCDF where its name ends in ``.nc``."""
    out = Path(out)
    if out.suffix not in (".zarr", ".nc"):
        raise InputError(f"--out {out.as_posix()}: the name must end in .zarr or .nc (netCDF)")
    if out.exists() and not parts_folder(out).exists():
        _refuse_other(out, sweep)
        return out
    remarks = [] if out.exists() else _check_items(sweep)
    with _hold_parts(out):
        if out.exists():  # another command has finished it, or was killed after the last rename
            _refuse_other(out, sweep)
            remove(parts_folder(out))
            return out
        for remark in remarks:
            if progress:
                print(f"warning: {remark}", file=sys.stderr)
        _run(sweep, out, engine or in_loop(), progress=progress)
    return out


@contextlib.contextmanager
def _hold_parts(out: Path) -> Iterator[None]:
    """Hold the folder of the parts of ``out`` during the block; another command that fills it is waited for."""
    folder = parts_folder(out)

    def wait() -> None:
        print(f"warning: {out.as_posix()}: another command computes it; this one waits for its end", file=sys.stderr)

    while True:
        make_folder(folder)
        made = folder.stat()
        with hold_folder(folder, wait):
            if folder.is_dir() and os.path.samestat(folder.stat(), made):  # else the other one has removed it
                yield
                return


def _run(sweep: Sweep, out: Path, engine: Engine, *, progress: bool) -> None:
    parts = open_parts(out, sweep)
    damaged = parts.drop_damaged(sweep)
    if damaged:
        print(f"warning: {damaged} damaged parts in {parts.folder.as_posix()} are recomputed", file=sys.stderr)
    todo = [piece for piece in pieces(sweep, parts.items) if not parts.has(piece)]
    points = sweep.points_per_item
    points_left, total = sum(stop - start for start, stop in todo) * points, sweep.items * points
    try:
        with progress_bar(
            total=total, initial=total - points_left, unit="points", unit_scale=True, show=progress
        ) as bar:
            for piece, arrays in engine(partial(compute, sweep), todo):
                parts.write(piece, arrays)
                bar.update((piece[1] - piece[0]) * points)
        _finish(sweep, parts, out)
    except ImpossibleItem as error:
        if not any(parts.has(piece) for piece in pieces(sweep, parts.items)):
            remove(parts.folder)  # not in the way of the changed sweep
            raise InputError(str(error)) from error
        raise InputError(f"{error}; {_describe_finished(sweep, parts)}, but a changed sweep restarts") from error
    except (InputError, OSError) as error:
        reason = str(error)
        if isinstance(error, OSError):
            reason = f"{error.strerror or error}: cannot write to {out.absolute().parent.as_posix()}"
        raise InputError(f"{reason}; {_describe_finished(sweep, parts)}: remove the cause and {CONTINUE}") from error
    except KeyboardInterrupt:
        print(f"{_describe_finished(sweep, parts)}: {CONTINUE}", file=sys.stderr)
        raise
    remove(parts.folder)


def _check_items(sweep: Sweep) -> list[str]:
    """Refuse a sweep with an impossible cell before any is computed; remarks on its items."""
    sampler = Sampler(sweep)
    sampler.model.linear_model().check_speeds(sweep.speeds)
    cells = sampler.centres() if sweep.random else sampler
    for start, stop in pieces(cells.sweep, 16384):
        points = cells.points(start, stop, sampler.zeros(stop - start), linear=True)
        cells.refuse_any(points, start, where="the mean of what is sampled" if sweep.random else "")
    extrapolated, counts = 0, Counter[str]()
    for start, stop in pieces(sweep, 16384):
        points = sampler.points(start, stop)
        counts.update(points.refused.counts)
        extrapolated += 0 if points.extrapolated is None else int(points.extrapolated[~points.refused.mask].sum())
    remarks = list(sampler.notes)
    if counts:
        remarks.append(f"{left_out(counts, sweep.items)}; the result holds NaN for them and marks them in impossible")
    if extrapolated:
        remarks.append(
            f"{extrapolated} of {sweep.items} samples have a tyre outside its measured loads and pressures; "
            "tyre_extrapolated marks them"
        )
    return remarks


def _describe_finished(sweep: Sweep, parts: Parts) -> str:
    finished = sum(piece[1] - piece[0] for piece in pieces(sweep, parts.items) if parts.has(piece))
    return f"{finished} of {sweep.items} bicycles are finished and kept in {parts.folder.as_posix()}"


def _finish(sweep: Sweep, parts: Parts, out: Path) -> None:
    """Put the result together from all parts, under another name until it is whole."""
    partial = out.with_name(f"{out.stem}.partial{out.suffix}")
    try:
        remove(partial)
        write_result(sweep, parts, partial)
        partial.replace(out)
    finally:
        remove(partial)


def _refuse_other(out: Path, sweep: Sweep) -> None:
    """Refuse a result that is not of this sweep, with what has changed."""
    made_by, before = dict[str, Any](), None
    with contextlib.suppress(OSError, ValueError, KeyError):
        with open_data(out) as data:
            made_by = dict(data.attrs)
        before = json.loads(made_by["made_of"])
    if made_by.get("fingerprint") == sweep.fingerprint:
        return
    changed = f" (changed since: {differences(before, sweep.made_of)})" if before else ""
    raise InputError(
        f"{out.as_posix()} exists and is not the result of this sweep{changed}; remove it or choose another --out"
    )
