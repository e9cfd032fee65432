"""Judge free decays by their repeats, say what is to be known of them, and draw their fits."""

import math
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bicycle.identification.free_decay import Decay
from bicycle.identification.recording import Run
from bicycle.identification.ride_wobble import LOWEST_HZ
from bicycle.identification.scatter import repeats
from bicycle.model.eigen import frequency_hz
from tyre.ground.number_with_sd import with_sd

LEAST_NOISE = 1e-4  # probability of noise below which a note says so: 5 of 900 sound windows lie below
NOTES = {
    "jump": "{run}: {channel} jumps at about {time_s:.3g} s ({size:.2g} sd of its noise), as after a second impulse, a "
    "step of the sensor or a spike",
    "jump widens": "{run}: its sd contains how far it moves when the window ends at {until_s:.4g} s",
    "no noise": "{run}: the residuals are not noise (p {p:.1g}), as on a rough road that drives the motion: its sd "
    "may be too small; repeats show the scatter",
    "beside": "{run}: {what} is in the window; it is fitted as well and not in the table",
    "wider": "repeats scatter more than their fits predict: the sd of {wider} of {rows} rows is widened by that",
    "aside": "{run} at {speed:g} m/s is an outlier among its repeats; only its sd is widened",
    "no repeats": "no run has a repeat within 5 % of its speed: the sd of the fit does not include the scatter "
    "from run "
    "to run, as on a rough road that drives the motion",
    "some alone": "{alone} of {rows} rows have no repeat within 5 % of its speed: the sd of the fit says nothing of "
    "the scatter from run to run, as on a rough road that drives the motion, unless other speeds showed it",
    "fast weave": "called weave at {least:g} Hz or more, the band of wobble: {fast} of {rows} rows, up to {hertz:.3g} "
    "Hz; --mode wobble names a table of wobble",
}
BESIDE = {
    "dies": "a transient that dies within {seconds:.2g} s",
    "grows": "a motion that grows without oscillating (real part {real:.2g} 1/s)",
    "oscillates": "a second oscillation of {hertz:.2g} Hz (real part {real:.2g} 1/s; --modes names both)",
}
PANELS = {
    "roll_rate_rad_s": "roll rate in rad/s", "yaw_rate_rad_s": "yaw rate in rad/s",
    "steer_rate_rad_s": "steer rate in rad/s", "lean_rad": "lean in rad", "steer_rad": "steer in rad",
    "lateral_acceleration_m_s2": "lateral acceleration in m/s²",
}  # fmt: skip


@dataclass(frozen=True)
class Judged:
    """A mode of a run with the sd of its repeats."""

    mode: str  # name, as in a modal table
    decay: Decay  # eigenvalue (1/s), ratios and their sd by one run
    rejected: str  # why the run is not used, by what it says alone
    repeats: int = 0  # runs at about this speed, itself among them; 0: the run is not used
    widened: bool = False  # True: its sd is more than 5 % above what the fit says
    aside: bool = False  # True: far outside the scatter of its repeats


def judge_decays(decays: Sequence[tuple[str, Decay]]) -> list[Judged]:
    """Weigh the sd of ``decays``, pairs of a mode and what a run says of it, against the scatter of repeats."""
    judgements = [Judged(mode, decay, decay.rejected) for mode, decay in decays]
    for mode in dict.fromkeys(mode for mode, _ in decays):
        places = [k for k, (mode_of_decay, decay) in enumerate(decays) if mode_of_decay == mode and not decay.rejected]
        used = [judgements[k].decay for k in places]
        if not used:
            continue
        speeds = [d.speed for d in used]
        real = repeats(speeds, [d.eigenvalue.real for d in used], [d.sd[0] for d in used])
        imaginary = repeats(speeds, [d.eigenvalue.imag for d in used], [d.sd[1] for d in used])
        ratios = {}  # of a ratio the larger scatter of its two parts
        for name in sorted(set.intersection(*(set(d.ratios) for d in used))):
            values, ratio_sds = zip(*(d.ratios[name] for d in used), strict=True)
            parts = [
                repeats(speeds, part, ratio_sds).sd for part in ([z.real for z in values], [z.imag for z in values])
            ]
            ratios[name] = [(z, float(max(sds))) for z, *sds in zip(values, *parts, strict=True)]
        for row, place in enumerate(places):
            sd = (float(real.sd[row]), float(imaginary.sd[row]))
            weighed = dict(used[row].ratios) | {name: ratios_of_run[row] for name, ratios_of_run in ratios.items()}
            wider = any(new > 1.05 * old for new, old in zip(sd, used[row].sd, strict=True))
            aside = row in real.aside or row in imaginary.aside
            decay = replace(used[row], sd=sd, ratios=weighed)
            judgements[place] = Judged(mode, decay, "", real.count(row), widened=wider, aside=aside)
    return judgements


