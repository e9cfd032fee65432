"""``velotyre tyre simulate`` and ``velotyre tyre fit`` as a user calls them."""

import json

import pytest
from read_report import read_report

from studies.cli import main
from studies.reporting import made_by

SMALL = ["--loads", "400", "--pressures", "5", "--rates", "4", "--sweeps", "1", "--pulls", "1"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("campaign")
    main(["tyre", "simulate", str(place), "--seed", "7", *SMALL, "--axes", "SAE", "--format", "mixed"])
    return place


def test_simulate_writes_recordings_and_truth(folder):
    assert sorted(path.suffix for path in folder.iterdir()) == [".csv", ".json", ".json", ".tdx", ".toml"]
    truth = json.loads((folder / "truth.json").read_text())
    assert truth["synthetic"] is True
    assert truth["seed"] == 7
    assert "synthetic = true" in next(folder.glob("*.toml")).read_text()


def test_fit_writes_json_to_file_and_stdout(folder, tmp_path, capsys, no_pictures, printed):
    out = tmp_path / "a"
    fit = ["tyre", "fit", str(folder), "--out", str(out), "--jobs", "1", "--json"]
    main([*fit, str(tmp_path / "c.json"), "--every-residual"])
    assert len(list((out / "figures" / "residuals").glob("*.png"))) == 2
    assert "1 condition, 1 with a relaxation length, 0 files skipped" in capsys.readouterr().out
    shown = json.loads(printed(*fit, "-"))
    assert shown == json.loads((tmp_path / "c.json").read_text())
    truth = json.loads((folder / "truth.json").read_text())["conditions"][0]
    (condition,) = shown["conditions"]
    for name in ("cornering_stiffness_N_per_rad", "lateral_stiffness_N_per_m", "relaxation_length_m"):
        low, high = condition[name]["ci95"]
        assert low < truth[name] < high


def test_what_lacks_a_relaxation_length_is_said(tmp_path, capsys, no_pictures):
    main(["tyre", "simulate", str(tmp_path / "rig"), "--seed", "9", *SMALL])
    (sidecar,) = (tmp_path / "rig").glob("*pull*.toml")
    sidecar.write_text(sidecar.read_text().replace("load_N = 400.0", "load_N = 401.0"))
    capsys.readouterr()
    main(["tyre", "fit", str(tmp_path / "rig"), "--out", str(tmp_path / "out"), "--jobs", "1"])
    printed = capsys.readouterr()
    assert "2 conditions, 0 with a relaxation length, 0 files skipped" in printed.out
    assert "nearly the same condition is taken as two: " in printed.err
    assert "if it is one, declare the same load and pressure in their sidecars" in printed.err
    assert "conditions without C or K, not in the map: 2" in printed.err


def test_a_bad_file_is_left_out_and_listed(folder, tmp_path, capsys, no_pictures, refused):
    main(["tyre", "simulate", str(tmp_path / "rig"), "--seed", "8", *SMALL])
    bad = tmp_path / "rig" / "bad.tdx"
    bad.write_text("no TYDEX here\n")
    capsys.readouterr()
    fit = ["tyre", "fit", str(tmp_path / "rig"), "--out", str(tmp_path / "out"), "--jobs", "1"]
    error = refused(*fit, "--stop-at-bad")
    assert "bad.tdx" in error
    assert error.count("\n") == 1
    main(fit)
    printed = capsys.readouterr()
    assert "skipped bad.tdx" in printed.err
    report = read_report(tmp_path / "out")
    assert "## Skipped files (1)" in report
    assert report.endswith(made_by())


@pytest.mark.parametrize(("arguments", "words"), [
    (["--loads", "340;400"], "must be numbers separated by commas"),
    (["--rates", "0"], "rates must be positive and finite, got 0"),
    (["--loads", "340,inf"], "loads = '340,inf' must be numbers separated by commas"),
    (["--loads", "300,300"], "loads = 300,300 names one twice, whose files would take each other's place"),
    (["--surfaces", "flat,flat"], "surfaces = flat,flat names one twice"),
    (["--seed", "-1"], "-1: give a whole number from 0"),
    (["--axes", "iso"], "is not one of ISO, SAE, adapted SAE"),
    (["--effect", "nois:white=2"], "did you mean 'noise'"),
    (["--effect", "noise:white=loud"], "must be numbers separated by commas"),
    (["--without", "rig_fricton"], "did you mean 'rig_friction'"),
    (["--sweeps", "0", "--pulls", "0"], "one must be positive"),
])  # fmt: skip
def test_simulate_refuses_nonsense(tmp_path, arguments, words, refused):
    assert words in refused("tyre", "simulate", str(tmp_path / "x"), "--seed", "1", *arguments)


def test_fit_refuses_nonsense(tmp_path, refused):
    missing = ["tyre", "fit", str(tmp_path / "none"), "--out", str(tmp_path / "o")]
    assert "no such folder" in refused(*missing)
    for name in ("--load-tolerance", "--force-calibration", "--slip-calibration", "--gauge-calibration"):
        assert f"'{name}': 200: give a number" in refused(*missing, name, "200")  # per cent, as it was typed
    assert "'--load-tolerance': 0: give a number above 0 up to 100" in refused(*missing, "--load-tolerance", "0")
    assert "'--repeatability': 51: give a number from 0 up to 50" in refused(*missing, "--repeatability", "51")
    assert "must be from 0.05 to 1 m" in refused(*missing, "--wheel-radius", "7")
    assert "'--force-calibration': -1: give a number from 0" in refused(*missing, "--force-calibration", "-1")
