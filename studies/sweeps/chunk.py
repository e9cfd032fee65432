"""One chunk of a sweep: a pure function of the sweep and a range of items, the same wherever it runs."""

import json
import platform
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.critical.pencil import crossings_by_pencil
from bicycle.effect import take_over
from bicycle.eigenvalues.oscillation import least_damping_ratio
from bicycle.eigenvalues.solvers import eigenvalues, solver_for
from bicycle.linear_model import LinearModel
from bicycle.modal.known_modes import packaged_modes
from bicycle.modal.named_modes import modes
from bicycle.modal.naming import every_mode
from bicycle.sensitivity.eigenvalue_derivatives import sensitivities
from studies.sweeps.made_of import differences
from studies.sweeps.named import OF_MODES, batch_solver, block_of, critical_output, in_batches, named_outputs
from studies.sweeps.points import Points, Sampler
from studies.sweeps.sketch import sketch
from studies.sweeps.spec import BY_SPEED, Sweep, software
from tyre.base.errors import InputError

BLOCK = 2048  # matrices worked on at a time; blocks start at fixed items, so that no result depends on the chunk
SLOW_ITEMS = 32  # per part, where every bicycle is tracked by itself
OCCURRENCES = 4  # of a critical speed of one mode in one direction
CHANGES = ("destabilising", "stabilising")
OTHER = "other"  # where critical speeds of modes without a name stand
Arrays = dict[str, NDArray[Any]]


def compute(sweep: Sweep, start: int, stop: int) -> Arrays:
    """Results of the items with numbers ``start`` to ``stop`` - 1: arrays, first axis the item, or sketches.

    Draws that make no bicycle have NaN everywhere but in ``parameters``, and 1 in ``impossible``.

    Raises
    ------
    InputError
        A cell of the grid whose parameters are physically impossible, named by its place in the sweep.
    """
    take_over(sweep.outside_effects)  # which came along from where the sweep was started
    arrays = _worker(sweep).items(start, stop)
    return arrays if sweep.quantiles is None else sketch(arrays, start, sweep.samples)


class Worker:
    """What is prepared once per sweep and process.

    Raises
    ------
    InputError
        The software here is not that of the machine where the sweep was started.
    """

    def __init__(self, sweep: Sweep) -> None:
        here = replace(sweep)
        if here.fingerprint != sweep.fingerprint:  # the latter came along from where the sweep was started
            raise InputError(
                f"the worker on {platform.node()} computes with {json.dumps(software())} and other than what the sweep "
                f"was started with: {differences(sweep.made_of, here.made_of)}; install the same versions "
                "everywhere, with the same tyre files, and restart the workers"
            )
        self.sweep = sweep
        self.sampler = Sampler(sweep)
        self.linear = self.sampler.model.linear_model()
        self.slow = [name for name in sweep.outputs if name in SLOW]
        self.fast = [name for name in sweep.outputs if name in FAST]
        self.parameters = parameter_names(self.sampler)
        self.modes = mode_names(self.linear)
        self.solver = batch_solver(self.sampler.family, sweep.items)
        self.alone = 0  # bicycles of which a batch was not sure, so far

    def items(self, start: int, stop: int) -> Arrays:
        """Outputs by name of the items with the numbers ``start`` to ``stop`` - 1, the first axis is the item."""
        points = self._points(start, stop)
        outputs: Arrays = {}
        if self.fast:
            values = self._by_blocks(start, stop)
            outputs |= {name: FAST[name](values) for name in self.fast}
        if self.slow:
            outputs |= self._named(points.harmless, start, stop - start)
        if points.extrapolated is not None:
            outputs["tyre_extrapolated"] = points.extrapolated.astype(float)
        for array in outputs.values():
            array[points.refused.mask] = np.nan
        if "parameters" in self.sweep.outputs:
            outputs["parameters"] = np.stack(
                [np.broadcast_to(points.values[key], stop - start) for key in self.parameters], -1
            )
        outputs["impossible"] = points.refused.mask.astype(float)
        if not self.sweep.speeds:  # one speed, or none, of its own for each item: no axis
            outputs |= {name: outputs[name][:, 0] for name in self.sweep.outputs if name in BY_SPEED}
        return {name: outputs[name] for name in stored(self.sweep)}

    def _points(self, start: int, stop: int) -> Points:
        points = self.sampler.points(start, stop)
        if not self.sweep.random:
            self.sampler.refuse_any(points, start)
        return points

    def _by_blocks(self, start: int, stop: int) -> NDArray[np.complex128]:
        """Eigenvalues: of whole blocks, where the last bits may depend on the place in the block."""
        block = block_items(self.sweep)
        parts = []
        for first in range(start - start % block, stop, block):
            last = min(first + block, self.sweep.items)
            values = self._eigenvalues(self._points(first, last).harmless, last - first)
            parts.append(values[max(start - first, 0) : min(stop, last) - first])
        return np.concatenate(parts)

    def _eigenvalues(self, points: Points, count: int) -> NDArray[np.complex128]:
        """Eigenvalues of possible bicycles."""
        speeds = points.speeds
        self.linear.check_speeds(speeds)
        every = np.broadcast_to(speeds, (count, speeds.shape[1]))
        solver = solver_for(self.sweep.items * max(len(self.sweep.speeds), 1))  # one for all parts
        return eigenvalues(self.sampler.family.state_matrices(points.values, every, solver=solver), solver=solver)

    def _named(self, points: Points, start: int, count: int) -> Arrays:
        """Named results of possible bicycles: together, and one by one where that is not sure."""
        together: Arrays = {}
        sure = np.zeros(count, bool)
        at_once = in_batches(self.slow, self.solver)
        if self.solver and at_once:
            block, refused = block_of(self.linear, self.sampler.family, points.values, count, self.solver)
            sure = ~refused
            if set(OF_MODES) & set(at_once):
                speeds = np.broadcast_to(points.speeds, (count, points.speeds.shape[1]))
                together, told = named_outputs(block, speeds, self.modes, self.solver)
                sure &= told
            if "critical_speeds" in at_once:
                crossings, told = critical_output(block, self.sweep.max_speed, self.modes, CHANGES, OCCURRENCES)
                together["critical_speeds"] = crossings
                sure &= told
        self.alone += int((~sure).sum())
        wanted = [name for name in self.slow if name not in together]
        rows = [
            self._one(points, item, start, wanted if sure[item] else self.slow) if wanted or not sure[item] else {}
            for item in range(count)
        ]
        return {
            name: np.array([together[name][k] if sure[k] and name in together else row[name]
                            for k, row in enumerate(rows)])
            for name in self.slow
        }  # fmt: skip

    def _one(self, points: Points, item: int, start: int, wanted: Sequence[str]) -> Mapping[str, Any]:
        """Named results ``wanted`` of one possible bicycle."""
        speeds, result = _row(points.speeds, item), {}
        try:
            model = self.sampler.variant(points, item)
            linear = model.linear_model()
            if set(OF_MODES) & set(wanted):
                named = modes(linear, speeds)
                here = [name in named.branches for name in self.modes]
                nothing = np.full(len(speeds), np.nan)
                result["modes"] = np.array(
                    [
                        named.branch(name)[:, 0] if ok else nothing + 0j
                        for name, ok in zip(self.modes, here, strict=True)
                    ]
                ).T
                result["frequencies"] = np.array(
                    [named.frequency(name) if ok else nothing for name, ok in zip(self.modes, here, strict=True)]
                ).T
                result["damping_ratios"] = np.array(
                    [named.damping_ratio(name) if ok else nothing for name, ok in zip(self.modes, here, strict=True)]
                ).T
            if "critical_speeds" in wanted:
                result["critical_speeds"] = self._critical(linear)
            if "sensitivities" in wanted:
                slopes = sensitivities(model, speeds)
                result["sensitivities"] = np.stack([slopes.of(key) for key in free_parameters(self.sampler)], -1)
        except InputError as error:
            self.sampler.refuse(item, start, str(error))
        return result

    def _critical(self, linear: Any) -> NDArray[np.float64]:
        names = (*self.modes, OTHER)
        result = np.full((len(names), len(CHANGES), OCCURRENCES), np.nan)
        for crossing in crossings_by_pencil(linear, self.sweep.max_speed):
            name = crossing.mode if crossing.mode in self.modes else OTHER
            row = result[names.index(name), CHANGES.index(crossing.direction)]
            free = np.flatnonzero(np.isnan(row))
            if not free.size:
                raise InputError(
                    f"{crossing.mode} has more than {OCCURRENCES} {crossing.direction} critical speeds up to "
                    f"{self.sweep.max_speed:g} m/s; lower max_speed_m_s"
                )
            row[free[0]] = crossing.speed
        return result


