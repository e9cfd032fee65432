"""The same rig campaign in every format, in awkward units, signs and axes, gives the same fit."""

import json
import math

import pytest
from lab_recordings import write_lab

from studies.cli import main
from tests.validation.recording_writers import WRITERS
from tyre.fits import read_recording
from tyre.ground import InputError

SMALL = ["--loads", "400", "--pressures", "5", "--rates", "4", "--sweeps", "1", "--pulls", "1"]


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """A simulated campaign: its recordings as read, and what the fit of velotyre's own CSV files says."""
    place = tmp_path_factory.mktemp("campaign")
    main(["tyre", "simulate", str(place / "own"), "--seed", "7", *SMALL, "--axes", "SAE", "--format", "csv"])
    recordings = {path.stem: read_recording(path) for path in sorted((place / "own").glob("*.csv"))}
    return recordings, fitted(place / "own", place / "fit")


@pytest.fixture(autouse=True)
def _numbers_alone(monkeypatch):
    """The fits are compared; nothing is drawn of them."""
    monkeypatch.setattr("studies.rig_campaign.figures.save_figures", lambda *_, **__: [])


def fitted(folder, out, *options):
    file = out.with_suffix(".json")
    main(["tyre", "fit", str(folder), "--out", str(out), "--json", str(file), "--jobs", "1", *options])
    return json.loads(file.read_text())["conditions"]


def same(found, expected, *, where=""):
    """Numbers within 1e-9 of each other; texts of files and warnings aside."""
    if isinstance(expected, dict):
        assert found.keys() == expected.keys()
        for key in expected.keys() - {"files", "warnings"}:
            same(found[key], expected[key], where=f"{where}.{key}")
    elif isinstance(expected, list):
        assert len(found) == len(expected)
        for place, (one, other) in enumerate(zip(found, expected, strict=True)):
            same(one, other, where=f"{where}[{place}]")
    elif isinstance(expected, float):
        assert math.isclose(found, expected, rel_tol=1e-9), (where, found, expected)
    else:
        assert found == expected, where


@pytest.mark.filterwarnings("ignore:duration_to_mat")  # of the writer
@pytest.mark.parametrize("form", WRITERS)
def test_every_format_gives_the_same_fit(no_pictures, form, campaign, tmp_path, capsys):
    recordings, expected = campaign
    assert len(recordings) > 1
    (tmp_path / "lab").mkdir()
    for stem, recording in recordings.items():
        write_lab(tmp_path / "lab", form, recording, stem)
    same(fitted(tmp_path / "lab", tmp_path / "fit"), expected)
    assert not list((tmp_path / "fit").glob(".as_read*"))
    assert "0 files skipped" in capsys.readouterr().out


def test_events_of_one_file_are_recordings_of_their_own(campaign, tmp_path):
    """Two sweeps one after the other in one file, told by windows, are two files of the result."""
    recordings, _ = campaign
    stem, sweep = next((stem, r) for stem, r in recordings.items() if hasattr(r, "slip_angle"))
    path = write_lab(tmp_path, "hdf5", sweep, stem)
    half = (sweep.time[-1] - sweep.time[0]) / 2
    windows = f'[[windows]]\nname = "first"\nto_s = {half}\n[[windows]]\nname = "second"\nfrom_s = {half}\n'
    sidecar = path.with_suffix(".toml")
    sidecar.write_text(sidecar.read_text() + windows)
    (condition,) = fitted(tmp_path, tmp_path / "fit")
    assert condition["files"] == [f"{path.name}#first", f"{path.name}#second"]
    with pytest.raises(InputError, match="holds the events first, second; one recording is needed here"):
        read_recording(sidecar)


def test_a_recording_that_cannot_be_read_is_skipped_or_refused(campaign, tmp_path, capsys, refused):
    recordings, _ = campaign
    for stem, recording in recordings.items():
        path = write_lab(tmp_path, "parquet", recording, stem)
    path.write_bytes(path.read_bytes()[:-100])
    line = refused("tyre", "fit", tmp_path, "--out", tmp_path / "fit", "--stop-at-bad")
    assert f"{path.name}: cannot be read as .parquet" in line
    main(["tyre", "fit", str(tmp_path), "--out", str(tmp_path / "fit"), "--jobs", "1"])
    shown = capsys.readouterr()
    assert f"skipped {path.name}: " in shown.err
    assert "1 file skipped" in shown.out


def test_a_file_without_a_sidecar_is_named(campaign, tmp_path, capsys):
    recordings, _ = campaign
    for stem, recording in recordings.items():
        path = write_lab(tmp_path, "hdf5", recording, stem)
    (tmp_path / "lonely.h5").write_bytes(path.read_bytes())
    fitted(tmp_path, tmp_path / "fit")
    assert "note: lonely.h5: passed over, for it has no sidecar" in capsys.readouterr().err


def test_unknown_headers_are_shown_with_a_draft_that_can_be_pasted(campaign, tmp_path, refused):
    """The draft, put into the sidecar as it stands, with the signs put right, gives the fit."""
    recordings, expected = campaign
    for stem, recording in recordings.items():
        path = write_lab(tmp_path, "tsv", recording, stem)
        sidecar = path.with_suffix(".toml")
        sidecar.write_text(sidecar.read_text().partition("[channels.")[0])
    for path in list(tmp_path.glob("*.tsv")):
        path.rename(path.with_suffix(".csv"))
    for path in sorted(tmp_path.glob("*.csv")):
        message = refused("tyre", "fit", tmp_path, "--out", tmp_path / "fit", "--jobs", "1", "--stop-at-bad")
        assert str(path) in message
        assert "the columns are t [ms]," in message
        draft = "[channels]" + message.partition("[channels]")[2]
        assert 'lateral_force = {column = "Fy"}  # the file states lbf' in draft
        pull = "Platte" in path.read_text()
        draft = draft.replace('column = "SR angle"', 'column = "SR angle", sign = -1')
        draft = draft.replace('column = "Mz"', 'column = "Mz", sign = -1')
        lines = [line for line in draft.splitlines() if not line.startswith("#")]
        assert any(line.startswith("plate_displacement") for line in lines) == pull
        sidecar = path.with_suffix(".toml")
        if not pull:  # what cannot be guessed is left to the user
            slip = 'slip_angle = {column = "SR angle", unit = "mrad", sign = -1}'
            lines = [line for line in lines if not line.startswith("slip_angle")] + [slip]
        sidecar.write_text(sidecar.read_text() + "\n".join(lines))
    same(fitted(tmp_path, tmp_path / "fit"), expected)


def test_an_interrupt_leaves_nothing_behind(campaign, tmp_path, monkeypatch, capsys):
    (tmp_path / "lab").mkdir()
    recordings, _ = campaign
    for stem, recording in recordings.items():
        write_lab(tmp_path / "lab", "csv", recording, stem)

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("tyre.formats.csv._samples", interrupted)
    with pytest.raises(SystemExit) as stop:
        main(["tyre", "fit", str(tmp_path / "lab"), "--out", str(tmp_path / "fit")])
    assert stop.value.code == 130
    assert capsys.readouterr().err.splitlines()[-1] == "velotyre: interrupted"
    assert [path.name for path in (tmp_path / "fit").rglob("*")] == [".cache"]
