"""Sentences of the report, put together from numbers: no claim is written that the results do not make.

Sentences about a setup stand under its name (:func:`summary`); what does not depend on the setup stands apart.
"""

from collections.abc import Sequence
from decimal import Decimal
from typing import NamedTuple

from studies.main_study.cases import Setup, TyreCase
from studies.main_study.report_numbers import plain_range, signed, signed_range
from studies.main_study.solve import COMPARED_MODES, Result
from studies.main_study.study import CRITICAL, DAMPING, Change, Decomposition, Study

EDGES = {"wobble unstable above": "begins", "wobble stable above": "ends"}
DESCRIBED = (*COMPARED_MODES, "capsize")


class Printed(NamedTuple):
    """A change in rounded numbers that add up: total = after - before = length + stiffness + interaction."""

    before: Decimal
    after: Decimal
    total: Decimal
    length: Decimal
    stiffness: Decimal
    interaction: Decimal


class Group(NamedTuple):
    """What holds in one setup; ``label`` names it."""

    label: str
    lines: list[str]


def printed(change: Change, digits: int) -> Printed:
    """Round the ends and the two parts to ``digits`` places; the total and the interaction follow from these."""
    numbers = (change.before, change.after, change.length_part, change.stiffness_part)
    before, after, length, stiffness = (round(Decimal(number), digits) for number in numbers)
    total = after - before
    return Printed(before, after, total, length, stiffness, total - length - stiffness)


def tyre_changes(study: Study) -> list[str]:
    """What lower pressure does to each tyre at the wheel loads; the same in all setups."""
    lines = []
    for d in (d for d in study.decompositions if d.setup == study.settings.setups[-1]):
        wheels = (("rear", d.higher.rear, d.lower.rear), ("front", d.higher.front, d.lower.front))
        lengths = " and ".join(
            f"from {1e3 * high.relaxation_length:.0f} to {1e3 * low.relaxation_length:.0f} mm ({wheel})"
            for wheel, high, low in wheels
        )
        lines.append(f"{d.higher.name}, from {pressures([d])}: the relaxation length goes {lengths}.")
    return lines


def summary(study: Study) -> list[Group]:
    """Wobble, weave and damping in every setup, the one of the headline first."""
    *others, headline = study.settings.setups
    return [
        Group(
            label(setup),
            [*wobble_words(study, setup), *weave_words(study, setup), *other_modes(study, setup),
             *damping_words(study, setup)],
        )
        for setup in (headline, *others)
    ]  # fmt: skip


def label(setup: Setup) -> str:
    """The setup as a heading."""
    return setup.label[0].upper() + setup.label[1:]


def pressures(decompositions: Sequence[Decomposition]) -> str:
    """``7.5 to 3.5 bar``, or several such."""
    said = dict.fromkeys(f"{d.higher.pressure_bar:g} to {d.lower.pressure_bar:g} bar" for d in decompositions)
    return " or ".join(said)


def wobble_words(study: Study, setup: Setup) -> list[str]:
    """Where wobble is unstable in a setup, and how lower pressure moves that."""
    results, highest = study.of(setup), study.settings.max_speed
    unstable = [r for r in results if r.bands("wobble")]
    if not unstable:
        return [f"Wobble is not unstable at any speed up to {highest:g} m/s, in any of {len(results)} cases."]
    cases = f"{len(unstable)} of {len(results)} cases"
    lines = [f"Wobble is unstable somewhere up to {highest:g} m/s in {cases}{_onset(unstable)}."]
    ds = [d for d in study.decompositions if d.setup == setup]
    for d in ds:
        edges = [(EDGES[c.name], printed(c, 2), c) for c in _edges(d)]
        if edges:
            said = " and ".join(f"{word} at {p.after} instead of {p.before} m/s ({parts(c)})" for word, p, c in edges)
        else:
            said = _without_edges(study.of(setup, d.higher.name))
        lines.append(f"{d.higher.name}, from {pressures([d])}: unstable wobble {said}.")
    changes = [c for d in ds for c in _edges(d)]
    if changes:
        larger = sum(abs(c.length_part) > abs(c.stiffness_part) for c in changes)
        lines.append(
            f"The relaxation length is the larger part of {larger} of these {len(changes)} shifts, the cornering "
            f"stiffness of {len(changes) - larger}."
        )
    sds = [edge.sd for r in unstable for band in r.bands("wobble") for edge in (band.start, band.end) if edge]
    if sds:
        lines.append(
            f"The uncertainty of {study.settings.uncertain} moves the edges of the bands by {plain_range(sds, '.2f')} "
            "m/s (one standard deviation)."
        )
    return lines


def _onset(unstable: Sequence[Result]) -> str:
    onsets: list[tuple[float, TyreCase]] = [
        (speed, r.case) for r in unstable if (speed := r.first("wobble", "destabilising")) is not None
    ]
    if not onsets:
        return ""
    speed, case = min(onsets, key=lambda pair: pair[0])
    return f"; the lowest onset is {speed:.1f} m/s ({case.name}, {case.pressure_bar:g} bar)"


