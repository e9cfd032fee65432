"""What is peculiar to each format: groups, rates, units, tables in tables, frames on a bus, files not finalised."""

import struct
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.shared.refusals import refuses
from tests.validation.recording_writers import WRITERS, quiet_matio
from tyre.formats import ChannelMap, Reading, contents, read_signals, table_rows
from tyre.ground import InputError
from tyre.recordings import read_records

TIME = np.arange(100) / 100
WAVE = np.sin(TIME)


def all_of(path, **reading):
    found = contents(path, reading=Reading(**reading))
    return {signal.name: signal for signal in found.load([column.name for column in found.columns], None)}


# MDF


def write_mdf(path: Path, groups, **settings):
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        for title, time, channels in groups:
            group = file.append([Signal(x, time, name=name, unit=unit) for name, x, unit in channels], acq_source=None,
                                comment=title, common_timebase=True)  # fmt: skip
            assert group is not None
        file.save(path, overwrite=True, **settings)


def test_groups_of_several_rates(tmp_path):
    slow = TIME[::5]
    write_mdf(tmp_path / "a.mf4", [
        ("IMU", TIME, [("gyro", WAVE, "deg/s"), ("acc", WAVE, "g")]), ("Rig", slow, [("gyro", slow, "rad/s")]),
    ], compression=2)  # fmt: skip
    found = read_signals(tmp_path / "a.mf4")
    assert {name: signal.unit for name, signal in found.signals.items()} == {
        "IMU/gyro": "deg/s", "acc": "g", "Rig/gyro": "rad/s",
    }  # fmt: skip
    np.testing.assert_array_equal(found["Rig/gyro"].time, slow)
    np.testing.assert_array_equal(found["acc"].values, WAVE)
    lazy = ChannelMap().with_channels(["rate=IMU/gyro"])
    assert list(read_signals(tmp_path / "a.mf4", map=lazy).signals) == ["IMU/gyro"]


def unfinalised(path: Path) -> None:
    """As a logger leaves it when its power is cut: length of the data and number of samples were never written."""
    raw = bytearray(path.read_bytes())
    raw[:8] = b"UnFinMF "
    raw[60] = 0b101  # cycle counters, length of the last data block (ASAM MDF 4.1, identification block)
    struct.pack_into("<Q", raw, bytes(raw).find(b"##DT") + 8, 24)
    place = bytes(raw).find(b"##CG")
    links = struct.unpack_from("<Q", raw, place + 16)[0]
    struct.pack_into("<Q", raw, place + 24 + 8 * links + 8, 0)
    path.write_bytes(raw)


def test_a_file_that_was_not_finalised(tmp_path):
    write_mdf(tmp_path / "a.mf4", [("IMU", TIME, [("gyro", WAVE, "deg/s")])])
    unfinalised(tmp_path / "a.mf4")
    before = (tmp_path / "a.mf4").read_bytes()
    found = read_signals(tmp_path / "a.mf4")
    np.testing.assert_array_equal(found["gyro"].values, WAVE)
    assert found.notes == ("the file was not finalised when the logger stopped: read as far as it was written",)
    assert (tmp_path / "a.mf4").read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["a.mf4"]


DBC = """VERSION ""
NS_ :
BS_:
BU_: ECU
BO_ 256 Motion: 8 ECU
 SG_ roll_rate : 0|16@1- (0.01,0) [-300|300] "deg/s" ECU
 SG_ steer : 16|16@1- (0.001,0.5) [-30|30] "rad" ECU
"""


