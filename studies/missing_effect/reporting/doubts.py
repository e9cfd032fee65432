"""Gaps that no physics makes: channels in other units or of the other sign, absurd or faint data, another bicycle."""

import math
from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from bicycle.identification.recording import AS_LINEAR, INPUTS
from studies.inference.fit import Fit, fit
from studies.inference.joint import JointForward
from studies.inference.moved import moved
from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.motion.bicycle_forward import BicycleForward
from studies.missing_effect.motion.canonical_forward import CanonicalForward
from studies.missing_effect.motion.history_forward import HistoryForward
from studies.missing_effect.motion.modal_forward import ModalForward
from studies.missing_effect.reporting.words import ADJUSTED, explains
from tyre.base.arrays import Array

ABSURD = 1e4  # chi^2 a number, with the parameters adjusted
NEAR, CONSISTENT = 0.15, 0.3  # relative: of the middle of some ratios to a known factor, of most of them to it
CLOSE, CLOSER = 0.8, 0.6  # relative: of what a factor leaves to the values, and to what is left without it
FEWEST = 3  # values or runs that agree
GAP = 25.0  # chi^2 a number of a series that is worth a doubt
FAINT = 0.3  # of the sd of its noise: pure noise of the stated sd has 1
BETTER = 25.0  # chi^2 and penalty, over chi^2 a number: so much better do torques fit that are linear between samples
SELDOM, FARTHEST = 1e-6, 3  # probability of such a sum of squares by chance; parameters that are listed
NAMED = ("named", "class", "tentative")
FACTORS = {
    180 / math.pi: "are they in degrees? Radians are expected",
    math.pi / 180: "were they turned from degrees to radians twice?",
    1000.0: "are they in mm or g? m and kg are expected",
    1 / 1000.0: "are they in km or t? m and kg are expected",
    2 * math.pi: "were they turned from Hz to rad/s twice?",
    1 / (2 * math.pi): "are they in Hz? rad/s is expected",
    -1.0: "is the sign that of the conventions (docs/conventions.md)?",
}
"""Measured over computed, and what to ask."""

FREQUENCY = (2 * math.pi, 1 / (2 * math.pi))
ANGULAR = {factor: FACTORS[factor] for factor in (180 / math.pi, math.pi / 180, -1.0)} | {
    1000.0: "are they in mrad or mrad/s? rad and rad/s are expected",
}
LINEAR = {
    1000.0: "are they in mm/s^2? m/s^2 is expected",
    1 / 9.80665: "are they in g? m/s^2 is expected",
    -1.0: FACTORS[-1.0],
}
TORQUES = {
    1000.0: "are they in N mm? N m is expected",
    1 / 9.80665: "are they in kgf m? N m is expected",
    -1.0: FACTORS[-1.0],
}
"""The same of a channel: of angles and their rates, of accelerations, of torques."""


def doubts(diagnosis: Diagnosis, torque: Fit | None = None) -> tuple[str, ...]:
    """What of the data of a ``diagnosis``, or of its bicycle, is surely not as stated, in words.

    Parameters
    ----------
    diagnosis : Diagnosis
    torque : Fit, optional
        The named model with a residual torque, where one was fitted.
    """
    forward = diagnosis.forward
    found: list[str] = []
    if isinstance(forward, ModalForward):
        found += _of_frequencies(forward)
    if isinstance(forward, ModalForward | CanonicalForward):
        found += _of_values(diagnosis, *forward.measured)
    if isinstance(forward, HistoryForward) and len(forward.noise) > 1:
        found += _of_channels(forward)
    if isinstance(forward, HistoryForward):
        found += _faint(forward)
    n, adjusted = len(diagnosis.nominal), diagnosis.hypotheses.null.chi2
    if not found and adjusted > ABSURD * n and diagnosis.verdict.verdict not in NAMED:
        found.append(
            f"chi^2 is {adjusted / n:.2g} a number even with the parameters adjusted: check the units, the signs, the "
            "speeds (m/s) and the stated standard deviations before anything else"
        )
    if not found and isinstance(forward, BicycleForward | JointForward):
        found += _of_the_bicycle(diagnosis)
    if isinstance(forward, HistoryForward):
        found += _between_samples(diagnosis, forward, torque)
    return tuple(found)


