"""The first page of a report: every sentence against the figures beside it, on readings of a mass that is let go."""

import dataclasses
import html
import json
import re
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from studies.diagnosis import (
    GAP,
    Diagnosis,
    draw_all,
    fate,
    figures,
    find,
    leading_two,
    listed,
    misfit,
    number,
    page,
    percent,
    probability,
    record,
    residuals,
    said,
    terminal,
    titles,
    values_of,
    with_stability,
    write_report,
)
from studies.inference import (
    LEFT_OVER,
    AcceptanceCheck,
    Candidate,
    Fit,
    Judged,
    Kind,
    Mimic,
    Named,
    Reason,
    Rows,
    Separation,
    UncertainParameter,
    judge,
)
from studies.reporting import drawing, made_by
from tyre.errors import InputError

PLACES = np.repeat(np.arange(1.0, 7.0), 4)
POWERS = {"linear": 1, "alike": 1, "shift": 0, "bias": 2}


@dataclass(frozen=True, eq=False)
class Line(Kind):
    """Synthetic readings of level + rate t, sd 1, at six times; it is told apart by nothing but its growth."""

    readings: np.ndarray
    candidates: tuple
    nuisances: tuple = (
        UncertainParameter("level", "m", {"level": 1.0}, 2.0, 0.5),
        UncertainParameter("swing", "m", {"swing": 1.0}, 0.0, 0.5),
    )
    name: str = "readings"
    description: str = "Synthetic: a line."
    source: str = "made up"

    def figures(self):
        return {"gap": GAP}

    @property
    def rows(self):
        fold = (PLACES - 1).astype(int)
        where = tuple(f"{t:g} s" for t in PLACES)
        return Rows(where, PLACES, tuple("ab"[k % 2] for k in range(24)), fold, axis="time, s")

    def residual(self, candidates, theta, *, slopes=True):
        base = [np.ones(24), np.where(PLACES > 3, 0.3, -0.3)]
        columns = base + [(PLACES / 6) ** POWERS[c.identifier] for c in candidates for _ in c.unknowns]
        jacobian = np.stack(columns, 1)
        residual = self.readings - jacobian @ theta
        if any(not c.unknowns for c in candidates):
            residual, jacobian = residual - residual.mean(), jacobian - jacobian.mean(0)
        return residual, -jacobian if slopes else np.empty((24, 0))


def growth(name):
    return Candidate(name, (UncertainParameter("rate", "m/s", {name: 1.0}, 0.0, 3.0, 0.0, size=True),))


def diagnosed(rate, *names, seed=1, level=1.4):
    data = level + rate * PLACES / 6 + np.random.default_rng(seed).standard_normal(24)
    found = judge(Line(data, tuple(growth(name) for name in names)))
    return Diagnosis(model=None, **vars(found))


def changed(found, **fields):
    return dataclasses.replace(found, verdict=dataclasses.replace(found.verdict, **fields))


@pytest.fixture(scope="module")
def one():
    found = diagnosed(9.0, "linear", "shift")
    assert (found.verdict.verdict, found.verdict.equivalent) == ("named", ("linear",))
    return found


@pytest.fixture(scope="module")
def nothing():
    found = diagnosed(0.0, "linear", "shift")
    assert found.verdict.verdict == "none"
    return found


@pytest.fixture(scope="module")
def several():
    found = diagnosed(9.0, "linear", "alike")
    assert set(found.verdict.equivalent) == {"linear", "alike"}
    return found


@pytest.fixture(scope="module")
def folder(one, tmp_path_factory):
    """The report of a named effect, with its variants."""
    root = tmp_path_factory.mktemp("report")
    write_report(one, root, with_stability(find(one), one))
    return root


def written(found, findings=None):
    return page(found, findings or find(found), {})


def first_page(text):
    return text.split("# Details")[0]


def test_a_measurement_is_advised_where_its_gain_is_not_printed_as_zero(one):
    found = find(changed(one, separating_measurements=(Separation("much", 0.051), Separation("little", 0.049))))
    assert [s.what for s in found.further] == ["much"]
    text = written(one, found)
    assert "| much | 0.1 |" in text
    assert "little |" not in text