@pytest.fixture
def bus(tmp_path):
    """Frames of two signals of 16 bits each, little-endian, and their database."""
    from asammdf import MDF, Signal
    from asammdf.blocks import v4_constants
    from asammdf.blocks.source_utils import Source

    roll, steer = np.round(1000 * WAVE).astype("<i2"), np.round(300 * np.cos(TIME)).astype("<i2")
    kind = np.dtype([
        ("CAN_DataFrame.BusChannel", "u1"), ("CAN_DataFrame.ID", "<u4"), ("CAN_DataFrame.IDE", "u1"),
        ("CAN_DataFrame.DLC", "u1"), ("CAN_DataFrame.DataLength", "u1"), ("CAN_DataFrame.DataBytes", "(8,)u1"),
    ])  # fmt: skip
    frames = np.zeros(len(TIME), kind)
    frames["CAN_DataFrame.BusChannel"], frames["CAN_DataFrame.ID"] = 1, 256
    frames["CAN_DataFrame.DLC"] = frames["CAN_DataFrame.DataLength"] = 8
    frames["CAN_DataFrame.DataBytes"][:, :2] = roll.view(np.uint8).reshape(-1, 2)
    frames["CAN_DataFrame.DataBytes"][:, 2:4] = steer.view(np.uint8).reshape(-1, 2)
    source = Source(name="CAN 1", path="CAN 1", comment="", source_type=v4_constants.SOURCE_BUS,
                    bus_type=v4_constants.BUS_TYPE_CAN)  # fmt: skip
    with MDF(version="4.10") as file:
        file.append(Signal(frames, TIME, name="CAN_DataFrame", source=source))
        file.save(tmp_path / "bus.mf4", overwrite=True)
    (tmp_path / "bus.dbc").write_text(DBC)
    return tmp_path / "bus.mf4", 0.01 * roll, 0.001 * steer + 0.5


def test_frames_are_decoded_with_a_database(bus):
    path, roll, steer = bus
    found = read_signals(path, dbc=[path.with_suffix(".dbc")])
    assert (found["roll_rate"].unit, found["steer"].unit) == ("deg/s", "rad")
    np.testing.assert_allclose(found["roll_rate"].values, roll, rtol=1e-12)
    np.testing.assert_allclose(found["steer"].values, steer, rtol=1e-12)
    np.testing.assert_allclose(found["steer"].time, TIME, atol=1e-9)
    told = {"channels": {"steer": "steer"}, "reading": {"dbc": ["bus.dbc"]}}
    (record,) = read_records(path, ChannelMap.from_table(told, path.parent, where="map"), {"steer": "angle"})
    np.testing.assert_allclose(record.values["steer"], steer, rtol=1e-12)


def test_frames_without_a_database_or_with_a_wrong_one(bus):
    path, _, _ = bus
    refuses("holds CAN frames that are not decoded; give their databases", contents, path)
    refuses("no such database .*other.dbc", read_signals, path, dbc=[path.with_name("other.dbc")])
    path.with_suffix(".dbc").write_text(DBC.replace("256", "257"))
    refuses("bus.dbc decode none of its CAN frames", read_signals, path, dbc=[path.with_suffix(".dbc")])


@pytest.mark.parametrize("ending", ["xlsx", "dbc"])
def test_a_database_is_taken_by_its_content_and_none_that_may_hold_code(bus, tmp_path, monkeypatch, ending):
    """The loader of spreadsheets for CAN databases executes column headings."""
    import openpyxl

    monkeypatch.chdir(tmp_path)
    book = openpyxl.Workbook()
    code = "frame.comment=open('OWNED.txt','w').write('x'); frame.comment"
    for row in (["ID", "Frame Name", "Signal Not Available", "Value", code], ["123h", "F", "", "", "''"]):
        book.active.append(row)
    book.save(tmp_path / "can.xlsx")
    path = (tmp_path / "can.xlsx").rename(tmp_path / f"can.{ending}")
    refuses(rf"can\.{ending} is no CAN database in text as \.dbc or \.arxml", read_signals, bus[0], dbc=[path])
    assert not (tmp_path / "OWNED.txt").exists()
    good = path.with_suffix(".txt")
    good.write_text(DBC)
    np.testing.assert_allclose(read_signals(bus[0], dbc=[good])["steer"].values, bus[2], rtol=1e-12)


