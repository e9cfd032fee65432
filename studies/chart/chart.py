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
    space, x, count = plane.space, plane.x(boundary.shares), len(boundary)
    values, rules = space.values(x), Rules.of(space.linear)
    gravity, wheelbase = (np.broadcast_to(np.asarray(values[key], float), count) for key in "gw")
    polynomial = space.family.polynomials(values, count)[0]
    speeds, row = plane.speeds(boundary.shares), np.arange(count)
    found = name_points(rules, polynomial, np.sqrt(gravity * wheelbase), gravity, row, speeds)
    away = np.abs(found.values - 1j * np.abs(boundary.roots.imag)[:, None])
    own = away.argmin(1)
    near = away[row, own] < FAR * boundary.sizes + 1e-6
    pairs = zip(near, found.first[row, own].tolist(), found.second[row, own].tolist(), strict=True)
    return tuple(rules.name(first, second) if known else "" for known, first, second in pairs)


@dataclass(frozen=True)
class Uncertain:
    """Numbers that are uncertain, p of them: ``names``, ``covariance`` (p, p) in SI units, ``values`` (p,)."""

    names: tuple[str, ...]
    covariance: Array
    values: Array

    @classmethod
    def of(cls, plane: Plane, given: Mapping[str, float] | None = None, *, assume: bool = False) -> "Uncertain":
        """Numbers that the model states or that are given, SI, without those of the axes; ``assume`` takes defaults."""
        names, covariance = model_covariance(plane.space.model, given, assume=assume)
        own = {entry for entries in plane.space.entries for entry in entries}
        kept = [i for i, name in enumerate(names) if name not in own]
        values = plane.space.model.parameters
        chosen = tuple(names[i] for i in kept)
        return cls(chosen, covariance[np.ix_(kept, kept)], np.array([values[name] for name in chosen]))

    def __bool__(self) -> bool:
        return bool(self.names)


def spread(plane: Plane, boundary: Boundary, uncertain: Uncertain) -> Array:
    """Standard deviation (m,) of the real part of the crossing root along a boundary, 1/s."""
    space, points = plane.space, plane.x(boundary.shares)
    values, right = np.linalg.eig(space.matrices(points, plane.speed))
    left = np.linalg.inv(right)
    own, row = np.abs(values - boundary.roots[:, None]).argmin(1), np.arange(len(points))
    u, x = left[row, own], right[row, :, own]
    here, slopes = space.values(points), []
    for name, value, variance in zip(uncertain.names, uncertain.values, np.diag(uncertain.covariance), strict=True):
        at = np.broadcast_to(np.asarray(here[name], float), len(points))
        share = at / value if value else np.ones(len(at))  # of a tyre that is softer here than in the model
        step = 1e-5 * np.maximum(np.abs(at), np.sqrt(variance) * np.abs(share))
        ends = [space.matrices(points, plane.speed, {name: at + sign * step}) for sign in (1, -1)]
        slopes.append(np.einsum("mi,mij,mj->m", u, (ends[0] - ends[1]) / (2 * step)[:, None, None], x).real * share)
    return np.asarray(standard_deviation(np.stack(slopes, -1), uncertain.covariance))


def along_axes(boundary: Boundary, growth: Array) -> Array:
    """Standard deviations (m, 3) of a boundary in shares of the axes, from those of the real part (m,) in 1/s."""
    uphill = np.abs(boundary.gradients.real)
    with np.errstate(divide="ignore"):
        return np.stack([growth / uphill[:, 0], growth / uphill[:, 1], growth / np.hypot(*uphill.T)], -1)


def band_of(shares: Array, sd: Array) -> tuple[Array, Array]:
    """Shares (k,) of either axis, and distances (k, k) of such points in half widths of the band of a boundary."""
    share = np.linspace(0, 1, CELLS + 1)
    point = np.arange(len(shares))
    between = np.linspace(0, len(point) - 1, 6 * len(point))
    dense = np.stack([np.interp(between, point, along) for along in shares.T], -1)
    away, at = scipy.spatial.KDTree(dense).query(lattice(share, share))
    away = away / np.maximum(BAND * np.interp(between, point, sd)[at], 1e-12)
    return share, away.reshape(CELLS + 1, CELLS + 1)


