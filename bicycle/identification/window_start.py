"""Whether a decay depends on where its window begins: the same fit from later starts, up to a quarter of a cycle.

A later window is a part of the earlier one, so the difference of the two estimates has the difference of their
variances (Hausman 1978, Econometrica 46, 1251-1271). The noise of each window is estimated anew, so a later window may
state the smaller sd; its variance is taken to be larger at least by the share of the oscillation's energy that it
lacks. What moves farther than its sd, and farther than that explains, is a transient of the start: a kick that still
lasts, or a fast mode.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from bicycle.identification.decay_estimate import Estimate, clearer, estimate
from bicycle.identification.decay_window import window
from bicycle.identification.run import Run
from tyre.base.arrays import Array
from tyre.base.errors import InputError

STEPS = 3
REACH = 0.25  # of a cycle
BY_CHANCE = 2.5  # sd of the difference that a part of the samples makes
CERTAIN = 3.4  # the same, for a refusal: with twelve comparisons one sound window of a hundred
TOO_FAR = 3.0  # sd beyond which a start is refused where a later one settles
PARTS = ("real part", "imaginary part")


@dataclass(frozen=True)
class Movement:
    """How far an estimate moves when its window begins later.

    Attributes
    ----------
    shifts : dict
        Name of a number (real part, imaginary part, a ratio) -> how far it moves beyond chance (its own unit; 0: not).
    farthest : float
        Largest of them over the sd of its number before it was widened.
    what : str
        Name of that number; empty where nothing moves.
    tried_s : float
        The latest start, s after the first sample of the run.
    settled_s : float or None
        The first start from which nothing moves any more; None where there is none.
    refused : bool
        Whether it moves too far, beyond what chance does in one of a hundred windows, while a later start would do.
    """

    shifts: dict[str, float]
    farthest: float
    what: str
    tried_s: float
    settled_s: float | None
    refused: bool


def movement(run: Run, found: Estimate, number: int, last_s: float, *, beside: bool) -> Movement | None:
    """Fit a window again from later starts.

    Parameters
    ----------
    run : Run
    found : Estimate
        Of the window itself.
    number : int
        Which of its modes.
    last_s : float
        End of the window, s after the first sample of the run.
    beside : bool
        The other modes were not asked for; later they may have died away.

    Returns
    -------
    Movement or None
        None where no later window is long enough.
    """
    fits = [(found, number)]
    cycle = 2 * math.pi / float(found.mean[number, 1])
    steps = dict.fromkeys(max(round(REACH * cycle * k / STEPS / run.step), 1) * run.step for k in range(1, STEPS + 1))
    for step in steps:
        later = _later(run, found, number, step, last_s, beside=beside)
        if later is None:
            break
        fits.append(later)
    if len(fits) == 1:
        return None
    table, energy = [numbers_of(*fit) for fit in fits], _energy(found, [fit.window.start for fit, _ in fits])
    shifts, farthest, what = moved(table, energy, 0)
    settled = next((place for place in range(1, len(fits) - 1) if moved(table, energy, place)[1] == 0), None)
    refused = settled is not None and moved(table, energy, 0, CERTAIN)[1] > TOO_FAR
    return Movement(
        shifts, farthest, what, fits[-1][0].window.start, None if settled is None else fits[settled][0].window.start,
        refused,
    )  # fmt: skip


def _later(
    run: Run, found: Estimate, number: int, step: float, last_s: float, *, beside: bool
) -> tuple[Estimate, int] | None:
    """The fit of the window that begins a ``step`` later, and the place of the mode in it."""
    likely = [drift for drift, weight in found.kinds.items() if weight > 0.05]
    try:
        w = window(run, found.window.start + step, last_s, block=found.window.block, driven=found.window.driven)
    except InputError:
        return None
    known = found.best.best
    whole = estimate(w, likely, [known])
    if beside:
        alone = estimate(w, likely, [known[number : number + 1]])
        if alone is not None and (whole is None or not clearer(whole.best, alone.best)):
            return alone, 0
    return None if whole is None else (whole, same_mode(known, whole.mean, number))


def same_mode(before: Array, after: Array, number: int) -> int:
    """Place ``after`` of the mode ``number`` of those ``before`` (1/s, rad/s): near ones may change places."""
    distance = np.hypot(*(before[:, None, :] - after[None, :, :]).transpose(2, 0, 1))
    return int(linear_sum_assignment(distance)[1][number])


def numbers_of(found: Estimate, number: int) -> dict[str, tuple[Array, float]]:
    """Name -> value (one or two numbers) and sd, of the mode with a ``number`` among those ``found``."""
    numbers = {name: (found.mean[number, k : k + 1], float(found.sd[number, k])) for k, name in enumerate(PARTS)}
    for name, (value, sd) in found.ratios[number].items():
        numbers[name] = (np.array([value.real, value.imag]), sd)
    return numbers


def _energy(found: Estimate, starts: list[float]) -> list[float]:
    """Sum of squares of the oscillations of a fit from each of some times on, s after the first sample of the run."""
    fitted, drift = found.curves()
    power = ((fitted - drift) ** 2).sum(1)
    return [float(power[found.window.start + found.window.time >= start].sum()) for start in starts]


def moved(
    table: list[dict[str, tuple[Array, float]]], energy: list[float], place: int, chances: float = BY_CHANCE
) -> tuple[dict[str, float], float, str]:
    """How far numbers of one window lie from those of parts of it, beyond chance.

    Parameters
    ----------
    table : list of dict
        Of each window, the whole first: name -> value, one number or two, and sd (its own unit); as :func:`numbers_of`.
    energy : list of float
        Sum of squares of the oscillations in each window; of any unit.
    place : int
        Of the window that is compared with those after it.
    chances : float, optional
        What chance may do, in sd of the difference.

    Returns
    -------
    dict
        Name -> how far it moves (its own unit); 0: not.
    float
        The largest of these over the sd of its number.
    str
        The name of that; empty where nothing moves.
    """
    shifts, farthest, what = dict.fromkeys(table[place], 0.0), 0.0, ""
    for later, left in zip(table[place + 1 :], energy[place + 1 :], strict=True):
        more = max(energy[place] / max(left, 1e-300) - 1, 0.0)  # of the variance; less is rounding
        for name, (value, sd) in table[place].items():
            shift = float(np.abs(later[name][0] - value).max())
            chance = math.sqrt(max(later[name][1] ** 2 - sd**2, more * sd**2))
            if shift > sd and shift > chances * chance:
                shifts[name] = max(shifts[name], shift)
                if shift / sd > farthest:
                    farthest, what = shift / sd, name
    return shifts, farthest, what
