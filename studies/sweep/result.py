"""Finished parts of a sweep on disk, each there whole or not at all, and the labelled store made of them."""

import contextlib
import errno
import json
import math
import os
import platform
import shutil
import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from bicycle.parameters.parameter_covariance import ParameterKey
from studies.model_space.axes import unit_of
from studies.model_space.outputs import DIMENSIONS, OUTPUTS
from studies.sweep.engines import Piece, usual_items
from studies.sweep.reduction import EXTREMES, Merged
from studies.sweep.sampler import stiffness_warnings
from studies.sweep.specification import SPEED, Sweep, differences, software
from studies.sweep.worker import Arrays, stored
from tyre.ground.errors import InputError
from tyre.ground.files import held, write_text

Labels = dict[str, Sequence[Any]]
CHUNK_BYTES = 4_000_000


@dataclass(frozen=True)
class Parts:
    """Folder of the finished pieces of one sweep, with the number of bicycles in a part; made by :func:`open_parts`."""

    folder: Path
    items: int

    def file(self, piece: Piece) -> Path:
        """File (npz, with the check sums of its format) with the results of items ``piece``."""
        return self.folder / f"{piece[0]:012d}-{piece[1]:012d}.part"

    def has(self, piece: Piece) -> bool:
        """True if the piece is finished; a file that a crash of the machine left damaged does not count."""
        with contextlib.suppress(InputError):
            return bool(self.read(piece))
        return False

    def read(self, piece: Piece) -> Arrays:
        """Results of a finished piece; InputError if it is missing or damaged."""
        try:
            with self.file(piece).open("rb") as stream, np.load(stream, allow_pickle=False) as found:
                return dict(found)
        except (OSError, EOFError, ValueError, BadZipFile) as error:
            raise InputError(f"{self.file(piece).as_posix()} is missing or damaged") from error

    def groups(self, pieces: Iterable[Piece]) -> Iterator[tuple[int, Arrays]]:
        """Finished pieces joined along their items, some chunks at a time: first item and arrays."""
        held, size = dict[int, Arrays](), 0
        for piece in [*pieces, None]:
            if held and (piece is None or size >= 16 * CHUNK_BYTES):
                parts = list(held.values())
                yield next(iter(held)), {name: np.concatenate([one[name] for one in parts]) for name in parts[0]}
                held, size = {}, 0
            if piece is not None:
                held[piece[0]] = self.read(piece)
                size += sum(array.nbytes for array in held[piece[0]].values())

    def write(self, piece: Piece, arrays: Arrays) -> None:
        """Write arrays under another name, make sure they are on the disk, then rename: a kill leaves no half file."""
        temporary = self.file(piece).with_suffix(".tmp")
        try:
            with temporary.open("wb") as stream:
                np.savez(stream, **arrays)  # type: ignore[arg-type]
                stream.flush()
                os.fsync(stream.fileno())
            temporary.replace(self.file(piece))
        finally:
            temporary.unlink(missing_ok=True)


def parts_folder(out: Path) -> Path:
    """Folder of the parts of a result ``out``, beside it."""
    return out.with_name(out.name + ".parts")


@contextlib.contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """Hold the folder of parts as long as this process lives: another sweep into the same result is refused."""
    folder.mkdir(parents=True, exist_ok=True)
    (mark := folder / "claim").touch()

    def refuse() -> None:
        raise InputError(
            f"{folder.as_posix()}: {mark.read_text(encoding='utf-8') or 'another process'} is computing this result; "
            "wait for its end, or choose another --out"
        )

    with held(mark, refuse):
        mark.write_text(f"process {os.getpid()} of {platform.node() or 'this machine'}", encoding="utf-8")
        yield


def open_parts(out: Path, sweep: Sweep) -> Parts:
    """The folder of parts beside ``out``, new or of an interrupted run of the same sweep."""
    folder = parts_folder(out)
    mark, found = folder / "sweep.json", dict[str, Any]()
    with contextlib.suppress(OSError, ValueError):
        found = dict(json.loads(mark.read_text(encoding="utf-8")))
    same = found.get("fingerprint") == sweep.fingerprint
    if same and isinstance(found.get("items"), int) and found["items"] > 0:
        return Parts(folder, found["items"])
    if any(folder.glob("*.part")):
        changed = differences(None if same else found.get("made_of"), sweep.made_of)
        raise InputError(
            f"{folder.as_posix()} holds parts of another sweep; changed since: {changed}. "
            "To start anew, remove that folder or choose another --out"
        )
    folder.mkdir(parents=True, exist_ok=True)
    count = usual_items(sweep)
    write_text(mark, json.dumps({"fingerprint": sweep.fingerprint, "items": count, "made_of": sweep.made_of}, indent=1))
    return Parts(folder, count)


def drop_unusable(sweep: Sweep, parts: Parts, pieces: Iterable[Piece]) -> int:
    """Remove finished pieces that are damaged or not what this sweep writes; the number of them."""
    labels, dropped = coordinates(sweep), 0
    for piece in pieces:
        if not parts.file(piece).is_file():
            continue
        try:
            usable = _is_usable(sweep, labels, piece, parts.read(piece))
        except InputError:
            usable = False
        if not usable:
            parts.file(piece).unlink()
            dropped += 1
    return dropped


