"""The report says what the numbers say, and nothing that they do not."""

import re
from dataclasses import replace
from decimal import Decimal

import numpy as np
import pytest

from bicycle.bicycle_file import load_bicycle
from studies.main_study import study as main_study
from studies.main_study.cases import Settings, tyre_cases
from studies.main_study.checks import Check
from studies.main_study.report import context, write_report
from studies.main_study.report_checks import check_words
from studies.main_study.report_numbers import plain_range, shown_like, signed, signed_range, with_sd
from studies.main_study.report_words import label, parts, printed, summary
from studies.main_study.solve import Crossing, Uncertain
from studies.main_study.study import CRITICAL, Change, Study, run_study
from studies.uncertainty.quantity import Quantity

NUMBER = re.compile(r"[-+]?\d+\.\d+")


def small_study(bicycle: str, shares: tuple[float, ...]) -> Study:
    settings = Settings(load_bicycle(bicycle), np.linspace(0, 30, 4), camber_shares=shares, max_speed=35.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(main_study, "tyre_cases", lambda b, files: [c for c in tyre_cases(b) if c.name == "Tyre1 flat"])
        return run_study(settings)


@pytest.fixture(scope="module")
def racing():
    return small_study("pista_rider_drops", (0.0, 0.8))


@pytest.fixture(scope="module")
def heavy():
    return small_study("benchmark", (0.8,))


def lines_of(study: Study, setup) -> list[str]:
    (found,) = (group.lines for group in summary(study) if group.label == label(setup))
    return found


def test_words_carry_the_numbers_of_the_study(racing):
    found = context(racing)
    setup = racing.settings.setups[-1]
    lowest, highest = racing.of(setup)[0], racing.of(setup)[-1]
    (line,) = (words for words in lines_of(racing, setup) if words.startswith("Tyre1 flat, from 7.5 to 3.5 bar"))
    (low,), (high,) = lowest.bands("wobble"), highest.bands("wobble")
    assert f"begins at {low.start.speed:.2f} instead of {high.start.speed:.2f} m/s" in line
    assert f"ends at {low.end.speed:.2f} instead of {high.end.speed:.2f} m/s" in line
    assert f"from {1e3 * highest.case.rear.relaxation_length:.0f} to " in found["tyre_changes"][0]
    rigid = lines_of(racing, racing.settings.setups[0])
    assert "Wobble is not unstable at any speed up to 35 m/s, in any of 3 cases." in rigid
    assert "Weave becomes unstable at no speed up to 35 m/s, in any of 3 cases." in rigid
    assert found["extrapolated"].startswith("Nothing: both wheel loads and all pressures lie inside")
    assert "assumed" in found["setup_label"]


def test_every_claim_of_the_summary_stands_under_its_setup(racing, tmp_path):
    text = write_report(racing, tmp_path, paper_figures=[])[0].read_text(encoding="utf-8")
    section = text.split("## What the measured relaxation length does\n")[1].split("\n## ")[0]
    before, *groups = section.split("\n### ")
    assert [group.split("\n")[0] for group in groups] == [
        "Flexible front (assumed), camber thrust 0.8 × load (assumed)", "Rigid front, no camber thrust",
        "Rigid front, camber thrust 0.8 × load (assumed)", "Flexible front (assumed), no camber thrust",
    ]  # fmt: skip
    assert not re.search("wobble|weave|damping", before, re.IGNORECASE)
    assert all(
        re.search(r"^- Wobble is .*^- Weave becomes stable", group, re.DOTALL | re.MULTILINE) for group in groups
    )


def test_ranges_of_a_setup_contain_exactly_its_own_critical_speeds(racing, heavy):
    for study in (racing, heavy):
        for setup in study.settings.setups:
            for direction, word in (("stabilising", "stable"), ("destabilising", "unstable")):
                (line,) = (x for x in lines_of(study, setup) if x.startswith(f"Weave becomes {word} "))
                crossings = [c for r in study.of(setup) for c in r.crossings if c.mode == "weave"]
                speeds = [c.speed for c in crossings if c.direction == direction]
                if not speeds:
                    assert "at no speed up to 35 m/s" in line
                    continue
                told = [float(number) for number in NUMBER.findall(line)]
                assert (told[0], told[-1]) == pytest.approx((min(speeds), max(speeds)), abs=0.00501)
                assert f"in {len(speeds)} of 3 cases" in line


def test_onset_and_no_unstable_wobble_are_claims_of_different_setups(heavy):
    rigid, flexible = heavy.settings.setups
    onset = min(c.speed for r in heavy.of(rigid) for c in r.crossings if c.mode == "wobble")
    assert any(f"the lowest onset is {onset:.1f} m/s (Tyre1 flat, 3.5 bar)" in line for line in lines_of(heavy, rigid))
    told = " ".join(lines_of(heavy, flexible))
    assert "Wobble is not unstable at any speed up to 35 m/s, in any of 3 cases." in told
    assert "onset" not in told


def test_changes_name_both_pressures(racing):
    for group in summary(racing):
        for line in group.lines:
            if re.search("shifts by|changes by|instead of", line):
                assert "rom 7.5 to 3.5 bar" in line


def test_another_mode_that_becomes_unstable_is_not_passed_over(racing):
    setup = racing.settings.setups[0]
    found = Crossing("castering+rear_tyre", "oscillatory", "destabilising", 21.3, 0.1, 0.1, 2.0)
    first, *rest = racing.results
    study = replace(racing, results=(replace(first, crossings=(*first.crossings, found)), *rest))
    assert any("The mode castering+rear tyre becomes unstable at 21.30 m/s" in line for line in lines_of(study, setup))


def test_printed_decomposition_adds_up(racing):
    found = context(racing)
    rows = 0
    for table in (found["critical_parts"], found["damping_parts"]):
        for line in table.splitlines()[2:]:
            before, after, total, *shares = (Decimal(cell.strip()) for cell in line.split("|")[4:-1])
            assert total == after - before
            assert total == sum(shares)
            assert len(shares) == 3
            rows += 1
    assert rows == 6  # two edges of the band, weave and capsize speed; two damping ratios


@pytest.mark.parametrize(("before", "after"), [(4.2951, 4.2949), (4.2961, 4.2949), (0.12345, -0.12345)])
def test_rounding_keeps_sums(before, after):
    change = Change("weave stable above", CRITICAL, before, after, -0.00049, 0.0015)
    for digits in (2, 3, 5):
        p = printed(change, digits)
        assert p.total == p.after - p.before == p.length + p.stiffness + p.interaction
        assert float(p.before) == pytest.approx(before, abs=0.5001 * 10.0**-digits)
        assert float(p.interaction) == pytest.approx(change.interaction, abs=2.001 * 10.0**-digits)


def test_no_rider_is_claimed_for_a_bicycle_without_one(heavy, tmp_path):
    settings = replace(heavy.settings, bicycle=load_bicycle("fisher"))  # the numbers do not matter for these words
    study = replace(heavy, settings=settings)
    text = write_report(study, tmp_path, paper_figures=[])[0].read_text(encoding="utf-8")
    assert "no rider" in settings.bicycle.description
    assert "rider" not in text.replace(settings.bicycle.description, "")
    assert "rigid rear frame with\nwhatever it carries" in text


def test_camber_thrust_is_compared_with_none(racing, heavy):
    (rigid, flexible) = context(racing)["camber"]
    assert rigid.startswith("Rigid front, 0.8 × load changes the wobble damping ratio at 15 m/s by ")
    assert "the capsize speed by +0." in flexible
    assert context(heavy)["camber"] == []  # nothing without camber thrust to compare with


def test_extrapolation_and_missing_wobble_are_said_in_words(heavy, tmp_path):
    found = context(heavy)
    assert "lie outside the measured loads or pressures" in found["extrapolated"]
    assert "Tyre1 flat, rear wheel at 613 N, 3.5 bar" in found["extrapolated"]
    assert "| yes" in found["band_table"]
    assert "| no " not in found["band_table"]
    text = write_report(heavy, tmp_path, paper_figures=[])[0].read_text(encoding="utf-8")
    assert "extrapolated beyond the measured 340-490 N" in text


def test_assumptions_are_named(racing):
    told = " ".join(context(racing)["assumed"])
    camber = "Camber stiffness 0.8 × static load"
    for words in ("3 mm is one standard deviation", camber, "flexible front", "nothing holds the handlebar"):
        assert words in told
    assert any("uncertainty of the cornering stiffness" in note for note in context(racing)["notes"])


def quantity(samples) -> Quantity:
    return Quantity("wobble stable above", "m/s", 20.0, np.array([0.6, 0.8]), {}, np.array(samples))


def test_linear_and_monte_carlo_are_compared_in_words(racing):
    """Two draws a apart have the sd a / sqrt(2); the linear one is 1."""
    result = racing.checks[0].result
    near, wide = (quantity([20.0, 20.0 + a * np.sqrt(2)]) for a in (1.01, 1.2))
    lost = quantity([20.0, 20.0 + np.sqrt(2), np.nan])
    told = check_words(replace(racing, checks=(Check(result, (near, wide, lost)),)))
    assert "In 1 of 3 rows the two standard deviations agree within 5 % (that of the draws is larger by +1.0 %)" in told
    assert "They differ for Tyre1 flat, " in told
    assert "wobble stable above by +20.0 %; Tyre1 flat" in told
    assert "wobble stable above by 0.0 %, lost in 1 draws" in told
    assert "They differ" not in check_words(replace(racing, checks=(Check(result, (near,)),)))
    assert "rows" not in check_words(replace(racing, checks=()))


def test_what_the_bands_are_of_is_said(racing, tmp_path):
    def text_with(sd):
        settings = replace(racing.settings, bicycle=replace(racing.settings.bicycle, sd=sd))
        return write_report(replace(racing, settings=settings), tmp_path, paper_figures=[])[0].read_text(
            encoding="utf-8"
        )

    plain = text_with({})
    assert "± is one standard deviation of the tyre data." in plain
    assert "every ± and every band is of the tyre data alone" in " ".join(plain.split())
    text = text_with({"c": 0.001, "w": 0.0})
    assert "± is one standard deviation of tyre data and bicycle parameters." in text
    assert "standard deviations of c, taken as independent; w, lam, g, " in text


def test_numbers_have_the_digits_of_their_sd():
    assert with_sd(Uncertain(24.8083, 0.8797, 0.8797)) == "24.8 ± 0.9"
    assert with_sd(Uncertain(24.8083, 1.24, 0.8797)) == "24.8 ± 1.2 (tyre 0.9)"
    assert with_sd(Uncertain(4.90574, 0.000253, 0.000253)) == "4.9057 ± 0.0003"
    assert with_sd(Uncertain(-0.0773, 0.00096, 0.00096)) == "-0.0773 ± 0.0010"
    assert shown_like(38.84, 30.0) == "39"
    assert shown_like(38.84, 0.0) == "38.84"


def test_both_forms_are_written_with_their_figures(racing, tmp_path):
    markdown_file, html_file = write_report(racing, tmp_path, paper_figures=["paper_fig01"])
    text, page = markdown_file.read_text(encoding="utf-8"), html_file.read_text(encoding="utf-8")
    assert "{{" not in text
    assert "nan" not in text
    assert page.count("<table>") == text.count("|\n\n") >= 4
    shown = re.findall(r"!\[[^]]*\]\(([^)]*)\)", text)
    assert {"headline.png", "wobble_bands.png", "eigenvalues_4.png", "paper_fig01.png"} < set(shown)
    assert all(f'src="{name}"' in page for name in shown)


def test_small_words():
    change = Change("wobble stable above", "critical_speed_m_s", 20.0, 22.0, -0.04, 1.5)
    assert parts(change) == (
        "+1.50 from the relaxation length, -0.04 from the cornering stiffness, +0.54 from both together"
    )
    assert signed(-0.0004, ".2f") == "0.00"
    assert plain_range([3.04, 2.96], ".1f") == "3.0"
    assert signed_range([-0.2, 0.1], ".1f") == "-0.2 to +0.1"
