"""``velotyre frequency-response``: gain and phase from recorded forced runs, as a table for ``velotyre diagnose``."""

from pathlib import Path

import click

from studies.model_space.channel_options import chosen_map, takes_channels
from studies.model_space.command_options import DURATION, FINITE
from studies.reporting.command_context import example


@click.command(
    help="Estimate frequency responses from forced runs. Each recording is given with its speed, m/s: RUN.csv@4.8.",
    epilog=example(
        "velotyre frequency-response run01.csv@4.8 --input steer_torque --output roll_rate,steer --out table.csv"
    ),
)
@click.argument("runs", nargs=-1, required=True, metavar="RUN.csv@SPEED...")
@takes_channels
@click.option(
    "--input",
    "source",
    default="steer_torque",
    show_default=True,
    help="Channel of the input; also lean_torque, lateral_push.",
)
@click.option(
    "--output",
    "outputs",
    default="roll_rate,steer",
    show_default=True,
    help="Channels of the outputs, separated by commas.",
)
@click.option(
    "--instrument",
    "reference",
    default="",
    metavar="COLUMN",
    help="Recorded reference that was added to the input; removes the bias of feedback from the motion.",
)
@click.option(
    "--segment", "segment_s", type=DURATION, default=10.0, show_default=True, help="Length of the segments, s."
)
@click.option("--to-hz", "highest_hz", type=FINITE, default=5.0, show_default=True, help="Highest frequency, Hz.")
@click.option("--out", "out_file", metavar="TABLE.csv", help="Write the table of frequency responses.")
def command(
    runs: tuple[str, ...],
    channels_file: Path | None,
    channel_texts: tuple[str, ...],
    source: str,
    outputs: str,
    reference: str,
    segment_s: float,
    highest_hz: float,
    out_file: str | None,
) -> None:
    import math

    from studies.diagnosis.spectra import responses_of_runs, rows_of, shown_of
    from studies.reporting.output import check_targets, print_table
    from tyre.ground.errors import InputError

    for name, value in (("segment", segment_s), ("to-hz", highest_hz)):
        if not (math.isfinite(value) and value > 0):
            raise InputError(f"--{name} = {value:g} must be positive")
    check_targets(out=out_file)
    names = [name.strip() for name in outputs.split(",") if name.strip()]
    responses, notes = responses_of_runs(
        runs,
        source,
        names,
        chosen_map(channels_file, channel_texts),
        reference=reference,
        segment_s=segment_s,
        highest_hz=highest_hz,
    )
    for note in notes:
        click.echo(f"note: {note}", err=True)
    headers = ["speed m/s", "response", "frequencies", "Hz", "averages", "coherence", "relative sd"]
    print_table([row for response in responses for row in shown_of(response)], headers)
    if out_file:
        import pandas as pd

        from studies.reporting.output import write_csv

        write_csv(pd.DataFrame([row for response in responses for row in rows_of(response)]), out_file)
        click.echo(
            f'{out_file}: {sum(len(r.spectrum.gain) for r in responses)} rows, read by kind = "frequency_response"'
        )
