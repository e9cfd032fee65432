"""The tables of the report, Markdown."""

import math
from collections.abc import Iterable, Sequence
from decimal import Decimal
from typing import NamedTuple

import numpy as np

from studies.main_study.bands import KMH, Band, UncertainCriticalSpeed
from studies.main_study.cases import TyreCase
from studies.main_study.decompose import Change
from studies.main_study.hinges import End
from studies.main_study.plausible import Plausible
from studies.main_study.published import UNITS, compared
from studies.main_study.report_numbers import plain_range, shown_like, signed, table, with_sd
from studies.main_study.solve import COMPARED_MODES, Result
from studies.main_study.study import Study

SLOWEST, STRIDE = 1.0, 0.1  # m/s


class Printed(NamedTuple):
    """A change in rounded numbers that add up: total = after - before = length + stiffness + interaction."""

    before: Decimal
    after: Decimal
    total: Decimal
    length: Decimal
    stiffness: Decimal
    interaction: Decimal


def printed(change: Change, digits: int) -> Printed:
    """Round the ends and the two parts to ``digits`` places; the total and the interaction follow from these."""
    numbers = (change.before, change.after, change.length_part, change.stiffness_part)
    before, after, length, stiffness = (round(Decimal(number), digits) for number in numbers)
    total = after - before
    return Printed(before, after, total, length, stiffness, total - length - stiffness)


def band_table(study: Study) -> str:
    """Unstable wobble of every case in the reference world: edges, km/h, frequency, and the plausible fronts."""
    results, limit = study.of(study.settings.reference), study.settings.fastest
    far = any(r.case.extrapolated for r in results)
    rows = []
    for r in results:
        outer, bands = study.outer(r), r.bands(limit)
        rows.append([
            r.case.name, r.case.condition, bands_words(bands, study.settings.max_speed),
            kmh_words(bands, study.settings.max_speed), frequencies(bands),
            *(likely(outer, edge, limit) for edge in ("onset", "end")),
            f"{outer.without} of {outer.count}" if outer else "-",
            *(["yes" if r.case.extrapolated else "no"] if far else []),
        ])  # fmt: skip
    head = ["tyre", "pressure", "unstable wobble, m/s", "km/h", "its frequency, Hz", "plausible onset, m/s",
            "plausible end, m/s", "do not wobble", *(["extrapolated"] if far else [])]  # fmt: skip
    return table(rows, head)


def likely(outer: Plausible | None, edge: str, fastest: float) -> str:
    """Where nine of ten plausible fronts have the ``onset`` or ``end`` (``edge``) of the band; ``fastest`` in m/s."""
    ends = outer.likely(edge) if outer else None
    if ends is None:
        return "-"
    return f"{ends[0]:.1f} to " + (f"beyond {fastest:g}" if ends[1] >= fastest else f"{ends[1]:.1f}")


def worlds_table(study: Study) -> str:
    """A row per case, and for each world the unstable wobble and its least damping."""
    setups = study.settings.setups
    rows = []
    for case in study.cases:
        row = [case.name, case.condition]
        for setup in setups:
            r = study.result(setup, case)
            row.append("not computed" if r is None else f"{_span(r, study.settings.fastest)}; {least(r)}")
        rows.append(row)
    return table(rows, ["tyre", "pressure", *(f"{setup.label}: m/s; least damping" for setup in setups)])


def hinge_table(study: Study) -> str:
    """What is varied, the largest change of the least damping first."""
    rows = []
    for hinge in study.hinges:
        change = "-" if math.isinf(hinge.size) else f"{hinge.size:.3f}"
        rows.append([hinge.what, *(word for end in (hinge.low, hinge.high) for word in _end(end)), change])
    head = ["what", "from", "unstable wobble, m/s", "least damping", "to", "unstable wobble, m/s", "least damping",
            "change"]  # fmt: skip
    return table(rows, head)


