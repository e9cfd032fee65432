"""A picture of the fit of one free decay: measured channels, fit, drift, window, and what was found."""

import textwrap
from pathlib import Path

from bicycle.identification.free_decay import Decay
from bicycle.identification.run import Run
from studies.free_decays.words import second_words, with_sd
from studies.reporting.plotting import drawing

MEASURED, FITTED, DRIFT = "#9db8d9", "#123a6b", "#c8462f"
LINE = 100  # letters of a title's line
ASIDE = 0.6  # of the window's length that is shown before and after it
WORDS = {
    "roll_rate_rad_s": "roll rate in rad/s", "yaw_rate_rad_s": "yaw rate in rad/s",
    "steer_rate_rad_s": "steer rate in rad/s", "lean_rad": "lean in rad", "steer_rad": "steer in rad",
    "lateral_acceleration_m_s2": "lateral acceleration in m/s²",
}  # fmt: skip


def draw(run: Run, decays: tuple[tuple[str, Decay], ...], target: Path) -> Path:
    """Draw the fit of a run.

    Parameters
    ----------
    run : Run
        The whole recording or event.
    decays : tuple of tuple, shape (modes, 2)
        Name of each mode and what was found of it.
    target : Path
        Without ending; .png and .svg are written.

    Returns
    -------
    Path
        Of the .png.
    """
    first = decays[0][1]
    assert first.estimate is not None
    w = first.estimate.window
    fit, drift = first.estimate.curves()
    time = run.time - run.time[0]
    begin, end = w.start, w.start + w.length + (w.block - 1) * run.step
    near = (time >= begin - ASIDE * w.length) & (time <= end + ASIDE * w.length)
    fitted = w.start + (w.block - 1) * run.step / 2 + w.time
    with drawing(target, width=8.0, height=2.1 + 0.3 * len(decays) + 1.7 * len(w.channels)) as figure:
        axes = figure.subplots(len(w.channels), 1, squeeze=False, sharex=True)[:, 0]
        for place, (panel, name) in enumerate(zip(axes, w.channels, strict=True)):
            scale = w.scale[place]
            panel.axvspan(begin, end, color="#e5a823", alpha=0.13, linewidth=0, label="window")
            panel.plot(time[near], run.channels[name][near], color=MEASURED, linewidth=2.4, label="measured")
            panel.plot(fitted, scale * fit[:, place], color=FITTED, linewidth=1.3, label="fit")
            label = f"drift: {first.drift}"
            panel.plot(fitted, scale * drift[:, place], color=DRIFT, linewidth=1.1, linestyle="--", label=label)
            shown = [
                run.channels[name][(time >= begin) & (time <= end)],
                scale * fit[:, place],
                scale * drift[:, place],
            ]
            low, high = float(min(x.min() for x in shown)), float(max(x.max() for x in shown))
            panel.set_ylim(low - 0.35 * (high - low), high + 0.35 * (high - low))
            panel.set_title(WORDS[name], fontsize=9)
        axes[-1].set_xlabel("time after the first sample in s")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
        figure.suptitle(_title(run, decays), x=0.01, ha="left", fontsize=10)
    return target.with_name(f"{target.name}.png")


def _title(run: Run, decays: tuple[tuple[str, Decay], ...]) -> str:
    lines = [f"{run.name.replace('$', chr(92) + '$')} at {run.speed:g} m/s"]
    for mode, found in decays:
        z, sd = found.eigenvalue, found.sd
        lines.append(f"{mode}: {with_sd(z.real, sd[0])} 1/s, {with_sd(z.imag, sd[1])} rad/s (1 sd of this run)")
        lines.append(f"    {found.cycles:.1f} cycles, R² {found.r_squared:.3f}")
        lines += [f"    fitted beside: {second_words(z)}" for z in found.beside]
        if found.rejected:
            lines[-1] = "    not used: " + "\n    ".join(textwrap.wrap(found.rejected, LINE))
    return "\n".join(lines)