@pytest.mark.parametrize(("formula", "allowed"), [
    ("0.5*X1+2", True), ("X1^2", True), ("sqrt(abs(X)) - 1.5e-3/(X1 + .5)", True), ("X1*0+9**9**9", False),
    ("9**(9**9)", False),
])  # fmt: skip
def test_a_formula_without_end_is_not_evaluated(tmp_path, formula, allowed):
    from asammdf import MDF, Signal
    from asammdf.blocks import v4_blocks, v4_constants

    with MDF(version="4.10") as file:
        file.append([Signal(np.arange(100), TIME, name="x", unit="deg/s")])
        file.groups[0].channels[1].conversion = v4_blocks.ChannelConversion(
            conversion_type=v4_constants.CONVERSION_TYPE_ALG, formula=formula
        )
        file.save(tmp_path / "a.mf4", overwrite=True)
    if allowed:
        assert read_signals(tmp_path / "a.mf4")["x"].values.size == 100
        return
    refuses(r"x is converted by the formula .* which is not evaluated", read_signals, tmp_path / "a.mf4")


CODE = "open('OWNED', 'w').write('X')"


@pytest.mark.parametrize("place", ["channel", "time", "within"])
@pytest.mark.parametrize("formula", [
    CODE, f"X*0 + {CODE}", f"[{CODE} for k in (1,)][0]", f"(lambda: {CODE})()", "X.__class__", "exec('X')",
])  # fmt: skip
def test_code_in_the_formula_of_a_measurement_file_is_not_run(tmp_path, monkeypatch, formula, place):
    """The library evaluates a formula as Python; read here and not in the child, so that its file would be found."""
    from asammdf import MDF, Signal
    from asammdf.blocks import v4_blocks, v4_constants

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tyre.formats.child.apart", lambda: False)
    coded = v4_blocks.ChannelConversion(conversion_type=v4_constants.CONVERSION_TYPE_ALG, formula=formula)
    with MDF(version="4.10") as file:
        file.append([Signal(np.arange(100), TIME, name="x", unit="deg/s")])
        time, channel = file.groups[0].channels
        if place == "within":
            outer = {"val_param_nr": 2, "lower_0": -1.0, "upper_0": 1e3, "text_0": coded, "default_addr": b""}
            channel.conversion = v4_blocks.ChannelConversion(
                conversion_type=v4_constants.CONVERSION_TYPE_RTABX, links_nr=6, ref_param_nr=2, **outer
            )
        elif place == "time":
            time.conversion = coded
        else:
            channel.conversion = coded
        file.save("a.mf4", overwrite=True)
    refuses(r"a\.mf4: .*formula .* is not evaluated", read_signals, Path("a.mf4"))
    assert not Path("OWNED").exists()


@pytest.mark.parametrize(("ending", "found", "other", "words"), [
    (".mf4", b"##DT", b"##DX", "x announces 100 samples and holds 0; is the file damaged"),
    (".tdms", struct.pack("<IQ", 1, 100), struct.pack("<IQ", 1, 101), "its channels announce more samples than"),
])  # fmt: skip
def test_fewer_samples_than_are_announced_are_refused(tmp_path, ending, found, other, words):
    writer = dict(WRITERS.values())[ending]
    writer(path := tmp_path / f"a{ending}", {"time": (TIME, "s"), "x": (WAVE, "N")})
    assert len(read_signals(path)[{".mf4": "x", ".tdms": "run/x"}[ending]].values) == 100
    path.write_bytes(path.read_bytes().replace(found, other, 1))
    refuses(words, read_signals, path)


# TDMS


