"""Quantiles of any number of samples in little memory, the same however the samples are cut into chunks.

A number is counted in the bin of its leading bits: sign, exponent and ten bits of the mantissa, so a quantile is found
to 2**-11 of its value. Counts are whole numbers and extremes are exact, hence merging is exact in any order.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tyre.ground.arrays import Array

SHIFT = np.uint64(42)  # of 52 mantissa bits, ten are kept
KEY_BITS = np.uint64(22)  # sign, 11 bits of exponent, ten of mantissa
SIGN = np.uint64(1) << np.uint64(63)
EXTREMES = ("min", "max", "min_sample", "max_sample", "count", "above_zero")


def keys(values: Array) -> NDArray[np.uint64]:
    """Bin of each of ``values`` (any shape); bins are ordered like the numbers."""
    bits = np.ascontiguousarray(values + 0.0).view(np.uint64)  # -0 becomes 0
    return np.asarray(np.where(bits & SIGN, ~bits, bits | SIGN) >> SHIFT)


def centre(key: NDArray[np.uint64]) -> Array:
    """Number in the middle of each bin ``key`` (any shape)."""
    ordered = (key << SHIFT) | (np.uint64(1) << (SHIFT - np.uint64(1)))
    return np.where(ordered & SIGN, ordered & ~SIGN, ~ordered).view(np.float64)


def sketch(arrays: dict[str, NDArray[Any]], start: int, samples: int) -> dict[str, NDArray[Any]]:
    """Counts and extremes of arrays over the samples, for every cell of the grid that the items touch."""
    count = len(next(iter(arrays.values())))
    first_cell, last_cell = start // samples, (start + count - 1) // samples + 1
    result: dict[str, NDArray[Any]] = {"cells": np.array([first_cell, last_cell])}
    cell, sample = np.divmod(np.arange(start, start + count), samples)
    for name, array in arrays.items():
        flat = array.reshape(count, -1)
        width = flat.shape[1]
        column = ((cell - first_cell)[:, None] * width + np.arange(width)).astype(np.uint64)
        valid = ~np.isnan(flat)
        bins, counts = np.unique((column[valid] << KEY_BITS) | keys(flat[valid]), return_counts=True)
        result[f"{name}|bins"], result[f"{name}|counts"] = bins, counts
        extremes = np.full((last_cell - first_cell, width, len(EXTREMES)), np.nan)
        for k in range(last_cell - first_cell):
            rows = cell == first_cell + k
            extremes[k] = _extremes(flat[rows], sample[rows])
        result[f"{name}|extremes"] = extremes
    return result


def _extremes(values: Array, sample: NDArray[np.intp]) -> Array:
    low, high = np.where(np.isnan(values), np.inf, values), np.where(np.isnan(values), -np.inf, values)
    found = np.stack(
        [
            low.min(0),
            high.max(0),
            sample[low.argmin(0)],
            sample[high.argmax(0)],
            (~np.isnan(values)).sum(0),
            (high > 0).sum(0),
        ],
        -1,
    ).astype(float)
    found[found[:, 4] == 0, :4] = np.nan
    return found


class Merged:
    """Sketches of one output, merged cell by cell; feed parts in the order of their items."""

    def __init__(self, quantiles: Iterable[float]) -> None:
        self.quantiles = tuple(quantiles)
        self.cell = -1
        self.bins: list[NDArray[np.uint64]] = []
        self.counts: list[NDArray[np.intp]] = []
        self.extremes: list[Array] = []

    def add(self, part: dict[str, NDArray[Any]], name: str) -> list[tuple[int, Array, Array]]:
        """Take in one part; returns (cell, quantiles (width, q), extremes (width, 6)) of cells it completes."""
        done = []
        first, last = part["cells"]
        bins, counts, extremes = (part[f"{name}|{what}"] for what in ("bins", "counts", "extremes"))
        width = extremes.shape[1]
        edges = np.searchsorted(bins >> KEY_BITS, np.arange(last - first + 1, dtype=np.uint64) * np.uint64(width))
        for k, cell in enumerate(range(first, last)):
            if cell != self.cell:
                done += self.finish()
                self.cell = cell
            at = slice(edges[k], edges[k + 1])
            self.bins.append(bins[at] - (np.uint64(k * width) << KEY_BITS))
            self.counts.append(counts[at])
            self.extremes.append(extremes[k])
            self._compact()
        return done

    def finish(self) -> list[tuple[int, Array, Array]]:
        """Return the cell in work, if any, and start anew."""
        if self.cell < 0:
            return []
        self._compact(least=1)
        extremes = self.extremes[0]
        result = (self.cell, _quantiles(self.bins[0], self.counts[0], extremes, self.quantiles), extremes)
        self.cell, self.bins, self.counts, self.extremes = -1, [], [], []
        return [result]

    def _compact(self, least: int = 16) -> None:
        if len(self.bins) < max(least, 2):
            return
        bins, inverse = np.unique(np.concatenate(self.bins), return_inverse=True)
        counts = np.bincount(inverse, np.concatenate(self.counts)).astype(np.intp)  # whole numbers: exact to 2**53
        self.bins, self.counts = [bins], [counts]
        stack = np.array(self.extremes)
        merged = stack.sum(0)  # count and above_zero; whole numbers
        for value, sample, pick in ((0, 2, np.argmin), (1, 3, np.argmax)):
            filled = np.where(np.isnan(stack[..., value]), np.inf if value == 0 else -np.inf, stack[..., value])
            best = pick(filled, axis=0)[None]
            for field in (value, sample):
                merged[:, field] = np.take_along_axis(stack[..., field], best, 0)[0]
        self.extremes = [merged]


def _quantiles(
    bins: NDArray[np.uint64], counts: NDArray[np.intp], extremes: Array, quantiles: tuple[float, ...]
) -> Array:
    """Smallest bin with at least the share q of the samples in or below it, as a number within the extremes."""
    width = len(extremes)
    total = np.concatenate([[0], np.cumsum(counts)])
    edges = np.searchsorted(bins >> KEY_BITS, np.arange(width + 1, dtype=np.uint64))
    below, number = total[edges[:-1]], total[edges[1:]] - total[edges[:-1]]
    result = np.full((width, len(quantiles)), np.nan)
    full = number > 0
    for k, q in enumerate(quantiles):
        rank = below + np.maximum(np.ceil(q * number), 1).astype(np.intp)
        at = np.searchsorted(total[1:], rank[full])
        value = centre(bins[at] & ((np.uint64(1) << KEY_BITS) - np.uint64(1)))
        result[full, k] = np.clip(value, extremes[full, 0], extremes[full, 1])
    return result
