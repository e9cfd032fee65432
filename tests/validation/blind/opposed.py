"""Pairs of effects that hide each other, with sizes at which both could be found.

A twisting torque undoes what trail or a steer spring does to weave (their changes are opposed, cosine about -0.9). A
crown radius changes it in the same direction as either of them (cosine 0.7 to 0.99, for physical signs of both), so
that one alone passes for both. Sizes are drawn until each of the two stands out by :data:`STANDS_OUT` standard
deviations once the other and every parameter of the bicycle are adjusted: below that no search could be blamed.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from bicycle import Bicycle, load_bicycle
from tests.validation.blind.hidden import HIDDEN, UNRIDDEN, Hidden, true_machine, uncertainty
from tests.validation.blind.motion import shapes
from tyre.ground import Array

PAIRS = (
    ("pneumatic_trail", "crown_radius"),
    ("steer_spring", "crown_radius"),
    ("pneumatic_trail", "twisting_torque"),
    ("steer_spring", "twisting_torque"),
)
SPEEDS = np.linspace(3.2, 8.0, 12)
NOISE = 0.3
"""Of the middle level: crowns are small."""
UNDONE = (0.5, 0.95)  # share of the first's change that an opposed second takes back
STANDS_OUT = 4.0
TRIES = 200


def seen_weave(bicycle: Bicycle, hidden: Mapping[str, Mapping[str, float]]) -> Array:
    """Weave and its shape at :data:`SPEEDS` over their sd, of a ``bicycle`` with ``hidden`` effects."""
    machine, found = true_machine(bicycle, {}, hidden), []
    for speed in SPEEDS:
        weave = shapes(machine, float(speed)).get("weave")
        if weave is None:
            found += [math.nan] * 6
            continue
        sd = NOISE * (0.03 + 0.01 * abs(weave.root))
        found += [weave.root.real / sd, weave.root.imag / sd]
        for value in (weave.steer, weave.yaw):
            spread = NOISE * (0.02 + 0.01 * abs(value))
            found += [value.real / spread, value.imag / spread]
    return np.array(found)


@cache
def slopes(name: str) -> tuple[dict[str, Array], Array]:
    """Change of what is seen by unit size of each effect, and by one sd of each parameter, of the bicycle ``name``."""
    bicycle = load_bicycle(name)
    plain = seen_weave(bicycle, {})
    effects = {}
    for effect in {effect for pair in PAIRS for effect in pair}:
        key, span = next(iter(HIDDEN[effect].draw.items()))
        effects[effect] = (seen_weave(bicycle, {effect: {key: span[0]}}) - plain) / span[0]
    columns = []
    for key, sd in uncertainty(bicycle).items():
        columns.append((seen_weave(bicycle.replace(**{key: bicycle[key] + 0.3 * sd}), {}) - plain) / 0.3)
    known = np.isfinite(plain) & np.all(np.isfinite([*effects.values(), *columns]), axis=0)
    return {effect: slope[known] for effect, slope in effects.items()}, np.array(columns).T[known]


def stand_out(name: str, sizes: Mapping[str, float]) -> float:
    """Size in sd of the weaker of two effects of ``sizes`` (SI), parameters of bicycle ``name`` and the other free."""
    effects, nuisances = slopes(name)
    both = np.array([effects[effect] * size for effect, size in sizes.items()]).T
    spread = np.eye(len(both)) + nuisances @ nuisances.T
    covariance = np.linalg.inv(both.T @ np.linalg.solve(spread, both))
    return float(1 / np.sqrt(covariance.diagonal().max()))


def opposed_pair(rng: np.random.Generator) -> tuple[str, dict[str, Hidden]]:
    """A bicycle and the sizes of two effects that hide each other on it, drawn by ``rng``."""
    first, second = PAIRS[int(rng.integers(len(PAIRS)))]
    best, found = 0.0, ("", {first: 0.0, second: 0.0})
    for _ in range(TRIES):
        name = str(rng.choice(UNRIDDEN))
        effects, _ = slopes(name)
        one, two = effects[first], effects[second]
        sizes = {effect: _drawn(effect, rng) for effect in (first, second)}
        against = -(one @ two) / (one @ one)
        if against > 0:  # opposed: the first is chosen so that the second takes back most of it
            sizes[first] = float(sizes[second] * against / rng.uniform(*UNDONE))
        figure = stand_out(name, sizes)
        if figure > best and _occurs(first, sizes[first]):
            best, found = figure, (name, sizes)
        if best > STANDS_OUT:
            break
    name, sizes = found
    return name, {
        effect: replace(HIDDEN[effect], draw={next(iter(HIDDEN[effect].draw)): (size, size)})
        for effect, size in sizes.items()
    }


def _drawn(effect: str, rng: np.random.Generator) -> float:
    low, high = next(iter(HIDDEN[effect].draw.values()))
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def _occurs(effect: str, size: float) -> bool:
    """Not beyond what is hidden alone, and no smaller than half of that."""
    low, high = next(iter(HIDDEN[effect].draw.values()))
    return low / 2 <= size <= high
