"""The report says what the numbers say; nothing is left open, every link leads somewhere."""

import re
from dataclasses import replace
from decimal import Decimal

import pytest
from small_study import own_table, small

from studies.main_study.answer import answer
from studies.main_study.bands import Band
from studies.main_study.cases import tyre_cases
from studies.main_study.decompose import CRITICAL, Change
from studies.main_study.report import anchor, assumed, context, tyre_sources, write_report
from studies.main_study.report_tables import bands_words, kmh_words, printed, worlds_table
from studies.main_study.settings import Arms, Front

IMAGE = re.compile(r"!\[[^]]*\]\(([^)]*)\)")


def cells(table) -> list[list[str]]:
    """Rows of a Markdown table without its head."""
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()[2:]]


@pytest.fixture(scope="module")
def written(racing, tmp_path_factory):
    """Markdown and HTML of the racing study."""
    files = write_report(racing, answer(racing), tmp_path_factory.mktemp("report"), paper_figures=["paper_fig01"])
    return [file.read_text(encoding="utf-8") for file in files]


def test_nothing_is_left_open(written, heavy, tmp_path):
    other = write_report(heavy, answer(heavy), tmp_path, paper_figures=[])[0].read_text(encoding="utf-8")
    for text in (*written, other):
        assert not re.search(r"{{|{%|}}|\bnan\b|\bNone\b|\binf\b|\[\]|Traceback|<[a-z_.]+ object", text)
        assert " ." not in text
        assert "  ," not in text


def test_the_question_and_its_answer_come_first(racing, written):
    text, page = written
    found = answer(racing)
    assert text.startswith(f"# {found.question}\n")
    first_screen = text.split("## Contents")[0]
    assert all(f"- **{label}** {words}" in first_screen for label, words in found.sentences)
    assert found.why in first_screen
    assert first_screen.count("\n- ") == len(found.sentences)
    assert IMAGE.findall(first_screen) == ["headline.png"]
    assert page.index("<h1") < page.index("headline.png") < page.index("<table>") < page.index("Contents")


def test_every_section_is_in_the_contents_and_every_link_leads_to_one(written):
    text, page = written
    titles = re.findall(r"^## (.+)$", text, re.MULTILINE)
    links = dict(re.findall(r"^- \[(.+)\]\(#(.+)\)$", text, re.MULTILINE))
    assert [title for title in titles if title != "Contents"] == list(links)
    ids = re.findall(r'<h2 id="([^"]+)"', page)
    assert set(links.values()) < set(ids)
    assert len(set(ids)) == len(ids)
    assert set(re.findall(r'href="#([^"]+)"', page)) == set(links.values())


def test_anchors_are_those_that_markdown_viewers_make():
    assert anchor("The figures of Dell'Orto et al. redrawn") == "the-figures-of-dellorto-et-al-redrawn"
    assert anchor("Relaxation length or cornering stiffness?") == "relaxation-length-or-cornering-stiffness"


def test_every_picture_is_in_both_forms(written):
    text, page = written
    shown = IMAGE.findall(text)
    assert {"headline.png", "wobble_hands_on.png", "root_locus_2.png", "eigenvalues_4.png", "paper_fig01.png"} < set(
        shown
    )
    assert re.findall(r'<img [^>]*src="([^"]+)"', page) == shown
    assert page.count("<table>") == len(re.findall(r"^\|-", text, re.MULTILINE)) >= 9


def test_printed_decomposition_adds_up(racing):
    found, rows = context(racing, answer(racing)), 0
    for name in ("critical_parts", "damping_parts"):
        for row in cells(found[name]):
            before, after, total, *shares = (Decimal(cell) for cell in row[3:])
            assert total == after - before == sum(shares)
            assert len(shares) == 3
            rows += 1
    assert rows == len([c for d in racing.decompositions[:2] for c in d.changes]) >= 10


@pytest.mark.parametrize(("before", "after"), [(4.2951, 4.2949), (4.2961, 4.2949), (0.12345, -0.12345)])
def test_rounding_keeps_sums(before, after):
    change = Change("weave stable above", CRITICAL, before, after, -0.00049, 0.0015)
    for digits in (2, 3, 5):
        p = printed(change, digits)
        assert p.total == p.after - p.before == p.length + p.stiffness + p.interaction
        assert float(p.before) == pytest.approx(before, abs=0.5001 * 10.0**-digits)
        assert float(p.interaction) == pytest.approx(change.interaction, abs=2.001 * 10.0**-digits)


def test_the_band_table_is_that_of_the_results(racing):
    rows = cells(context(racing, answer(racing))["band_table"])
    for row, result in zip(rows, racing.of(racing.settings.reference), strict=True):
        (band,) = result.bands(30.0)
        assert row[:2] == [result.case.name, result.case.condition]
        numbers = [float(number) for number in re.findall(r"\d+\.?\d*", row[2])]
        assert numbers[0] == pytest.approx(band.start.speed, abs=band.start.sd)
        assert numbers[2] == pytest.approx(band.end.speed, abs=band.end.sd)
        assert row[3] == f"{3.6 * band.start.speed:.0f} – {3.6 * band.end.speed:.0f}"
        outer = racing.outer(result)
        assert row[7] == f"{outer.without} of {outer.count}"


