"""Critical speeds of one bicycle by the kernels: the same; where they are not sure or not there, by the plain path."""

import numpy as np
import pytest
import wobble_onsets
from plain_kernels import plain, put_roots

from bicycle.critical import critical_speeds as module
from bicycle.critical.critical_speeds import critical_speeds
from bicycle.critical.pencil import crossings_by_pencil
from bicycle.eigenvalues.solvers import lapack
from tyre.base.errors import InputError

COMPLIANCE = wobble_onsets.COMPLIANCE
TYRE = {"cornering_stiffness": 6300.0, "relaxation_length": 0.1}


def needs_numba():
    pytest.importorskip("numba")


def test_a_step_crosses_beyond_doubt_where_its_cubic_does_by_more_than_its_ends_miss_each_other():
    """Cubics that are known in all of a step, of any size: their values, and slopes of one sign and steep."""
    needs_numba()
    from bicycle.critical.crossing_kernel import NONE, ONE, PERHAPS, STRAIGHT, _one

    rng, s, seen = np.random.default_rng(7), np.linspace(0, 1, 2001), []
    for _ in range(1500):
        size = 10.0 ** rng.uniform(-3, 3)
        level, slope, square, cube = size * rng.normal(size=4) * [2, 3, 1, 0.6]
        values, slopes = level + s * (slope + s * (square + s * cube)), slope + s * (2 * square + 3 * s * cube)
        half = level + slope / 2, values[-1] - slopes[-1] / 2  # what each end foretells for the middle
        doubt = abs(half[0] - half[1])
        away, straight = abs(values).min() - doubt, abs(slopes).min() - STRAIGHT * doubt
        turns, rises = values.min() < 0 < values.max(), slopes.min() < 0 < slopes.max()
        if min(abs(away), abs(straight)) < 1e-4 * size:
            continue  # too near to tell by these places
        expected = PERHAPS
        if away > 0 and not turns:
            expected = NONE
        elif straight > 0 and not rises:
            expected = ONE if values[0] * values[-1] < 0 else NONE
        assert plain(_one)(values[0], values[-1], slopes[0], slopes[-1], 0.0, 0) == expected
        seen.append(expected)
    assert min(seen.count(kind) for kind in (NONE, ONE, PERHAPS)) > 50


@pytest.mark.parametrize("half", [0.5, 0.9])
@pytest.mark.parametrize("mean", [-1.0, 1.0])
@pytest.mark.parametrize("split", [True, False])
def test_a_step_with_a_meeting_is_divided_where_one_of_the_two_roots_may_be_zero(mean, half, split):
    """Two real roots about ``mean``, so far to both sides, meet half-way: what if their distance swelled by a fifth."""
    needs_numba()
    from bicycle.critical.crossing_kernel import divide
    from bicycle.modal.track_kernel import MEETING, empty_track

    t = empty_track(1, 3, 2)
    t.filled[0], t.order[0], t.kind[0, 0], t.match[0, 0] = 2, [0, 1, 2], MEETING, [0, 1]
    t.v[0, :2] = 3.0, 4.0
    ends = [half * np.array([-1, 1]), half * np.array([-1j, 1j])]  # roots of half^2 (1 - 2 s)
    for end, values in enumerate(ends[::-1] if split else ends):
        put_roots(t, 0, end, mean + values, (1 if split else -1) * half**2 / values)
    t.two[0, 0] = [1, 0, 1, 0]
    owner, v = np.zeros(3, int), np.zeros(3)
    one = np.ones(1)
    assert plain(divide)(t, one, 0.0 * one, 10.0 * one, owner, v) == (1 if half * 1.2 > abs(mean) else 0)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("at", "other"), [(0.99, 1.02), (0.9, 1.3), (0.3, 1.75), (0.01, -0.02), (0.99, -4.0)])
def test_a_crossing_begins_where_the_cubic_of_its_step_is_zero_whatever_it_does_beyond(at, other, sign):
    """A real root sign (s - at) (s - other) for s = v - 3, of which only the first zero lies in the step."""
    needs_numba()
    from bicycle.critical.crossing_kernel import crossings
    from bicycle.modal.track_kernel import SMOOTH, empty_track

    t = empty_track(1, 2, 2)
    t.filled[0], t.order[0], t.kind[0, 0], t.match[0, 0], t.v[0] = 2, [0, 1], SMOOTH, [0, 1], [3.0, 4.0]
    for end, s in enumerate((0.0, 1.0)):
        values = np.array([-9.0, sign * (s - at) * (s - other)], complex)
        put_roots(t, 0, end, values, np.array([0.0, sign * (2 * s - at - other)]))
    owner, place, root, start = *np.zeros((3, 2), int), np.zeros((3, 2))
    assert plain(crossings)(t, np.zeros(1), np.full(1, 9.0), owner, place, root, start) == 1
    assert (owner[0], place[0], root[0]) == (0, 0, 1)
    assert start[:, 0] == pytest.approx([3.0 + at, 0.0, 0.0], abs=1e-9)


