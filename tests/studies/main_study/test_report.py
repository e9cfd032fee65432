"""The report says what the numbers say; nothing is left open, every link leads somewhere."""

import re
from dataclasses import replace
from decimal import Decimal

import numpy as np
import pytest
from read_report import text_of_page
from small_study import chosen as cases_of
from small_study import small

from bicycle.parameters import ParameterCovariance
from bicycle.stability import CrossingIdentity
from studies import main_study
from studies.uncertainty import Quantity
from tyre.ground import InputError

IMAGE = re.compile(r"!\[[^]]*\]\(([^)]*)\)")


@pytest.fixture
def report(tmp_path):
    """Text of a study's report."""
    return lambda study: text_of_page(main_study.write_report(study, tmp_path)[1].read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def written(racing, tmp_path_factory):
    """Text and HTML of the report of the racing study."""
    page = main_study.write_report(racing, tmp_path_factory.mktemp("report"))[1].read_text(encoding="utf-8")
    return text_of_page(page), page


def table(text, title, number=0) -> list[list[str]]:
    """Rows of a Markdown table below a title, without its head."""
    lines = text.partition(f"\n{title}")[2].splitlines()
    rules = [k for k, line in enumerate(lines) if line.startswith("|-")]
    rows = []
    for line in lines[rules[number] + 1 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


def test_nothing_is_left_open(written, heavy, report):
    for text in (*written, report(heavy)):
        assert not re.search(r"{{|{%|}}|\bnan\b|\bNone\b|\binf\b|\[\]|Traceback|<[a-z_.]+ object", text)
        assert " ." not in text
        assert "  ," not in text


def test_every_picture_and_table_is_on_the_page(written):
    text, page = written
    shown = IMAGE.findall(text)
    assert shown == ["headline.png", "amplitude.png", "causes.png", "damping_ratio.png", "critical_speeds.png"]
    assert re.findall(r'<img [^>]*src="([^"]+)"', page) == shown
    assert page.count("<table>") == len(re.findall(r"^\|-", text, re.MULTILINE)) >= 9
    for head, rows in re.findall(r"^(\|.*)\n\|-[-|]*\n((?:\|.*\n)+)", text, re.MULTILINE):
        assert {row.count("|") for row in rows.splitlines()} == {head.count("|")}


def test_printed_decomposition_adds_up(racing, written):
    rows = [row for k in (0, 1) for row in table(written[0], "### Contributions of", k)]
    for row in rows:
        before, after, total, *shares = (Decimal(cell) for cell in row[3:])
        assert total == after - before == sum(shares)
        assert len(shares) == 3
    assert (
        len(rows)
        == len([c for d in racing.decompositions if d.setup == racing.settings.reference for c in d.changes])
        >= 10
    )


def test_the_answer_comes_first_and_its_rule_after_the_figure(racing, written):
    text, page = written
    answer = re.sub(r"[|\-:\s]+", " ", main_study.first_screen(racing)).strip()  # without the rules of its table
    assert re.sub(r"[|\-:\s]+", " ", text).strip().startswith(answer)
    top = text.partition("## One-at-a-time sensitivity")[0]
    assert "| yes, no | at least 90 % | at most 2 % |" in top
    assert (
        page.index("<h1") < page.index("<table>") < page.index("headline.png") < page.index("One-at-a-time sensitivity")
    )


def test_bands_have_their_sd_or_where_that_is_not_valid_the_interval_of_the_draws(racing, report):
    """Two draws a apart have the sd a / sqrt(2); the linear one is 1."""
    (result,) = racing.results_of(racing.settings.reference, "Tyre1 flat")[:1]
    (band,) = result.bands(30.0)
    identity = CrossingIdentity("wobble", destabilising=True)

    def row(*draws):
        samples = band.start.speed + np.array(draws)
        q = Quantity("wobble unstable above", "m/s", band.start.speed, np.array([0.6, 0.8]), {}, samples, identity)
        told = report(replace(racing, checks=(main_study.Check(result, (q,)),)))
        return table(told, "### Unstable wobble")[0][2], told

    alike = np.tile([-1.0, 1.0], 200)
    cell, told = row(*alike)
    assert cell.startswith(f"{band.start.speed:.1f}"[:3])
    assert "±" in cell.partition(" to ")[0]
    assert "The linear standard uncertainty is not valid" not in told
    cell, told = row(*(3 * alike))
    at = band.start.speed
    assert cell.partition(") to ")[0] == f"{at:.1f} ({at - 3:.1f} to {at + 3:.1f}"
    assert "The linear standard uncertainty is not valid for wobble unstable above at 3.5 bar: use the interval" in told
    assert "±" not in row(*alike[:-1], np.nan)[0].partition(") to ")[0]  # some draws have lost the edge

    # a result of another process is another object; where the linear one fails, no other row has it either
    samples = at + 3 * alike
    q = Quantity("wobble unstable above", "m/s", at, np.array([0.6, 0.8]), {}, samples, identity)
    rows = table(report(replace(racing, checks=(main_study.Check(replace(result), (q,)),))), "### Unstable wobble")
    assert rows[0][2].partition(") to ")[0] == f"{at:.1f} ({at - 3:.1f} to {at + 3:.1f}"
    assert all(re.fullmatch(r"[\d.]+|none", row[2].partition(" to ")[0]) for row in rows[1:])


def test_what_is_known_together_is_not_called_independent(racing, report):
    assert "All parameters of the bicycle are treated as independent" in report(racing)
    bicycle = racing.settings.bicycle
    joint = ParameterCovariance(("mB", "zB"), np.array([[1.0, 0.01], [0.01, 0.0004]]))
    together = replace(bicycle, sd={}, covariance=joint)
    told = report(replace(racing, settings=replace(racing.settings, bicycle=together)))
    assert "2 parameters of the bicycle are correlated ([covariance] of its file: mB, zB)" in told
    assert "All parameters of the bicycle are treated" not in told


def test_the_sentence_about_the_lag_says_only_what_the_lag_does(racing, written):
    """Two thirds and more of what a string changes is its trail, which a lag may have too."""
    first = racing.contact_models[0]
    lag, trailing, string = (one.least.damping_ratio for one in (first.lag, first.trailing, first.string))
    assert trailing - lag < 2 * (string - trailing) < 0
    assert f"the pneumatic trail changes the minimum damping ratio by {trailing - lag:+.3f}," in written[0]
    assert f"a single lag in place of the string's by {trailing - string:+.3f}." in written[0]


@pytest.mark.parametrize(("before", "after"), [(4.2951, 4.2949), (4.2961, 4.2949), (0.12345, -0.12345)])
def test_rounding_keeps_sums(before, after):
    weave = CrossingIdentity("weave", destabilising=False)
    change = main_study.Change(weave, main_study.CRITICAL, before, after, -0.00049, 0.0015)
    for digits in (2, 3, 5):
        p = main_study.round_change(change, digits)
        assert p.total == p.after - p.before == p.length + p.stiffness + p.interaction
        assert float(p.before) == pytest.approx(before, abs=0.5001 * 10.0**-digits)
        assert float(p.interaction) == pytest.approx(change.interaction, abs=2.001 * 10.0**-digits)


def test_extrapolation_is_said(heavy, report, written):
    text = report(heavy)
    assert "- Tyre1 flat, rear wheel at 613 N, 3.5 bar\n" in text
    assert all(row[-1] == "yes" for row in table(text, "### Unstable wobble"))
    assert "These values are guesses" not in text
    assert "Nothing is extrapolated: wheel loads and pressures are inside" in written[0]
    far = replace(heavy, cases=tuple(replace(case, out_of_reach=True) for case in heavy.cases))
    assert "Tyre1 flat: some loads or pressures are outside the measured range by more than its width. " in report(far)
    assert "These values are guesses." in report(far)


def test_assumptions_are_named_and_what_is_given_is_not_one(racing, heavy, report, written):
    told = written[0].partition("## Assumptions")[2]
    for words in (
        "Front frame, assumed (measured on no bicycle): joint 0.65 m",
        "Relaxed hands on, assumed: inertia 0.1 kg m²", "Tense hands on, assumed: inertia 0.05 kg m²",
        "damping ratio 0.25 (20.7 N m s/rad), frame and seated rider together.",
        "Tyre, assumed: camber stiffness 0.65 × ",
        "3 mm is one standard uncertainty",
        "Tyre, assumed: pneumatic trail 0.017 m; published 0.012 to 0.026 m",
        "front-frame stiffness 2500 to 10000 N m/rad; ", "one rigid body",
    ):  # fmt: skip
        assert words in told
    given = replace(
        racing.settings, front=main_study.Front(4000.0, 0.1, from_file=True),
        arms=main_study.Arms(grip="", from_file=True),
        further={"pneumatic_trail": {"trail": 0.02}, "camber_thrust": {"camber_stiffness": 200.0}},
    )  # fmt: skip
    relaxed = [setup for setup in racing.settings.setups if setup.hands != "tense" and setup.front]
    worlds = dict(zip(relaxed, given.setups, strict=True))
    results = tuple(replace(r, setup=worlds[r.setup]) for r in racing.results if r.setup in worlds)
    told = report(replace(racing, settings=given, results=results)).partition("## Assumptions")[2]
    assert "from the model file: joint 0.65 m above the ground (0.34 m above the hub, along the steer axis)" in told
    assert "Hands on, from the model file" in told
    assert "pneumatic_trail: from the model file." in told
    assert "assumed: pneumatic trail" not in told
    assert "pneumatic trail 0.0" not in told  # nor is it varied
    assert "camber stiffness 0.8 to 1.25 × that of the model file" in told
    assert "assumed: camber" not in told
    assert "front-frame stiffness 3200 to 5000 N m/rad" in told


def test_numbers_have_the_digits_of_their_sd():
    assert main_study.like(24.8083, 0.8797) == "24.8"
    assert main_study.like(0.8797, 0.8797) == "0.9"
    assert main_study.like(4.90574, 0.000253) == "4.9057"
    assert main_study.like(-0.0773, 0.00096) == "-0.0773"
    assert main_study.like(38.84, 30.0) == "39"
    assert main_study.like(38.84, 0.0) == "38.84"
    assert (main_study.with_sign(-0.0004, ".2f"), main_study.with_sign(0.5, ".1f")) == ("0.00", "+0.5")
    assert main_study.span_of([3.04, 2.96], ".1f") == "3.0"
    assert main_study.span_of([3.0, 2.0, 5.0], ".1f") == "2.0 to 5.0"
    assert main_study.span_of([-0.2, 0.1], ".1f", sign=True) == "-0.2 to +0.1"


def test_a_check_that_fails_is_said_and_costs_nothing(racing, monkeypatch, results_alone, report):
    def refuse(*arguments, **options):
        raise InputError("no draw is a bicycle")

    settings = small(fronts=2, speeds=racing.settings.speeds[::4])
    monkeypatch.setattr("studies.uncertainty.propagation.Uncertainty.quantities", refuse)
    study = main_study.run_study(settings, cases=cases_of(settings, {"Tyre1 flat": (5.5,)}))
    assert len(study.results) == 5
    assert [one.failure for one in study.checks] == ["no draw is a bicycle"]
    told = report(study)
    assert "5.5 bar: this check could not be made (no draw is a bicycle)." in told
    assert "\nNothing to compare" in told


def test_how_large_wobble_gets_is_that_of_both_pressures(racing, heavy, report, written):
    rows = table(written[0], "## Amplitude of wobble")
    assert len(rows) == len(racing.amplitudes)
    for one, row in zip(racing.amplitudes, rows, strict=True):
        largest, at, low = one.wobble.largest, one.wobble.at, one.wobble.low
        end = ">30" if one.wobble.high == 30.0 else f"{one.wobble.high:.1f}"
        assert row == [one.case.condition, f"{largest:.1f}°", f"{at:.1f}", f"{low:.1f} to {end}"]
        (band,) = racing.result(racing.settings.reference, one.case).bands(30.0)
        assert low == pytest.approx(band.start.speed, rel=1e-6)
    assert "(amplitude.png)" in written[0]
    none = report(heavy)
    assert table(none, "## Amplitude of wobble") == [["3.5 bar", "none", "-", "-"], ["7.5 bar", "none", "-", "-"]]
    assert "(amplitude.png)" not in none
    refused = replace(racing, amplitudes=(main_study.Amplitude(racing.amplitudes[0].case, refused="leave out drag"),))
    assert "steer amplitude" not in main_study.first_screen(refused)
    told = report(refused)
    assert table(told, "## Amplitude of wobble") == [["3.5 bar", "not known", "-", "-"]]
    assert "Not known: leave out drag." in told
    larger = racing.amplitudes[0].wobble._replace(followed=False)
    more = replace(racing, amplitudes=(replace(racing.amplitudes[0], wobble=larger),))
    assert table(report(more), "## Amplitude of wobble")[0][1] == f"{larger.largest:.1f}° or more"


def test_the_page_is_short_before_its_appendix(written, heavy, report):
    for text in (written[0], report(heavy)):
        before, appendix = text.split("\n## Appendix\n")
        assert len(before.split()) <= 1200
        assert len(appendix.split()) > 100
