"""Why parameter sets are no physical bicycle, for many of them at once."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.effect import WHEELS
from bicycle.parameters import BOUNDS, POSITIVE, UNITS, bodies, static_loads

Reasons = dict[str, NDArray[np.bool_]]


def impossible_bicycles(p: Mapping[str, Any]) -> Reasons:
    """Conditions that some of the bicycles break, in words -> which ones do.

    Parameters
    ----------
    p : mapping
        Every key of :data:`bicycle.parameters.UNITS`, numbers or arrays that broadcast to (m,), SI.

    Returns
    -------
    dict
        Arrays of the common shape; empty where all are possible. The same conditions as those of
        :class:`bicycle.parameters.Bicycle`, without that of the mass matrix.
    """
    with np.errstate(all="ignore"):
        broken: dict[str, Any] = {"a number that is not finite": ~np.isfinite(sum(np.abs(p[key]) for key in UNITS))}
        for key, (low, high) in BOUNDS.items():
            value, strict = np.asarray(p[key]), key in POSITIVE or key == "lam"
            if np.isfinite(low):
                broken[f"{key} {'<=' if strict else '<'} {low:.4g}"] = value <= low if strict else value < low
            if np.isfinite(high):
                broken[f"{key} >= {high:.4g}"] = value >= high
        for part in "BH":
            xx, zz, xz = (p[f"I{part}{axes}"] for axes in ("xx", "zz", "xz"))
            broken[f"I{part}xx I{part}zz < I{part}xz^2"] = xx * zz < xz**2
        for wheel, load in zip(WHEELS, static_loads(bodies(p), p["w"], p["g"]), strict=True):
            broken[f"the {wheel} wheel bears no load"] = ~((np.asarray(load) > 0) & (np.asarray(load) < np.inf))
    shape = np.broadcast_shapes(*(np.shape(mask) for mask in broken.values()))
    return {why: np.broadcast_to(mask, shape) for why, mask in broken.items() if np.any(mask)}
