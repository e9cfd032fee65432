"""Closing in on meetings of roots: the nodes are those of plain bisection, however few calls it takes."""

from dataclasses import replace

import numpy as np
import pytest

from bicycle import load_bicycle
from bicycle.critical.critical_speeds import critical_speeds
from bicycle.eigenvalues.decomposition import decompose
from bicycle.modal import tracking
from bicycle.modal.double_roots import between, join_double_root
from bicycle.modal.matching import Nodes, link
from bicycle.modal.tracker import Tracker
from bicycle.speed_polynomial import SpeedPolynomial

BASE, SMALLEST = np.arange(0.0, 12.0, 0.3), 1e-7  # m/s


def meeting_at(speed, other=-40.0):
    """Roots -1 +- sqrt(7 / speed v - 7) and ``other``."""
    return SpeedPolynomial(
        {
            0: np.array([[-2.0, -8.0, 0], [1, 0, 0], [0, 0, other]]),
            1: np.diag([7 / speed, 0], 1)[:3, :3] * [[1], [0], [0]],
        }
    )


def counting(polynomial):
    """Nodes at asked speeds, and the numbers of speeds asked for."""
    calls = []

    def compute(speeds):
        calls.append(len(speeds))
        return Nodes(speeds, *decompose(polynomial, speeds))

    return compute, calls


def refined(polynomial, *, sparse=False):
    compute, calls = counting(polynomial)
    nodes, _, smooth = tracking.refine(compute(BASE), compute, SMALLEST, sparse=sparse)
    return nodes.v, smooth, calls


def plainly_refined(coefficients):
    """Halve every step that does not match until it does or is tiny."""
    compute, calls = counting(coefficients)
    nodes = compute(BASE)
    while True:
        a, b = nodes.take(np.arange(len(nodes.v) - 1)), nodes.take(np.arange(1, len(nodes.v)))
        _, smooth = link(a, b)
        split = ~smooth & (b.v - a.v > SMALLEST)
        if not split.any():
            return nodes.v, smooth, calls
        nodes, _ = nodes.joined(compute((a.v[split] + b.v[split]) / 2))


@pytest.mark.parametrize("speed", [7.0, 6.3 + 1e-6, 5.37, 0.31])
def test_the_nodes_are_those_of_plain_bisection(speed):
    found, smooth, calls = refined(meeting_at(speed))
    plain, plainly_smooth, many = plainly_refined(meeting_at(speed))
    np.testing.assert_array_equal(found, plain)
    np.testing.assert_array_equal(smooth, plainly_smooth)
    assert any(found[k] <= speed <= found[k + 1] for k in np.flatnonzero(~smooth))
    assert len(calls) < 8 < 20 < len(many)


@pytest.mark.parametrize("ends", [(5.1, 5.4), (5.3, 6.5), (1.0, 6.0)])
def test_a_meeting_is_foreseen_at_once_where_the_discriminant_is_straight(ends):
    asked = []

    def compute(speeds):
        asked.append(speeds.copy())
        return Nodes(speeds, *decompose(meeting_at(5.37), speeds))

    a, b = (compute(np.array([end])) for end in ends)
    between(a, b, compute, SMALLEST)
    assert asked[2] == pytest.approx([5.37], abs=1e-9)


def test_a_meeting_foreseen_at_the_wrong_speed_is_found_all_the_same():
    """Roots -1 +- sqrt(7 / 5.37 u - 7), u = 5.37 + 0.3 tanh(40 (v - 5.33)): far from the meeting Newton leaps away."""
    compute, calls = counting(meeting_at(5.37))

    def warped(speeds):
        bend = np.tanh(40 * (speeds - 5.33))
        nodes = compute(5.37 + 0.3 * bend)
        return replace(nodes, v=speeds, slopes=nodes.slopes * (12 * (1 - bend**2))[:, None])

    base = np.arange(5.0, 6.0, 0.3)
    nodes, _, smooth = tracking.refine(warped(base), warped, SMALLEST)
    (k,) = np.flatnonzero(~smooth)
    assert nodes.v[k] <= 5.33 <= nodes.v[k + 1]
    assert nodes.v[k + 1] - nodes.v[k] <= SMALLEST
    assert len(nodes.v) < 100
    foreseen, at_once = counting(meeting_at(5.37))
    tracking.refine(foreseen(base), foreseen, SMALLEST)
    assert len(calls) > len(at_once)


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


UNSURE = {
    "w": 1.11, "c": 0.0537, "lam": 0.358, "rR": 0.303, "mR": 4.18, "IRxx": 0.0786, "IRyy": 0.121, "xB": 0.32,
    "zB": -1.21, "mB": 79.6, "IBxx": 8.58, "IBzz": 2.22, "IBxz": -0.882, "xH": 0.831, "zH": -1.08, "mH": 6.07,
    "IHxx": 0.312, "IHzz": 0.118, "IHxz": -0.0993, "rF": 0.353, "mF": 1.61, "IFxx": 0.0585, "IFyy": 0.102,
}  # fmt: skip
"""A bicycle with a rider that two meetings below 1 m/s confuse, on the strange tyres below."""


def names_at(tracker, crossings):
    speeds = np.array([c.speed for c in crossings])
    ordered = tracker.ordered(speeds)
    index, labels = tracker.labels(speeds, ordered)
    branch = np.abs(ordered - 2j * np.pi * np.array([[c.frequency_hz] for c in crossings])).argmin(1)
    return [labels[case][i] for case, i in zip(index, branch, strict=True)]


def test_names_that_are_not_sure_come_from_the_full_track(tyred):
    """A wide step takes the rear tyre for wobble, and knows that it is not sure."""
    model = tyred(
        load_bicycle("rigid_rider").replace(**UNSURE),
        relaxation_length={
            "cornering_stiffness": {"rear": 30300.0, "front": 4520.0},
            "relaxation_length": {"rear": 0.656, "front": 0.0152},
        },
        pneumatic_trail={"trail": {"rear": 0.00189, "front": 0.0179}},
        steer_assist={"gain": 3.8, "fade_speed": 65.4, "lean_gain": 0.42},
    )  # fmt: skip
    crossings = critical_speeds(model)
    sparse, full = (Tracker.over(model, crossings[0].speed, 60.0, sparse=few) for few in (True, False))
    assert not sparse.sure(np.array([c.speed for c in crossings]))
    assert names_at(sparse, crossings) != names_at(full, crossings) == [c.mode for c in crossings]


def test_names_that_are_sure_are_those_of_the_full_track(tyred):
    crossings = critical_speeds(tyred())
    sparse, full = (Tracker.over(tyred(), crossings[0].speed, 60.0, sparse=few) for few in (True, False))
    assert sparse.sure(np.array([c.speed for c in crossings]))
    assert names_at(sparse, crossings) == names_at(full, crossings) == ["weave", "capsize"]


def test_names_inside_the_step_of_a_meeting_are_not_sure(tyred):
    tracker = Tracker.over(tyred(), 0.0, 10.0, sparse=True)
    (own,) = tracker.tracked
    assert (~own.smooth).any()
    middles = (own.speeds[1:] + own.speeds[:-1]) / 2
    assert [tracker.sure(np.array([v])) for v in middles[~own.smooth]] == [False] * (~own.smooth).sum()
    assert tracker.sure(middles[own.smooth][-5:])
