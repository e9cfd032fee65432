"""What the speed table times of charts and designs is what it says."""

from studies.validations import _speed_of_charts as of_charts
from studies.validations import speed


def test_the_chart_has_two_boundaries_of_200_points_at_8_states(monkeypatch):
    monkeypatch.setattr(of_charts, "seconds", lambda call, repeats: 0.5)
    row = speed._chart(1)
    assert row["met"]
    found = of_charts.chart()
    assert found.plane.space.linear.order == 8
    assert {name for one in found.boundaries for name in one.names.distinct} == {"weave", "capsize"}
    monkeypatch.setattr(of_charts, "seconds", lambda call, repeats: 1.5)
    assert not speed._chart(1)["met"]


def test_no_cheaper_point_of_a_grid_keeps_the_design(monkeypatch):
    found = of_charts.design()
    kept, count = of_charts.cheaper(found)
    assert kept == 0
    assert count > 500
    monkeypatch.setattr(of_charts, "NEARER", 1.3)  # dearer points: some keep it, so that the count can tell
    monkeypatch.setattr(of_charts, "WAYS", 5)
    assert of_charts.cheaper(found)[0] > 0
    monkeypatch.setattr(of_charts, "design", lambda: found)
    monkeypatch.setattr(of_charts, "seconds", lambda call, repeats: 2.0)
    assert not speed._design(1)["met"]
    assert speed._design(1)["measured"] == "2.00 s"
