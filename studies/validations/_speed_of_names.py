"""Sweeps of named modes and critical speeds: in batches against one bicycle after another, unnamed, and one thread.

What is timed is what a sweep computes, without storage. Batches, compiled or in plain numpy, pay for the bicycles of
which they are not sure.
"""

from functools import partial

import numpy as np

from bicycle.critical.critical_speeds import critical_speeds
from bicycle.eigenvalues.solvers import Solver, compiled
from studies.sweeps.chunk import Worker, compute
from studies.sweeps.engines import in_threads
from studies.sweeps.spec import Sweep
from studies.validations._speed_of_studies import grid_crossings
from studies.validations._speed_timing import Pair, alternating, drain, sweep_of, tyre_model

SPEEDS = np.linspace(0.5, 30.0, 60).tolist()  # m/s
TOP = 60.0  # m/s
FEW = 24  # bicycles that are tracked one by one


def _named(samples: int, order: int, output: str = "modes") -> Sweep:
    return sweep_of(samples, order, outputs=[output], grid={"speed_m_s": SPEEDS})


def _crossings(samples: int, order: int) -> Sweep:
    return sweep_of(samples, order, outputs=["critical_speeds"], grid={}, max_speed_m_s=TOP)


def _compared(few: Sweep, many: Sweep, solver: Solver, repeats: int) -> tuple[float, float, int]:
    """Seconds a bicycle one by one (the few) and in batches, and how many of the latter were tracked one by one."""
    alone, together = Worker(few), Worker(many)
    alone.solver, together.solver = None, solver
    one, all_ = alternating(lambda: alone.items(0, few.items), lambda: together.items(0, many.items), repeats)
    return one / few.items, all_ / many.items, together.alone // (repeats + 1)


def named_modes(order: int, count: int, solver: Solver, repeats: int) -> tuple[float, float, int]:
    """Seconds a bicycle: one by one, and in batches; and how many bicycles the batches left."""
    return _compared(_named(FEW, order), _named(count, order), solver, repeats)


def many_critical_speeds(order: int, count: int, solver: Solver, repeats: int) -> tuple[float, float, int]:
    """Likewise for critical speeds."""
    return _compared(_crossings(FEW, order), _crossings(count, order), solver, repeats)


def critical_speeds_as_swept(order: int, count: int, repeats: int) -> Pair:
    """Seconds a bicycle: one by one, and as a sweep finds them on two cores, in batches on two threads."""
    few, many = Worker(_crossings(FEW, order)), _crossings(count, order)
    few.solver = None
    one, all_ = alternating(lambda: few.items(0, FEW), lambda: drain(many, in_threads(2)), repeats)
    return one / FEW, all_ / count


def named_against_unnamed(order: int, count: int, repeats: int) -> Pair:
    """Eigenvalues without and with names, on one thread."""
    unnamed, named = _named(count, order, "eigenvalues"), _named(count, order)
    return alternating(lambda: compute(unnamed, 0, count), lambda: compute(named, 0, count), repeats)


def threads(order: int, count: int, repeats: int) -> Pair:
    """Named modes on one thread and on two."""
    sweep = _named(count, order)
    return alternating(lambda: drain(sweep, in_threads(1)), lambda: drain(sweep, in_threads(2)), repeats)


def one_bicycle(order: int, solver: Solver, repeats: int) -> tuple[float, float, int, int]:
    """Seconds of a grid of 400 speeds with polishing, and of the critical speeds of one bicycle; crossings of each.

    By numpy, or by the kernels.
    """
    linear = tyre_model(order).linear_model()
    search = partial(critical_speeds, fast=solver is compiled)
    found, on_grid = search(linear, TOP), grid_crossings(linear)
    grid, ours = alternating(lambda: grid_crossings(linear), lambda: search(linear, TOP), 5 * repeats)
    return grid, ours, len(on_grid), len(found)
