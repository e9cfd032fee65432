"""How finely a dial gauge was read, as far as its readings show it."""

import numpy as np

from tyre.recordings.recording import Channel

COARSE = 0.02  # of a step, by which a reading may be off a multiple
FINEST = 5e-7  # m; no dial gauge is read more finely


def reading_step(displacement: Channel) -> float:
    """Resolution of a gauge seen in its readings: the step (m) they are all multiples of; 0 where none is visible.

    Where every reading is one step from the next, whoever pulled chose that step, and the gauge may be finer.

    Parameters
    ----------
    displacement : ndarray, shape (n,)
        Readings, m.
    """
    values = np.unique(np.round(displacement, 9))
    if values.size < 2:
        return 0.0
    step = float(np.min(np.diff(values)))
    count = values / step
    if step < FINEST or np.max(np.abs(count - np.round(count))) > COARSE:
        return 0.0
    pulled = np.abs(np.diff(displacement)) / step
    return 0.0 if np.all(np.abs(pulled - 1.0) <= COARSE) else step
