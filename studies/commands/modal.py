"""``velotyre modal``: eigenvalues from free decays or rides, as a modal table for ``velotyre diagnose``."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from shlex import quote
from typing import Any

import click

from studies.model_space.channel_options import chosen_map, takes_channels
from studies.model_space.command_options import FINITE, FOLDER, TIME
from studies.reporting.command_context import example

CLOCK = "; --from and --to count from the first sample, which is at {begin:.10g} s by the clock of the recording"
BEYOND = (
    "{run}: the window from {first:g} s to {last:g} s reaches beyond the recording, 0 to {length:g} s{clock}; what "
    "there is was fitted"
)
STANDS = (
    "{run}: at 0 m/s, a bicycle that stands or hangs; frequency and damping are those of the recording, but `velotyre "
    "diagnose` compares speeds above 0 alone"
)
UNUSED = (
    "no run could be used{unwritten}; see the judgements above; `velotyre look {file}` finds the windows in which a "
    "motion dies away"
)


@click.command(
    help="Estimate frequency and damping from free decays. Each recording is given with its speed, m/s: RUN.csv@4.8.",
    epilog=example("velotyre modal run01.csv@4.8 run02.csv@5.6 --from 0.5 --out weave.csv"),
)
@click.argument("runs", nargs=-1, required=True, metavar="RUN.csv@SPEED...")
@takes_channels
@click.option("--mode", help="Name of the mode in the table, such as wobble; weave unless --modes is given.")
@click.option(
    "--modes", metavar="NAME,NAME", help="Names of several modes in one window, in order of frequency: weave,wobble."
)
@click.option(
    "--from",
    "first_s",
    type=TIME,
    default=0.0,
    show_default=True,
    help="Start of the window, s after the first sample.",
)
@click.option("--to", "last_s", type=TIME, help="End of the window, s after the first sample.")
@click.option("--start-hz", type=FINITE, help="Start the fit near this frequency, Hz.")
@click.option(
    "--drift", help="Drift: none, constant, parabola, exponential or parabola-exponential; default: by evidence."
)
@click.option(
    "--ride", is_flag=True, help="Estimate wobble from ordinary riding without an impulse, RIDE.csv or RIDE.csv@4.8."
)
@click.option("--out", "out_file", metavar="TABLE.csv", help="Write the modal table.")
@click.option("--figures", type=FOLDER, help="Folder for a picture of each fit.")
def command(
    runs: tuple[str, ...],
    channels_file: Path | None,
    channel_texts: tuple[str, ...],
    mode: str | None,
    modes: str | None,
    first_s: float,
    last_s: float | None,
    start_hz: float | None,
    drift: str | None,
    out_file: str | None,
    figures: Path | None,
    *,
    ride: bool,
) -> None:
    from contextlib import nullcontext

    from bicycle.identification.free_decay import identify_modes
    from bicycle.identification.recording import refuse_copies
    from studies.model_space.run_argument import name_apart
    from studies.motion.free_decays import draw, judge_decays, notes_of, notes_of_weave
    from studies.reporting.manifest import results
    from studies.reporting.output import print_table
    from tyre.ground.errors import InputError

    channel_map = chosen_map(channels_file, channel_texts)
    if ride:
        of_decays = {"--mode": mode, "--modes": modes, "--from": first_s, "--to": last_s, "--drift": drift}
        _refuse_of_decays({**of_decays, "--figures": figures})
        _identify_rides(runs, channel_map, start_hz, out_file)
        return
    names = _names(mode, modes)
    events = name_apart([_read(argument, channel_map) for argument in runs])
    refuse_copies(events)
    window: dict[str, Any] = {"first_s": first_s, "last_s": float("inf") if last_s is None else last_s}
    notes: list[str] = []
    stems: list[str] = []  # of the pictures
    decays: list[tuple[str, Any]] = []  # mode and what one run says of it
    with nullcontext() if figures is None else results(figures):
        for event in events:
            try:
                identified = identify_modes(event, len(names), start_hz=start_hz, drift=drift, **window)
            except InputError as error:
                raise InputError(f"{error}{_clock(event)}") from error
            decays_of_run = list(zip(names, identified, strict=True))
            decays += decays_of_run
            notes += [f"{event.name}: {note}" for note in event.notes] + _note_long_window(event, **window)
            if event.speed == 0:
                notes.append(STANDS.format(run=event.name))
            if figures is not None and identified[0].estimate is not None:
                stems.append(_choose_stem(event, stems))
                draw(event, decays_of_run, figures / stems[-1])
    judgements = judge_decays(decays)
    notes += notes_of(judgements)
    if mode is None and modes is None:
        notes += notes_of_weave(judgements)
    for note in notes:
        click.echo(f"note: {note}", err=True)
    heads = ["run", "speed m/s", "real 1/s", "imaginary rad/s", "cycles", "R^2", "drift", "start moves it by"]
    print_table([_cells(judgement) for judgement in judgements], [*heads, "repeats", "judgement"])
    rows = [judgement.decay.row(judgement.mode) for judgement in judgements if not judgement.rejected]
    if rows and out_file:
        _write(rows, out_file)
    if not rows:
        unwritten = f", {out_file} is not written" if out_file else ""
        unused = UNUSED.format(unwritten=unwritten, file=quote(runs[0].rpartition("@")[0]))
        if out_file:
            raise InputError(unused)
        click.echo(f"note: {unused}", err=True)


def _refuse_of_decays(values: Mapping[str, object]) -> None:
    """Refuse an option of free decays that was given with --ride."""
    from tyre.ground.errors import InputError

    given = [option for option, value in values.items() if value]
    if given:
        raise InputError(f"{given[0]} is an option of free decays; with --ride leave it out")


def _identify_rides(texts: Sequence[str], channel_map: Any, start_hz: float | None, out_file: str | None) -> None:
    """Print the wobble of rides at each speed, and write its modal table."""
    from bicycle.identification.recording import refuse_copies
    from bicycle.identification.ride_recording import read_ride
    from bicycle.identification.ride_wobble import identify_wobble
    from studies.model_space.run_argument import ride_file_and_speed
    from studies.reporting.output import print_few, print_table
    from studies.rides.wobble import HEADERS, notes_of_wobble, wobble_cells
    from tyre.ground.errors import InputError
    from tyre.recordings.draft import looking

    rides = []
    for text in texts:
        file, speed = ride_file_and_speed(text)
        with looking(file):
            rides.append(read_ride(file, speed, channel_map=channel_map))
    refuse_copies([run for ride in rides for run in ride.segments])
    wobbles: list[Any] = []
    for ride in rides:
        for note in ride.notes:
            click.echo(f"note: {ride.name}: {note}", err=True)
        print_few(f"left out: {ride.name}", [str(part) for part in ride.left_out])
        wobbles += identify_wobble(ride, start_hz=start_hz)
    for note in notes_of_wobble(wobbles):
        click.echo(f"note: {note}", err=True)
    print_table([wobble_cells(wobble) for wobble in wobbles], HEADERS)
    rows = [wobble.row() for wobble in wobbles if not wobble.rejected]
    if rows and out_file:
        _write(rows, out_file)
    elif out_file:
        raise InputError(f"no speed has a row of wobble, {out_file} is not written; see the judgements above")


def _names(mode: str | None, modes: str | None) -> list[str]:
    """Read the names of the modes, by frequency; refuse an unknown or repeated one."""
    from bicycle.stability.naming import known_modes
    from tyre.ground.errors import InputError, unknown

    if mode is not None and modes is not None:
        raise InputError("--mode and --modes: give one of them")
    names = [name.strip() for name in (modes or "weave").split(",")] if mode is None else [mode]
    for name in names:
        if name not in known_modes():
            raise InputError(unknown("mode", name, known_modes()))
    if len(set(names)) < len(names):
        raise InputError(f"--modes {modes}: a mode is named twice; name each once, by frequency")
    return names


def _read(argument: str, channel_map: Any) -> tuple[Path, tuple[Any, ...]]:
    """Read an argument RUN.csv@SPEED: its file, and its events in SI."""
    from bicycle.identification.recording import read_events
    from studies.model_space.run_argument import file_and_speed
    from tyre.recordings.draft import looking

    file, speed = file_and_speed(argument, may_stand=True)
    with looking(file):
        return file, read_events(file, speed, channel_map=channel_map)


def _choose_stem(event: Any, taken: Sequence[str]) -> str:
    """Name the picture of a run without ending, unlike those that are ``taken``."""
    stem = re.sub(r"[^\w.-]+", "_", f"{event.name}_{event.speed:g}".replace(".csv", ""))
    numbered = (f"{stem}_{k}" for k in range(2, 10_000))
    return next(name for name in (stem, *numbered) if name not in taken)


def _note_long_window(event: Any, first_s: float, last_s: float) -> list[str]:
    """Note that a chosen window (s after the first sample) is longer than the recording; 0 to infinity is no choice."""
    length = float(event.time[-1] - event.time[0])
    if not first_s < -event.step and not length + event.step < last_s < float("inf"):
        return []
    return [BEYOND.format(run=event.name, first=first_s, last=last_s, length=length, clock=_clock(event))]


def _clock(event: Any) -> str:
    """Say when the first sample was, if the clock of the recording does not begin at 0 s."""
    begin = float(event.time[0])
    return CLOCK.format(begin=begin) if abs(begin) > event.step else ""


def _cells(judged: Any) -> list[object]:
    """Cells of a judged decay: run, speed (m/s), eigenvalue ± sd (1/s, rad/s), fit, movement, repeats, judgement."""
    from studies.motion.free_decays import drift_words, movement_words
    from tyre.ground.number_with_sd import with_sd

    d = judged.decay
    judgement = judged.rejected or ("ok, far from its repeats" if judged.aside else "ok")
    if not judged.rejected and d.movement is not None and d.movement.what:
        judgement += ", sd widened by the start"
    return [
        d.run if judged.mode == "weave" else f"{d.run} ({judged.mode})",
        d.speed,
        with_sd(d.eigenvalue.real, d.sd[0]),
        with_sd(d.eigenvalue.imag, d.sd[1]),
        d.cycles,
        d.r_squared,
        drift_words(d),
        movement_words(d),
        judged.repeats or None,
        judgement,
    ]


def _write(rows: Sequence[dict[str, object]], out_file: str) -> None:
    """Write the modal table; refuse runs that do not have the same columns."""
    import pandas as pd

    from tyre.ground.errors import InputError
    from tyre.ground.text_table import write_csv

    unlike = next((row for row in rows if row.keys() != rows[0].keys()), None)
    if unlike is not None:
        extra = ", ".join(sorted({key[:-3] for key in rows[0].keys() ^ unlike.keys() if key.endswith("_sd")}))
        raise InputError(
            f"{out_file} is not written: only some of the runs have {extra}; give runs with the same channels, or a "
            "table of each kind"
        )
    write_csv(out_file, pd.DataFrame(rows), number_format="%.6g")
