"""How plain weave, capsize and castering are at a speed."""

import numpy as np
import pytest

from bicycle.modal.anchor import Cores
from bicycle.modal.identity import conjugate_index


@pytest.mark.parametrize("per_second", [1.0, 60.0])
def test_a_pair_is_as_plain_as_it_is_far_from_splitting_in_any_unit_of_time(per_second):
    """-1 +- 0.2 i is nearer to the real axis than to -3 and -9: its angle to it."""
    values = per_second * np.array([[-1 + 0.2j, -1 - 0.2j, -3, -9]])
    found = Cores.of(np.array([1.5]), values, conjugate_index(values), np.ones(values.shape))
    assert found.core.tolist() == [[True, False, True, True]]
    assert found.plain == pytest.approx(0.2 / np.hypot(1, 0.2))