def test_a_named_effect_stands_with_its_sd_before_anything_else(one):
    text = written(one)
    (effect,) = one.verdict.effects
    value, sd = effect.parameters["rate"]
    assert f"| linear | rate | {number(value, 4)} m/s | ± {number(sd, 2)} m/s |" in first_page(text)
    assert text.index("| linear | rate |") < text.index("## The gap")
    assert value == pytest.approx(9.0, abs=4 * sd)


def test_the_table_of_the_gap_is_that_of_the_three_fits(one):
    text = first_page(written(one))
    nominal, adjusted, final = (float(r @ r) for r in residuals(one).values())
    assert "| model | χ² of 24 values | share explained |" in text
    assert f"| base model | {nominal:.1f} | - |" in text
    assert f"| parameters only | {adjusted:.1f} | {100 * (1 - adjusted / nominal):.0f} % |" in text
    assert f"| with linear | {final:.1f} | {percent(1 - final / nominal)} |" in text
    null = one.hypotheses.null
    went = [(x - u.centre) / u.scale for x, u in zip(null.theta, null.unknowns, strict=True)]
    assert f"moved: {max(map(abs, went)):.2g} of its stated or assumed standard deviations" in text


def test_p_follows_from_chi2_and_penalty_as_they_are_printed(one, nothing):
    for found in (one, nothing):
        text = next(line for line in terminal(found, find(found)).splitlines() if " penalty of the prior" in line)
        misfit, penalty, total, n = (
            float(x) for x in re.findall(r"[-\d.]+(?= \+| penalty| for \d|(?= numbers))", text)
        )
        assert misfit + penalty == pytest.approx(total, abs=0.11)
        free = len(found.final.candidates)
        sign, shown = re.search(r"p ([=<>]) ([\d.e-]+)", text).groups()
        p = chi2.sf(found.final.objective, n - free)
        assert {"=": float(shown) == pytest.approx(p, rel=0.01), "<": p < float(shown), ">": p > float(shown)}[sign]


def test_where_nothing_is_named_nothing_is_said_to_be(nothing):
    text = written(nothing)
    assert "with linear" not in text.replace("between", "")
    assert list(titles(nothing).values()) == ["base model", "parameters only"]
    assert "| χ² by | n | base model | parameters only |" in text
    assert "moved, parameters only |" in text
    assert list(residuals(nothing)) == ["base model", "parameters only"]


def test_figures_and_tables_call_a_hypothesis_alike(one, folder):
    assert said("none") == "parameters only"
    assert said("a+b") == "a + b"
    text = (folder / "report.md").read_text(encoding="utf-8")
    assert text.endswith(made_by())
    svg = (folder / "posterior.svg").read_text(encoding="utf-8")
    for name, share in one.hypotheses.posterior.items():
        assert f"| {said(name)} | {probability(share)} |" in text
        assert f"<!-- {said(name)} -->" in svg
    gap = (folder / "gap.svg").read_text(encoding="utf-8")
    for title in titles(one).values():
        assert f"<!-- {title} -->" in gap
        assert title in text
    assert "<!-- 0.000001 -->" in svg


def test_parameters_that_went_far_are_on_the_first_page_and_the_rest_are_not(one):
    text = written(one)
    for k, u in enumerate(one.kind.nuisances):
        shift, alone = ((f.theta[k] - u.centre) / u.scale for f in (one.final, one.hypotheses.null))
        line = f"| {u.name} | {number(u.centre, 4)} ± {number(u.scale, 2)} m |"
        assert (line in first_page(text)) == (max(abs(shift), abs(alone)) > 0.5), u.name
        assert line in text
        assert f"| {alone:+.1f} | {shift:+.1f} |" in text


def test_limits_beside_the_named_effect(one):
    page = first_page(written(one))
    (limit,) = find(one).limits
    assert limit.identifier == "shift"
    assert f"| shift | rate | ≤ {number(limit.values['rate'], 3)} m/s |" in page or "Not limited by these data" in page
    assert "an effect beside linear is not larger than this" in page


