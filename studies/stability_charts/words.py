"""A stability chart in words and tables: what the command prints."""

from typing import Any

import numpy as np

from studies.model_axes.axis import SPEED
from studies.stability_charts.chart import NamedBoundary, StabilityChart
from studies.stability_charts.plane import Span, speed_of_rest

NOTHING = 1e-9  # of an axis: a standard deviation below this is rounding


def title(chart: StabilityChart) -> str:
    """The bicycle, its effects and what runs, in a line."""
    plane = chart.plane
    effects = [e.identifier.replace("_", " ") for e in plane.space.model.effects if e.identifier != "no_slip"]
    what = f"{plane.space.model.bicycle.name}{' with ' if effects else ''}{', '.join(effects)}"
    return f"Stability: {what}" + ("" if plane.speed is None else f", at {plane.speed:g} m/s")


def headers(chart: StabilityChart) -> list[str]:
    """Headers of :func:`rows`."""
    names = [f"{span.axis.key} {span.axis.unit}".removesuffix(" 1") for span in chart.plane.spans]
    sd = [f"sd {name}, median along it" for name in names] if chart.uncertain else []
    return ["boundary", "mode", *names, "frequency Hz", *sd, "of a bicycle that is", "remark"]


def rows(chart: StabilityChart) -> list[list[Any]]:
    """A row per boundary: mode, ranges, frequency, standard deviations, and what is stable on its stable side."""
    return [
        [
            number, " / ".join((name or "unknown").replace("+", " or ") for name in one.names.distinct),
            *(_range(chart.plane.spans[i], one, i) for i in (0, 1)), _between(one.frequency),
            *_deviations(chart, one), _beside(one), chart.ends(one),
        ]
        for number, one in enumerate(chart.boundaries, 1)
    ]  # fmt: skip


def _range(span: Span, one: NamedBoundary, i: int) -> str:
    return _between(np.asarray(span.at(one.curve.shares[:, i])))


def _between(values: Any) -> str:
    low, high = f"{values.min():.4g}", f"{values.max():.4g}"
    return low if low == high else f"{low} .. {high}"


def _deviations(chart: StabilityChart, one: NamedBoundary) -> list[str]:
    if not chart.uncertain:
        return []
    scale = np.stack([span.slope(one.curve.shares[:, i]) for i, span in enumerate(chart.plane.spans)], -1)
    share, size = np.median(one.spread[:, :2], axis=0), np.median(scale, axis=0)
    return ["0" if s < NOTHING else "beyond" if s > 1 else f"{s * x:.2g}" for s, x in zip(share, size, strict=True)]


def _beside(one: NamedBoundary) -> str:
    stable = np.mean(one.beside == 0)
    return "stable" if stable == 1 else "unstable anyhow" if stable == 0 else f"stable on {stable:.0%} of it"


def checked(chart: StabilityChart) -> list[str]:
    """How the chart was checked, and what its band is, a line each."""
    check, lines = chart.check, []
    apart, k = int(check.apart.sum()), len(check.unstable)
    if not chart.boundaries:
        count = int(check.told[0, 0])
        lines.append(
            "no boundary here: "
            + ("stable everywhere" if count == 0 else f"{count} unstable root{'s' * (count > 1)} everywhere")
        )
    agreed = apart - int(check.wrong.sum())
    lines.append(
        f"checked: on a grid of {k} x {k} points, at {agreed} of the {apart} that are more than a cell from a boundary "
        "the number of unstable roots is what the boundaries tell"
    )
    if chart.uncertain and chart.boundaries:
        count = len(chart.uncertain.names)
        uncertain = f"{count} uncertain number{'s' * (count > 1)}"
        lines.append(f"band: 95 %, first order, of {uncertain}; the axes themselves are exact")
    elif not chart.uncertain:
        lines.append("no band: the model states no uncertainty; --sd NAME=VALUE gives some, --assume takes defaults")
    rest = speed_of_rest(chart.plane.space)
    if any(span.axis.key == SPEED and span.low == rest for span in chart.plane.spans):
        lines.append(
            f"from {rest:.2g} m/s on: slower is rest, where an undamped pair lies on the imaginary axis at any value"
        )
    return lines


def record(chart: StabilityChart) -> dict[str, Any]:
    """The chart as JSON-ready data."""
    plane, check = chart.plane, chart.check
    table = chart.frame()
    return {
        "axes": [
            {"key": s.axis.key, "unit": s.axis.unit, "low": s.low, "high": s.high, "log": s.log} for s in plane.spans
        ],
        "speed_m_s": plane.speed,
        "boundaries": [
            {
                "modes": list(one.names.distinct), "kind": "real" if one.curve.real else "oscillatory",
                "closed": one.curve.closed, "ends": list(one.curve.ends),
                "points": plane.x(one.curve.shares).tolist(), "frequency_Hz": one.frequency.tolist(),
                "unstable_roots_on_the_stable_side": one.beside.tolist(),
                "sd": [_listed(table.loc[table.boundary == number, f"sd_{s.axis.column}"]) for s in plane.spans]
                if chart.uncertain else None,
            }
            for number, one in enumerate(chart.boundaries, 1)
        ],
        "marks": [
            {"kind": m.kind, "label": m.label, "x": None if m.x != m.x else m.x, "y": None if m.y != m.y else m.y}
            for m in chart.marks
        ],
        "check": {
            "grid_points": check.apart.size, "more_than_a_cell_from_boundaries": int(check.apart.sum()),
            "not_explained": int(check.wrong.sum()), "points_with_wrong_sides": check.sides,
        },
        "uncertain": list(chart.uncertain.names), "doubts": chart.doubts,
    }  # fmt: skip


def _listed(values: Any) -> list[float | None]:
    return [None if value != value or abs(value) == np.inf else float(value) for value in values]
