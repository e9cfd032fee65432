"""The command: the question first, then the answer, and everything written."""

import re
from dataclasses import replace

import numpy as np
import pytest
from small_study import small

from studies.cli import main
from studies.commands.run import run_and_show
from studies.main_study.answer import answer
from studies.main_study.cases import Cases, tyre_cases
from studies.main_study.parallel import spread
from studies.main_study.report import write_report
from studies.main_study.settings import Settings
from studies.main_study.study import run_study
from studies.main_study.tables import write_tables
from studies.reporting import plotting
from studies.reporting.made_by import made_by


def tiny(**others):
    few = {"speeds": np.linspace(0, 30, 5), "max_speed": 35.0, "samples": 20, "fronts": 2}
    return small(**(few | others))


def one_tyre(settings):
    """Cases of one tyre, its lowest and highest pressure."""
    found = [case for case in tyre_cases(settings).found if case.name == "Tyre3 flat"]
    return Cases((found[0], found[-1]), ("Tyre9 flat at 3 bar: gone",))


@pytest.fixture
def quick(monkeypatch):
    """Small figures."""
    monkeypatch.setattr(plotting, "STYLE", {**plotting.STYLE, "savefig.dpi": 20})
    monkeypatch.setattr(plotting, "FORMATS", ("png",))  # both are tested with the paper's figures


def test_run_prints_the_question_then_the_answer_and_writes_everything(quick, tmp_path, capsys):
    folder = tmp_path / "new" / "out"
    run_and_show(tiny(), folder, workers=1, cases=one_tyre(tiny()))
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "Does less air in Tyre3 (measured on a flat track) bring pista_charlie_drops closer to wobble?"
    assert lines[1] == ""
    labels = [i for i, line in enumerate(lines) if re.match(r"(Yes|No|It depends|Closer|Farther)", line)]
    assert labels[0] == 2
    said = " ".join(line.strip() for line in lines)
    assert said.index("How sure:") < said.index("It hinges on") < said.index("How far to believe it:")
    assert lines[-1] == f"report: {(folder / 'report.html').as_posix()}"
    assert max(map(len, lines[:-1])) <= 110
    text = (folder / "report.md").read_text(encoding="utf-8")
    assert text.endswith(made_by())
    for sentence in said.split("How sure:")[0].removeprefix(lines[0]).strip().split(". ")[1:]:
        assert sentence.strip(" .") in text
    assert "- Tyre9 flat at 3 bar: gone" in text
    names = {file.name for file in folder.iterdir()}
    figures = {
        "headline", "wobble_hands_on", "damping_ratio", "critical_speeds",
        *(f"eigenvalues_{n}" for n in (1, 2, 3, 4)), "root_locus_1", "root_locus_2",
        *(f"paper_fig{n:02d}" for n in (1, 5, 6, 9, 10, 11, 12, 13, 14)),
    }  # fmt: skip
    assert {f"{name}.png" for name in figures} == {name for name in names if name.endswith(".png")}
    assert {"report.md", "report.html", "eigenvalues.csv", "wobble.csv", "hinges.csv"} < names
    shown = set(re.findall(r"\]\(([^)#]+\.png)\)", text))
    assert shown == {f"{name}.png" for name in figures}


def test_two_workers_write_the_tables_of_one(tmp_path, monkeypatch):
    """In two worlds of the same parts, as each process derives the equations of each set of parts."""
    worlds = property(lambda self: (self.reference, replace(self.reference, camber_share=0.5)))
    monkeypatch.setattr(Settings, "setups", worlds)
    settings = tiny()
    names = {}
    for workers in (1, 2):
        with spread(workers, lambda what: None) as each:
            study = run_study(settings, each=each, cases=one_tyre(settings))
        folder = tmp_path / str(workers)
        folder.mkdir()
        write_tables(study, folder)
        names[workers] = sorted(file.name for file in folder.iterdir())
    assert len(names[1]) == 11
    for name in names[1]:
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes(), name


def test_unknown_bicycle_is_refused_in_one_line(capsys, tmp_path):
    with pytest.raises(SystemExit) as stop:
        main(["run", "--bicycle", "benchmrk", "--out", str(tmp_path)])
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert error.startswith("velotyre: unknown bicycle 'benchmrk'; did you mean 'benchmark'?")
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_missing_tyre_table_is_refused_before_any_work(capsys, tmp_path):
    with pytest.raises(SystemExit) as stop:
        main(["run", "--tyre", str(tmp_path / "none.csv"), "--out", str(tmp_path / "out")])
    assert stop.value.code == 2
    assert "none.csv" in capsys.readouterr().err


@pytest.mark.parametrize("out", ["", "  ", "a\0b"])
def test_a_folder_without_a_name_is_refused(out, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stop:
        main(["run", "--out", out])
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert "is no folder name; give a folder to write into, for example out" in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_file_in_place_of_the_folder_is_refused(capsys, tmp_path):
    (tmp_path / "taken").write_text("mine")
    with pytest.raises(SystemExit) as stop:
        main(["run", "--out", str(tmp_path / "taken")])
    assert stop.value.code == 2
    assert "taken' is a file; give a folder to write into" in capsys.readouterr().err


def test_a_tyre_called_like_a_script_stays_text(tmp_path, monkeypatch):
    worlds = Settings.setups.fget
    monkeypatch.setattr(Settings, "setups", property(lambda self: worlds(self)[:2]))
    settings, hostile = tiny(), "<script>alert(1)</script>"
    cases = one_tyre(settings)
    cases = Cases(tuple(replace(case, name=hostile) for case in cases.found), (f"{hostile}: gone",))
    study = run_study(settings, cases=cases)
    write_report(study, answer(study), tmp_path, paper_figures=[])
    for name in ("report.md", "report.html"):
        text = (tmp_path / name).read_text(encoding="utf-8")
        assert "<script" not in text
        assert text.count("&lt;script&gt;alert(1)") > 5
