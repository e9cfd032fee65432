"""The page on riders' reports has the numbers of the study."""

import json
import re
from pathlib import Path

import pytest
from pages import page

from tests.validation.what_riders_report import BANDS, judge

STUDY = json.loads((Path(__file__).parents[2] / "data/validation/what_riders_report.json").read_text(encoding="utf-8"))
PAGE = page("what_riders_report")
ROWS = {
    "former ranges": STUDY["rows"]["former"]["counts"],
    "bare structures": STUDY["rows"]["bare"]["counts"],
    "bare, the rider turns on": STUDY["rows"]["bare_turning_rider"]["counts"],
    "bare, the rider turns and": STUDY["rows"]["bare_turning_and_rolling_rider"]["counts"],
    "shipped": STUDY["rows"]["shipped"]["counts"],
}
CANDIDATES = ("roll on the saddle", "sideways on the saddle", "legs that swing", "torsion of the main frame",
              "wheel compliance", "contact length", "yaw and sideways", "yaw and legs", "yaw, roll and legs",
              "yaw and torsion", "rider, legs and torsion")  # fmt: skip
SHARES = ("off", "off_slow", "on")


def cells(start):
    """Cells of the row of a table that starts so, without their first."""
    (line,) = [line for line in PAGE.splitlines() if line.startswith(f"| {start}")]
    return [cell.strip() for cell in line.strip("|").split("|")][1:]


@pytest.mark.parametrize("start", ROWS)
def test_populations(start):
    counts = ROWS[start]
    shown = [f"{100 * counts[name]:.0f} %" for name in SHARES] + [f"{counts['onset_off_m_s']:.1f} m/s"]
    outside = set(judge({"stiff_pairs_on": 0, **counts})) - {"hertz_off", "hertz_on"}
    bold = [name in outside for name in (*SHARES, "onset_off_m_s")]
    expected = [f"**{text}**" if far else text for text, far in zip(shown, bold, strict=True)]
    assert cells(start) == [*expected, f"{counts['hertz_off']:.1f} / {counts['hertz_on']:.1f}"]


@pytest.mark.parametrize("name", CANDIDATES)
def test_candidates(name):
    assert cells(name) == [f"{100 * STUDY['others'][name][key]:.0f} %" for key in SHARES]


def test_bands():
    numbers = [float(number) for number in re.findall(r"[\d.]+", " ".join(cells("band")))]
    low, high = 100 * BANDS["off"][0], 100 * BANDS["off"][1]
    slow, on = 100 * BANDS["off_slow"][1], [100 * end for end in BANDS["on"]]
    rest = [*BANDS["onset_off_m_s"], *BANDS["hertz_off"], *BANDS["hertz_on"]]
    assert numbers == pytest.approx([low, high, slow, *on, *rest])


def test_numbers_in_sentences():
    text = " ".join(PAGE.split())
    others, shipped = STUDY["others"], STUDY["rows"]["shipped"]["counts"]
    tense = 100 * others["shipped_tense_arms"]["on"]
    assert f"{100 * shipped['on']:.0f} % wobble with relaxed arms and {tense:.0f} % with tense ones" in text
    assert f"City bicycles wobble less ({100 * others['shipped_city_bicycles']['off']:.0f} % hands off)" in text
    assert f"rises by {100 * shipped['frequency_change_on']:.0f} % (median)" in text
    seated, damped = (STUDY["knees"]["turning_and_rolling_rider"][name] for name in ("seated", "yaw damping x 2.5"))
    assert f"hands off {seated['off']:.1f} to {damped['off']:.1f}, on {seated['on']:.1f} to {damped['on']:.1f}" in text
    knees = {kind: others[f"yaw and roll, knees as {kind}"] for kind in ("damping", "stiffness")}
    rolling = STUDY["rows"]["bare_turning_and_rolling_rider"]["counts"]
    before, after, stiff = (100 * counts["off"] for counts in (rolling, knees["damping"], knees["stiffness"]))
    assert f"(hands off {before:.0f} to {after:.0f} %)" in text
    assert f"add wobble ({stiff:.0f} %)" in text
    for hands, (count, low, high, middle) in {"off": (10, 5.4, 13.4, 7.4), "on": (17, 11.1, 26.4, 15.6)}.items():
        reported = STUDY["reports"][hands]
        assert (reported["count"], reported["lowest"], reported["highest"]) == (count, low, high)
        assert f"{count} speeds: {low} to {high} m/s, median {middle}" in text
        assert reported["median"] == pytest.approx(middle, abs=0.051)


def test_the_verdicts_of_the_study():
    assert STUDY["rows"]["shipped"]["outside"] == []
    assert "off_slow" in STUDY["rows"]["former"]["outside"]
    assert all(sign["as_reported"] for base in STUDY["signs"].values() for sign in base.values())