@pytest.fixture
def judged(monkeypatch):
    """The speeds up to which the plain path was asked."""
    asked = []

    def by_pencil(model, max_speed):
        asked.append(max_speed)
        return crossings_by_pencil(model, max_speed)

    monkeypatch.setattr(module, "crossings_by_pencil", by_pencil)
    return asked


@pytest.mark.parametrize("bicycle", ["benchmark", "pista_rider", "browser"])
@pytest.mark.parametrize(
    "effects", [{}, {"relaxation_length": TYRE}, {"relaxation_length": TYRE, "front_compliance": COMPLIANCE}]
)
@pytest.mark.parametrize("max_speed", [4.5, 60.0])
def test_it_is_the_same(tyred, judged, bicycle, effects, max_speed):
    needs_numba()
    model = tyred(bicycle, **effects)
    found, plain = critical_speeds(model, max_speed, fast=True), crossings_by_pencil(model, max_speed)
    assert judged == []
    assert [(c.mode, c.kind, c.direction) for c in found] == [(c.mode, c.kind, c.direction) for c in plain]
    np.testing.assert_allclose([c.speed for c in found], [c.speed for c in plain], rtol=0, atol=1e-9)
    np.testing.assert_allclose([c.frequency_hz for c in found], [c.frequency_hz for c in plain], rtol=0, atol=1e-8)


def test_one_of_which_they_are_not_sure_is_judged(synthetic, judged):
    """Roots 0 and -20 at all speeds, and v - 7."""
    needs_numba()
    model = synthetic({0: np.diag([0.0, -7.0, -20.0]), 1: np.diag([0.0, 1.0, 0.0])})
    assert [c.speed for c in critical_speeds(model, 20.0, fast=True)] == [pytest.approx(7.0)]
    assert judged == [20.0]


def test_one_whose_equations_switch_is_judged(synthetic, judged):
    """Root v - 3 below 5 m/s and v - 4 above."""
    needs_numba()
    below, above = ({0: np.diag([-far, -20.0]), 1: np.diag([1.0, 0.0])} for far in (3.0, 4.0))
    found = critical_speeds(synthetic(below, above, borders=(5.0,)), 20.0, fast=True)
    assert [c.speed for c in found] == [pytest.approx(3.0)]
    assert judged == [20.0]


def test_where_no_kernel_can_be_kept_it_is_judged(tyred, judged, monkeypatch):
    """As in a zipped wheel."""
    needs_numba()
    monkeypatch.setattr(module, "default_solver", lambda: lapack)
    assert critical_speeds(tyred(), 10.0, fast=True) == crossings_by_pencil(tyred(), 10.0)
    assert judged == [10.0]


def test_nothing_is_critical_next_to_rest(tyred):
    needs_numba()
    assert critical_speeds(tyred(), 1e-9, fast=True) == ()


def test_too_fast_is_refused_alike(tyred):
    needs_numba()
    with pytest.raises(InputError, match="max_speed = 1e\\+06 m/s is not allowed"):
        critical_speeds(tyred(), 1e6, fast=True)


@pytest.mark.parametrize("law", ["relaxation_length", "side_slip"])
@pytest.mark.parametrize("stiffness", [1e25, 1e100, 1e300])
def test_a_model_too_stiff_is_refused_alike(tyred, law, stiffness):
    """The kernels meet roots that are not finite."""
    needs_numba()
    length = {"relaxation_length": 0.12} if law == "relaxation_length" else {}
    model = tyred(**{law: {"cornering_stiffness": stiffness} | length})
    with pytest.raises(InputError, match="too stiff to be computed: its fastest root is"):
        critical_speeds(model, fast=True)


def test_without_numba_it_is_said_what_to_install(tyred, monkeypatch):
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    with pytest.raises(InputError, match="numba is not installed; install it with: .*fast"):
        critical_speeds(tyred(), fast=True)
