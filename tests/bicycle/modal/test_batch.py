"""Names of many bicycles at once: those of the full track of each, whoever the neighbours are, or a reason why not."""

import importlib.util
from itertools import permutations
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_kernels import plain, put_roots

from bicycle import Model, effect_class, load_bicycle
from bicycle.eigenvalues.solvers import compiled, lapack
from bicycle.linear_model import LinearModel
from bicycle.modal import batch, stacked_batch, stacked_track
from bicycle.modal.anchor import WALKING
from bicycle.modal.batch import name_of, name_roots
from bicycle.modal.block import Block
from bicycle.modal.doubts import WHY
from bicycle.modal.matching import Roots, link_roots
from bicycle.modal.named_modes import modes
from bicycle.modal.naming import FAST
from bicycle.modal.tracking import STEP, grid

SPEEDS = np.linspace(1.0, 30.0, 30)
needs_numba = pytest.mark.skipif(not importlib.util.find_spec("numba"), reason="needs numba")
either_path = pytest.mark.parametrize("solver", [lapack, pytest.param(compiled, marks=needs_numba)])


def built(trail=0.08, mass=85.0, length=0.1, stiffness=6300.0, **effects):
    bicycle = load_bicycle("benchmark").replace(c=trail, mB=mass)
    tyre = effect_class("relaxation_length")(cornering_stiffness=stiffness, relaxation_length=length)
    others = tuple(effect_class(name)(**table) for name, table in effects.items())
    return Model(bicycle, (tyre, *others)).linear_model()


def assert_same_names(model, speeds, solver):
    """The batch is not sure, or names every root as the track does; whether it is sure."""
    found = name_roots(Block.of_models([model]), np.asarray(speeds, float)[None], solver=solver)
    judged = modes(model, speeds)
    if found.status[0]:
        return False
    size = np.abs(judged.eigenvalues).max()
    np.testing.assert_allclose(found.values[0], judged.eigenvalues, rtol=0, atol=1e-7 * size)
    assert found.anchor[0] == judged.anchor
    for k, row in enumerate(found.values[0]):
        called = [name_of(int(bits), found.names) for bits in found.bits[0, k]]
        for name in {*called, *judged.branches}:
            mine = sorted((z for z, own in zip(row, called, strict=True) if own == name and z.imag >= 0), key=abs)
            theirs = judged.branches[name][k] if name in judged.branches else np.empty(0)
            theirs = sorted(theirs[~np.isnan(theirs)], key=abs)
            assert len(mine) == len(theirs), (name, speeds[k])
            np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-6 * size)
    return True


@either_path
@settings(max_examples=25)
@given(
    trail=st.floats(0.03, 0.12), mass=st.floats(60.0, 120.0), length=st.floats(0.02, 0.4),
    stiffness=st.floats(2000.0, 20000.0),
    effects=st.sampled_from(
        [{}, {"camber_thrust": {"camber_stiffness": 400.0}}, {"steer_damper": {"damping": 3.0}}]
    ),
)  # fmt: skip
def test_names_are_those_of_the_full_track(solver, trail, mass, length, stiffness, effects):
    assert_same_names(built(trail, mass, length, stiffness, **effects), SPEEDS, solver)


@either_path
def test_a_bicycle_with_tyres_is_named(solver):
    assert assert_same_names(built(), SPEEDS, solver)
    assert assert_same_names(built(), SPEEDS[::-1] + 20.0, solver)


@either_path
def test_roots_that_change_hands_are_named(solver):
    """A soft front: castering and the rear tyre meet at 15 m/s."""
    hinge = {"stiffness": 3000.0, "damping": 15.0, "joint_x": 0.8, "joint_z": -0.85}
    model = built(front_compliance=hinge)
    assert [event.modes for event in modes(model, SPEEDS).events if event.pair == ("rear_tyre",)] != []
    assert any(assert_same_names(model, speeds, solver) for speeds in np.split(SPEEDS, 10)[5:])


