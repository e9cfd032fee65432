"""What would mimic an unknown effect: torques without a cause, and effects with the sign that nature does not give.

They are never named; they say in which direction to look.
"""

import itertools
import math
from dataclasses import replace

from bicycle.effect import registry
from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.motion.family import feedback_key

TERMS = tuple(itertools.product(("steer", "steer_rate", "lean", "lean_rate"), ("steer_torque", "lean_torque")))
"""Outputs, and the torque that is proportional to each."""


def feedback_terms() -> tuple[Candidate, ...]:
    """One candidate for each term."""
    found = []
    declared = {p.name: p for effect in registry().values() if not effect.nameable for p in effect.parameters}
    for seen, torque in TERMS:
        size = declared[f"{torque.removesuffix('_torque')}_from_{seen}"]
        unit, scale = size.unit, size.typical[1] / 2  # the upper end of the typical range is two sigma
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
