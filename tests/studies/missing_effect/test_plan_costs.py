"""The file of costs: what is read, and what is refused; what is said where nothing can be planned."""

import math
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from studies.cli import main
from studies.missing_effect.plan import plan as planning
from studies.missing_effect.plan.costs import Bench, Costs, Stop, read_costs
from studies.missing_effect.plan.figure import draw
from studies.missing_effect.plan.offer import Answer
from studies.missing_effect.plan.plan import Plan, Settled, Step
from studies.missing_effect.plan.questions import PairQuestion
from studies.missing_effect.plan.report import EXPLAINED
from studies.missing_effect.plan.words import QUESTIONS, headline, question_rows
from tyre.base.errors import InputError

TABLE = "speed_m_s,mode,real_1_s,imag_rad_s,steer_over_lean_re,steer_over_lean_im\n" + "".join(
    f"{v},weave,-0.8,{4 + v},0.8,0.1\n" for v in (5, 6, 7)
)
RUNS = "[[runs]]\nspeeds_m_s = [6, 5]\nsetup = 10\neach = 2\n"


def write(folder, content):
    (folder / "costs.toml").write_text(content)
    return folder / "costs.toml"


def test_everything_that_a_file_may_hold(tmp_path):
    found = read_costs(write(tmp_path, RUNS + """
[[runs]]
speeds_m_s = [12]
each = 3.5
most = 2
[channels.steer_rad]
price = 300
[bench.steer_damper]
price = 5
[bench.steer_spring.stiffness]
price = 6
sd = 0.1
[sd]
steer_rad = 0.001
[limits]
steer_damper = 0.2
steer_spring.stiffness = 0.4
[goal]
odds = 100
"""))  # fmt: skip
    assert found == Costs(
        stops=(Stop(5, 10, 2, 6), Stop(6, 10, 2, 6), Stop(12, 0, 3.5, 2)), channels={"steer_rad": 300},
        bench={"steer_damper": Bench(5), "steer_spring.stiffness": Bench(6, 0.1)}, sd={"steer_rad": 0.001},
        limits={"steer_damper": 0.2, "steer_spring.stiffness": 0.4}, odds=100, probability=0.9,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "nothing can be measured; write \\[\\[runs\\]\\] with speeds_m_s"),
        (RUNS + "[limits.nonsense]", "\\[limits\\]: nonsense is an empty table; write the sizes above which"),
        (RUNS + f"[limits]\nsteer_damper = {10**400}", "must be the size above which an effect would matter, above 0"),
        ("[[runs]]\neach = 2", "\\[\\[runs\\]\\] number 1: no speeds_m_s; write"),
        ("[[runs]]\nspeeds_m_s = [5]", "no price of each run"),
        ("[[runs]]\nspeeds_m_s = [500]\neach = 1", "must be a list of speeds in m/s, above 0 and up to 60"),
        ("[[runs]]\nspeeds_m_s = []\neach = 1", "must be a list of speeds"),
        ("[[runs]]\nspeeds_m_s = [5]\neach = 0", "each = 0 must be a price above 0"),
        ("[[runs]]\nspeeds_m_s = [5]\neach = 1\nmost = 21", "most = 21 must be a whole number from 1 to 20"),
        ("[[runs]]\nspeeds_m_s = [5]\neach = 1\nprice = 3", "unknown key 'price'"),
        ("[[runs]]\nspeeds_m_s = [5, 5.0]\neach = 1", "5 m/s is given twice"),
        (f"[[runs]]\nspeeds_m_s = {list(range(1, 22))}\neach = 1", "21 speeds are more than 20"),
        (RUNS + "[channels.steer]\nprice = 3", "unknown channel 'steer'; did you mean 'steer_rad'"),
        (RUNS + "[channels.steer_rad]", "no price; write price = 100"),
        (RUNS + "[channels.steer_rad]\nprice = -1", "price = -1 must be a price >= 0"),
        (RUNS + "".join(f"[channels.{c}]\nprice = 1\n" for c in (
            "lean_rad", "steer_rad", "steer_rate_rad_s", "yaw_rate_rad_s", "roll_rate_rad_s"
        )), "5 are more than 4"),
        ("[bench.steer_damper]\nprice = 1\n[channels.steer_rad]\nprice = 3", "are bought for runs, and there are none"),
        ("[bench.steer_damper]\nprice = 1\nsd = 0", "sd = 0 must be a standard deviation above 0"),
        (RUNS + "[sd]\nlean = 1", "unknown column 'lean'"),
        (RUNS + "[sd]\nreal_1_s = 0", "real_1_s = 0 must be a standard deviation above 0"),
        (RUNS + "[limits]\nsteer_damper = 0", "steer_damper = 0 must be the size above which an effect would matter"),
        (RUNS + "[goal]\nodds = 5", "odds = 5 must be odds from 20, below which a diagnosis names nothing, to 10000"),
        (RUNS + "[goal]\nprobability = 1", "probability = 1 must be a probability from 0.5 to 0.99"),
        ("budget = 0\n" + RUNS, "budget = 0 must be a price above 0"),
        ("most_runs = 0\n" + RUNS, "most_runs = 0 must be a whole number from 1"),
        ("currency = 3\n" + RUNS, "currency = 3 must be words in quotes"),
        ("price = 3\n" + RUNS, "unknown key 'price'"),
    ],
)  # fmt: skip
def test_refused_files(content, words, tmp_path):
    with pytest.raises(InputError, match=f"costs.toml[:,].*{words}"):
        read_costs(write(tmp_path, content))


