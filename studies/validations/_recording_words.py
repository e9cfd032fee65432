"""A channel of words where numbers belong, in the formats that hold binary numbers."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from tyre.base.arrays import Array

Columns = Mapping[str, Array]
Words = Callable[[Path, Columns, Mapping[str, str], str], None]


def _mixed(columns: Columns, victim: str) -> dict[str, list[object]]:
    return {name: ["error"] * len(x) if name == victim else x.tolist() for name, x in columns.items()}


def _xlsx(path: Path, columns: Columns, units: Mapping[str, str], victim: str) -> None:
    import openpyxl

    book = openpyxl.Workbook(write_only=True)
    sheet = book.create_sheet("Messung")
    sheet.append(list(columns))
    sheet.append([units[name] for name in columns])
    for row in zip(*_mixed(columns, victim).values(), strict=True):
        sheet.append(list(row))
    book.save(path)


def _parquet(path: Path, columns: Columns, units: Mapping[str, str], victim: str) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table(_mixed(columns, victim)), path)


def _mat5(path: Path, columns: Columns, units: Mapping[str, str], victim: str) -> None:
    import scipy.io

    scipy.io.savemat(path, {"run": {name: np.array(x) for name, x in _mixed(columns, victim).items()}})


def _mat73(path: Path, columns: Columns, units: Mapping[str, str], victim: str) -> None:
    import matio

    matio.save_to_mat(str(path), {name: "error" if name == victim else x for name, x in columns.items()})


def _timetable(path: Path, columns: Columns, units: Mapping[str, str], victim: str) -> None:
    import matio
    import pandas as pd

    index = pd.Index(np.round(columns["t"] * 1e3).astype("timedelta64[ms]"), name="Time")
    frame = pd.DataFrame({name: x for name, x in _mixed(columns, victim).items() if name != "t"}, index=index)
    matio.save_to_mat(str(path), {"run": frame}, version="v7")


def _hdf5(path: Path, columns: Columns, units: Mapping[str, str], victim: str) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        for name, x in _mixed(columns, victim).items():
            file.create_dataset(f"run/{name}", data=x).attrs["units"] = units[name]


def _tdms(path: Path, columns: Columns, units: Mapping[str, str], victim: str) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as file:
        file.write_segment(
            [ChannelObject("run", name, x if name == victim else columns[name], properties={"wf_increment": 0.01})
             for name, x in _mixed(columns, victim).items() if name != "t"]
        )  # fmt: skip


def _mf4(path: Path, columns: Columns, units: Mapping[str, str], victim: str) -> None:
    from asammdf import MDF, Signal

    signals = [
        Signal(np.array([b"error"] * len(x)) if name == victim else x, columns["t"], unit=units[name], name=name,
               encoding="utf-8" if name == victim else None)
        for name, x in columns.items() if name != "t"
    ]  # fmt: skip
    with MDF(version="4.10") as file:
        file.append(signals, common_timebase=True)
        file.save(path, overwrite=True)


WORDED: Mapping[str, Words] = {
    "xlsx": _xlsx, "parquet": _parquet, "mat5": _mat5, "mat73": _mat73, "timetable": _timetable, "hdf5": _hdf5,
    "tdms": _tdms, "mf4": _mf4,
}  # fmt: skip
"""Format -> writer of columns with their units, one of them, the victim, all words."""
