"""The first page of a report: every sentence against the figures beside it, on readings of a mass that is let go."""

import dataclasses
import html
import json
import re
from dataclasses import dataclass

import numpy as np
import pytest
from read_report import printed, read_report
from scipy.stats import chi2

from studies.diagnosis import (
    BEFORE_AFTER,
    Diagnosis,
    fate,
    find,
    listed,
    misfit,
    number,
    page,
    probability,
    record,
    residuals,
    said,
    sentence,
    terminal,
    titles,
    with_stability,
    write_report,
)
from studies.inference import (
    AcceptanceCheck,
    Candidate,
    Judged,
    Kind,
    Moved,
    Named,
    Reason,
    Rows,
    UncertainParameter,
    fit_effect_alone,
    judge,
)
from studies.reporting import made_by, plotting
from tyre.ground import InputError

WHERE = r"\*\*Where:\*\* [ab]: measured [\d.]+ above the base model \(mean measured [\d.]+\), time [\d.]+ to 6 s\."
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
        return {"before_after": BEFORE_AFTER}

    @property
    def data(self):
        return self.readings, np.ones(24)

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
    return Diagnosis(model=None, **{**vars(found), "alone": fit_effect_alone(found)})


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


def first_screen(text):
    return text.split("# Details")[0]


def test_the_bar_of_a_misfit_far_below_noise_is_drawn_with_its_number(one, canvases, monkeypatch, tmp_path):
    monkeypatch.setattr("studies.diagnosis.figures.drawing", plotting.drawing)
    found = find(one)
    tiny = dataclasses.replace(found.story, gap=dataclasses.replace(found.story.gap, adjusted=0.5))  # 0.02 of 24
    write_report(one, tmp_path, dataclasses.replace(found, story=tiny))
    (axis,) = canvases[0].axes
    shortest = min(bar.get_width() for bars in axis.containers for bar in bars)
    assert shortest == pytest.approx(0.5 / 24)
    assert axis.get_xlim()[0] <= 0.5 * shortest


def test_the_story_credits_the_effect_alone_before_the_parameters(one):
    """By hand: the rate alone with level and swing as stated, and the two without it."""
    story = find(one).story
    data, n = one.kind.readings, 24
    base = float(((data - 2.0) ** 2).sum())
    t = PLACES / 6
    rate = float(t @ (data - 2.0) / (t @ t + 1 / 9))  # prior sd 3
    alone = float(((data - 2.0 - rate * t) ** 2).sum())
    level = np.linalg.inv(np.array([[n, 0], [0, 0.09 * n]]) + 4 * np.eye(2)) @ [
        (data - 2).sum(), (np.where(PLACES > 3, 0.3, -0.3) * (data - 2)).sum()
    ]  # fmt: skip
    without = float(((data - 2 - level[0] - level[1] * np.where(PLACES > 3, 0.3, -0.3)) ** 2).sum())
    gap = story.gap
    assert (gap.base, gap.effect_alone, gap.without_effect) == pytest.approx((base, alone, without), rel=1e-4)
    assert gap.adjusted == pytest.approx(one.final.chi2)
    assert gap.without_effect_moved_sd == pytest.approx(max(abs(level)) / 0.5, rel=1e-4)
    assert gap.noise == n
    held = story.held_out
    assert held.base == pytest.approx(base)
    assert held.adjusted < held.without_effect < held.base


def test_the_first_screen_states_what_confidence_where_and_evidence(one):
    text = first_screen(written(one))
    (effect,) = one.verdict.effects
    value, sd = effect.parameters["rate"]
    assert value == pytest.approx(9.0, abs=4 * sd)
    assert f"**What:** Missing effect: linear (rate {printed(value, sd)} m/s)." in text
    assert f"**Confidence:** named, probability {probability(one.verdict.posterior['linear'])}. " in text
    closest = find(one).alternative
    by_hand = next(f for f in one.hypotheses.rank() if not f.identifiers >= {"linear"} and f.admissible)
    assert (closest.name, closest.misfit) == (by_hand.name, pytest.approx(by_hand.chi2 / 24))
    assert f"Closest alternative: {said(closest.name)}, probability {probability(closest.probability)}, " in text
    assert f"remaining misfit {closest.misfit:.3g} per data point (verdict: {one.final.chi2 / 24:.3g})." in text
    where = find(one).where
    assert where.by == pytest.approx((one.kind.readings - 2)[np.abs(one.nominal) > 2].mean(), rel=0.6)
    assert re.search(WHERE, text)
    assert find(one).story.held_out.remaining_share("effect_alone") == 0.0
    assert "On held-out data it alone closes the base model's discrepancy" in text
    assert "remains, with implausible parameter shifts: level" in text
    for word in ("χ²", "p =", "odds", "chi^2"):
        assert word not in text
    assert len(text.split()) < 250
    thirds = re.findall(r"^\| (\d.* to .*) \| (\d+) \|", written(one), re.MULTILINE)
    assert set(thirds) == {("1 to 2.67 s", "8"), ("2.67 to 4.33 s", "8"), ("4.33 to 6 s", "8")}