@either_path
def test_no_bicycle_hangs_on_its_neighbours(solver):
    models = [built(trail) for trail in (0.05, 0.07, 0.09, 0.11)]
    speeds = np.array([SPEEDS, SPEEDS + 0.1, SPEEDS[::-1], SPEEDS + 40.0])
    together = name_roots(Block.of_models(models), speeds, solver=solver)
    assert together.unsure == {}
    for k, model in enumerate(models):
        alone = name_roots(Block.of_models([model]), speeds[k : k + 1], solver=solver)
        np.testing.assert_array_equal(alone.values[0], together.values[k])
        np.testing.assert_array_equal(alone.bits[0], together.bits[k])


@either_path
def test_speeds_that_cannot_be_tracked_are_not_answered(solver):
    found = name_roots(Block.of_models([built(), built()]), np.array([[5.0, 2000.0], [5.0, 6.0]]), solver=solver)
    assert found.status.tolist() == [12, 0]
    assert found.unsure == {"speeds that cannot be tracked": 1}
    assert all(WHY.values())


@either_path
def test_a_double_root_is_left_to_the_plain_path(synthetic, solver):
    """-1 twice at all speeds: its eigenvectors are any, or one of two, and so are the names."""
    for above in (0.0, 1.0):
        model: LinearModel = synthetic({0: [[-1.0, above, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -9.0]]})
        found = name_roots(Block.of_models([model, model]), np.tile(SPEEDS, (2, 1)), solver=solver)
        assert (found.status != 0).all()


@either_path
def test_one_that_is_not_finite_leaves_its_neighbours(solver):
    block = Block.of_models([built(), built(0.07), built()])
    block.coefficients[:, 1] = np.nan
    found = name_roots(block, np.tile(SPEEDS, (3, 1)), solver=solver)
    alone = name_roots(Block.of_models([built()]), SPEEDS[None], solver=solver)
    assert found.status[1] != 0
    assert found.status[[0, 2]].tolist() == [0, 0]
    for neighbour in (0, 2):
        np.testing.assert_array_equal(found.bits[neighbour], alone.bits[0])


def two_that_meet(shift=0.0, damping=-2):
    """-1 +- sqrt(0.01 - v) beside -3, -40 and a pair that is so damped, at v = 0 and 0.02, and their slopes."""
    still = np.array([-3, -40, damping + 9j, damping - 9j])
    first, last = (np.concatenate([-1 + gap * np.array([1, -1]), still]) for gap in (0.1, 0.1j))
    rise, later = (np.array([-1, 1, 0, 0, 0, 0]) / (2 * gap) for gap in (0.1, 0.1j))
    return first + shift, last + shift, rise, later


@pytest.mark.parametrize("damping", [-2, -1])
def test_two_roots_that_meet_are_known_in_whatever_order_the_others_come(damping):
    first, last, rise, later = two_that_meet(damping=damping)
    order = np.array([*permutations(range(6))])
    every = np.ones((len(order), 1), complex)
    a = Roots(np.zeros(len(order)), every * first, every * rise)
    match, good, meets = stacked_track._linked(a, Roots(np.full(len(order), 0.02), last[order], later[order]))
    assert good.all()
    assert meets.all()
    assert (np.take_along_axis(order, match, 1)[:, 2:] == [2, 3, 4, 5]).all()


def step(*ends, h):
    """A track of one bicycle with a step of ``h`` (m/s) between two nodes, and room for more."""
    from bicycle.modal.track_kernel import empty_track

    t = empty_track(1, 4, len(ends[0][0]))
    t.filled[0], t.order[0, :2], t.v[0, 1] = 2, [0, 1], h
    for end, (values, slopes) in enumerate(ends):
        put_roots(t, 0, end, values, slopes)
    return t


def linked(t):
    from bicycle.modal import follow_kernel

    n = t.re.shape[2]
    return plain(follow_kernel._link)(t, 0, 0, 1, np.empty((2, 5, n)), np.empty(2, np.int64))


def nodes_asked(t, unit):
    from bicycle.modal import follow_kernel

    v = np.empty(9)
    return v[: plain(follow_kernel.link_steps)(t, np.array([unit]), np.empty(9, int), v)].tolist()


