"""What a campaign leaves behind: tables, report and figures, marked where they are synthetic."""

import json
from dataclasses import replace

import pytest

from studies.rig_campaign import report_text, save_figures, stiffness_over_load, write_campaign


@pytest.fixture(scope="module")
def results(rig_campaign, tmp_path_factory):
    out = tmp_path_factory.mktemp("out")
    return out, write_campaign(rig_campaign[0], out)


def test_report_and_figures_say_synthetic_and_name_the_routes(results):
    out, written = results
    report = (out / "report.md").read_text()
    assert "SYNTHETIC" in report
    assert "two sweep rates" in report
    assert "slip step" in report
    assert "Reported, not applied" in report
    pictures = [path for path in written if path.suffix == ".png"]
    assert {path.stem for path in pictures} == {
        "carpet_Synthetic_tyre_flat",
        "carpet_Synthetic_tyre_drum",
        "stiffness_Synthetic_tyre",
        "flat_drum_Synthetic_tyre",
        "residuals_worst_sweep",
        "pull_worst",
        "repeatability",
    }
    assert all(path.stat().st_size > 5000 for path in pictures)


def test_the_conditions_are_written_as_json_and_every_file_is_told(rig_campaign, results):
    out, written = results
    assert json.loads((out / "conditions.json").read_text()) == rig_campaign[0].as_json()
    sidecars = {path.with_suffix(".toml") for path in written if path.parent.name == "maps"}
    assert {path for path in out.rglob("*") if path.is_file()} == {*written, *sidecars}


def test_names_in_the_report_are_no_markup(rig_campaign, tmp_path):
    campaign, hostile = rig_campaign[0], "<script>alert(1)</script>"
    conditions = tuple(replace(c, tyre=f"{hostile} 2", warnings=(hostile,)) for c in campaign.conditions)
    named = replace(campaign, conditions=conditions, skipped={f"{hostile}.csv": f"no {hostile}"})
    text = report_text(named, [], [f"remark on {hostile}"], tmp_path)
    assert text.count("<script>") == 1  # in the file's name, between backticks
    assert f"- `{hostile}.csv`: no &lt;script&gt;" in text
    assert "&lt;script&gt;alert(1)&lt;/script&gt; 2 " in text
    assert "- remark on &lt;script&gt;" in text


def test_one_load_is_one_tick_and_a_name_no_formula(rig_campaign, tmp_path):
    campaign = rig_campaign[0]
    load = campaign.conditions[0].load
    one = tuple(replace(c, tyre="a$b_{1$", sweeps=(), pulls=()) for c in campaign.conditions if c.load == load)
    assert all(list(panel.get_xticks()) == [load] for panel in stiffness_over_load(one).axes)
    few = replace(campaign, conditions=one, curvature=())
    assert {path.name for path in save_figures(few, tmp_path)} >= {"stiffness_a_b__1_.png"}
