"""Run a sweep: hand out its pieces, keep what is finished, put the result together; interrupted, it continues."""

import contextlib
import json
import sys
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from studies.sampling.refused import left_out
from studies.sweeps.chunk import compute
from studies.sweeps.engines import Engine, in_loop
from studies.sweeps.made_of import differences
from studies.sweeps.netcdf import to_netcdf
from studies.sweeps.part_size import measured_items, usual_items
from studies.sweeps.parts import Parts, open_parts
from studies.sweeps.points import ImpossibleItem, Sampler
from studies.sweeps.result import assemble, remove
from studies.sweeps.spec import Sweep
from tyre.base.errors import InputError

CHECKED_TOGETHER = 16384  # items
CONTINUE = "run the same command again to continue"


def run_sweep(sweep: Sweep, out: str | Path, *, engine: Engine | None = None, progress: bool = False) -> Path:
    """Compute a sweep into ``out``, a zarr store, or netCDF where its name ends in ``.nc``.

    Finished pieces are kept in ``OUT.parts`` until all are there; the same call continues after any interruption and
    ends with the same bits. ``progress`` shows a bar on standard error.

    Raises
    ------
    InputError
        ``out`` holds another sweep; a cell of the grid is physically impossible; a worker or the disk failed. The
        message says what is kept.
    """
    out = Path(out)
    if out.suffix not in (".zarr", ".nc"):
        raise InputError(f"--out {out.as_posix()}: the name must end in .zarr or .nc (netCDF)")
    if out.exists():
        made_by = _attributes(out)
        if made_by.get("fingerprint") != sweep.fingerprint:
            raise InputError(_other_result(out, sweep, made_by))
        for left in ("parts", "partial"):  # killed after the last rename
            remove(out.with_name(f"{out.name}.{left}"))
        return out
    said = _check_items(sweep)
    if progress:
        for warning in said:
            print(f"warning: {warning}", file=sys.stderr)
    parts = open_parts(out, sweep, items=lambda: measured_items(sweep, show=progress))
    todo = [piece for piece in pieces(sweep, parts.items) if not parts.has(piece)]
    try:
        _compute(sweep, parts, todo, engine or in_loop(), progress=progress)
        _finish(sweep, parts, out)
    except ImpossibleItem as error:
        if not any(parts.has(piece) for piece in pieces(sweep, parts.items)):
            parts.remove()  # not in the way of the changed sweep
            raise InputError(str(error)) from error
        raise InputError(f"{error}; {_kept(sweep, parts)}, but a changed sweep starts anew") from error
    except (InputError, OSError) as error:
        reason = str(error)
        if isinstance(error, OSError):
            reason = f"{error.strerror or error}: cannot write to {out.absolute().parent.as_posix()}"
        raise InputError(f"{reason}; {_kept(sweep, parts)}: mend the cause and {CONTINUE}") from error
    except KeyboardInterrupt:
        print(f"{_kept(sweep, parts)}: {CONTINUE}", file=sys.stderr)
        raise
    parts.remove()
    return out


def _check_items(sweep: Sweep) -> tuple[str, ...]:
    """Refuse a sweep with an impossible cell before any is computed; returns what must be told of the items.

    With random draws, a cell is impossible where it is at the mean of what is drawn.
    """
    sampler = Sampler(sweep)
    sampler.model.linear_model().check_speeds(sweep.speeds)
    cells = sampler.centres() if sweep.random else sampler
    for start in range(0, cells.sweep.items, CHECKED_TOGETHER):
        stop = min(start + CHECKED_TOGETHER, cells.sweep.items)
        points = cells.points(start, stop, sampler.zeros(stop - start), linear=True)
        cells.refuse_any(points, start, where="the mean of what is sampled" if sweep.random else "")
    extrapolated, counts = 0, Counter[str]()
    for start in range(0, sweep.items, CHECKED_TOGETHER):
        points = sampler.points(start, min(start + CHECKED_TOGETHER, sweep.items))
        counts.update(points.refused.counts)
        extrapolated += 0 if points.extrapolated is None else int(points.extrapolated[~points.refused.mask].sum())
    said = list(sampler.notes)
    if counts:
        said.append(f"{left_out(counts, sweep.items)}: they are NaN, and impossible marks them")
    if extrapolated:
        said.append(
            f"{extrapolated} of {sweep.items} bicycles have a tyre outside its measured loads and pressures; "
            "tyre_extrapolated marks them"
        )
    return tuple(said)


def _kept(sweep: Sweep, parts: Parts) -> str:
    done = sum(piece[1] - piece[0] for piece in pieces(sweep, parts.items) if parts.has(piece))
    return f"{done} of {sweep.items} bicycles are finished and kept in {parts.folder.as_posix()}"


def pieces(sweep: Sweep, items: int | None = None) -> Iterator[tuple[int, int]]:
    """Item ranges that are computed and kept together: a number of ``items`` each, by default the usual one."""
    step = items or usual_items(sweep)
    for start in range(0, sweep.items, step):
        yield start, min(start + step, sweep.items)


def _compute(sweep: Sweep, parts: Parts, todo: list[tuple[int, int]], engine: Engine, *, progress: bool) -> None:
    from tyre.base.progress import progress_bar

    points = sweep.points_per_item
    left = sum(stop - start for start, stop in todo) * points
    total = sweep.items * points
    with progress_bar(total=total, initial=total - left, unit="points", unit_scale=True, show=progress) as bar:
        for piece, arrays in engine(partial(compute, sweep), todo):
            parts.write(piece, arrays)
            bar.update((piece[1] - piece[0]) * points)


def _finish(sweep: Sweep, parts: Parts, out: Path) -> None:
    store, export = (out.with_name(f"{out.name}.{ending}") for ending in ("partial", "export"))
    try:
        remove(store)
        remove(export)
        assemble(sweep, parts, pieces(sweep, parts.items), store)
        if out.suffix == ".nc":
            to_netcdf(store, export)
            export.replace(out)
        else:
            store.replace(out)
    finally:
        remove(store)
        remove(export)


def _attributes(out: Path) -> dict[str, Any]:
    """What a result says of itself; empty where it is none."""
    if out.is_dir():
        try:
            content = json.loads((out / "zarr.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return dict(content.get("attributes", {}))
    import xarray as xr

    try:
        with xr.open_dataset(out, engine="netcdf4") as found:
            return dict(found.attrs)
    except OSError:
        return {}


def _other_result(out: Path, sweep: Sweep, made_by: dict[str, Any]) -> str:
    before = None
    with contextlib.suppress(KeyError, ValueError):
        before = json.loads(made_by["made_of"])
    changed = f" (changed since: {differences(before, sweep.made_of)})" if before else ""
    return f"{out.as_posix()} exists and is not the result of this sweep{changed}; remove it or choose another --out"