def published_table(study: Study) -> str:
    """Published ranges beside ours."""
    rows = []
    for one in compared(study):
        name, unit, digits = UNITS[one.finding.quantity]
        ends = [f"{end:{digits}}" if math.isfinite(end) else "more" for end in (one.finding.low, one.finding.high)]
        theirs = f"{' to '.join(ends)} {unit}".strip()
        hands = f", hands {one.finding.hands}" if one.finding.hands else ""
        rows.append([one.finding.who, f"{name}{hands}", theirs, one.shown, one.verdict, one.finding.read])
    return table(rows, ["who", "what", "theirs", "here", "ours is", "how read"])


def lag_table(study: Study) -> str:
    """Wobble of the tyre in question with a single lag and as a string in contact over a length."""
    rows = []
    for one in study.contact_lengths:
        rear, front = (f"{2e3 * half:.0f}" for half in one.half_length)
        how = "load, pressure, width (longest)" if one.estimated else "assumed"
        rows.append([
            one.case.name, one.case.condition, f"{rear} / {front}", how,
            *_end(one.lag)[1:], *_end(one.string)[1:],
        ])  # fmt: skip
    head = ["tyre", "pressure", "contact rear / front, mm", "estimated from", "single lag: unstable, m/s",
            "least damping", "string: unstable, m/s", "least damping"]  # fmt: skip
    return table(rows, head) if rows else ""


def posture_table(study: Study) -> str:
    """Mass, loads and wobble of the same rider in other postures."""
    rows = []
    for one in study.postures:
        b = one.bicycle
        rear, front = b.static_loads
        wobble = _end(one.end)[1:] if one.end else ["no tyre values", "-"]
        rows.append([
            b.name, f"{b['xB']:.3f}", f"{b['zB']:.3f}", f"{b['IBxx']:.1f}", f"{b['IBzz']:.1f}", f"{b['IBxz']:.1f}",
            f"{rear:.0f} / {front:.0f}", *wobble, "yes" if one.extrapolated else "no",
        ])  # fmt: skip
    head = ["bicycle", "xB, m", "zB, m", "IBxx, kg m²", "IBzz", "IBxz", "loads, N", "unstable wobble, m/s",
            "least damping", "tyre extrapolated"]  # fmt: skip
    return table(rows, head) if rows else ""


def mode_table(results: Sequence[Result]) -> str:
    """Frequency and damping ratio of the compared modes per tyre and pressure."""
    rows = [
        [
            r.case.name, r.case.condition,
            *(
                with_sd(part[mode]) if mode in part else "-"
                for mode in COMPARED_MODES for part in (r.frequency, r.damping)
            ),
        ]
        for r in results
    ]  # fmt: skip
    head = [f"{mode} {what}" for mode in COMPARED_MODES for what in ("frequency, Hz", "damping ratio")]
    return table(rows, ["tyre", "pressure", *head])


def parts_table(study: Study, quantity: str, unit: str, digits: int) -> str:
    """Decomposition of the reference world; the printed numbers of a row add up.

    Parameters
    ----------
    study : Study
    quantity : str
        Of the changes, ``damping_ratio`` or ``critical_speed_m_s``.
    unit : str
        Follows the words in the head: ``, m/s``.
    digits : int
        Number of decimals.
    """
    rows = []
    for d in (d for d in study.decompositions if d.setup == study.settings.reference):
        for c in (c for c in d.changes if c.quantity == quantity):
            before, after, *parts = printed(c, digits)
            ends = f"{d.higher.condition} → {d.lower.condition}"
            rows.append([d.higher.name, c.name, ends, f"{before}", f"{after}", *map(signed, parts)])
    head = [
        "tyre",
        "what",
        "pressure",
        f"before{unit}",
        f"after{unit}",
        "total",
        "relaxation length",
        "C",
        "interaction",
    ]
    return table(rows, head) if rows else "No tyre has the same quantities at both pressures."


def never_stable(result: Result, limit: float) -> bool:
    """Whether some root grows at every speed from walking to ``limit`` (m/s), though no one mode may do so."""
    values = result.modes.model.eigenvalues(np.arange(SLOWEST, limit + STRIDE, STRIDE))
    return bool((values.real > 0).any(axis=1).all())


