"""What to advise where samples do not come at even steps: a rate that fits them, and whether resampling mends it."""

import numpy as np

from tyre.base.arrays import Array
from tyre.channels.clock import GAP


def usual_rate(time: Array) -> float:
    """Samples per s that even steps would have, dropped samples and gaps aside, Hz; of ``time``, s, shape (n,), n > 1.

    The mean of the usual steps: the median alone is that of stamps, which may be rounded.
    """
    steps = np.diff(time)
    usual = float(np.median(steps))
    near = steps[np.abs(steps - usual) <= 0.5 * usual]
    return 1 / float(near.mean() if near.size else usual)


def how_to(*times: Array) -> str:
    """What to write for even steps, with the rate of the fastest of ``times`` (s, each of shape (n,))."""
    rate = max((usual_rate(time) for time in times if time.size > 1), default=0.0)
    return f"write [resampling] with rate_hz = {f'{rate:.4g}' if rate else '...'} (linear interpolation)"


def fills(time: Array, *values: Array) -> bool:
    """Whether resampling leaves no sample of ``values`` at ``time`` (s), all of shape (n,), missing: no gap, no end."""
    known = [time[np.isfinite(x)] for x in values]
    if any(t.size < 2 or t[0] > time[0] or t[-1] < time[-1] for t in known):
        return False
    return max(float(np.diff(t).max()) for t in known) <= GAP * float(np.median(np.diff(time)))
