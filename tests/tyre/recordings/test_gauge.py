"""The reading step of a gauge, and steps that are those of the pull."""

import numpy as np
import pytest

from tyre.recordings.gauge import reading_step


@pytest.mark.parametrize(
    ("readings", "step"),
    [
        ([0.0, 1e-5, 3e-5, 7e-5], 1e-5),
        ([0.0, 1.03e-5, 3.41e-5, 7.77e-5], 0.0),  # no step that all are multiples of
        ([0.0, 5e-4, 1e-3, 1.5e-3, 1e-3, 5e-4], 0.0),  # pulled in steps of half a millimetre, there and back
        ([0.0, 0.0, 5e-4, 1e-3, 1e-3, 1.5e-3], 5e-4),  # the gauge stood still where the tyre did not
        ([1e-3, 1e-3], 0.0),
    ],
)
def test_reading_step(readings, step):
    assert reading_step(np.array(readings)) == pytest.approx(step)
