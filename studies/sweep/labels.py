"""Dimensions of the result of a sweep, and their labels."""

from collections.abc import Sequence
from typing import Any

from studies.model_space.outputs import DIMENSIONS, OUTPUTS
from studies.sweep.specification import SAMPLE, SPEED, Sweep

Labels = dict[str, Sequence[Any]]


def coordinates(sweep: Sweep) -> Labels:
    """Every dimension and its labels, without those that a reduction over the samples adds."""
    model = sweep.nominal
    labels: Labels = {axis.name: axis.values for axis in sweep.axes}
    if sweep.speeds:
        labels[SPEED] = sweep.speeds
    if sweep.samples > 1:
        labels[SAMPLE] = range(sweep.samples)
    dims = dict.fromkeys(dim for name in sweep.outputs for dim in OUTPUTS[name].dims)
    return labels | {dim: DIMENSIONS[dim](model) for dim in dims}


def outer_of(sweep: Sweep) -> tuple[str, ...]:
    """Dimensions along which the bicycles differ: the axes of the grid, then the samples if there are several."""
    grid = tuple(axis.name for axis in sweep.axes)
    return (*grid, SAMPLE) if sweep.samples > 1 else grid


def inner_of(name: str, sweep: Sweep) -> tuple[str, ...]:
    """Dimensions of one bicycle's values of an output, or of a mark of bicycles."""
    output = OUTPUTS.get(name)
    if output is None:
        return ()
    return (SPEED, *output.dims) if output.by_speed and sweep.speeds else output.dims
