"""From recorded forced runs to a table of frequency responses, one for each speed and output."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.identification.frequency_response import SpectralResponse, spectral_response
from bicycle.identification.recording import FORCED_INPUTS, MOTIONS, Run, read_forced, refuse_copies
from studies.diagnosis.frequency_response import describe_signal
from studies.model_space.run_argument import file_and_speed, name_apart
from tyre.formats.channel_map import ChannelMap
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, unknown
from tyre.recordings.draft import looking


@dataclass(frozen=True)
class RunResponse:
    """The response ``spectrum`` of the signal ``output`` to the signal ``input``, of the runs at one speed."""

    input: str
    output: str
    speed: float  # m/s
    spectrum: SpectralResponse


def responses_of_runs(
    recordings: Sequence[str],
    source: str,
    outputs: Sequence[str],
    channel_map: ChannelMap | None,
    *,
    reference: str = "",
    segment_s: float,
    highest_hz: float,
) -> tuple[list[RunResponse], list[str]]:
    """Responses from recordings; those of one speed are averaged."""
    if source not in FORCED_INPUTS:
        raise InputError(f"--input: {unknown('input', source, FORCED_INPUTS)}")
    for name in outputs:
        if name not in MOTIONS:
            raise InputError(f"--output: {unknown('output', name, MOTIONS)}")
    if not outputs or len(set(outputs)) < len(outputs):
        raise InputError(f"--output {','.join(outputs)!r}: name each output once, such as roll_rate,steer")
    if len(set(recordings)) < len(recordings):
        raise InputError(f"{next(x for x in recordings if list(recordings).count(x) > 1)!r} is given twice; keep one")
    _refuse_two_speeds(recordings)
    column = {**FORCED_INPUTS, **MOTIONS}.get(reference, reference)
    if column == FORCED_INPUTS[source]:
        raise InputError(
            f"--instrument {reference}: this is the input itself, no reference from outside; leave --instrument out, "
            "or name the signal that was added to the input"
        )
    runs = name_apart([_read(text, reference, channel_map) for text in recordings])
    refuse_copies(runs)
    notes = [f"{run.name}: {note}" for run in runs for note in run.notes]
    responses = []
    for speed in sorted({run.speed for run in runs}):
        same_speed = [run for run in runs if run.speed == speed]
        _refuse_steps(same_speed)
        driven = [_signal(run, FORCED_INPUTS[source], f"--input {source}") for run in same_speed]
        pushed = [_signal(run, column, f"--instrument {reference}") for run in same_speed] if reference else None
        for name in outputs:
            measured = [_signal(run, MOTIONS[name], f"--output {name}") for run in same_speed]
            try:
                response = spectral_response(
                    driven, measured, same_speed[0].step, segment_s=segment_s, references=pushed, highest_hz=highest_hz
                )
            except InputError as error:
                raise InputError(f"{', '.join(run.name for run in same_speed)}: {error}") from None
            responses.append(RunResponse(source, name, speed, response))
        if lines := responses[-1].spectrum.lines:
            notes.append(
                f"{speed:g} m/s: {describe_signal(reference or source)} is made of {lines} lines, as a multisine is; "
                "the response is given at these only, from full recordings; --segment is not used"
            )
        if left_out := responses[-1].spectrum.left_out:
            notes.append(
                f"{speed:g} m/s: omitted {left_out} frequenc{'ies' if left_out > 1 else 'y'} at which "
                f"{reference or source} hardly moves {'the ' + describe_signal(source) if reference else 'anything'}"
            )
    if not reference and not all(
        r.spectrum.lines for r in responses
    ):  # lines average the noise before they are divided
        notes.append(
            "output over input: where a rider or controller answered the motion, its noise biases the ratio; name a "
            "reference that came from outside with --instrument"
        )
    return responses, notes


def _read(text: str, reference: str, channel_map: ChannelMap | None) -> tuple[Path, tuple[Run, ...]]:
    file, speed = file_and_speed(text)
    with looking(file):
        return file, read_forced(file, speed, reference=reference, channel_map=channel_map)


def _refuse_two_speeds(recordings: Sequence[str]) -> None:
    """Refuse a recording that is given at two speeds."""
    speeds: dict[str, float] = {}
    for text in recordings:
        file, speed = file_and_speed(text)
        if (earlier := speeds.setdefault(file.resolve().as_posix(), speed)) != speed:
            raise InputError(
                f"{file} is given at {earlier:g} and at {speed:g} m/s; a recording has one speed: keep one"
            )


def _refuse_steps(runs: Sequence[Run]) -> None:
    """Refuse ``runs`` of one speed whose samples are not equally far apart."""
    for run in runs[1:]:
        if abs(run.step / runs[0].step - 1) > 1e-3:
            raise InputError(
                f"{run.name}: samples every {run.step:.6g} s, {runs[0].name} every {runs[0].step:.6g} s; resample the "
                "runs of one speed alike, or give them to the command one by one"
            )


def _signal(run: Run, column: str, option: str) -> Array:
    """Recorded ``column`` (T,) of a ``run``; InputError that names the ``option`` if it was not recorded."""
    signals = {**run.channels, **run.inputs}
    if column not in signals:
        raise InputError(f"{run.name}: {option}: {column} was not recorded; it holds {', '.join(signals)}")
    return signals[column]


def rows_of(response: RunResponse) -> list[dict[str, Any]]:
    """Rows of a table for ``kind = "frequency_response"``, SI, of a ``response``."""
    spectrum = response.spectrum
    return [
        {
            "input": response.input,
            "output": response.output,
            "frequency_Hz": float(f"{f:.6g}"),
            "speed_m_s": response.speed,
            "re": float(f"{gain.real:.6g}"),
            "im": float(f"{gain.imag:.6g}"),
            "sd": float(f"{sd:.4g}"),
            "coherence": float(f"{coherence:.4g}"),
            "averages": round(spectrum.averages, 2),
        }
        for f, gain, sd, coherence in zip(
            spectrum.frequency_hz, spectrum.gain, spectrum.sd, spectrum.coherence, strict=True
        )
    ]


def shown_of(response: RunResponse) -> list[list[Any]]:
    """The row of a ``response`` in the terminal."""
    spectrum, words = response.spectrum, f"{describe_signal(response.input)} to {describe_signal(response.output)}"
    if not len(spectrum.gain):
        return [[response.speed, words, 0, None, spectrum.averages, None, None]]
    band = f"{spectrum.frequency_hz[0]:.3g} to {spectrum.frequency_hz[-1]:.3g}"
    middle = (float(np.median(spectrum.coherence)), float(np.median(spectrum.sd / np.abs(spectrum.gain))))
    return [[response.speed, words, len(spectrum.gain), band, spectrum.averages, *middle]]
