"""Results of a range of items of a sweep: a pure function, the same wherever it runs."""

import json
import platform
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.effects.effect_registry import take_over
from bicycle.model.eigen import eigenvalues
from bicycle.stability.named_modes import modes
from bicycle.stability.naming import NONE, Rules, name_stack
from studies.model_space.outputs import MODE, MODEL, OUTPUTS, PARAMETERS, ROOTS, Output, mode_names
from studies.sweep.sampler import Points, Sampler
from studies.sweep.specification import Sweep, differences, software
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError

BLOCK = 2048  # matrices worked on at a time; blocks start at fixed items, so that no result depends on the part
SLOW_ITEMS = 32  # per part, where every bicycle is tracked by itself
Arrays = dict[str, NDArray[Any]]


def compute(sweep: Sweep, start: int, stop: int) -> Arrays:
    """Results by name of the items with numbers ``start`` to ``stop`` - 1: arrays, the first axis is the item."""
    take_over(sweep.outside_effects)  # which came along from where the sweep was started
    for name, module in sweep.outside_outputs.items():
        if name not in OUTPUTS:
            try:
                import_module(module)
            except ImportError as error:
                raise InputError(f"output {name}: a worker cannot import {module}; install it there") from error
    return _worker(sweep).items(start, stop)


class Worker:
    """Preparations made once per sweep and process."""

    def __init__(self, sweep: Sweep) -> None:
        sweep_here = replace(sweep)
        if sweep_here.fingerprint != sweep.fingerprint:  # the latter came along from where the sweep was started
            raise InputError(
                f"the worker on {platform.node()} has {json.dumps(software())}; differences from the start "
                f"of the sweep: {differences(sweep.made_of, sweep_here.made_of)}; install the same versions "
                "everywhere, with the same tyre files, and restart the workers"
            )
        self.sweep = sweep
        self.sampler = Sampler(sweep)
        self.linear = self.sampler.model.linear_model()
        self.modes = mode_names(self.linear)

    def items(self, start: int, stop: int) -> Arrays:
        """Outputs by name of the items with the numbers ``start`` to ``stop`` - 1, the first axis is the item."""
        sweep, points, count = self.sweep, self._points(start, stop), stop - start
        of_roots = sweep.outputs_from(ROOTS)
        roots = self._roots(start, stop) if of_roots else None
        outputs: Arrays = {output.name: output.function(roots) for output in of_roots}
        outputs |= self._compute_from_modes(points.harmless, start, count) if sweep.outputs_from(MODE) else {}
        outputs |= {
            output.name: self._compute_from_models(output, points.harmless, start, count)
            for output in sweep.outputs_from(MODEL)
        }
        if points.extrapolated is not None:
            outputs["tyre_extrapolated"] = points.extrapolated.astype(float)
        for array in outputs.values():
            array[points.refused.mask] = np.nan
        for output in sweep.outputs_from(PARAMETERS):
            values = output.function(points.values)
            outputs[output.name] = np.stack([np.broadcast_to(values[key], count) for key in self.sampler.nominal], -1)
        outputs["impossible"] = points.refused.mask.astype(float)
        if not sweep.speeds:  # one speed, or none, of its own for each item: no axis
            outputs |= {name: outputs[name][:, 0] for name in sweep.outputs if OUTPUTS[name].by_speed}
        return {name: outputs[name] for name in stored_names(sweep)}

    def _points(self, start: int, stop: int) -> Points:
        points = self.sampler.points(start, stop)
        if not self.sweep.random:
            self.sampler.refuse_any(points, start)
        return points

    def _roots(self, start: int, stop: int) -> Complex:
        """Eigenvalues of whole blocks, as the last bits may depend on the place in the block."""
        block = block_items(self.sweep)
        parts = []
        for first in range(start - start % block, stop, block):
            last = min(first + block, self.sweep.items)
            points = self._points(first, last).harmless
            self.linear.check_speeds(points.speeds)
            speeds = np.broadcast_to(points.speeds, (last - first, points.speeds.shape[1]))
            values = eigenvalues(self.sampler.family.state_matrices(points.values, speeds))
            parts.append(values[max(start - first, 0) : min(stop, last) - first])
        return np.concatenate(parts)

    def _compute_from_modes(self, points: Points, start: int, count: int) -> Arrays:
        """Outputs of named modes of possible bicycles: all at once, and one by one if equations switch at a speed."""
        speeds, values = np.broadcast_to(points.speeds, (count, points.speeds.shape[1])), points.values
        pairs = np.full((count, speeds.shape[1], len(self.modes), 2), np.nan + 0j)
        if self.sampler.family.evaluate.symbolic.switches:
            for item in range(count):
                try:
                    named = modes(self.sampler.variant(points, item).linear_model(), speeds[item])
                except InputError as error:
                    self.sampler.refuse(item, start, str(error))
                for k in [k for k, name in enumerate(self.modes) if name in named.branches]:
                    pairs[item, :, k] = named.branch(self.modes[k])[:, :2]
        else:
            rules, polynomial = Rules.of(self.linear), self.sampler.family.polynomials(values, count)[0]
            gravity = np.broadcast_to(np.asarray(values["g"], float), count)
            stack = name_stack(rules, polynomial, np.sqrt(gravity * values["w"]), gravity, speeds)
            for k in [k for k, name in enumerate(self.modes) if name in rules.names]:
                of_mode = (stack.second == NONE) & (stack.first == rules.names.index(self.modes[k]))
                pairs[:, :, k] = named_pair(stack.values, of_mode)
        return {output.name: output.of_pair(pairs[..., 0], pairs[..., 1]) for output in self.sweep.outputs_from(MODE)}

    def _compute_from_models(self, output: Output, points: Points, start: int, count: int) -> Array:
        """Values (count, ...) of an output of models, of the items from number ``start`` on."""
        if output.at_once:
            values, step = [], block_items(self.sweep)
            for first in range(0, count, step):  # whole blocks, as the last bits may depend on who is beside
                block = slice(first, min(first + step, count))
                parameters = {key: value[block] if np.ndim(value) else value for key, value in points.values.items()}
                rows, refused = output.function(
                    self.sampler.family, parameters, block.stop - first, self.sweep.max_speed
                )
                for item, why in refused.items():
                    self.sampler.refuse(first + item, start, why)
                values.append(rows)
            return np.concatenate(values)
        values = []
        for item, speeds in enumerate(np.broadcast_to(points.speeds, (count, points.speeds.shape[1]))):
            try:
                values.append(output.function(self.sampler.variant(points, item), speeds, self.sweep.max_speed))
            except InputError as error:
                self.sampler.refuse(item, start, str(error))
        return np.array(values)