@pytest.mark.parametrize(
    ("measurement", "content", "words"),
    [
        ("kooijman2008", RUNS + "[channels.steer_rad]\nprice = 3", "steer_rad does not belong to modes"),
        (
            "kooijman2008",
            RUNS + "[channels.lean]\nprice = 3",
            r"unknown channel 'lean'; known: steer_over_lean, yaw_over_lean\n",
        ),
        ("kooijman2008", RUNS + "[bench.steer_dampr]\nprice = 1", "did you mean 'steer_damper'"),
        ("kooijman2008", RUNS + "[bench.steer_damper.damp]\nprice = 1", "did you mean 'steer_damper.damping'"),
        ("kooijman2008", RUNS + "[bench.IBxx]\nprice = 1", "\\[bench.IBxx\\]: no sd; give the standard deviation"),
        ("mine.toml", RUNS + "[channels.steer_over_lean]\nprice = 3", "recorded already and costs nothing"),
        ("davis", RUNS, "davis: a plan is offered for modes .kind = 'modal'. and time histories"),
    ],
)
def test_what_does_not_go_with_the_measurement_is_refused_before_anything_is_fitted(
    measurement, content, words, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    file = write(tmp_path, content)
    Path("mine.toml").write_text('kind = "modal"\nbicycle = "benchmark"\n[modal]\ntable = "t.csv"\n')
    Path("t.csv").write_text(TABLE)
    with pytest.raises(SystemExit):
        main(["plan", measurement, "--costs", str(file)])
    assert re.search(words, capsys.readouterr().err)


def test_the_example_is_read(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    main(["new", "costs.toml", "--kind", "costs"])
    assert "velotyre plan kooijman2008 --costs costs.toml" in capsys.readouterr().out
    assert [stop.speed for stop in read_costs(tmp_path / "costs.toml").stops] == [4, 5, 6, 7, 8, 10]


@pytest.mark.parametrize(
    ("verdict", "words"),
    [
        ("named", "Nothing is open: no further measurement is needed."),
        ("none", "Nothing is open: no further measurement is needed."),
        ("unknown", "Nothing can be planned: the verdict is unknown, so something in the data has no explanation yet"),
        ("partial", "Nothing can be planned: the verdict is partial, so something in the data has no explanation yet"),
    ],
)
def test_a_gap_without_an_explanation_is_not_called_settled(verdict, words):
    assert headline(Plan((), (), 0.0, (), (), True, Costs(), verdict=verdict)).startswith(words)


@pytest.mark.parametrize("asked", [True, False])
def test_offers_are_not_found_fault_with_where_nothing_is_open(asked, monkeypatch):
    """A named effect, and a bench test of it and of another on offer."""
    fit = SimpleNamespace(name="a", candidates=(1,))
    offer = SimpleNamespace(
        items=(),
        channels=(),
        everything=(),
        questions=(PairQuestion(0, 1, "a or b"),),
        looked_at=lambda places: [],
        answers=lambda counts: (Answer(0.1, met=not asked),),
        open=SimpleNamespace(judged=SimpleNamespace(log_posterior=(1.0, 0.0), fits=(fit, fit))),
    )
    monkeypatch.setattr(planning, "check", lambda *_: None)
    monkeypatch.setattr(planning, "opened", lambda *_: None)
    monkeypatch.setattr(planning, "standing", lambda _: None)
    monkeypatch.setattr(
        planning, "offers_of", lambda *_: ([offer], ["bench test of b: nothing that is open depends on it"])
    )
    diagnosis = SimpleNamespace(
        forward=None, measurement=SimpleNamespace(name="m"), verdict=SimpleNamespace(verdict="named")
    )
    assert len(planning.plan(diagnosis, Costs()).notes) == asked


def open_question(**most):
    now = Answer(0.0, met=False, log_odds=-math.log(6.1))
    then = Answer(0.74, met=False, log_odds=math.log(2.9))
    return Settled(
        "steer_damper or nothing missing", now, then, Answer(0.74, **most), limit=False, leads="steer_damper"
    )


def test_odds_say_whose_they_are():
    """Those of the leader now and those of the truth, were it the other answer, are not the same."""
    question = open_question(met=False, log_odds=math.log(2.9))
    plan = Plan((Step("runs at 6.25 m/s", 2, 187.1, 6.25),), (), 187.1, (question,), (), True, Costs())
    ((_, now, then, most),) = question_rows(plan)
    assert now == "odds 6.1 : 1 for steer_damper"
    assert then == most == "74 %, expected odds 2.9 : 1 for what is true"
    assert QUESTIONS[2] == "after the plan, by the less favourable answer"
    assert "they may be smaller than the odds now" in EXPLAINED.replace("\n", " ")


def test_every_probability_from_nothing_to_all_has_room_in_the_figure(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda self, to, **_: (drawn.append(self), to.touch()))
    plan = Plan((), (), 200.0, (), ((0.0, 0.0), (100.0, 0.4), (200.0, 1.0)), True, Costs())
    assert draw(plan, tmp_path / "curve")
    (axis,) = drawn[0].axes
    low, high = axis.get_ylim()
    for line in axis.lines:
        assert all(low <= share <= high for share in line.get_ydata())
    assert max(axis.lines[0].get_ydata()) == 100.0


@pytest.mark.parametrize(
    ("met", "said"),
    [
        ((False,), "is not sure to settle the question that is open, but goes as far as is worth its price."),
        ((False, False), "is not sure to settle any of the 2 questions that are open, but goes as far as is worth"),
        ((True, False), "settles 1 of 2 questions and takes the other as far as is worth its price."),
        ((True, False, False), "settles 1 of 3 questions and takes the others as far as is worth its price."),
    ],
)
def test_a_headline_counts_what_is_open(met, said):
    questions = tuple(replace(open_question(met=one), then=Answer(0.9, met=one)) for one in met)
    plan = Plan((Step("runs at 6.25 m/s", 2, 187.1, 6.25),), (), 187.1, questions, (), True, Costs())
    assert said in headline(plan)


LEFT = Answer(0.48, met=False)
LIMIT = Answer(0.9, met=False, limit=0.3)


@pytest.mark.parametrize(
    ("at_most", "words"),
    [
        ([None, LEFT], "settles 1 of 2 questions; it is not aimed at the other, which all that is offered together "
                       "would settle with a probability of less than 50 %."),
        ([None, LEFT, LEFT], "settles 1 of 3 questions; it is not aimed at the others, which all that"),
        ([None, Answer(0.6, met=False), LEFT], "settles 1 of 3 questions and takes 1 of the others as far as is worth "
                                               "its price; it is not aimed at 1 more, which all that"),
        ([Answer(0.6, met=False), LEFT], "is not sure to settle one question that is open, but goes as far as is worth "
                                         "its price; it is not aimed at 1 more, which all that is offered"),
        ([None, LIMIT], "settles 1 of 2 questions; it is not aimed at the other, which all that is offered together "
                        "would not settle."),
    ],
)  # fmt: skip
def test_a_headline_says_what_a_plan_is_not_aimed_at(at_most, words):
    """By the rule of the page: what everything together would settle with less than 0.5, and limits beyond reach."""
    now = Answer(0.0, met=False, log_odds=-math.log(13))
    questions = tuple(
        Settled(
            "a or b", now, now if most else Answer(1.0, met=True), most or Answer(1.0, met=True), limit=most is LIMIT
        )
        for most in at_most
    )
    plan = Plan((Step("bench test of steer_damper", 1, 60.0),), (), 60.0, questions, (), True, Costs())
    assert words in headline(plan)
    assert ("as far as is worth" in headline(plan)) == ("as far as is worth" in words)
