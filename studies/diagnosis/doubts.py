"""Gaps that no physics makes: values in other units or of the other sign, absurd data, another bicycle."""

import math
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from scipy.stats import chi2

from studies.inference.fit import Fit, moved
from studies.inference.judge import Judgement
from studies.inference.kind import Kind
from tyre.arrays import Array

NAMED = ("named", "class", "tentative")
DEGREES, SIGN = 180 / math.pi, "is the sign that of the conventions (docs/conventions.md)?"
FREQUENCY = {
    2 * math.pi: "were they turned from Hz to rad/s twice?", 1 / (2 * math.pi): "are they in Hz? rad/s is expected",
}  # fmt: skip
FACTORS = {
    DEGREES: "are they in degrees? Radians are expected",
    1 / DEGREES: "were they turned from degrees to radians twice?",
    1000.0: "are they in mm or g? m and kg are expected", 1 / 1000.0: "are they in km or t? m and kg are expected",
    -1.0: SIGN,
}  # fmt: skip
"""Measured over computed values, and the question that it raises."""
CHANNELS: dict[str | tuple[str, ...], dict[float, str]] = {
    "_N_m": {
        1000.0: "are they in N mm? N m is expected", 1 / 9.80665: "are they in kgf m? N m is expected", -1.0: SIGN,
    },
    ("_rad", "_rad_s"): {
        DEGREES: FACTORS[DEGREES], 1 / DEGREES: FACTORS[1 / DEGREES], -1.0: SIGN,
        1000.0: "are they in mrad or mrad/s? rad and rad/s are expected",
    },
    "": {
        1000.0: "are they in mm/s^2? m/s^2 is expected", 1 / 9.80665: "are they in g? m/s^2 is expected", -1.0: SIGN,
    },
}  # fmt: skip
"""Measured over computed values of a channel, by the end of its name."""

OFF = "{what}: the measured values are about {size} those of the base model throughout; {asked}"
OPPOSITE = "{what}: the measured values have the sign opposite to the base model's throughout; {asked}"
ABSURD = (
    "chi^2 is {size:.2g} a number even with the parameters adjusted: check the units, the signs, the speeds (m/s) and "
    "the stated standard deviations before anything else"
)
OTHER_BICYCLE = (
    "the parameters went farther than their stated or assumed standard deviations allow ({farthest}; sum of squares "
    "{squares:.3g} for {count}, and chance makes more than {most:.2g} once in a million at most): is the bicycle of "
    "the file the one that was measured, as it was ridden? An effect that the library lacks, or deviations that are "
    "stated too small, do the same"
)


def doubts(
    judgement: Judgement, torque: Fit | None = None, without: Mapping[str, Any] | None = None
) -> tuple[str, ...]:
    """Statements of the data of a ``judgement``, or of its bicycle, that are surely wrong."""
    kind, null = judgement.kind, judgement.hypotheses.null
    if found := kind.doubts(judgement, torque, without):
        return found
    n = len(judgement.nominal)
    if null.chi2 > 1e4 * n and judgement.verdict.verdict not in NAMED:
        return (ABSURD.format(size=null.chi2 / n),)
    if kind.model is None:
        return ()
    went = moved(judgement.final, judgement.final)
    squares, most = sum(m.shift**2 for m in went), float(chi2.isf(1e-6, max(len(went), 1)))
    farthest = ", ".join(f"{m.name} {m.shift:+.1f} sd" for m in went[:3])
    told = OTHER_BICYCLE.format(farthest=farthest, squares=squares, count=len(went), most=most)
    return (told,) if squares > most else ()


def question(what: str, factor: float, known: Mapping[float, str]) -> str:
    """Doubt about ``what`` was measured, whose values are ``factor`` times the computed ones."""
    size = f"{factor:.3g} times" if factor > 1 else f"1/{1 / factor:.3g} of"
    return (OPPOSITE if factor == -1 else OFF).format(what=what, size=size, asked=known[factor])


def channel_factors(channel: str) -> Mapping[float, str]:
    """Factors that a unit or sign makes in a ``channel``, and their questions."""
    return next(known for end, known in CHANNELS.items() if channel.endswith(end))


def known_factor(ratio: float, known: Collection[float]) -> float | None:
    """The factor among the ``known`` that a measured over computed ``ratio`` is within 15 % of; or None."""
    return next((f for f in known if abs(ratio / f - 1) < 0.15), None)


def brings_near(seen: Array, rest: float, without: float) -> bool:
    """True if a factor leaves ``rest`` of the values ``seen``, clearly less than the gap ``without`` it."""
    return rest < 0.8 * float(np.linalg.norm(seen)) and rest < 0.6 * without


def misread_values(kind: Kind, gap: Array, left_out: Collection[str] = ()) -> tuple[str, ...]:
    """Series of a ``kind`` whose values a known factor brings near the computed ones, which leave ``gap`` (n,)."""
    rows, (measured, sd) = kind.rows, kind.data
    series = np.array(rows.series)
    found: dict[float, list[str]] = {}
    for name in dict.fromkeys(rows.series):
        here = series == name
        if name in left_out or here.sum() < 3 or not (gap[here] ** 2).mean() > 25:  # too little, or no gap
            continue
        seen, computed = measured[here], (measured - sd * gap)[here]
        rest = {factor: float(np.linalg.norm(seen - factor * computed)) for factor in FACTORS}
        best = min(rest, key=lambda factor: rest[factor])
        if brings_near(seen, rest[best], float(np.linalg.norm(seen - computed))):
            shown = rows.show(name)
            found.setdefault(best, []).append(
                f"{shown.channel} ({shown.quantity})" if shown.quantity else shown.channel
            )
    return tuple(question(", ".join(names), factor, FACTORS) for factor, names in found.items())
