"""The residual torque in sentences, each true of the numbers beside it; none of them names a cause."""

import math

import numpy as np

from bicycle.critical.critical_speed import OSCILLATORY
from studies.inference.attempts import POOR_FIT
from studies.missing_effect.reporting.words import ADJUSTED, explains, listed, number, percent, unit_of
from studies.missing_effect.residual.amplitude import Amplitude
from studies.missing_effect.residual.changed import Changed, changed
from studies.missing_effect.residual.claims import Claims, Critical
from studies.missing_effect.residual.fitting import Residual
from studies.missing_effect.residual.kept import Kept, plain
from studies.missing_effect.residual.shapes import Likeness
from studies.missing_effect.residual.terms import PAIRS, Pair

SMALL = 0.05  # share of the power that is not told
LIKE, SAME = 0.5, 0.8  # shares from which on a thing is like, and would do the same
MOST_CHANGED = 6  # numbers that are told; verdict.json has all
CHANGES = 1.5  # ratio of the ends of the speed range from which on a coefficient grows or falls


def sentence(kept: Kept) -> str:
    """What was kept, in a few sentences."""
    if kept.residual is None or kept.shape is None:
        return f"Nothing could be kept of what remains: {kept.refused}."
    beside = kept.residual.beside
    told = [
        f"What remains beside {explains(beside) if beside.candidates else ADJUSTED} is kept as a torque that is linear "
        f"in the state (`residual_torque`): no cause, and no part of the verdict. {_gap(kept.residual)}"
    ]
    told.append(_changed(changed(kept.residual), written=kept.critical is not None))
    told.append(_shares(kept))
    if kept.shape.shares:
        told += [_likeness(kept.shape.library), _errors(kept.shape.errors)]
    if kept.residual.p < POOR_FIT:
        told.append(
            f"Even so χ² is {number(kept.residual.misfit, 3)} a number: part of it is no such torque, and the standard "
            "deviations are widened by that."
        )
    return " ".join(part for part in told if part)


def _gap(residual: Residual) -> str:
    """What the torque gains on held-out data; in chi^2 where there is no gap without it, after a tentative name."""
    before, after = residual.before, residual.after
    if before.gap > 0:
        return f"Gap on held-out data {number(before.gap, 2)} sd without it, {number(after.gap, 2)} with it."
    return (
        f"χ² of {len(before.residual)} held-out numbers is {number(before.chi2, 3)} without it, "
        f"{number(after.chi2, 3)} with it."
    )


def _changed(found: tuple[Changed, ...], *, written: bool) -> str:
    """Numbers that are others in the fit with the torque; ``written``: there is a corrected model, which has these."""
    if not found:
        return ""
    shown = [_now(one) for one in found[:MOST_CHANGED]]
    more = [f"{len(found) - MOST_CHANGED} more"] if len(found) > MOST_CHANGED else []
    told = (
        f"Fitted with the torque, more than one standard deviation from the fit without it: {listed([*shown, *more])}."
    )
    if written:
        told += " The corrected model (`model.toml`) has the values with the torque."
    gone = list(dict.fromkeys(one.effect for one in found if one.replaced))
    if gone:
        told += f" {listed(gone)} {'is' if len(gone) == 1 else 'are'} no longer significant: the torque takes "
        told += "its place." if len(gone) == 1 else "their place."
    return told


def _now(one: Changed) -> str:
    name = f"{one.effect}.{one.name}" if one.effect else one.name
    return (
        f"{name} {number(one.value, 3)} ± {number(one.sd, 2)}{unit_of(one.unit)} in place of {number(one.named, 3)}"
    ).strip()


def _shares(kept: Kept) -> str:
    """Shares of the power; with both torques, how they are weighed against each other."""
    assert kept.shape is not None
    if not kept.shape.shares:
        return "It has no power on the motion seen, so there is nothing to compare."
    ranked = sorted(kept.shape.shares.items(), key=lambda item: -item[1])
    told = [f"{percent(round(share, 3))} is a {_direction(kept, pair)}" for pair, share in ranked if share >= SMALL]
    against = [pair for pair, share in ranked if share <= -SMALL]
    both = len({torque for torque, _ in kept.shape.shares}) > 1
    weighed = (
        f" (a newton metre of steer torque counts as {number(kept.shape.counts, 2)} of lean torque: so much more does "
        "it change the predicted numbers)"
    )
    words = f"Of its power on the motion seen{weighed if both else ''}, {listed(told)}." if told else ""
    if against or sum(share for _, share in ranked if share >= SMALL) > 1 + SMALL:
        words += " Parts of it cancel each other, so these shares are not each a thing by itself."
    return words


