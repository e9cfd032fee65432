"""Random numbers of a sweep: a pure function of seed, parameter name and sample number.

Every parameter has a Philox stream of its own, keyed by seed and name, and sample i takes word i of it (Salmon et al.
2011, doi 10.1145/2063384.2063405). A draw thus depends neither on chunks, engines or order nor on what else
is varied.
"""

import hashlib
from typing import Any

import numpy as np
from scipy.special import ndtri

from tyre.base.arrays import Array

WORDS = 4  # 64-bit words a Philox counter gives


def uniform(*, seed: int, name: str, start: int, stop: int) -> Array:
    """Numbers (stop - start,) in the open interval (0, 1), in steps of 2**-53.

    Parameters
    ----------
    seed : int
        Of the sweep, any whole number.
    name : str
        Of the parameter: each has a stream of its own.
    start, stop : int
        Numbers of the first sample and of the one after the last.
    """
    name_key = int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "little")
    first = start // WORDS
    stream: Any = np.random.Philox(key=np.array([seed, name_key], np.uint64), counter=first)
    words = stream.random_raw(WORDS * (-(-stop // WORDS) - first))[start - WORDS * first :][: stop - start]
    return np.asarray(((words >> np.uint64(11)).astype(float) + 0.5) * 2.0**-53)


def normal(*, seed: int, name: str, start: int, stop: int) -> Array:
    """Standard normal numbers (stop - start,), the inverse distribution function of :func:`uniform`.

    Parameters
    ----------
    seed : int
        Of the sweep, any whole number.
    name : str
        Of the parameter: each has a stream of its own.
    start, stop : int
        Numbers of the first sample and of the one after the last.
    """
    return np.asarray(ndtri(uniform(seed=seed, name=name, start=start, stop=stop)))
