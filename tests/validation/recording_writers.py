"""The same recording written in every format, by the libraries with which laboratories write them."""

import warnings
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from tyre.ground import Array

Columns = Mapping[str, tuple[Array, str]]
"""Name -> numbers and unit."""

OWN_TIMES = ("mf4", "tdms", "timetable")
"""Formats in which the first column, the time in s, becomes the time of all others."""


def name_in_file(form: str, name: str) -> str:
    """What a column is called in a file of a format (a key of ``WRITERS``)."""
    return {"mat5": f"run.{name}", "timetable": f"run.{name}", "hdf5": f"run/{name}"}.get(form, name)


def write_csv(path: Path, columns: Columns) -> None:
    """Semicolons, decimal commas, a line about the logger, a line of units, Windows-1252 (``columns``: see above)."""
    rows = np.column_stack([x for x, _ in columns.values()])
    text = "Logger 7;Versuch 3\n" + ";".join(columns) + "\n" + ";".join(unit for _, unit in columns.values()) + "\n"
    text += "".join(";".join("" if np.isnan(x) else repr(float(x)) for x in row) + "\n" for row in rows).replace(
        ".", ","
    )
    path.write_bytes(text.encode("cp1252"))


def write_tsv(path: Path, columns: Columns) -> None:
    """Tabs, units in brackets (``columns``: name -> numbers and unit)."""
    import pandas as pd

    pd.DataFrame({f"{name} [{unit}]": x for name, (x, unit) in columns.items()}).to_csv(path, sep="\t", index=False)


def write_xlsx(path: Path, columns: Columns) -> None:
    """A sheet with names and units (``columns``: name -> numbers and unit)."""
    import openpyxl

    book = openpyxl.Workbook(write_only=True)
    sheet = book.create_sheet("Messung")
    sheet.append(list(columns))
    sheet.append([unit for _, unit in columns.values()])
    for row in np.column_stack([x for x, _ in columns.values()]).tolist():
        sheet.append([None if x != x else x for x in row])
    book.save(path)


def write_parquet(path: Path, columns: Columns) -> None:
    """Units as metadata, checksums of pages (``columns``: name -> numbers and unit)."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [pa.field(name, pa.float64(), metadata={"unit": unit}) for name, (_, unit) in columns.items()]
    table = pa.table([x for x, _ in columns.values()], schema=pa.schema(fields))
    pq.write_table(table, path, row_group_size=500, write_page_checksum=True)


def write_mat5(path: Path, columns: Columns) -> None:
    """Version 5: a structure of vectors, without units (``columns``: name -> numbers and unit)."""
    import scipy.io

    scipy.io.savemat(path, {"run": {name: x for name, (x, _) in columns.items()}}, do_compression=True)


def quiet_matio() -> Any:
    """Import matio, which sets a deprecated option of pandas."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return import_module("matio")


def write_mat73(path: Path, columns: Columns) -> None:
    """Version 7.3: vectors, without units (``columns``: name -> numbers and unit)."""
    matio = quiet_matio()
    matio.save_to_mat(str(path), {name: x for name, (x, _) in columns.items()}, version="v7.3")


def write_timetable(path: Path, columns: Columns) -> None:
    """Version 7: a timetable whose times are the first column, in s (``columns``: name -> numbers and unit)."""
    import pandas as pd

    matio = quiet_matio()
    (time, _), *_ = columns.values()
    index = pd.Index(np.round(time * 1e3).astype("timedelta64[ms]"), name="Time")
    frame = pd.DataFrame({name: x for name, (x, _) in list(columns.items())[1:]}, index=index)
    matio.save_to_mat(str(path), {"run": frame}, version="v7")


def write_hdf5(path: Path, columns: Columns) -> None:
    """A group of datasets with checksums and units (``columns``: name -> numbers and unit)."""
    import h5py

    with h5py.File(path, "w") as file:
        for name, (x, unit) in columns.items():
            file.create_dataset(f"run/{name}", data=x, fletcher32=True).attrs["units"] = unit


def write_tdms(path: Path, columns: Columns) -> None:
    """Channels with a time step, equally spaced, from the first column in s (``columns``: name -> numbers and unit)."""
    from nptdms import ChannelObject, TdmsWriter

    (time, _), *_ = columns.values()
    step = {"wf_increment": round(float(time[1] - time[0]), 9), "wf_start_offset": float(time[0])}
    with TdmsWriter(path) as file:
        file.write_segment(
            [ChannelObject("run", name, x, properties={"unit_string": unit, **step})
             for name, (x, unit) in list(columns.items())[1:]]
        )  # fmt: skip


def write_mf4(path: Path, columns: Columns) -> None:
    """A group whose master is the first column, in s (``columns``: name -> numbers and unit)."""
    from asammdf import MDF, Signal

    (time, _), *_ = columns.values()
    with MDF(version="4.10") as file:
        file.append(
            [Signal(x, time, unit=unit, name=name) for name, (x, unit) in list(columns.items())[1:]],
            common_timebase=True,
        )
        file.save(path, overwrite=True)


def write_tdx(path: Path, columns: Columns) -> None:
    """TYDEX, in fields of twelve digits set apart by blanks (``columns``: name -> numbers and unit)."""
    lines = ["**HEADER", f"{'RELEASE':<10}{'Release of TYDEX-Format':<40}1.3", "**MEASURCHANNELS"]
    lines += [f"{name[:10]:<10}{name:<30}{unit:<10}1" for name, (_, unit) in columns.items()]
    rows = np.column_stack([x for x, _ in columns.values()])
    lines += ["**MEASURDATA"] + [" ".join("NOTAVAIL" if x != x else repr(x) for x in row) for row in rows.tolist()]
    path.write_text("\n".join([*lines, "**END", ""]), encoding="utf-8")


WRITERS: Mapping[str, tuple[str, Callable[[Path, Any], None]]] = {
    "csv": (".csv", write_csv), "tsv": (".tsv", write_tsv), "xlsx": (".xlsx", write_xlsx),
    "parquet": (".parquet", write_parquet), "mat5": (".mat", write_mat5), "mat73": (".mat", write_mat73),
    "timetable": (".mat", write_timetable), "hdf5": (".h5", write_hdf5), "tdms": (".tdms", write_tdms),
    "mf4": (".mf4", write_mf4), "tdx": (".tdx", write_tdx),
}  # fmt: skip
"""Format -> ending and writer."""