@pytest.mark.parametrize("drift", [0.0, -1000.0, 1000.0])
@pytest.mark.parametrize("shift", [0.0, -40.0, 40.0])
@pytest.mark.parametrize("merge", [True, False])
@needs_numba
def test_the_kernel_knows_two_roots_that_meet_wherever_they_do(merge, shift, drift):
    """And however all roots move together (``drift``, 1/m)."""
    from bicycle.modal.track_kernel import MEETING

    first, last, rise, later = two_that_meet(shift)
    ends = [(first, rise), (last, later)] if merge else [(last, -later), (first, -rise)]
    at = [np.lexsort((values.imag, values.real)).tolist() for values, _ in ends]
    moved = [
        (values[k] + 0.02 * drift * end, slopes[k] + drift)
        for end, (k, (values, slopes)) in enumerate(zip(at, ends, strict=True))
    ]
    t = step(*moved, h=0.02)
    assert linked(t) == MEETING
    assert [at[1][t.match[0, 0, at[0].index(root)]] for root in range(6)] == [0, 1, 2, 3, 4, 5]


@pytest.mark.parametrize("moves", [[-0.5, -0.5, 0, 0, 0, 0], [0.5, 0.5, 0, 0, 0, 0], [0, 0, 0, 0, 1, 1]])
@needs_numba
def test_two_that_meet_are_expected_where_their_mean_is_heading_and_others_pass_them(moves):
    """In a step 2 wide both drift half-way to the next root, or a pair passes them with less damping."""
    from bicycle.modal.track_kernel import MEETING

    (first, last, rise, later), drift = two_that_meet(), np.array(moves)
    ends = [(first, rise / 100 + drift), (last + 2 * drift, later / 100 + drift)]
    at = [np.lexsort((values.imag, values.real)).tolist() for values, _ in ends]
    t = step(*((values[k], slopes[k]) for k, (values, slopes) in zip(at, ends, strict=True)), h=2.0)
    assert linked(t) == MEETING
    assert [at[1][t.match[0, 0, at[0].index(root)]] for root in range(6)] == [0, 1, 2, 3, 4, 5]


def clear(ends, h):
    """Whether the roots of a step are linked beyond doubt."""
    a, z = (
        Roots(np.array([v]), values[None], slopes[None]) for v, (values, slopes) in zip((0.0, h), ends, strict=True)
    )
    return bool(link_roots(a, z)[1][0])


def clear_by_kernel(ends, h):
    """The same of the kernel."""
    return linked(step(*ends, h=h)) != 0


@pytest.mark.parametrize("way", [clear, pytest.param(clear_by_kernel, marks=needs_numba)])
@pytest.mark.parametrize("roots", [[-3, -1], [-1 - 5j, -1 - 3j, -1 + 3j, -1 + 5j]])
@pytest.mark.parametrize("size", [0.01, 1.0, 100.0])
def test_a_root_is_linked_where_it_is_five_times_nearer_than_its_rival(way, roots, size):
    """The last is 2 from its neighbour and steps aside from where it is heading."""
    still, aside = np.array(roots, complex), np.array(roots, complex)
    heading = np.zeros(len(still))
    for far in (0.38, 0.42):
        aside[-1] = still[-1] + far
        aside[0] = aside[-1].conjugate() if aside.imag.any() else still[0]
        assert way([(size * still, heading), (size * aside, heading)], 0.3) is (far < 0.4)


@needs_numba
def test_a_meeting_is_taken_as_known_in_no_step_wider_than_one_of_the_full_track():
    first, last, rise, later = two_that_meet()
    at = [np.lexsort((values.imag, values.real)) for values in (first, last)]
    for steps, asked in ((0.5, []), (1, []), (2, [0.01]), (20, [0.01])):
        t = step((first[at[0]], rise[at[0]]), (last[at[1]], later[at[1]]), h=0.02)
        assert nodes_asked(t, 0.02 / STEP / steps) == asked


