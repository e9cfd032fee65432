"""Recordings of a rig measurement that cannot be used: left out of a folder with the reason, refused by name."""

from dataclasses import replace

import numpy as np
import pytest

from studies.diagnosis import read_measurement
from tests.shared.refusals import refuses
from tests.validation.sensor_faults import TYRES, sweep, two_gains
from tyre.fits import write_csv
from tyre.ground import InputError

RIG = 'kind = "rig"\ndescription = "Synthetic."\n[rig]\nrecordings = "new"\n[rig.reference]\nrecordings = "old"\n'


@pytest.fixture
def folder(tmp_path):
    rng = np.random.default_rng(8)
    run = sweep(rng, TYRES["magic formula"])
    again = replace(run, lateral_force=run.lateral_force + rng.normal(0.0, 1.0, run.time.size))
    for place, recording in (("old", run), ("new", two_gains(again, 0.15))):
        (tmp_path / place).mkdir()
        write_csv(recording, tmp_path / place / "sweep.csv")
        (tmp_path / place / "dead.csv").write_text("time_s,slip_angle_deg\n0,1\n")
    return tmp_path


def read(folder, text=RIG):
    (folder / "rig.toml").write_text(text)
    return read_measurement(folder / "rig.toml")


def test_a_bad_recording_of_a_folder_is_left_out_and_told(folder):
    found = read(folder).prepare()
    assert [name for name, _ in found.sweeps] == ["sweep"]
    assert any(note.startswith("dead: left out: ") and "sidecar is missing" in note for note in found.notes)
    assert "(dead.csv left out: " in found.reference.origin
    assert any(
        note.startswith("sweep: the force cell seems to have a larger gain to the right") for note in found.notes
    )


def test_a_bad_recording_that_is_named_is_refused(folder):
    with pytest.raises(InputError, match=r"dead\.toml: the sidecar is missing"):
        read(folder, RIG.replace('"new"', '["new/sweep.csv", "new/dead.csv"]'))


def test_a_folder_of_bad_recordings_is_refused(folder):
    for path in (folder / "new").glob("*.toml"):
        path.unlink()
    refuses(r"none of 2 recordings can be used; dead: left out: .*sidecar is missing", read, folder)


@pytest.mark.parametrize("value", ["0", "2", '"x"'])
def test_the_load_tolerance_must_be_a_share(folder, value):
    with pytest.raises(InputError, match="above 0, at most 1: a share of the declared load"):
        read(folder, RIG.replace("[rig.ref", f"load_tolerance = {value}\n[rig.ref"))


def test_a_load_off_the_declared_one_is_refused_unless_allowed(folder):
    place = folder / "new" / "sweep.toml"
    text = place.read_text()
    load = float(text.partition("load_N = ")[2].partition("\n")[0])
    place.write_text(text.replace(f"load_N = {text.partition('load_N = ')[2].partition(chr(10))[0]}",
                                  f"load_N = {load / 1.1}"))  # fmt: skip
    refuses(r"\+10\.0% off the declared", read, folder)
    allowed = RIG.replace("[rig.ref", "load_tolerance = 0.2\n[rig.ref")
    assert any("+10.0% off the declared" in note for note in read(folder, allowed).notes)
