"""The page on the main study runs as it stands, and the README shows the same answer."""

from pathlib import Path

import pytest
from pages import blocks, page, run_page

README = Path(__file__).parents[2] / "README.md"


@pytest.mark.usefixtures("no_pictures")
def test_the_page_runs_and_shows_what_is_seen(tmp_path, monkeypatch):
    monkeypatch.setattr("studies.main_study.figures.drawings", lambda *_: [])  # looked at in tests/studies/main_study
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    monkeypatch.chdir(tmp_path)
    shown, _ = run_page(page("main_study"))
    assert "Of 10 answers 6 are definite; measuring the front frame would make 8." in shown


def test_the_readme_shows_the_same_answer():
    (first,) = blocks(README.read_text(encoding="utf-8"), "text")
    whole, _ = blocks(page("main_study"), "text")
    assert whole.startswith(first)
