"""Named modes and critical speeds of many items of a sweep at once; the unsure are left to one by one."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.oscillation import frequency_hz, pair_damping_ratio
from bicycle.eigenvalues.solvers import Solver, compiled, default_solver, lapack
from bicycle.linear_model import LinearModel
from bicycle.model_family import ModelFamily
from tyre.base.arrays import Array, Complex

FEWEST = 1000  # bicycles: it takes longer to compile the kernels for the first time than to track fewer one by one
OF_MODES = ("modes", "frequencies", "damping_ratios")
Arrays = dict[str, NDArray[Any]]
Done = NDArray[np.bool_]


def batch_solver(family: ModelFamily, items: int) -> Solver | None:
    """How bicycles of a ``family`` are named at once: compiled where they are many, by LAPACK, or not at all (None).

    Equations that switch at a speed are left to one by one.

    Parameters
    ----------
    family : ModelFamily
    items : int
        Number of bicycles.
    """
    if family.evaluate.symbolic.switches:
        return None
    return default_solver() if items >= FEWEST else lapack


def in_batches(outputs: Sequence[str], solver: Solver | None) -> tuple[str, ...]:
    """Those of ``outputs`` that are computed for many bicycles at once: critical speeds compiled only.

    Parameters
    ----------
    outputs : sequence of str
    solver : callable, optional
        As :func:`batch_solver` gives it.
    """
    together = (*(OF_MODES if solver else ()), *(["critical_speeds"] if solver is compiled else ()))
    return tuple(name for name in outputs if name in together)


def block_of(
    model: LinearModel, family: ModelFamily, values: Mapping[str, Any], count: int, solver: Solver
) -> tuple[Any, Done]:
    """The bicycles as a :class:`bicycle.modal.block.Block`, and which of them are none, (m,).

    Parameters
    ----------
    model : LinearModel
        Of one of them.
    family : ModelFamily
    values : mapping of str to array_like, shape () or (m,)
        Every parameter, SI.
    count : int
        Number m of bicycles.
    solver : callable
        As :func:`batch_solver` gives it.
    """
    from bicycle.modal.batch_kind import BatchKind
    from bicycle.modal.block import Block

    found = family.polynomials(values, count, solver=solver)
    unit = np.broadcast_to(np.sqrt(np.asarray(values["g"], float) * values["w"]), count)
    return Block.of(found.polynomial, unit, BatchKind.of(model)), found.refused


def named_outputs(block: Any, speeds: Array, modes: Sequence[str], solver: Solver) -> tuple[Arrays, Done]:
    """``modes``, ``frequencies`` and ``damping_ratios`` of the bicycles of a block, and of which they are sure, (m,).

    Parameters
    ----------
    block : bicycle.modal.block.Block
    speeds : ndarray, shape (m, k)
        m/s.
    modes : sequence of str
        Names along the axis ``mode``.
    solver : callable
        As :func:`batch_solver` gives it.
    """
    from bicycle.modal.batch import name_roots

    found = name_roots(block, speeds, solver=solver)
    two = np.stack([_two(found.values, found.bits == 1 << found.names.index(name)) if name in found.names
                    else np.full((*speeds.shape, 2), np.nan + 0j) for name in modes], 2)  # fmt: skip
    first, second = two[..., 0], two[..., 1]
    has = np.stack([found.every >> found.names.index(name) & 1 if name in found.names else np.zeros(len(speeds), int)
                    for name in modes], 1)  # fmt: skip
    frequencies = np.where(has[:, None, :] > 0, frequency_hz(first), np.nan)
    outputs = {"modes": first, "frequencies": frequencies, "damping_ratios": pair_damping_ratio(first, second)}
    return outputs, np.asarray(found.status == 0)


def _two(values: Complex, own: NDArray[np.bool_]) -> Complex:
    """A pair's upper half, or two real roots, the larger first, of the ``own`` roots (m, k, n); NaN where none."""
    shown = own & (values.imag >= 0)
    height = np.where(shown, values.imag, -1.0)
    found = np.full((*values.shape[:2], 2), np.nan, complex)
    for number in range(2):  # the fastest oscillation first, then the larger real root: roots rise, the last is larger
        last = values.shape[2] - 1 - height[..., ::-1].argmax(2)[..., None]
        there = np.take_along_axis(height, last, 2)[..., 0] >= 0
        found[..., number] = np.where(there, np.take_along_axis(values, last, 2)[..., 0], np.nan)
        np.put_along_axis(height, last, -1.0, 2)
    return found


def critical_output(
    block: Any, max_speed: float, modes: Sequence[str], changes: Sequence[str], occurrences: int
) -> tuple[NDArray[np.float64], Done]:
    """``critical_speeds`` of the bicycles of a block (m, modes + 1, changes, occurrences), m/s, and which are sure.

    One with more occurrences than there is room for is left to one by one, which says so.

    Parameters
    ----------
    block : bicycle.modal.block.Block
    max_speed : float
        m/s.
    modes : sequence of str
        Names along the axis ``mode``; all others come last.
    changes : sequence of str
        ``destabilising`` and ``stabilising``, in their order.
    occurrences : int
        Number of those of one mode and direction that there is room for.
    """
    from bicycle.critical.batch import critical_speeds_of
    from bicycle.modal.batch import name_of

    found = critical_speeds_of(block, max_speed)
    result = np.full((len(found.status), len(modes) + 1, len(changes), occurrences), np.nan)
    sure = np.asarray(found.status == 0)
    place = {int(bits): name_of(int(bits), found.names) for bits in np.unique(found.bits)}
    row = {bits: modes.index(name) if name in modes else len(modes) for bits, name in place.items()}
    for bicycle, speed, rises, bits in zip(
        found.bicycle.tolist(), found.speed.tolist(), found.destabilising.tolist(), found.bits.tolist(), strict=True
    ):
        own = result[bicycle, row[bits], changes.index("destabilising" if rises else "stabilising")]
        free = np.flatnonzero(np.isnan(own))
        if free.size:
            own[free[0]] = speed
        else:
            sure[bicycle] = False
    return result, sure
