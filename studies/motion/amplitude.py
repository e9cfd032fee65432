"""Periodic motions of a model as ``velotyre amplitude`` tells them: in a line of Python, as text, record and figure."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from bicycle.motion.limit_cycles import LIMITS, SLOWEST, LimitCycles
from bicycle.motion.responses import Response
from bicycle.stability.mode_figure import mode_look, mode_words
from studies.model_space.lasting_motions import lasts, traces_of
from studies.motion.animation import FRAMES_PER_SECOND, animate
from studies.reporting.markdown_text import render_file
from studies.reporting.plotting import picture
from tyre.ground.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    import pandas as pd

    from bicycle.motion.kicks import Kick
    from studies.model_space.lasting_motions import Side, Trace

PEAKS = (0.6, 0.8, 1.0)  # peak factors D over dry roads, assumed
LINES: dict[str, Any] = {"yes": "-", "falls slowly": (0, (5, 2)), "no": (0, (1, 1.2))}  # by the column ``stable``


def lines(
    found: LimitCycles,
    frame: pd.DataFrame,
    *,
    peak_factor: float | None,
    without_kick: bool = False,
    sides: Sequence[Side] = (),
    max_speed: float = 60.0,
) -> list[str]:
    """Lines on how motions begin, where they fold and end, what a damper does, and what limits the numbers."""
    content = {
        "found": found,
        "frame": frame,
        "friction": peak_factor,
        "without_kick": without_kick,
        "slowest": SLOWEST,
        "sides": sides,
        "max_speed": max_speed,
        "outside": frame[~frame["within_geometry"].astype(bool)],
        "peaks": PEAKS,
        "limits": {name: np.degrees(limit) for name, limit in LIMITS.items()},
    }
    filters = {"degrees": np.degrees, "words": mode_words}
    return render_file("studies.reporting", "amplitude.txt.j2", content, escaped=False, filters=filters).splitlines()


def record(
    found: LimitCycles, frame: pd.DataFrame, kicks: Sequence[Kick] = (), unit: str = "", sides: Sequence[Side] = ()
) -> dict[str, Any]:
    """Content of the JSON file: how motions begin, the branches, the rows of a ``frame``, ``kicks`` in ``unit``, and
    the ``sides`` of a damper."""
    onsets = [
        {
            "speed_m_s": one.critical.speed,
            "mode": one.critical.mode,
            "as_speed_grows": one.critical.direction,
            "begins": one.kind,
            "lyapunov_1_s_rad2": one.bend,
            "lyapunov_band_1_s_rad2": list(one.band),
        }
        for one in found.onsets
    ]
    branches = [
        {
            "mode": one.mode,
            "from_m_s": one.begin.speed,
            "to_m_s": one.end.speed if one.end else None,
            "ends": one.reason,
            "folds": [
                {"speed_m_s": fold.speed, "steer_amplitude_deg": float(np.degrees(found.amplitude(fold)))}
                for fold in one.folds
            ],
        }
        for one in found.branches
    ]
    cycles = frame.to_dict("records")
    return {
        "critical": onsets,
        "branches": branches,
        "cycles": cycles,
        "kicks": [one._asdict() | {"unit": unit} for one in kicks],
        "damper": [
            {
                "added_N_m_s_rad": one.damping,
                "wobble_m_s": [speed.speed for speed in one.wobble],
                "largest_wobble_deg": one.extent.largest if one.extent else None,
                "largest_wobble_at_m_s": one.extent.at if one.extent else None,
                "weave_unstable_from_m_s": one.weave.critical.speed if one.weave else None,
                "weave_begins": one.weave.kind if one.weave else None,
                "weave_caught_deg": one.caught,
            }
            for one in sides
        ],
    }


def draw_amplitude(found: LimitCycles, target: str, *, title: str, peak_factor: float | None = None) -> None:
    """Draw amplitude at the bar and frequency along each branch into ``target``, its line by stability.

    Pale bands reach over plausible peak factors, if the curves have one.
    """
    with picture(target) as figure:
        bar, frequency = figure.subplots(2, 1, sharex=True)
        for trace in traces_of(found):
            looks = mode_look(trace.mode)
            draw_trace(bar, trace, looks.colour, peak_factor)
            draw_trace(frequency, trace._replace(amplitude=trace.frequency), looks.colour)
            bar.plot(trace.speed[0], 0.0, looks.marker, color=looks.colour, label=mode_words(trace.mode))
        finish_amplitude(bar)
        bar.set_title(title)
        frequency.set(ylabel="Frequency, Hz", xlabel="Speed, m/s")
        frequency.set_ylim(bottom=0)


def film_cycle(found: LimitCycles, speeds: Iterable[float], target: Path) -> None:
    """Film one cycle of the largest motion that lasts at ``speeds`` (m/s), over and over in 2 s, into ``target``."""
    cycles = [(mode, cycle) for v in speeds for mode, cycle in found.at(v) if lasts(found, cycle)]
    if not cycles:
        raise InputError("--film: at none of these --speeds is there a motion that lasts")
    mode, cycle = max(cycles, key=lambda one: found.amplitude(one[1]))
    frames = 2 * FRAMES_PER_SECOND
    along = 1j * np.arange(1, 2 * len(cycle.states), 2) * cycle.angular_frequency  # of odd harmonics
    waves = {name: cycle.states @ found.system.row(name) for name in found.system.at_one_speed.outputs}
    waves["yaw"] = waves["yaw_rate"] / along
    waves["rear_lateral_displacement"] = (waves["rear_lateral_velocity"] + cycle.speed * waves["yaw"]) / along
    time = np.arange(frames) / frames * cycle.period
    outputs = {name: (np.exp(np.outer(time, along)) @ wave).real for name, wave in waves.items()}
    title = (
        f"{mode_words(mode).capitalize()} of {found.model.bicycle.name} at {cycle.speed:g} m/s: "
        f"{np.degrees(found.amplitude(cycle)):.1f}° at the bar, {cycle.frequency_hz:.2f} Hz\n"
        f"{2 / cycle.period:.3g} times slower than real"
    )
    animate(found.model, Response(time, cycle.speed, outputs), target, title=title)


def draw_trace(axes: Any, trace: Trace, colour: str, peak_factor: float | None = None) -> None:
    """Draw the amplitude along a ``trace``, its line by stability, with a band over plausible peak factors."""
    begun = 0
    for stable, group in groupby(trace.stable):
        end = begun + len(list(group))
        part = slice(max(begun - 1, 0), end)
        axes.plot(trace.speed[part], trace.amplitude[part], color=colour, linestyle=LINES[stable])
        begun = end
    if peak_factor and trace.lasting.any():
        low, high = (trace.amplitude * peak / peak_factor for peak in (PEAKS[0], PEAKS[-1]))
        there = trace.lasting | (trace.amplitude == 0)
        axes.fill_between(trace.speed, low, high, where=there, color=colour, alpha=0.15, linewidth=0)


def finish_amplitude(axes: Any) -> None:
    """Name the axis, hatch what lies outside linear geometry, and explain lines and bands below the figure."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    limit, band = float(np.degrees(LIMITS["steer"])), bool(axes.collections)
    top = max(axes.get_ylim()[1], 1.1 * limit if axes.get_ylim()[1] > limit else 0.0)
    axes.axhspan(limit, max(top, limit), facecolor="none", hatch="//", edgecolor="0.82", linewidth=0)
    axes.set(ylabel="Amplitude at the bar, °", ylim=(0, top))
    words = {"yes": "stable", "falls slowly": "stable but slowly falling", "no": "unstable"}
    handles = axes.get_legend_handles_labels()[0]
    handles += [Line2D([], [], color="0.3", linestyle=line, label=words[name]) for name, line in LINES.items()]
    if band:
        handles.append(Patch(color="0.5", alpha=0.25, linewidth=0, label=f"D from {PEAKS[0]:g} to {PEAKS[-1]:g}"))
    if top > limit:
        handles.append(Patch(facecolor="none", hatch="//", edgecolor="0.7", label="outside linear geometry"))
    axes.figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 4))
