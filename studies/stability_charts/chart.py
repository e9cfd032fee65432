"""A stability chart: boundaries with the names of their modes, what is uncertain, and how they were checked."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.oscillation import frequency_hz
from studies.stability_charts.band import BAND
from studies.stability_charts.boundary import DOUBLE_ZERO, LOST, Boundary
from studies.stability_charts.checking import ASIDE, Check, completed
from studies.stability_charts.marks import Mark, marks
from studies.stability_charts.naming import Names, named
from studies.stability_charts.plane import Plane
from studies.stability_charts.search import all_boundaries, counted
from studies.stability_charts.spread import Uncertain, along_axes, spread
from tyre.base.arrays import Array

if TYPE_CHECKING:
    import pandas as pd

STEP = 1 / 150  # of the axes, the longest along a boundary
WIDE = 0.3  # of the axes: a band whose half width is more along half of a boundary is no band


@dataclass(frozen=True, eq=False)
class NamedBoundary:
    """A boundary of a chart.

    Attributes
    ----------
    curve : Boundary
    names : Names
        Of the mode that crosses.
    beside : ndarray of int, shape (m,)
        Number of unstable roots on the stable side of each point.
    growth_sd : ndarray, shape (m,)
        Standard deviation of the real part of the root, 1/s; NaN where nothing is uncertain.
    """

    curve: Boundary
    names: Names
    beside: NDArray[np.intp]
    growth_sd: Array

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
        """Whether the band is narrow enough for first order to mean something."""
        return bool(np.median(BAND * self.spread[:, 2]) <= WIDE)


@dataclass(frozen=True, eq=False)
class StabilityChart:
    """Boundaries over a plane, and what was found on the way."""

    plane: Plane
    boundaries: tuple[NamedBoundary, ...]
    check: Check
    uncertain: Uncertain
    marks: tuple[Mark, ...]

    def frame(self) -> "pd.DataFrame":
        """A row per point of a boundary; units stand in the names of the columns."""
        import pandas as pd

        axes = [span.axis for span in self.plane.spans]
        tables = []
        for number, one in enumerate(self.boundaries, 1):
            curve, points = one.curve, self.plane.x(one.curve.shares)
            scale = np.stack([span.slope(curve.shares[:, i]) for i, span in enumerate(self.plane.spans)], -1)
            columns: dict[str, Any] = {axis.column: points[:, i] for i, axis in enumerate(axes)}
            columns |= {
                "boundary": number, "closed": curve.closed, "mode": [name or "unknown" for name in one.names.names],
                "mode_asked_here": one.names.asked, "kind": "real" if curve.real else "oscillatory",
                "frequency_Hz": one.frequency, "residual_real_1_s": curve.roots.real,
                "largest_root_1_s": curve.sizes, "unstable_roots_on_the_stable_side": one.beside,
                f"towards_instability_{axes[0].key}": curve.normals[:, 0],
                f"towards_instability_{axes[1].key}": curve.normals[:, 1],
            }  # fmt: skip
            if self.uncertain:
                sd = one.spread
                columns |= {f"sd_{axis.column}": sd[:, i] * scale[:, i] for i, axis in enumerate(axes)}
                columns["sd_normal_share_of_axes"] = sd[:, 2]
            columns["tyre_inside_measured_range"] = self.plane.space.inside(points)
            tables.append(pd.DataFrame(columns))
        names = [axis.column for axis in axes] + ["boundary", "mode", "kind", "frequency_Hz"]
        return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=names)

    def regions(self, first: Array, second: Array) -> NDArray[np.intp]:
        """Number of unstable roots (k, l) on a grid as the boundaries tell it.

        Parameters
        ----------
        first, second : ndarray, shape (k,) and (l,)
            Rising shares of the axes, from 0 to 1.
        """
        grid = self.check.grid
        start = int(self.check.told[0, 0] - counted(self.curves, grid, grid, 0)[0, 0])
        return counted(self.curves, first, second, start)

    @property
    def curves(self) -> tuple[Boundary, ...]:
        """The boundaries without their names."""
        return tuple(one.curve for one in self.boundaries)

    @property
    def doubts(self) -> list[str]:
        """What is not certain about this chart, in sentences."""
        said, check = [], self.check
        if check.wrong.any():
            where = np.argwhere(check.wrong)[0]
            place = self.plane.x(check.grid[where][None])[0]
            said.append(
                f"at {int(check.wrong.sum())} of {check.wrong.size} points of the checking grid the number of unstable "
                f"roots is not what the boundaries tell (the first at {self.place(place)}): a boundary is missing"
            )
        if check.sides:
            said.append(
                f"at {check.sides} of {check.compared} points of boundaries the number of unstable roots on the two "
                "sides does not differ as one root makes it: boundaries may run close to each other there"
            )
        for number, one in enumerate(self.boundaries, 1):
            for k, end in enumerate(one.curve.ends):
                if end == LOST:
                    at = self.plane.x(one.curve.shares[[0, -1]])[k]
                    said.append(f"boundary {number} could not be followed beyond {self.place(at)}")
            if self.uncertain and not one.band_is_told:
                said.append(
                    f"boundary {number}: its band would be wider than most of the chart, where first order means "
                    "little; it is not drawn"
                )
            joint = [name for name in one.names.distinct if "+" in name or not name]
            if joint:
                which = " and ".join((name or "unknown").replace("+", " or ") for name in joint)
                said.append(f"boundary {number}: for part of it the mode is not certain ({which})")
            elif len(one.names.distinct) > 1:
                said.append(f"boundary {number} is called {', then '.join(one.names.distinct)}: modes exchange names")
        return said

    def place(self, x: Array) -> str:
        """Coordinates ``x`` (2,) in the units of the axes, in words."""
        return ", ".join(
            f"{span.axis.key} = {value:.4g} {span.axis.unit}" for span, value in zip(self.plane.spans, x, strict=True)
        )

    def ends(self, one: NamedBoundary) -> str:
        """How the boundary ``one`` begins and ends, in words."""
        if one.curve.closed:
            return "closed"
        return "ends where its frequency becomes zero" if DOUBLE_ZERO in one.curve.ends else ""


def stability_chart(
    plane: Plane, *, sd: Mapping[str, float] | None = None, assume: bool = False, step: float = STEP
) -> StabilityChart:
    """Every boundary of a plane, named, with the uncertainty that the model states, and checked.

    Parameters
    ----------
    plane : Plane
    sd : mapping of str to float, optional
        Further standard deviations, SI.
    assume : bool
        Whether what nobody states has a default standard deviation.
    step : float
        Longest step along a boundary, as a share of the axes.
    """
    uncertain = Uncertain.of(plane, sd, assume=assume)
    curves, check = completed(plane, all_boundaries(plane, step=step), step=step)
    return StabilityChart(
        plane, tuple(_named(plane, curve, uncertain) for curve in curves), check, uncertain, tuple(marks(plane))
    )


def _named(plane: Plane, curve: Boundary, uncertain: Uncertain) -> NamedBoundary:
    beside = plane.unstable(np.clip(curve.shares - ASIDE * curve.normals, 0.0, 1.0))
    growth = spread(plane, curve, uncertain) if uncertain else np.full(len(curve), np.nan)
    return NamedBoundary(curve, named(plane, curve), beside, growth)
