"""Time histories and frequency responses as figures."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.responses.linear import FrequencyResponse, Response
from studies.reporting.plotting import drawing, look

PANELS = (("lean", "steer"), ("yaw_rate",), ("rear_side_force", "front_side_force"), ("rear_lateral_displacement",))
TITLES = {"rear_side_force": "Side force", "rear_lateral_displacement": "Lateral path", "lean": "Angle"}
OF_INPUT = ("lean", "steer", "yaw_rate")
DEGREES = {"rad": ("°", 180 / np.pi), "rad/s": ("°/s", 180 / np.pi)}


def draw_responses(responses: Mapping[str, Response], target: Path, *, title: str) -> Path:
    """Inputs, angles, yaw rate, side forces and path over time; one line style per response.

    Parameters
    ----------
    responses : mapping of str to Response
        By label.
    target : Path
    title : str
    """
    first = next(iter(responses.values()))
    panels: list[tuple[str, ...]] = [(name,) for name in first.inputs]
    panels += [shown for panel in PANELS if (shown := tuple(name for name in panel if name in first.outputs))]
    with drawing(target, width=8.5, height=1.6 * len(panels) + 0.9) as canvas:
        rows = canvas.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        for axes, names in zip(rows, panels, strict=True):
            unit, factor = DEGREES.get(first.units[names[0]], (first.units[names[0]], 1.0))
            for number, name in enumerate(names):
                for order, (label, response) in enumerate(responses.items()):
                    upright = slice(response.fall)  # what follows a fall means nothing
                    style = {"color": look(2 * number).colour, "linewidth": 2.0 - 0.7 * order}
                    if name in response.inputs:
                        axes.plot(response.time, factor * response.inputs[name], drawstyle="steps-post", **style)
                        break
                    axes.plot(
                        response.time[upright], factor * response.outputs[name][upright], **style,
                        linestyle=("-", (0, (4, 2)))[order % 2],
                        label=_plain(name) + (f", {label}" if len(responses) > 1 else ""),
                    )  # fmt: skip
            axes.set_ylabel(f"{TITLES.get(names[0], _plain(names[0]).capitalize())}, {unit}")
            if len(axes.lines) > 1:
                axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0)
        rows[-1].set_xlabel("Time, s")
        rows[-1].set_xlim(first.time[0], first.time[-1])
        canvas.align_ylabels()
        canvas.suptitle(title, x=0.01, ha="left")
    return target


def draw_frequency_response(response: FrequencyResponse, target: Path, *, title: str) -> Path:
    """Gain and phase of lean, steer and yaw rate against frequency, into ``target`` under a ``title``."""
    hertz = response.frequency_hz
    with drawing(target, width=7.5, height=5.8) as canvas:
        gain, phase = canvas.subplots(2, 1, sharex=True)
        for number, name in enumerate(OF_INPUT):
            values, style = response.outputs[name], look(number)
            line: dict[str, Any] = {"color": style.colour, "linestyle": style.line}
            said = f"{_plain(name)}, {response.units[name]} per {response.units[response.input]}"
            gain.loglog(hertz, np.abs(values), label=said, **line)
            phase.semilogx(hertz, np.degrees(np.unwrap(np.angle(values))), **line)
        gain.set_ylabel("Gain")
        gain.legend(loc="best")
        phase.set(ylabel="Phase, °", xlabel="Frequency, Hz", xlim=(hertz[0], hertz[-1]))
        phase.yaxis.set_major_locator(_multiples(90))
        canvas.suptitle(title, x=0.01, ha="left")
    return target


def _plain(name: str) -> str:
    return name.replace("_", " ")


def _multiples(step: float) -> Any:
    from matplotlib.ticker import MultipleLocator

    return MultipleLocator(step)