def _is_usable(sweep: Sweep, labels: Labels, piece: Piece, arrays: Arrays) -> bool:
    """True if names, shapes and types of arrays are those that :func:`studies.sweep.worker.compute` gives."""
    start, stop = piece
    first, last = start // sweep.samples, (stop - 1) // sweep.samples + 1
    expected: dict[str, tuple[tuple[int, ...], str]] = {}  # shape, and kind of number as numpy writes it
    for name in stored(sweep):
        output, inner = OUTPUTS.get(name), tuple(len(labels[dim]) for dim in inner_of(name, sweep))
        if sweep.quantiles is None:
            expected[name] = (stop - start, *inner), "c" if output is not None and output.complex_valued else "f"
            continue
        count = np.shape(arrays.get(f"{name}|bins", ()))[:1]  # as many as there are different numbers
        expected[f"{name}|bins"] = count, "u"
        expected[f"{name}|counts"] = count, "i"
        expected[f"{name}|extremes"] = (last - first, math.prod(inner), len(EXTREMES)), "f"
    if sweep.quantiles is not None:
        expected["cells"] = (2,), "i"
        if not np.array_equal(arrays.get("cells", ()), (first, last)):
            return False
    return {name: (array.shape, array.dtype.kind) for name, array in arrays.items()} == expected


def assemble(sweep: Sweep, parts: Parts, pieces: Iterable[Piece], store: Path) -> None:
    """Write the zarr ``store`` from the parts of all ``pieces``; few are in memory at a time."""
    import zarr

    labels = coordinates(sweep)
    group = zarr.open_group(store, mode="w", zarr_format=3)
    group.attrs.update(provenance(sweep))
    for name, values in labels.items():
        array = np.asarray(values)
        kind: Any = {"U": str, "f": "float64"}.get(array.dtype.kind, "int64")
        created = group.create_array(name, shape=array.shape, dtype=kind, dimension_names=(name,))
        created[:] = array
        created.attrs["units"] = "1" if name == "quantile" else unit_of(str(ParameterKey.parse(name).whole))
    targets: dict[str, Any] = {}
    for name in stored(sweep):
        targets |= _variables(group, sweep, labels, name)
    if sweep.quantiles is None:
        shape = sweep.shape if sweep.samples > 1 else sweep.shape[:-1]
        for start, arrays in parts.groups(pieces):
            for name, rows in arrays.items():
                write_rows(targets[name], shape, start, rows)
    else:
        merged = {name: Merged(sweep.quantiles) for name in stored(sweep)}
        for piece in pieces:
            part = parts.read(piece)
            for name, one in merged.items():
                _write_reduced(targets, sweep, name, one.add(part, name))
        for name, one in merged.items():
            _write_reduced(targets, sweep, name, one.finish())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # zarr's: others than zarr-python may not know consolidated metadata
        zarr.consolidate_metadata(store)  # without them xarray warns at every opening


def coordinates(sweep: Sweep) -> Labels:
    """Every dimension and its labels."""
    model = sweep.nominal
    labels: Labels = {axis.name: axis.values for axis in sweep.axes}
    labels |= {SPEED: sweep.speeds} if sweep.speeds else {}
    labels |= {"sample": range(sweep.samples)} if sweep.samples > 1 and sweep.quantiles is None else {}
    labels |= {"quantile": sweep.quantiles} if sweep.quantiles is not None else {}
    dims = dict.fromkeys(dim for name in sweep.outputs for dim in OUTPUTS[name].dims)
    return labels | {dim: DIMENSIONS[dim](model) for dim in dims}


def inner_of(name: str, sweep: Sweep) -> tuple[str, ...]:
    """Dimensions of one bicycle's values of an output, or of a mark of bicycles."""
    output = OUTPUTS.get(name)
    if output is None:
        return ()
    return (SPEED, *output.dims) if output.by_speed and sweep.speeds else output.dims


