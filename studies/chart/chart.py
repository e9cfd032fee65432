"""A stability chart: boundaries with the names of their modes, how well each is known, and what was found on the way.

With Re lambda(u, p) = 0 along a boundary, numbers p with covariance S move it along its unit normal n by
-dp . dRe/dp / |dRe/du|, so that its standard deviation there is sqrt(g' S g) / |dRe/du| with g = dRe/dp. Along an axis
it is sqrt(g' S g) / |dRe/du_i|. The numbers of the two axes themselves are where they stand, without error.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import scipy
from numpy.typing import NDArray

from bicycle.model.eigen import eigenvalues, frequency_hz
from bicycle.stability.naming import Rules, name_points
from bicycle.stability.propagation import model_covariance, standard_deviation
from studies.chart.curve import DOUBLE_ZERO, Boundary
from studies.chart.plane import Mark, Plane, lattice, marks, speed_of_rest
from studies.chart.search import ASIDE, Check, all_boundaries, complete_boundaries, count_unstable
from studies.model_space.axes import SPEED
from studies.model_space.outputs import ROOTS, Output
from studies.reporting.markdown_text import render_file
from tyre.ground.arrays import Array

FAR = 1e-3  # of the largest root: a named root so far from the crossing one is another
BAND = 1.96  # standard deviations: 95 %
WIDE = 0.3  # of the axes: a band whose half width is more along half of a boundary is no band
CELLS = 300  # of a band, along each axis


def name_crossing_root(plane: Plane, boundary: Boundary) -> tuple[str, ...]:
    """Name the crossing root at each point: two joined by a plus if it is in doubt, empty if it is unknown."""
    space = plane.space
    count = len(boundary)
    values = space.values(plane.x(boundary.shares))
    rules = Rules.of(space.linear)
    gravity, wheelbase = (np.broadcast_to(np.asarray(values[key], float), count) for key in "gw")
    polynomial = space.family.polynomials(values, count)[0]
    speeds = plane.speeds(boundary.shares)
    point = np.arange(count)
    named = name_points(rules, polynomial, np.sqrt(gravity * wheelbase), gravity, point, speeds)
    distance = np.abs(named.values - 1j * np.abs(boundary.roots.imag)[:, None])
    nearest = distance.argmin(1)
    is_crossing = distance[point, nearest] < FAR * boundary.sizes + 1e-6
    pairs = zip(is_crossing, named.first[point, nearest].tolist(), named.second[point, nearest].tolist(), strict=True)
    return tuple(rules.name(first, second) if is_named else "" for is_named, first, second in pairs)


@dataclass(frozen=True)
class Uncertain:
    """Numbers of the model that are uncertain, p of them."""

    names: tuple[str, ...]  # p keys of parameters
    covariance: Array  # (p, p), SI
    values: Array  # (p,), SI

    @classmethod
    def of(cls, plane: Plane, sd: Mapping[str, float] | None = None, *, assume: bool = False) -> "Uncertain":
        """Take those with an sd in the model or in ``sd`` (SI), without the axes; ``assume`` adds default sds."""
        names, covariance = model_covariance(plane.space.model, sd, assume=assume)
        axis_keys = {entry for entries in plane.space.entries for entry in entries}
        places = [i for i, name in enumerate(names) if name not in axis_keys]
        values = plane.space.model.parameters
        chosen = tuple(names[i] for i in places)
        return cls(chosen, covariance[np.ix_(places, places)], np.array([values[name] for name in chosen]))

    def __bool__(self) -> bool:
        return bool(self.names)


def spread(plane: Plane, boundary: Boundary, uncertain: Uncertain) -> Array:
    """Compute the standard deviation (m,), 1/s, of the real part of the crossing root along a boundary."""
    space = plane.space
    points = plane.x(boundary.shares)
    values, right = np.linalg.eig(space.matrices(points, plane.speed))
    left = np.linalg.inv(right)
    crossing = np.abs(values - boundary.roots[:, None]).argmin(1)
    row = np.arange(len(points))
    u, x = left[row, crossing], right[row, :, crossing]
    parameters = space.values(points)
    slopes = []
    for name, value, variance in zip(uncertain.names, uncertain.values, np.diag(uncertain.covariance), strict=True):
        at = np.broadcast_to(np.asarray(parameters[name], float), len(points))
        share = at / value if value else np.ones(len(at))  # of a tyre that is softer here than in the model
        step = 1e-5 * np.maximum(np.abs(at), np.sqrt(variance) * np.abs(share))
        ends = [space.matrices(points, plane.speed, {name: at + sign * step}) for sign in (1, -1)]
        slopes.append(np.einsum("mi,mij,mj->m", u, (ends[0] - ends[1]) / (2 * step)[:, None, None], x).real * share)
    return np.asarray(standard_deviation(np.stack(slopes, -1), uncertain.covariance))


def along_axes(boundary: Boundary, growth: Array) -> Array:
    """Convert sds of the real part (m,), 1/s, to sds (m, 3) along first axis, second axis and normal, in shares."""
    uphill = np.abs(boundary.gradients.real)
    with np.errstate(divide="ignore"):
        return np.stack([growth / uphill[:, 0], growth / uphill[:, 1], growth / np.hypot(*uphill.T)], -1)


def band_of(shares: Array, sd: Array) -> tuple[Array, Array]:
    """Measure how far a grid lies from a boundary of ``shares`` (m, 2) and normal sd (m,), in half widths of its band.

    Return the shares (k,) of either axis and the distances (k, k); up to 1 a point is inside.
    """
    share = np.linspace(0, 1, CELLS + 1)
    point = np.arange(len(shares))
    between = np.linspace(0, len(point) - 1, 6 * len(point))
    dense = np.stack([np.interp(between, point, column) for column in shares.T], -1)
    distance, nearest = scipy.spatial.KDTree(dense).query(lattice(share, share))
    distance = distance / np.maximum(BAND * np.interp(between, point, sd)[nearest], 1e-12)
    return share, distance.reshape(CELLS + 1, CELLS + 1)


@dataclass(frozen=True, eq=False)
class NamedBoundary:
    """A boundary of m points, and what is known at each."""

    curve: Boundary  # points in shares of the axes, roots and gradients
    names: tuple[str, ...]  # m; two joined by a plus where in doubt, empty where unknown
    roots_on_stable_side: NDArray[np.intp]  # (m,), unstable roots just off the boundary, on its stable side
    growth_sd: Array  # (m,), 1/s, of the real part of the crossing root

    @property
    def distinct(self) -> tuple[str, ...]:
        """Every name along the boundary, in order."""
        return tuple(dict.fromkeys(self.names))

    def pieces(self, plane: Plane) -> Iterator[tuple[str, bool, Array, Array]]:
        """Yield stretches of one name: True if it limits what is stable, points (k, 2) in axis units, (k,) Hz."""
        order = list(range(len(self.names)))
        if self.curve.closed:
            order.append(0)
        points = plane.x(self.curve.shares)[order]
        hertz = self.frequency[order]
        start = 0
        kinds = [(self.names[k], bool(self.roots_on_stable_side[k] == 0)) for k in order]
        for k in range(1, len(order)):
            if k == len(order) - 1 or kinds[k] != kinds[start]:
                yield *kinds[start], points[start : k + 1], hertz[start : k + 1]
                start = k

    @property
    def frequency(self) -> Array:
        """Frequency of the crossing root, Hz, (m,); 0 of a real one."""
        return np.abs(frequency_hz(np.where(self.curve.real, 0j, self.curve.roots)))

    @property
    def spread(self) -> Array:
        """Standard deviations (m, 3) along the first axis, the second and the normal, in shares of the axes."""
        return along_axes(self.curve, self.growth_sd)

    @property
    def band_is_narrow(self) -> bool:
        """True if the band is narrow enough for first order to mean something."""
        return bool(np.median(BAND * self.spread[:, 2]) <= WIDE)


@dataclass(frozen=True, eq=False)
class StabilityChart:
    """Boundaries over a plane, and what was found on the way."""

    plane: Plane  # the two axes, and the speed if it is none of them
    boundaries: tuple[NamedBoundary, ...]  # all that were found
    check: Check  # counts of unstable roots that show if a boundary is missing
    uncertain: Uncertain  # numbers whose sds move the boundaries
    marks: tuple[Mark, ...]  # the model and measured conditions

    def __repr__(self) -> str:
        axes = [f"{s.axis.key} {s.low:g} to {s.high:g} {s.axis.unit}".removesuffix(" 1") for s in self.plane.spans]
        speed = "" if self.plane.speed is None else f" at {self.plane.speed:g} m/s"
        modes = [" or ".join(name or "unknown" for name in boundary.distinct) for boundary in self.boundaries]
        return f"<StabilityChart{speed}: {', '.join(axes)}\n stability boundaries: {', '.join(modes) or 'none'}>"

    def frame(self) -> pd.DataFrame:
        """Make a table with a row per point of a boundary; units are in the names of the columns."""
        axes = [span.axis for span in self.plane.spans]
        tables = []
        for number, boundary in enumerate(self.boundaries, 1):
            curve = boundary.curve
            points = self.plane.x(curve.shares)
            columns: dict[str, Any] = {axis.column: points[:, i] for i, axis in enumerate(axes)}
            columns |= {
                "boundary": number,
                "closed": curve.closed,
                "mode": [name or "unknown" for name in boundary.names],
                "kind": "real" if curve.real else "oscillatory",
                "frequency_Hz": boundary.frequency,
                "residual_real_1_s": curve.roots.real,
                "largest_root_1_s": curve.sizes,
                "unstable_roots_on_the_stable_side": boundary.roots_on_stable_side,
                f"towards_instability_{axes[0].key}": curve.normals[:, 0],
                f"towards_instability_{axes[1].key}": curve.normals[:, 1],
            }
            if self.uncertain:
                sd = boundary.spread
                scale = self.plane.scale(curve.shares)
                columns |= {f"sd_{axis.column}": sd[:, i] * scale[:, i] for i, axis in enumerate(axes)}
                columns["sd_normal_share_of_axes"] = sd[:, 2]
            columns["tyre_inside_measured_range"] = self.plane.space.inside(points)
            tables.append(pd.DataFrame(columns))
        names = [axis.column for axis in axes] + ["boundary", "mode", "kind", "frequency_Hz"]
        return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=names)

    def regions(self, first: Array, second: Array) -> NDArray[np.intp]:
        """Count unstable roots (k, l) from the boundaries crossed, at rising shares (k,) and (l,) of the axes."""
        grid = self.check.grid
        start = int(self.check.predicted[0, 0] - count_unstable(self.curves, grid, grid, 0)[0, 0])
        return count_unstable(self.curves, first, second, start)

    @property
    def curves(self) -> tuple[Boundary, ...]:
        """The boundaries without their names."""
        return tuple(boundary.curve for boundary in self.boundaries)

    @property
    def doubts(self) -> list[str]:
        """Remarks on what is not certain about this chart."""
        missing = self.check.grid[np.argwhere(self.check.wrong)[:1]]

        def place(shares: Array) -> list[tuple[str, float, str]]:
            values = self.plane.x(np.reshape(shares, (1, 2)))[0]
            return [
                (span.axis.key, value, span.axis.unit) for span, value in zip(self.plane.spans, values, strict=True)
            ]

        return _render("doubts", self, missing=missing, place=place)


def stability_chart(
    plane: Plane, *, sd: Mapping[str, float] | None = None, assume: bool = False, step: float = 1 / 150
) -> StabilityChart:
    """Find, name and check every boundary of a plane, with the uncertainty of the model's sds and of ``sd`` (SI).

    Points are at most ``step`` (share of the axes) apart; ``assume`` takes default sds where none is stated.
    """
    uncertain = Uncertain.of(plane, sd, assume=assume)
    curves, check = complete_boundaries(plane, all_boundaries(plane, step=step), step=step)
    boundaries = []
    for curve in curves:
        roots_on_stable_side = plane.unstable(np.clip(curve.shares - ASIDE * curve.normals, 0.0, 1.0))
        growth = spread(plane, curve, uncertain) if uncertain else np.full(len(curve), np.nan)
        boundaries.append(NamedBoundary(curve, name_crossing_root(plane, curve), roots_on_stable_side, growth))
    return StabilityChart(plane, tuple(boundaries), check, uncertain, tuple(marks(plane)))


def contour_values(plane: Plane, output: Output, count: int = 41) -> tuple[Array, Array]:
    """Compute an output on a grid: shares (count,) of either axis, and values (count, count), NaN where none."""
    share = np.linspace(0, 1, count)
    shares = lattice(share, share)
    points = plane.x(shares)
    speeds = plane.speeds(shares)
    if output.source == ROOTS:
        values = output.function(eigenvalues(plane.space.matrices(points, plane.speed)))
    else:
        pairs = zip(points, speeds, strict=True)
        values = [np.ravel(output.function(plane.space.model_at(x), np.array([v]), v))[0] for x, v in pairs]
    return share, np.asarray(values, float).reshape(count, count)


def title(chart: StabilityChart) -> str:
    """Write a title: the bicycle, its effects and the speed, unless it is an axis."""
    plane = chart.plane
    effects = [e.identifier.replace("_", " ") for e in plane.space.model.effects if e.identifier != "no_slip"]
    added = f" with {', '.join(effects)}" if effects else ""
    speed = "" if plane.speed is None else f", at {plane.speed:g} m/s"
    return f"Stability: {plane.space.model.bicycle.name}{added}{speed}"


def headers(chart: StabilityChart) -> list[str]:
    """Make the headers of :func:`rows`."""
    names = [f"{span.axis.key} {span.axis.unit}".removesuffix(" 1") for span in chart.plane.spans]
    sd = [f"sd {name}, median along it" for name in names] if chart.uncertain else []
    return ["boundary", "mode", *names, "frequency Hz", *sd, "other modes", "remark"]


def rows(chart: StabilityChart) -> list[list[Any]]:
    """Make a row per boundary: mode, ranges, frequency, standard deviations, and what is stable on its stable side."""
    table = []
    for number, boundary in enumerate(chart.boundaries, 1):
        points = chart.plane.x(boundary.curve.shares)
        stable = float(np.mean(boundary.roots_on_stable_side == 0))
        remark = ""
        if boundary.curve.closed:
            remark = "closed"
        elif DOUBLE_ZERO in boundary.curve.ends:
            remark = "ends where its frequency becomes zero"
        table.append(
            [
                number,
                " / ".join((name or "unknown").replace("+", " or ") for name in boundary.distinct),
                *(_range(values) for values in (*points.T, boundary.frequency)),
                *_deviations(chart, boundary),
                "stable" if stable == 1 else "unstable" if stable == 0 else f"stable along {100 * stable:.0f} %",
                remark,
            ]
        )
    return table


def _range(values: Any) -> str:
    """Print lowest and highest of the values, or one if they print alike."""
    low, high = f"{values.min():.4g}", f"{values.max():.4g}"
    return low if low == high else f"{low} .. {high}"


def _deviations(chart: StabilityChart, boundary: NamedBoundary) -> list[str]:
    """Print the median sd along each axis, in its unit; "beyond" if it is longer than the axis."""
    if not chart.uncertain:
        return []
    share, size = np.median(boundary.spread[:, :2], axis=0), np.median(chart.plane.scale(boundary.curve.shares), axis=0)
    return ["0" if s < 1e-9 else "beyond" if s > 1 else f"{s * x:.2g}" for s, x in zip(share, size, strict=True)]


def describe_check(chart: StabilityChart) -> list[str]:
    """Write lines on the check of the chart, and on its band."""
    slowest = speed_of_rest(chart.plane.space)
    from_rest = any(span.axis.key == SPEED and span.low == slowest for span in chart.plane.spans)
    return _render("checked", chart, rest=slowest, from_rest=from_rest)


def _render(name: str, chart: StabilityChart, **more: Any) -> list[str]:
    content = {"chart": chart, "check": chart.check, **more}
    return render_file("studies.chart", f"{name}.txt.j2", content, escaped=False).splitlines()


def record(chart: StabilityChart) -> dict[str, Any]:
    """Make the chart JSON-ready; points in the units of the axes."""
    plane, check, table = chart.plane, chart.check, chart.frame()
    return {
        "axes": [
            {"key": s.axis.key, "unit": s.axis.unit, "low": s.low, "high": s.high, "log": s.log} for s in plane.spans
        ],
        "speed_m_s": plane.speed,
        "boundaries": [
            {
                "modes": list(boundary.distinct),
                "kind": "real" if boundary.curve.real else "oscillatory",
                "closed": boundary.curve.closed,
                "ends": list(boundary.curve.ends),
                "points": plane.x(boundary.curve.shares).tolist(),
                "frequency_Hz": boundary.frequency.tolist(),
                "unstable_roots_on_the_stable_side": boundary.roots_on_stable_side.tolist(),
                "sd": [_json_numbers(table.loc[table.boundary == number, f"sd_{s.axis.column}"]) for s in plane.spans]
                if chart.uncertain
                else None,
            }
            for number, boundary in enumerate(chart.boundaries, 1)
        ],
        "marks": [
            dict(zip(("kind", "label", "x", "y"), (m.kind, m.label, *_json_numbers((m.x, m.y))), strict=True))
            for m in chart.marks
        ],
        "check": {
            "grid_points": check.far.size,
            "more_than_a_cell_from_boundaries": int(check.far.sum()),
            "not_explained": int(check.wrong.sum()),
            "points_with_wrong_sides": check.sides,
        },
        "uncertain": list(chart.uncertain.names),
        "doubts": chart.doubts,
    }


def _json_numbers(values: Any) -> list[float | None]:
    """Make numbers JSON-ready: None for what is not finite."""
    return [float(value) if np.isfinite(value) else None for value in values]
