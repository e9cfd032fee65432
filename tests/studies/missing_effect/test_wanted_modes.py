"""Which eigenvalue is the measured mode: one root for each mode of a speed, whatever stands first."""

from itertools import permutations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from studies.missing_effect.motion.wanted_modes import Wanted, root_of

NAMES = ("weave", "wobble", "capsize", "castering")


@given(st.integers(1, 4), st.integers(1, 3), st.integers(1, 3), st.integers(0, 2**32 - 1))
def test_no_two_modes_of_a_speed_take_one_root_and_together_they_are_nearest(modes, repeats, speeds, seed):
    """Against all assignments, tried one by one; every repeat of a mode takes the same root."""
    rng = np.random.default_rng(seed)
    v = np.arange(1.0, speeds + 1)
    points = [(speed, name) for speed in v.tolist() for name in NAMES[:modes] for _ in range(repeats)]
    rng.shuffle(points)
    speed, names = np.array([float(s) for s, _ in points]), tuple(str(name) for _, name in points)
    near = rng.normal(size=len(points)) + 1j * rng.uniform(0.5, 3, len(points))
    values = rng.normal(size=(speeds, 5)) + 1j * rng.uniform(0.5, 3, (speeds, 5))
    found = root_of(Wanted(speed, names, near), v, values)
    for k, s in enumerate(v):
        here = {name: [i for i in range(len(points)) if speed[i] == s and names[i] == name] for name in NAMES[:modes]}
        if modes == 1:
            for i in here[NAMES[0]]:
                assert found[i] == np.abs(values[k] - near[i]).argmin()
            continue
        cost = np.array([[sum(abs(value - near[i]) for i in here[name]) for value in values[k]] for name in here])
        least = min(cost[np.arange(modes), list(roots)].sum() for roots in permutations(range(5), modes))
        taken = [{int(found[i]) for i in here[name]} for name in here]
        assert all(len(roots) == 1 for roots in taken)
        chosen = [roots.pop() for roots in taken]
        assert len(set(chosen)) == modes
        np.testing.assert_allclose(cost[np.arange(modes), chosen].sum(), least, rtol=1e-12)


def test_two_settings_of_crowds_of_different_size():
    """Three modes at one speed, two at another, one at a third."""
    speed = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 3.0])
    near = np.array([1j, 2j, 3j, 2j, 1j, 2.2j])
    names = ("a", "b", "c", "a", "b", "a")
    values = np.array([[3j, 2j, 1j], [1j, 2j, 9j], [1j, 2j, 9j]])
    assert root_of(Wanted(speed, names, near), np.array([1.0, 2.0, 3.0]), values).tolist() == [2, 1, 0, 1, 0, 1]
