"""The study as a whole: what is computed, what is left out, and how the work is counted and spread."""

import operator
from dataclasses import replace

import pytest
from small_study import chosen, small

from studies.main_study import study as module
from studies.main_study.parallel import spread
from studies.main_study.settings import Settings
from studies.main_study.study import count_steps, pressure_ends, run_study, typical
from tyre.base.errors import InputError


def test_every_case_is_solved_in_every_world(racing):
    assert len(racing.results) == 4 * len(racing.cases) == 20
    for setup in racing.settings.setups:
        assert [r.case for r in racing.of(setup)] == list(racing.cases)
        assert [r.case.name for r in racing.of(setup, "Tyre3 flat")] == ["Tyre3 flat"] * 2
    assert racing.names == ["Tyre1 flat", "Tyre3 flat"]
    assert racing.conditions == ["3.5 bar", "5.5 bar", "7.5 bar"]
    assert [case.condition for case in racing.subject] == ["3.5 bar", "5.5 bar", "7.5 bar"]


def test_random_bicycles_are_of_every_tyre_hands_off_and_of_the_asked_one_hands_on(racing):
    first, second = racing.settings.setups[:2]
    assert [(p.setup, p.case.name) for p in racing.plausible] == (
        [(first, case.name) for case in racing.cases] + [(second, "Tyre1 flat")] * 3
    )
    assert racing.outer(racing.of(racing.settings.setups[2])[0]) is None
    (own,) = (p for p in racing.plausible if p.setup == second and p.case.condition == "7.5 bar")
    assert racing.outer(racing.of(second, "Tyre1 flat")[2]) is own


def test_the_ends_of_the_pressures(racing):
    assert [(high.condition, low.condition) for high, low in pressure_ends(racing.cases)] == [
        ("7.5 bar", "3.5 bar")
    ] * 2
    alone = [case for case in racing.cases if case.condition == "3.5 bar"]
    assert pressure_ends(alone) == []
    assert typical(racing.subject).condition == racing.focus.condition == "5.5 bar"
    unknown = replace(alone[0], pressures_bar=())
    assert typical([unknown]) is unknown


def failing_at(monkeypatch, wrong):
    """Let the solution of some (case, setup) fail."""
    solve = module.solve

    def maybe(settings, case, setup):
        if wrong(case, setup):
            raise InputError("no such model")
        return solve(settings, case, setup)

    monkeypatch.setattr(module, "solve", maybe)


def quick() -> Settings:
    return small(fronts=2, samples=20, speeds=small().speeds[::4])


def test_a_case_that_cannot_be_computed_in_a_world_is_left_out_and_told(monkeypatch, tmp_path):
    from studies.main_study.answer import answer
    from studies.main_study.figure_critical_speeds import draw_critical_speeds
    from studies.main_study.report import write_report
    from studies.main_study.tables import write_tables

    settings = quick()
    cases = chosen(settings, {"Tyre1 flat": (3.5, 7.5)}, ["x: y"])
    failing_at(monkeypatch, lambda case, setup: setup == settings.setups[3] and case.condition == "3.5 bar")
    found = run_study(settings, cases=cases)
    assert found.left_out == ("x: y", "Tyre1 flat, 3.5 bar, hands on, rigid front: no such model")
    assert len(found.results) == 7
    assert found.result(settings.setups[3], found.cases[0]) is None
    assert found.decompositions == ()  # the pressure is not there in every world
    assert len(found.of(settings.setups[3])) == 1
    text = write_report(found, answer(found), tmp_path, paper_figures=[])[0].read_text(encoding="utf-8")
    assert "- Tyre1 flat, 3.5 bar, hands on, rigid front: no such model" in text
    write_tables(found, tmp_path)
    monkeypatch.setattr("studies.reporting.plotting.FORMATS", ("png",))
    draw_critical_speeds(found, tmp_path / "f")


def test_a_tyre_that_cannot_be_computed_at_all_leaves_the_others(monkeypatch):
    settings = quick()
    cases = chosen(settings, {"Tyre1 flat": (3.5,), "Tyre3 flat": (3.5,)})
    failing_at(monkeypatch, lambda case, setup: case.name == "Tyre1 flat")
    found = run_study(settings, cases=cases)
    assert found.names == ["Tyre3 flat"]
    assert found.focus.name == "Tyre3 flat"
    assert len(found.left_out) == 4


def test_a_study_without_any_result_is_refused(monkeypatch):
    settings = quick()
    failing_at(monkeypatch, lambda case, setup: True)
    with pytest.raises(InputError, match="no case can be computed: Tyre1 flat, 5.5 bar, hands off, .*: no such model"):
        run_study(settings, cases=chosen(settings, {"Tyre1 flat": (5.5,)}))


@pytest.mark.parametrize("wanted", [{"Tyre1 flat": (5.5,)}, {"Tyre1 flat": (3.5, 7.5), "Tyre3 flat": (3.5,)}])
def test_steps_are_counted_before_they_are_made(wanted, racing, monkeypatch):
    """Without the work itself: what is reported is what was promised."""
    settings = racing.settings
    cases = chosen(settings, wanted)
    monkeypatch.setattr(module, "solve", lambda _, case, setup: racing.result(setup, case))
    for work in ("hinges", "contact_lengths"):
        monkeypatch.setattr(module, work, lambda *arguments: ())
    told: list[str] = []

    def each(work, items, said):
        todo = list(items)
        for item in todo:
            told.append(said(*item))
        return [work(*item) for item in todo] if work is module._solved else [None] * len(todo)

    run_study(settings, told.append, each=each, cases=cases)
    assert len(told) == count_steps(settings, cases.found)


@pytest.mark.parametrize("workers", [1, 2])
def test_work_comes_back_in_the_order_of_its_items_and_is_told(workers):
    told: list[str] = []
    with spread(workers, told.append) as each:
        assert each(operator.add, [(k, 10) for k in range(5)], lambda a, b: f"{a} and {b}") == [10, 11, 12, 13, 14]
    assert told == [f"{k} and 10" for k in range(5)]
