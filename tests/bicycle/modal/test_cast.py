"""Which mode plays a role, and whether that is clear."""

import numpy as np
import pytest

from bicycle.derivation.declarations import Mode
from bicycle.modal.cast import FAINT, named_by_role
from bicycle.modal.identity import Regions


@pytest.mark.parametrize(
    ("share", "name", "clear"),
    [(0.5, "other_1", True), (0.95, "other_1", False), (1.05, "bag", False), (2.0, "bag", True)],
)
def test_a_role_played_by_about_the_least_share_is_not_clear(share, name, clear):
    """One mode at ten nodes; ``share`` is of the least one that earns a name."""
    found = Regions((((0,),),), np.zeros(10, np.intp), np.zeros(10, bool), clear=True)
    played = [Mode("bag", marks=("bag",), weight=1.0)]
    assert named_by_role(np.ones(10), np.full((10, 1, 1), share * FAINT), [""], found, played) == ([name], clear)