def named_pair(values: Complex, of_mode: NDArray[np.bool_]) -> Complex:
    """A pair's upper half, or two real roots, the larger first, of the ``own`` roots (m, k, n); NaN where none."""
    height = np.where(of_mode & (values.imag >= 0), values.imag, -1.0)
    pair = np.full((*values.shape[:2], 2), np.nan, complex)
    for number in range(2):  # the fastest oscillation first, then the larger real root: roots rise, the last is larger
        last = values.shape[2] - 1 - height[..., ::-1].argmax(2)[..., None]
        exists = np.take_along_axis(height, last, 2)[..., 0] >= 0
        pair[..., number] = np.where(exists, np.take_along_axis(values, last, 2)[..., 0], np.nan)
        np.put_along_axis(height, last, -1.0, 2)
    return pair


def stored_names(sweep: Sweep) -> tuple[str, ...]:
    """Names of the arrays of a sweep: its outputs, and the status of each bicycle and of each sample."""
    names = list(sweep.outputs)
    if any("tyre" in table for table in sweep.model.get("effects", {}).values()):
        names.append("tyre_extrapolated")
    if sweep.random:
        names.append("impossible")
    return tuple(names)


def block_items(sweep: Sweep) -> int:
    """Items in one block of eigenvalues."""
    return max(1, min(SLOW_ITEMS if slow(sweep) else BLOCK, BLOCK // sweep.points_per_item))


def slow(sweep: Sweep) -> bool:
    """True if bicycles are tracked one by one."""
    return bool(sweep.outputs_from(MODE, MODEL))


_workers: dict[str, Worker] = {}  # of this process, the latest few


def _worker(sweep: Sweep) -> Worker:
    if sweep.fingerprint not in _workers:  # threads may build it twice, which changes nothing
        while len(_workers) > 3:
            _workers.pop(next(iter(_workers)), None)
        _workers[sweep.fingerprint] = Worker(sweep)
    return _workers[sweep.fingerprint]