@needs_numba
def test_where_roots_may_meet_in_a_step_of_the_full_track_it_is_kept_where_the_step_leads():
    """Squared distance 0.6 + cos(2 pi s + 0.15): below zero for a while. Wider steps are none of the full track."""
    gap, turn = np.sqrt(0.6 + np.cos(0.15)), -2 * np.pi * np.sin(0.15)
    for unit in (0.2, 3.0):
        for steps, leads in ((0.5, 1), (1, 1), (2, 0), (8, 0)):
            h = steps * STEP * unit
            end = np.array([-gap, gap]) / 2 - 2, turn / (4 * gap) * np.array([-1, 1]) / h
            t = step(end, end, h=h)
            assert linked(t) == 1
            t.match[:] = 0
            assert nodes_asked(t, unit) == [h / 2]
            assert t.until[0, 0] == leads
            assert not leads or t.whole[0, 0].tolist() == [0, 1]


SLOTS, ENDS = [2, 0, 3, 1], np.array([1.0, 2.0, 6.0, 9.0])


def four_nodes(*, ends=ENDS, labels=((1, 2), (1, 2), (2, 1), (2, 1))):
    """Two roots -1 +- sqrt(3.3 - v) at four nodes that were computed in another order; unit of speed 3 m/s."""
    from bicycle.modal.naming_kernel import Named
    from bicycle.modal.track_kernel import SMOOTH, empty_track

    t = empty_track(1, 9, 2)
    found = Named(np.zeros((1, 9, 2), int), np.zeros((1, 9, 2), int), np.array([[0, 1]]), np.ones(1))
    t.filled[0], t.order[0, :4], t.kind[0, :4], t.v[0, SLOTS] = 4, SLOTS, SMOOTH, ends
    found.root[:], found.label[0, :4] = [0, 1], labels
    for slot, v in zip(SLOTS, ends, strict=True):
        put_roots(t, 0, slot, -1 + np.sqrt(3.3 - v + 0j) * np.array([1, -1]), np.zeros(2))
    t.two[0, SLOTS[1]] = [0, 1, 0, 1]
    return t, found


def asked_for(t, found, *speeds):
    from bicycle.modal import answer_kernel

    owner, more = np.empty(20, int), np.empty(20)
    count = plain(answer_kernel.ask_more)(t, found, np.array([speeds]), np.array([3.0]), owner, more)
    return more[:count].tolist()


@needs_numba
def test_a_wide_step_in_which_names_change_is_halved_where_a_speed_in_it_is_asked_for():
    assert asked_for(*four_nodes(), 1.5, 3.0, 3.1, 8.0) == [4.0]
    assert asked_for(*four_nodes(), 1.5, 2.0, 6.0, 8.0, np.nan) == []


@needs_numba
def test_a_step_of_the_full_track_in_which_names_change_is_not_halved():
    narrow = np.array([1.0, 2.0, 2.0 + 3.0 * STEP, 9.0])
    assert asked_for(*four_nodes(ends=narrow), 2.1) == []


@needs_numba
def test_the_meeting_of_two_modes_is_closed_in_on_by_several_halvings_at_once():
    """At 3.3 in the step from 2 to 6, whether a speed in it is asked for or not."""
    from bicycle.modal.track_kernel import MEETING

    for speed in (np.nan, 3.0):
        t, found = four_nodes(labels=((1, 2), (1, 2), (3, 3), (3, 3)))
        t.kind[0, SLOTS[1]] = MEETING
        halvings = asked_for(t, found, speed)
        assert len(halvings) > 2
        assert halvings == [4.0, 3.0, 3.5, 3.25, 3.375][: len(halvings)]


@pytest.mark.parametrize(
    ("labels", "two"),
    [
        (((1, 2), (3, 3), (3, 3), (1, 2)), False),  # one mode in the whole step, whatever lies beside it
        (((3, 3), (3, 1), (3, 3), (3, 3)), True),
        (((3, 3), (1, 3), (3, 3), (3, 3)), True),
        (((3, 3), (3, 3), (1, 3), (3, 3)), True),
        (((3, 3), (3, 3), (3, 1), (3, 3)), True),
    ],
)
@needs_numba
def test_two_roots_that_meet_are_of_two_modes_unless_all_their_names_at_both_ends_are_one(labels, two):
    from bicycle.modal import answer_kernel

    t, found = four_nodes(labels=labels)
    assert plain(answer_kernel._of_two_modes)(t, found, 0, 1) is two