def notes_of(judgements: Sequence[Judged]) -> Iterator[str]:
    """Notes on breaks, on what is no noise, on further fitted motions, and on repeats."""
    used = [judgement for judgement in judgements if not judgement.rejected]
    for judgement in judgements:
        run, jump = judgement.decay.run, judgement.decay.broken
        if jump is not None:
            yield NOTES["jump"].format(run=run, **vars(jump))
            if jump.what and not jump.refused:
                yield NOTES["jump widens"].format(run=run, until_s=jump.until_s)
    for judgement in used:
        if judgement.decay.noise_p < LEAST_NOISE and judgement.decay.broken is None:
            yield NOTES["no noise"].format(run=judgement.decay.run, p=judgement.decay.noise_p)
        for root in judgement.decay.beside:
            yield NOTES["beside"].format(run=judgement.decay.run, what=second_words(root))
    wider = sum(judgement.widened for judgement in used)
    without_repeats = sum(judgement.repeats == 1 for judgement in used)
    if wider:
        yield NOTES["wider"].format(wider=wider, rows=len(used))
    for judgement in used:
        if judgement.aside:
            yield NOTES["aside"].format(run=judgement.decay.run, speed=judgement.decay.speed)
    if without_repeats:
        yield NOTES["no repeats" if without_repeats == len(used) else "some alone"].format(
            alone=without_repeats, rows=len(used)
        )


def notes_of_weave(judgements: Sequence[Judged]) -> Iterator[str]:
    """Note rows that are called weave without being asked to, in the band of wobble."""
    used = [judgement for judgement in judgements if not judgement.rejected]
    fast = [
        hertz
        for judgement in used
        if judgement.mode == "weave" and (hertz := float(frequency_hz(judgement.decay.eigenvalue))) >= LOWEST_HZ
    ]
    if fast:
        yield NOTES["fast weave"].format(fast=len(fast), rows=len(used), least=LOWEST_HZ, hertz=max(fast))


def drift_words(decay: Decay) -> str:
    """``parabola``, or ``parabola 63 %, constant 37 %`` if a ``decay`` leaves it open; a real mode with its rate."""
    if decay.estimate is None:
        return ""
    shares = list(decay.estimate.drifts.items())
    if shares[0][1] >= 0.9:
        rate = decay.estimate.best.best_rate
        return shares[0][0] + ("" if rate is None else f", {-rate[0]:.2g} 1/s")
    return ", ".join(f"{name} {share:.0%}" for name, share in shares if share >= 0.05)


def movement_words(decay: Decay) -> str:
    """Farthest movement with the start of the window, in sd, and which number it is."""
    movement = decay.movement
    if movement is None:
        return "not tried" if decay.rejected else "no later window"
    return f"{movement.farthest:.1f} sd ({movement.what.replace('_', ' ')})" if movement.what else "no"


def second_words(root: complex) -> str:
    """Name a further fitted motion by its eigenvalue ``root`` (1/s)."""
    kind = "dies" if -root.real > root.imag else "grows" if root.real > root.imag else "oscillates"
    seconds = -3 / root.real if root.real else math.inf
    return BESIDE[kind].format(real=root.real, hertz=float(frequency_hz(root)), seconds=seconds)


def draw(run: Run, decays: Sequence[tuple[str, Decay]], target: Path) -> None:
    """Draw measured channels, fit, drift and window of a run with its modes; ``target`` has no ending."""
    from studies.reporting.plotting import drawing

    first = decays[0][1]
    assert first.estimate is not None
    w = first.estimate.window
    fit, drift = first.estimate.curves()
    time = run.time - run.time[0]
    begin, end = w.start, w.start + w.length + (w.block - 1) * run.step
    shown_samples = (time >= begin - 0.6 * w.length) & (time <= end + 0.6 * w.length)
    fitted_samples = (time >= begin) & (time <= end)
    fitted = w.start + (w.block - 1) * run.step / 2 + w.time
    with drawing(target, width=8.0, height=2.1 + 0.3 * len(decays) + 1.7 * len(w.channels)) as figure:
        axes = figure.subplots(len(w.channels), 1, squeeze=False, sharex=True)[:, 0]
        for place, (panel, name) in enumerate(zip(axes, w.channels, strict=True)):
            curve, slow = w.scale[place] * fit[:, place], w.scale[place] * drift[:, place]
            panel.axvspan(begin, end, color="#e5a823", alpha=0.13, linewidth=0, label="window")
            panel.plot(
                time[shown_samples], run.channels[name][shown_samples], color="#9db8d9", linewidth=2.4, label="measured"
            )
            panel.plot(fitted, curve, color="#123a6b", linewidth=1.3, label="fit")
            panel.plot(fitted, slow, color="#c8462f", linewidth=1.1, linestyle="--", label=f"drift: {first.drift}")
            curves = [run.channels[name][fitted_samples], curve, slow]
            low, high = float(min(x.min() for x in curves)), float(max(x.max() for x in curves))
            panel.set_ylim(low - 0.35 * (high - low), high + 0.35 * (high - low))
            panel.set_title(PANELS[name], fontsize=9)
        axes[-1].set_xlabel("time after the first sample in s")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
        lines = [f"{run.name.replace('$', chr(92) + '$')} at {run.speed:g} m/s"]
        for mode, decay in decays:
            z, (of_real, of_imaginary) = decay.eigenvalue, decay.sd
            parts = with_sd(z.real, of_real), with_sd(z.imag, of_imaginary)
            lines.append("{}: {} 1/s, {} rad/s (1 sd of this run)".format(mode, *parts))
            lines.append(f"    {decay.cycles:.1f} cycles, R² {decay.r_squared:.3f}")
            lines += [f"    also fitted: {second_words(z)}" for z in decay.beside]
            if decay.rejected:
                lines[-1] = "    not used: " + "\n    ".join(textwrap.wrap(decay.rejected, 100))
        figure.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=10)
