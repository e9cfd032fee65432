"""The time of samples: what a sound clock is, and what is said or refused of another one."""

from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError

GAP = 5.0
"""A step of so many usual ones is a gap."""

_REPEATED = 1e-6  # of the usual step: less is rounding
_UNEVEN = 0.1  # of the usual step
_LATEST = 1e11  # s, the year 5000
_DRIFT = 1e-3  # relative change of the sample time from the first to the last part of a recording
_PARTS = 10
_ENOUGH = 100_000  # steps that tell how they scatter


@dataclass(frozen=True)
class Clock:
    """Where the time of samples comes from: a ``column`` in ``unit``, or a counter ``index``, or a ``rate`` in Hz."""

    column: str = ""
    unit: str = ""
    index: str = ""
    rate: float = 0.0

    def times(self, values: Array | None, count: int, factor: float, *, where: str) -> Array:
        """Times of samples.

        Parameters
        ----------
        values : ndarray, shape (count,), optional
            Of the column or the counter, in its unit.
        count : int
            How many samples there are.
        factor : float
            From the unit of the column to s.
        where : str
            What a message begins with.

        Returns
        -------
        ndarray, shape (count,)
            s.
        """
        if values is None:
            return np.arange(count) / self.rate
        if self.index:
            if not np.isfinite(values).all() or (values != np.round(values)).any():
                raise InputError(f"{where}: {self.index} does not count samples: it must hold whole numbers")
            return (values - values[0]) / self.rate
        return factor * values


def check_clock(time: Array, *, where: str, lines: int = 1) -> tuple[str, ...]:
    """Refuse a clock that would give wrong results, and say what is odd about another.

    Parameters
    ----------
    time : ndarray, shape (n,)
        s.
    where : str
        What a message begins with.
    lines : int
        Number that messages give the first sample, from 1.

    Returns
    -------
    tuple of str
        Gaps, uneven steps, and a sample time that drifts.

    Raises
    ------
    InputError
        A time that is missing, stands still or runs back.
    """
    missing = np.flatnonzero(~np.isfinite(time))
    if missing.size:
        raise InputError(
            f"{where}: time is missing in {missing.size} of {time.size} samples, first in sample "
            f"{missing[0] + lines}; repair it, or give time = {{rate_hz = ...}} if the samples are equally spaced"
        )
    if time.size < 2:
        return ()
    if np.abs(time[[0, -1]]).max() > _LATEST:
        raise InputError(f"{where}: time reaches {np.abs(time).max():.3g} s, which is no date; check its unit")
    steps = np.diff(time)
    usual = float(np.median(steps[:: 1 + steps.size // _ENOUGH]))
    wrong = np.flatnonzero(steps <= _REPEATED * max(usual, 0.0))
    if wrong.size:
        first = int(wrong[0])
        back = steps[wrong] < -_REPEATED * abs(usual)
        what = "runs back" if back[0] else "repeats"
        raise InputError(
            f"{where}: time {what} at {int(np.count_nonzero(back == back[0]))} samples, first at sample "
            f"{first + 1 + lines} ({time[first]:.10g} s, then {time[first + 1]:.10g} s); cut the recording there, or "
            "give time = {rate_hz = ...} if the samples are equally spaced"
        )
    return _oddities(time, steps, usual)


def _oddities(time: Array, steps: Array, usual: float) -> tuple[str, ...]:
    notes = []
    gaps = np.flatnonzero(steps > GAP * usual)
    if gaps.size:
        notes.append(
            f"time jumps {gaps.size} times by more than {GAP:g} usual steps of {usual:.6g} s, first by "
            f"{steps[gaps[0]]:.6g} s after {time[gaps[0]]:.10g} s"
        )
    elif steps.max() > (1 + _UNEVEN) * usual or steps.min() < (1 - _UNEVEN) * usual:
        notes.append(f"time is uneven: its steps range from {steps.min():.6g} to {steps.max():.6g} s")
    part = steps.size // _PARTS
    if part >= _PARTS:
        first, last = np.median(steps[:part]), np.median(steps[-part:])
        resolution = float(
            np.ptp(np.quantile(steps[:: 1 + steps.size // _ENOUGH], [0.1, 0.9]))
        )  # rounded stamps make medians jump
        if abs(last / first - 1) > _DRIFT and abs(last - first) > resolution / 2:
            notes.append(f"the sample time drifts from {first:.6g} to {last:.6g} s over the recording")
    return tuple(notes)
