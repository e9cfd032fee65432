"""The tutorial from one's own bicycle to a verdict runs as it stands and says what is seen."""

import re
from pathlib import Path

import pytest
from page_files import page
from page_runs import run_page


def test_the_page_runs_and_says_what_is_seen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # what the figures show is tested in their rooms
    monkeypatch.setattr("os.cpu_count", lambda: 1)  # another process would derive every model again
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda self, target, **_: Path(target).touch())
    *_, ranked, designed = run_page(page("tutorial"))
    names = [line.split()[0] for line in ranked.splitlines() if line.startswith(("front", "IB"))]
    assert names == ["front_compliance.damping", "IBxz", "front_compliance.stiffness"]
    share = float(re.search(r"how sure: ([\d.]+)% of 1000", designed)[1])
    assert share == pytest.approx(50, abs=10)  # "every second"
    assert Path("study/report.html").is_file()
    assert Path("ridden.png").is_file()
