"""How far a tyre map may be asked: beyond the measured loads and pressures, but not anywhere."""

from tyre.maps.tables import PASCAL_PER_BAR
from tyre.maps.tyre_map import TyreMap


def out_of_reach(tyre_map: TyreMap, *, load: float, pressure: float) -> str | None:
    """Say which of load and pressure lies farther outside the measured range than that range is wide.

    Parameters
    ----------
    tyre_map : TyreMap
    load, pressure : float
        N and Pa.

    Returns
    -------
    str or None
        In words, with what was measured; None within reach.
    """
    bars = tyre_map.pressures / PASCAL_PER_BAR
    for value, lines, unit in ((load, tyre_map.loads, "N"), (pressure / PASCAL_PER_BAR, bars, "bar")):
        low, high = float(lines[0]), float(lines[-1])
        outside = max(low - value, value - high)
        if lines.size > 1 and outside > (high - low) * (1 + 1e-9):  # of a single one the map says nothing anyway
            return (
                f"{value:.4g} {unit} is farther outside the {low:g}-{high:g} {unit} at which {tyre_map.measured.label} "
                "was measured than that range is wide"
            )
    return None
