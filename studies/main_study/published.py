"""The study beside published ranges: ours, and whether ours lie inside."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from bicycle.critical import CrossingIdentity
from studies.main_study.result import WEAVE, WOBBLE, Result
from studies.main_study.settings import LIMITS, Setup
from studies.main_study.study import Study
from tyre.errors import InputError
from tyre.files import data_root, read_toml
from tyre.schema import known, maybe, needed, number, read, table, text


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
    found = []
    for place, entry in enumerate(content["finding"], 1):
        one = Finding(**read(FINDING, entry, where=f"finding {place}"))
        if not one.low < one.high:
            raise InputError(f"finding {place}: low = {one.low:g} must be below high = {one.high:g}")
        found.append(one)
    return tuple(found)


def compared(study: Study) -> tuple[Comparison, ...]:
    """Compare all published ranges with the packaged and own tyres of the study, in the world of a flexible front."""
    found = []
    for finding in findings():
        setup = study.settings.setups[1] if finding.hands == "on" else study.settings.reference
        values = [float(value) for value in MEASURES[finding.quantity](study, setup) if not np.isnan(value)]
        found.append(Comparison(finding, (min(values), max(values)) if values else None))
    return tuple(found)


def _ridden(result: Result) -> Any:
    """Mask of the ridden speeds at which wobble oscillates, without the report speed; None without wobble."""
    if WOBBLE not in result.modes.branches:
        return None
    there = (result.modes.speeds >= LIMITS.ridden[0]) & (result.modes.speeds <= LIMITS.ridden[1])
    there[-1] = False  # the report speed is among the others, or between them
    return there & (result.modes.frequency(WOBBLE) > 0)


def _frequencies(study: Study, setup: Setup) -> list[Any]:
    """Frequencies of wobble (Hz), an array a result."""
    masks = [(result, _ridden(result)) for result in study.of(setup)]
    return [result.modes.frequency(WOBBLE)[mask] for result, mask in masks if mask is not None and mask.any()]


def _ratios(study: Study, setup: Setup) -> list[float]:
    found: list[float] = []
    for result in study.of(setup):
        if WOBBLE in result.modes.branches:
            shape = result.modes.shape(WOBBLE)
            there = (result.modes.speeds >= LIMITS.ridden[0]) & (result.modes.speeds <= LIMITS.ridden[1])
            there &= result.modes.frequency(WOBBLE) > 0
            found += (shape.magnitude["steer"][there] / shape.magnitude["lean"][there]).tolist()
    return found


def _edges(which: str) -> Callable[[Study, Setup], list[float]]:
    def measure(study: Study, setup: Setup) -> list[float]:
        spans = [result.span(study.settings.fastest) for result in study.of(setup)]
        return [getattr(span, which) for span in spans if span]

    return measure


def _weave(study: Study, setup: Setup) -> list[float]:
    identity = CrossingIdentity(WEAVE, destabilising=False)
    changes = [d.change(identity) for d in study.decompositions if d.setup == setup]
    return [abs(change.total) for change in changes if change]


def _cornering(study: Study, setup: Setup) -> list[float]:
    loads = study.settings.bicycle.static_loads
    return [
        float(np.radians(c / load)) for case in study.cases for c, load in zip(case.contact[::2], loads, strict=True)
    ]


def _camber(study: Study, setup: Setup) -> list[float]:
    return [] if "camber_thrust" in study.settings.further else [float(np.radians(setup.camber_share))]


MEASURES: dict[str, Callable[[Study, Setup], Iterable[float]]] = {
    "wobble_frequency_Hz": lambda study, setup: [hertz for one in _frequencies(study, setup) for hertz in one],
    "onset_m_s": _edges("low"),
    "end_m_s": _edges("high"),
    "steer_over_roll": _ratios,
    "frequency_change": lambda study, setup: [np.ptp(one) / np.mean(one) for one in _frequencies(study, setup)],
    "weave_shift_m_s": _weave,
    "cornering_stiffness_over_load_per_deg": _cornering,
    "camber_stiffness_over_load_per_deg": _camber,
    "relaxation_length_mm": lambda study, setup: [1e3 * v for case in study.cases for v in case.contact[1::2]],
}
FINDING = table(
    {
        needed("who"): text(), needed("quantity"): known("quantity", MEASURES), needed("low"): number(endless=True),
        needed("high"): number(endless=True), needed("words"): text(), needed("read"): text(), needed("source"): text(),
        maybe("hands", ""): text("must be on, off, or left out", allowed=("", "on", "off")),
    }
)  # fmt: skip
