"""Statements of time histories that are wrong: channels without a signal, a rider who steers, held torques."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bicycle.identification.recording import AS_LINEAR, INPUTS, STEER, STEER_TORQUE
from studies.diagnosis.candidates import nobody_rides
from studies.diagnosis.doubts import NAMED
from studies.inference.fit import Fit, fit
from studies.inference.judge import Judgement

if TYPE_CHECKING:
    from studies.diagnosis.histories import Histories

BETWEEN = (
    "{inputs}: most samples repeat the one before, so it is treated as held from sample to sample. Treated as linear "
    "between samples, chi^2 of {n} data points with {model} is {other:.5g} instead of {chi2:.5g}. State "
    'torque_between_samples = "linear" in [histories], or "held"'
)
SOMEBODY = "if the rider steers, record the steer torque or ride hands off: no effect of a bicycle replaces a rider"
FAINT = (
    "{channel}: its root mean square is at most {size:.2g} with a noise sd of {sd:.2g}: it holds almost no "
    "information; check its unit and that of noise_sd"
)


def doubt_faint_channels(kind: "Histories") -> list[str]:
    """Sentences, one for each measured channel whose root mean square is below 0.3 sd of its noise in every run."""
    sentences = []
    for channel, noise in kind.noise.items():
        size = max(float(np.sqrt(np.mean(run.channels[channel] ** 2))) for run in kind.runs)
        if size < 0.3 * noise.sd:  # noise of the stated sd has 1
            sentences.append(FAINT.format(channel=channel, size=size, sd=noise.sd))
    return sentences


def doubt_unrecorded_rider(kind: "Histories", judgement: Judgement) -> list[str]:
    """Sentence if the cause is unknown and somebody rides whose steering was not recorded; else none."""
    steering_recorded = {STEER, STEER_TORQUE} & {*kind.runs[0].inputs}
    if judgement.verdict.verdict == "unknown" and not nobody_rides(kind.model) and not steering_recorded:
        return [SOMEBODY]
    return []


def doubt_held_torques(kind: "Histories", judgement: Judgement, torque: Fit | None) -> list[str]:
    """Sentence if torques are taken as held from sample to sample though linear ones fit clearly better; else none.

    The model is the final one, or that of the residual ``torque`` if it was fitted.
    """
    named = judgement.verdict.verdict in (*NAMED, "none")
    if not kind.taken_as_held or not (named or torque is not None):
        return []
    compared = judgement.final if torque is None else torque
    n = len(compared.residual)
    linear = replace(kind, runs=tuple(replace(run, between=AS_LINEAR) for run in kind.runs))
    linear_fit = fit(linear, compared.candidates, starts=[compared.theta])
    if not linear_fit.objective < compared.objective - 25 * max(1.0, compared.objective / n):
        return []
    final = judgement.final
    model = final.name.replace("+", " + ") if final.candidates else "parameters only"
    if torque is not None:
        model += " and the unmodelled torque"
    inputs = ", ".join(name for name in kind.runs[0].inputs if name in INPUTS)
    return [BETWEEN.format(inputs=inputs, n=n, model=model, other=linear_fit.chi2, chi2=compared.chi2)]
