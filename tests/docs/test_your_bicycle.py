"""The tutorial from one's own bicycle to a verdict runs as it stands and says what is seen.

What the page does not speak of is left out of its study: the packaged tyres beside the one in question, and all but the
first figure. Both are looked at in tests/studies/main_study.
"""

import re
from pathlib import Path

import pytest
from page_files import page
from page_runs import run_page

from studies.main_study import output


@pytest.fixture
def only_what_is_said(monkeypatch):
    """A study of the tyre in question with its first figure, in one process: others would derive the models anew."""
    drawings = output.drawings
    monkeypatch.setattr(output, "drawings", lambda *given: drawings(*given)[:1])
    monkeypatch.setattr(output, "paper_stems", lambda folder: [])
    monkeypatch.setattr("studies.main_study.cases.available_tyres", dict)
    monkeypatch.setattr("os.cpu_count", lambda: 1)


def test_the_page_runs_and_says_what_is_seen(only_what_is_said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    *_, ranked, designed = run_page(page("tutorial"))
    names = [line.split()[0] for line in ranked.splitlines() if line.startswith(("front", "IB"))]
    assert names == ["front_compliance.damping", "IBxz", "front_compliance.stiffness"]
    share = float(re.search(r"how sure: ([\d.]+)% of 1000", designed)[1])
    assert share == pytest.approx(50, abs=10)  # "every second"
    assert Path("study/report.html").is_file()
    assert Path("ridden.png").is_file()