def stored(sweep: Sweep) -> tuple[str, ...]:
    """Names of the arrays of a sweep: its outputs, and what is told of each bicycle and of each draw."""
    tyre = any("tyre" in table for table in sweep.model.get("effects", {}).values())
    return (*sweep.outputs, *(["tyre_extrapolated"] if tyre else []), *(["impossible"] if sweep.random else []))


def block_items(sweep: Sweep) -> int:
    """Items in one block of eigenvalues."""
    most = SLOW_ITEMS if any(name in SLOW for name in sweep.outputs) else BLOCK
    return max(1, min(most, BLOCK // sweep.points_per_item))


FAST = {
    "eigenvalues": lambda values: values,
    "largest_growth_rate": lambda values: values.real.max(-1),
    "smallest_damping_ratio": least_damping_ratio,
}
SLOW = ("modes", "frequencies", "damping_ratios", "critical_speeds", "sensitivities")


def parameter_names(sampler: Sampler) -> tuple[str, ...]:
    """Names along the axis ``parameter`` of the output ``parameters``: all that a bicycle or effect has."""
    return tuple(sampler.nominal)


def mode_names(linear: LinearModel) -> tuple[str, ...]:
    """Names along the axis ``mode``: those of the package, so that sweeps can be compared, then the model's further."""
    packaged = packaged_modes()
    return (*packaged, *(mode.name for mode in every_mode(linear) if mode.name not in packaged))


def free_parameters(sampler: Sampler) -> tuple[str, ...]:
    """Names along the axis ``parameter`` of the sensitivities."""
    return sensitivities(sampler.model, [1.0]).parameters


def _row(speeds: NDArray[np.float64], item: int) -> NDArray[np.float64]:
    return np.asarray(speeds[item if len(speeds) > 1 else 0])


_workers: OrderedDict[str, Worker] = OrderedDict()


def _worker(sweep: Sweep) -> Worker:
    """The worker of this sweep in this process; threads may build it twice, which changes nothing."""
    worker = _workers.get(sweep.fingerprint)
    if worker is None:
        worker = _workers[sweep.fingerprint] = Worker(sweep)
        while len(_workers) > 4:
            _workers.popitem(last=False)
    return worker
