"""Standard deviation of a measured frequency response, the same for real and imaginary part.

It is stated, or follows from coherence gamma^2 and number n of averages,

    sd = |H| sqrt((1 - gamma^2) / (2 gamma^2 n))

(Bendat & Piersol, Random Data, ch. 9: relative error of the gain, and error of the phase in rad). As the noise itself
was estimated from n - 1 differences, its square is widened by n / (n - 2): squares of errors over sd are then 1 on
average (variance of Student's t).
"""

import math
from pathlib import Path

import numpy as np

from tyre.base.arrays import Array, Complex
from tyre.base.csv_table import Columns
from tyre.base.errors import InputError
from tyre.base.plausible import LARGEST

NOISE = ("sd", "sd_db", "coherence", "averages")
FEWEST_AVERAGES = 4


def noise(path: Path, columns: Columns, gain: Complex, relative: float | None) -> tuple[Array, tuple[str, ...]]:
    """One sd (n,) of both parts of a gain, in its unit, and notes.

    Parameters
    ----------
    path : Path
        Of the table, for messages.
    columns : Columns
        As read.
    gain : ndarray of complex, shape (n,)
        In any unit.
    relative : float, optional
        Of each gain, without unit: what the measurement file states.

    Raises
    ------
    InputError
        Noise in no form or in two, a coherence or number of averages out of range.
    """
    there = [name for name in NOISE if name in columns.numbers]
    stated = [name for name in ("sd", "sd_db") if name in there]
    if relative is not None:
        if stated or "coherence" in there:
            raise InputError(f"[frequency_response]: relative_sd, but {path} has {', '.join(there)}; keep one")
        return relative * np.abs(gain), (f"{relative:.2g} of each gain is taken as its sd",)
    if len(stated) > 1 or ("sd_db" in stated and "gain_db" not in columns.numbers):
        raise InputError(f"{path}: sd_db belongs to gain_db, and sd to the gain in its own unit; give one of them")
    if stated:
        unused = [name for name in there if name not in stated]
        notes = (f"{', '.join(unused)}: read, but not used, for {stated[0]} is there",) if unused else ()
        sd = columns.numbers[stated[0]]
        for row in np.flatnonzero(sd > LARGEST):
            raise InputError(
                f"{path}, line {columns.lines[row]}: {stated[0]} = {sd[row]:g} must be {LARGEST:g} or less; leave the "
                "row out if it tells nothing"
            )
        return (np.abs(gain) * math.log(10) / 20 * sd if stated == ["sd_db"] else sd), notes
    if not {"coherence", "averages"} <= set(there):
        raise InputError(
            f"{path}: no noise; give the column sd (of real and imaginary part), or coherence and averages"
        )
    return of_coherence(path, columns, gain), ()


def of_coherence(path: Path, columns: Columns, gain: Complex) -> Array:
    """Standard deviation (n,) of both parts of a ``gain`` (n,) in its own unit, see the head of this file.

    Parameters
    ----------
    path : Path
        Of the table, for messages.
    columns : Columns
        With ``coherence`` (gamma^2) and ``averages``.
    gain : ndarray of complex, shape (n,)
        In any unit.
    """
    coherence, averages = columns.numbers["coherence"], columns.numbers["averages"]
    for row, line in enumerate(columns.lines):
        if not 0 < coherence[row] < 1:
            raise InputError(
                f"{path}, line {line}: coherence = {coherence[row]:g} must lie between 0 and 1 (gamma^2); "
                "where it is 1 there was one average, or no noise: give sd"
            )
        if not averages[row] >= FEWEST_AVERAGES:
            raise InputError(
                f"{path}, line {line}: averages = {averages[row]:g}; with fewer than {FEWEST_AVERAGES} the coherence "
                "says nothing of the noise"
            )
    return np.asarray(np.abs(gain) * np.sqrt((1 - coherence) / coherence / (2 * (averages - 2))))
