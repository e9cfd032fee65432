"""Sentences of a report, each true of the numbers beside it."""

from studies.inference.contradiction import PartAgainstRest
from studies.inference.identifiability import MORE_PROBABLE
from studies.inference.limits import widening
from studies.inference.moved import moved, share_closed
from studies.inference.odd_part import fits
from studies.inference.part import OF
from studies.inference.sentence import printed
from studies.inference.verdict import Verdict
from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.leading import NO_EFFECT
from studies.missing_effect.motion.history_forward import HistoryForward
from studies.missing_effect.motion.modal_forward import ModalForward
from studies.missing_effect.plan.questions import chosen
from studies.missing_effect.reporting.findings import WORTH_IT, Findings
from studies.missing_effect.reporting.tables import WIDER, penalty, widened
from studies.missing_effect.reporting.words import ADJUSTED, BASE, explains, listed, misfit, number, percent, said
from studies.missing_effect.residual import words
from studies.missing_effect.unfitted import LARGE, Predicted

SAYS = {
    "none": "Nothing is named: the base model with its uncertain parameters explains the measurement.",
    "named": "One hypothesis explains what is missing and is named, relative to the library that was tried.",
    "class": "Something is missing, but these data cannot tell which of several hypotheses it is.",
    "tentative": "One hypothesis explains the measurement, but its name rests on what is stated below.",
    "partial": "An effect is named, but something significant remains; see the rules that do not hold.",
    "unknown": "A gap remains for which nothing in the library can be named; see the rules that do not hold.",
}
"""What each verdict means; the verdict's own sentence says more."""

WORDS = {
    "nominal": f"({BASE})",
    "nuisance_only": f"({ADJUSTED})",
    "final": "(final model)",
    "with_torque": "(with the residual torque)",
}

UNITS = {"_rad_s": " rad/s", "_rad": " rad", "_m_s2": " m/s^2", "_N_m": " N m"}
"""Of channels, by the end of their names."""


def sentence(verdict: Verdict) -> str:
    """The ``verdict`` in a sentence."""
    return verdict.sentence or SAYS[verdict.verdict]


def beside_name(verdict: Verdict, member: str) -> str:
    """That a ``member`` of the class of a ``verdict`` may be it too, and why."""
    why = verdict.reasons.get(member, "")
    begin = "not ruled out is" if why.startswith(MORE_PROBABLE) else "cannot be told apart from"
    return f"{begin} {said(member)}{f': {why}' if why else ''}"


def closing(diagnosis: Diagnosis) -> str:
    """Which share of chi^2 goes by moving parameters, and which with what was named."""
    chi2 = diagnosis.verdict.chi2
    nominal, adjusted, final = chi2["nominal"], chi2["nuisance_only"], chi2["final"]
    told = [f"χ² over {chi2['n']} numbers is {misfit(nominal)} for the base model"]
    if diagnosis.forward.nuisances:
        null = diagnosis.hypotheses.null
        farthest = number(abs(moved(null, null)[0].shift), 2)
        told.append(
            f"{percent(share_closed(nominal, adjusted))} of it goes by moving parameters, by up to {farthest} of "
            f"their stated or assumed standard deviations ({misfit(adjusted)} remain)"
        )
    if diagnosis.final.candidates:
        more = (adjusted - final) / nominal if nominal > 0 else 0.0
        of_it = "more" if diagnosis.forward.nuisances else "of it goes"
        told.append(f"{percent(more)} {of_it} with {explains(diagnosis.final)} ({misfit(final)} remain)")
    return f"{', '.join(told)}."


def fitting(diagnosis: Diagnosis) -> str:
    """What p of the final model of a ``diagnosis`` is made of."""
    final = diagnosis.final
    n, free = len(final.residual), sum(u.size for c in final.candidates for u in c.unknowns)
    who = f"the model with {explains(final)}" if final.candidates else f"the model with {ADJUSTED}"
    numbers = f"{n} numbers" if not free else f"{n} numbers less {free} fitted freely"
    return (
        f"χ² {final.chi2:.1f} + {penalty(final):.1f} penalty for what moved from its prior = {final.objective:.1f} for "
        f"{numbers}: p {printed(diagnosis.verdict.goodness_of_fit_p, 3)} of {who}."
    )


def named_note(diagnosis: Diagnosis) -> str:
    """What the standard deviations of the named effects of a ``diagnosis`` hold."""
    ratio = widened(diagnosis)
    if ratio <= WIDER:
        return "± is one standard deviation, given that nothing else is missing."
    return (
        f"± is one standard deviation, up to {ratio:.2g} times that of the fit alone: it holds what else is possible "
        "or remains unexplained."
    )


