"""What a campaign leaves behind: tables, report and figures, marked where they are synthetic."""

import json

import pytest

from studies.rig_campaign.report import write_campaign


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
