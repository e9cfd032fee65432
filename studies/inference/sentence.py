"""The verdict in one sentence, made of the figures that stand beside it."""

from collections.abc import Mapping

from studies.inference.acceptance import Acceptance
from studies.inference.attempts import POOR_FIT
from studies.inference.checks import goodness_of_fit
from studies.inference.evidence import CLEAR_ODDS, Hypotheses
from studies.inference.fit import Fit
from studies.inference.forward import Forward
from studies.inference.verdict import Named

LEAST = 1e-99  # of a probability that is printed


def sentence(
    forward: Forward, known: Hypotheses, acceptance: Acceptance, effects: tuple[Named, ...], refused: Mapping[str, str]
) -> str:
    """What was decided, in words that the figures bear.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
    acceptance : Acceptance
    effects : tuple of Named
        With their values.
    refused : mapping of str to str
        Hypotheses that are more probable than what is named, and the rule that each fails.
    """
    what = " and ".join(map(in_words, effects))
    p = goodness_of_fit(forward, acceptance.final)
    if acceptance.verdict == "none":
        return _none(known, p)
    if acceptance.verdict == "unknown":
        return _unknown(forward, known, acceptance, refused)
    if acceptance.verdict == "partial":
        final, n = acceptance.final, len(forward.rows.where)
        closes = "close" if len(effects) > 1 else "closes"
        failed = "; ".join(f"{c.what}: no, {c.figure}" for c in acceptance.checks if not c.passed)
        return (
            f"{what} {closes} part of the gap: chi^2 {known.null.chi2:.4g} with the parameters adjusted, "
            f"{final.chi2:.4g} with {'them' if len(effects) > 1 else 'it'}, of {n} numbers; something remains "
            f"({failed})."
        )
    ahead = [f.name for f in acceptance.members[1:] if known.odds(acceptance.final, f) * CLEAR_ODDS < 1]
    others = [f.name for f in acceptance.members[1:] if f.name not in ahead]
    alone = goodness_of_fit(forward, known.null)
    fits = "fit too" if alone > POOR_FIT else "do not fit"
    without = f"without it the adjusted parameters {fits} (p {printed(alone)})"
    whole = f"it explains the data (p {printed(p)}); {without}, P(nothing is missing) {printed(known.nothing)}"
    if acceptance.verdict == "named":
        return f"{_found(acceptance.final, effects)}, relative to this library: {whole}."
    either = f", which these data cannot tell from {' or '.join(others)}" if others else ""
    led = (
        "the most probable is"
        if not refused and all(known.odds(acceptance.final, f) >= 1 for f in acceptance.members)
        else "it is led by"
    )
    if ahead:
        either += f", while {' and '.join(ahead)}, more probable, {'are' if len(ahead) > 1 else 'is'} not ruled out"
    if acceptance.verdict == "class":
        return f"{_kind(acceptance.members)}; {led} {what}{either}: {whole}."
    return f"Tentatively {what}{either}: {whole}. What does not hold: {'; '.join(acceptance.reservations)}."


def printed(probability: float, digits: int = 2) -> str:
    """A ``probability`` behind its sign, to so many ``digits`` but never as impossible or certain: ``= 0.03``.

    Beyond what is printed it is ``< 1e-99`` or, of two digits, ``> 0.99``.
    """
    if probability < LEAST:
        return f"< {LEAST:g}"
    rounded = f"{probability:.{digits}g}"
    return f"> {1 - 10**-digits:g}" if rounded == "1" else f"= {rounded}"


def in_words(effect: Named) -> str:
    """An ``effect`` with its values: ``steer_spring (stiffness 0.70 +- 0.10 N m/rad)``."""
    values = [
        f"{name} {value:.3g} +- {sd:.2g} {'' if effect.units.get(name) == '1' else effect.units.get(name, '')}".rstrip()
        for name, (value, sd) in effect.parameters.items()
    ]
    return f"{effect.identifier} ({', '.join(values)})" if values else effect.identifier


def _found(final: Fit, effects: tuple[Named, ...]) -> str:
    """What of the effects is missing, and which is no effect but an error of the measurement or its file."""
    errors = {c.identifier for c in final.candidates if c.mistake}
    missing = [in_words(e) for e in effects if e.identifier not in errors]
    wrong = [in_words(e) for e in effects if e.identifier in errors]
    told = [f"{' and '.join(missing)} {'are' if len(missing) > 1 else 'is'} missing"] if missing else []
    if wrong:
        kind = "are errors" if len(wrong) > 1 else "is an error"
        told.append(f"{' and '.join(wrong)} {kind} of the measurement or its file")
    return " and ".join(told)


def _kind(members: tuple[Fit, ...]) -> str:
    """Whether an effect is missing, by all members of a class, or none of these has one that is no mistake."""
    real = [any(not c.mistake for c in f.candidates) for f in members]
    wrong = "he measurement or its file is wrong"
    return "An effect is missing" if all(real) else f"An effect is missing or t{wrong}" if any(real) else f"T{wrong}"


def _none(known: Hypotheses, p: float) -> str:
    fits = "explains the data" if p > POOR_FIT else "does not fit well"
    said = f"The base model with its parameters adjusted {fits} (p {printed(p)}), P(nothing is missing) "
    said += f"{printed(known.nothing)}: no effect is named."
    best = known.best()
    if best and known.nothing < 0.5:
        share = known.posterior[best[0].name]
        said = said.removesuffix(".") + f", though {best[0].name} has P {printed(share)}; more data would tell."
    return said


def _unknown(forward: Forward, known: Hypotheses, acceptance: Acceptance, refused: Mapping[str, str]) -> str:
    leader = acceptance.leader
    null = goodness_of_fit(forward, known.null)
    said = f"The base model with its parameters adjusted does not fit (p {printed(null)})"
    if leader is None:
        return f"{said}, and no effect of the library makes it more probable."
    p = goodness_of_fit(forward, leader)
    if p <= POOR_FIT:
        return f"{said}{_poor(forward, known, leader, refused)}"
    if not forward.varied:
        return (
            f"{said}; {leader.name} would (p {printed(p)}), but one speed and one input are no evidence for a name: "
            "measure at a second speed."
        )
    if leader.at_bound():
        where = f"(p {printed(p)}: {leader.at_bound()[0]})"
        return f"{said}; only {leader.name} at a bound of what is physical does {where}."
    if not leader.converged:
        return f"{said}; {leader.name} comes near (p {printed(p)}), but its fit did not converge: it is not judged."
    failed = "; ".join(f"{c.what}: {c.figure}" for c in acceptance.checks if not c.passed)
    return f"{said}; {leader.name} would in sum (p {printed(p)}), but fails a rule ({failed})."


def _poor(forward: Forward, known: Hypotheses, leader: Fit, refused: Mapping[str, str]) -> str:
    """Where what was judged does not fit: whether anything does."""
    p = {f: goodness_of_fit(forward, f) for f in known.best() if f.converged}
    fitting = next((f for f in p if p[f] > POOR_FIT), None)
    if fitting is None:
        best = next(iter(p), leader)
        left = goodness_of_fit(forward, best)
        lowers = f"takes chi^2 from {known.null.chi2:.4g} to {best.chi2:.4g} and leaves p {printed(left)}"
        return f", nor does any hypothesis of the library; the most probable, {best.name}, {lowers}."
    judged = f"{leader.name}, which was judged (p {printed(goodness_of_fit(forward, leader))})"
    why = refused.get(fitting.name, "it is less probable than that nothing is missing")
    would = f"{fitting.name} would in sum (p {printed(p[fitting])}), but is refused: {why}"
    return f", nor does {judged}; {would}."
