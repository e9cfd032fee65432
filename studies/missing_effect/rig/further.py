"""Feasible further sweeps on the rig, to tell apart what the recordings at hand cannot."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from studies.missing_effect.rig.candidates import DRIFT, ZERO
from studies.missing_effect.rig.data import Noise, Sweep
from tyre.base.arrays import Array
from tyre.recordings.recording import Condition

BLOCK = np.deg2rad(0.2)  # of a predicted sweep
SETTLING = 0.5  # m
GAUGE = 1e-5  # m, a dial gauge
FASTER = 2.0  # sweep rate, rolling speed
HEAVIER = 1.25
SAME = 1.2  # rates or speeds within this factor are one


@dataclass(frozen=True)
class Further:
    """A sweep to be predicted; ``turned``: the tyre is mounted the other way round."""

    sweep: Sweep
    turned: bool = False


def further_sweeps(sweeps: Sequence[Sweep], repeatability: float) -> dict[str, Further]:
    """What could be measured next, by its description."""
    first = sweeps[0]

    def one(**changes: object) -> Further:
        turned = bool(changes.pop("turned", False))
        return Further(_path(first, repeatability, **changes), turned)  # type: ignore[arg-type]

    found = {}
    single = len({float(way) for s in sweeps for way in s.direction}) == 1
    if single:
        found["the other branch of the sweep"] = one(branches=(-float(first.direction[0]),))
    if _alike([s.rate for s in sweeps]):
        rate = FASTER * first.rate
        found[f"both branches at {np.rad2deg(rate):.3g} deg/s"] = one(rate=rate)
    if first.speed is not None and _alike([s.speed or first.speed for s in sweeps]):
        speed = FASTER * first.speed
        found[f"both branches at a rolling speed of {speed:.3g} m/s"] = one(speed=speed)
    if any(s.condition.drum_radius for s in sweeps) and all(s.condition.drum_radius for s in sweeps):
        flat = replace(first.condition, surface="flat", drum_radius=None)
        found["the same sweep on a flat track with the same sensors"] = one(condition=flat)
    if single:
        return found  # the other branch first
    loads = [s.condition.load for s in sweeps]
    if max(loads) / min(loads) < SAME:
        load = HEAVIER * first.condition.load
        found[f"both branches at {load:.0f} N"] = one(condition=replace(first.condition, load=load))
    found["both branches with the tyre turned round on its rim"] = one(turned=True)
    return found


def _alike(values: Sequence[float]) -> bool:
    return max(values) < SAME * min(values)


def _path(
    like: Sweep, repeatability: float, *, rate: float | None = None, speed: float | None = None,
    branches: tuple[float, ...] = (1.0, -1.0), condition: Condition | None = None,
) -> Sweep:  # fmt: skip
    """A sweep like another, with settled blocks only and the noise of the other one."""
    rate, speed = rate or like.rate, speed or like.speed
    reach = float(np.abs(like.slip).max())
    count = max(8, round(2 * reach / BLOCK))
    line = np.linspace(-reach, reach, count)
    slip = np.concatenate([sign * line for sign in branches])
    step = 2 * reach / count / rate
    time = step * np.arange(len(slip))
    since = np.tile(step * np.arange(count), len(branches))
    used = since * (speed or 2.5) > SETTLING
    white = like.noise.white * rate / like.rate / 2
    sweep = replace(
        like, name="", condition=condition or like.condition, time=time[used], slip=slip[used],
        force=np.zeros(used.sum()),
        direction=np.repeat(branches, count)[used], part=np.repeat(np.arange(len(branches)), count)[used],
        slip_time=time, slip_history=slip, speed=speed, rate=rate,
        noise=Noise(white, like.noise.wander, like.noise.memory),
    )  # fmt: skip
    force = np.interp(sweep.slip, *_ordered(like))
    return replace(sweep, further=np.stack([repeatability * force, DRIFT * sweep.clock, np.full_like(force, ZERO)], 1))


def _ordered(like: Sweep) -> tuple[Array, Array]:
    order = np.argsort(like.slip)
    return like.slip[order], like.force[order]
