"""The report says what the numbers say; nothing is left open, every link leads somewhere."""

import re
from dataclasses import replace
from decimal import Decimal

import numpy as np
import pytest
from small_study import chosen as cases_of
from small_study import small

from bicycle.critical import CrossingIdentity
from studies.main_study import (
    CRITICAL,
    Arms,
    Change,
    Check,
    Front,
    doubt,
    first_screen,
    like,
    printed,
    run_study,
    signed,
    span_of,
    write_report,
)
from studies.uncertainty import Quantity
from tyre.errors import InputError

IMAGE = re.compile(r"!\[[^]]*\]\(([^)]*)\)")


@pytest.fixture
def report(tmp_path):
    """Markdown of a study's report."""
    return lambda study: write_report(study, tmp_path)[1].read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def written(racing, tmp_path_factory):
    """Markdown and HTML of the racing study."""
    files = write_report(racing, tmp_path_factory.mktemp("report"), redrawn=["paper_fig01"])[1:]
    return [file.read_text(encoding="utf-8") for file in files]


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


def test_the_question_and_its_answer_come_first(racing, written):
    text, page = written
    top = text.split("## Contents")[0]
    assert top.startswith(first_screen(racing).rstrip())
    assert IMAGE.findall(top) == ["headline.png"]
    assert page.index("<h1") < page.index("headline.png") < page.index("<table>") < page.index("Contents")


def test_every_picture_and_table_is_in_both_forms(written):
    text, page = written
    shown = IMAGE.findall(text)
    assert {"headline.png", "wobble_hands_on.png", "paper_fig01.png"} < set(shown)
    assert re.findall(r'<img [^>]*src="([^"]+)"', page) == shown
    assert page.count("<table>") == len(re.findall(r"^\|-", text, re.MULTILINE)) >= 9
    for head, rows in re.findall(r"^(\|.*)\n\|-[-|]*\n((?:\|.*\n)+)", text, re.MULTILINE):
        assert {row.count("|") for row in rows.splitlines()} == {head.count("|")}


def test_printed_decomposition_adds_up(racing, written):
    rows = [row for k in (0, 1) for row in table(written[0], "## Relaxation length or", k)]
    for row in rows:
        before, after, total, *shares = (Decimal(cell) for cell in row[3:])
        assert total == after - before == sum(shares)
        assert len(shares) == 3
    assert len(rows) == len([c for d in racing.decompositions[:2] for c in d.changes]) >= 10


@pytest.mark.parametrize(("before", "after"), [(4.2951, 4.2949), (4.2961, 4.2949), (0.12345, -0.12345)])
def test_rounding_keeps_sums(before, after):
    change = Change(CrossingIdentity("weave", destabilising=False), CRITICAL, before, after, -0.00049, 0.0015)
    for digits in (2, 3, 5):
        p = printed(change, digits)
        assert p.total == p.after - p.before == p.length + p.stiffness + p.interaction
        assert float(p.before) == pytest.approx(before, abs=0.5001 * 10.0**-digits)
        assert float(p.interaction) == pytest.approx(change.interaction, abs=2.001 * 10.0**-digits)


def test_the_band_table_is_that_of_the_results(racing, written):
    rows = table(written[0], "![Speeds of unstable")
    for row, result in zip(rows, racing.of(racing.settings.reference), strict=True):
        (band,) = result.bands(30.0)
        assert row[:2] == [result.case.name, result.case.condition]
        numbers = [float(number) for number in re.findall(r"\d+\.?\d*", row[2])]
        assert numbers[0] == pytest.approx(band.start.speed, abs=band.start.sd)
        assert numbers[2] == pytest.approx(band.end.speed, abs=band.end.sd)
        assert row[3] == f"{3.6 * band.start.speed:.0f} – {3.6 * band.end.speed:.0f}"
        outer = racing.outer(result)
        assert row[7] == f"{outer.without} of {outer.count}"


def test_worlds_are_compared_case_by_case(racing, written):
    rows = table(written[0], "## The four worlds")
    assert [row[:2] for row in rows] == [[case.name, case.condition] for case in racing.cases]
    for row, case in zip(rows, racing.cases, strict=True):
        for cell, setup in zip(row[2:], racing.settings.setups, strict=True):
            result = racing.result(setup, case)
            assert cell.endswith(f"; {result.least.damping_ratio:.3f}")
            assert cell.startswith("stable" if result.span(30.0) is None else f"{result.span(30.0).low:.1f} – ")


def test_extrapolation_is_said(heavy, report, written):
    text = report(heavy)
    assert "- Tyre1 flat, rear wheel at 613 N, 3.5 bar\n" in text
    assert all(row[-1] == "yes" for row in table(text, "![Speeds of unstable"))
    assert "is a guess" not in text
    assert "Nothing is extrapolated: wheel loads and" in written[0]
    far = replace(heavy, cases=tuple(replace(case, out_of_reach=True) for case in heavy.cases))
    assert "Of Tyre1 flat some loads or pressures are farther outside" in report(far)


def test_what_is_the_users_is_not_called_dellortos(racing, report, written):
    mine = [replace(case, packaged=case.name != "Tyre1 flat") for case in racing.cases]
    assert "\nTyre1 flat: yours. Tyre3 flat: tables of Dell'Orto" in report(replace(racing, cases=tuple(mine)))
    assert "yours" not in written[0]


