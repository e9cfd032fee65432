"""What recordings of one campaign must agree on before they may be averaged."""

import math
from collections.abc import Iterable, Sequence
from itertools import combinations
from pathlib import Path

import numpy as np

from tyre.bands import BANDS, doubts
from tyre.base.errors import InputError
from tyre.base.plausible import suspicion
from tyre.base.units import PASCAL_PER_BAR
from tyre.campaigns.summary import RecordingSummary

POSSIBLE = {
    "cornering_stiffness_per_load": (2.0, 60.0),
    "lateral_stiffness": (5e3, 1e6),
    "relaxation_length": (3e-3, 3.0),
}
"""What a tyre of any vehicle may have, SI; what is usual of a bicycle's: :mod:`tyre.bands`."""
_TRAIL_SD = 0.02  # m; a trail known worse is not judged
COPY = 1e-9  # relative: two fits closer than this come from the same numbers
REPRINT = 1e-4  # relative: closer than this, perhaps the same recording printed twice
SPREAD = 0.05  # relative range of repeats that is said
FRICTION = 0.25  # share of the largest force
NEAR = 0.02  # relative: conditions closer than this were perhaps meant to be one


def refuse_infinite(summary: RecordingSummary, path: Path) -> None:
    """Refuse a ``summary`` of the recording ``path`` with a number that is infinite.

    Raises
    ------
    InputError
        It names the file and the number.
    """
    found = {"value": summary.value, "sd": summary.fit_sd, "R^2": summary.r_squared, **summary.details}
    for name, number in found.items():
        if isinstance(number, float) and math.isinf(number):
            raise InputError(
                f"{path}: {name} came out as {number:g}; numbers of the recording are too large or too small to be "
                "fitted, see its units"
            )


def check_plausible(summary: RecordingSummary, path: Path) -> tuple[str, ...]:
    """What is unusual of a fitted recording, with the unit it may be in; a stiffness that no tyre has is refused.

    Parameters
    ----------
    summary : RecordingSummary
    path : Path
        Of the recording, for the message.

    Returns
    -------
    tuple of str
        One sentence for each value outside the bands of :mod:`tyre.bands`.

    Raises
    ------
    InputError
        A fitted value outside ``POSSIBLE``.
    """
    load = summary.condition.load
    name = {"slip_sweep": "cornering_stiffness_per_load", "pull_test": "lateral_stiffness"}.get(
        summary.kind, "relaxation_length"
    )
    values: dict[str, float | None] = {name: summary.value / load if summary.kind == "slip_sweep" else summary.value}
    if summary.kind == "slip_sweep":
        values["largest_force_per_load"] = summary.details.get("largest_force_N", np.nan) / load
        values["pneumatic_trail"] = summary.details.get("pneumatic_trail_m")
        if summary.details.get("pneumatic_trail_sd_m", 0.0) > _TRAIL_SD:
            values["pneumatic_trail"] = None
    said = doubts(values)
    (low, high), value, band = POSSIBLE[name], values[name], BANDS[name]
    if value is not None and not low <= value <= high:
        why = suspicion(value, unit=band.unit, typical=band.typical, further=band.slips)
        raise InputError(
            f"{path}: {band.words} is {value:.3g} {band.unit}; a tyre has {low:g} to {high:g}, so a column is in "
            f"another unit than its name says{why}"
        )
    return tuple(doubt.text for doubt in said)


def check_repeats(recordings: Sequence[RecordingSummary], label: str) -> None:
    """Refuse to average recordings made on another rim, at another camber or drum, and copies of one recording.

    Copies are recordings of one kind whose fitted numbers differ by less than 1e-9 of their size.

    Parameters
    ----------
    recordings : sequence of RecordingSummary
        Of one condition.
    label : str
        Names the condition in messages.

    Raises
    ------
    InputError
        Naming two recordings that are no repeats of each other.
    """
    for one, other in combinations(recordings, 2):
        for name in ("rim", "camber", "drum_radius"):
            values = [getattr(item.condition, name) for item in (one, other)]
            if values[0] != values[1] and None not in values:
                raise InputError(
                    f"{label}: {one.file} and {other.file} differ in {name} ({values[0]} and {values[1]}); "
                    "they are not repeats, so fit them in folders of their own"
                )
        if one.kind == other.kind and _distance(one, other) < COPY:
            raise InputError(f"{label}: {one.file} and {other.file} hold the same recording; keep one of them")


def repeat_warnings(recordings: Sequence[RecordingSummary]) -> list[str]:
    """What a reader must be told of repeats that disagree, of likely copies and of doubtful pull tests.

    Parameters
    ----------
    recordings : sequence of RecordingSummary
        Of one condition.
    """
    said = []
    for one, other in combinations(recordings, 2):
        if one.kind != other.kind:
            continue
        if _distance(one, other) < REPRINT:
            said.append(f"{one.file} and {other.file} agree to {REPRINT:g}: the same recording twice?")
        if one.kind != "slip_step" and abs(one.value / other.value - 1) > SPREAD:
            said.append(f"{one.file} and {other.file} differ by {100 * abs(one.value / other.value - 1):.1f} %")
    for item in recordings:
        if item.kind != "pull_test":
            continue
        if item.r_squared < 0.98:
            said.append(f"{item.file}: the friction loop fits badly (R^2 {item.r_squared:.3f}); did a gauge slip?")
        share = item.details.get("friction_N", 0.0) / item.details.get("largest_force_N", np.inf)
        if share > FRICTION:
            said.append(f"{item.file}: friction is {100 * share:.0f} % of the largest force")
    return said


def near_conditions(keys: Iterable[tuple[str, str, float, float]]) -> dict[tuple[str, str, float, float], str]:
    """For conditions so close that they were perhaps meant to be one: what to tell of each.

    Parameters
    ----------
    keys : iterable of (tyre, surface, load, pressure)
        N and Pa.
    """
    said = {}
    for one, other in combinations(sorted(keys), 2):
        if (one[0].casefold(), one[1]) == (other[0].casefold(), other[1]) and all(
            abs(a / b - 1) < NEAR for a, b in zip(one[2:], other[2:], strict=True)
        ):
            text = " and ".join(
                f"{tyre}, {load:g} N, {pressure / PASCAL_PER_BAR:g} bar" for tyre, _, load, pressure in (one, other)
            )
            said[one] = said[other] = f"nearly the same condition is taken as two: {text}"
    return said


def _distance(one: RecordingSummary, other: RecordingSummary) -> float:
    """Largest relative difference of the fitted value, its residual and the other fitted numbers."""
    pairs = [(one.value, other.value), (one.fit_sd, other.fit_sd), (one.r_squared, other.r_squared)]
    pairs += [(one.details[key], other.details[key]) for key in ("residual_sd_N",) if key in one.details]
    return max(abs(a - b) / max(abs(a), abs(b), 1e-300) for a, b in pairs)
