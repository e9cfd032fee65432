"""The first screen's reasons: what the answer hinges on, how far to believe it, and why this bicycle wobbles."""

import numpy as np

from studies.main_study.bands import KMH
from studies.main_study.cases import GIVEN, TyreCase
from studies.main_study.contact_length import ContactLength
from studies.main_study.hinges import End, Hinge
from studies.main_study.settings import CONTACT_LENGTH
from studies.main_study.solve import RIDDEN, Result
from studies.main_study.study import Study

RIDDEN_WORDS = f"at {RIDDEN[0]:g} to {RIDDEN[1]:g} m/s"
NAMED = 4  # things the answer hinges on that are named
MANY = 10.0  # relaxation lengths in a wavelength, from which a single lag describes a tyre fairly
LATER = 1.5  # times the onset, from which something is said to make wobble begin later


def hinge_words(study: Study) -> str:
    """What the answer hinges on, the largest first, and where pressure stands among it."""
    ranked = [one for one in study.hinges if one.low.least and one.high.least]
    if not ranked:
        return ""
    named = ", ".join(f"{k}. {one_hinge(one)}" for k, one in enumerate(ranked[:NAMED], 1))
    words = f"(by how far each alone moves the least damping ratio {RIDDEN_WORDS}{at_condition(study.focus)}) {named}"
    place = next((k for k, one in enumerate(ranked, 1) if one.what == "pressure"), None)
    if place and place > NAMED:
        words += f"; and, {place}. of {len(ranked)}, {one_hinge(ranked[place - 1])}"
    return words + "."


def one_hinge(hinge: Hinge) -> str:
    """``hands (off the bar -0.068, on the bar 0.045)``."""
    return f"{hinge.what} ({', '.join(_end(one) for one in (hinge.low, hinge.high))})"


def _end(end: End) -> str:
    return f"{end.what} {end.least.damping_ratio:.3f}" if end.least else end.what


def belief_words(study: Study, results: list[Result]) -> str:
    """How far to believe it: the single lag, the rigid rider, small motions."""
    parts = []
    limit = study.settings.fastest
    onsets = [(r, bands[0].start) for r in results if (bands := r.bands(limit)) and bands[0].start]
    focus = onsets[0][0] if onsets and CONTACT_LENGTH not in study.settings.further else None
    if focus:
        start = onsets[0][1]
        length = float(focus.case.contact[3])
        wave = start.speed / start.frequency_hz
        coarse = "coarse" if wave < MANY * length else "fair"
        parts.append(
            f"at its onset{at_condition(focus.case)} the wavelength of wobble is {wave:.2f} m, {wave / length:.1f} "
            f"relaxation lengths, so that a tyre with a single lag is a {coarse} description"
        )
    strings = [one for one in study.contact_lengths if not one.estimated]
    if strings:
        parts.append(string_words(strings[-1], strings[0]))
    parts.append("the rider is a rigid body and the motion is small")
    return f"{'; '.join(parts)}."


def string_words(high: ContactLength, low: ContactLength) -> str:
    """Where wobble is unstable with a contact that has a length, at the ends of the pressures."""
    length = f"as a string in contact over {1e3 * sum(low.half_length):.0f} mm, wobble"

    def state(one: ContactLength) -> str:
        damping = f", least damping ratio {one.string.least.damping_ratio:.3f}" if one.string.least else ""
        return f"is unstable {one.string.span.words}{damping}" if one.string.span else f"is stable{damping}"

    if high is low:
        return f"{length} {state(low)}"
    return f"{length} at {low.case.condition} {state(low)}, at {high.case.condition} {state(high)}"


def why_words(study: Study) -> str:
    """Why this bicycle wobbles early although real ones seldom do, from what removes the band."""
    result = study.result(study.settings.reference, study.focus)
    span = result.span(study.settings.fastest) if result else None
    if result is None or span is None or span.low > RIDDEN[1]:
        return ""
    gone = [
        f"{one.what} {end.what}"
        for one in study.hinges for end in (one.low, one.high) if end.span is None and one.what != "pressure"
    ]  # fmt: skip
    later = [
        (end.span.low, f"{one.what} {end.what} (from {speed(end.span.low)})")
        for one in study.hinges for end in (one.low, one.high)
        if end.span is not None and end.span.low > LATER * span.low
    ]  # fmt: skip
    front = study.settings.front
    reasons = ["nobody touches the bar"]
    reasons += [] if "steer_damper" in study.settings.further or front.friction else ["the steering has no friction"]
    whose = "given" if front.given else "assumed"
    reasons.append(f"the {whose} front is flexible ({front.stiffness:g} N m/rad, {front.damping:g} N m s/rad)")
    words = (
        f"Real bicycles seldom wobble from {speed(span.low) if span.low else 'rest'} on. This one does in the "
        f"model{at_condition(study.focus)} because "
        f"{', '.join(reasons[:-1])} and {reasons[-1]}"
    )
    if gone:
        words += f". Each alone takes the unstable wobble away up to {speed(study.settings.fastest)}: {', '.join(gone)}"
    if later:
        words += (
            f". Each alone makes it begin later: {', '.join(text for _, text in sorted(later, reverse=True)[:NAMED])}"
        )
    worst = result.least
    if worst and worst.eigenvalue.real > 0:
        words += (
            f". Where it is least damped, at {speed(worst.speed)}, the amplitude doubles in "
            f"{np.log(2) / worst.eigenvalue.real:.2f} s"
        )
    return words + "."


def at_condition(case: TyreCase) -> str:
    """At which pressure, where one is known."""
    return "" if case.condition == GIVEN else f" at {case.condition}"


def speed(value: float) -> str:
    """``4.1 m/s (15 km/h)``, from a ``value`` in m/s."""
    return f"{value:.1f} m/s ({KMH * value:.0f} km/h)"