def test_the_terminal_has_twelve_lines_at_most(one, nothing, several):
    for found in (one, nothing, several):
        findings = find(found)
        lines = terminal(found, findings).splitlines()
        assert len(lines) <= 12
        assert lines[0].startswith(f"{found.verdict.verdict}. ")
        bars = [line for line in lines if line.endswith("#")]
        assert len(bars) == len(findings.story.gap.steps)
        assert len(max(bars, key=len)) == len(bars[0])  # that of the base model is the longest
        base = max(float(bars[0].split()[-2]), 1.0)  # times the noise; a decade of at least one fills 40 signs
        assert bars[0].count("#") == pytest.approx(max(1, 40 * np.log(base) / np.log(max(base, 10.0))), abs=0.6)


def test_where_nothing_is_named_nothing_is_said_to_be(nothing):
    text = written(nothing)
    p = probability(chi2.sf(float(nothing.nominal @ nothing.nominal), 24))
    expected = f"No missing effect detected: the base model's residuals are consistent with noise (p = {p})."
    assert f"**What:** {expected}" in text
    assert "could hide" not in text
    misfits = find(nothing).story.held_out.misfits
    assert (
        f"On held-out data the misfit per data point is {misfits['base']:.3g} with the base model and "
        f"{misfits['adjusted']:.3g} with re-estimated parameters (noise: 1)." in text
    )
    assert "base model's discrepancy" not in text  # a share of what is no more than noise
    share = probability(nothing.verdict.posterior["none"])
    assert f"**Confidence:** no missing effect, probability {share}. Closest alternative: " in text
    assert list(titles(nothing).values()) == ["base model", "parameters re-estimated"]
    assert find(nothing).story.gap.effect_alone is None
    assert list(residuals(nothing)) == ["base model", "parameters re-estimated"]


def test_where_parameters_alone_close_a_gap_the_words_say_which_and_that_an_effect_may_hide(nothing):
    """Readings of a level of 3, stated as 2 +- 0.5: by hand, the posterior mean of level and swing."""
    found = diagnosed(0.0, "bias", level=3.1)
    assert found.verdict.verdict == "none"
    away, columns = found.kind.readings - 2.0, np.stack([np.ones(24), np.where(PLACES > 3, 0.3, -0.3)], 1)
    level, swing = np.linalg.solve(columns.T @ columns + 4 * np.eye(2), columns.T @ away)
    assert found.verdict.absorbed[0].name == "level"
    assert found.verdict.absorbed[0].shift == pytest.approx(level / 0.5, rel=1e-6)
    words = record(found, find(found))["sentence"]
    p = probability(found.hypotheses.null.goodness)
    assert (
        f"No missing effect detected: after re-estimation the residuals are consistent with noise (p = {p})." in words
    )
    assert f"Parameter shifts: level {2 + level:.2f} instead of 2.00 ± 0.50 m ({level / 0.5:+.1f} stated SD)" in words
    assert ("swing" in words) == (abs(swing / 0.5) > 0.5)
    assert words.endswith("A missing effect could hide in them.")
    assert nothing.verdict.absorbed == ()


def test_a_parameter_that_went_far_is_told_whole_beside_what_was_stated_of_it(nothing):
    """A trail of 42 +- 30 mm that becomes 104 mm, and a tilt whose sd nobody stated."""
    trail = Moved("c", "m", 0.0420, 0.030, 0.1041, 0.02, 2.07, 2.07)
    tilt = Moved("lam", "rad", 0.3665, 0.010, 0.3364, 0.006, -3.01, -3.01, assumed=True)
    mass = Moved("mB", "kg", 81.2, 10.0, 120.4, 4.0, 3.92, 3.92)
    words = sentence(changed(nothing, absorbed=(trail, tilt, mass)).verdict)
    assert "trail 104 instead of 42 ± 30 mm (+2.1 stated SD), " in words
    assert "steer axis tilt 19.27 instead of 21.00 ± 0.57 deg (-3.0 assumed SD), " in words
    assert "mass of frame and rider 120 instead of 81 ± 10 kg (+3.9 stated SD)." in words