def known_factor(ratio: float, known: Collection[float] = tuple(FACTORS)) -> float | None:
    """The factor among the ``known`` that a measured over computed ``ratio`` is near; None where there is none."""
    return next((f for f in known if abs(ratio / f - 1) < NEAR), None)


def _of_values(diagnosis: Diagnosis, measured: Array, sd: Array) -> list[str]:
    """Series whose values a known factor brings near those of the base model, which are far off without it."""
    rows, residual = diagnosis.forward.rows, diagnosis.nominal
    series = np.array(rows.series)
    found: dict[str, list[str]] = {}
    roots = [name for name in rows.series if _is_frequency(name)] if isinstance(diagnosis.forward, ModalForward) else []
    for name in dict.fromkeys(rows.series):
        here = series == name
        if name in roots or here.sum() < FEWEST or not (residual[here] ** 2).mean() > GAP:
            continue
        seen, computed = measured[here], (measured - sd * residual)[here]
        rest = {
            factor: float(np.linalg.norm(seen - factor * computed)) for factor in FACTORS if factor not in FREQUENCY
        }
        best = min(rest, key=lambda factor: rest[factor])
        if _brings_near(seen, rest[best], float(np.linalg.norm(seen - computed))):
            found.setdefault(_asked(best), []).append(_words(rows.show(name).channel, rows.show(name).quantity))
    return [f"{', '.join(names)}: {asked}" for asked, names in found.items()]


def _brings_near(seen: Array, rest: float, without: float) -> bool:
    return rest < CLOSE * float(np.linalg.norm(seen)) and rest < CLOSER * without


def _of_frequencies(forward: ModalForward) -> list[str]:
    """Imaginary parts that are frequencies in Hz, or were turned twice: the measured roots decide which is compared."""
    nominal = np.array([u.centre for u in forward.nuisances])
    here = np.array([_is_frequency(name) for name in forward.rows.series])
    seen = forward.measured[0][here]
    found: dict[float, float] = {}
    for factor in (1.0, *FREQUENCY):
        points = tuple(
            replace(p, eigenvalue=complex(p.eigenvalue.real, p.eigenvalue.imag / factor)) for p in forward.points
        )
        trial = replace(forward, points=points)
        residual, _ = trial.residual((), nominal, slopes=False)
        rest = float(np.linalg.norm((trial.measured[1] * residual)[here])) * factor
        found[factor] = rest if math.isfinite(rest) else math.inf
    without = found.pop(1.0)
    best = min(found, key=lambda factor: found[factor])
    named = ", ".join(dict.fromkeys(f"{p.mode} (imaginary part, rad/s)" for p in forward.points))
    if here.sum() < FEWEST or not seen.any() or not _brings_near(seen, found[best], without):
        return []
    return [f"{named}: {_asked(best)}"]


def _is_frequency(series: str) -> bool:
    """Whether a series of modal data is the imaginary part of an eigenvalue, and not of a ratio."""
    return series.endswith(", imaginary") and " over " not in series


def _words(channel: str, quantity: str) -> str:
    return f"{channel} ({quantity})" if quantity else channel


def _of_channels(forward: HistoryForward) -> list[str]:
    """Channels that are all off by a known factor from what the others make of the base model's motion.

    Of the initial state x and the factor h of one channel, |Phi x + forced - h measured| over all channels is least.
    """
    names = tuple(forward.noise)
    nominal = np.array([u.centre for u in forward.nuisances])
    family = forward.family(())
    states = len(family.symbolic.declared.states)
    forced, free = forward.replay_of(names).free(family, nominal)
    ratios: dict[str, float] = {}
    for c, name in enumerate(names):
        found = []
        for k, run in enumerate(forward.runs):
            n = len(run.time)
            weight = np.array([1 / (np.std(run.channels[other]) or 1.0) for other in names])
            phi = np.moveaxis(free[k, :, :n, :states], 0, 1) * weight[:, None]
            rest = forced[k, :, :n].T * weight
            seen = np.stack([run.channels[other] for other in names], 1) * weight
            column = np.where(np.arange(len(names)) == c, -seen, 0.0)
            target = np.where(np.arange(len(names)) == c, 0.0, seen) - rest
            matrix = np.column_stack([phi.reshape(-1, phi.shape[-1]), column.ravel()])
            if np.isfinite(matrix).all():
                scale = np.linalg.norm(matrix, axis=0)
                scale[scale == 0] = 1.0
                h = np.linalg.lstsq(matrix / scale, target.ravel(), rcond=1e-9)[0][-1] / scale[-1]
                found.append(1 / h if h else math.inf)
        if len(found) >= FEWEST:
            ratio = float(np.median(found))
            factor = known_factor(ratio, _factors(name))
            if factor is not None and np.mean([abs(x / factor - 1) < CONSISTENT for x in found]) > 0.7:
                ratios[name] = factor
    wrong = {name: factor for name, factor in ratios.items() if abs(factor) >= 1} or ratios
    if wrong and all(factor == -1 for factor in wrong.values()) and len(wrong) == len(names) == 2:
        return [f"{names[0]} or {names[1]}: {_asked(-1.0)}"]
    return [f"{name}: {_asked(factor, _factors(name))}" for name, factor in wrong.items()]


