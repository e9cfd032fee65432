"""Closing in on meetings of roots: the nodes are those of plain bisection, however few calls it takes."""

import numpy as np
import pytest

from bicycle.critical.critical_speeds import critical_speeds
from bicycle.eigenvalues.decomposition import decompose
from bicycle.modal import double_roots, tracking
from bicycle.modal.double_roots import join_double_root
from bicycle.modal.matching import Nodes
from bicycle.modal.naming import Naming
from bicycle.modal.tracker import Tracker
from bicycle.speed_polynomial import SpeedPolynomial

BASE = np.arange(0.0, 12.0, 0.3)


def meeting_at(speed, other=-40.0):
    """Roots -1 +- sqrt(7 / speed v - 7) and ``other``."""
    return SpeedPolynomial(
        {
            0: np.array([[-2.0, -8.0, 0], [1, 0, 0], [0, 0, other]]),
            1: np.diag([7 / speed, 0], 1)[:3, :3] * [[1], [0], [0]],
        }
    )


def refined(polynomial, sparse=False):
    calls = []

    def compute(speeds):
        calls.append(len(speeds))
        return Nodes(speeds, *decompose(polynomial, speeds))

    nodes, _, smooth = tracking.refine(compute(BASE), compute, 1e-7, sparse=sparse)
    return nodes.v, smooth, calls


@pytest.mark.parametrize("speed", [7.0, 6.3 + 1e-6, 5.37, 0.31])
def test_the_nodes_are_those_of_plain_bisection(monkeypatch, speed):
    found, smooth, calls = refined(meeting_at(speed))
    monkeypatch.setattr(tracking, "between", lambda a, b, compute, smallest: compute((a.v + b.v) / 2))
    plain, plainly_smooth, many = refined(meeting_at(speed))
    np.testing.assert_array_equal(found, plain)
    np.testing.assert_array_equal(smooth, plainly_smooth)
    assert any(found[k] <= speed <= found[k + 1] for k in np.flatnonzero(~smooth))
    assert len(calls) < 8 < 20 < len(many)


def test_a_meeting_foreseen_at_the_wrong_speed_is_found_all_the_same(monkeypatch):
    monkeypatch.setattr(double_roots, "_double_root_speeds", lambda a, b, compute: a.v + 0.1 * (b.v - a.v))
    found, smooth, _ = refined(meeting_at(5.37))
    (k,) = np.flatnonzero(~smooth)
    assert found[k] <= 5.37 <= found[k + 1]
    assert found[k + 1] - found[k] <= 1e-7
    assert len(found) < 100


def test_a_sparse_track_spans_a_meeting_where_it_is_plain_which_two_meet():
    found, smooth, _ = refined(meeting_at(5.37), sparse=True)
    assert len(found) < len(BASE) + 8
    (k,) = np.flatnonzero(~smooth)
    assert found[k] < 5.37 < found[k + 1]
    assert found[k + 1] - found[k] > 1e-3


def test_two_roots_that_meet_next_to_a_third_are_not_plain():
    ends = np.array([5.2, 5.5])

    def joined(other):
        nodes = Nodes(ends, *decompose(meeting_at(5.37, other), ends))
        return join_double_root(nodes.take(np.array([0])), nodes.take(np.array([1])), 0)

    assert joined(-1.2) is None
    below, above = joined(-40.0)
    assert len({*below}) == len({*above}) == 2


@pytest.mark.parametrize("clear", [True, False])
def test_names_that_are_not_sure_come_from_the_full_track(tyred, monkeypatch, clear):
    asked = []
    over = Tracker.over.__func__

    def noted(cls, *arguments, **options):
        asked.append(options)
        found = over(cls, *arguments, **options)
        return (
            found
            if clear
            else Tracker(found.model, found.tracked, found.meetings, Naming(**{**vars(found.naming), "clear": False}))
        )

    monkeypatch.setattr(Tracker, "over", classmethod(noted))
    assert [c.mode for c in critical_speeds(tyred())] == ["weave", "capsize"]
    assert asked == [{"sparse": True}] + ([] if clear else [{}])


def test_names_inside_the_step_of_a_meeting_are_not_sure(tyred):
    tracker = Tracker.over(tyred(), 0.0, 10.0, sparse=True)
    (own,) = tracker.tracked
    assert (~own.smooth).any()
    middles = (own.speeds[1:] + own.speeds[:-1]) / 2
    assert [tracker.sure(np.array([v])) for v in middles[~own.smooth]] == [False] * (~own.smooth).sum()
    assert tracker.sure(middles[own.smooth][-5:])
