"""The tutorial from one's own bicycle to a verdict runs as it stands and says what is seen."""

import re
from pathlib import Path

import pytest
from pages import page, run_page


def test_the_page_runs_and_says_what_is_seen(no_pictures, tmp_path, monkeypatch):
    """In one process: others would derive models anew."""
    monkeypatch.setattr("studies.main_study.figures.drawings", lambda *_: [])  # looked at in tests/studies/main_study
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    monkeypatch.chdir(tmp_path)
    *_, ranked, designed = run_page(page("tutorial"))
    first = [line.split()[0] for line in ranked.splitlines() if line.startswith(("front", "IB"))]
    names = [name for name in first if not name.endswith(":")]  # not the heights below the table
    # what nobody measured before what a posture sets, IBxz: a damping of 5 to 40 N m s/rad moves wobble by 1.9 1/s
    assert names == ["front_compliance.damping", "front_compliance.stiffness", "front_compliance.joint_z"]
    share = float(re.search(r"robustness: ([\d.]+) % of 1000", designed)[1])
    assert share == pytest.approx(50, abs=10)  # "every second"
    assert Path("study/report.html").is_file()
    assert Path("ridden.png").is_file()