def test_tdms_groups_and_times(tmp_path):
    from nptdms import ChannelObject, TdmsWriter

    stamps = np.datetime64("2026-03-01T12:00:00") + (TIME * 1e3).astype("timedelta64[ms]")
    with TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment([
            ChannelObject("rig", "Fy", WAVE, properties={"unit_string": "kN", "wf_increment": 0.02}),
            ChannelObject("rig", "note", ["a", "b"]), ChannelObject("log", "stamp", stamps),
        ])  # fmt: skip
    found = all_of(tmp_path / "a.tdms")
    assert {name: signal.unit for name, signal in found.items()} == {"rig/Fy": "kN", "log/stamp": "datetime"}
    np.testing.assert_allclose(found["rig/Fy"].time, 2 * TIME)
    np.testing.assert_allclose(found["log/stamp"].values, TIME, atol=1e-6)
    assert set(all_of(tmp_path / "a.tdms", table="rig")) == {"rig/Fy"}
    refuses("no group 'rigg'; there are log, rig", contents, tmp_path / "a.tdms", reading=Reading(table="rigg"))


# MATLAB


def test_matlab_structures_and_matrices(tmp_path):
    import scipy.io

    content = {
        "run": {"imu": {"gyro": np.column_stack([TIME, WAVE])}, "name": "x"}, "fs": 200.0, "z": WAVE * 1j,
        "wide": np.vstack([TIME, WAVE]), "two": [{"x": TIME}, {"x": WAVE}], "n": np.arange(100, dtype=np.int16),
    }  # fmt: skip
    scipy.io.savemat(tmp_path / "a.mat", content)
    found = all_of(tmp_path / "a.mat")
    assert {"run.imu.gyro(1)", "run.imu.gyro(2)", "wide(2)", "n"} <= set(found)
    assert not {"fs", "z", "run.name"} & set(found)
    for name in ("run.imu.gyro(2)", "wide(2)"):
        np.testing.assert_array_equal(found[name].values, WAVE)
    assert set(all_of(tmp_path / "a.mat", table="wide")) == {"wide(1)", "wide(2)"}
    refuses("no variable 'Run'; did you mean 'run'", contents, tmp_path / "a.mat", reading=Reading(table="Run"))


@pytest.mark.parametrize("version", ["v7", "v7.3"])
@pytest.mark.filterwarnings("ignore:duration_to_mat")  # of the writer
def test_matlab_timetables_have_their_own_times(tmp_path, version):
    import pandas as pd

    matio = quiet_matio()
    dates = pd.date_range("2026-03-01", periods=100, freq="10ms")
    durations = pd.Index((TIME * 1e3).round().astype("timedelta64[ms]"), name="Time")
    frames = {name: pd.DataFrame({"gyro": WAVE, "note": "x"}, index=i) for name, i in (("a", dates), ("b", durations))}
    matio.save_to_mat(str(tmp_path / "a.mat"), frames, version=version)
    found = all_of(tmp_path / "a.mat")
    assert set(found) == {"a.gyro", "b.gyro"}
    for name in found:
        np.testing.assert_array_equal(found[name].values, WAVE)
        np.testing.assert_allclose(found[name].time, TIME, atol=1e-9)
    assert contents(tmp_path / "a.mat").own_times


# HDF5


def test_hdf5_groups_matrices_and_compounds(tmp_path):
    import h5py

    pair = np.zeros(100, [("x", "f8"), ("label", "S3"), ("y", "i4")])
    pair["x"] = WAVE
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["imu/gyro"] = np.column_stack([TIME, WAVE]).astype("f4")
        file["imu/gyro"].attrs["Units"] = np.array([b"deg/s"])
        file["pair"] = pair
        file["label"], file["one"] = "text", 3.0
    found = all_of(tmp_path / "a.h5")
    assert {name: signal.unit for name, signal in found.items()} == {
        "imu/gyro[0]": "deg/s", "imu/gyro[1]": "deg/s", "pair.x": "", "pair.y": "",
    }  # fmt: skip
    np.testing.assert_array_equal(found["imu/gyro[1]"].values, WAVE.astype("f4"))
    np.testing.assert_array_equal(found["pair.x"].values, WAVE)
    assert set(all_of(tmp_path / "a.h5", table="imu")) == {"imu/gyro[0]", "imu/gyro[1]"}
    assert set(all_of(tmp_path / "a.h5", table="pair")) == {"pair.x", "pair.y"}
    with pytest.raises(InputError, match="no group 'rig'; there are imu, label, one, pair"):
        contents(tmp_path / "a.h5", reading=Reading(table="rig"))


