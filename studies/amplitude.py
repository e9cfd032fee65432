"""Periodic motions of a model as ``velotyre amplitude`` tells them: in a line of Python, as text, record and figure."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from bicycle.limit_cycles import LIMITS, SLOWEST, Branch, LimitCycles, find_limit_cycles
from bicycle.mode_figure import mode_look, mode_words
from studies.library import model_of
from studies.reporting.markdown_text import render_file
from studies.reporting.plotting import STYLE, settle
from tyre.errors import InputError
from tyre.files import replacing

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd

    from bicycle.kicks import Kick
    from bicycle.nonlinear import CurveTyre, MagicTyre
    from studies.library import AnyModel

LINES: dict[str, Any] = {"yes": "-", "falls slowly": (0, (5, 2)), "no": (0, (1, 1.2))}  # by the column ``stable``


def limit_cycles(
    model: AnyModel, *, rear: MagicTyre | CurveTyre | None = None, front: MagicTyre | CurveTyre | None = None,
    max_speed: float = 60.0,
) -> LimitCycles:  # fmt: skip
    """Find the periodic motions of a bicycle on tyres that saturate, from its critical speeds on.

    >>> found = limit_cycles("benchmark", max_speed=10.0)
    Traceback (most recent call last):
    tyre.errors.InputError: nonlinear tyres need the effect side_slip or relaxation_length; ...

    Parameters
    ----------
    model : str, Path, Bicycle, Model or mapping
        A model on the effect ``relaxation_length``, a file, or what a model file holds.
    rear, front : MagicTyre or CurveTyre
        Curves of the tyres, by default the Magic Formula with D = 0.8, C = 1.3, E = 0.
    max_speed : float
        m/s, up to which critical speeds are looked for and motions followed.

    Returns
    -------
    bicycle.limit_cycles.LimitCycles
        ``frame(speeds)`` tabulates amplitude, frequency and stability.

    Raises
    ------
    InputError
        No model, tyres that do not saturate, or wheel loads or equations that change with the speed.
    """
    return find_limit_cycles(model_of(model), rear=rear, front=front, max_speed=max_speed)


def lines(
    found: LimitCycles, frame: pd.DataFrame, *, peak_factor: float | None, without_kick: bool = False
) -> list[str]:
    """Lines on how motions begin, where they fold and end, and what limits the numbers of a ``frame``."""
    content = {
        "found": found, "frame": frame, "friction": peak_factor, "without_kick": without_kick, "slowest": SLOWEST,
        "outside": frame[~frame["within_geometry"].astype(bool)],
        "limits": {name: np.degrees(limit) for name, limit in LIMITS.items()},
    }  # fmt: skip
    filters = {"degrees": np.degrees, "words": mode_words}
    return render_file("studies.reporting", "amplitude.txt.j2", content, escaped=False, filters=filters).splitlines()


def record(found: LimitCycles, frame: pd.DataFrame, kicks: Sequence[Kick] = (), unit: str = "") -> dict[str, Any]:
    """Content of the JSON file: how motions begin, the branches, the rows of a ``frame``, and ``kicks`` in ``unit``."""
    onsets = [
        {
            "speed_m_s": one.critical.speed, "mode": one.critical.mode, "as_speed_grows": one.critical.direction,
            "begins": one.kind, "lyapunov_1_s_rad2": one.bend, "lyapunov_band_1_s_rad2": list(one.band),
        }
        for one in found.onsets
    ]  # fmt: skip
    branches = [
        {
            "mode": one.mode, "from_m_s": one.begin.speed, "to_m_s": one.end.speed if one.end else None,
            "ends": one.reason,
            "folds": [
                {"speed_m_s": fold.speed, "steer_amplitude_deg": float(np.degrees(found.amplitude(fold)))}
                for fold in one.folds
            ],
        }
        for one in found.branches
    ]  # fmt: skip
    cycles = frame.to_dict("records")
    return {
        "critical": onsets,
        "branches": branches,
        "cycles": cycles,
        "kicks": [one._asdict() | {"unit": unit} for one in kicks],
    }


def draw_amplitude(found: LimitCycles, target: str, *, title: str) -> None:
    """Draw amplitude at the bar and frequency along each branch into ``target``, its line by stability."""
    import matplotlib
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    style: Any = dict(STYLE)
    with matplotlib.rc_context(style):
        figure = Figure(figsize=(7.5, 6.5), layout="constrained")
        bar, frequency = figure.subplots(2, 1, sharex=True)
        for branch in found.branches:
            _draw_branch(found, branch, bar, frequency)
        limit = float(np.degrees(LIMITS["steer"]))
        top = max(bar.get_ylim()[1], 1.1 * limit if bar.get_ylim()[1] > limit else 0.0)
        bar.axhspan(limit, max(top, limit), facecolor="none", hatch="//", edgecolor="0.82", linewidth=0)
        bar.set(ylabel="Amplitude at the bar, °", ylim=(0, top), title=title)
        hatched = f" (hatched: above {limit:g}° at the bar)" if top > limit else ""
        frequency.set(ylabel="Frequency, Hz", xlabel=f"Speed, m/s{hatched}")
        frequency.set_ylim(bottom=0)
        handles, _ = bar.get_legend_handles_labels()
        words = {"yes": "stable", "falls slowly": "stable but slowly falling", "no": "unstable"}
        handles += [Line2D([], [], color="0.3", linestyle=line, label=words[name]) for name, line in LINES.items()]
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
        settle(figure)
        try:
            with replacing(target) as part:
                figure.savefig(part)
        except OSError as error:
            raise InputError(f"{target}: cannot write the picture: {error.strerror}") from error


def _draw_branch(found: LimitCycles, branch: Branch, bar: Any, frequency: Any) -> None:
    colour = mode_look(branch.mode).colour
    points: list[tuple[float, float, float, str]] = []
    for cycle in (point.cycle for point in branch.points):
        moves = cycle.slips.any()
        angle = float(np.degrees(found.amplitude(cycle))) if moves else 0.0
        points.append((cycle.speed, angle, cycle.frequency_hz, found.stability(cycle) if moves else ""))
    points[0], points[-1] = (*points[0][:3], points[1][3]), (*points[-1][:3], points[-1][3] or points[-2][3])
    begun = 0
    for stable, group in groupby(points, key=lambda one: one[3]):
        count = len(list(group))
        speed, height, hertz, _ = zip(*points[max(begun - 1, 0) : begun + count], strict=True)
        look = {"color": colour, "linestyle": LINES[stable]}
        bar.plot(speed, height, **look)
        frequency.plot(speed, hertz, **look)
        begun += count
    bar.plot(points[0][0], 0.0, mode_look(branch.mode).marker, color=colour, label=mode_words(branch.mode))