def _variables(group: Any, sweep: Sweep, labels: Labels, name: str) -> dict[str, Any]:
    """New arrays that hold the output ``name``: itself, or what its reduction over the samples gives."""
    output = OUTPUTS.get(name)
    unit, inner = "1" if output is None else output.unit, inner_of(name, sweep)
    grid = tuple(axis.name for axis in sweep.axes)
    dtype = "complex128" if output is not None and output.complex_valued else "float64"
    if sweep.quantiles is None:
        outer = (*grid, "sample") if sweep.samples > 1 else grid
        wanted = {name: ((*outer, *inner), unit)}
    else:
        wanted = {f"{name}_quantiles": ((*grid, *inner, "quantile"), unit)}
        units = {"min": unit, "max": unit}
        wanted |= {f"{name}_{field}": ((*grid, *inner), units.get(field, "1")) for field in EXTREMES}
    found = {}
    for full, (dims, own_unit) in wanted.items():
        shape = tuple(len(labels[dim]) for dim in dims)
        chunks, size = [], np.dtype(dtype).itemsize
        for length in reversed(shape):
            chunks.append(max(1, min(length, CHUNK_BYTES // size)))
            size *= chunks[-1]
        found[full] = group.create_array(
            full,
            shape=shape,
            chunks=tuple(reversed(chunks)) or "auto",
            dtype=dtype,
            fill_value=math.nan,
            dimension_names=dims,
        )
        found[full].attrs["units"] = own_unit
    return found


def write_rows(target: Any, shape: Sequence[int], start: int, rows: NDArray[Any], at: tuple[int, ...] = ()) -> None:
    """Write rows (k, ...) into an array whose leading dimensions have this shape in C order, from row ``start`` on."""
    if not shape:
        target[(*at, ...)] = rows[0]
        return
    inner = math.prod(shape[1:])
    while len(rows):
        first, offset = divmod(start, inner)
        whole = len(rows) // inner if offset == 0 else 0
        if whole:
            used = whole * inner
            target[(*at, slice(first, first + whole), ...)] = rows[:used].reshape(whole, *shape[1:], *rows.shape[1:])
        else:
            used = min(inner - offset, len(rows))
            write_rows(target, shape[1:], offset, rows[:used], (*at, first))
        start, rows = start + used, rows[used:]


def _write_reduced(targets: dict[str, Any], sweep: Sweep, name: str, cells: list[Any]) -> None:
    shape = sweep.shape[:-1]
    for cell, quantiles, extremes in cells:
        fields = {f"{name}_{field}": extremes[:, k] for k, field in enumerate(EXTREMES)}
        for full, values in ({f"{name}_quantiles": quantiles} | fields).items():
            target = targets[full]
            write_rows(target, shape, cell, values.reshape(1, *target.shape[len(shape) :]))


def provenance(sweep: Sweep) -> dict[str, Any]:
    """Attributes that say what made the numbers; neither time nor machine, so that equal sweeps give equal files."""
    content = asdict(sweep)
    del content["points_per_part"]
    remarks = stiffness_warnings(sweep.nominal.linear_model().warnings, sweep.relative_cornering_stiffness_sd)
    return {
        "title": "velotyre sweep",
        "fingerprint": sweep.fingerprint,
        "made_of": json.dumps(sweep.made_of),
        "software": json.dumps(software()),
        "sweep": json.dumps(content),
        "warnings": "; ".join(remarks),
        "random_numbers": "Philox 4x64 keyed by seed and SHA-256 of the parameter's name; sample i is word i",
        "quantile_accuracy": "exact extremes; quantiles to 2**-11 of their value" if sweep.quantiles else "",
    }


def to_netcdf(store: Path, target: Path) -> None:
    """Export a zarr store to netCDF; a complex variable becomes ``name_real`` and ``name_imag``, as netCDF needs."""
    import netCDF4
    import zarr

    found = zarr.open_group(store, mode="r")
    arrays: list[tuple[str, Any]] = sorted(found.arrays())
    try:
        with netCDF4.Dataset(target, "w") as file:
            file.setncatts(dict(found.attrs))
            for name, array in arrays:
                if array.metadata.dimension_names == (name,):
                    file.createDimension(name, array.shape[0])
            for name, array in arrays:
                for part in ("real", "imag") if array.dtype.kind == "c" else ("",):
                    _copy(file, f"{name}_{part}" if part else name, array, part)
    except RuntimeError as error:  # HDF5 does not say why
        raise OSError(errno.EIO, f"netCDF says {str(error)!r}, as it does when the disk is full") from error


def _copy(file: Any, name: str, array: Any, part: str) -> None:
    words = array.dtype.kind in "TUO"
    kind: Any = str if words else np.zeros(0, array.dtype).real.dtype.newbyteorder("=")
    options = {"fill_value": np.nan} if not words and kind.kind == "f" else {}
    variable = file.createVariable(name, kind, array.metadata.dimension_names or (), **options)
    variable.setncatts(dict(array.attrs))
    for start in range(0, array.shape[0], array.chunks[0]) if array.ndim else [0]:  # whole stored chunks
        box = slice(start, start + array.chunks[0]) if array.ndim else ...
        values = np.asarray(array[box])
        variable[box] = values.astype(object) if words else getattr(values, part) if part else values


def open_data(path: Path) -> Any:
    """The data set of a finished sweep, zarr or netCDF, opened and not read."""
    import xarray as xr

    return xr.open_zarr(path, consolidated=False) if path.is_dir() else xr.open_dataset(path, engine="netcdf4")


def impossible_draws(out: Path) -> int:
    """Number of draws of the finished sweep ``out`` that make no bicycle."""
    with open_data(out) as found:
        marks = [found[name] for name in ("impossible", "impossible_above_zero") if name in found]
        return sum(int(mark.sum()) for mark in marks)


def remove(path: Path) -> None:
    """Delete the file or folder ``path``, if there is one."""
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
