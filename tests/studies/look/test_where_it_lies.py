"""A recording that does not lie where the drafts are: the next command that `look` names works, or says why not."""

import re
import shlex

import numpy as np
import pytest

from studies.cli import main

FILL = {'tyre = ""': 'tyre = "A"', 'surface = ""': 'surface = "flat"'}


@pytest.fixture
def elsewhere(tmp_path, monkeypatch, no_pictures, capsys):
    """A sweep in one folder, drafts in another beside it, from which the commands are typed; and what `look` says."""
    rng, time = np.random.default_rng(2), np.arange(1200) / 50
    slip = np.interp(time, [0, 3, 9, 15, 21, 24], [0, 5, -5, 5, -5, 0])
    force = 440 * np.sin(1.3 * np.arctan(6400 * np.radians(slip) / 572)) + rng.normal(0, 1, time.size)
    rows = zip(time, slip, force, 400 + rng.normal(0, 2, time.size), strict=True)
    lines = [
        "t [s],slip [deg],Fy [N],Fz [N],v [m/s],p [bar]",
        *(",".join(f"{x:.3f}" for x in r) + ",3,5" for r in rows),
    ]
    for name in ("data", "study"):
        (tmp_path / name).mkdir()
    (tmp_path / "data" / "s.csv").write_text("\n".join([*lines, ""]))
    monkeypatch.chdir(tmp_path / "study")
    main(["look", "../data/s.csv", "--out", "drafts"])
    draft = tmp_path / "study" / "drafts" / "s.toml"
    text = draft.read_text()
    for empty, full in FILL.items():
        text = text.replace(empty, full)
    draft.write_text(text)
    return tmp_path, capsys.readouterr().out


def test_the_next_command_names_the_folder_of_the_recording(elsewhere, capsys, monkeypatch):
    folder_of_all, said = elsewhere
    command = shlex.split(re.search(r"next: (.*tyre fit.*)", said)[1])
    variable, _, folder = command[0].partition("=")
    assert (variable, folder) == ("VELOTYRE_FOLDER", str(folder_of_all / "data"))
    with pytest.raises(SystemExit):
        main(command[2:])
    assert "names '../../data/s.csv', which lies outside its folder" in capsys.readouterr().err
    monkeypatch.setenv(variable, folder)
    main([*command[2:], "--jobs", "1"])
    assert "1 condition, 0 with a relaxation length, 0 files skipped" in capsys.readouterr().out


def test_a_sidecar_that_is_refused_is_told_beside_others_that_are_read(elsewhere, capsys, monkeypatch):
    folder_of_all, _ = elsewhere
    monkeypatch.setenv("VELOTYRE_FOLDER", str(folder_of_all / "data"))
    (folder_of_all / "study" / "drafts" / "t.toml").write_text('recording = "../../../t.csv"\ntyre = "A"\n')
    main(["tyre", "fit", "drafts", "--out", "fit", "--jobs", "1"])
    told = capsys.readouterr()
    assert "1 condition, 0 with a relaxation length, 1 file skipped" in told.out
    assert "names '../../../t.csv', which lies outside" in told.out + told.err