def test_assumptions_are_named_and_what_is_given_is_not_one(racing, heavy, report, written):
    told = written[0].partition("## What is assumed")[2]
    for words in (
        "Flexible front, assumed: a hinge 0.65 m", "Hands on the bar, assumed: 0.1 kg m²", "Camber stiffness 0.65 × ",
        "3 mm is one standard deviation", "No aligning moment.", "stiffness 2500 to 10000", "one rigid body",
    ):  # fmt: skip
        assert words in told
    given = replace(
        racing.settings, front=Front(4000.0, 8.0, given=True), arms=Arms(given=True),
        further={"pneumatic_trail": {"trail": 0.02}, "camber_thrust": {"camber_stiffness": 200.0}},
    )  # fmt: skip
    worlds = dict(zip(racing.settings.setups, given.setups, strict=True))
    results = tuple(replace(r, setup=worlds[r.setup]) for r in racing.results)
    told = report(replace(racing, settings=given, results=results)).partition("## What is assumed")[2]
    assert "as the model file gives it: a hinge 0.65 m above the ground, 4000 N m/rad" in told
    assert "Hands on the bar, as the model file gives them" in told
    assert "pneumatic_trail as the model file gives it." in told
    assert "No aligning moment" not in told
    assert "× static" not in told
    assert "stiffness 3200 to 5000" in told
    bare = report(heavy).partition("## What is assumed")[2].partition("##")[0]
    assert "rider" not in bare  # of a bicycle without one


def test_numbers_have_the_digits_of_their_sd():
    assert like(24.8083, 0.8797) == "24.8"
    assert like(0.8797, 0.8797) == "0.9"
    assert like(4.90574, 0.000253) == "4.9057"
    assert like(-0.0773, 0.00096) == "-0.0773"
    assert like(38.84, 30.0) == "39"
    assert like(38.84, 0.0) == "38.84"
    assert (signed(-0.0004, ".2f"), signed(0.5, ".1f")) == ("0.00", "+0.5")
    assert span_of([3.04, 2.96], ".1f") == "3.0"
    assert span_of([3.0, 2.0, 5.0], ".1f") == "2.0 to 5.0"
    assert span_of([-0.2, 0.1], ".1f", sign=True) == "-0.2 to +0.1"


def quantity(samples) -> Quantity:
    return Quantity("wobble stable above", "m/s", 20.0, np.array([0.6, 0.8]), {}, np.array(samples))


def test_linear_and_monte_carlo_are_compared(racing, report):
    """Two draws a apart have the sd a / sqrt(2); the linear one is 1."""
    result = racing.checks[0].result
    near, wide = (quantity([20.0, 20.0 + a * np.sqrt(2)]) for a in (1.01, 1.2))
    lost = quantity([20.0, 20.0 + np.sqrt(2), np.nan])
    told = report(replace(racing, checks=(Check(result, (near, wide, lost)),)))
    assert "In 1 of 3 rows" in told
    assert "larger by +1.0 %)" in told
    assert "wobble stable above by +20.0 %; Tyre1 flat" in told
    assert "wobble stable above by 0.0 %, lost in 1 draws" in told
    assert "They differ" not in report(replace(racing, checks=(Check(result, (near,)),)))


def test_checks_take_the_most_doubtful_cases_and_the_same_linear_sd(racing):
    settings = racing.settings
    assert [one.result.setup for one in racing.checks] == [settings.reference] * 2 + list(settings.setups[1:])
    for one in racing.checks:
        rivals = racing.of(one.result.setup, one.result.case.name if one.result.setup == settings.reference else None)
        assert doubt(one.result) == max(doubt(r) for r in rivals)
        found = {q.name: q.linear_sd for q in one.quantities}
        assert not one.failure
        for name, part in (("frequency", one.result.frequency), ("damping ratio", one.result.damping)):
            np.testing.assert_allclose(found[f"wobble {name} at 15 m/s"], part["wobble"].sd, rtol=1e-6)
        assert all(len(q.samples) <= settings.samples for q in one.quantities)
    best = next(one for one in racing.checks if one.result.case.name == "Tyre1 flat")
    assert max(abs(q.sampled_sd / q.linear_sd - 1) for q in best.quantities if not q.lost) < 0.2  # 60 draws


def test_a_check_that_fails_is_said_and_costs_nothing(racing, monkeypatch, results_alone, report):
    def refuse(*arguments, **options):
        raise InputError("no draw is a bicycle")

    settings = small(fronts=2, speeds=racing.settings.speeds[::4])
    monkeypatch.setattr("studies.uncertainty.propagation.Uncertainty.quantities", refuse)
    study = run_study(settings, cases=cases_of(settings, {"Tyre1 flat": (5.5,)}))
    assert len(study.results) == 4
    assert [one.failure for one in study.checks] == ["no draw is a bicycle"] * 4
    told = report(study)
    assert "Tyre1 flat, 5.5 bar, hands on, rigid front: this check could not be made (no draw is a bicycle)." in told
    assert "\nNothing to compare" in told