def test_open_bands_in_words(racing):
    (band,) = racing.of(racing.settings.reference)[0].bands(30.0)
    low, high = f"{3.6 * band.start.speed:.0f}", f"{3.6 * band.end.speed:.0f}"
    for one, words in (
        ([], "-"), ([Band(band.start, None)], f"{low} – beyond 144"), ([Band(None, band.end)], f"0 – {high}"),
        ([band, Band(None, None)], f"{low} – {high}; 0 – beyond 144"),
    ):  # fmt: skip
        assert kmh_words(one, 40.0) == words
    assert bands_words([], 40.0) == "none"
    assert bands_words([Band(band.start, None)], 40.0).endswith(" – beyond 40")
    assert bands_words([Band(None, band.end)], 40.0).startswith("0 – ")


def test_worlds_are_compared_case_by_case(racing):
    rows = cells(worlds_table(racing))
    assert [row[:2] for row in rows] == [[case.name, case.condition] for case in racing.cases]
    for row, case in zip(rows, racing.cases, strict=True):
        for cell, setup in zip(row[2:], racing.settings.setups, strict=True):
            result = racing.result(setup, case)
            assert cell.endswith(f"; {result.least.damping_ratio:.3f}")
            assert cell.startswith("stable" if result.span(30.0) is None else f"{result.span(30.0).low:.1f} – ")


def test_a_case_that_could_not_be_computed_is_said_in_the_tables(racing):
    gone = racing.of(racing.settings.setups[3])[0]
    study = replace(racing, results=tuple(r for r in racing.results if r is not gone), left_out=("this: because",))
    assert cells(worlds_table(study))[0][5] == "not computed"
    assert context(study, answer(study))["left_out"] == "Left out, because it could not be computed:\n\n- this: because"
    assert context(racing, answer(racing))["left_out"] == "Nothing is left out."


def test_extrapolation_is_said_in_words(racing, heavy):
    found = context(heavy, answer(heavy))
    assert "lie outside the measured loads or pressures" in found["extrapolated"]
    assert "Tyre1 flat, rear wheel at 613 N, 3.5 bar" in found["extrapolated"]
    assert all(row[-1] == "yes" for row in cells(found["band_table"]))
    assert "a guess" not in found["extrapolated"]
    assert context(racing, answer(racing))["extrapolated"].startswith("Nothing is extrapolated: wheel loads and")
    far = replace(heavy, cases=tuple(replace(case, out_of_reach=True) for case in heavy.cases))
    assert "Of Tyre1 flat some loads or pressures are farther outside" in context(far, answer(far))["extrapolated"]


def test_what_is_the_users_is_not_called_dellortos(racing, tmp_path):
    own = own_table(tmp_path)
    words = tyre_sources(tyre_cases(small(tyres=(str(own),))).found)
    mine, others = words.split(": yours. ")
    assert mine == "Mine (synthetic) flat"
    assert "Mine" not in others
    assert others.startswith("Tyre1 flat")
    assert others.endswith("tables of Dell'Orto, Ballo, Mastinu & Gobbi.")
    assert "yours" not in tyre_sources(racing.cases)
    numbers = tyre_cases(small(contact={"cornering_stiffness": 6000.0, "relaxation_length": 0.1})).found[:1]
    assert tyre_sources(numbers) == "tyre of the model file: yours."
    packaged = tyre_cases(small(contact={"tyre": "Tyre1", "pressure_bar": 5.0})).found[:1]
    assert tyre_sources(packaged) == "Tyre1 flat: tables of Dell'Orto, Ballo, Mastinu & Gobbi."


def test_assumptions_are_named_and_what_is_given_is_not_one(racing):
    told = " ".join(assumed(racing))
    for words in (
        "Flexible front, assumed: a hinge 0.65 m", "Hands on the bar, assumed: 0.1 kg m²", "Camber stiffness 0.65 × ",
        "3 mm is one standard deviation", "No aligning moment.", "stiffness 2500 to 10000", "one rigid body",
    ):  # fmt: skip
        assert words in told
    given = replace(
        racing.settings, front=Front(4000.0, 8.0, given=True), arms=Arms(given=True),
        further={"pneumatic_trail": {"trail": 0.02}, "camber_thrust": {"camber_stiffness": 200.0}},
    )  # fmt: skip
    told = " ".join(assumed(replace(racing, settings=given)))
    assert "Flexible front, as the model file gives it: a hinge 0.65 m above the ground, 4000 N m/rad" in told
    assert "Hands on the bar, as the model file gives them" in told
    assert "pneumatic_trail as the model file gives it." in told
    assert "No aligning moment" not in told
    assert "× static" not in told
    assert "stiffness 3200 to 5000" in told


def test_other_modes_that_change_their_stability_are_told(racing):
    rows = cells(context(racing, answer(racing))["weave_table"])
    for setup in racing.settings.setups:
        crossings = [c for r in racing.of(setup) for c in r.crossings if c.mode == "weave" and c.speed <= 30]
        stable = [c.speed for c in crossings if c.direction == "stabilising"]
        (row,) = (row for row in rows if row[:3] == [setup.label, "weave", "stable"])
        told = [float(number) for number in row[3].split(" to ")]
        assert (told[0], told[-1]) == pytest.approx((min(stable), max(stable)), abs=0.00501)
        assert row[5] == f"{len(stable)} of 5"


def test_no_rider_is_claimed_for_a_bicycle_without_one(heavy):
    told = " ".join(assumed(heavy))
    assert "rider" not in told
    assert "The rear frame with whatever it carries is one rigid body." in told
