"""``velotyre tyre fit``: a folder of rig recordings to cornering stiffness, lateral stiffness and relaxation length."""

from collections.abc import Callable, Sized
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from studies.model_space.channel_options import chosen_map, takes_channels
from studies.model_space.command_options import LENGTH, PATH, WORKERS, Number
from studies.reporting.command_context import example
from tyre.ground.errors import InputError

if TYPE_CHECKING:
    from tyre.fits.campaign import Campaign


GAIN, SHARE = Number(0, 50), Number(0, 100, above=True)  # %


def _percent(name: str, default: float, words: str, kind: Number = GAIN) -> Callable[[Any], Any]:
    return click.option(name, type=kind, default=default, show_default=True, help=f"{words}, %.")


@click.command(epilog=example("velotyre tyre fit campaign --out fit"))
@click.argument("folder", type=PATH)
@click.option("--out", type=PATH, required=True, help="Folder for the results.")
@takes_channels
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
@click.option(
    "--skip-bad/--stop-at-bad",
    default=True,
    show_default=True,
    help="Skip files that cannot be used and list them with the reason, or stop at the first.",
)
@click.option("--jobs", type=WORKERS, help="Worker processes; default: one per processor.")
@_percent("--force-calibration", 0.3, "Standard uncertainty of the force gain")
@_percent("--slip-calibration", 0.3, "Standard uncertainty of the slip gain")
@_percent("--gauge-calibration", 0.2, "Standard uncertainty of the dial gauges")
@_percent("--repeatability", 1.0, "Standard deviation of one recording if there are no repeats")
@_percent("--load-tolerance", 5.0, "Largest difference between measured and declared load", SHARE)
@click.option(
    "--wheel-radius", type=LENGTH, default=0.34, show_default=True, help="Radius of the wheel with its tyre, m."
)
@click.option("--every-residual", is_flag=True, help="Draw the residuals of every recording; default: the worst only.")
@click.option("--no-lag-correction", is_flag=True, help="Fit sweeps without correcting the lag (for comparison).")
def command(
    folder: Path,
    out: Path,
    channels_file: Path | None,
    channel_texts: tuple[str, ...],
    json_file: str | None,
    *,
    skip_bad: bool,
    jobs: int | None,
    force_calibration: float,
    slip_calibration: float,
    gauge_calibration: float,
    repeatability: float,
    load_tolerance: float,
    wheel_radius: float,
    every_residual: bool,
    no_lag_correction: bool,
) -> None:
    """Fit tyre properties to the recordings in FOLDER.

    Recordings are .csv with a .toml sidecar or .tdx files. A report, tables, maps and .tir files are written.

    A sidecar with a channel map describes a recording in any columns, units and formats.

    Fits of single files are kept in OUT/.cache, so an interrupted run continues. For a campaign of `velotyre tyre
    simulate`, the report compares the fit with the true values.
    """
    from studies.reporting.manifest import results
    from studies.reporting.output import write_json
    from tyre.fits.campaign import fit_campaign, measured_tables, passed_over
    from tyre.fits.condition import FitSettings
    from tyre.measured.properties import Calibration

    if not 0.05 <= wheel_radius <= 1.0:
        raise InputError(f"--wheel-radius {wheel_radius:g} m must be from 0.05 to 1 m")
    calibration = Calibration(
        force=force_calibration / 100.0,
        slip=slip_calibration / 100.0,
        displacement=gauge_calibration / 100.0,
        repeatability=repeatability / 100.0,
    )
    settings = FitSettings(
        calibration=calibration, lag_correction=not no_lag_correction, load_tolerance=load_tolerance / 100.0
    )
    for path in passed_over(folder, exclude=out):
        click.echo(f"note: {path.relative_to(folder)}: passed over, for it has no sidecar", err=True)
    campaign = fit_campaign(
        folder,
        settings=settings,
        cache_folder=out / ".cache",
        exclude=out,
        skip_bad=skip_bad,
        jobs=jobs,
        wheel_radius=wheel_radius,
        channel_map=chosen_map(channels_file, channel_texts),
    )
    from studies.rig_campaign import write_campaign  # once there is something to draw

    for name, reason in campaign.skipped.items():
        click.echo(f"skipped {name}: {reason}", err=True)
    with results(out):
        written = write_campaign(campaign, out, wheel_radius=wheel_radius, every_recording=every_residual)
    for warning in _near_conditions(campaign):
        click.echo(f"warning: {warning}", err=True)
    for remark in measured_tables(campaign)[1]:
        click.echo(f"note: {remark}", err=True)
    to_stdout = json_file == "-"
    if json_file is not None:
        write_json(campaign.as_json(), json_file)
    known = sum(condition.relaxation_length is not None for condition in campaign.conditions)
    click.echo(
        f"{_count(campaign.conditions, 'condition')}, {known} with a relaxation length, "
        f"{_count(campaign.skipped, 'file')} skipped; {_count(written, 'file')} in {out}, see {out / 'report.html'}",
        err=to_stdout,
    )
    for table in sorted((out / "maps").glob("*.csv")):
        click.echo(f'on a bicycle: tyre = "{table.as_posix()}" in a model file', err=to_stdout)


def _count(things: Sized, word: str) -> str:
    return f"1 {word}" if len(things) == 1 else f"{len(things)} {word}s"


def _near_conditions(campaign: "Campaign") -> list[str]:
    """Warn of conditions that were perhaps meant to be one, each pair once."""
    from tyre.fits.condition import Key, near_conditions

    keys = [Key(c.tyre, c.surface, c.load, c.pressure, c.camber) for c in campaign.conditions]
    return list(dict.fromkeys(near_conditions(keys).values()))