def test_what_to_measure_next_is_said_for_every_verdict(one, nothing, several):
    findings, text = find(one), first_page(written(one))
    assert max(share for f, share in one.hypotheses.probabilities if f.admissible and f is not one.final) < 1e-20
    assert (findings.between, findings.further) == (("linear",), ())
    assert "## What to measure next\n\nNothing is open. No rival of linear" in text
    for found in (diagnosed(6.0, "linear", "shift", "bias"), nothing, several):
        findings = find(found)
        text = first_page(written(found))
        assert "## What to measure next" in text
        assert len(findings.between) >= 2
        if findings.further:
            assert f"| {findings.further[0].what} | {findings.further[0].gain:.1f} |" in text
            assert f"predicted distance of {said(findings.between[0])} from" in text
    assert leading_two(one)[0] is one.final
    assert leading_two(nothing)[0] is nothing.hypotheses.null


@pytest.mark.parametrize(("gain", "advised"), [(1.01, True), (0.99, False)])
def test_of_a_name_that_stands_only_what_brings_a_whole_sd_is_advised(one, gain, advised, monkeypatch):
    """The rate is there at odds of many to one; a rival at 50 : 1 is put beside it."""
    rival = Fit(one.final.candidates, one.final.unknowns, one.final.theta, one.final.covariance, one.final.residual,
                one.final.jacobian, one.final.objective, one.final.log_evidence - np.log(50.0))  # fmt: skip
    monkeypatch.setattr("studies.diagnosis.findings.leading_two", lambda _: (one.final, rival))
    monkeypatch.setattr("studies.diagnosis.findings.separating", lambda *_: [Separation("a further reading", gain)])
    found = find(one)
    assert [s.what for s in found.further] == ["a further reading"] * advised
    assert found.standing.odds == pytest.approx(50.0)
    text = first_page(written(one, found))
    assert ("| a further reading | 1.0 |" in text) == advised
    assert "odds are 50 : 1 for linear against its nearest rival, linear." in text
    assert ("make that surer, or overturn it." in text) == advised
    assert ("would separate linear from linear by 1 sd." in text) != advised


def test_each_member_of_a_class_says_why(several):
    leader, other = several.verdict.equivalent
    assert f"- {other}: {several.verdict.reasons[other]}" in first_page(written(several))
    assert f"not separated: {other} (" in terminal(several, find(several))
    ahead = changed(several, reasons=several.verdict.reasons | {other: Reason("ahead", odds=50.0, why="")})
    assert "The data do not rule out these:" in written(ahead)
    assert f"{other} is more probable and not ruled out." in written(ahead)
    fates = fate(several)
    assert (fates[leader], fates[other]) == ("leads the class", "in the class")


def test_a_refused_leader_is_marked_with_its_rule_wherever_it_stands(one, tmp_path):
    rule = Reason("fails", rules="a size that occurs")
    found = changed(one, refused_leaders=(("shift", 0.4, rule),), verdict="tentative")
    findings = find(found)
    text = written(found, findings)
    draw_all(found, tmp_path)
    assert "**tentative.** Missing (tentatively): linear (rate " in text
    assert f"- shift (P = 0.4): {rule}" in first_page(text)
    assert fate(found)["shift"] == f"refused: {rule}"
    assert "refused: does not hold" in (tmp_path / "posterior.svg").read_text(encoding="utf-8")
    assert fate(found)["linear"] == "named, tentatively"
    assert record(found, findings)["refused_leaders"] == [
        {"hypothesis": "shift", "probability": 0.4, "rule": str(rule)}
    ]


def test_a_partial_name_comes_last_and_says_how_far_its_sd_is_widened(one):
    (effect,) = one.verdict.effects
    value, sd = effect.parameters["rate"]
    wide = dataclasses.replace(effect, parameters={"rate": (value, 3 * sd)})
    page = first_page(written(changed(one, verdict="partial", effects=(wide,))))
    assert page.index("## Named in part") > page.index("## What to measure next")
    assert f"± {number(3 * sd, 2)} m/s" in page
    assert "up to 3 times that of the fit alone" in page
    assert "given that nothing else is missing" in written(one)


def test_an_effect_without_numbers_is_not_printed_empty():
    data = 7.0 + np.random.default_rng(2).standard_normal(24)
    found = judge(Line(data, (Candidate("bias", ()),)))
    diagnosis = Diagnosis(model=None, **vars(found))
    assert values_of(found.hypotheses.fits[0]) == "bias: a constant in each run, integrated out"
    assert diagnosis.verdict.equivalent == ("bias",)
    assert "| bias | - | a constant in each run, integrated out |" in first_page(written(diagnosis))