@pytest.fixture
def foreign(tmp_path):
    """How each dataset is made that lies in another file: external storage, virtual datasets and links."""
    import h5py

    (tmp_path / "secret.bin").write_bytes(bytes(80))
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = WAVE
    layout = h5py.VirtualLayout((100,), "f8")
    layout[:] = h5py.VirtualSource(tmp_path / "other.h5", "x", (100,))
    link = h5py.ExternalLink(str(tmp_path / "other.h5"), "/x")
    return {
        "stored": lambda file: file.create_dataset("x", (10,), "f8", external=[(str(tmp_path / "secret.bin"), 0, 80)]),
        "virtual": lambda file: file.create_virtual_dataset("x", layout),
        "linked": lambda file: file.__setitem__("x", link),
        "beside": lambda file: file.update({"x": WAVE, "away": link}),
        "softly": lambda file: file.update({"x": h5py.SoftLink("/a/way"), "a/way": link, "y": WAVE}),
    }


def test_values_in_other_files_are_not_read(tmp_path, foreign):
    import h5py

    for name, make in foreign.items():
        with h5py.File(tmp_path / f"{name}.h5", "w") as file:
            make(file)
        refuses("other file", contents, tmp_path / f"{name}.h5")
        refuses("other file", contents, tmp_path / f"{name}.h5", reading=Reading(table="x"))


