"""How far a map of a tyre reaches."""

import pytest

from tyre import TyreMap
from tyre.properties import out_of_reach


@pytest.mark.parametrize(
    ("load", "bar", "words"),
    [
        (340.0, 5.5, None),
        (190.0, 5.5, None),  # 340 - (490 - 340)
        (189.0, 5.5, "189 N is farther outside the 340-490 N at which Tyre1 on flat was measured than that range is"),
        (640.0, 11.5, None),
        (641.0, 5.5, "641 N"),
        (400.0, 11.6, "11.6 bar is farther outside the 3.5-7.5 bar"),
        (400.0, 0.1, None),  # 3.4 bar below, within 4 bar
    ],
)
def test_out_of_reach_is_farther_outside_than_the_range_is_wide(load, bar, words):
    said = out_of_reach(TyreMap.load("Tyre1"), load=load, pressure=bar * 1e5)
    assert (said is None) == (words is None)
    assert words is None or words in str(said)
