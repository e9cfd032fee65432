"""What a campaign leaves behind: tables, report and figures, marked where they are synthetic."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from read_report import read_report

from studies.rig_campaign import report_text, save_figures, stiffness_over_load, write_campaign


@pytest.fixture(scope="module")
def results(rig_campaign, tmp_path_factory):
    out = tmp_path_factory.mktemp("out")
    return out, write_campaign(rig_campaign[0], out)


def test_report_and_figures_say_synthetic_and_name_the_routes(results):
    out, written = results
    report = read_report(out)
    assert "SYNTHETIC" in report
    assert "two sweep rates" in report
    assert "slip step" in report
    assert "Reported, not applied" in report
    pictures = [path for path in written if path.suffix == ".png"]
    assert {path.stem for path in pictures} == {
        "carpet_Synthetic_tyre_flat", "carpet_Synthetic_tyre_drum", "stiffness_Synthetic_tyre",
        "flat_drum_Synthetic_tyre", "residuals_worst_sweep", "pull_worst", "repeatability",
    }  # fmt: skip
    assert all(path.stat().st_size > 5000 for path in pictures)


def test_the_conditions_are_written_as_json_and_every_file_is_told(rig_campaign, results):
    out, written = results
    assert json.loads((out / "conditions.json").read_text()) == rig_campaign[0].as_json()
    sidecars = {path.with_suffix(".toml") for path in written if path.parent.name == "maps"}
    assert {path for path in out.rglob("*") if path.is_file()} == {*written, *sidecars}


def test_the_page_shows_what_the_report_does(results):
    out, written = results
    page = (out / "report.html").read_text(encoding="utf-8")
    assert out / "report.html" in written
    pictures = re.findall(r'<img alt="[^"]+" src="([^"]+)"', page)
    assert sorted(out / name for name in pictures) == sorted(path for path in written if path.suffix == ".png")
    assert page.count("<p><img") == len(pictures)  # each scrolls by itself on a phone
    assert page.count("<table>") == read_report(out).count("|---|\n")
    assert "SYNTHETIC" in page


def test_truth_of_a_simulated_campaign_stands_beside_the_fit(rig_campaign, rig_folder, results, tmp_path):
    campaign, text = rig_campaign[0], read_report(results[0])
    truth = json.loads((rig_folder / "truth.json").read_text())["conditions"]
    table = text.split("## Comparison with the true values (synthetic)")[1].split("\n## ")[0]
    rows = [[x.strip() for x in line.strip("|").split("|")] for line in table.splitlines() if line.startswith("| ")][1:]
    assert len(rows) == 3 * len(campaign.conditions) == 3 * len(truth)
    for number, t in enumerate(sorted(truth, key=lambda t: (t["surface"] != "flat", t["load_N"]))):
        expected = (np.radians(t["cornering_stiffness_N_per_rad"]), t["lateral_stiffness_N_per_m"] / 1e3,
                    t["relaxation_length_m"] * 1e3)  # fmt: skip
        for row, true in zip(rows[3 * number : 3 * number + 3], expected, strict=True):
            value, low, high = map(float, re.findall(r"[\d.]+", row[3]))
            assert float(row[2]) == pytest.approx(true, abs=0.051)
            assert float(row[4]) == pytest.approx(100 * (value / true - 1), abs=0.06)
            assert row[5] == ("yes" if low <= true <= high else "no")
    inside = sum(row[5] == "yes" for row in rows)
    assert f"{inside} of {len(rows)} intervals contain the true value" in table
    measured = replace(campaign, conditions=tuple(replace(c, synthetic=False) for c in campaign.conditions))
    for file in ("[]", "no JSON"):
        (tmp_path / "truth.json").write_text(file)
        assert "Comparison with the true values" not in report_text(
            replace(campaign, folder=tmp_path), [], [], tmp_path
        )
    assert "Comparison with the true values" not in report_text(measured, [], [], tmp_path)


def test_each_warning_stands_once_with_the_places_it_is_about(rig_campaign, tmp_path):
    campaign = rig_campaign[0]
    conditions = []
    for number, c in enumerate(campaign.conditions):
        warnings = ["no repeats", f"{c.files[0]}: drift", f"{c.files[1]}: drift"]
        conditions.append(replace(c, warnings=(*warnings, "near another") if number < 2 else tuple(warnings)))
    text = report_text(replace(campaign, conditions=tuple(conditions)), [], [], tmp_path)
    lines = text.split("## Warnings\n\n")[1].split("\n\n")[0].splitlines()
    recordings = {file for c in conditions for file in c.files}
    drifting = {file for c in conditions for file in c.files[:2]}
    assert len(conditions) > 3
    assert lines == [
        f"- all {len(conditions)} conditions: no repeats",
        f"- {conditions[0].label}; {conditions[1].label}: near another",
        f"- {len(drifting)} of {len(recordings)} recordings (see recordings.csv): drift",
    ]


def test_names_in_the_report_are_no_markup(rig_campaign, tmp_path):
    campaign, hostile = rig_campaign[0], "<script>alert(1)</script>"
    conditions = tuple(replace(c, tyre=f"{hostile} 2", warnings=(hostile,)) for c in campaign.conditions)
    named = replace(campaign, conditions=conditions, skipped={f"{hostile}.csv": f"no {hostile}"})
    text = report_text(named, [], [f"remark on {hostile}"], tmp_path)
    assert text.count("<script>") == 1  # in the file's name, between backticks
    assert f"- `{hostile}.csv`: no &lt;script&gt;" in text
    assert "&lt;script&gt;alert(1)&lt;/script&gt; 2 " in text
    assert "- remark on &lt;script&gt;" in text


def test_one_load_is_one_tick_and_a_name_no_formula(rig_campaign, tmp_path, no_pictures):
    campaign = rig_campaign[0]
    load = campaign.conditions[0].load
    one = tuple(replace(c, tyre="a$b_{1$", sweeps=(), pulls=()) for c in campaign.conditions if c.load == load)
    assert all(list(panel.get_xticks()) == [load] for panel in stiffness_over_load(one).axes)
    few = replace(campaign, conditions=one, curvature=())
    assert {path.name for path in save_figures(few, tmp_path)} >= {"stiffness_a_b__1_.png"}
