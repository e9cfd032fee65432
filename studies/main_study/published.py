"""The study beside published ranges: ours, and whether ours lie inside."""

from dataclasses import dataclass

import numpy as np

from bicycle.critical import CrossingIdentity
from studies.main_study.result import WEAVE, WOBBLE
from studies.main_study.settings import LIMITS, Setup
from studies.main_study.study import Study
from tyre.files import data_root, read_toml


@dataclass(frozen=True)
class Finding:
    """A published range."""

    who: str
    quantity: str
    low: float
    high: float
    words: str
    read: str
    source: str
    hands: str = ""


@dataclass(frozen=True)
class Comparison:
    """A published range beside the range of this study; ``ours`` is None if the study has no such number."""

    finding: Finding
    ours: tuple[float, float] | None

    @property
    def verdict(self) -> str:
        """``inside``, ``partly inside``, ``outside``, or ``none here``."""
        if self.ours is None:
            return "none here"
        low, high = self.ours
        if self.finding.low <= low and high <= self.finding.high:
            return "inside"
        return "outside" if high < self.finding.low or low > self.finding.high else "partly inside"


def findings() -> tuple[Finding, ...]:
    """Read every published range of the packaged data."""
    content = read_toml(data_root().joinpath("published", "wobble.toml"), "file of findings")
    return tuple(Finding(**entry) for entry in content["finding"])


def compared(study: Study) -> tuple[Comparison, ...]:
    """Compare all published ranges with the tyres of the study, in the world of a flexible front."""
    settings = study.settings
    ours = {hands: measured(study, setup) for hands, setup in (("on", settings.setups[1]), ("off", settings.reference))}
    found = []
    for finding in findings():
        values = [value for value in ours[finding.hands or "off"][finding.quantity] if not np.isnan(value)]
        found.append(Comparison(finding, (min(values), max(values)) if values else None))
    return tuple(found)


def measured(study: Study, setup: Setup) -> dict[str, list[float]]:
    """Numbers of the study in one world by the quantities of the published ranges."""
    found: dict[str, list[float]] = {quantity: [] for quantity in QUANTITIES}
    for case in study.cases:
        per_load = np.radians(case.contact[::2] / study.settings.bicycle.static_loads)
        found["cornering_stiffness_over_load_per_deg"] += per_load.tolist()
        found["relaxation_length_mm"] += (1e3 * case.contact[1::2]).tolist()
        if "camber_thrust" not in study.settings.further:
            found["camber_stiffness_over_load_per_deg"] += np.radians(np.ravel(case.on(setup).camber_share)).tolist()
    for result in study.of(setup):
        if span := result.span(study.settings.fastest):
            found["onset_m_s"].append(span.low)
            found["end_m_s"].append(span.high)
        if WOBBLE not in result.modes.branches:
            continue
        speeds, hertz = result.modes.speeds, result.modes.frequency(WOBBLE)
        there = (speeds >= LIMITS.ridden[0]) & (speeds <= LIMITS.ridden[1]) & (hertz > 0)
        magnitude = result.modes.shape(WOBBLE).magnitude
        found["steer_over_roll"] += (magnitude["steer"][there] / magnitude["lean"][there]).tolist()
        there[-1] = False  # the report speed is among the others, or between them
        if there.any():
            found["wobble_frequency_Hz"] += hertz[there].tolist()
            found["frequency_change"].append(float(np.ptp(hertz[there]) / np.mean(hertz[there])))
    identity = CrossingIdentity(WEAVE, destabilising=False)
    changes = [d.change(identity) for d in study.decompositions if d.setup == setup]
    found["weave_shift_m_s"] = [abs(change.total) for change in changes if change]
    return found


QUANTITIES = (
    "wobble_frequency_Hz", "onset_m_s", "end_m_s", "steer_over_roll", "frequency_change", "weave_shift_m_s",
    "cornering_stiffness_over_load_per_deg", "camber_stiffness_over_load_per_deg", "relaxation_length_mm",
)  # fmt: skip
