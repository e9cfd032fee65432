"""What to measure next: how many cases would become definite if a group of assumptions were known.

In each case the fastest growth of the samples is regressed on the assumed numbers. A group that is known leaves the
rest of the variance. A case is definite if its mean growth is far enough from the limit of wobble that one grade
*yes* or *no* holds, by normal distributions. It is an estimate; the study with the measured numbers decides.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from studies.main_study.grades import GRADE_RULES
from studies.main_study.samples import Samples, front_draws
from studies.main_study.settings import LIMITS, Settings
from tyre.ground.arrays import Array

GROUPS: Mapping[str, tuple[str, ...]] = {
    "front frame": ("stiffness", "damping_ratio", "hinge"),
    "hands": ("arm_inertia", "arm_stiffness", "arm_damping"),
    "rider on the saddle": ("saddle_stiffness", "saddle_damping_ratio"),
    "steering friction": ("friction",),
    "aligning moment and camber stiffness of the tyre": ("trail", "twisting", "camber_share"),
}
"""What is measured together -> names of :class:`~studies.main_study.settings.Ranges`."""


@dataclass(frozen=True)
class Gain:
    """Cases that are expected to be definite."""

    group: str  # of GROUPS, that would be measured; empty: as it is
    definite: float  # expected number of cases
    count: int  # number of cases, at each pressure


def rank_measurements(
    settings: Settings, samples: Iterable[Samples], assumed: Iterable[str], definite_now: int
) -> list[Gain]:
    """Rank what of the ``assumed`` numbers to measure next, the greatest gain first; the first entry is as it is.

    ``definite_now`` is the number of cases whose grade is definite. The estimate adds what a measurement gains.
    """
    drawn = front_draws(settings)
    names = set(assumed)
    groups = {group: [name for name in members if name in names] for group, members in GROUPS.items()}
    groups = {group: members for group, members in groups.items() if members}
    cases = [sample for sample in samples if sample.count >= LIMITS.fewest]
    before = sum(_share_definite(sample, drawn, [], []) for sample in cases)
    gains = []
    for group, members in groups.items():
        others = [name for other, names_of in groups.items() if other != group for name in names_of]
        after = sum(_share_definite(sample, drawn, members, others) for sample in cases)
        definite = min(definite_now + max(after - before, 0.0), float(len(cases)))
        gains.append(Gain(group, definite, len(cases)))
    return [Gain("", float(definite_now), len(cases)), *sorted(gains, key=lambda gain: -gain.definite)]


def _share_definite(sample: Samples, drawn: Mapping[str, Array], known: list[str], unknown: list[str]) -> float:
    """Probability that a case is definite once the ``known`` numbers are."""
    growth = np.maximum(sample.peak, LIMITS.slowest)[sample.computed]  # finite where nothing oscillates
    excess = growth - LIMITS.growth
    columns = [np.ones(len(excess))]
    for name in [*known, *unknown]:
        numbers = drawn[name][sample.computed]
        columns.append((numbers - numbers.mean()) / (numbers.std() or 1.0))
    slopes = np.linalg.lstsq(np.column_stack(columns), excess, rcond=None)[0]
    by_known = float(np.linalg.norm(slopes[1 : 1 + len(known)]))  # 1/s, sd of the mean that the measurement will give
    remaining = float(np.sqrt(max(excess.var() - by_known**2, 1e-12)))
    far = norm.ppf(GRADE_RULES.agreement[0].agree) * remaining  # 1/s, from here on the grade is yes or no
    mean = float(excess.mean())
    if not by_known:
        return float(abs(mean) >= far)
    return float(norm.sf((far - mean) / by_known) + norm.cdf((-far - mean) / by_known))