def _faint(forward: HistoryForward) -> list[str]:
    """Channels that move less than their own noise in every run."""
    moved = {
        name: max(float(np.sqrt(np.mean(run.channels[name] ** 2))) for run in forward.runs) for name in forward.noise
    }
    return [
        f"{name}: its root mean square is {size:.2g} at most, of a noise with sd {forward.noise[name].sd:.2g}: it "
        "tells next to nothing; is the unit right, and that of noise_sd?"
        for name, size in moved.items()
        if size < FAINT * forward.noise[name].sd
    ]


def _between_samples(diagnosis: Diagnosis, forward: HistoryForward, torque: Fit | None) -> list[str]:
    """Torques that were taken as held from sample to sample, where the data are nearer to linear ones.

    Asked only of what fits, the residual torque included: half a sample imitates part of an effect that is missing.
    """
    if not forward.taken_as_held or (torque is None and diagnosis.verdict.verdict not in (*NAMED, "none")):
        return []
    found = diagnosis.final if torque is None else torque
    least = BETTER * max(1.0, found.objective / len(found.residual))
    linear = replace(forward, runs=tuple(replace(run, between=AS_LINEAR) for run in forward.runs))
    other = fit(linear, found.candidates, starts=[found.theta])
    if not other.objective < found.objective - least:
        return []
    names = ", ".join(name for name in forward.runs[0].inputs if name in INPUTS)
    what = explains(diagnosis.final) if diagnosis.final.candidates else ADJUSTED
    more = "" if torque is None else " and the residual torque"
    return [
        f"{names}: most samples repeat the one before, so it is taken as held from sample to sample; taken as linear "
        f"between them, chi^2 of {len(found.residual)} numbers with {what}{more} is {other.chi2:.5g} in place of "
        f'{found.chi2:.5g}. If it was so, state torque_between_samples = "linear" in [histories]; if it was held, '
        'state "held"'
    ]


def _of_the_bicycle(diagnosis: Diagnosis) -> list[str]:
    """Parameters that went farther, all together, than their standard deviations allow."""
    went = moved(diagnosis.final, diagnosis.final)
    squares, most = sum(m.shift**2 for m in went), float(chi2.isf(SELDOM, max(len(went), 1)))
    if not squares > most:
        return []
    farthest = ", ".join(f"{m.name} {m.shift:+.1f} sd" for m in went[:FARTHEST])
    return [
        f"the parameters went farther than their stated or assumed standard deviations allow ({farthest}; sum of "
        f"squares {squares:.3g} for {len(went)}, and chance makes more than {most:.2g} once in a million at most): is "
        "the bicycle of the file the one that was measured, as it was ridden? An effect that the library lacks, or "
        "deviations that are stated too small, do the same"
    ]


def _factors(channel: str) -> Mapping[float, str]:
    if channel.endswith("_N_m"):
        return TORQUES
    return ANGULAR if channel.endswith(("_rad", "_rad_s")) else LINEAR


def _asked(factor: float, known: Mapping[float, str] = FACTORS) -> str:
    if factor == -1:
        return f"the measured values have the sign opposite to the base model's throughout; {known[factor]}"
    shown = f"{factor:.3g} times" if factor > 1 else f"1/{1 / factor:.3g} of"
    return f"the measured values are about {shown} those of the base model throughout; {known[factor]}"