def test_figures_and_tables_call_a_hypothesis_alike(one, folder):
    assert said("none") == "parameters re-estimated"
    assert said("a+b") == "a + b"
    text = read_report(folder)
    assert text.endswith(made_by())
    story = (folder / "story.svg").read_text(encoding="utf-8")
    drawn = (folder / "before_after.svg").read_text(encoding="utf-8")
    assert list(titles(one).values()) == [
        "base model", "+ linear alone", "+ linear, parameters re-estimated",
        "without linear, parameters re-estimated",
    ]  # fmt: skip
    for title in titles(one).values():
        assert f"<!-- {title} -->" in story
    for title in residuals(one):
        assert f"<!-- {title} -->" in drawn
        assert title in text


def test_a_size_that_its_sd_exceeds_is_not_printed(one):
    (effect,) = one.verdict.effects
    loose = changed(one, effects=(dataclasses.replace(effect, parameters={"rate": (0.5, 0.6)}),))
    text = written(loose)
    assert "Missing effect: linear." in text
    assert "| linear | rate | not determined | - |" in text


def test_each_member_of_a_class_says_why(several):
    leader, other = several.verdict.equivalent
    text = written(several)
    assert f"Missing effect, one of these: {leader} (rate" in text
    assert f", or {other}." in text
    assert f"- {other}: {several.verdict.reasons[other]}" in text
    fates = fate(several)
    assert (fates[leader], fates[other]) == ("leads", "not ruled out")
    findings = find(several)
    assert len(findings.between) == 2
    assert findings.alternative.name == other
    together = probability(several.verdict.probability)
    second = said(several.verdict.equivalent[1])  # a member of the class is no alternative to it
    assert f"**Confidence:** one of 2, probability together {together}. Second of them: {second}, " in text


def test_what_is_far_more_probable_but_refused_has_its_own_sentence(one):
    rule = Reason("fails", rules="a usual size")
    found = changed(one, refused_leaders=(("shift", 0.999, rule),), posterior={"shift": 0.999, "linear": 1e-4})
    assert f"At least 1000 times as probable but refused: shift ({rule})." in first_screen(written(found))
    assert fate(found)["shift"] == f"refused: {rule}"
    near = changed(one, refused_leaders=(("shift", 0.6, rule),), posterior={"shift": 0.6, "linear": 0.4})
    assert "but refused: shift" not in first_screen(written(near))
    assert "times as probable" not in written(near)


def test_effects_of_one_family_are_one_answer():
    """Two that do the same to the data are a class, and a name if they are one physics."""
    data = 1.4 + 9.0 * PLACES / 6 + np.random.default_rng(1).standard_normal(24)
    both = [dataclasses.replace(growth(name), family="a growth") for name in ("linear", "alike")]
    found = Diagnosis(model=None, **vars(judge(Line(data, tuple(both)))))
    assert (found.verdict.verdict, set(found.verdict.equivalent)) == ("named", {"linear", "alike"})
    assert "Equivalent: alike (a growth)." in first_screen(written(found))


def test_an_effect_without_numbers_is_not_printed_empty():
    data = 7.0 + np.random.default_rng(2).standard_normal(24)
    found = judge(Line(data, (Candidate("bias", ()),)))
    diagnosis = Diagnosis(model=None, **vars(found))
    assert diagnosis.verdict.equivalent == ("bias",)
    assert "| bias | - | a constant in each run, integrated out |" in written(diagnosis)