@dataclass(frozen=True, eq=False)
class NamedBoundary:
    """A boundary, and at each point (m) the name of its mode and the number of unstable roots on its stable side."""

    curve: Boundary
    names: tuple[str, ...]  # m; two joined by a plus where in doubt, empty where unknown
    beside: NDArray[np.intp]  # (m,), unstable roots just off the boundary, on its stable side
    growth_sd: Array  # (m,), 1/s, of the real part of the crossing root

    @property
    def distinct(self) -> tuple[str, ...]:
        """Every name along the boundary, in order."""
        return tuple(dict.fromkeys(self.names))

    def pieces(self, plane: Plane) -> Iterator[tuple[str, bool, Array, Array]]:
        """Stretches of one name: whether each limits what is stable, its points (m, 2) and frequencies (m,) in Hz."""
        order, start = [*range(len(self.names)), *[0] * self.curve.closed], 0
        points, hertz = plane.x(self.curve.shares)[order], self.frequency[order]
        kinds = [(self.names[k], bool(self.beside[k] == 0)) for k in order]
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
    def band_is_told(self) -> bool:
        """True if the band is narrow enough for first order to mean something."""
        return bool(np.median(BAND * self.spread[:, 2]) <= WIDE)


@dataclass(frozen=True, eq=False)
class StabilityChart:
    """Boundaries over a plane, and what was found on the way."""

    plane: Plane
    boundaries: tuple[NamedBoundary, ...]
    check: Check
    uncertain: Uncertain
    marks: tuple[Mark, ...]

    def frame(self) -> pd.DataFrame:
        """A row per point of a boundary; units stand in the names of the columns."""
        axes = [span.axis for span in self.plane.spans]
        tables = []
        for number, one in enumerate(self.boundaries, 1):
            curve, points = one.curve, self.plane.x(one.curve.shares)
            columns: dict[str, Any] = {axis.column: points[:, i] for i, axis in enumerate(axes)}
            columns |= {
                "boundary": number,
                "closed": curve.closed,
                "mode": [name or "unknown" for name in one.names],
                "kind": "real" if curve.real else "oscillatory",
                "frequency_Hz": one.frequency,
                "residual_real_1_s": curve.roots.real,
                "largest_root_1_s": curve.sizes,
                "unstable_roots_on_the_stable_side": one.beside,
                f"towards_instability_{axes[0].key}": curve.normals[:, 0],
                f"towards_instability_{axes[1].key}": curve.normals[:, 1],
            }
            if self.uncertain:
                sd, scale = one.spread, self.plane.scale(curve.shares)
                columns |= {f"sd_{axis.column}": sd[:, i] * scale[:, i] for i, axis in enumerate(axes)}
                columns["sd_normal_share_of_axes"] = sd[:, 2]
            columns["tyre_inside_measured_range"] = self.plane.space.inside(points)
            tables.append(pd.DataFrame(columns))
        names = [axis.column for axis in axes] + ["boundary", "mode", "kind", "frequency_Hz"]
        return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=names)

    def regions(self, first: Array, second: Array) -> NDArray[np.intp]:
        """Number of unstable roots (k, l) as the boundaries tell it, at rising shares (k,) and (l,) of the axes."""
        grid = self.check.grid
        start = int(self.check.told[0, 0] - count_unstable(self.curves, grid, grid, 0)[0, 0])
        return count_unstable(self.curves, first, second, start)

    @property
    def curves(self) -> tuple[Boundary, ...]:
        """The boundaries without their names."""
        return tuple(one.curve for one in self.boundaries)

    @property
    def doubts(self) -> list[str]:
        """Remarks on what is not certain about this chart."""
        missing = self.check.grid[np.argwhere(self.check.wrong)[:1]]

        def place(shares: Array) -> list[tuple[str, float, str]]:
            found = zip(self.plane.spans, self.plane.x(np.reshape(shares, (1, 2)))[0], strict=True)
            return [(span.axis.key, value, span.axis.unit) for span, value in found]

        return _render("doubts", self, missing=missing, place=place)


def stability_chart(
    plane: Plane, *, sd: Mapping[str, float] | None = None, assume: bool = False, step: float = 1 / 150
) -> StabilityChart:
    """Every boundary of a plane, named, with the uncertainty that the model states, and checked."""
    uncertain = Uncertain.of(plane, sd, assume=assume)
    curves, check = complete_boundaries(plane, all_boundaries(plane, step=step), step=step)
    boundaries = []
    for curve in curves:
        beside = plane.unstable(np.clip(curve.shares - ASIDE * curve.normals, 0.0, 1.0))
        growth = spread(plane, curve, uncertain) if uncertain else np.full(len(curve), np.nan)
        boundaries.append(NamedBoundary(curve, name_crossing_root(plane, curve), beside, growth))
    return StabilityChart(plane, tuple(boundaries), check, uncertain, tuple(marks(plane)))


