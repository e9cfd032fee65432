"""Standard deviations of measured eigenvalues: as stated, by the scatter of repeats, or assumed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from bicycle.identification.scatter import Repeats, repeats, surprise
from tyre.ground.arrays import Array

if TYPE_CHECKING:
    from studies.diagnosis.modal import ModalPoint

SD = ("real_sd_1_s", "imag_sd_rad_s")
DEFAULT_SD = 0.03  # of |eigenvalue|, without sd and repeats
DEFAULT_RATIO_SD = 0.05  # of both parts of a ratio of two rates
FEWEST_REPEATS = 5  # degrees of freedom of all repeats together


def fill_sd(points: tuple["ModalPoint", ...], has_sd: Sequence[bool]) -> tuple[tuple["ModalPoint", ...], list[str]]:
    """Points with missing standard deviations filled in, by repeats or default, and refuted ones widened; and notes.

    ``has_sd``: the table states that of the real part, of the imaginary part. A real root gets 0 for its frequency.
    """
    is_real = np.array([point.eigenvalue.imag == 0 and point.sd[1] == 0 for point in points])
    oscillating = tuple(point.drop_frequency() if real else point for point, real in zip(points, is_real, strict=True))
    real_sd, real_notes = _sd_of_part(points, 0, stated=has_sd[0])
    imag_sd, imag_notes = _sd_of_part(oscillating, 1, stated=has_sd[1])
    imag_sd = np.where(is_real, 0.0, imag_sd)
    notes = [*real_notes, *imag_notes]
    if is_real.any():
        notes.append(f"{is_real.sum()} roots are real: they have no frequency that could be off, so it is not counted")
    filled = []
    ratio_assumed = False
    for point, *sd in zip(points, real_sd.tolist(), imag_sd.tolist(), strict=True):
        ratio_assumed = ratio_assumed or any(ratio_sd == 0 for _, ratio_sd in point.ratios.values())
        ratios = {name: (value, ratio_sd or DEFAULT_RATIO_SD) for name, (value, ratio_sd) in point.ratios.items()}
        filled.append(replace(point, sd=(sd[0], sd[1]), ratios=ratios))
    if ratio_assumed:
        notes.append(f"a shape ratio without sd: {DEFAULT_RATIO_SD:g} is assumed for both parts")
    return tuple(filled), notes


@dataclass(frozen=True, eq=False)
class _ModeRows:
    """Rows of one mode at one setting, of which one part of the eigenvalue was measured."""

    rows: list[int]  # (k,), their indices among all rows
    speeds: list[float]  # (k,), m/s
    values: list[float]  # (k,), 1/s or rad/s
    stated_sd: list[float]  # (k,), in the unit of the values; 0 where none is stated

    @property
    def scatter(self) -> Repeats:
        """Scatter of repeats about a smooth law in speed: sd of each row, degrees of freedom, and outliers."""
        return repeats(self.speeds, self.values, self.stated_sd)


def _sd_of_part(points: tuple["ModalPoint", ...], part: int, *, stated: bool) -> tuple[Array, list[str]]:
    """Sd (n,) of the real parts (``part`` 0, 1/s) or imaginary parts (1, rad/s) of all ``points``, and notes."""
    name = SD[part]
    stated_sd = np.array([point.sd[part] for point in points])
    parts = np.array([(point.eigenvalue.real, point.eigenvalue.imag) for point in points])
    default = DEFAULT_SD * np.linalg.norm(np.nan_to_num(parts), axis=1)
    if np.isnan(parts[:, part]).all():
        return default, []
    groups = _group_repeats(points, parts[:, part], stated_sd)
    scatters = [(group.rows, group.scatter) for group in groups]
    freedom = sum(scatter.freedom for _, scatter in scatters)
    if stated and (freedom < FEWEST_REPEATS or not _is_sd_refuted(groups)):
        return np.where(stated_sd > 0, stated_sd, default), []
    if freedom < FEWEST_REPEATS:
        reason = (
            f"too few repeats ({freedom} of {FEWEST_REPEATS} degrees of freedom)" if freedom else "there are no repeats"
        )
        return default, [f"{name} is missing and {reason}: {DEFAULT_SD:.0%} of |eigenvalue| is assumed"]
    sd = stated_sd.copy()
    for rows, scatter in scatters:
        if stated or scatter.freedom:
            sd[rows] = scatter.sd
    assumed = sd == 0  # a mode without repeats among others with
    sd[assumed] = default[assumed]
    if assumed.all():  # a real mode has no frequency that could scatter
        notes = [f"{name} is missing and repeats do not differ: {DEFAULT_SD:.0%} of |eigenvalue| is assumed"]
    elif stated:
        notes = _describe_widening(name, sd, stated_sd)
    else:
        notes = _describe_scatter(name, sd, assumed, freedom)
    for rows, scatter in scatters:
        for place in scatter.aside:
            point = points[rows[place]]
            notes.append(
                f"{name}: the {point.label} at {point.speed:g} m/s is outside the scatter of its repeats; it "
                f"alone is widened, to {sd[rows[place]]:.3g}"
            )
    return sd, notes


def _group_repeats(points: tuple["ModalPoint", ...], values: Array, stated_sd: Array) -> list[_ModeRows]:
    """Group the rows whose value (n,) is not NaN by mode and settings, in the order in which these first occur."""
    rows_by_mode: dict[str, list[int]] = {}
    for row in np.flatnonzero(~np.isnan(values)).tolist():
        rows_by_mode.setdefault(points[row].label, []).append(row)
    return [
        _ModeRows(rows, [points[row].speed for row in rows], values[rows].tolist(), stated_sd[rows].tolist())
        for rows in rows_by_mode.values()
    ]


def _is_sd_refuted(groups: Sequence[_ModeRows]) -> bool:
    """True if repeats of all modes scatter more than chance (1 %) allows with the stated sd."""
    surprises = [surprise(group.speeds, group.values, group.stated_sd, tolerance=0.01) for group in groups]
    chi2 = sum(squares for squares, _ in surprises)
    freedom = max(sum(degrees for _, degrees in surprises), 1)
    return bool(chdtrc(freedom, chi2) < 0.01)


def _describe_scatter(name: str, sd: Array, assumed: NDArray[np.bool_], freedom: int) -> list[str]:
    """Notes on missing sd that repeats gave, with ``freedom`` degrees; in ``assumed`` rows (n,) the default stands."""
    notes = [
        f"{name} is missing: the scatter of repeats ({freedom} degrees of freedom) is used, {_extremes(sd[~assumed])}"
    ]
    if assumed.any():
        notes.append(f"{name}: {assumed.sum()} rows of modes without repeats; {DEFAULT_SD:.0%} is assumed there")
    return notes


def _describe_widening(name: str, sd: Array, stated_sd: Array) -> list[str]:
    """Note on rows whose ``stated_sd`` (n,) repeats widened to ``sd`` by 0.1 % or more; empty if there is none."""
    wider = sd > 1.001 * stated_sd
    if not wider.any():
        return []
    return [
        f"repeats scatter more than {name} says: {wider.sum()} of {len(sd)} rows are widened, to {_extremes(sd[wider])}"
    ]


def _extremes(values: Array) -> str:
    """Smallest and largest of ``values`` (n,) as text, once if they print alike."""
    return " to ".join(dict.fromkeys((f"{values.min():.3g}", f"{values.max():.3g}")))