def branches_of(ends, roots, *, meet=(), at=0.5):
    """Branch of each root at a place in a step of 1 m/s between nodes with these ``ends``; None where unclear."""
    from bicycle.modal import answer_kernel
    from bicycle.modal.naming_kernel import Named
    from bicycle.modal.track_kernel import MEETING, SMOOTH

    n, roots = len(roots), np.array(roots, complex)
    t = step(*ends, h=1.0)
    t.kind[0, 0], t.two[0, 0] = (MEETING, [*meet, *meet]) if meet else (SMOOTH, 0)
    found = Named(np.tile(np.arange(n), (1, 4, 1)), np.ones((1, 4, n), int), np.zeros((1, n), int), np.ones(1))
    branch = np.empty(n, int)
    sure = plain(answer_kernel._branches)(t, found, 0, 0, at, roots.real, roots.imag, np.empty((2, n)), branch)
    return branch.tolist() if sure else None


@needs_numba
def test_a_root_within_a_step_is_of_the_branch_that_leads_there_in_whatever_order_roots_come():
    """Real roots -1 - v / 2 and -3 + v / 4, and pairs."""
    ends = [(np.array([-1.0, -3.0]), np.array([-0.5, 0.25])), (np.array([-1.5, -2.75]), np.array([-0.5, 0.25]))]
    assert branches_of(ends, [-1.25, -2.875]) == [0, 1]
    assert branches_of(ends, [-2.875, -1.25]) == [1, 0]
    pairs, still = np.array([-1 + 3j, -1 - 3j, -1 + 5j, -1 - 5j]), np.zeros(4)
    assert branches_of([(pairs, still), (pairs, still)], pairs[[2, 0, 3, 1]]) == [2, 0, 3, 1]


@needs_numba
def test_two_roots_that_have_met_take_what_the_others_leave():
    """-2 +- sqrt(0.25 - v) beside -9: at 0.5 they are a pair, of one mode."""
    ends = [
        (np.array([-9, -2.5, -1.5]), np.array([0, 1, -1])),
        (np.array([-9, -2 - 0.75**0.5 * 1j, -2 + 0.75**0.5 * 1j]), np.array([0, 1j, -1j]) / (2 * 0.75**0.5)),
    ]
    pair = [-2 - 0.5j, -2 + 0.5j]
    assert branches_of(ends, [-9, *pair], meet=(1, 2)) == [0, 1, 2]
    assert branches_of(ends, [*pair, -9], meet=(1, 2)) == [1, 2, 0]


@pytest.mark.parametrize("unit", [3.0, 3.0 / (1 + 1e-9), 3.0 / (1 - 1e-9)])
@needs_numba
def test_nodes_weigh_what_the_full_track_has_for_them_from_walking_speed_to_fast(unit):
    """A step for each of its nodes in the range; rounding decides whether a node on its border is in it."""
    from bicycle.modal.naming_kernel import SAME, _weight

    steps = np.array([*range(10, 32), *range(32, 97, 8)])
    full, v = 3.0 * STEP * np.arange(10, 97), 3.0 * STEP * steps
    near = [k for k in range(len(v)) if WALKING - SAME <= v[k] / unit <= FAST + SAME]
    counted = sum(plain(_weight)(v, len(v), k, unit) for k in near)
    assert counted == pytest.approx(STEP * np.count_nonzero((full / unit >= WALKING) & (full / unit <= FAST)), rel=1e-7)


@needs_numba
def test_a_node_has_its_own_names_whatever_changes_beside_it():
    from bicycle.modal import answer_kernel

    def same(j, v):
        return plain(answer_kernel.same_labels)(*four_nodes(), 0, j, v)

    assert [same(j, v) for j, v in enumerate(ENDS[:-1])] == [same(j, v) for j, v in enumerate(ENDS[1:])] == [True] * 3
    assert [same(j, v) for j, v in enumerate((ENDS[1:] + ENDS[:-1]) / 2)] == [True, False, True]