def _direction(kept: Kept, pair: Pair) -> str:
    """A pair of torque and state with its sign, and how it changes over the measured speeds."""
    assert kept.residual is not None
    torque, state = pair[0], pair[1].replace("_", " ")
    scale = kept.residual.scale
    speeds = np.linspace(scale.middle - scale.span, scale.middle + scale.span, 21)
    gain = kept.residual.gains_at(speeds)[0].reshape(len(speeds), -1)[:, PAIRS.index(pair)]
    if gain.min() < 0 < gain.max():
        return f"{torque} torque from the {state} that changes its sign with speed"
    word = "against" if gain.sum() < 0 else "with"
    first, last = abs(gain[0]), abs(gain[-1])
    change = ""
    if last > CHANGES * first:
        change = ", growing with speed"
    elif first > CHANGES * last:
        change = ", falling with speed"
    elif np.ptp(gain) == 0 and kept.residual.scale.most > 1:
        change = ", the same at all speeds"
    return f"{torque} torque {word} the {state}{change}"


def _likeness(library: tuple[Likeness, ...]) -> str:
    if not library:
        return ""
    best = library[0]
    if best.share < LIKE:
        return (
            f"Its shape is that of no effect of the library; the likest, {best.identifier}, has {_share(best)} "
            f"of its power{_sign(best)}."
        )
    others = [f"{one.identifier} {_share(one)}{_sign(one)}" for one in library[1:3] if one.share >= LIKE]
    more = f"; {listed(others)}" if others else ""
    return f"{_share(best)} of its power has the shape of {best.identifier}{_sign(best)}{more}."


def _share(one: Likeness) -> str:
    return percent(round(one.share, 3))


def _sign(one: Likeness) -> str:
    return ", with the opposite sign" if one.reversed else ""


def _errors(errors: tuple[Likeness, ...]) -> str:
    """Whether an error of the measurement would do the same to the data."""
    if not errors:
        return ""
    same = [one for one in errors if one.share >= SAME]
    if same:
        names = listed(f"{one.identifier} ({_share(one)}{_sign(one)})" for one in same[:3])
        return f"An error of the measurement would do the same to these data, and must be ruled out first: {names}."
    best = errors[0]
    return (
        f"No error of the measurement would do the same to these data; {best.identifier} comes nearest, with "
        f"{_share(best)} of it{_sign(best)}."
    )


def amplitude_note(found: Amplitude | None) -> str:
    """Whether the damping of the steering depends on the amplitude; empty of other data."""
    if found is None:
        return ""
    low, high = number(float(found.rate.min()), 2), number(float(found.rate.max()), 2)
    size = f"{number(found.dry[0], 2)} ± {number(found.dry[1], 2)} N m"
    if found.falls:
        return (
            f"The equivalent damping of the steering falls as the amplitude of the steer rate grows ({low} to {high} "
            f"rad/s), as with dry friction of {size}: a linear torque is then right at one amplitude only."
        )
    how = "rises with" if found.rises else "does not depend on"
    return (
        f"The equivalent damping of the steering {how} the amplitude of the steer rate ({low} to {high} rad/s); "
        f"the dry friction fitted to it is {size}."
    )


def coefficients(kept: Kept) -> list[list[str]]:
    """Rows of the table of coefficients: in words, value, standard deviation alone and with the others, gains."""
    residual = kept.residual
    if residual is None:
        return []
    units = {u.name: u.unit for u in residual.fit.unknowns}
    rows = []
    for name, value in residual.values.items():
        gain = residual.gains.get(name)
        shown = [f"{one:+.1f}" for one in gain] if gain else ["with the next"] * 2
        sds = (number(residual.sd_alone[name], 2), number(residual.sd[name], 2))
        rows.append([plain(name), f"{number(value, 3)} {units[name]}", *sds, *shown])
    return rows


def critical_note(found: Claims | None) -> str:
    """Before the table of critical speeds, or in its place; empty where there is no corrected model."""
    if found is None:
        return ""
    if found.withheld:
        return f"No critical speed of the corrected model is told: {found.withheld}."
    looked = f"{number(found.slowest, 3)} to {number(found.fastest, 3)} m/s"
    if not found.found:
        return f"From {looked} no mode of the corrected model has a real part with zero in its 95 % band."
    return (
        f"Where modes of the corrected model may change their stability (95 %), with what parameters and torque leave "
        f"open, looked for from {looked}:"
    )


def critical_rows(found: Claims | None) -> list[list[str]]:
    """Rows of the table of critical speeds."""
    return [] if found is None else [[_what(one), _where(one), one.measured] for one in found.found]


def _what(one: Critical) -> str:
    kind = "" if one.interval.kind == OSCILLATORY else ", a real root"
    return f"{one.interval.mode} {listed(c.direction for c in one.crossings) if one.crossings else 'critical'}{kind}"


def _where(one: Critical) -> str:
    """The interval in words; the speed of the model itself only where it is told."""
    low, high = f"{one.interval.low:.2f}", f"{one.interval.high:.2f}"
    if not one.interval.told:
        return "not told by these data"
    if math.isinf(one.interval.low):
        return f"perhaps, below {high} m/s"
    if math.isinf(one.interval.high):
        return f"perhaps, above {low} m/s"
    if one.crossings:
        return f"{listed(f'{c.speed:.2f}' for c in one.crossings)} m/s, from {low} to {high} m/s"
    return f"perhaps, from {low} to {high} m/s"
