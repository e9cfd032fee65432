"""``velotyre modal``: eigenvalues from raw free decays, as a modal table for ``velotyre diagnose``."""

from pathlib import Path

import click

from studies.channel_options import chosen_map, takes_channels
from studies.reporting.examples import example


@click.command(
    help="Frequency and damping from free decays: recordings, each with its speed as RUN.csv@4.8 (m/s).",
    epilog=example("velotyre modal run01.csv@4.8 run02.csv@5.6 --from 0.5 --out weave.csv"),
)
@click.argument("runs", nargs=-1, required=True, metavar="RUN.csv@SPEED...")
@takes_channels
@click.option("--mode", default="weave", show_default=True, help="Name of the mode in the table.")
@click.option("--from", "first_s", default=0.0, show_default=True, help="Start of the window, s.")
@click.option("--to", "last_s", default=float("inf"), help="End of the window, s.")
@click.option("--start-hz", type=float, help="Look near this frequency.")
@click.option("--out", "out_file", metavar="TABLE.csv", help="Write the modal table.")
def command(
    runs: tuple[str, ...], channels_file: Path | None, channel_texts: tuple[str, ...], mode: str, first_s: float,
    last_s: float, start_hz: float | None, out_file: str | None,
) -> None:  # fmt: skip
    import csv

    from bicycle.identification.free_decay import identify
    from bicycle.identification.recording import FASTEST, read_events
    from bicycle.modal.known_modes import known_modes
    from studies.reporting.output import print_table
    from tyre.base.errors import InputError, unknown
    from tyre.base.files import replacing
    from tyre.channels.draft import looking

    if mode not in known_modes():
        raise InputError(unknown("mode", mode, known_modes()))
    channel_map = chosen_map(channels_file, channel_texts)
    shown: list[list[object]] = []
    rows: list[dict[str, object]] = []
    notes: list[str] = []
    for given in runs:
        name, _, text = given.rpartition("@")
        try:
            speed = float(text)
        except ValueError:
            speed = 0.0
        if not name or not 0 < speed <= FASTEST:
            raise InputError(f"{given!r}: give a file and its speed in m/s (up to {FASTEST:g}), as run01.csv@4.8")
        with looking(Path(name)):
            events = read_events(Path(name), speed, channel_map=channel_map)
        for event in events:
            found = identify(event, first_s=first_s, last_s=last_s, start_hz=start_hz)
            z = found.eigenvalue
            shown.append([
                found.run, speed, f"{z.real:.3f} ± {found.sd[0]:.3f}", f"{z.imag:.3f} ± {found.sd[1]:.3f}",
                found.cycles, found.r_squared, found.rejected or "ok",
            ])  # fmt: skip
            notes += [f"{event.name}: {note}" for note in event.notes]
            if not found.rejected:
                rows.append(found.row(mode))
    for note in notes:
        click.echo(f"note: {note}", err=True)
    print_table(shown, ["run", "speed m/s", "real 1/s", "imaginary rad/s", "cycles", "R^2", "judgement"])
    if out_file and rows:
        with replacing(out_file) as part, part.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows({key: f"{x:.6g}" if isinstance(x, float) else x for key, x in row.items()} for row in rows)
    if not rows:
        unwritten = f", {out_file} is not written" if out_file else ""
        first = runs[0].rpartition("@")[0]
        said = (
            f"no run could be used{unwritten}; see the judgements above; `velotyre look {first}` finds the windows in "
            "which a motion dies away"
        )
        if out_file:
            raise InputError(said)
        click.echo(f"note: {said}", err=True)
