"""Crossings along any number, of matrices whose roots are known."""

import numpy as np
import pytest

from bicycle.stability import branch_crossings, follow_branches


def test_every_crossing_is_found_in_neighbouring_steps_and_in_the_last():
    """Roots (x - 1.5) (x - 2.5), 4.75 - x and -9."""

    def matrices(at):
        return np.array([np.diag([(x - 1.5) * (x - 2.5), 4.75 - x, -9.0]) for x in at])

    values, roots = follow_branches(matrices, np.arange(0.0, 5.5, 1.0))
    found = branch_crossings(matrices, values, roots)
    assert [crossing.value for crossing in found] == pytest.approx([1.5, 2.5, 4.75])
    assert [crossing.destabilising for crossing in found] == [False, True, False]
    assert found[0].branch == found[1].branch != found[2].branch
