"""``velotyre tyre fit``: a folder of rig recordings to cornering stiffness, lateral stiffness and relaxation length."""

from pathlib import Path

import click

from studies.channel_options import chosen_map, takes_channels
from studies.command_options import FINITE, WORKERS
from studies.reporting.command_context import example
from tyre.errors import InputError


@click.command(epilog=example("velotyre tyre fit campaign --out fit"))
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for the results.")
@takes_channels
@click.option(
    "--json", "json_file", type=click.Path(path_type=Path, allow_dash=True), help="Write JSON here (- = stdout)."
)
@click.option(
    "--skip-bad/--stop-at-bad", default=True, show_default=True,
    help="Leave out files that cannot be used and list them with the reason, or stop at the first.",
)  # fmt: skip
@click.option("--jobs", type=WORKERS, help="Worker processes (default: one per processor).")
@click.option(
    "--force-calibration",
    type=FINITE,
    default=0.3,
    show_default=True,
    help="Standard uncertainty of the force gain, %.",
)
@click.option(
    "--slip-calibration",
    type=FINITE,
    default=0.3,
    show_default=True,
    help="Standard uncertainty of the slip gain, %.",
)
@click.option(
    "--gauge-calibration",
    type=FINITE,
    default=0.2,
    show_default=True,
    help="Standard uncertainty of the dial gauges, %.",
)
@click.option(
    "--repeatability",
    type=FINITE,
    default=1.0,
    show_default=True,
    help="Scatter of one recording where there are no repeats, %.",
)
@click.option(
    "--load-tolerance", type=FINITE, default=5.0, show_default=True,
    help="Largest distance of the measured from the declared load, %.",
)  # fmt: skip
@click.option(
    "--wheel-radius",
    type=FINITE,
    default=0.34,
    show_default=True,
    help="Radius of wheel and tyre, m.",
)
@click.option("--every-residual", is_flag=True, help="Draw the residuals of every recording, not only of the worst.")
@click.option("--no-lag-correction", is_flag=True, help="Fit sweeps without taking out the lag (for comparison).")
def command(
    folder: Path, out: Path, channels_file: Path | None, channel_texts: tuple[str, ...], json_file: Path | None, *,
    skip_bad: bool, jobs: int | None, force_calibration: float, slip_calibration: float, gauge_calibration: float,
    repeatability: float, load_tolerance: float, wheel_radius: float, every_residual: bool, no_lag_correction: bool,
) -> None:  # fmt: skip
    """Fit all recordings in FOLDER (.csv with .toml sidecar, .tdx) and write a report, tables, maps and .tir files.

    A sidecar with a channel map describes a recording in any columns, units and formats.

    Fits of single files are kept in OUT/.cache, so an interrupted run goes on where it was. Beside a campaign of
    `velotyre tyre simulate`, the report compares the fit with the truth.
    """
    import json

    from studies.reporting.manifest import results
    from studies.rig_campaign import write_campaign
    from tyre.campaign import fit_campaign, passed_over
    from tyre.condition import FitSettings
    from tyre.files import write_text
    from tyre.properties import Calibration

    if not 0.05 <= wheel_radius <= 1.0:
        raise InputError(f"--wheel-radius {wheel_radius:g} m must be from 0.05 to 1 m")
    calibration = Calibration(
        force=force_calibration / 100.0, slip=slip_calibration / 100.0, displacement=gauge_calibration / 100.0,
        repeatability=repeatability / 100.0,
    )  # fmt: skip
    settings = FitSettings(
        calibration=calibration, lag_correction=not no_lag_correction, load_tolerance=load_tolerance / 100.0
    )
    for path in passed_over(folder, exclude=out):
        click.echo(f"note: {path.relative_to(folder)}: passed over, for it has no sidecar", err=True)
    campaign = fit_campaign(
        folder, settings=settings, cache_folder=out / ".cache", exclude=out, skip_bad=skip_bad, jobs=jobs,
        wheel_radius=wheel_radius, channel_map=chosen_map(channels_file, channel_texts),
    )  # fmt: skip
    for name, reason in campaign.skipped.items():
        click.echo(f"skipped {name}: {reason}", err=True)
    with results(out):
        written = write_campaign(campaign, out, wheel_radius=wheel_radius, every_recording=every_residual)
    to_stdout = str(json_file) == "-"
    if json_file is not None:
        text = json.dumps(campaign.as_json(), indent=1, allow_nan=False) + "\n"
        if to_stdout:
            click.echo(text, nl=False)
        else:
            write_text(json_file, text)
    click.echo(
        f"{len(campaign.conditions)} conditions, {len(campaign.skipped)} files skipped; "
        f"{len(written)} files in {out}, see {out / 'report.html'}",
        err=to_stdout,
    )
    for table in sorted((out / "maps").glob("*.csv")):
        click.echo(f'on a bicycle: tyre = "{table.as_posix()}" in a model file', err=to_stdout)