def weave_table(study: Study) -> str:
    """A row per world and mode: where weave and the real modes change their stability, over all tyres and pressures."""
    limit, rows = study.settings.fastest, []
    for setup in study.settings.setups:
        results = study.of(setup)
        found: dict[tuple[str, str], list[tuple[int, float]]] = {}
        for number, r in enumerate(results):
            for c in r.crossings:
                if c not in r.wobble_edges and c.speed <= limit:
                    found.setdefault((c.mode, c.direction), []).append((number, c.speed))
        for (mode, direction), places in found.items():
            speeds = [speed for _, speed in places]
            rows.append([
                setup.label, mode.replace("_", " "), "unstable" if direction == "destabilising" else "stable",
                plain_range(speeds, ".2f"), plain_range([KMH * speed for speed in speeds], ".0f"),
                f"{len({number for number, _ in places})} of {len(results)}",
            ])  # fmt: skip
        never = sum(never_stable(r, limit) for r in results)
        if never:
            rows.append([setup.label, "all together", "stable", "no speed", "", f"{never} of {len(results)}"])
    head = ["world", "mode", "becomes", f"at m/s (up to {limit:g})", "km/h", "cases"]
    return table(rows, head) if rows else "No other mode changes its stability."


def tyre_table(cases: Iterable[TyreCase]) -> str:
    """Tyre numbers at the wheel loads."""
    rows = []
    for case in cases:
        for k, wheel in enumerate(("rear", "front")):
            stiffness, length = case.contact[2 * k : 2 * k + 2]
            p = case.properties[k] if case.properties else None
            rows.append([
                case.name, case.condition, wheel, f"{p.load:.0f}" if p else "-", f"{np.radians(stiffness):.1f}",
                f"{stiffness / length / 1e3:.1f}",
                f"{1e3 * length:.1f} ± {1e3 * math.sqrt(case.covariance[2 * k + 1, 2 * k + 1]):.1f}",
                p.origin if p else "given",
            ])  # fmt: skip
    return table(
        rows, ["tyre", "pressure", "wheel", "load, N", "C, N/deg", "K, N/mm", "relaxation length, mm", "origin"]
    )


def bands_words(bands: Sequence[Band], max_speed: float) -> str:
    """Bands with the standard deviations of their edges; ``max_speed`` (m/s) is the fastest looked at."""
    words = []
    for band in bands:
        low = one_sd(band.start) if band.start else "0"
        high = one_sd(band.end) if band.end else f"beyond {max_speed:g}"
        words.append(f"{low} – {high}")
    return "; ".join(words) or "none"


def one_sd(edge: UncertainCriticalSpeed) -> str:
    """``3.16 ± 0.05``."""
    return f"{shown_like(edge.speed, edge.sd)} ± {shown_like(edge.sd, edge.sd)}"


def kmh_words(bands: Sequence[Band], max_speed: float) -> str:
    """Bands in km/h; ``max_speed`` (m/s) is the fastest looked at."""
    words = []
    for band in bands:
        low = KMH * band.start.speed if band.start else 0.0
        words.append(f"{low:.0f} – " + (f"{KMH * band.end.speed:.0f}" if band.end else f"beyond {KMH * max_speed:.0f}"))
    return "; ".join(words) or "-"


def frequencies(bands: Sequence[Band]) -> str:
    """Frequencies at the edges of bands, Hz."""
    values = [edge.frequency_hz for band in bands for edge in (band.start, band.end) if edge]
    return plain_range(values, ".1f") if values else "-"


def least(result: Result) -> str:
    """The least damping ratio where ridden."""
    return f"{result.least.damping_ratio:.3f}" if result.least else "no wobble"


def _span(result: Result, limit: float) -> str:
    span = result.span(limit)
    if span is None:
        return "stable"
    return f"{span.low:.1f} – " + ("beyond" if math.isinf(span.high) else f"{span.high:.1f}")


def _end(end: End) -> list[str]:
    if end.span is None:
        where = "stable"
    else:
        where = f"{end.span.low:.1f} – " + ("beyond" if math.isinf(end.span.high) else f"{end.span.high:.1f}")
    return [end.what, where, f"{end.least.damping_ratio:.3f}" if end.least else "-"]
