"""A design in words, tables and as a model file: what the command prints and writes."""

from pathlib import Path
from typing import Any

import numpy as np

from bicycle.eigenvalues.oscillation import damping_ratio, frequency_hz
from bicycle.files.model_file import build_model
from studies.design.design import Design
from studies.design.worst_speeds import Peak
from studies.model_axes.changed_content import near_to

HEADERS = ["parameter", "unit", "now", "design", "change", "counts as 1", "limits", ""]
WORSE = 1e-3  # 1/s: a real part that grew by more is worth a word


def rows(design: Design) -> list[list[Any]]:
    """A row per number that is varied."""
    problem, limits = design.problem, design.problem.limits
    held = {key for key, _, _ in design.at_limit}
    return [
        [
            axis.key, axis.unit, float(now), f"{after:.6g}", float(after - now), float(scale),
            f"{low:.4g} .. {high:.4g} ({why})", "at its limit" if axis.key in held else "",
        ]
        for axis, now, after, scale, low, high, why in zip(
            problem.space.axes, problem.start, design.after.x, problem.cost.scale, limits.low, limits.high, limits.why,
            strict=True,
        )
    ]  # fmt: skip


def lines(design: Design) -> list[str]:
    """What the design does, what binds and how sure it is, a sentence each."""
    problem, found = design.problem, []
    low, high = problem.speeds[0], problem.speeds[-1]
    asked = "; ".join(map(str, problem.demands))
    if not design.after.kept:
        found.append(
            f"no change within the limits keeps this from {low:g} to {high:g} m/s: {asked}{_asked_sure(design)}; the "
            "nearest that was found is shown"
        )
        found += [f"missed most: {_place(peak)}" for peak in design.binding]
        found += _limits(design)
        found.append("best reachable: " + "; ".join(_reached(design)))
        return found + (_sure(design) if design.probability is not None else [])
    found.append(f"kept from {low:g} to {high:g} m/s: {asked}{_asked_sure(design)}")
    if design.after.cost == 0:
        found.append("the model does so as it stands: nothing is changed")
    else:
        found.append(f"cost: {design.after.cost:.4g}, the root of the sum of squares of changes in {problem.cost.kind}")
        found += [f"binds: {_place(peak)}" for peak in design.binding]
        found += _limits(design)
        same, count = design.agreed
        found.append(f"{same} of {count} searches from different beginnings came to this cost; none found less")
    return found + _sure(design)


def _asked_sure(design: Design) -> str:
    return "" if design.probability is None else f", with a probability of {design.probability:g}"


def _limits(design: Design) -> list[str]:
    return [
        f"binds: {key} at its limit {end:.4g} ({why}); --limits {key}=LOW:HIGH sets another"
        for key, end, why in design.at_limit
    ]


def _place(peak: Peak) -> str:
    omega = abs(float(frequency_hz(peak.root)))
    how = f"{omega:.3g} Hz" if omega else "a real root"
    ratio = f", damping ratio {float(damping_ratio(peak.root)):.4f}" if omega else ""
    return f"{peak.demand.mode} at {peak.speed:.4g} m/s ({how}): real part {peak.root.real:.3g} 1/s{ratio}"


def _reached(design: Design) -> list[str]:
    said = []
    for demand in design.problem.demands:
        own = [p for p in design.after.peaks if p.demand == demand]
        if own:
            most = max(own, key=lambda p: p.excess)
            said.append(f"{_place(most)}, where it was {_before(design, demand)} 1/s at most")
    return said


def _before(design: Design, demand: Any) -> str:
    return f"{max((p.root.real for p in design.before.peaks if p.demand == demand), default=np.nan):.3g}"


def _sure(design: Design) -> list[str]:
    sure = design.certainty
    if sure is None:
        return ["how sure: no uncertainty is stated; --sd NAME=VALUE gives some, --assume takes defaults for the rest"]
    low, high = sure.interval
    count = sure.known.size + sure.unknown
    said = f"how sure: {sure.probability:.1%} of {count} drawn bicycles keep it (95 % interval {low:.1%} to {high:.1%})"
    said += f"; of {sure.unknown} it could not be told" if sure.unknown else ""
    said += f"; {sure.refused} draws that make no bicycle are left out" if sure.refused else ""
    return [said]


def remarks(design: Design) -> list[str]:
    """What else changed and was not asked for: modes that are unstable now, or more than before."""
    before, after = design.unstable
    kept = {demand.mode for demand in design.problem.demands}
    said, others = [], []
    for name, (low, high, real) in after.items():
        if name in kept and design.after.kept:
            continue
        where = f"from {low:.3g} to {high:.3g} m/s, real part up to {real:.3g} 1/s"
        if "+" in name:  # modes that have met; they are listed one by one elsewhere
            continue
        if name not in before:
            advice = ", though it was to be kept" if name in kept else f": --keep {name} stable keeps it too"
            said.append(f"{name} is unstable now ({where}) and was not{advice}")
        elif real > before[name][2] + WORSE:
            said.append(f"{name} is unstable ({where}), more than before ({before[name][2]:.3g} 1/s)")
        elif name not in kept:
            others.append(name)
    if others:
        said.append(f"not asked for, and unstable somewhere in the range as before: {', '.join(others)}")
    return said


def model_text(design: Design, folder: Path, what: str) -> str:
    """Text of the corrected model file, for a ``folder``; ``what`` was asked for."""
    import tomli_w

    content = near_to(design.content, folder)
    given = str(content.get("description", "")).strip()
    content["description"] = f"{given}{' ' * bool(given)}Changed by velotyre design: {what}."
    build_model(design.content)  # as every other command will
    first = {key: content.pop(key) for key in ("description", "bicycle", "allow_unusual") if key in content}
    tables = {"bicycle": first.pop("bicycle")}
    return tomli_w.dumps(first | tables | content)


def record(design: Design) -> dict[str, Any]:
    """The design as JSON-ready data."""
    problem, sure = design.problem, design.certainty
    peaks = [
        {
            "mode": p.demand.mode, "least_damping_ratio": p.demand.ratio, "speed_m_s": p.speed,
            "real_1_s": p.root.real, "imaginary_rad_s": p.root.imag, "excess_1_s": p.excess,
        }
        for p in design.after.peaks
    ]  # fmt: skip
    return {
        "kept": design.after.kept, "cost": design.after.cost, "cost_in": problem.cost.kind,
        "speeds_m_s": [float(problem.speeds[0]), float(problem.speeds[-1])],
        "parameters": [
            {
                "key": axis.key, "unit": axis.unit, "now": float(now), "design": float(x),
                "counts_as_one": float(scale), "limits": [float(low), float(high)], "limits_from": why,
            }
            for axis, now, x, scale, low, high, why in zip(
                problem.space.axes, problem.start, design.after.x, problem.cost.scale, problem.limits.low,
                problem.limits.high, problem.limits.why, strict=True,
            )
        ],
        "worst": peaks,
        "binding": [{"mode": p.demand.mode, "speed_m_s": p.speed} for p in design.binding],
        "at_limit": [{"key": key, "limit": end} for key, end, _ in design.at_limit],
        "searches": {"agreed": design.agreed[0], "of": design.agreed[1]},
        "probability": None if sure is None else {
            "kept": sure.probability, "interval_95": list(sure.interval), "draws": sure.known.size + sure.unknown,
            "not_told": sure.unknown, "left_out": sure.refused,
        },
        "unstable_before": {k: list(v) for k, v in design.unstable[0].items()},
        "unstable_after": {k: list(v) for k, v in design.unstable[1].items()}, "remarks": remarks(design),
    }  # fmt: skip