def test_values_in_other_files_of_matlab_are_not_read(tmp_path, foreign):
    """Version 7.3 is HDF5 behind a header."""
    import h5py

    for name, make in foreign.items():
        matlab = tmp_path / f"{name}.mat"
        with h5py.File(matlab, "w", userblock_size=512) as file:
            make(file)
        with matlab.open("r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
        refuses("other file", contents, matlab)


def test_a_soft_link_within_a_file_is_no_danger(tmp_path):
    import h5py

    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.update({"imu/x": WAVE, "motion": h5py.SoftLink("/imu"), "nowhere": h5py.SoftLink("/none")})
    assert set(all_of(tmp_path / "a.h5", table="motion")) == {"motion/x"}
    refuses("no group 'nowhere'", contents, tmp_path / "a.h5", reading=Reading(table="nowhere"))


# Parquet


def test_parquet_stamps_units_and_missing_samples(tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    values = [None if k == 3 else float(x) for k, x in enumerate(WAVE)]
    ticks = (1_772_000_000_000 + np.arange(100) * 10).tolist()
    table = pa.table(
        {"stamp": pa.array(ticks, pa.timestamp("ms")), "lap": pa.array(ticks, pa.duration("ms")),
         "F [kN]": values, "n": pa.array(range(100), pa.int32()), "note": ["x"] * 100}
    )  # fmt: skip
    pq.write_table(table, tmp_path / "a.parquet", row_group_size=7)
    found = all_of(tmp_path / "a.parquet")
    assert {name: signal.unit for name, signal in found.items()} == {
        "stamp": "datetime", "lap": "s", "F": "kN", "n": "",
    }  # fmt: skip
    np.testing.assert_allclose(found["stamp"].values, TIME, atol=1e-12)
    np.testing.assert_array_equal(found["F"].values, [np.nan if k == 3 else x for k, x in enumerate(WAVE)])
    assert len(read_signals(tmp_path / "a.parquet", most=9)["F"].values) == 9


# Spreadsheets


def write_sheets(path, **sheets):
    import openpyxl

    book = openpyxl.Workbook(write_only=True)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(path)


TABLE = [["Versuch 7"], [], ["t", "Fy [kN]"], [0, 1.5], [0.5, None], [1, 2]]


def test_sheets(tmp_path):
    path = tmp_path / "a.xlsx"
    write_sheets(path, Leer=[], Messung=TABLE)
    found = all_of(path)
    np.testing.assert_array_equal(found["Fy"].values, [1.5, np.nan, 2])
    assert found["Fy"].unit == "kN"
    write_sheets(path, Eins=TABLE, Zwei=TABLE)
    refuses("has the sheets Eins, Zwei; name one, as sheet = ", contents, path)
    assert set(all_of(path, sheet="Zwei")) == {"t", "Fy"}
    with pytest.raises(InputError, match="no sheet 'Drei'; there are Eins, Zwei|no sheet 'Drei'; did you mean"):
        contents(path, reading=Reading(sheet="Drei"))
    write_sheets(path, Leer=[])
    refuses("every sheet is empty", contents, path)
    write_sheets(path, Worte=[["a", "b"], ["c", "d"]])
    refuses("no table of numbers was found", contents, path)


def test_dates_and_words_in_sheets(tmp_path):
    from datetime import datetime, time, timedelta

    start, path = datetime(2026, 3, 1, 12), tmp_path / "a.xlsx"
    write_sheets(path, A=[["t", "f"], *([start + timedelta(seconds=k), k] for k in range(5))])
    found = all_of(path)
    np.testing.assert_allclose(found["t"].values, range(5), atol=1e-3)
    assert found["t"].unit == "datetime"
    write_sheets(path, A=[["t", "f"], [0, 1], [1, "x"], [2, 3]])
    refuses("sheet 'A', row 3: f = 'x' is not a number; empty cells are missing", all_of, path)
    clock = [time(23, 59, 58, 500_000), time(23, 59, 59, 500_000), time(0, 0, 0, 500_000), time(0, 0, 1, 500_000)]
    write_sheets(path, A=[["t", "f"], *([moment, 1] for moment in clock)])
    np.testing.assert_allclose(all_of(path)["t"].values, range(4), atol=1e-3)
    write_sheets(
        path, A=[["t", "f"], *([datetime(2026, 3, 1, 23, 59, 58) + timedelta(seconds=k), k] for k in range(5))]
    )
    np.testing.assert_allclose(all_of(path)["t"].values, range(5), atol=1e-3)  # at midnight a cell holds a day


# Any of them


def many_samples_of_hdf5(path):
    import h5py

    with h5py.File(path, "w") as file:  # none of them is written: 2 kB
        file.create_dataset("x", (300_000_000,), "f8", chunks=(1_000_000,), compression="gzip")


def one_chunk_of_hdf5(path):
    import h5py

    with h5py.File(path, "w") as file:  # which is unpacked whole for its ten numbers
        file.create_dataset("x", (10,), "f8", maxshape=(None,), chunks=(200_000_000,), compression="gzip")


def many_fields_of_matlab(path):
    from scipy.io import savemat

    savemat(path, {"s": {f"f{number}": [1.0, 2.0] for number in range(10_001)}}, do_compression=True)


def many_variables_of_matlab(path):
    from scipy.io import savemat

    savemat(path, {f"v{number}": [1.0, 2.0] for number in range(10_001)}, do_compression=True)


def many_samples_of_parquet(path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.table({"x": pa.nulls(5_000_000, pa.float64())})
    with pq.ParquetWriter(path, table.schema, compression="zstd") as file:
        for _ in range(25):
            file.write_table(table)


def many_rows_of_a_spreadsheet(path):
    import zipfile

    write_sheets(path, A=[["t"], [0]])
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as parts:
        parts.writestr("xl/worksheets/sheet2.xml", b"<row><c><v>1</v></c></row>")
        parts.getinfo("xl/worksheets/sheet2.xml").file_size = 312_000_000  # as the directory of such an archive says


@pytest.mark.parametrize(("name", "write", "words"), [
    ("a.h5", many_samples_of_hdf5, "1 channels of up to 300,000,000 samples are 300,000,000 numbers, at most"),
    ("a.h5", one_chunk_of_hdf5, "1 channels of up to 200,000,000 samples are 200,000,000 numbers, at most"),
    ("a.mat", many_fields_of_matlab, "holds 10,001 channels, at most 10,000 are read; remove what is not measured"),
    ("a.mat", many_variables_of_matlab, "10001 channels of up to 2 samples are 20,002 numbers, at most"),
    ("a.parquet", many_samples_of_parquet, "1 channels of up to 125,000,000 samples are 125,000,000 numbers"),
    ("a.xlsx", many_rows_of_a_spreadsheet, "holds 312 MB once unpacked, at most 250 MB are read of a spreadsheet"),
])  # fmt: skip
def test_a_small_file_of_many_numbers_is_refused_with_its_size(tmp_path, name, write, words):
    write(tmp_path / name)
    assert (tmp_path / name).stat().st_size < 1e6
    refuses(words, read_signals, tmp_path / name)


@pytest.mark.parametrize(("suffix", "package", "extra"), [
    (".mf4", "asammdf", "can"), (".tdms", "nptdms", "tdms"), (".parquet", "pyarrow.parquet", "formats"),
    (".xlsx", "python_calamine", "formats"), (".mat", "matio", "formats"), (".h5", "h5py", "formats"),
])  # fmt: skip
def test_a_library_that_is_not_installed_is_named_with_its_extra(tmp_path, monkeypatch, suffix, package, extra):
    (path := tmp_path / f"a{suffix}").write_bytes(b"MDF     ")
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.setattr("tyre.formats.child.apart", lambda: False)
    words = rf"{package} is not installed; install it with: pip install .*\[{extra}\]"
    for read in (contents, partial(table_rows, kind="bicycles"))[: 1 + (suffix in (".parquet", ".xlsx"))]:
        refuses(words, read, path)


def test_groups_too_deep_and_empty_data_in_hdf5(tmp_path):
    import h5py

    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"], file["none"] = np.arange(5.0), h5py.Empty("f8")
        file.create_dataset("zero", (0, 5), "f8")
        file["way/round"] = h5py.SoftLink("/")
        file["way/hard"] = file["/"]
    assert list(read_signals(tmp_path / "a.h5").signals) == ["x"]
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["/".join("g" * 200)] = np.arange(5.0)
    refuses(r"a\.h5: groups lie in groups, more than 50 deep", contents, tmp_path / "a.h5")


def test_two_cells_far_apart_in_a_sheet_are_no_table(tmp_path):
    """The library would fill all 17,179,869,184 cells between them."""
    import zipfile

    write_sheets(tmp_path / "near.xlsx", A=[["t", "f"], [0, 1], [1, 2]])
    with zipfile.ZipFile(tmp_path / "near.xlsx") as near, zipfile.ZipFile(tmp_path / "far.xlsx", "w") as far:
        for name in near.namelist():
            text = near.read(name)
            if name.endswith("sheet1.xml"):
                text = text.replace(
                    b"</sheetData>", b'<row r="1048576"><c r="XFD1048576"><v>2</v></c></row></sheetData>'
                )
            far.writestr(name, text)
    words = r"far\.xlsx: its cells reach to row 1,048,576 and column 16,384, which are 17,179,869,184 cells; at most"
    refuses(words, contents, tmp_path / "far.xlsx")
    refuses(words, table_rows, tmp_path / "far.xlsx", "bicycles")
    assert [column.name for column in contents(tmp_path / "near.xlsx").columns] == ["t", "f"]


def test_importing_the_room_loads_no_library_of_a_format():
    import subprocess

    code = (
        "import sys, tyre.formats, tyre.recordings.channels, tyre.recordings.draft; "
        "print([x for x in ('pandas', 'pyarrow', 'h5py', 'asammdf', 'matio', 'nptdms', 'scipy') if x in sys.modules])"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == "[]"