def _without_edges(results: Sequence[Result]) -> str:
    there = ", ".join(f"{r.case.pressure_bar:g}" for r in results if r.bands("wobble"))
    return f"occurs at {there} bar only, so that there are no edges to compare" if there else "does not occur"


def parts(change: Change) -> str:
    """The parts of a change of speed in words."""
    p = printed(change, 2)
    return (
        f"{signed(p.length)} from the relaxation length, {signed(p.stiffness)} from the cornering stiffness, "
        f"{signed(p.interaction)} from both together"
    )


def weave_words(study: Study, setup: Setup) -> list[str]:
    """Where weave is stable in a setup, and how the tyre moves that."""
    results, lines = study.of(setup), []
    for direction, word in (("stabilising", "stable"), ("destabilising", "unstable")):
        speeds = [speed for r in results if (speed := r.first("weave", direction)) is not None]
        if not speeds:
            limit = study.settings.max_speed
            lines.append(f"Weave becomes {word} at no speed up to {limit:g} m/s, in any of {len(results)} cases.")
            continue
        cases = f"{len(speeds)} of {len(results)} cases"
        lines.append(f"Weave becomes {word} at {plain_range(speeds, '.2f')} m/s, in {cases}.")
        name = f"weave {word} above"
        moved = [(d, c) for d in study.decompositions if d.setup == setup and (c := d.change(name))]
        if moved:
            lines.append(f"From {pressures([d for d, _ in moved])} this speed shifts, in m/s, by {_split(moved)}.")
    return lines


def other_modes(study: Study, setup: Setup) -> list[str]:
    """Oscillations beside weave and wobble that become unstable."""
    found: dict[str, list[float]] = {}
    for result in study.of(setup):
        for c in result.crossings:
            if c.destabilising and c.kind == "oscillatory" and c.mode not in DESCRIBED:
                found.setdefault(c.mode, []).append(c.speed)
    return [
        f"The mode {mode.replace('_', ' ')} becomes unstable at {plain_range(speeds, '.2f')} m/s, {len(speeds)} times "
        f"in {len(study.of(setup))} cases."
        for mode, speeds in found.items()
    ]


def damping_words(study: Study, setup: Setup) -> list[str]:
    """Shares of relaxation length and C in the change of damping ratio."""
    lines = []
    for mode in COMPARED_MODES:
        moved = [(d, c) for d in study.decompositions if d.setup == setup and (c := d.change(mode, DAMPING))]
        if moved:
            lines.append(
                f"From {pressures([d for d, _ in moved])} the {mode} damping ratio at {study.settings.report_speed:g} "
                f"m/s changes by {_split(moved)}."
            )
    return lines


def _split(moved: Sequence[tuple[Decomposition, Change]]) -> str:
    changes = [change for _, change in moved]
    return (
        f"{signed_range([c.total for c in changes])} (tyres and surfaces: {len(changes)}; by the relaxation length "
        f"alone {signed_range([c.length_part for c in changes])}, by the cornering stiffness alone "
        f"{signed_range([c.stiffness_part for c in changes])})"
    )


def camber_words(study: Study) -> list[str]:
    """Differences between each camber thrust and none, over all tyres and pressures."""
    lines = []
    setups = study.settings.setups
    for setup in setups:
        plain = next((s for s in setups if s.front == setup.front and s.camber_share == 0), None)
        if plain is None or setup.camber_share == 0:
            continue
        before, after = study.of(plain), study.of(setup)
        found = []
        for mode in COMPARED_MODES:
            shifts = [
                b.damping[mode].value - a.damping[mode].value
                for a, b in zip(before, after, strict=True) if mode in a.damping and mode in b.damping
            ]  # fmt: skip
            if shifts:
                found.append(
                    f"the {mode} damping ratio at {study.settings.report_speed:g} m/s by {signed_range(shifts)}"
                )
        for mode, direction, words in (
            ("wobble", "destabilising", "the onset of unstable wobble"),
            ("wobble", "stabilising", "its end"),
            ("capsize", "destabilising", "the capsize speed"),
        ):
            pairs = [(a.first(mode, direction), b.first(mode, direction)) for a, b in zip(before, after, strict=True)]
            moved = [b - a for a, b in pairs if a is not None and b is not None]
            if moved:
                found.append(f"{words} by {signed_range(moved, '.2f')} m/s")
        if found:
            lines.append(
                f"{setup.front_name.capitalize()} front, {setup.camber_share:g} × load changes {', '.join(found)}."
            )
    return lines


def _edges(decomposition: Decomposition) -> list[Change]:
    return [c for name in EDGES if (c := decomposition.change(name, CRITICAL))]
