"""Whether a recording of forced motion gives a frequency response: what ``velotyre frequency-response`` would do."""

from collections.abc import Sequence
from dataclasses import replace

from bicycle.identification.forced_run import MOTIONS
from bicycle.identification.recording import PLACELESS
from bicycle.identification.run import Run
from bicycle.identification.spectral_response import spectral_response
from studies.look.roles import TORQUES
from studies.look.use import Use
from tyre.base.errors import InputError

RESPONSE = "frequency response"
SEGMENT, SHORTEST = 10.0, 2.0  # s, of the segments of a spectrum
SEGMENTS = 4  # end to end: overlapping by half they are seven


def response_use(replay: Use, runs: Sequence[Run], command: str) -> Use:
    """Gain and phase need what replay needs, for so long that five segments are independent.

    Parameters
    ----------
    replay : Use
        Of the same ``runs``: what it lacks is lacking here.
    runs : sequence of Run
        As the commands read them.
    command : str
        With the recording and its map.
    """
    if not replay.usable:
        return Use(RESPONSE, (), replay.reasons, replay.remedies[:1])
    source = next(name for name in TORQUES if f"{name}_N_m" in runs[0].inputs)
    motions = {name: column for name, column in MOTIONS.items() if column in runs[0].channels}
    motions = {name: column for name, column in motions.items() if column not in PLACELESS}
    column = next(iter(motions.values()))
    longest = max(float(run.time[-1] - run.time[0]) for run in runs)
    segment = min(SEGMENT, int(longest / SEGMENTS * 10) / 10)
    told, reasons = [], []
    for run, event in zip(runs, replay.events, strict=True):
        try:
            if segment < SHORTEST:
                raise InputError(f"{longest:.3g} s are too short; {SEGMENTS * SHORTEST:g} s or more are needed")
            found = spectral_response(
                [run.inputs[f"{source}_N_m"]], [run.channels[column]], run.step, segment_s=segment
            )
        except InputError as error:
            reasons.append(f"{event.name or 'the whole recording'}: {error}")
            continue
        what = f"{found.averages:.1f} independent segments of {segment:g} s"
        if found.lines:
            what = f"a {source.replace('_', ' ')} of {found.lines} lines"
        told.append(replace(event, notes=(what,)))
    if not told:
        return Use(RESPONSE, (), tuple(reasons), ("record longer, or use replay: it fits the same samples in time",))
    step = f"{command} --input {source} --output {','.join(motions)}"
    step += f" --segment {segment:g}" * (segment != SEGMENT) + " --out responses.csv"
    closed = "where a rider or controller answered the motion, name a reference with --instrument"
    speed = "the forward speed in m/s, after @" if "@SPEED" in command else ""
    return Use(RESPONSE, tuple(told), tuple(reasons), (closed,), step, speed, windows=replay.windows)