def limits_note(diagnosis: Diagnosis) -> str:
    """What the upper limits of a ``diagnosis`` assume."""
    final = diagnosis.final
    beside = f"beside {explains(final)}" if final.candidates else f"beside {ADJUSTED}"
    note = f"With 95 % probability an effect {beside} is no larger than this, given these data and its prior."
    wider = widening(diagnosis.forward, final)
    if wider > 1:
        p = diagnosis.verdict.goodness_of_fit_p
        note += f" As that model does not fit (p {printed(p)}), the noise is taken {wider:.3g} times larger."
    return note


def next_note(findings: Findings) -> str:
    """Which hypotheses a further measurement would tell apart, or why there are none."""
    if findings.settled:
        return findings.settled
    begin = f"{stands(findings)} " if findings.standing is not None else ""
    if not findings.further and len(findings.between) > 1 and findings.least_gain >= WORTH_IT:
        apart, least = told_apart(findings), f"{findings.least_gain:g} sd"
        return f"{begin}Nothing that this kind of data proposes would tell {apart} by as much as {least}."
    if not findings.further or len(findings.between) < 2:
        return "Nothing that this kind of data proposes would tell the leading hypotheses apart."
    wider = " The uncertainty of the parameters is doubled in it, as in the rule that does not hold."
    return (
        f"{begin}How well it tells {told_apart(findings)}: the predicted distance, in standard deviations of what it "
        f"measures.{wider if findings.doubled else ''}"
    )


def stands(findings: Findings) -> str:
    """How firmly the verdict stands, whatever is measured next; empty where it is open or nothing comes near."""
    if findings.standing is None:
        return ""
    surer = ": what follows would make that surer, or overturn it" if findings.further else ""
    told = f"{findings.standing}{surer}."
    return told[:1].upper() + told[1:] if told.startswith(f"{NO_EFFECT} ") else told


def plan_note(diagnosis: Diagnosis) -> str:
    """How to weigh measurements against their price, where a plan finds something open; begins with a blank."""
    if not isinstance(diagnosis.forward, ModalForward | HistoryForward) or len(chosen(diagnosis)) < 2:
        return ""
    return (
        " `velotyre plan`, with your prices, finds the cheapest set of runs, channels and bench tests that settles it."
    )


def told_apart(findings: Findings) -> str:
    """What a further measurement tells from what."""
    leader, *rivals = map(said, findings.between)
    return f"{leader} from {'the nearest of ' if len(rivals) > 1 else ''}{listed(rivals)}"


def odd_note(diagnosis: Diagnosis, findings: Findings) -> str:
    """Without which part everything else fits, where all together do not; empty where that singles none out."""
    odd, n = findings.odd, diagnosis.verdict.chi2["n"]
    told = []
    for k, one in enumerate(odd):
        rest, part = one.rest, one.part
        begin = f"Without {part} everything else fits{', too' if k else ''}"
        told.append(f"{begin} ({rest.chi2['n']} of {n} numbers): {rest.verdict}: {sentence(rest)}")
        if one.alone is not None and len(odd) < len(findings.parts):
            by_itself = "though it fits by itself" if fits(one.alone) else "nor does it fit by itself"
            told.append(f"{part} does not fit with that, {by_itself}: {one.alone.verdict}: {sentence(one.alone)}")
    names = [one.part for one in odd]
    if len(names) > 1:
        told.append(f"Which of {listed(names)} is the odd one these data do not say; the first leaves the better fit.")
    if names:
        told.append(
            f"Was {' or '.join(names)} measured in another set-up (bicycle, load, rider, tyres), is a sensor of it "
            "wrong, or does it show something that the others cannot see?"
        )
    return " ".join(told)


def parts_lines(diagnosis: Diagnosis, findings: Findings) -> list[str]:
    """Which part contradicts the others, and what they say without it; empty of data without parts."""
    if not findings.parts:
        return []
    told = [_without(part, findings) for part in findings.ranked if part.part in findings.without]
    if findings.joint_fits:
        return told or [_agreed(diagnosis)]
    p = printed(diagnosis.verdict.goodness_of_fit_p)
    return [
        f"All parts together do not fit (p {p}): how far a part is from the rest is linear about that fit and does not "
        "say which one is the odd one; first is the part without which the others fit best.",
        *told,
    ]  # fmt: skip


