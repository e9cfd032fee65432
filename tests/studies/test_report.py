"""The report says what the numbers say, and nothing that they do not."""

import re

import numpy as np
import pytest

from bicycle.bicycle_file import load_bicycle
from studies import main_study
from studies.main_study import Change, Study, run_study
from studies.main_study_cases import Settings, tyre_cases
from studies.report import context, write_report
from studies.report_words import parts, plain_range, signed, signed_range


def small_study(bicycle: str, shares: tuple[float, ...]) -> Study:
    settings = Settings(load_bicycle(bicycle), np.linspace(0, 30, 4), camber_shares=shares, max_speed=35.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(main_study, "tyre_cases", lambda b: [c for c in tyre_cases(b) if c.name == "Tyre1 flat"])
        return run_study(settings)


@pytest.fixture(scope="module")
def racing():
    return small_study("pista_rider_drops", (0.0, 0.8))


@pytest.fixture(scope="module")
def heavy():
    return small_study("benchmark", (0.8,))


def test_words_carry_the_numbers_of_the_study(racing):
    found = context(racing)
    setup = racing.settings.setups[-1]
    lowest, highest = racing.of(setup)[0], racing.of(setup)[-1]
    line = found["summary"][0]
    (low,), (high,) = lowest.bands("wobble"), highest.bands("wobble")
    assert f"begins at {low.start.speed:.1f} instead of {high.start.speed:.1f} m/s" in line
    assert f"ends at {low.end.speed:.1f} instead of {high.end.speed:.1f} m/s" in line
    assert f"from {1e3 * highest.case.rear.relaxation_length:.0f} to " in line
    assert any("no case has an unstable wobble within 30 m/s" in words for words in found["summary"])
    assert any(words.startswith("Weave does not become unstable again up to 35 m/s") for words in found["summary"])
    assert found["extrapolated"].startswith("Nothing: both wheel loads and all pressures lie inside")
    assert "assumed" in found["setup_label"]


def test_camber_thrust_is_compared_with_none(racing, heavy):
    (rigid, flexible) = context(racing)["camber"]
    assert rigid.startswith("Rigid front, 0.8 × load changes the wobble damping ratio at 15 m/s by ")
    assert "the capsize speed by +0." in flexible
    assert context(heavy)["camber"] == []  # nothing without camber thrust to compare with


def test_extrapolation_and_missing_wobble_are_said_in_words(heavy, tmp_path):
    found = context(heavy)
    assert "lie outside the measured loads or pressures" in found["extrapolated"]
    assert "Tyre1 flat, rear wheel at 613 N, 3.5 bar" in found["extrapolated"]
    assert "wobble is stable at all these pressures" in found["summary"][0]
    assert "| yes" in found["band_table"]
    assert "| no " not in found["band_table"]
    text = write_report(heavy, tmp_path, paper_figures=[])[0].read_text(encoding="utf-8")
    assert "extrapolated beyond the measured 340-490 N" in text


def test_assumptions_are_named(racing):
    told = " ".join(context(racing)["assumed"])
    for words in ("3 mm is one standard deviation", "Camber stiffness 0.8 × static load", "flexible front", "rider"):
        assert words in told
    assert any("uncertainty of the cornering stiffness" in note for note in context(racing)["notes"])


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
        "+1.5 from the relaxation length, 0.0 from the cornering stiffness, +0.5 from both together"
    )
    assert signed(-0.0004, ".2f") == "0.00"
    assert plain_range([3.04, 2.96], ".1f") == "3.0"
    assert signed_range([-0.2, 0.1], ".1f") == "-0.2 to +0.1"
