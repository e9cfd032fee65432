"""The study as a whole: what is computed and left out, how the work is spread, and the command that writes it."""

import re
from dataclasses import replace

import numpy as np
import pytest
from read_report import read_report
from small_study import chosen, small

from studies import main_study
from tyre.ground import InputError


def test_the_tyre_in_question_is_solved_in_every_world_and_the_others_in_the_first(racing):
    assert len(racing.results) == 5 * 3 + 2
    for setup in racing.settings.setups:
        others = list(racing.cases[3:]) if setup == racing.settings.reference else []
        assert [r.case for r in racing.results_of(setup)] == [*racing.cases[:3], *others]
    assert racing.names == ["Tyre1 flat", "Tyre3 flat"]
    assert [case.condition for case in racing.subject] == ["3.5 bar", "5.5 bar", "7.5 bar"]
    assert racing.focus.condition == "5.5 bar"
    assert [(p.setup, p.case.condition) for p in racing.samples] == [
        (setup, condition) for setup in racing.settings.setups for condition in ("3.5 bar", "7.5 bar")
    ]  # fmt: skip
    assert [one.result.case.condition for one in racing.checks] == ["3.5 bar", "7.5 bar"]
    for one in racing.checks:
        found = {q.name: q.linear_sd for q in one.quantities}
        for name, part in (("frequency", one.result.frequency), ("damping ratio", one.result.damping)):
            np.testing.assert_allclose(found[f"wobble {name} at 15 m/s"], part["wobble"].sd, rtol=1e-6)


def quick(**others) -> main_study.Settings:
    few = {"fronts": 2, "samples": 20, "speeds": np.linspace(0, 30, 4), "max_speed": 35.0}
    return small(**(few | others))


@pytest.fixture
def failing(monkeypatch, results_alone):
    """Let the solution of some (case, setup) fail."""
    from studies.main_study import solve

    def at(wrong):
        def maybe(settings, case, setup):
            if wrong(case, setup):
                raise InputError("no such model")
            return solve(settings, case, setup)

        monkeypatch.setattr("studies.main_study.study.solve", maybe)

    return at


def test_a_case_that_cannot_be_computed_in_a_world_is_left_out_and_told(failing, tmp_path, no_pictures):
    settings = quick()
    cases = chosen(settings, {"Tyre1 flat": (3.5, 7.5)}, ["x: y"])
    failing(lambda case, setup: setup == settings.setups[4] and case.condition == "3.5 bar")
    found = main_study.run_study(settings, cases=cases)
    assert found.left_out == ("x: y", "Tyre1 flat, 3.5 bar, relaxed hands on, rigid front frame: no such model")
    assert len(found.results) == 9
    assert found.result(settings.setups[4], found.cases[0]) is None
    assert [d.setup for d in found.decompositions] == list(settings.setups[:4])
    main_study.write_report(found, tmp_path)
    text = read_report(tmp_path)
    assert "- Tyre1 flat, 3.5 bar, relaxed hands on, rigid front frame: no such model" in text
    assert "Not all cases could be computed; the report says why." in text
    main_study.write_tables(found, tmp_path)
    main_study.draw_critical_speeds(found, tmp_path / "f")


def test_a_study_without_any_result_is_refused(failing):
    settings = quick()
    failing(lambda case, setup: True)
    with pytest.raises(InputError, match="no case can be computed: Tyre1 flat, 5.5 bar, hands off, .*: no such model"):
        main_study.run_study(settings, cases=chosen(settings, {"Tyre1 flat": (5.5,)}))


def one_tyre(settings):
    """Cases of one tyre, its lowest and highest pressure."""
    return chosen(settings, {"Tyre3 flat": (3.5, 7.5)}, ["Tyre9 flat at 3 bar: gone"])