@pytest.mark.parametrize("up", [True, False])
@pytest.mark.parametrize(
    ("nodes", "label", "meets", "expected"),
    [
        ([10, 10.5, 11, 12, 13], [1, 1, 2, 2, 2], [], [False, False, True, True]),
        ([10, 10.5, 11, 12, 13], [1, 2, 2, 2, 2], [], [False, True, True, True]),
        ([9, 10, 10.5, 10.75, 11, 12], [1, 1, 1, 1, 2, 2], [], [True, False, False, False, True]),
        ([10, 10.5, 11, 12], [1, 1, 2, 2], [1], [True, False, True]),
    ],
)
def test_names_are_settled_where_none_changes_out_to_the_end_of_a_step_of_the_full_track(
    up, nodes, label, meets, expected
):
    """Seen from the anchor: up, or mirrored; the steps of the full track end at whole numbers and where roots meet."""
    smooth = ~np.isin(np.arange(len(nodes)), meets)
    v, label = 0.3 * np.array(nodes), np.array(label)
    if not up:
        v, label, smooth = 6.0 - v[::-1], label[::-1], np.append(smooth[-2::-1], True)
    tracks = stacked_track.ManyTracks(
        np.array([0, len(v)]), v, *np.zeros((3, len(v), 1)), smooth, np.zeros(len(v), bool)
    )  # fmt: skip
    block = SimpleNamespace(unit=np.array([0.3 / STEP]))
    found = stacked_batch._settled(block, tracks, label[:, None], np.array([0.0 if up else 100.0]))
    assert found[:-1].tolist() == (expected if up else expected[::-1])
    assert not found[-1]


def test_roles_are_judged_as_the_full_track_does_whatever_nodes_there_are():
    """From walking speed to where it is fast, half a step to both sides; of two bicycles with other nodes each."""
    sparse, few = grid(0.0, 20.0, 1.0, singular=False, sparse=True), np.array([0.0, 1.0, 7.0, 9.0])
    owner = np.repeat([0, 1], [len(sparse), len(few)])
    found = stacked_batch._weight(np.concatenate([sparse, few]), owner)
    assert [found[owner == b].sum() for b in (0, 1)] == pytest.approx([FAST - WALKING + STEP] * 2)
    full = grid(0.0, 20.0, 1.0, singular=False)
    inside = (full > WALKING - STEP / 2) & (full < FAST + STEP / 2)
    np.testing.assert_allclose(stacked_batch._weight(full, np.zeros(len(full), int)), STEP * inside, atol=1e-12)


@needs_numba
def test_the_kernels_decompose_the_neighbours_of_a_matrix_that_is_not_finite():
    from bicycle.modal.compiled_batch import decompose

    block = Block.of_models([built()] * 9)
    whole = decompose(block, np.arange(9), SPEEDS[:9])
    block.coefficients[:, [3, 7]] = np.nan
    found = decompose(block, np.arange(9), SPEEDS[:9])
    good = np.delete(np.arange(9), [3, 7])
    assert np.isnan(found.doubt[[3, 7]]).all()
    for part, expected in zip(found._replace(slopes=found.slopes.swapaxes(0, 1)), whole._replace(
        slopes=whole.slopes.swapaxes(0, 1)
    ), strict=True):  # fmt: skip
        np.testing.assert_allclose(part[good], expected[good], rtol=1e-9, atol=1e-12)


def test_the_kernels_are_taken_where_they_can_be(monkeypatch):
    monkeypatch.setattr(batch, "default_solver", lambda: lapack)
    block, speeds = Block.of_models([built()]), SPEEDS[None]
    assert name_roots(block, speeds).bits.tolist() == name_roots(block, speeds, solver=lapack).bits.tolist()


def test_a_joint_name_lists_both():
    names = ("weave", "capsize", "castering")
    assert [name_of(bits, names) for bits in (1, 2, 5, 7)] == [
        "weave", "capsize", "castering+weave", "capsize+castering+weave",
    ]  # fmt: skip
