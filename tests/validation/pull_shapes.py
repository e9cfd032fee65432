"""Does the interval of a static lateral stiffness hold the truth, whatever the shape of the pull? SYNTHETIC.

Plate against a fixed rim, 100 readings a second, noise of the gauge and of the force cell. The eight shapes are a few
readings, a ramp, a ramp that is held, one after a rest, one there and back, and three ends that slide: of one piece at
its friction limit, as a brush (summed over its bristles under a parabolic pressure), and exponentially. Each tyre has
another stiffness, load, friction and noise. Beyond these eight stand three that nobody asked for: an end that slides
as a hyperbolic tangent, coloured noise, and guides that rub. Counted: 95 % intervals that hold the slope at the origin
(also without what repeatability and calibration add), refusals with their reasons, and the width of the intervals.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.validation.cases import KeptCases, Row, share_of
from tyre import InputError
from tyre.fits import fit_lateral_stiffness
from tyre.measured import Estimate
from tyre.recordings import Condition, LateralStiffnessTest

Real = NDArray[np.float64]
RATE = 100.0  # readings a second
SPEED = 0.5e-3  # of the plate, m/s
TARGETS = {"held_of_20": 18, "refused_of_20_if_it_slides": 5}


@dataclass(frozen=True)
class Pulled:
    """A tyre under a pull: stiffness at the origin N/m, load N, friction limit N, noise of the gauges m and N."""

    stiffness: float
    load: float
    limit: float
    gauge_noise: float
    force_noise: float

    @property
    def grip(self) -> float:
        """Deflection at which the undisturbed spring would reach the friction limit, m."""
        return self.limit / self.stiffness


def draw_tyre(rng: np.random.Generator) -> Pulled:
    """Draw a tyre of 28 to 62 mm, and the gauges on it."""
    load = rng.uniform(300.0, 700.0)
    return Pulled(
        stiffness=1e3 * rng.uniform(40.0, 110.0),
        load=load,
        limit=load * rng.uniform(0.6, 0.9),
        gauge_noise=1e-3 * rng.uniform(0.005, 0.015),
        force_noise=rng.uniform(1.0, 3.0),
    )


def spring(tyre: Pulled, way: Real) -> Real:
    """Lateral force of a tyre that does not slide, N."""
    return tyre.stiffness * way


def slides_whole(tyre: Pulled, way: Real) -> Real:
    """Lateral force of a contact patch that slides all at once, N."""
    return np.minimum(tyre.stiffness * way, tyre.limit)


def slides_by_bristles(tyre: Pulled, way: Real) -> Real:
    """Lateral force of bristles under a parabolic pressure on a standing patch, each as stiff as its pull is long, N.

    The share ``place`` of the patch has run through under a bristle: it is bent by ``way`` times its place.
    """
    place = (np.arange(2000) + 0.5) / 2000
    held = 6.0 * tyre.limit * place * (1.0 - place)
    bent = 2.0 * tyre.stiffness * place * way[:, None]
    return np.asarray(np.minimum(bent, held).mean(axis=1))


def slides_exponentially(tyre: Pulled, way: Real) -> Real:
    """Lateral force that comes ever closer to the friction limit, N."""
    return -tyre.limit * np.expm1(-way / tyre.grip)


def slides_as_tangent(tyre: Pulled, way: Real) -> Real:
    """Lateral force that softens late, N."""
    return tyre.limit * np.tanh(way / tyre.grip)


def moves(*stages: tuple[float, float]) -> Real:
    """Plate (m) that goes to ``target`` (m) and stays there for some seconds, stage after stage."""
    path, place = [np.zeros(1)], 0.0
    for target, seconds in stages:
        count = round(abs(target - place) / SPEED * RATE)
        path += [np.linspace(place, target, count + 1)[1:], np.full(round(seconds * RATE), target)]
        place = target
    return np.concatenate(path)


Law = Callable[[Pulled, Real], Real]
SLIDING: dict[str, Law] = {
    "slides_hard": slides_whole,
    "slides_gently": slides_by_bristles,
    "slides_exp": slides_exponentially,
    "slides_tanh": slides_as_tangent,
}
SHAPES = ("few", "ramp", "ramp_hold", "rest_ramp_hold", "there_and_back", *SLIDING, "coloured_noise", "rubs")
ASKED = SHAPES[:8]


def pull(shape: str, rng: np.random.Generator) -> tuple[LateralStiffnessTest, float]:
    """Make a pull of a ``shape``, and give the stiffness at the origin (N/m)."""
    tyre = draw_tyre(rng)
    reach = 0.3 * tyre.load / tyre.stiffness
    if shape == "few":
        path = np.linspace(0.0, 2.0 * reach, 9)
    elif shape == "ramp_hold":
        path = moves((reach, 14.0))
    elif shape == "rest_ramp_hold":
        path = moves((0.0, 2.0), (2.0 * reach, 5.0))
    elif shape == "there_and_back":
        path = moves((reach, 0.0), (0.0, 0.0))
    elif shape == "rubs":
        path = np.concatenate([np.linspace(0, reach, 41), np.linspace(reach, 0, 41)[1:]])
        path[1:-1] += rng.uniform(-0.1, 0.1, path.size - 2) * reach / 40
    elif shape in SLIDING:
        path = moves((0.0, 2.0), (rng.uniform(1.1, 1.4) * tyre.grip, 0.0))
    else:
        path = moves((reach, 0.0))
    force = SLIDING.get(shape, spring)(tyre, path)
    force = force + tyre.force_noise * rng.standard_normal(path.size)
    if shape == "coloured_noise":
        force += 0.5 * tyre.force_noise * slow_noise(path.size, 0.3, rng)
    if shape == "rubs":
        force += rub(path, rng.uniform(1.0, 5.0), rng.uniform(1e-5, 5e-5))
    seen = path + tyre.gauge_noise * rng.standard_normal(path.size)
    condition = Condition(tyre=shape, load=tyre.load, pressure=5.5e5, surface="flat")
    time = np.arange(path.size) / RATE
    test = LateralStiffnessTest(condition, "adapted SAE", force, seen, np.zeros(path.size), time=time, synthetic=True)
    return test, tyre.stiffness


def slow_noise(count: int, seconds: float, rng: np.random.Generator) -> Real:
    """Noise of unit sd with a correlation time (s)."""
    kept = np.exp(-1.0 / RATE / seconds)
    noise = np.empty(count)
    noise[0] = rng.standard_normal()
    for k in range(1, count):
        noise[k] = kept * noise[k - 1] + np.sqrt(1.0 - kept**2) * rng.standard_normal()
    return noise


def rub(path: Real, force: float, slack: float) -> Real:
    """Force (N) of guides that give way by a ``slack`` (m) like a spring before they slide."""
    bent, drag = 0.0, np.zeros(path.size)
    for k in range(1, path.size):
        bent = min(max(bent + path[k] - path[k - 1], -slack), slack)
        drag[k] = force * bent / slack
    return drag


def one_pull(seed: int, shape: str, number: int) -> Row:
    """Make and fit one pull."""
    test, truth = pull(shape, np.random.default_rng([seed, SHAPES.index(shape), number]))
    row: Row = {"seed": seed, "shape": shape, "number": number, "refused": "", "held": False, "error": None}
    try:
        fit = fit_lateral_stiffness(test)
    except InputError as error:
        return row | {"refused": str(error)}
    low, high = fit.lateral_stiffness.ci95
    alone = Estimate(fit.lateral_stiffness.value, fit.fit_sd, fit.fit_dof)
    return row | {
        "held": bool(low <= truth <= high),
        "held_by_fit_alone": bool(alone.covers(truth)),
        "deviation": fit.lateral_stiffness.value / truth - 1.0,
        "half_width": (high - low) / 2.0 / truth,
        "notes": list(fit.notes),
    }


def run(*, out: Path, seed: int, draws: int = 20, workers: int = 2) -> dict[str, Any]:
    """Make and fit a number of ``draws`` of each shape."""
    kept = KeptCases(out / "pull_shapes_cases.jsonl", ("seed", "shape", "number"))
    jobs = [(seed, shape, number) for shape in SHAPES for number in range(draws)]
    rows = kept.computed(jobs, one_pull, workers=workers, what="pulls")
    return {
        "targets": TARGETS,
        "asked": {shape: summary([row for row in rows if row["shape"] == shape]) for shape in ASKED},
        "beyond": {shape: summary([row for row in rows if row["shape"] == shape]) for shape in SHAPES[8:]},
    }


def summary(rows: list[Row]) -> dict[str, Any]:
    """Count one shape."""
    fitted = [row for row in rows if not row["refused"]]
    return {
        "held": share_of(fitted, "held"),
        "held_by_fit_alone": share_of(fitted, "held_by_fit_alone"),
        "refused": dict(Counter(row["refused"] for row in rows if row["refused"])),
        "mean_deviation_percent": round(100 * float(np.mean([row["deviation"] for row in fitted])), 3),
        "median_half_width_percent": round(100 * float(np.median([row["half_width"] for row in fitted])), 3),
    }
