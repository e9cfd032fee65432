"""Feasible further sweeps on the rig, to tell apart what the recordings at hand cannot."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from studies.inference.forward import ProposedMeasurement
from studies.missing_effect.rig.candidates import DRIFT, ZERO
from studies.missing_effect.rig.data import SweepBlocks
from tyre.base.arrays import Array
from tyre.fits.noise_in_time import AR1Noise
from tyre.recordings.recording import Condition

BLOCK = np.deg2rad(0.2)  # of a predicted sweep
SETTLING = 0.5  # m
GAUGE_SD = 1e-5  # m, a dial gauge
FASTER = 2.0  # sweep rate, rolling speed
HEAVIER = 1.25
SAME = 1.2  # rates or speeds within this factor are one


@dataclass(frozen=True, eq=False)
class FurtherSweep(ProposedMeasurement):
    """A ``sweep`` to be predicted; ``turned``: the tyre is mounted the other way round."""

    sweep: SweepBlocks
    turned: bool = False


@dataclass(frozen=True, eq=False)
class RimGauge(ProposedMeasurement):
    """A gauge that shows how rim and fixture give way in the hardest pull."""


def further_sweeps(sweeps: Sequence[SweepBlocks], repeatability: float) -> list[ProposedMeasurement]:
    """What could be measured next.

    Parameters
    ----------
    sweeps : sequence of SweepBlocks
        What was measured.
    repeatability : float
        Relative, 1 sd, of the force of one recording.
    """
    first = sweeps[0]
    proposals: list[ProposedMeasurement] = []

    def propose(what: str, *, turned: bool = False, **changes: Any) -> None:
        sweep = _path(first, repeatability, **changes)
        proposals.append(FurtherSweep(what, np.ones(len(sweep.time)), sweep, turned))

    single = len({float(way) for s in sweeps for way in s.direction}) == 1
    if single:
        propose("the other branch of the sweep", branches=(-float(first.direction[0]),))
    if _alike([s.rate for s in sweeps]):
        rate = FASTER * first.rate
        propose(f"both branches at {np.rad2deg(rate):.3g} deg/s", rate=rate)
    if first.speed is not None and _alike([s.speed or first.speed for s in sweeps]):
        speed = FASTER * first.speed
        propose(f"both branches at a rolling speed of {speed:.3g} m/s", speed=speed)
    if any(s.condition.drum_radius for s in sweeps) and all(s.condition.drum_radius for s in sweeps):
        flat = replace(first.condition, surface="flat", drum_radius=None)
        propose("the same sweep on a flat track with the same sensors", condition=flat)
    if single:
        return proposals  # the other branch first
    loads = [s.condition.load for s in sweeps]
    if max(loads) / min(loads) < SAME:
        load = HEAVIER * first.condition.load
        propose(f"both branches at {load:.0f} N", condition=replace(first.condition, load=load))
    propose("both branches with the tyre turned round on its rim", turned=True)
    return proposals


def _alike(values: Sequence[float]) -> bool:
    return max(values) < SAME * min(values)


def _path(
    like: SweepBlocks, repeatability: float, *, rate: float | None = None, speed: float | None = None,
    branches: tuple[float, ...] = (1.0, -1.0), condition: Condition | None = None,
) -> SweepBlocks:  # fmt: skip
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
        direction=np.repeat(branches, count)[used], branch=np.repeat(np.arange(len(branches)), count)[used],
        slip_time=time, slip_history=slip, speed=speed, rate=rate,
        noise=AR1Noise(white, like.noise.correlated, like.noise.memory),
    )  # fmt: skip
    force = np.interp(sweep.slip, *_ordered(like))
    return replace(sweep, common=np.stack([repeatability * force, DRIFT * sweep.clock, np.full_like(force, ZERO)], 1))


def _ordered(like: SweepBlocks) -> tuple[Array, Array]:
    order = np.argsort(like.slip)
    return like.slip[order], like.force[order]
