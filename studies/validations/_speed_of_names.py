"""Named modes and critical speeds in batches against one bicycle after another, unnamed eigenvalues and one thread."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np

from bicycle.critical.critical_speeds import critical_speeds, tracked_critical_speeds
from bicycle.eigenvalues.solvers import eigenvalues
from bicycle.linear_model import LinearModel
from bicycle.modal.named_modes import tracked_modes
from bicycle.model_family import ModelFamily
from studies.validations._speed_of_studies import grid_crossings
from studies.validations._speed_timing import SPREAD, Pair, alternating, tyre_model
from tyre.base.arrays import Array
from tyre.base.parallel import one_blas_thread

SPEEDS = np.linspace(0.5, 30.0, 60)  # m/s
TOP = 60.0  # m/s
AT_ONCE, ALONE = 256, 24  # bicycles: in a block, and tracked one by one


def _drawn(order: int, count: int) -> tuple[ModelFamily, dict[str, Array]]:
    """Bicycles around the one with so many states."""
    model = tyre_model(order)
    rng = np.random.default_rng(1)
    numbers = {key: model.bicycle[key] + sd * rng.normal(size=count) for key, sd in SPREAD.items()}
    return ModelFamily(model, tuple(SPREAD)), numbers


def _parts(order: int, count: int) -> list[Callable[[], Any]]:
    """Makers of the blocks of bicycles, assembly included."""
    from bicycle.modal.batch import Block
    from bicycle.modal.batch_kind import BatchKind

    family, numbers = _drawn(order, count)
    kind = BatchKind.of(family.model.linear_model())

    def block(start: int) -> Any:
        part = {key: values[start : start + AT_ONCE] for key, values in numbers.items()}
        polynomial, _ = family.polynomials(part, len(part["w"]))
        return Block.of(polynomial, np.sqrt(family.base["g"] * part["w"]), kind)

    return [partial(block, start) for start in range(0, count, AT_ONCE)]


def _alone(order: int) -> list[LinearModel]:
    family, numbers = _drawn(order, ALONE)
    return [
        family.with_values({key: float(values[k]) for key, values in numbers.items()}).linear_model()
        for k in range(ALONE)
    ]


def _named(block: Any) -> Any:
    from bicycle.modal.batch import name_roots

    return name_roots(block, np.broadcast_to(SPEEDS, (len(block.unit), len(SPEEDS))))


def _crossings(block: Any) -> Any:
    from bicycle.critical.batch import critical_speeds_of

    return critical_speeds_of(block, TOP)


def named_modes(order: int, count: int, repeats: int) -> tuple[float, float, int]:
    """Seconds a bicycle: tracked one by one, and in batches; and of how many bicycles the batches were not sure."""
    models, parts = _alone(order), _parts(order, count)
    left = sum(int((_named(part()).status != 0).sum()) for part in parts)
    one, many = alternating(
        lambda: [tracked_modes(model, SPEEDS) for model in models], lambda: [_named(part()) for part in parts], repeats
    )
    return one / ALONE, many / count, left


def many_critical_speeds(order: int, count: int, repeats: int) -> tuple[float, float, int]:
    """Likewise for critical speeds."""
    models, parts = _alone(order), _parts(order, count)
    left = sum(int((_crossings(part()).status != 0).sum()) for part in parts)
    one, many = alternating(
        lambda: [tracked_critical_speeds(model, TOP) for model in models],
        lambda: [_crossings(part()) for part in parts], repeats,
    )  # fmt: skip
    return one / ALONE, many / count, left


def named_against_unnamed(order: int, count: int, repeats: int) -> Pair:
    """Eigenvalues without and with names, assembly included, on one thread."""
    family, numbers = _drawn(order, count)
    parts = _parts(order, count)

    def unnamed() -> None:
        for start in range(0, count, AT_ONCE):
            part = {key: values[start : start + AT_ONCE] for key, values in numbers.items()}
            polynomial, _ = family.polynomials(part, len(part["w"]))
            eigenvalues(polynomial(SPEEDS[None]))

    return alternating(unnamed, lambda: [_named(part()) for part in parts], repeats)


def threads(order: int, count: int, repeats: int) -> Pair:
    """Named modes on one thread and on two."""
    parts = _parts(order, count)

    def two() -> None:
        with one_blas_thread(), ThreadPoolExecutor(2) as pool:
            list(pool.map(lambda part: _named(part()), parts))

    return alternating(lambda: [_named(part()) for part in parts], two, repeats)


def one_bicycle(order: int, repeats: int) -> tuple[float, float, int, int]:
    """Seconds of a grid of 400 speeds with polishing, and of critical_speeds; crossings of each."""
    linear = tyre_model(order).linear_model()
    found, on_grid = critical_speeds(linear, TOP), grid_crossings(linear)
    grid, ours = alternating(lambda: grid_crossings(linear), lambda: critical_speeds(linear, TOP), 5 * repeats)
    return grid, ours, len(on_grid), len(found)
