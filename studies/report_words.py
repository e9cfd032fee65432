"""Sentences of the report, put together from numbers: no claim is written that the results do not make."""

from collections.abc import Sequence

from studies.main_study import CRITICAL, DAMPING, Change, Decomposition, Study
from studies.main_study_cases import Setup
from studies.main_study_solve import COMPARED_MODES

EDGES = {"wobble unstable above": "begins", "wobble stable above": "ends"}


def flexible_summary(study: Study, setup: Setup) -> list[str]:
    """What lower pressure does to the unstable wobble of each tyre, and by which part."""
    lines = []
    for name in study.names:
        d = study.decomposition(setup, name)
        if d is None:
            continue
        lengths = " and ".join(
            f"from {1e3 * high.relaxation_length:.0f} to {1e3 * low.relaxation_length:.0f} mm ({wheel})"
            for wheel, high, low in (("rear", d.higher.rear, d.lower.rear), ("front", d.higher.front, d.lower.front))
        )
        edges = [f"{EDGES[c.name]} at {c.after:.1f} instead of {c.before:.1f} m/s ({parts(c)})" for c in _edges(d)]
        effect = f"unstable wobble {' and '.join(edges)}" if edges else _without_edges(study, setup, name)
        lines.append(
            f"{name}, {d.higher.pressure_bar:g} to {d.lower.pressure_bar:g} bar: the relaxation length goes {lengths}; "
            f"{effect}."
        )
    changes = [c for d in study.decompositions if d.setup == setup for c in _edges(d)]
    if changes:
        larger = sum(abs(c.length_part) > abs(c.stiffness_part) for c in changes)
        lines.append(
            f"The relaxation length is the larger part of {larger} of these {len(changes)} shifts, the cornering "
            f"stiffness of {len(changes) - larger}."
        )
    sds = [edge.sd for r in study.of(setup) for band in r.bands("wobble") for edge in (band.start, band.end) if edge]
    if sds:
        lines.append(
            f"The uncertainty of the tyre data moves the edges of the band by {plain_range(sds, '.2f')} m/s (one "
            "standard deviation)."
        )
    return lines


def parts(change: Change) -> str:
    """The parts of a change of speed in words."""
    return (
        f"{signed(change.length_part, '.1f')} from the relaxation length, {signed(change.stiffness_part, '.1f')} from "
        f"the cornering stiffness, {signed(change.interaction, '.1f')} from both together"
    )


def rigid_summary(study: Study, setup: Setup) -> str:
    """Wobble of the rigid front."""
    limit = float(study.settings.speeds[-1])
    results = study.of(setup)
    onsets = [(c.speed, r) for r in results for c in r.crossings if c.mode == "wobble" and c.destabilising]
    below = [r for r in results if any(not b.start or b.start.speed <= limit for b in r.bands("wobble"))]
    text = (
        f"With a rigid front wobble is unstable somewhere below {limit:g} m/s in {len(below)} of {len(results)} cases"
        if below
        else f"With a rigid front no case has an unstable wobble within {limit:g} m/s"
    )
    if onsets:
        speed, result = min(onsets, key=lambda pair: pair[0])
        return f"{text}; the lowest onset is {speed:.1f} m/s ({result.case.name}, {result.case.pressure_bar:g} bar)."
    return f"{text}, nor an onset up to {study.settings.max_speed:g} m/s." if not below else f"{text}."


def weave_summary(study: Study, setup: Setup) -> list[str]:
    """Where weave is stable, and how the tyre moves that."""
    results = study.of(setup)
    lines = []
    stable = [speed for r in results if (speed := r.first("weave", "stabilising")) is not None]
    if stable:
        lines.append(f"Weave becomes stable at {plain_range(stable, '.2f')} m/s, over all tyres and pressures.")
    lost = [speed for r in results if (speed := r.first("weave", "destabilising")) is not None]
    if lost:
        lines.append(
            f"Weave becomes unstable at {plain_range(lost, '.2f')} m/s, in {len(lost)} of {len(results)} cases."
        )
    else:
        lines.append(f"Weave does not become unstable again up to {study.settings.max_speed:g} m/s.")
    for key, words in (("weave stable above", "becomes stable"), ("weave unstable above", "becomes unstable")):
        found = [d.change(key) for d in study.decompositions if d.setup == setup]
        changes = [c for c in found if c]
        if changes:
            lines.append(f"Lower pressure shifts the speed at which weave {words} by {_split(changes)} m/s.")
    return lines


def damping_summary(study: Study, setups: Sequence[Setup]) -> list[str]:
    """Shares of relaxation length and C in the change of damping ratio."""
    lines = []
    at = f"damping ratio at {study.settings.report_speed:g} m/s"
    for setup in setups:
        for mode in COMPARED_MODES:
            found = [d.change(mode, DAMPING) for d in study.decompositions if d.setup == setup]
            changes = [c for c in found if c]
            if changes:
                front = f"{setup.front_name.capitalize()} front"
                lines.append(f"{front}, {mode} {at}: lower pressure changes it by {_split(changes)}.")
    return lines


def _split(changes: Sequence[Change]) -> str:
    return (
        f"{signed_range([c.total for c in changes])}, by the relaxation length alone "
        f"{signed_range([c.length_part for c in changes])}, by the cornering stiffness alone "
        f"{signed_range([c.stiffness_part for c in changes])}"
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


def plain_range(values: Sequence[float], digits: str) -> str:
    """``low to high``, or one number where they print alike."""
    return _range([f"{value:{digits}}" for value in (min(values), max(values))])


def signed_range(values: Sequence[float], digits: str = ".3f") -> str:
    """The same with signs."""
    return _range([signed(value, digits) for value in (min(values), max(values))])


def signed(value: float, digits: str) -> str:
    """A number with its sign, and without one where it prints as zero."""
    text = f"{value:+{digits}}"
    return text if float(text) else text[1:]


def _range(ends: list[str]) -> str:
    return " to ".join(dict.fromkeys(ends))


def _edges(decomposition: Decomposition) -> list[Change]:
    return [c for name in EDGES if (c := decomposition.change(name, CRITICAL))]


def _without_edges(study: Study, setup: Setup, name: str) -> str:
    results = study.of(setup, name)
    unstable = [f"{r.case.pressure_bar:g}" for r in results if r.bands("wobble")]
    stable = [f"{r.case.pressure_bar:g}" for r in results if not r.bands("wobble")]
    if not unstable:
        return "wobble is stable at all these pressures"
    else_stable = f" and stable at {', '.join(stable)} bar" if stable else ""
    return f"wobble is unstable at {', '.join(unstable)} bar{else_stable}; there are no edges to compare"
