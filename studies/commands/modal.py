"""``velotyre modal``: eigenvalues from raw free decays, as a modal table for ``velotyre diagnose``."""

from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from typing import Any

import click

from studies.channel_options import chosen_map, takes_channels
from studies.reporting.examples import example

WIDER = 1.2  # sd if driven, over that which leaves it open, from which it is told


@click.command(
    help="Frequency and damping from free decays: recordings, each with its speed as RUN.csv@4.8 (m/s).",
    epilog=example("velotyre modal run01.csv@4.8 run02.csv@5.6 --from 0.5 --out weave.csv"),
)
@click.argument("runs", nargs=-1, required=True, metavar="RUN.csv@SPEED...")
@takes_channels
@click.option("--mode", help="Name of the mode in the table; weave unless --modes is given.")
@click.option("--modes", metavar="NAME,NAME", help="Several modes in one window, by frequency: weave,wobble.")
@click.option(
    "--from", "first_s", default=0.0, show_default=True, help="Start of the window, s after the first sample."
)
@click.option("--to", "last_s", default=float("inf"), help="End of the window, likewise.")
@click.option("--start-hz", type=float, help="Look near this frequency.")
@click.option(
    "--drift", help="none, constant, parabola, exponential or parabola-exponential; by default weighed by evidence."
)
@click.option(
    "--driven",
    type=click.Choice(["yes", "no"]),
    help="Whether a rough road, say, keeps driving the motion; by default weighed by the evidence of all runs.",
)
@click.option("--out", "out_file", metavar="TABLE.csv", help="Write the modal table.")
@click.option("--figures", type=click.Path(path_type=Path, file_okay=False), help="Folder for a picture of each fit.")
def command(
    runs: tuple[str, ...], channels_file: Path | None, channel_texts: tuple[str, ...], mode: str | None,
    modes: str | None, first_s: float, last_s: float, start_hz: float | None, drift: str | None, driven: str | None,
    out_file: str | None, figures: Path | None,
) -> Any:  # fmt: skip
    from contextlib import nullcontext

    from bicycle.identification.driven_together import together
    from bicycle.identification.free_decay import identify_modes
    from bicycle.identification.run import refuse_copies
    from studies.free_decays.words import break_words, judged, repeat_notes, together_words
    from studies.reporting.manifest import results
    from studies.reporting.output import print_table
    from studies.run_argument import named_apart
    from tyre.base.errors import InputError

    names = _names(mode, modes)
    known: dict[str, Any] = {
        "start_hz": start_hz, "drift": drift, "driven": None if driven is None else driven == "yes",
    }  # fmt: skip
    channel_map = chosen_map(channels_file, channel_texts)
    notes: list[str] = []
    drawn: list[str] = []
    events = named_apart([_read(given, channel_map) for given in runs])
    refuse_copies(events)

    def fit(place: int, driven: Any) -> tuple[Any, ...]:
        event, given = events[place], known | {"driven": driven}
        try:
            return identify_modes(event, len(names), first_s=first_s, last_s=last_s, **given)
        except InputError as error:
            meant, begin = _by_its_clock(event, first_s, last_s), _clock(event)[0]
            if not meant:
                raise
            raise InputError(
                f"{error}; --from and --to count from the first sample, which is at {begin:.10g} s by the clock of the "
                f"recording: by that clock the window is {meant}"
            ) from error

    places = range(len(events))
    with nullcontext() if figures is None else results(figures):
        each_run: Sequence[Sequence[Any]] = [fit(place, known["driven"]) for place in places]
        if driven is None:
            each_run, again = together(each_run, fit)
            notes += [together_words(each_run)] if again else []
        fitted = [(event, tuple(zip(names, found, strict=True))) for event, found in zip(events, each_run, strict=True)]
        for place, (event, found) in enumerate(fitted):
            notes += [f"{event.name}: {note}" for note in (*event.notes, *_beyond(event, first_s, last_s))]
            if figures is not None and found[0][1].estimate is not None:
                drawn.append(_draw(event, found, figures, drawn))
            notes += _open(event, each_run[place], lambda p=place: fit(p, True)) if driven is None else []
    every = judged([pair for _, found in fitted for pair in found])
    rows = [each.decay.row(each.mode) for each in every if not each.rejected]
    notes += [f"{each.decay.run}: {said}" for each in every if (said := break_words(each.decay))]
    notes += [note for each in every for note in _beside(each)]
    for note in [*notes, *repeat_notes(every)]:
        click.echo(f"note: {note}", err=True)
    heads = ["run", "speed m/s", "real 1/s", "imaginary rad/s", "cycles", "R^2", "drift", "start moves it by"]
    print_table([_shown(each) for each in every], [*heads, "repeats", "judgement"])
    if out_file and rows:
        _write(rows, out_file)
    if not rows:
        unwritten = f", {out_file} is not written" if out_file else ""
        first = runs[0].rpartition("@")[0]
        said = (
            f"no run could be used{unwritten}; see the judgements above; `velotyre look {quote(first)}` finds the "
            "windows in which a motion dies away"
        )
        if out_file:
            raise InputError(said)
        click.echo(f"note: {said}", err=True)
    return fitted, every  # for the page of velotyre explore