def test_run_prints_the_question_then_the_answer_and_writes_all(racing, monkeypatch, tmp_path, no_pictures, printed):
    study = replace(racing, left_out=("Tyre9 flat at 3 bar: gone",))
    monkeypatch.setattr("studies.main_study.report.run_study", lambda *_, **__: study)
    folder = tmp_path / "new" / "out"
    lines = printed("run", "--out", str(folder), "--workers", "1").splitlines()
    assert lines[0] == (
        "Does lower pressure in Tyre1 (flat track) make a Pista track bicycle with a rider in the drops more prone to"
    )
    assert lines[3].startswith(main_study.answer(racing).graded.grade.words.capitalize())
    assert lines[7].split() == ["hands,", "front", "3.5", "bar", "7.5", "bar", "lower", "pressure:", "onset,", "growth"]
    assert lines[-2] == f"figure: {(folder / 'headline.png').as_posix()}"
    assert lines[-1] == f"report: {(folder / 'report.html').as_posix()}"
    assert max(map(len, lines[:-1])) <= 110
    text = read_report(folder)
    assert "- Tyre9 flat at 3 bar: gone" in text
    names = {file.name for file in folder.iterdir()}
    figures = {"headline", "amplitude", "causes", "damping_ratio", "critical_speeds"}
    assert {f"{name}.png" for name in figures} == {name for name in names if name.endswith(".png")}
    assert {f"{name}.svg" for name in figures} < names
    assert {"report.html", "eigenvalues.csv", "wobble.csv", "one_at_a_time.csv", "run.manifest.json"} < names
    assert set(re.findall(r"\]\(([^)#]+\.png)\)", text)) == {f"{name}.png" for name in figures}


def test_two_workers_write_the_tables_of_one(tmp_path, monkeypatch, results_alone):
    """In rigid worlds of the same parts, as each process derives the equations of each set of parts."""
    worlds = main_study.Setup(None), main_study.Setup(None, camber_share=0.5)
    monkeypatch.setattr(main_study.Settings, "setups", worlds)
    settings = quick()
    for workers in (1, 2):
        (tmp_path / str(workers)).mkdir()
        with main_study.spread(workers) as distribute:
            study = main_study.run_study(settings, distribute=distribute, cases=one_tyre(settings))
        written = main_study.write_tables(study, tmp_path / str(workers))
        assert study.amplitudes
        main_study.draw_amplitude(study, tmp_path / str(workers) / "amplitude")  # of cases that are copies by a worker
    assert len(written) == 11
    for file in written.values():
        assert file.read_bytes() == (tmp_path / "1" / file.name).read_bytes(), file.name


@pytest.mark.parametrize(("asked", "words"), [
    (["--bicycle", "benchmrk"], "unknown bicycle 'benchmrk'; did you mean 'benchmark'?"),
    (["--tyre", "none.csv"], "none.csv"),
    (["--pressures", "0"], "--pressures '0': 0 is out of range"),
    (["--surface", "drum"], "--surface drum applies to a measured tyre; give --tyre too, for example --tyre Tyre1"),
    (["--json", "a.csv"], "a.csv: what is written is JSON; give a name that ends in .json"),
    (["--out", ""], "is no folder name; give a folder to write into, for example out"),
    (["--out", "a\0b"], "NUL"),
    (["--out", "/"], "/ is a whole disk; give a folder for the results"),
    (["--out", "taken"], "taken' is a file; give a folder to write into"),
])  # fmt: skip
def test_what_the_command_refuses(asked, words, tmp_path, monkeypatch, refused):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "taken").write_text("mine")
    error = refused("run", *asked)
    assert words in error
    assert error.count("\n") == 1
    assert [file.name for file in tmp_path.iterdir()] == ["taken"]


def test_a_tyre_called_like_a_script_stays_text(heavy, tmp_path):
    hostile = "<script>alert(1)</script>"

    def renamed(found):
        return tuple(replace(one, case=replace(one.case, name=hostile)) for one in found)

    cases = tuple(replace(case, name=hostile) for case in heavy.cases)
    study = replace(heavy, cases=cases, focus=replace(heavy.focus, name=hostile), results=renamed(heavy.results),
                    samples=renamed(heavy.samples), left_out=(f"{hostile}: gone",))  # fmt: skip
    text = main_study.write_report(study, tmp_path)[1].read_text(encoding="utf-8")
    assert "<script>alert" not in text
    assert text.count("<script") == 1  # that of the page
    assert text.count("&lt;script&gt;alert(1)") > 5
