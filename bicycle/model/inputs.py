"""Inputs over time: pulses, steps, doublets and recorded histories."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError


@dataclass(frozen=True, eq=False)
class InputHistory:
    """``value[k]`` (SI) holds from ``time[k]`` (s, increasing) to the next; before the first the input is zero.

    With ``linear`` it goes straight from each value to the next, as samples of a recording are read; the last holds.

    Raises
    ------
    InputError
        Times that do not increase, unequal lengths, values that are not finite.
    """

    time: Array  # (k,), s
    value: Array  # (k,), SI unit of the input
    linear: bool = False

    def __repr__(self) -> str:
        course = "straight between times" if self.linear else "constant from each time on"
        return (
            f"<InputHistory: {self.time.size} times, {self.time[0]:g} to {self.time[-1]:g} s, {course}; "
            f"values {self.value.min():g} to {self.value.max():g}>"
        )

    def __post_init__(self) -> None:
        time, value = (np.atleast_1d(np.asarray(values, float)) for values in (self.time, self.value))
        if time.shape != value.shape or time.ndim != 1 or not time.size:
            raise InputError(f"an input has {time.size} times and {value.size} values; give one value for each time")
        if not (np.isfinite(time).all() and np.isfinite(value).all()):
            raise InputError("an input has a time or value that is not finite")
        if (np.diff(time) <= 0).any():
            raise InputError("the times of an input must increase")
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "value", value)

    def at(self, time: ArrayLike) -> Array:
        """Value just after each ``time`` (s)."""
        t = np.asarray(time, float)
        return self._from(t, np.searchsorted(self.time, t + _rounding(t), side="right"))

    def before(self, time: ArrayLike) -> Array:
        """Value just before each ``time`` (s)."""
        t = np.asarray(time, float)
        return self._from(t, np.searchsorted(self.time, t - _rounding(t), side="left"))

    def _from(self, time: Array, begun: NDArray[np.intp]) -> Array:
        if self.linear:
            return np.where(begun > 0, np.interp(time, self.time, self.value), 0.0)
        return np.asarray(np.concatenate([[0.0], self.value])[begun])


def _rounding(time: Array) -> Array:
    """Time (s) within which a sample is at a jump, whatever rounding made of 0.2 + 0.4: 16 steps of its last bit."""
    return np.asarray(16 * np.spacing(np.abs(time)))


def step(size: float, *, start: float = 0.0) -> InputHistory:
    """An input that is zero until ``start`` (s) and ``size`` (SI) from then on."""
    return InputHistory(np.array([start]), np.array([size]))


def pulse(size: float, *, start: float = 0.0, duration: float) -> InputHistory:
    """An input that is ``size`` (SI) from ``start`` (s) for ``duration`` (s), and else zero."""
    _check_duration("pulse", duration)
    return InputHistory(np.array([start, start + duration]), np.array([size, 0.0]))


def doublet(size: float, *, start: float = 0.0, duration: float) -> InputHistory:
    """An input that is ``size`` (SI) from ``start`` (s), then ``-size``, each for half of ``duration`` (s)."""
    _check_duration("doublet", duration)
    return InputHistory(start + duration * np.array([0.0, 0.5, 1.0]), np.array([size, -size, 0.0]))


def _check_duration(name: str, duration: float) -> None:
    if not duration > 0:
        raise InputError(f"the duration of a {name} is {duration:g} s; it must be positive")
