"""The page on rides runs as it stands."""

from pages import page, run_page

PAGE = page("from_a_ride")


def test_the_page_runs_and_shows_what_is_seen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    _, shown = run_page(PAGE)
    assert "The bicycle turns from" in shown
