"""Rig recordings in a laboratory's own columns: sidecars with a channel map, and what is refused."""

import numpy as np
import pytest

from tests.shared.refusals import refuses
from tests.validation.recording_writers import write_csv, write_hdf5, write_parquet
from tyre.fits import read_events, read_recording
from tyre.ground import InputError
from tyre.recordings import LateralStiffnessTest, RigRun

SIDECAR = """
tyre = "Test tyre"
load_N = 400
pressure_bar = 5.5
surface = "flat"
axes = "SAE"
"""
SWEEP = """
[channels]
time = {column = "t", unit = "ms"}
slip_angle = {column = "SA", sign = -1}
lateral_force = "FY"
vertical_load = {column = "FZ"}
"""
PULL = """
[channels]
lateral_force = "F"
plate_displacement = {column = "plate", unit = "mm"}
rim_displacement = {column = "rim", unit = "mm"}
"""
N = 50
TIME = np.arange(N) / 100
SLIP = np.sin(TIME)
COLUMNS = {"t": (1e3 * TIME, "ms"), "SA": (SLIP, "deg"), "FY": (SLIP, "kN"), "FZ": (np.full(N, -0.4), "kN"),
           "T": (TIME, "V")}  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    def write(tables="", name="run", sidecar=SIDECAR):
        (tmp_path / f"{name}.toml").write_text(sidecar + tables)
        return tmp_path / f"{name}.toml"

    return write


@pytest.mark.parametrize(("suffix", "write"), [(".csv", write_csv), (".h5", write_hdf5), (".parquet", write_parquet)])
def test_a_sweep_in_other_columns_units_and_axes(folder, suffix, write):
    sidecar = folder(SWEEP)
    write(sidecar.with_suffix(suffix), COLUMNS)
    for path in (sidecar, sidecar.with_suffix(suffix)):
        run = read_recording(path)
        assert isinstance(run, RigRun)
        np.testing.assert_allclose(run.time, TIME, rtol=1e-12)
        np.testing.assert_allclose(run.slip_angle, np.deg2rad(SLIP))  # SAE turns the sign, the map turns it back
        np.testing.assert_allclose(run.lateral_force, 1e3 * SLIP)
        np.testing.assert_allclose(run.vertical_load, 400)
    (event,) = read_events(sidecar)
    assert event == ""


def test_a_sidecar_may_name_a_file_with_another_stem(folder, tmp_path):
    (tmp_path / "raw").mkdir()
    write_parquet(tmp_path / "raw" / "big.parquet", COLUMNS)
    window = "[[windows]]\nfrom_s = 0.1\nto_s = 0.3\n"
    run = read_recording(folder(SWEEP + window, sidecar='recording = "raw/big.parquet"' + SIDECAR))
    np.testing.assert_allclose(run.time, TIME[10:31], rtol=1e-12)


def test_a_lateral_stiffness_test_read_from_dial_gauges_needs_no_time(folder, tmp_path):
    pull = {"F": (100 * TIME, "N"), "plate": (TIME, "mm"), "rim": (0.1 * TIME, "mm")}
    write_parquet(tmp_path / "run.parquet", pull)
    test = read_recording(folder(PULL))
    assert isinstance(test, LateralStiffnessTest)
    assert test.time is None
    np.testing.assert_allclose(test.tyre_deflection, 0.9e-3 * TIME, atol=1e-15)


def test_a_lateral_stiffness_test_takes_load_and_pressure_of_its_channels(folder, tmp_path):
    noise = np.random.default_rng(1).normal(0, 1, (2, N))
    pull = {"F": (100 * TIME, "N"), "plate": (TIME, "mm"), "rim": (0.1 * TIME, "mm"),
            "load": (41.9 + 0.1 * noise[0], "kgf"), "p": (80 + 0.1 * noise[1], "psi")}  # fmt: skip
    sidecar = SIDECAR.replace("load_N = 400\npressure_bar = 5.5\n", "").replace("SAE", "adapted SAE")
    channels = PULL + 'vertical_load = "load"\npressure = "p"\n'
    write_parquet(tmp_path / "run.parquet", pull)
    condition = read_recording(folder(channels, sidecar=sidecar)).condition
    assert condition.load == 410  # 410.9 N, as a slip sweep at this load is called
    assert condition.pressure == 5.5e5  # 80 psi are 5.516 bar
    assert condition.camber == 0
    declared = sidecar + "load_N = 412\npressure_bar = 5.6\n"
    test = read_recording(folder(channels, sidecar=declared))
    assert (test.condition.load, test.notes) == (412, ())
    other = read_recording(folder(channels, sidecar=declared.replace("412", "500")))
    assert other.notes == ("median load is 410.9 N, declared are 500 N",)
    refuses("key 'pressure' is missing in the sidecar, and no channel has it", read_recording,
            folder(PULL + 'vertical_load = "load"\n', sidecar=sidecar))  # fmt: skip
    write_parquet(tmp_path / "run.parquet", pull | {"load": (np.linspace(0, 60, N), "kgf")})
    refuses("the load varies during the lateral stiffness test; select the test itself", read_recording,
            folder(channels, sidecar=sidecar))  # fmt: skip


def test_two_files_of_one_stem(folder, tmp_path):
    for suffix in ("h5", "parquet"):
        write_parquet(tmp_path / f"run.{suffix}", COLUMNS)
    refuses(r"describes run.h5, run.parquet; write recording = 'run.h5' or rename", read_recording, folder(SWEEP))


def test_files_without_a_map_are_shown_with_a_draft(folder, tmp_path):
    sidecar = folder()
    write_parquet(sidecar.with_suffix(".parquet"), COLUMNS)
    with pytest.raises(
        InputError, match=r"run\.parquet: no channel map .* the columns are t \[ms\], SA \[deg\]"
    ) as told:
        read_recording(sidecar)
    draft = "[channels]" + str(told.value).partition("[channels]")[2]
    run = read_recording(folder(draft.replace('"SA"', '"SA", sign = -1')))
    np.testing.assert_allclose(run.slip_angle, np.deg2rad(SLIP))
    (tmp_path / "own.csv").write_text("t;SA;FY\nms;deg;kN\n0;1;2\n10;2;3\n")
    with pytest.raises(
        InputError, match="no known column name .* put a channel map into the sidecar: the columns are t"
    ):
        read_recording(tmp_path / "own.csv")
    (tmp_path / "own.csv").write_text("time_s,slip_angle_deg,Fy [N]\n0,1,2\n10,2,3\n")
    (tmp_path / "own.toml").write_text(SIDECAR)
    refuses(
        r'column lateral_force_N is missing (.|\n)*lateral_force = {column = "Fy"}',
        read_recording,
        tmp_path / "own.csv",
    )


def test_mistakes_in_a_map_name_the_sidecar(folder, tmp_path):
    write_parquet(tmp_path / "run.parquet", COLUMNS)
    with pytest.raises(InputError, match=r"run\.toml: \[channels\]: \[slip_angle\]: unknown key 'units'"):
        read_recording(folder(SWEEP.replace("sign = -1", 'units = "deg"')))
    refuses(r"run\.toml: unknown key 'chanels'; did you mean 'channels'\?", read_recording, folder("[chanels]\n"))
