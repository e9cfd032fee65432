"""Where linear propagation and Monte Carlo differ, in words."""

import math
from collections.abc import Sequence

from studies.uncertainty.propagation import Uncertainty
from studies.uncertainty.quantity import Quantity

FAR = 0.1  # relative difference of the two sd that is worth a word
CHANCE = 3.0  # sd of the sampled sd
LEAST = 40  # draws, of which one lies below 2.5 % on average and one above 97.5 %
ROUNDING = 1e-9  # relative


def remarks(found: Sequence[Quantity], unlisted: int, samples: int, max_speed: float) -> tuple[str, ...]:
    """What a reader of the table has to know: what some samples do not have, and where linear propagation fails.

    Parameters
    ----------
    found : sequence of Quantity
    unlisted : int
        Number of samples with critical speeds that the nominal model does not have.
    samples : int
        Number of samples.
    max_speed : float
        m/s.
    """
    said = []
    for q in found:
        if q.lost:
            why = "have no such oscillation, or one like another"
            if q.unit == "m/s":
                why = f"do not have it up to {max_speed:g} m/s"
            rest = "sd Monte Carlo and band are of the others" if len(q.kept) else "so there is no band"
            said.append(f"{q.name}: {q.lost} of {samples} bicycles {why}, which the linear sd does not show; {rest}")
        elif differs(q):
            said.append(
                f"{q.name}: not linear, sd {q.sampled_sd:.3g} {q.unit} by Monte Carlo against {q.linear_sd:.3g} linear"
            )
    if unlisted:
        said.append(
            f"at least {unlisted} of {samples} bicycles have further critical speeds up to {max_speed:g} m/s, "
            "which the model at its mean values does not have; a sweep with the output critical_speeds lists them"
        )
    if samples < LEAST:
        said.append(f"{samples} bicycles are too few for the bounds at 2.5 % and 97.5 %; draw {LEAST} or more")
    return tuple(said)


def stands_alone(uncertainty: Uncertainty) -> tuple[str, ...]:
    """What becomes of correlations that a model states of parameters whose sd is given anew."""
    names, stated = uncertainty.given_anew
    others = len(stated.names) - len(names)
    return tuple(
        f"{name}: the sd given for it stands alone; its correlation with {others} other numbers "
        f"({stated.origin}) is dropped, which may make a result less sure than with it"
        for name in names
        if others
    )


def differs(q: Quantity) -> bool:
    """True where the two sd differ by more than a tenth and more than chance explains."""
    chance = CHANCE / math.sqrt(2 * max(len(q.kept) - 1, 1))
    return not abs(q.sampled_sd - q.linear_sd) <= max(FAR, chance) * q.linear_sd + ROUNDING * abs(q.value)