def _without(part: PartAgainstRest, findings: Findings) -> str:
    """How far a ``part`` is from the others, and what they say without it, once."""
    one = findings.without[part.part]
    begin = f"{part.part} contradicts the rest by {part.sd:.1f} sd (p {printed(part.p)}); without it: "
    if not part.contradicts:
        begin = f"without {part.part}: "
    if any(one is other for other in findings.odd):
        return f"{begin}everything else fits (p {printed(one.rest.goodness_of_fit_p)}), see the first line."
    return f"{begin}{one.rest.verdict}: {sentence(one.rest)}"


def unseen_note(findings: Findings) -> str:
    """Which numbers of effects are not compared, as a part or the others tell little more of them than the prior."""
    found = [f"{name} ({part.part})" for part in findings.parts for name in part.unseen]
    return f"Not compared, as that part or the others say little more of it than its prior: {', '.join(found)}." * bool(
        found
    )


def _agreed(diagnosis: Diagnosis) -> str:
    """That no part contradicts the others, and which errors of single parts that rests on."""
    final = diagnosis.final
    if not final.candidates:
        return "No part contradicts the others."
    errors = [c.identifier for c in final.candidates if OF in c.identifier and c.effect is None]
    told = f"Beside {explains(final)} no part contradicts the others"
    if not errors:
        return f"{told}."
    return (
        f"{told}; {listed(errors)} {'are errors' if len(errors) > 1 else 'is an error'} of one part alone "
        "and may take up what would contradict it."
    )


def _runs(one: Predicted) -> str:
    count = len(one.runs)
    return f"{count} run{'s' if count > 1 else ''}{f' of {one.part}' if one.part else ''}"


def predicted_note(findings: Findings) -> str:
    """What was predicted, and from what."""
    told = [_runs(one) for one in findings.predicted]
    loud = "".join(f" Of {_runs(one)} {more}." for one in findings.predicted if (more := _loud(one)))
    return (
        f"{listed(told)} had no part in any fit. Of each, only the state at its first sample is adjusted (and an "
        "offset of each channel where bias or drift is named); the gap is sqrt(max(0, χ²/n - 1)) over that of the "
        f"base model, with the noise that the fitted runs show.{loud}"
    )


def _loud(one: Predicted) -> str:
    """That a gap is small beside an estimated noise, which holds more than noise from sample to sample; or empty."""
    if not one.loud:
        return ""
    told = []
    for name in one.loud:
        unit = next((unit for end, unit in UNITS.items() if name.endswith(end)), "")
        models = [m for m in ("final", "with_torque") if m in one.rms[name]]
        left = ", ".join(f"{one.rms[name][m]:.3g}{unit} {WORDS[m]}" for m in models)
        told.append(f"{name} leaves {left}, where its noise from sample to sample is {one.noise[name][1]:.2g}{unit}")
    return (
        f"the noise of {listed(one.loud)} is not stated (noise_sd) but estimated from what the fitted runs leave, and "
        f"more than {LARGE:g} times that from sample to sample: {'; '.join(told)}. Unless the noise of the sensors is "
        "slow, a small gap does not mean that these runs are predicted to within it"
    )


def predicted_lines(findings: Findings) -> list[str]:
    """How well runs that were never fitted are predicted, for the terminal."""
    return [
        f"{_runs(one)} never fitted: gap "
        + ", ".join(f"{value:.2f} {WORDS[model]}" for model, value in one.gap.items() if value is not None)
        + (f"; {more}" if (more := _loud(one)) else "")
        for one in findings.predicted
        if one.gap["nominal"] is not None
    ]


def stability_note(findings: Findings) -> str:
    """What was judged anew."""
    found = findings.stability
    if found is None:
        return ""
    return (
        f"{found.sentence} Judged anew in each variant: {len(found.tried)} of {found.library} candidates, those of the "
        f"leading hypotheses ({', '.join(found.tried) or 'none'}); the prior is that of the whole library, the noise "
        "that of the first judgement times the factor."
    )


def first_lines(diagnosis: Diagnosis, findings: Findings | None, place: str) -> list[str]:
    """What the terminal says.

    Parameters
    ----------
    diagnosis : Diagnosis
    findings : Findings, optional
    place : str
        Where the report is; empty where there is none.
    """
    lines = [f"{diagnosis.verdict.verdict}: {sentence(diagnosis.verdict)}"]
    if findings is not None:
        if findings.odd:
            lines = [odd_note(diagnosis, findings), f"all parts together: {lines[0]}"]
        lines += [f"check first: {doubt}" for doubt in findings.doubts]
        lines += parts_lines(diagnosis, findings)
        lines += predicted_lines(findings)
        lines += [findings.stability.sentence] if findings.stability is not None else []
        lines += [words.sentence(findings.kept).replace("χ²", "chi^2")] if findings.kept is not None else []
    return [*lines, *([f"report: {place}"] if place else [])]
