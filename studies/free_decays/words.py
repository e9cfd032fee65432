"""What the terminal says of decays: drift, movement of the window's start, repeats; and the sd that repeats ask for."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from bicycle.eigenvalues.oscillation import frequency_hz
from bicycle.identification.free_decay import Decay
from bicycle.identification.repeats import repeats

DRIVEN_OPEN = (0.02, 0.9)  # probability between which it is told what driving would mean
SURE = 0.9  # probability of a drift beyond which the others are not told
PLACES = 3  # of a number and its sd, or more where these would not show it


@dataclass(frozen=True)
class Judged:
    """A mode of a run with the sd of its repeats: how many, whether they widened it, whether it lies aside.

    ``rejected`` is why the run is not used, by what it says alone.
    """

    mode: str
    decay: Decay
    rejected: str
    repeats: int
    widened: bool
    aside: bool


def with_sd(value: float, sd: float) -> str:
    """``-1.052 ± 0.031``: a ``value`` with its ``sd`` in any one unit, of which two digits are shown at least."""
    places = max(PLACES, 1 - math.floor(math.log10(sd))) if math.isfinite(sd) and sd > 0 else PLACES
    return f"{value:.{places}f} ± {sd:.{places}f}"


def drift_words(decay: Decay) -> str:
    """``parabola``, or ``parabola 63 %, constant 37 %`` where a ``decay`` leaves it open; a real mode with its rate."""
    if decay.estimate is None:
        return ""
    shares = list(decay.estimate.drifts.items())
    if shares[0][1] >= SURE:
        rate = decay.estimate.best.best_rate
        return shares[0][0] + ("" if rate is None else f", {-rate[0]:.2g} 1/s")
    return ", ".join(f"{name} {share:.0%}" for name, share in shares if share >= 0.05)


def movement_words(decay: Decay) -> str:
    """How far the numbers of a ``decay`` move with the start of the window."""
    moved = decay.movement
    if moved is None:
        return "not tried" if decay.rejected else "no later window"
    if not moved.what:
        return "no"
    return f"{moved.farthest:.1f} sd ({moved.what.replace('_', ' ')})"


def break_words(decay: Decay) -> str:
    """That something happens within the window of a ``decay``; empty where nothing does."""
    if decay.broken is None:
        return ""
    one = decay.broken
    said = (
        f"{one.channel} jumps at about {one.time_s:.3g} s ({one.size:.2g} sd of its noise), as after a second kick, a "
        "step of the sensor or a spike"
    )
    if not one.what or one.refused:
        return said
    return f"{said}; its sd contains how far it moves when the window ends at {one.until_s:.4g} s"


def driven_words(decay: Decay, told: Decay) -> str:
    """That it is open whether something drives the motion of a ``decay``, and what its sd would be if told so."""
    if decay.estimate is None or decay.estimate.driven is None or told.rejected:
        return ""
    (real, imaginary), (more_real, more_imaginary) = decay.sd, told.sd
    return (
        f"whether something, such as a rough road, keeps driving the motion is open (probability "
        f"{decay.estimate.driven:.2g}); if so, the sd are {more_real:.2g} 1/s and {more_imaginary:.2g} rad/s instead "
        f"of {real:.2g} and {imaginary:.2g}: say --driven yes or no where you know"
    )


def together_words(runs: Sequence[Sequence[Decay]]) -> str:
    """What all ``runs``, the modes of each, say together of whether something drives them."""
    chances = [modes[0].estimate.driven for modes in runs if modes[0].estimate is not None]
    weighed = [chance for chance in chances if chance is not None]
    driven = [f"{chance:.2g}" for chance in weighed if chance > 0.5]
    many = {0: "none", len(weighed): "all"}.get(len(driven), f"{len(driven)}")
    others = [chance for chance in weighed if chance <= 0.5]
    told = [f"{min(driven, key=float)} or more"] if driven else []
    told += [f"{max(others):.2g} or less{' of the others' if driven else ''}"] if others else []
    return (
        "whether something, such as a rough road, keeps driving the motion is weighed by all runs together, as on one "
        f"ground: it does in {many} of {len(weighed)} runs (probability {'; '.join(told)}); say --driven yes or no "
        "where you know, or give runs on another ground by themselves"
    )


def second_words(root: complex) -> str:
    """A motion that was fitted beside, by its eigenvalue ``root``, 1/s."""
    if -root.real > root.imag:
        return f"a transient that dies within {-3 / root.real:.2g} s"
    if root.real > root.imag:
        return f"a motion that grows without oscillating (real part {root.real:.2g} 1/s)"
    hertz = frequency_hz(root)
    return f"a second oscillation of {hertz:.2g} Hz (real part {root.real:.2g} 1/s; --modes names both)"


def judged(decays: Sequence[tuple[str, Decay]]) -> list[Judged]:
    """Weigh the sd of ``decays``, pairs of a mode and what a run says of it, against the scatter of repeats."""
    found = [Judged(mode, decay, decay.rejected, 0, widened=False, aside=False) for mode, decay in decays]
    for mode in dict.fromkeys(mode for mode, _ in decays):
        places = [k for k, (other, decay) in enumerate(decays) if other == mode and not decay.rejected]
        if not places:
            continue
        used = [found[k].decay for k in places]
        speeds = [d.speed for d in used]
        parts = [
            repeats(speeds, [d.eigenvalue.real for d in used], [d.sd[0] for d in used]),
            repeats(speeds, [d.eigenvalue.imag for d in used], [d.sd[1] for d in used]),
        ]
        for row, place in enumerate(places):
            decay = replace(used[row], sd=(float(parts[0].sd[row]), float(parts[1].sd[row])))
            wider = any(new > 1.05 * old for new, old in zip(decay.sd, used[row].sd, strict=True))
            aside = any(row in part.aside for part in parts)
            found[place] = Judged(mode, decay, "", parts[0].count(row), widened=wider, aside=aside)
        for name in sorted(set.intersection(*(set(d.ratios) for d in used))):
            _ratio(found, places, name)
    return found


def _ratio(found: list[Judged], places: Sequence[int], name: str) -> None:
    """Widen a ratio by the larger scatter of its two parts."""
    used = [found[k].decay for k in places]
    values, stated = [d.ratios[name][0] for d in used], [d.ratios[name][1] for d in used]
    speeds = [d.speed for d in used]
    sds = [repeats(speeds, part, stated).sd for part in ([z.real for z in values], [z.imag for z in values])]
    for row, place in enumerate(places):
        ratios = dict(used[row].ratios) | {name: (values[row], float(max(sd[row] for sd in sds)))}
        found[place] = replace(found[place], decay=replace(used[row], ratios=ratios))


def repeat_notes(found: Sequence[Judged]) -> list[str]:
    """What is to be said of the repeats among ``found``."""
    used = [each for each in found if not each.rejected]
    notes = []
    wider = sum(each.widened for each in used)
    if wider:
        notes.append(
            f"repeats scatter more than their fits say: the sd of {wider} of {len(used)} rows is widened by that"
        )
    for each in used:
        if each.aside:
            d = each.decay
            notes.append(f"{d.run} at {d.speed:g} m/s lies far outside the scatter of its repeats; it alone is widened")
    alone = sum(each.repeats == 1 for each in used)
    if alone:
        which = "no run has a repeat" if alone == len(used) else f"{alone} of {len(used)} rows have no repeat"
        notes.append(
            f"{which} within 5 % of its speed: the sd of the fit says nothing of the scatter from run to run"
            + ("" if alone == len(used) else ", unless other speeds showed it")
        )
    return notes
