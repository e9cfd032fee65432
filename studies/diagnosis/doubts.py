"""Readings in other units or of another sign; data that no model explains, and another bicycle than stated."""

import math
from collections.abc import Mapping

from scipy.special import chdtri

from studies.diagnosis.mistakes import identification_errors
from studies.inference.fit import Fit, compare_nuisances
from studies.inference.judge import Judgement

NAMED = ("named", "class", "tentative")
ANGLES = {
    "of the opposite sign": -1.0, "in degrees": math.pi / 180, "converted from degrees twice": 180 / math.pi,
    "in mrad": 1e-3,
}  # fmt: skip
"""Readings of an angle or its rate, and the factor to the right values."""
TORQUES = {"of the opposite sign": -1.0, "in kgf m": 9.80665, "in N mm": 1e-3}
ACCELERATIONS = {"of the opposite sign": -1.0, "in g": 9.80665, "in mm/s^2": 1e-3}
SPEEDS = {"speeds in km/h": 1 / 3.6, "speeds in mph": 0.44704}
FREQUENCIES = {"in Hz": 2 * math.pi, "converted from Hz twice": 1 / (2 * math.pi)}

ABSURD = (
    "the misfit per data point (chi^2) is {size:.2g} with re-estimated parameters: first check units, signs, speeds "
    "(m/s) and the stated standard uncertainties"
)
OTHER_BICYCLE = (
    "parameter shifts exceed the stated or assumed standard uncertainties ({farthest}): check that the file describes "
    "the bicycle as ridden. A missing effect can cause the same shifts"
)
IDENTIFIED = (
    "an error of the mode identification ({errors}) explains the data as well: compare windows or methods before "
    "relying on a name"
)


def readings_of(column: str) -> Mapping[str, float]:
    """Readings of a ``column`` by the unit at the end of its name, and the factor of each to the right values."""
    if column.endswith("_N_m"):
        return TORQUES
    return ANGLES if column.endswith(("_rad", "_rad_s")) else ACCELERATIONS


def doubts(judgement: Judgement, torque: Fit | None = None) -> tuple[str, ...]:
    """Statements of the data of a ``judgement``, or of its bicycle, that are wrong, or badly paired."""
    return (*judgement.kind.find_mispairings(judgement), *_surely_wrong(judgement, torque))


def _surely_wrong(judgement: Judgement, torque: Fit | None) -> tuple[str, ...]:
    """Sentences on statements of the data that are wrong: of the kind, of a named error, of the bicycle."""
    kind, null = judgement.kind, judgement.hypotheses.null
    if data_doubts := kind.doubts(judgement, torque):
        return data_doubts
    members = {name for hypothesis in judgement.verdict.equivalent for name in hypothesis.split("+")}
    errors = [c.title for c in identification_errors() if c.identifier in members]
    if errors and len(judgement.verdict.equivalent) > 1:
        return (IDENTIFIED.format(errors=", ".join(errors)),)
    n = len(judgement.nominal)
    if null.chi2 > 1e4 * n and judgement.verdict.verdict not in NAMED:
        return (ABSURD.format(size=null.chi2 / n),)
    if kind.model is None:
        return ()
    went = compare_nuisances(judgement.final, judgement.final)
    chance = float(chdtri(max(len(went), 1), 1e-6))  # of the sum of squares: more is rarer than once in a million
    farthest = ", ".join(f"{m.name} {m.shift:+.1f} SD" for m in went[:3])
    return (OTHER_BICYCLE.format(farthest=farthest),) if sum(m.shift**2 for m in went) > chance else ()
