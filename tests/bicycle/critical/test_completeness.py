"""Where a real part that turns back between two nodes may be zero."""

import numpy as np
import pytest

from bicycle.critical.completeness import near_touches
from bicycle.modal.tracking import TrackedRange

NODES = np.array([4.0, 4.5, 6.0])


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("scale", [0.3, 40.0])
def test_a_parabola_that_dips_over_the_axis_is_zero_where_it_is_said(sign, scale):
    """sign scale ((v - 5)^2 - 0.01), 1/s, beside a root of -100."""
    values = np.stack([sign * scale * ((NODES - 5) ** 2 - 0.01), np.full(3, -100.0)], 1).astype(complex)
    slopes = np.stack([sign * scale * 2 * (NODES - 5), np.zeros(3)], 1).astype(complex)
    tracked = TrackedRange(NODES, values, slopes, np.array([True, True]), np.empty(0))
    assert near_touches(tracked, 0.0, 10.0) == pytest.approx([4.9, 5.1])