def test_only_what_improves_is_shown_to_mimic_the_rest(one):
    final = one.verdict.chi2["final"]
    better, worse = Mimic("torque from lean (N m/rad)", 2.0, final - 5), Mimic("torque from steer", 1.0, final + 5)
    text = written(changed(one, mimics=(better, worse)))
    assert f"| torque from lean (N m/rad) | 2 | {final - 5:.1f} |" in text
    assert "torque from steer" not in text
    assert f"each added to linear (χ² {final:.1f})" in text
    assert "mimic" not in written(changed(one, mimics=(worse,)))


def test_the_stability_table_is_that_of_the_variants(one):
    findings = with_stability(find(one), one)
    page = first_page(written(one, findings))
    outcomes = findings.stability.outcomes
    for o in outcomes:
        assert f"| {o.what} | {o.verdict} |" in page
    rows = re.findall(r"\| (yes|no) \|$", page, flags=re.MULTILINE)
    assert rows.count("yes") == sum(o.same for o in outcomes)
    assert all(o.same for o in outcomes)
    assert f"The verdict holds in all {len(outcomes)} variants." in page
    assert "Does the verdict stand?" not in written(one)


def test_json_has_what_the_page_says(one, folder):
    findings = with_stability(find(one), one)
    found = json.loads((folder / "verdict.json").read_text())
    assert found == json.loads(json.dumps(record(one, findings)))
    assert found["sentence"]
    assert {m["parameter"] for m in found["moved"]} == {"level", "swing"}
    assert found["upper_limits"][0]["effect"] == "shift"
    assert len(found["stability"]["variants"]) == len(findings.stability.outcomes)
    assert found["measure_next"]["between"][0] == "linear"
    assert found["doubts"] == []


def test_the_page_opens_its_details_from_a_table_of_contents(one, folder):
    page = (folder / "report.html").read_text(encoding="utf-8")
    anchors = re.findall(r'<a href="#(\w+)">', page)
    assert anchors
    assert anchors == re.findall(r'<details id="(\w+)">', page)
    assert page.count("<details") == page.count("</details>") == page.count("<summary>")
    assert "| --- |" not in page
    assert "{{" not in page


def test_no_model_is_written_where_there_is_no_bicycle(one, folder):
    assert "corrected model" not in (folder / "report.md").read_text(encoding="utf-8")
    assert not (folder / "model.toml").exists()


def test_captions_are_those_of_the_figures_that_are_there(one, folder):
    text = (folder / "report.md").read_text(encoding="utf-8")
    names = re.findall(r"\]\((\w+)\.png\)", text)
    assert names == ["gap", "posterior", "similarity", "held_out"]
    for name in names:
        assert (folder / f"{name}.png").stat().st_size > 5000


@pytest.mark.parametrize(
    ("nominal", "held_out", "labels"),
    [
        (1.2, 0.9, ["0.5", "1", "2"]),
        (0.2, 0.11, ["0.1", "0.2", "0.5", "1"]),
        (4000.0, 1.0, ["1", "10", "100", "1000", "10000"]),
    ],
)
def test_the_axis_of_held_out_data_has_few_labels_that_leave_each_other_room(
    nothing, nominal, held_out, labels, tmp_path, monkeypatch
):
    boxes, bars = [], []

    @contextmanager
    def seen(target, **size):
        with drawing(target, **size) as figure:
            yield figure
            figure.canvas.draw()
            (axis,) = figure.axes
            low, high = axis.get_xlim()
            every = [*axis.xaxis.get_majorticklabels(), *axis.xaxis.get_minorticklabels()]
            shown = [t for t in every if t.get_text() and low <= t.get_position()[0] <= high]
            boxes.extend((t.get_text(), t.get_window_extent()) for t in shown)
            bars.extend(p.get_width() / low for p in axis.patches)

    monkeypatch.setattr(figures, "drawing", seen)
    scores = {model: SimpleNamespace(possible=True, chi2=24 * held_out) for model in titles(nothing)}
    shown = changed_scores(nothing, np.full(24, nominal**0.5), scores)
    assert figures._held_out(shown, tmp_path / "held_out")
    assert [text for text, _ in boxes] == labels
    assert all(a.x1 < b.x0 for (_, a), (_, b) in pairwise(boxes))
    assert min(bars) > 1  # every bar begins within the axis


