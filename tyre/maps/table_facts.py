"""What a map of a measured table tells of itself, as :class:`tyre.tyre_source.TyreSource` asks it."""

from collections.abc import Mapping

from tyre.base.arrays import Array
from tyre.maps.conditions_grid import ConditionsGrid
from tyre.maps.stiffness_trend import Trend
from tyre.maps.tables import MeasuredTable


class TableFacts:
    """Name, origin and range of a measured table, and its values at many conditions."""

    measured: MeasuredTable

    @property
    def cornering_stiffness_trend(self) -> Trend:
        """The smooth law of C_Fy."""
        raise NotImplementedError

    @property
    def lateral_stiffness_trend(self) -> Trend:
        """The smooth law of K_y."""
        raise NotImplementedError

    @property
    def label(self) -> str:
        """``tyre on surface``, for messages."""
        return self.measured.label

    @property
    def description(self) -> str:
        """What the tyre is."""
        return self.measured.description

    @property
    def source(self) -> str:
        """Where the numbers come from."""
        return self.measured.source

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader of any value must be told."""
        return self.measured.notes

    @property
    def synthetic(self) -> bool:
        """True where no rig measured the tyre."""
        return self.measured.synthetic

    @property
    def width(self) -> float | None:
        """Of the tyre, m."""
        return self.measured.width

    @property
    def load_range(self) -> tuple[float, float]:
        """Lowest and highest measured load, N."""
        return float(self.measured.load.min()), float(self.measured.load.max())

    @property
    def pressure_range(self) -> tuple[float, float]:
        """Lowest and highest measured pressure, Pa."""
        return float(self.measured.pressure.min()), float(self.measured.pressure.max())

    @property
    def range_kind(self) -> str:
        """What the ranges are, in words."""
        return f"at which {self.label} was measured"

    def linear(self, *, load: Array, pressure: Array) -> Mapping[str, Array]:
        """C_Fy, K_y and relaxation length at many conditions, as ``at`` gives them for one; nothing is checked.

        Parameters
        ----------
        load, pressure : ndarray, shape (n,)
            N and Pa.

        Returns
        -------
        dict of str to ndarray, shape (n,)
            By the name of the field of `TyreProperties`, SI units.
        """
        # a sum over each row: the same to the last bit however many conditions are asked together
        weights = ConditionsGrid(self.measured.load, self.measured.pressure).weights(load, pressure)
        cornering, lateral = (
            trend.evaluate(load, pressure)[0] + (weights * trend.residuals).sum(1)
            for trend in (self.cornering_stiffness_trend, self.lateral_stiffness_trend)
        )
        return {
            "cornering_stiffness": cornering,
            "lateral_stiffness": lateral,
            "relaxation_length": cornering / lateral,
        }