def _open(event: Any, found: Any, again: Any) -> list[str]:
    """A note where the samples leave open whether something drives the motion, and it matters."""
    from studies.free_decays.words import DRIVEN_OPEN, driven_words

    first = found[0]
    if first.rejected or first.estimate.driven is None or not DRIVEN_OPEN[0] < first.estimate.driven < DRIVEN_OPEN[1]:
        return []
    told = again()[0]
    wider = max(new / old for new, old in zip(told.sd, first.sd, strict=True))
    return [f"{event.name}: {driven_words(first, told)}"] if not told.rejected and wider > WIDER else []


def _beyond(event: Any, first_s: float, last_s: float) -> list[str]:
    """A note where a window that was asked for is longer than the recording; 0 and infinity are not asked for."""
    begin, length, spare = _clock(event)
    if not first_s < -spare and not length + spare < last_s < float("inf"):
        return []
    asked = f"from {first_s:g} s" + (f" to {last_s:g} s" if last_s < float("inf") else "")
    window = _by_its_clock(event, first_s, last_s)
    own = f" after its first sample, which is at {begin:.10g} s by its own clock" if abs(begin) > spare else ""
    return [
        f"the window {asked} reaches beyond the recording, 0 to {length:g} s{own}; what there is was fitted"
        f"{f'; by that clock the window is {window}' if window else ''}"
    ]


def _clock(event: Any) -> tuple[float, float, float]:
    """Where the clock of a recording begins, how long it is and a sample time, s; windows count from the first one."""
    begin, length = float(event.time[0]), float(event.time[-1] - event.time[0])
    return begin, length, length / max(len(event.time) - 1, 1)


def _by_its_clock(event: Any, first_s: float, last_s: float) -> str:
    """The options of a window that lies in the recording by its own clock alone; empty of any other."""
    begin, length, spare = _clock(event)
    end, ends = begin + length + spare, last_s < float("inf")
    outside = not -spare <= first_s <= length + spare or (ends and last_s > length + spare)
    inside = begin - spare <= first_s <= end and (not ends or last_s <= end)
    if abs(begin) <= spare or not outside or not inside:
        return ""
    return f"--from {max(first_s - begin, 0):.6g}" + (f" --to {last_s - begin:.6g}" if ends else "")


def _names(mode: str | None, modes: str | None) -> list[str]:
    """Names of the modes, of known ones."""
    from bicycle.modal.known_modes import known_modes
    from tyre.base.errors import InputError, unknown

    if mode is not None and modes is not None:
        raise InputError("--mode and --modes: give one of them")
    names = [name.strip() for name in (modes or mode or "weave").split(",")] if mode is None else [mode]
    for name in names:
        if name not in known_modes():
            raise InputError(unknown("mode", name, known_modes()))
    if len(set(names)) < len(names):
        raise InputError(f"--modes {modes}: a mode is named twice; name each once, by frequency")
    return names


def _read(given: str, channel_map: Any) -> tuple[Path, tuple[Any, ...]]:
    """The file of an argument RUN.csv@SPEED, and its events."""
    from bicycle.identification.recording import read_events
    from studies.run_argument import file_and_speed
    from tyre.channels.draft import looking

    file, speed = file_and_speed(given)
    with looking(file):
        return file, read_events(file, speed, channel_map=channel_map)


def _shown(each: Any) -> list[object]:
    from studies.free_decays.words import drift_words, movement_words, with_sd

    d = each.decay
    z = d.eigenvalue
    run = d.run if each.mode == "weave" else f"{d.run} ({each.mode})"
    said = each.rejected or ("ok, far from its repeats" if each.aside else "ok")
    if not each.rejected and d.movement is not None and d.movement.what:
        said += ", sd widened by the start"
    return [
        run, d.speed, with_sd(z.real, d.sd[0]), with_sd(z.imag, d.sd[1]), d.cycles, d.r_squared,
        drift_words(d), movement_words(d), each.repeats or None, said,
    ]  # fmt: skip


def _beside(each: Any) -> list[str]:
    """What was fitted beside the mode that was asked for."""
    from studies.free_decays.words import second_words

    if each.rejected:
        return []
    return [
        f"{each.decay.run}: {second_words(z)} is in the window; it is fitted beside and left out of the table"
        for z in each.decay.beside
    ]


def _draw(event: Any, decays: Any, figures: Path, drawn: list[str]) -> str:
    """Draw a fit under a name that is not among those ``drawn``; the name."""
    import re

    from studies.free_decays.figure import draw

    stem = re.sub(r"[^\w.-]+", "_", f"{event.name}_{event.speed:g}".replace(".csv", ""))
    name = next(n for n in (stem, *(f"{stem}_{k}" for k in range(2, 10_000))) if n not in drawn)
    draw(event, decays, figures / name)
    return name


def _write(rows: list[dict[str, object]], out_file: str) -> None:
    import csv

    from tyre.base.csv_text import harmless
    from tyre.base.errors import InputError
    from tyre.base.files import replacing

    other = next((row for row in rows if row.keys() != rows[0].keys()), None)
    if other is not None:
        some = ", ".join(sorted({key[:-3] for key in rows[0].keys() ^ other.keys() if key.endswith("_sd")}))
        raise InputError(
            f"{out_file} is not written: only some of the runs have {some}; give runs with the same channels, or a "
            "table of each kind"
        )
    with replacing(out_file) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(
            {key: f"{x:.6g}" if isinstance(x, float) else harmless(x) for key, x in row.items()} for row in rows
        )
