"""What is odd about a channel for what it measures: an offset of a rate, a sign that contradicts another channel."""

import numpy as np

from studies.look.roles import Roles
from tyre.channels.units import GRAVITY, find_unit, quantity_of

RATES = ("roll_rate", "steer_rate", "yaw_rate")
PAIRS = (("lean", "roll_rate"), ("steer", "steer_rate"))
NEAR_G = 0.05
OFFSET = 0.3  # of the spread of a rate about its median
CORRELATED = 0.5


def oddities(roles: Roles, column: str) -> tuple[str, ...]:
    """What is odd about a ``column`` of a file, a phrase each; see :class:`Roles`."""
    seen = roles.opened.quality[column]
    unit = roles.opened.signals.signals[column].unit
    if seen.dead:
        return ()
    found = []
    names = {name: roles.opened.signals.find(given) for name, given in roles.names([*RATES, "lean", "steer"]).items()}
    mine = [name for name, whole in names.items() if whole == column]
    values = roles.opened.signals.signals[column].values
    if any(name in RATES for name in mine):
        spread = 1.4826 * float(np.nanmedian(np.abs(values - seen.median)))
        if abs(seen.median) > OFFSET * spread:
            found.append(f"median {seen.median:.3g}, straight on it would be 0: an offset, or a long bend?")
    if quantity_of(unit) == "acceleration":
        middle = find_unit(unit, "acceleration", where=column).factor * seen.median
        if abs(abs(middle) / GRAVITY - 1) < NEAR_G:
            found.append(f"shows gravity: its axis points {'up' if middle > 0 else 'down'} or the unit is another")
    for angle, rate in PAIRS:
        if rate in mine and angle in names:
            sign = _agreement(roles, names[angle], column)
            if sign < -CORRELATED:
                found.append(f"runs against the change of {angle} ({names[angle]}): one of the two needs sign = -1")
    return tuple(found)


def _agreement(roles: Roles, angle: str, rate: str) -> float:
    """Correlation of a rate with the change of an angle over some samples; 0 where it cannot be told."""
    signals = roles.opened.signals.signals
    if signals[angle].values.size != signals[rate].values.size or signals[rate].values.size < 50:
        return 0.0
    time, x, y = roles.opened.time_of(rate), signals[angle].values, signals[rate].values
    span = max(x.size // 500, 5)
    change = x[span:] - x[:-span]
    total = np.cumsum(np.nan_to_num(y[:-1]) * np.diff(time))
    meant = total[span - 1 :] - np.concatenate([[0.0], total[:-span]])
    good = np.isfinite(change) & np.isfinite(meant)
    if good.sum() < 50 or np.ptp(change[good]) == 0 or np.ptp(meant[good]) == 0:
        return 0.0
    return float(np.corrcoef(change[good], meant[good])[0, 1])