def test_a_section_that_fails_costs_only_itself(one, tmp_path, monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("by nothing")

    monkeypatch.setattr("studies.diagnosis.findings.upper_limits", broken)
    monkeypatch.setattr("studies.diagnosis.report.draw_story", broken)
    write_report(one, tmp_path)
    text = read_report(tmp_path)
    assert "not computed: upper limits (ZeroDivisionError: by nothing)" in text
    assert "not computed: figure story" in text
    assert "**What:** Missing effect: linear" in text
    found = json.loads((tmp_path / "verdict.json").read_text())
    assert found["failed_sections"] == {"upper limits": "ZeroDivisionError: by nothing"}
    assert (tmp_path / "before_after.png").exists()


def test_json_has_what_the_page_says(one, folder):
    findings = with_stability(find(one), one)
    found = json.loads((folder / "verdict.json").read_text())
    assert found == json.loads(json.dumps(record(one, findings)))
    assert set(found["gap"]) == {
        "base", "effect_alone", "adjusted", "with_torque", "without_effect", "without_effect_moved_sd", "noise",
    }  # fmt: skip
    assert set(found["gap"]) == set(found["held_out"])
    assert {"series", "speeds", "by", "unit", "measured"} <= set(found["where"])
    assert found["upper_limits"][0]["effect"] == "shift"
    assert len(found["stability"]["variants"]) == len(findings.stability.outcomes)
    assert found["stability"]["sentence"] in read_report(folder)
    assert found["doubts"] == []


def test_the_page_folds_its_details(one, folder):
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert re.findall(r'<details id="(\w+)">', page)
    assert page.count("<details") == page.count("</details>") == page.count("<summary>")
    assert "| --- |" not in page
    assert "{{" not in page
    assert len(read_report(folder).split()) < 250 + 900


def test_no_model_is_written_where_there_is_no_bicycle(one, folder):
    assert "**Model file:** None." in read_report(folder)
    assert not (folder / "model.toml").exists()


def test_figures_are_those_that_are_there(one, folder):
    text = read_report(folder)
    names = re.findall(r"\]\((\w+)\.png\)", text)
    assert names == ["story", "before_after"]
    for name in names:
        assert (folder / f"{name}.png").stat().st_size > 5000


def test_numbers_keep_their_digits_and_lose_their_exponents():
    assert [number(x, 4) for x in (11563.0, 0.006094439, -1.0, 1e-9, 2.0e5)] == [
        "11560", "0.006094", "-1.000", "1e-09", "200000"
    ]  # fmt: skip
    assert [number(x, 2) for x in (2859.0, 0.0008494, 0.0, 44.6)] == ["2900", "0.00085", "0", "45"]
    assert [misfit(x) for x in (65.81, 1319202.34)] == ["65.8", "1319202"]


def test_words():
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b and c"
    assert [probability(p) for p in (1.0, 0.9996, 0.5, 8.3e-21, 0.0)] == ["1", "0.9996", "0.5", "8.3e-21", "< 1e-99"]


@pytest.mark.parametrize(
    "hostile", ["<script>alert(1)</script>", "[x](javascript:alert(1))", "<img src=x onerror=a()>"]
)
def test_what_a_measurement_says_of_itself_never_runs(nothing, tmp_path, no_pictures, hostile):
    about = {"name": f"readings {hostile}", "description": f"about {hostile}", "source": f"from {hostile}"}
    write_report(dataclasses.replace(nothing, kind=dataclasses.replace(nothing.kind, **about)), tmp_path)
    made = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<script>alert" not in made
    assert 'href="javascript' not in made
    assert "<img src=x" not in made
    assert html.unescape(made).count(hostile) == 4  # title, heading, description, source


def test_a_verdict_with_a_number_that_is_none_leaves_no_report(nothing, tmp_path):
    verdict = dataclasses.replace(nothing.verdict, posterior={"none": float("nan")})
    with pytest.raises(InputError, match=r"nothing is written: posterior.none came out as nan, which is no result"):
        write_report(dataclasses.replace(nothing, verdict=verdict), tmp_path / "out", find(nothing))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        (
            {"verdict": "unknown", "judged": None},
            "No effect identified. No effect of the library makes the data more probable.",
        ),
        (
            {"verdict": "unknown", "judged": Judged("a", 99.0, 1e-9), "nearest": Judged("b", 50.0, 1e-3)},
            "No effect identified. No effect of the library explains the discrepancy. Closest alternative: b; "
            "not named: residuals exceed noise (p = 0.001).",
        ),
        (
            {"verdict": "unknown", "judged": Judged("a", 99.0, 1e-9), "nearest": Judged("b", 9.0, 0.3),
             "refused_leaders": (("b", 0.9, Reason("elsewhere")),)},
            "The best explanation fails the acceptance rules. Closest alternative: b; "
            f"not named: {Reason('elsewhere')}.",
        ),
        (
            {"verdict": "unknown", "alone_p": 0.5},
            "No effect identified. The data do not show whether an effect is missing.",
        ),
        (
            {"verdict": "named", "effects": (Named("a", {}), Named("b", {}, mistake=True))},
            "Missing effect: a; and an error of the ride, the measurement or its file: b.",
        ),
        (
            {"verdict": "class", "members": "both", "equivalent": ("a", "b"), "effects": (Named("a", {}),)},
            "Missing effect or measurement error, one of these: a, or b.",
        ),
        ({"verdict": "partial", "effects": (Named("a", {}),)}, "Partly explained by a. The remainder is unexplained: "),
        (
            {"verdict": "tentative", "effects": (Named("a", {}),),
             "checks": (AcceptanceCheck("nothing_unlikely", "0.2", False),
                        AcceptanceCheck("wide_priors", "0.9", False))},
            "Not proven: a. Reservation: P(nothing missing) = 0.2, limit 0.05.",
        ),
    ],
)  # fmt: skip
def test_the_sentence_of_each_verdict(one, fields, words):
    assert words in record(changed(one, **fields), find(one))["sentence"]
