"""Pairs of effects that nearly undo each other: one size drawn, the other chosen against it."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bicycle import Bicycle, load_bicycle
from studies.missing_effect.blind.hidden import HIDDEN, Hidden, draw_effect, true_machine
from studies.missing_effect.blind.second.shapes import shapes
from tyre.base.arrays import Array

SPEEDS = np.linspace(4.0, 8.0, 5)
UNDONE = (0.5, 0.95)  # share of the first's change of eigenvalues that the second takes back
CROWN = (0.015, 0.06)  # m, up to a balloon tyre
SEEN = 4.0  # sd of the middle noise, whole change of the pair
TRIES = 60


def seen_weave(bicycle: Bicycle, hidden: Mapping[str, Mapping[str, float]]) -> Array:
    """Weave and its shape at :data:`SPEEDS` over their usual sd, of a ``bicycle`` with ``hidden`` effects."""
    machine, found = true_machine(bicycle, {}, hidden), []
    for speed in SPEEDS:
        weave = shapes(machine, float(speed)).get("weave")
        if weave is None:
            found += [math.nan] * 6
            continue
        sd = 0.03 + 0.01 * abs(weave.root)
        for value, spread in ((weave.root, sd), (weave.steer, 0.03), (weave.yaw, 0.03)):
            found += [value.real / spread, value.imag / spread]
    return np.array(found)


def opposed_sizes(pair: tuple[str, str], name: str, rng: np.random.Generator) -> dict[str, Hidden]:
    """Sizes of a ``pair`` whose second takes back part of what the first does to the bicycle ``name``.

    The first is drawn by ``rng`` as usual, the second so that it undoes a random share of the first's change as far as
    the two are opposed, within sizes that occur; the pair must still be seen.
    """
    bicycle = load_bicycle(name)
    plain = seen_weave(bicycle, {})
    first, second = pair
    trial = 0.03
    slope = (seen_weave(bicycle, {second: {"crown_radius": trial}}) - plain) / trial
    key = next(iter(HIDDEN[first].draw))
    size, crown = 0.0, trial
    for _ in range(TRIES):
        size = draw_effect(HIDDEN[first], bicycle, rng)[key]
        change = seen_weave(bicycle, {first: {key: size}}) - plain
        known = np.isfinite(change) & np.isfinite(slope)
        ideal = -(change[known] @ slope[known]) / (slope[known] @ slope[known])
        crown = float(np.clip(rng.uniform(*UNDONE) * ideal, *CROWN)) if ideal > 0 else float(rng.uniform(*CROWN))
        left = change[known] + crown * slope[known]
        if ideal * UNDONE[1] > CROWN[0] and np.sqrt(left @ left) > SEEN:
            break
    return {
        first: replace(HIDDEN[first], draw={key: (size, size)}),
        second: replace(HIDDEN[second], draw={"crown_radius": (crown, crown)}),
    }
