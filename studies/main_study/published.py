"""The study beside what others found: their ranges, ours, and whether ours lie inside."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bicycle.critical.critical_speed import CrossingIdentity
from studies.main_study.bands import WEAVE, WOBBLE
from studies.main_study.settings import Setup
from studies.main_study.solve import RIDDEN, Result
from studies.main_study.study import Study
from tyre.base.errors import InputError
from tyre.base.paths import data_root
from tyre.base.schema import known, maybe, needed, number, read, table, text
from tyre.base.toml_file import read_toml

FILE = ("published", "wobble.toml")
UNITS = {
    "wobble_frequency_Hz": ("wobble frequency", "Hz", ".1f"), "onset_m_s": ("onset of unstable wobble", "m/s", ".1f"),
    "end_m_s": ("end of unstable wobble", "m/s", ".1f"), "steer_over_roll": ("steer over roll in wobble", "", ".1f"),
    "frequency_change": ("change of wobble's frequency, 3 to 20 m/s", "", ".0%"),
    "weave_shift_m_s": ("weave speed, change with pressure", "m/s", ".3f"),
    "cornering_stiffness_over_load_per_deg": ("cornering stiffness over load", "1/deg", ".2f"),
    "camber_stiffness_over_load_per_deg": ("camber stiffness over load", "1/deg", ".4f"),
    "relaxation_length_mm": ("relaxation length", "mm", ".0f"),
}  # fmt: skip


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
    """A published range beside the range of this study; ``ours`` is None where the study has no such number."""

    finding: Finding
    ours: tuple[float, float] | None

    @property
    def verdict(self) -> str:
        """``inside``, ``partly inside``, ``outside``, or that there is nothing to compare."""
        if self.ours is None:
            return "none here"
        low, high = self.ours
        if self.finding.low <= low and high <= self.finding.high:
            return "inside"
        return "outside" if high < self.finding.low or low > self.finding.high else "partly inside"

    @property
    def shown(self) -> str:
        """Our range in words."""
        if self.ours is None:
            return "-"
        _, unit, digits = UNITS[self.finding.quantity]
        ends = dict.fromkeys(f"{end:{digits}}" if math.isfinite(end) else "beyond" for end in self.ours)
        return f"{' to '.join(ends)} {unit}".strip()


def findings() -> tuple[Finding, ...]:
    """Every published range of the packaged data.

    Raises
    ------
    InputError
        A finding with another key, without one, with another quantity, or with no range.
    """
    content = read_toml(data_root().joinpath(*FILE), "file of findings")
    return tuple(_finding(one, f"finding {number}") for number, one in enumerate(content["finding"], 1))


FINDING = table(
    {
        needed("who"): text(), needed("quantity"): known("quantity", UNITS), needed("low"): number(endless=True),
        needed("high"): number(endless=True), needed("words"): text(), needed("read"): text(), needed("source"): text(),
        maybe("hands", ""): text("must be on, off, or left out", allowed=("", "on", "off")),
    }
)  # fmt: skip


def _finding(entry: Mapping[str, Any], where: str) -> Finding:
    finding = Finding(**read(FINDING, entry, where=where))
    if not finding.low < finding.high:
        raise InputError(f"{where}: low = {finding.low:g} must be below high = {finding.high:g}")
    return finding


def compared(study: Study) -> tuple[Comparison, ...]:
    """All published ranges beside the packaged and own tyres of the study, in the world of a flexible front."""
    return tuple(Comparison(one, our_range(study, one)) for one in findings())


def our_range(study: Study, finding: Finding) -> tuple[float, float] | None:
    """Smallest and largest of our numbers over all cases; None where there are none."""
    settings = study.settings
    setup = study.settings.setups[1] if finding.hands == "on" else settings.reference
    values = [value for value in MEASURES[finding.quantity](study, setup) if not math.isnan(value)]
    return (min(values), max(values)) if values else None


def _frequencies(study: Study, setup: Setup) -> list[float]:
    return [value for result in study.of(setup) for value in ridden_frequencies(result)]


def ridden_frequencies(result: Result) -> list[float]:
    """Frequency of wobble (Hz) at the ridden speeds at which it is an oscillation."""
    if WOBBLE not in result.modes.branches:
        return []
    there = (result.modes.speeds >= RIDDEN[0]) & (result.modes.speeds <= RIDDEN[1])
    there[-1] = False  # the report speed is among the others, or between them
    hertz = result.modes.frequency(WOBBLE)[there]
    return [float(value) for value in hertz[hertz > 0]]


def _changes(study: Study, setup: Setup) -> list[float]:
    every = [ridden_frequencies(result) for result in study.of(setup)]
    return [(max(one) - min(one)) / float(np.mean(one)) for one in every if one]


def _edges(which: str) -> Callable[[Study, Setup], list[float]]:
    def measure(study: Study, setup: Setup) -> list[float]:
        spans = [result.span(study.settings.fastest) for result in study.of(setup)]
        return [getattr(span, which) for span in spans if span]

    return measure


def _ratios(study: Study, setup: Setup) -> list[float]:
    found = []
    for result in study.of(setup):
        if WOBBLE in result.modes.branches:
            shape = result.modes.shape(WOBBLE)
            there = (result.modes.speeds >= RIDDEN[0]) & (result.modes.speeds <= RIDDEN[1])
            there &= result.modes.frequency(WOBBLE) > 0
            steer, lean = shape.magnitude["steer"][there], shape.magnitude["lean"][there]
            found += (steer / lean).tolist()
    return found


def _weave(study: Study, setup: Setup) -> list[float]:
    ds = [d for d in study.decompositions if d.setup == setup]
    return [abs(c.total) for d in ds if (c := d.change(CrossingIdentity(WEAVE, destabilising=False)))]


def _per_wheel(study: Study, of: Callable[[Sequence[float], float], float]) -> list[float]:
    loads = study.settings.bicycle.static_loads
    return [of(case.contact[2 * k : 2 * k + 2].tolist(), load) for case in study.cases for k, load in enumerate(loads)]


def _cornering(study: Study, setup: Setup) -> list[float]:
    return _per_wheel(study, lambda pair, load: float(np.radians(pair[0] / load)))


def _lengths(study: Study, setup: Setup) -> list[float]:
    return _per_wheel(study, lambda pair, load: 1e3 * pair[1])


def _camber(study: Study, setup: Setup) -> list[float]:
    return [] if "camber_thrust" in study.settings.further else [float(np.radians(setup.camber_share))]


MEASURES: dict[str, Callable[[Study, Setup], list[float]]] = {
    "wobble_frequency_Hz": _frequencies, "onset_m_s": _edges("low"), "end_m_s": _edges("high"),
    "steer_over_roll": _ratios, "frequency_change": _changes, "weave_shift_m_s": _weave,
    "cornering_stiffness_over_load_per_deg": _cornering, "camber_stiffness_over_load_per_deg": _camber,
    "relaxation_length_mm": _lengths,
}  # fmt: skip
