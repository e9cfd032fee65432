"""The page on amplitudes runs as it stands, and every option is on it."""

import pytest
from pages import missing_options, page, run_page

PAGE = page("amplitude")


@pytest.mark.usefixtures("no_pictures")
def test_the_page_runs_and_shows_what_is_seen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (shown,) = run_page(PAGE)
    assert "not determined" in shown


def test_every_option_is_on_the_page():
    assert set(missing_options("amplitude", PAGE)) <= {"--json", "--max-speed"}