def contour_values(plane: Plane, output: Output, count: int = 41) -> tuple[Array, Array]:
    """Shares (count,) of either axis, and an output of one number (count, count) there; NaN where there is none."""
    share = np.linspace(0, 1, count)
    shares = lattice(share, share)
    points, speeds = plane.x(shares), plane.speeds(shares)
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
    return ["boundary", "mode", *names, "frequency Hz", *sd, "of a bicycle that is", "remark"]


def rows(chart: StabilityChart) -> list[list[Any]]:
    """A row per boundary: mode, ranges, frequency, standard deviations, and what is stable on its stable side."""
    found = []
    for number, one in enumerate(chart.boundaries, 1):
        points, stable = chart.plane.x(one.curve.shares), float(np.mean(one.beside == 0))
        remark = ""
        if one.curve.closed:
            remark = "closed"
        elif DOUBLE_ZERO in one.curve.ends:
            remark = "ends where its frequency becomes zero"
        found.append(
            [
                number,
                " / ".join((name or "unknown").replace("+", " or ") for name in one.distinct),
                *(_range(values) for values in (*points.T, one.frequency)),
                *_deviations(chart, one),
                "stable" if stable == 1 else "unstable anyhow" if stable == 0 else f"stable on {stable:.0%} of it",
                remark,
            ]
        )
    return found


def _range(values: Any) -> str:
    low, high = f"{values.min():.4g}", f"{values.max():.4g}"
    return low if low == high else f"{low} .. {high}"


def _deviations(chart: StabilityChart, one: NamedBoundary) -> list[str]:
    if not chart.uncertain:
        return []
    share, size = np.median(one.spread[:, :2], axis=0), np.median(chart.plane.scale(one.curve.shares), axis=0)
    return ["0" if s < 1e-9 else "beyond" if s > 1 else f"{s * x:.2g}" for s, x in zip(share, size, strict=True)]


def checked(chart: StabilityChart) -> list[str]:
    """Write lines on the check of the chart, and on its band."""
    rest = speed_of_rest(chart.plane.space)
    from_rest = any(span.axis.key == SPEED and span.low == rest for span in chart.plane.spans)
    return _render("checked", chart, rest=rest, from_rest=from_rest)


def _render(name: str, chart: StabilityChart, **more: Any) -> list[str]:
    content = {"chart": chart, "check": chart.check, **more}
    return render_file("studies.chart", f"{name}.txt.j2", content, escaped=False).splitlines()


def record(chart: StabilityChart) -> dict[str, Any]:
    """The chart as JSON-ready data."""
    plane, check, table = chart.plane, chart.check, chart.frame()
    return {
        "axes": [
            {"key": s.axis.key, "unit": s.axis.unit, "low": s.low, "high": s.high, "log": s.log} for s in plane.spans
        ],
        "speed_m_s": plane.speed,
        "boundaries": [
            {
                "modes": list(one.distinct),
                "kind": "real" if one.curve.real else "oscillatory",
                "closed": one.curve.closed,
                "ends": list(one.curve.ends),
                "points": plane.x(one.curve.shares).tolist(),
                "frequency_Hz": one.frequency.tolist(),
                "unstable_roots_on_the_stable_side": one.beside.tolist(),
                "sd": [_finite(table.loc[table.boundary == number, f"sd_{s.axis.column}"]) for s in plane.spans]
                if chart.uncertain
                else None,
            }
            for number, one in enumerate(chart.boundaries, 1)
        ],
        "marks": [
            dict(zip(("kind", "label", "x", "y"), (m.kind, m.label, *_finite((m.x, m.y))), strict=True))
            for m in chart.marks
        ],
        "check": {
            "grid_points": check.apart.size,
            "more_than_a_cell_from_boundaries": int(check.apart.sum()),
            "not_explained": int(check.wrong.sum()),
            "points_with_wrong_sides": check.sides,
        },
        "uncertain": list(chart.uncertain.names),
        "doubts": chart.doubts,
    }


def _finite(values: Any) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]
