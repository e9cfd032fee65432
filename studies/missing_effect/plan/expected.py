"""What each hypothesis expects of further measurements: a run of modes, a run in time, a test on the bench."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from studies.inference.fit import Fit
from studies.inference.identifiability import BENCH_SD
from studies.inference.parameter import UncertainParameter, central_differences
from studies.missing_effect.motion.history_forward import FURTHER_SD, HistoryForward
from studies.missing_effect.motion.history_noise import ChannelNoise, whitened
from studies.missing_effect.motion.modal_forward import FURTHER_RATIO_SD, ModalForward, ModeAtSpeed
from studies.missing_effect.motion.replay import Replay
from studies.missing_effect.plan.costs import RATIOS, Bench, Costs
from studies.missing_effect.plan.separation import Block, Expected
from tyre.base.arrays import Array

UPRIGHT = 0.5  # rad of lean or steer, where a run is ended
SHORTEST = 0.5  # s, below which a run is none


@dataclass(frozen=True)
class Hypothesised:
    """A set of candidates at coordinates (p,): what is to be predicted."""

    fit: Fit

    @property
    def nuisances(self) -> Array:
        """Its coordinates without those of its effects."""
        return self.fit.theta[: self.fit.effect_columns.start]


def modal_run(
    forward: ModalForward, fits: Sequence[Fit], speed: float, ratios: Sequence[str], costs: Costs
) -> list[tuple[Expected, ...]]:
    """Expected numbers of one free decay at a speed, for each mode that all hypotheses expect to be seen.

    Parameters
    ----------
    forward : ModalForward
    fits : sequence of Fit
        Hypotheses.
    speed : float
        m/s.
    ratios : sequence of str
        Shape ratios that are measured.
    costs : Costs
        Standard deviations of one run, where they are given.
    """
    found = []
    for mode in dict.fromkeys(p.mode for p in forward.points):
        nearest = min((p for p in forward.points if p.mode == mode), key=lambda p: abs(p.speed - speed))
        sd = [costs.sd.get(name, own) for name, own in zip(("real_1_s", "imag_rad_s"), nearest.sd, strict=True)]
        for name in RATIOS:
            if name in ratios:
                own = nearest.ratios.get(name, (0j, FURTHER_RATIO_SD))[1] or FURTHER_RATIO_SD
                sd += 2 * [costs.sd.get(name, own)]
        seen = (RATIOS[0] in ratios, RATIOS[1] in ratios)
        run = ModeAtSpeed(f"{mode} at {speed:g} m/s", np.array(sd), mode, speed, nearest.settings, seen)
        with np.errstate(all="ignore"):
            expected = tuple(_modal(forward, run, fit) for fit in fits)
        if all(np.isfinite(x).all() for one in expected for x in (one.truth, one.slopes, one.without)):
            found.append(expected)
    return found


def _modal(forward: ModalForward, run: ModeAtSpeed, fit: Fit) -> Expected:
    mean, slopes = forward.predict(run, fit.candidates, fit.theta)
    without = mean
    if fit.candidates:
        without, _ = forward.predict(run, (), Hypothesised(fit).nuisances)
        if not np.isfinite(without).all() and np.isfinite(mean).all():
            without = mean  # the effect alone brings the mode out
    return Expected(mean, mean, slopes, without)


def history_run(
    forward: HistoryForward, fits: Sequence[Fit], speed: float, added: Sequence[str], costs: Costs
) -> list[tuple[Expected, ...]]:
    """The same of a run in time: the nearest measured one again at another speed, with further channels.

    Parameters
    ----------
    forward : HistoryForward
    fits : sequence of Fit
        Hypotheses, the first of which says when the bicycle falls.
    speed : float
        m/s.
    added : sequence of str
        Channels beside those that were recorded.
    costs : Costs
        Standard deviations of channels, where they are given.

    Returns
    -------
    list of tuple of Expected
        One entry; none where the bicycle falls at once.
    """
    place = min(range(len(forward.runs)), key=lambda k: abs(forward.runs[k].speed - speed))
    run = forward.runs[place]
    noise: dict[str, ChannelNoise] = dict(forward.noise)
    for name in (*forward.noise, *added):
        if name in added or name in costs.sd:
            colour = noise[name].colour if name in noise else 0.0
            noise[name] = ChannelNoise(costs.sd.get(name, FURTHER_SD.get(name, 0.02)), colour, given=True)
    nothing = np.zeros(len(run.time))
    channels = {name: run.channels.get(name, nothing) for name in noise}
    planned = replace(run, speed=speed, channels=channels)
    first = fits[0]
    starts = forward.starts(first.candidates, first.theta)[place : place + 1]
    angles = Replay((planned,), ("lean_rad", "steer_rad"))(forward.family(first.candidates), first.theta[None], starts)
    down = np.flatnonzero(~(np.abs(angles[0, 0]).max(0) < UPRIGHT))
    end = int(down[0]) if len(down) else len(run.time)
    if end * run.step < SHORTEST:
        return []
    planned = replace(
        planned, time=run.time[:end], channels={k: x[:end] for k, x in channels.items()},
        inputs={k: x[:end] for k, x in run.inputs.items()},
    )  # fmt: skip
    there = replace(forward, runs=(planned,), noise=noise)
    expected = tuple(_history(forward, there, place, fit) for fit in fits)
    finite = all(np.isfinite(x).all() for one in expected for x in (one.truth, one.model, one.slopes, one.without))
    return [expected] if finite else []


def _history(forward: HistoryForward, there: HistoryForward, place: int, fit: Fit) -> Expected:
    family, replay = forward.family(fit.candidates), there.replay_of(tuple(there.noise))
    start = forward.starts(fit.candidates, fit.theta)[place : place + 1]
    batch, steps = family.stencil(fit.theta)
    moved = _white(there.noise, replay(family, batch, start)[:, 0])
    rest = _white(there.noise, replay(family, fit.theta[None], 0 * start)[:, 0])[0]
    without = moved[0]
    if fit.candidates:
        nuisances = Hypothesised(fit).nuisances
        own = forward.starts((), nuisances)[place : place + 1]
        without = _white(there.noise, replay(forward.family(()), nuisances[None], own)[:, 0])[0]
    return Expected(
        moved[0], rest, central_differences(moved, steps), without,
        lambda columns: there.marginalised(fit.candidates, fit.theta, columns),
        there.log_determinant(fit.candidates, fit.theta),
    )  # fmt: skip


def _white(noise: Mapping[str, ChannelNoise], signals: Array) -> Array:
    """Signals (K, channels, T) as whitened rows (K, channels T)."""
    return whitened(signals[..., None], tuple(noise.values())).reshape(len(signals), -1)


def bench_test(fits: Sequence[Fit], key: str, bench: Bench) -> tuple[Expected, ...] | None:
    """Expected reading of a test of one parameter; None where no hypothesis has it.

    Parameters
    ----------
    fits : sequence of Fit
        Hypotheses.
    key : str
        As in the file of costs.
    bench : Bench
    """
    places = [_place(fit, key) for fit in fits]
    holder = next((k for k, place in enumerate(places) if place is not None), None)
    if holder is None:
        return None
    place = places[holder]
    assert place is not None
    u, x = fits[holder].unknowns[place], float(fits[holder].theta[place])
    sd = bench.sd / u.slope(x) if bench.sd and u.slope(x) > 0 else BENCH_SD * u.scale
    found = []
    for fit, own in zip(fits, places, strict=True):
        slopes = np.zeros((1, len(fit.theta)))
        mean = np.array([(u.centre if own is None else fit.theta[own]) / sd])
        if own is not None:
            slopes[0, own] = 1 / sd
        without = mean if own is not None and own < fit.effect_columns.start else np.array([u.centre / sd])
        found.append(Expected(mean, mean, slopes, without))
    return tuple(found)


def _place(fit: Fit, key: str) -> int | None:
    """Where the unknown of a bench test stands in a fit."""
    for c in fit.candidates:
        for k, u in enumerate(c.unknowns):
            if u.size and key in (c.identifier, f"{c.identifier}.{u.name}"):
                return fit.columns(c).start + k
    own: Sequence[UncertainParameter] = fit.unknowns[: fit.effect_columns.start]
    return next((k for k, u in enumerate(own) if key == u.name or key in u.sets), None)


def blocks(expected: Sequence[tuple[Expected, ...]], seed: int) -> list[Block]:
    """Blocks of what is ``expected``, each with a ``seed`` of its own noise."""
    return [Block(one, 1000 * seed + k) for k, one in enumerate(expected)]