def changed_scores(judgement, nominal, scores):
    return SimpleNamespace(**{name: getattr(judgement, name) for name in ("final", "kind", "hypotheses")},
                           nominal=nominal, held_out=scores)  # fmt: skip


def test_numbers_keep_their_digits_and_lose_their_exponents():
    assert [number(x, 4) for x in (11563.0, 0.006094439, -1.0, 1e-9, 2.0e5)] == [
        "11560", "0.006094", "-1.000", "1e-09", "200000"
    ]  # fmt: skip
    assert [number(x, 2) for x in (2859.0, 0.0008494, 0.0, 44.6)] == ["2900", "0.00085", "0", "45"]
    assert [percent(x) for x in (0.613, 0.9971, 0.0013, 1.0, 0.0)] == ["61 %", "99.7 %", "0.1 %", "100 %", "0 %"]
    assert [misfit(x) for x in (65.81, 1319202.34)] == ["65.8", "1319202"]


def test_words():
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b and c"
    assert [probability(p) for p in (1.0, 0.9996, 0.5, 8.3e-21, 0.0)] == ["1", "0.9996", "0.5", "8.3e-21", "< 1e-99"]


@pytest.mark.parametrize(
    "hostile", ["<script>alert(1)</script>", "[x](javascript:alert(1))", "<img src=x onerror=a()>"]
)
def test_what_a_measurement_says_of_itself_never_runs(nothing, tmp_path, unseen, hostile):
    unseen()
    about = {"name": f"readings {hostile}", "description": f"about {hostile}", "source": f"from {hostile}"}
    write_report(dataclasses.replace(nothing, kind=dataclasses.replace(nothing.kind, **about)), tmp_path)
    made = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<script>alert" not in made
    assert 'href="javascript' not in made
    assert "<img src=x" not in made
    assert html.unescape(made).count(hostile) == 4  # title, heading, description, source
    assert "<script>alert" not in (tmp_path / "report.md").read_text(encoding="utf-8")


def test_a_verdict_with_a_number_that_is_none_leaves_no_report(nothing, tmp_path):
    verdict = dataclasses.replace(nothing.verdict, posterior={"none": float("nan")})
    with pytest.raises(InputError, match=r"nothing is written: posterior.none came out as nan, which is no result"):
        write_report(dataclasses.replace(nothing, verdict=verdict), tmp_path / "out", find(nothing))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"verdict": "unknown", "judged": None}, "No effect of the library makes it more probable."),
        (
            {"verdict": "unknown", "judged": Judged("a", 99.0, 1e-9), "nearest": Judged("b", 50.0, 1e-3)},
            "The most probable, b, lowers chi^2 from ",
        ),
        (
            {"verdict": "unknown", "judged": Judged("a", 99.0, 1e-9), "nearest": Judged("b", 9.0, 0.3),
             "refused_leaders": (("b", 0.9, Reason("no gain")),)},
            f"b fits in sum (p = 0.3), but is refused: {Reason('no gain')}.",
        ),
        ({"verdict": "unknown", "judged": Judged("a", 9.0, 0.3)}, "a fits in sum (p = 0.3), but is not named."),
        (
            {"verdict": "named", "effects": (Named("a", {}), Named("b", {}, mistake=True))},
            "Missing: a, and an error of the measurement or its file: b. The model with them fits",
        ),
        ({"verdict": "class", "members": "both", "effects": (Named("a", {}),)}, "Missing or in error (most"),
        ({"verdict": "partial", "effects": (Named("a", {}),)}, "a explains part of the gap. chi^2 of 24 values falls"),
        (
            {"verdict": "tentative", "effects": (Named("a", {}),),
             "checks": (AcceptanceCheck(LEFT_OVER, "0.00041, mostly steer torque from lean", False),)},
            "Not met: the residuals still correlate with a steer torque proportional to lean (p = 0.00041).",
        ),
    ],
)  # fmt: skip
def test_the_sentence_of_each_verdict(one, fields, words):
    assert words in record(changed(one, **fields), find(one))["sentence"]
