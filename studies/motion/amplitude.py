"""Periodic motions of a model as ``velotyre amplitude`` shows them: in a line of Python, as text, record and figure."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from bicycle.motion.limit_cycles import BEYOND, LIMITS, SLOWEST, LimitCycles
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
    cycles: LimitCycles,
    frame: pd.DataFrame,
    *,
    peak_factor: float | None,
    without_kick: bool = False,
    sides: Sequence[Side] = (),
    max_speed: float = 60.0,
) -> list[str]:
    """Lines on how motions begin, where they fold and end, what a damper does, and what limits the numbers."""
    content = {
        "cycles": cycles,
        "frame": frame,
        "peak_factor": peak_factor,
        "without_kick": without_kick,
        "slowest": SLOWEST,
        "sides": sides,
        "max_speed": max_speed,
        "outside": frame[~frame["within_geometry"].astype(bool)],
        "peaks": PEAKS,
        "beyond": BEYOND,
        "limits": {name: np.degrees(limit) for name, limit in LIMITS.items()},
    }
    filters = {"degrees": np.degrees, "words": mode_words}
    return render_file("studies.reporting", "amplitude.txt.j2", content, escaped=False, filters=filters).splitlines()


def record(
    limit_cycles: LimitCycles,
    frame: pd.DataFrame,
    kicks: Sequence[Kick] = (),
    unit: str = "",
    sides: Sequence[Side] = (),
) -> dict[str, Any]:
    """Content of the JSON file: how motions begin, the branches, the rows of a ``frame``, ``kicks`` in ``unit``, and
    the ``sides`` of a damper."""
    onsets = [
        {
            "speed_m_s": onset.critical.speed,
            "mode": onset.critical.mode,
            "as_speed_grows": onset.critical.direction,
            "bifurcation": onset.kind,
            "lyapunov_1_s_rad2": onset.bend,
            "lyapunov_band_1_s_rad2": list(onset.band),
        }
        for onset in limit_cycles.onsets
    ]
    branches = [
        {
            "mode": branch.mode,
            "from_m_s": branch.begin.speed,
            "to_m_s": branch.end.speed if branch.end else None,
            "ends": branch.reason,
            "folds": [
                {"speed_m_s": fold.speed, "steer_amplitude_deg": float(np.degrees(limit_cycles.amplitude(fold)))}
                for fold in branch.folds
            ],
        }
        for branch in limit_cycles.branches
    ]
    cycles = frame.to_dict("records")
    return {
        "critical": onsets,
        "branches": branches,
        "cycles": cycles,
        "kicks": [kick._asdict() | {"unit": unit} for kick in kicks],
        "damper": [
            {
                "added_N_m_s_rad": side.damping,
                "wobble_m_s": [speed.speed for speed in side.wobble],
                "largest_wobble_deg": side.extent.largest if side.extent else None,
                "largest_wobble_at_m_s": side.extent.at if side.extent else None,
                "weave_unstable_from_m_s": side.weave.critical.speed if side.weave else None,
                "weave_bifurcation": side.weave.kind if side.weave else None,
                "weave_caught_deg": side.caught,
            }
            for side in sides
        ],
    }


def draw_amplitude(cycles: LimitCycles, target: str, *, title: str, peak_factor: float | None = None) -> None:
    """Draw steer amplitude and frequency along each branch into ``target``, its line by stability.

    Pale bands reach over plausible peak factors, if the curves have one.
    """
    with picture(target) as figure:
        bar, frequency = figure.subplots(2, 1, sharex=True)
        for trace in traces_of(cycles):
            looks = mode_look(trace.mode)
            draw_trace(bar, trace, looks.colour, peak_factor)
            draw_trace(frequency, trace._replace(amplitude=trace.frequency), looks.colour)
            bar.plot(trace.speed[0], 0.0, looks.marker, color=looks.colour, label=mode_words(trace.mode))
        finish_amplitude(bar)
        bar.set_title(title)
        frequency.set(ylabel="Frequency, Hz", xlabel="Speed, m/s")
        frequency.set_ylim(bottom=0)


def film_cycle(limit_cycles: LimitCycles, speeds: Iterable[float], target: Path) -> None:
    """Film one cycle of the largest stable limit cycle at ``speeds`` (m/s), repeated in 2 s, into ``target``."""
    cycles = [(mode, cycle) for v in speeds for mode, cycle in limit_cycles.at(v) if lasts(limit_cycles, cycle)]
    if not cycles:
        raise InputError("--film: no stable limit cycle at these --speeds; give others")
    mode, cycle = max(cycles, key=lambda mode_and_cycle: limit_cycles.amplitude(mode_and_cycle[1]))
    frames = 2 * FRAMES_PER_SECOND
    derivative = 1j * np.arange(1, 2 * len(cycle.states), 2) * cycle.angular_frequency  # of odd harmonics
    waves = {name: cycle.states @ limit_cycles.system.row(name) for name in limit_cycles.system.at_one_speed.outputs}
    waves["yaw"] = waves["yaw_rate"] / derivative
    waves["rear_lateral_displacement"] = (waves["rear_lateral_velocity"] + cycle.speed * waves["yaw"]) / derivative
    time = np.arange(frames) / frames * cycle.period
    outputs = {name: (np.exp(np.outer(time, derivative)) @ wave).real for name, wave in waves.items()}
    title = (
        f"{mode_words(mode).capitalize()} of {limit_cycles.model.bicycle.name} at {cycle.speed:g} m/s: "
        f"{np.degrees(limit_cycles.amplitude(cycle)):.1f}° steer amplitude, {cycle.frequency_hz:.2f} Hz\n"
        f"slowed down {2 / cycle.period:.3g} times"
    )
    animate(limit_cycles.model, Response(time, cycle.speed, outputs), target, title=title)


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
        drawn = trace.lasting | (trace.amplitude == 0)
        axes.fill_between(trace.speed, low, high, where=drawn, color=colour, alpha=0.15, linewidth=0)


def finish_amplitude(axes: Any) -> None:
    """Name the axis, hatch what lies outside linear geometry, and explain lines and bands below the figure."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    limit, band = float(np.degrees(LIMITS["steer"])), bool(axes.collections)
    top = max(axes.get_ylim()[1], 1.1 * limit if axes.get_ylim()[1] > limit else 0.0)
    axes.axhspan(limit, max(top, limit), facecolor="none", hatch="//", edgecolor="0.82", linewidth=0)
    axes.set(ylabel="Steer amplitude, °", ylim=(0, top))
    words = {"yes": "stable", "falls slowly": "only lean grows, slowly", "no": "unstable"}
    handles = axes.get_legend_handles_labels()[0]
    handles += [Line2D([], [], color="0.3", linestyle=line, label=words[name]) for name, line in LINES.items()]
    if band:
        handles.append(Patch(color="0.5", alpha=0.25, linewidth=0, label=f"peak factor {PEAKS[0]:g} to {PEAKS[-1]:g}"))
    if top > limit:
        handles.append(Patch(facecolor="none", hatch="//", edgecolor="0.7", label="outside linear geometry"))
    axes.figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 4))
