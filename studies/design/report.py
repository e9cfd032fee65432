"""Table, lines, JSON and model file of a design."""

from pathlib import Path
from typing import Any

from bicycle.eigen import damping_ratio, frequency_hz
from bicycle.model_file import build_model
from studies.design.design import Design
from studies.design.problem import Peak
from studies.model_space import near_to

HEADERS = ["parameter", "unit", "now", "design", "change", "counts as 1", "limits", ""]


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
    """Lines on what the design does, what binds and how sure it is."""
    problem, after, kept = design.problem, design.after, design.after.kept
    begin = "kept" if kept else "no change within the limits keeps this"
    sure = "" if design.probability is None else f", with a probability of {design.probability:g}"
    end = "" if kept else "; the nearest that was found is shown"
    asked = "; ".join(map(str, problem.demands))
    found = [f"{begin} from {problem.speeds[0]:g} to {problem.speeds[-1]:g} m/s: {asked}{sure}{end}"]
    if kept and after.cost == 0:
        return [*found, "the model does so as it stands: nothing is changed", *_sure(design)]
    if kept:
        found.append(f"cost: {after.cost:.4g}, the root of the sum of squares of changes in {problem.cost.kind}")
    found += [f"{'binds' if kept else 'missed most'}: {_place(peak)}" for peak in design.binding]
    found += [
        f"binds: {key} at its limit {end:.4g} ({why}); --limits {key}=LOW:HIGH sets another"
        for key, end, why in design.at_limit
    ]
    if kept:
        same, count = design.agreed
        searches = f"{same} of {count} searches from different beginnings came to this cost; none found less"
        return [*found, searches, *_sure(design)]
    reached = []
    for demand in problem.demands:
        own = [p for p in after.peaks if p.demand == demand]
        before = max((p.root.real for p in design.before.peaks if p.demand == demand), default=float("nan"))
        if own:
            place = _place(max(own, key=lambda p: p.excess))
            reached.append(f"{place}, where it was {before:.3g} 1/s at most")
    found.append(f"best reachable: {'; '.join(reached)}")
    return found + (_sure(design) if design.probability is not None else [])


def _place(peak: Peak) -> str:
    hertz, ratio = abs(float(frequency_hz(peak.root))), float(damping_ratio(peak.root))
    kind, damping = (f"{hertz:.3g} Hz", f", damping ratio {ratio:.4f}") if hertz else ("a real root", "")
    return f"{peak.demand.mode} at {peak.speed:.4g} m/s ({kind}): real part {peak.root.real:.3g} 1/s{damping}"


def _sure(design: Design) -> list[str]:
    sure = design.certainty
    if sure is None:
        return ["how sure: no uncertainty is stated; --sd NAME=VALUE gives some, --assume takes defaults for the rest"]
    more = f"; of {sure.unknown} it could not be told" if sure.unknown else ""
    more += f"; {sure.refused} draws that make no bicycle are left out" if sure.refused else ""
    low, high = sure.interval
    of = f"{sure.probability:.1%} of {sure.known.size + sure.unknown} drawn bicycles"
    return [f"how sure: {of} keep it (95 % interval {low:.1%} to {high:.1%}){more}"]


def remarks(design: Design) -> list[str]:
    """Remarks on what else changed and was not asked for: modes that are unstable now, or more than before."""
    before, after = design.unstable
    kept = {demand.mode for demand in design.problem.demands}
    found, others = [], []
    for name, (low, high, real) in after.items():
        if (name in kept and design.after.kept) or "+" in name:  # modes that have met are listed one by one elsewhere
            continue
        where = f"(from {low:.3g} to {high:.3g} m/s, real part up to {real:.3g} 1/s)"
        if name not in before:
            advice = ", though it was to be kept" if name in kept else f": --keep {name} stable keeps it too"
            found.append(f"{name} is unstable now {where} and was not{advice}")
        elif real > before[name][2] + 1e-3:  # 1/s: a real part that grew by more is worth a word
            found.append(f"{name} is unstable {where}, more than before ({before[name][2]:.3g} 1/s)")
        elif name not in kept:
            others.append(name)
    if others:
        found.append(f"not asked for, and unstable somewhere in the range as before: {', '.join(others)}")
    return found


def model_text(design: Design, folder: Path, what: str) -> str:
    """Text of the corrected model file, for a ``folder``; ``what`` was asked for."""
    import tomli_w

    content = near_to(design.content, folder)
    given = str(content.get("description", "")).strip()
    content["description"] = f"{given} Changed by velotyre design: {what}.".strip()
    build_model(design.content)  # as every other command will
    first = {key: content.pop(key) for key in ("description", "bicycle", "allow_unusual") if key in content}
    tables = {"bicycle": first.pop("bicycle")}
    return tomli_w.dumps(first | tables | content)


def record(design: Design) -> dict[str, Any]:
    """The design as JSON-ready data."""
    problem, after, sure = design.problem, design.after, design.certainty
    limits = problem.limits
    return {
        "kept": after.kept, "cost": after.cost, "cost_in": problem.cost.kind,
        "speeds_m_s": [float(problem.speeds[0]), float(problem.speeds[-1])],
        "parameters": [
            {
                "key": axis.key, "unit": axis.unit, "now": float(problem.start[k]), "design": float(after.x[k]),
                "counts_as_one": float(problem.cost.scale[k]), "limits": [float(limits.low[k]), float(limits.high[k])],
                "limits_from": limits.why[k],
            }
            for k, axis in enumerate(problem.space.axes)
        ],
        "worst": [
            {
                "mode": p.demand.mode, "least_damping_ratio": p.demand.ratio, "speed_m_s": p.speed,
                "real_1_s": p.root.real, "imaginary_rad_s": p.root.imag, "excess_1_s": p.excess,
            }
            for p in after.peaks
        ],
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
