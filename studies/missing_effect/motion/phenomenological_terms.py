"""What would mimic an unknown effect: torques without a cause, and effects with the sign that nature does not give.

They are never named; they say in which direction to look.
"""

import math
from dataclasses import replace

from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.motion.family import feedback_key

TERMS = {
    ("steer", "steer_torque"): 5.0, ("steer_rate", "steer_torque"): 1.0,
    ("lean", "steer_torque"): 10.0, ("lean_rate", "steer_torque"): 2.0,
    ("lean", "lean_torque"): 50.0, ("lean_rate", "lean_torque"): 10.0,
    ("steer", "lean_torque"): 20.0, ("steer_rate", "lean_torque"): 5.0,
}  # fmt: skip
"""Torque proportional to an output, and a typical size (N m/rad or N m s/rad)."""


def feedback_terms() -> tuple[Candidate, ...]:
    """One candidate for each term."""
    found = []
    for (seen, torque), scale in TERMS.items():
        unit = "N m s/rad" if seen.endswith("_rate") else "N m/rad"
        name = f"{torque.removesuffix('_torque')} torque from {seen.replace('_', ' ')}"
        found.append(
            Candidate(
                name, (UncertainParameter("gain", unit, {feedback_key(seen, torque): 1.0}, 0.0, scale, size=True),)
            )
        )
    return tuple(found)


def reversed_signs(candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
    """The one-sided effects of a single parameter among ``candidates``, with the opposite sign only."""
    found = []
    for c in candidates:
        if c.effect is None or c.replaces or len(c.unknowns) != 1:
            continue
        u = c.unknowns[0]
        if not u.one_sided or u.power != 1:
            continue
        u = replace(u, lowest=-math.inf, highest=u.centre)
        found.append(replace(c, identifier=f"{c.identifier} with the wrong sign", unknowns=(u,)))
    return tuple(found)
