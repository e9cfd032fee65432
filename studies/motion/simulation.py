"""Options and figures of simulated responses."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.model.inputs import InputHistory, doublet, pulse, step
from bicycle.motion.responses import FrequencyResponse, Response, column
from studies.reporting.plotting import drawing, look
from tyre.formats.channel_map import ChannelMap
from tyre.ground.errors import InputError, unknown
from tyre.ground.number_with_unit import typed_number
from tyre.ground.text_table import read_columns
from tyre.ground.units import SI
from tyre.recordings.channels import read_records
from tyre.recordings.draft import draft_words, refuse_unmapped

SHAPES: Mapping[str, tuple[Callable[..., InputHistory], bool]] = {
    "step": (step, False), "pulse": (pulse, True), "doublet": (doublet, True),
}  # fmt: skip
FILES = {"file": True, "steps": False}
"""Shapes that are read from a file: whether values are joined by straight lines; else each holds to the next."""
HOW = (
    "write NAME:step:SIZE[@START], NAME:pulse:SIZE@START+DURATION, NAME:doublet:SIZE@START+DURATION, "
    "NAME:file:FILE.csv (samples, straight lines between them) or NAME:steps:FILE.csv (each value holds to the next), "
    "in SI units and seconds, for example steer_torque:step:0.5@1.0"
)


def parse_initial(text: str, units: Mapping[str, str] | None = None) -> dict[str, float]:
    """State -> value (SI) from a ``text`` like ``lean=0.02,steer_rate=5deg/s``, in the SI ``units`` of states."""
    values: dict[str, float] = {}
    for part in filter(None, text.split(",")):
        name, _, number = (piece.strip() for piece in part.partition("="))
        if name in values:
            raise InputError(f"initial {text!r}: {name} is given twice")
        try:
            values[name] = typed_number(number, (units or {}).get(name, ""))
        except InputError as error:
            raise InputError(f"initial {text!r}: {name}: {error}") from error
        except ValueError:
            raise InputError(f"initial {text!r}: write STATE=NUMBER,... such as lean=0.02,steer_rate=0.1") from None
    return values


def parse_inputs(
    texts: Sequence[str], *, allowed: Mapping[str, str], channel_map: ChannelMap | None = None
) -> dict[str, InputHistory]:
    """Input -> history from ``texts`` like ``steer_torque:step:0.5@1.0``; see :data:`HOW`."""
    inputs: dict[str, InputHistory] = {}
    for text in texts:
        name, _, history_text = text.partition(":")
        shape, _, value = history_text.partition(":")
        if name not in allowed:
            raise InputError(f"input {text!r}: {unknown('input', name, allowed)}")
        if name in inputs:
            raise InputError(f"input {text!r}: {name} is given twice")
        if not value:
            raise InputError(f"input {text!r}: {HOW}")
        if shape in FILES:
            read = read_history(Path(value), name, allowed[name], channel_map)
            inputs[name] = replace(read, linear=FILES[shape])
        elif shape in SHAPES:
            inputs[name] = _parse_shape(text, shape, value, allowed[name])
        else:
            raise InputError(f"input {text!r}: {unknown('shape', shape, [*SHAPES, *FILES])}; {HOW}")
    return inputs


def check_within(inputs: Mapping[str, InputHistory], duration: float) -> None:
    """Refuse an input that starts outside the simulated time, 0 to ``duration`` (s)."""
    for name, history in inputs.items():
        if not 0 <= history.time[0] < duration:
            raise InputError(
                f"input {name} starts at {history.time[0]:g} s, outside the simulated time 0 .. {duration:g} s; "
                "move its start or take another --duration"
            )


def read_history(path: Path, name: str, unit: str, channel_map: ChannelMap | None = None) -> InputHistory:
    """The input ``name`` in ``unit`` from a CSV ``path`` with ``time_s`` and a column ``steer_torque_N_m``, say."""
    quantity = {name: {unit: quantity for quantity, unit in SI.items()}[unit]}
    if channel_map is not None:
        return _mapped_history(path, quantity, channel_map)
    if path.suffix.casefold() not in ("", ".csv"):
        refuse_unmapped(path, quantity)
    columns = ("time_s", column(name, unit))
    try:
        numbers = read_columns(path, numbers=columns, needed=columns, others=True).numbers
    except InputError as error:
        words = "" if f"{path}, line" in str(error) else draft_words(path, quantity)
        raise InputError(f"{error}; or give a channel map: {words}" if words else str(error)) from error
    try:
        return InputHistory(numbers["time_s"], numbers[columns[1]])
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _mapped_history(path: Path, quantity: dict[str, str], channel_map: ChannelMap) -> InputHistory:
    (name,) = quantity
    if name not in channel_map.channels:
        names = ", ".join(channel_map.channels)
        raise InputError(f"{path}: the channel map names no {name} (it names {names or 'nothing'}); add its column")
    records = read_records(path, channel_map.only([name]), quantity)
    if len(records) > 1:
        raise InputError(f"{path}: holds the events {', '.join(record.event for record in records)}; keep one window")
    values = records[0].values[name]
    if not np.isfinite(values).all():
        raise InputError(f"{path}: {name} is missing in {np.count_nonzero(~np.isfinite(values))} samples; repair them")
    return InputHistory(records[0].time, values)


def _parse_shape(text: str, shape: str, value: str, unit: str) -> InputHistory:
    make, lasts = SHAPES[shape]
    size, _, when = value.partition("@")
    start, _, duration = when.partition("+")
    try:
        numbers = [typed_number(size, unit), *(typed_number(part, "s") for part in (start or "0", duration) if part)]
    except InputError:
        raise
    except ValueError:
        numbers = []
    if len(numbers) != 2 + lasts:
        raise InputError(f"input {text!r}: {HOW}")
    try:
        return make(numbers[0], **dict(zip(("start", "duration"), numbers[1:], strict=False)))
    except InputError as error:
        raise InputError(f"input {text!r}: {error}") from error


PANELS = (
    ("lean", "steer"),
    ("yaw_rate",),
    ("rear_lateral_force", "front_lateral_force"),
    ("rear_lateral_displacement",),
)
TITLES = {"rear_lateral_force": "Lateral force", "rear_lateral_displacement": "Lateral path", "lean": "Angle"}
DEGREES = {"rad": ("°", 180 / np.pi), "rad/s": ("°/s", 180 / np.pi)}


def draw_responses(responses: Mapping[str, Response], target: Path, *, title: str) -> None:
    """Inputs, angles, yaw rate, lateral forces and path over time; one line style per response."""
    first = next(iter(responses.values()))
    panels: list[tuple[str, ...]] = [(name,) for name in first.inputs]
    panels += [present for panel in PANELS if (present := tuple(name for name in panel if name in first.outputs))]
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
                        response.time[upright],
                        factor * response.outputs[name][upright],
                        **style,
                        linestyle=("-", (0, (4, 2)))[order % 2],
                        label=_label(name) + (f", {label}" if len(responses) > 1 else ""),
                    )
            axes.set_ylabel(f"{TITLES.get(names[0], _label(names[0]).capitalize())}, {unit}")
            if len(axes.lines) > 1:
                axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0)
        rows[-1].set_xlabel("Time, s")
        rows[-1].set_xlim(first.time[0], first.time[-1])
        canvas.align_ylabels()
        canvas.suptitle(title, x=0.01, ha="left")


def draw_frequency_response(response: FrequencyResponse, target: Path, *, title: str) -> None:
    """Gain and phase of lean, steer and yaw rate against frequency, into ``target`` under a ``title``."""
    from matplotlib.ticker import MultipleLocator

    hertz = response.frequency_hz
    with drawing(target, width=7.5, height=5.8) as canvas:
        gain, phase = canvas.subplots(2, 1, sharex=True)
        for number, name in enumerate(("lean", "steer", "yaw_rate")):
            values, style = response.outputs[name], look(number)
            line: dict[str, Any] = {"color": style.colour, "linestyle": style.line}
            label = f"{_label(name)}, {response.units[name]} per {response.units[response.input]}"
            gain.loglog(hertz, np.abs(values), label=label, **line)
            phase.semilogx(hertz, np.degrees(np.unwrap(np.angle(values))), **line)
        gain.set_ylabel("Gain")
        gain.legend(loc="best")
        phase.set(ylabel="Phase, °", xlabel="Frequency, Hz", xlim=(hertz[0], hertz[-1]))
        phase.yaxis.set_major_locator(MultipleLocator(90))
        canvas.suptitle(title, x=0.01, ha="left")


def _label(name: str) -> str:
    return name.replace("_", " ")
