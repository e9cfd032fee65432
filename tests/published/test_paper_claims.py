"""The audit of the paper: verdicts and numbers worked out by hand from its tables."""

from dataclasses import replace
from typing import Any

import pytest

from tests.published.paper_claims import as_markdown, audit, judge_all, judge_number, load_tables


@pytest.fixture(scope="module")
def found() -> dict[str, dict[str, Any]]:
    return {record["name"]: record for record in audit()}


@pytest.mark.parametrize(("name", "verdict", "key", "value", "tolerance"), [
    ("cornering stiffness flat over drum", "holds", "mean_percent", 15.3, 0.05),
    ("relaxation length flat over drum", "holds", "mean_percent", 15.3, 0.05),
    ("relaxation length flat over drum at 7 5 bar", "fails", "mean_percent", 20.0, 0.05),
    ("relaxation length flat over drum at 7 5 bar", "fails", "at_3_5_bar_percent", 11.9, 0.05),
    ("almost doubled", "partly", "factor", [1.705, 1.713, 1.585, 1.935, 1.729, 1.704], 0.0005),
    ("direction of the doubling", "fails", "change_percent", [-41.34, -41.63, -36.91, -48.31, -42.16, -41.33], 0.005),
    ("mean difference of tyre3 and tyre2", "holds", "mean_N_per_deg", 7.9, 0.05),
    ("mean ratio of tyre3 and tyre2", "fails", "mean_percent", 8.1, 0.05),
    ("lowest relaxation length", "fails", "lowest_mm", [61.3, 78.6, 81.7], 1e-9),
    ("lowest relaxation length", "fails", "claimed_place_mm", 82.1, 1e-9),
    ("tyre1 lateral stiffness over load at 7 5 bar", "fails", "common_N_per_mm", [45.0, 60.4, 75.2], 0.05),
    ("tyre2 lateral stiffness from 340 to 400 newton", "fails", "rise_percent", 29.1, 0.05),
    ("lateral stiffness of tyre2 against tyre1 at 7 5 bar", "holds", "mean_percent", -26.7, 0.05),
    ("drum cornering stiffness at 3 5 against 7 5 bar", "holds", "change_percent", 15.65, 0.005),
    ("shift of tyre2 at 7 5 bar", "partly", "mean_percent", 14.8, 0.05),
    ("peak of tyre2 at 3 5 bar", "holds", "change_percent", 24.8, 0.05),
    ("explanation by slip between layers", "fails", "step_mm", [8.8, 26.8, 30.3, 20.0], 1e-9),
    ("load missing in equation 5", "fails", "stiffness_N_per_rad", 6033.2, 0.05),
    ("share of the steady force", "holds", "share_percent", 63.2, 0.05),
    ("exponent of equation 2", "fails", "corrected_share_percent", 63.2, 0.05),
    ("time divided by speed", "fails", "time_times_speed_mm", 134.0, 1e-9),
])  # fmt: skip
def test_numbers_of_the_claims(
    found: dict[str, dict[str, Any]], name: str, verdict: str, key: str, value: Any, tolerance: float
) -> None:
    assert found[name]["verdict"] == verdict
    assert found[name]["values"][key] == pytest.approx(value, abs=tolerance)


@pytest.mark.parametrize(("name", "verdict", "words"), [
    ("direction of pressure dependence", "holds", "12 of 12"),
    ("relaxation length at 7 5 against 5 5 bar", "partly", "4 of 6"),
    ("cornering stiffness of tyre1 against tyre2", "partly", "8 of 9"),
    ("cornering stiffness of tyre3 against tyre2", "holds", "9 of 9"),
    ("lateral stiffness of tyre2 against tyre3", "partly", "8 of 9"),
    ("relaxation length over load", "partly", "20 of 24"),
    ("caption of table 7", "fails", "off with table 2 28.22 %"),
    ("range of r squared", "fails", "r squared -11.81"),
])  # fmt: skip
def test_words_of_the_claims(found: dict[str, dict[str, Any]], name: str, verdict: str, words: str) -> None:
    assert found[name]["verdict"] == verdict
    assert words in found[name]["computed"]


def test_rule_of_the_verdicts() -> None:
    assert [judge_number(value, 15) for value in (15.3, 17.5, 18.7, 20.0)] == ["holds", "holds", "partly", "fails"]
    assert [judge_number(value, 24) for value in (24.8, 29.9, 30.1)] == ["holds", "partly", "fails"]
    assert [judge_all(flags) for flags in ([True, True], [True, False], [False])] == ["holds", "partly", "fails"]


def test_verdicts_follow_the_tables() -> None:
    """With the flat track's stiffness also on the drum there is no difference left to claim."""
    tables = load_tables()
    changed = replace(tables, drum=tables.tyre1)
    records = audit(changed)
    verdicts = {record["name"]: record["verdict"] for record in records}
    assert not any(record["remark"] for record in records)  # the remarks are on the printed numbers
    assert verdicts["cornering stiffness flat over drum"] == "fails"
    assert verdicts["relaxation length is lower on the drum"] == "fails"
    assert verdicts["caption of table 7"] == "fails"
    assert verdicts["mean difference of tyre3 and tyre2"] == "holds"


def test_the_page_has_a_row_for_each_claim(found: dict[str, dict[str, Any]]) -> None:
    page = as_markdown(list(found.values()))
    assert len(found) == 57
    assert page.count("\n|") == len(found) + 2
    assert "57 claims: " in page
