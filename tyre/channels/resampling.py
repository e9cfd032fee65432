"""Channels of several rates on one time base, where a channel map asks for it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tyre.base.arrays import Array
from tyre.base.checks import number, text
from tyre.base.errors import InputError
from tyre.base.schema import maybe, read, table
from tyre.channels.clock import GAP

TABLE = table({maybe("rate_hz"): number(above=0), maybe("like"): text(blank=False)})
_NEAR = 1e-3  # of a step: samples so near to the even times are there already


@dataclass(frozen=True)
class Resampling:
    """Linear interpolation at equal steps of a ``rate`` in Hz, or at the times of the channel ``like``."""

    rate: float = 0.0
    like: str = ""


def read_resampling(content: Any, *, where: str) -> Resampling:
    """The table ``[resampling]``.

    Parameters
    ----------
    content : object
        What the file holds.
    where : str
        What a message begins with.

    Raises
    ------
    InputError
        An unknown key, none, or both.
    """
    given = read(TABLE, content, where=where, section="resampling")
    if len(given) != 1:
        raise InputError(f"{where}: [resampling]: give either rate_hz or like")
    return Resampling(given.get("rate_hz", 0.0), given.get("like", ""))


def resampled(
    times: Mapping[str, Array], values: Mapping[str, Array], how: Resampling, *, where: str
) -> tuple[Array, dict[str, Array], tuple[str, ...]]:
    """All channels at the same times, within the span that all of them cover.

    Parameters
    ----------
    times, values : mapping of str to ndarray, shape (n,)
        Of every channel, times in s; each channel may have its own n.
    how : Resampling
    where : str
        What a message begins with.

    Returns
    -------
    time : ndarray, shape (m,)
        s.
    values : dict of str to ndarray, shape (m,)
        NaN inside gaps of a channel.
    notes : tuple of str
        What was done to which channel.

    Raises
    ------
    InputError
        No common span, or ``like`` names no channel.
    """
    first, last = max(t[0] for t in times.values()), min(t[-1] for t in times.values())
    if not last > first:
        raise InputError(f"{where}: the channels share no span of time; were they recorded together?")
    if how.like and how.like not in times:
        raise InputError(f"{where}: [resampling]: like = {how.like!r} is no channel; there are {', '.join(times)}")
    if how.like:
        base = times[how.like]
        time = base[(base >= first) & (base <= last)]
    else:
        time = first + np.arange(int(np.floor((last - first) * how.rate * (1 + 1e-12))) + 1) / how.rate
    if time.size < 2:
        raise InputError(f"{where}: resampling leaves {time.size} samples; take a higher rate")
    found, notes = {}, []
    rate = (time.size - 1) / (time[-1] - time[0])
    for name, own in times.items():
        if own.size == time.size and np.array_equal(own, time) and how.like:
            found[name] = values[name]
            continue
        found[name] = _at(time, own, values[name])
        missing = np.count_nonzero(~np.isfinite(values[name]))
        if _there_already(own, time):
            x = values[name][: time.size]
            found[name] = np.where(np.isfinite(x), x, found[name])
            filled = np.count_nonzero(np.isfinite(found[name]) & ~np.isfinite(x))
            if missing:
                notes.append(f"{name}: {filled} of {missing} missing samples filled by linear interpolation")
            continue
        old = (own.size - 1) / (own[-1] - own[0])
        fewer = "; no filter was applied, faster oscillations are mirrored" if old > 1.01 * rate else ""
        lost = f"; {missing} samples were missing" if missing else ""
        same = f"{old:.6g}" == f"{rate:.6g}"
        change = f"put at even steps of {rate:.6g} Hz" if same else f"resampled from {old:.6g} Hz to {rate:.6g} Hz"
        notes.append(f"{name}: {change} by linear interpolation{lost}{fewer}")
    return time, found, tuple(notes)


def _there_already(own: Array, time: Array) -> bool:
    """Whether samples at ``own`` times are at the even ones but for rounding (and one that these leave out)."""
    if not 0 <= own.size - time.size <= 1:
        return False
    return bool(np.abs(own[: time.size] - time).max() <= _NEAR * (time[1] - time[0]))


def _at(time: Array, own: Array, values: Array) -> Array:
    """Linear interpolation; NaN where the samples on both sides are further apart than a gap."""
    there = np.isfinite(values)
    if np.count_nonzero(there) < 2:
        return np.full(time.shape, np.nan)
    known, x = own[there], values[there]
    found = np.interp(time, known, x, left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(known, time), 1, known.size - 1)
    wide = known[after] - known[after - 1] > GAP * np.median(np.diff(own))
    found[wide & ~np.isin(time, known)] = np.nan
    return np.asarray(found, float)
