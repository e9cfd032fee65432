"""How many bicycles are computed and kept together, and by whom: often enough saved, little overhead.

What is handed out, kept and joined costs some milliseconds a part whatever is in it (`velotyre validate sweep-scale`
measures it). So where bicycles take long a part holds a thousandth of the sweep, but not less than a fifth of a second
of work nor more than ten seconds, which a kill may cost.
"""

import math
import time

from studies.sweeps.chunk import SLOW, SLOW_ITEMS, block_items, compute
from studies.sweeps.compiling import compilation_told
from studies.sweeps.engines import Engine, in_processes, in_threads
from studies.sweeps.spec import Sweep
from tyre.base.errors import InputError

LEAST_SECONDS, MOST_SECONDS = 0.2, 10.0  # of work in a part
SHARES = 1000  # parts of a sweep between
WORTH_MEASURING = 8  # blocks
WORTH_PROCESSES = 256  # bicycles: a process takes a second to start


def usual_items(sweep: Sweep) -> int:
    """Bicycles in a part where no time is measured: whole blocks, so that nothing is computed twice."""
    step = most_items(sweep)
    if slow(sweep):
        step = min(step, SLOW_ITEMS)
    return _whole_blocks(sweep, step)


def measured_items(sweep: Sweep, *, show: bool = False) -> int:
    """Bicycles in a part, from the time that the first ones of the sweep take here; ``show`` tells what is compiled."""
    block, most = block_items(sweep), most_items(sweep)
    if not slow(sweep) or sweep.items < WORTH_MEASURING * block:
        return usual_items(sweep)
    try:
        with compilation_told(show=show):
            _seconds(sweep, 1)  # derivation and compilation
        count = block
        while (taken := _seconds(sweep, count)) < LEAST_SECONDS and 2 * count <= min(most, sweep.items):
            count *= 2
    except InputError:
        return usual_items(sweep)  # which will be said where it belongs
    return _whole_blocks(sweep, chosen_items(count / taken, sweep.items, most))


def chosen_items(items_per_second: float, items: int, most: int) -> int:
    """Bicycles in a part.

    Parameters
    ----------
    items_per_second : float
        1/s.
    items, most : int
        Number of all bicycles, and of those allowed in a part.
    """
    wanted = max(items_per_second * LEAST_SECONDS, min(items_per_second * MOST_SECONDS, items / SHARES))
    return max(1, min(math.ceil(wanted), most))


def slow(sweep: Sweep) -> bool:
    """Whether bicycles are tracked one by one."""
    return any(name in SLOW for name in sweep.outputs)


def here(sweep: Sweep, workers: int) -> Engine:
    """Workers of this machine: processes where many bicycles are tracked one by one, which threads cannot share.

    Parameters
    ----------
    sweep : Sweep
    workers : int
        Their number.
    """
    if workers > 1 and slow(sweep) and sweep.items >= WORTH_PROCESSES:
        return in_processes(workers)
    return in_threads(workers)


def most_items(sweep: Sweep) -> int:
    """Bicycles that ``points_per_part`` allows in a part."""
    return max(1, sweep.points_per_part // sweep.points_per_item)


def _whole_blocks(sweep: Sweep, count: int) -> int:
    return math.ceil(count / block_items(sweep)) * block_items(sweep)


def _seconds(sweep: Sweep, count: int) -> float:
    start = time.perf_counter()
    compute(sweep, 0, count)
    return max(time.perf_counter() - start, 1e-9)
