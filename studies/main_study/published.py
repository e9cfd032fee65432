"""The study compared with published ranges: the range here, and whether it lies inside."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bicycle.stability.critical import CrossingIdentity
from studies.main_study.result import WEAVE, WOBBLE
from studies.main_study.settings import LIMITS, Setup
from studies.main_study.study import Study
from tyre.ground.files import data_root, read_toml


class Shown(NamedTuple):
    """How a quantity is printed."""

    name: str  # in words
    unit: str  # empty: a ratio or a share
    digits: str  # format of its numbers
    scale: float = 1.0  # of its numbers, before they are printed


QUANTITIES = {
    "wobble_frequency_Hz": Shown("wobble frequency", "Hz", ".1f"),
    "onset_m_s": Shown("onset of unstable wobble", "m/s", ".1f"),
    "end_m_s": Shown("end of unstable wobble", "m/s", ".1f"),
    "steer_over_roll": Shown("ratio of steer to roll in wobble", "", ".1f"),
    "frequency_change": Shown("change of wobble frequency, 3 to 20 m/s", "%", ".0f", 100.0),
    "weave_shift_m_s": Shown("change of weave speed with pressure", "m/s", ".3f"),
    "cornering_stiffness_over_load_per_deg": Shown("cornering stiffness over load", "1/deg", ".2f"),
    "camber_stiffness_over_load_per_deg": Shown("camber stiffness over load", "1/deg", ".4f"),
    "relaxation_length_mm": Shown("relaxation length", "mm", ".0f"),
}


@dataclass(frozen=True)
class Finding:
    """A published range."""

    who: str  # authors and year
    kind: str  # ``model``, ``measurement``, or ``both``: a model compared with a measurement
    quantity: str  # name with its unit, a key of :func:`list_quantities`
    low: float  # in the unit of the quantity
    high: float  # likewise
    words: str  # finding in a few words
    read: str  # what was read of it, and how it was taken
    source: str  # where it was published
    hands: str = ""  # ``on`` or ``off``; empty: of the tyre alone

    @property
    def shown(self) -> Shown:
        """How the quantity is printed."""
        return QUANTITIES[self.quantity]


@dataclass(frozen=True)
class Comparison:
    """A published range and the range of this study; ``ours`` is None if the study has no such number."""

    finding: Finding  # published range
    ours: tuple[float, float] | None  # lowest and highest number of the study, in the unit of the quantity

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


def compare_findings(study: Study) -> tuple[Comparison, ...]:
    """Compare all published ranges with the tyres of the study, with the flexible front frame."""
    settings = study.settings
    ours = {
        hands: list_quantities(study, setup)
        for hands, setup in (("on", settings.setups[1]), ("off", settings.reference))
    }
    comparisons = []
    for finding in findings():
        values = np.array(ours[finding.hands or "off"][finding.quantity])
        span = None if np.isnan(values).all() else (float(np.nanmin(values)), float(np.nanmax(values)))
        comparisons.append(Comparison(finding, span))
    return tuple(comparisons)


def list_quantities(study: Study, setup: Setup) -> dict[str, list[float]]:
    """List the numbers of the study in one case, by the quantities of the published ranges and in their units."""
    results, cases, loads = study.results_of(setup), study.cases, study.settings.bicycle.static_loads
    unstable = [bands for result in results if (bands := result.bands(study.settings.fastest))]
    camber_shares = []  # of the wheel load; none if the model file gives the camber stiffness
    if "camber_thrust" not in study.settings.further:
        camber_shares = [case.apply_to(setup).camber_share for case in cases]
    identity = CrossingIdentity(WEAVE, destabilising=False)
    changes = [d.change(identity) for d in study.decompositions if d.setup == setup]
    numbers: dict[str, list[float]] = {
        "cornering_stiffness_over_load_per_deg": [x for case in cases for x in np.radians(case.contact[::2] / loads)],
        "camber_stiffness_over_load_per_deg": [x for share in camber_shares for x in np.radians(np.ravel(share))],
        "relaxation_length_mm": [x for case in cases for x in 1e3 * case.contact[1::2]],
        "onset_m_s": [bands[0].start.speed if bands[0].start else 0.0 for bands in unstable],
        "end_m_s": [bands[-1].end.speed if bands[-1].end else math.inf for bands in unstable],
        "weave_shift_m_s": [abs(change.total) for change in changes if change],
        "steer_over_roll": [],
        "wobble_frequency_Hz": [],
        "frequency_change": [],
    }
    for modes in (result.modes for result in results if WOBBLE in result.modes.branches):
        hertz = modes.frequency(WOBBLE)
        magnitude = modes.shape(WOBBLE).magnitude
        ridden = (modes.speeds >= LIMITS.ridden[0]) & (modes.speeds <= LIMITS.ridden[1]) & (hertz > 0)
        numbers["steer_over_roll"] += (magnitude["steer"][ridden] / magnitude["lean"][ridden]).tolist()
        ridden[-1] = False  # the report speed is among the others, or between them
        if ridden.any():
            numbers["wobble_frequency_Hz"] += hertz[ridden].tolist()
            numbers["frequency_change"].append(float(np.ptp(hertz[ridden]) / np.mean(hertz[ridden])))
    return numbers
