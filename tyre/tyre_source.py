"""What every tyre answers, be it a measured table, a .tir file or published coefficients."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from tyre.base.arrays import Array
from tyre.base.units import PASCAL_PER_BAR
from tyre.joint_properties import JointProperties
from tyre.properties import Origin, TyreProperties


class Ranged(Protocol):
    """Where a tyre holds: the last three attributes of a :class:`TyreSource`."""

    @property
    def load_range(self) -> tuple[float, float]: ...
    @property
    def pressure_range(self) -> tuple[float, float]: ...
    @property
    def range_kind(self) -> str: ...


class TyreSource(Ranged, Protocol):
    """A tyre on one surface, to be asked at any load and pressure.

    Attributes
    ----------
    tyre, surface : str
        Its name; ``flat`` or ``drum``.
    label : str
        ``tyre on surface``, for messages.
    description, source : str
        What it is, and where its numbers come from.
    notes : tuple of str
        What a reader of any value must be told.
    synthetic : bool
        True where no rig measured it.
    width : float or None
        m.
    loads, pressures : ndarray
        Conditions worth looking at, N and Pa, ascending.
    load_range, pressure_range : (float, float)
        Where it holds, N and Pa; (0, inf) where that is not stated.
    range_kind : str
        What the ranges are, in words that follow them: ``at which Tyre1 on flat was measured``.
    """

    @property
    def tyre(self) -> str: ...
    @property
    def surface(self) -> str: ...
    @property
    def label(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def source(self) -> str: ...
    @property
    def notes(self) -> tuple[str, ...]: ...
    @property
    def synthetic(self) -> bool: ...
    @property
    def width(self) -> float | None: ...
    @property
    def loads(self) -> Array: ...
    @property
    def pressures(self) -> Array: ...

    def at(self, *, load: float, pressure: float) -> TyreProperties:
        """Return the properties at one vertical ``load`` (N) and inflation ``pressure`` (Pa)."""

    def jointly(self, conditions: Sequence[tuple[float, float]]) -> JointProperties:
        """Return the properties at ``conditions`` (load N, pressure Pa), with their joint covariance."""

    def origin(self, *, load: float, pressure: float) -> Origin:
        """Say how values come about at a ``load`` (N) and ``pressure`` (Pa)."""

    def linear(self, *, load: Array, pressure: Array) -> Mapping[str, Array]:
        """Values by the name of a field of `TyreProperties`, for ``load`` (N) and ``pressure`` (Pa), (n,) each.

        The conditions are not checked. What the tyre does not hold is left out.
        """

    def assuming(self, relative_sd: float, /) -> Any:
        """Return the same tyre with ``relative_sd`` as standard deviation wherever its source states none."""


def stated_range(tyre: Ranged) -> str:
    """The loads and pressures where a tyre holds, for messages.

    Parameters
    ----------
    tyre : Ranged
    """
    (low, high), (soft, hard) = tyre.load_range, tyre.pressure_range
    return f"{low:g}-{high:g} N and {soft / PASCAL_PER_BAR:g}-{hard / PASCAL_PER_BAR:g} bar"


def out_of_reach(tyre: Ranged, *, load: float, pressure: float) -> str | None:
    """Say which of load and pressure lies farther outside the range where a tyre holds than that range is wide.

    Parameters
    ----------
    tyre : Ranged
    load, pressure : float
        N and Pa.

    Returns
    -------
    str or None
        In words, with the range; None within reach. A billionth of the range more is still within reach: rounding.
    """
    bars = tuple(end / PASCAL_PER_BAR for end in tyre.pressure_range)
    for value, (low, high), unit in ((load, tyre.load_range, "N"), (pressure / PASCAL_PER_BAR, bars, "bar")):
        outside = max(low - value, value - high)
        if low < high and outside > (high - low) * (1 + 1e-9):  # of a single one the tyre says nothing anyway
            reach = f"{low:g}-{high:g} {unit} {tyre.range_kind}"
            return f"{value:.4g} {unit} is farther outside the {reach} than that range is wide"
    return None
