"""``velotyre diagnose``: find where simulation and measurement disagree and name the missing effect."""

import click

from studies.model_space.command_options import WORKERS
from studies.reporting.command_context import example, verbose


@click.command(
    help="Find where simulation and measurement disagree. Names the missing effect; MEASUREMENT is a file or a "
    "packaged name.",
    epilog=example("velotyre diagnose kooijman2008 --out diagnosis"),
)
@click.argument("measurement_file", metavar="MEASUREMENT")
@verbose
@click.option("--out", "folder", metavar="DIR", help="Folder for the report: page, figures, corrected model.")
@click.option(
    "--without", metavar="EFFECT", multiple=True, help="Exclude this effect from the search; may be repeated."
)
@click.option(
    "--with",
    "with_",
    metavar="EFFECT",
    multiple=True,
    help="Include this effect in the search: steer_assist, rotating_mass ...",
)
@click.option("--json", "json_file", metavar="FILE", help="Write the verdict as JSON; - is standard output.")
@click.option("--no-stability", is_flag=True, help="With --out: skip the variants of noise, priors and data.")
@click.option("--as-read", is_flag=True, help="Search even if another unit or sign explains the data much better.")
@click.option("--quick", is_flag=True, help="Try single effects only, by least squares and BIC; no report.")
@click.option("--workers", type=WORKERS, help="Processes for the variants; default: one per core, up to 4.")
def command(
    measurement_file: str,
    folder: str | None,
    without: tuple[str, ...],
    with_: tuple[str, ...],
    json_file: str | None,
    workers: int | None,
    *,
    no_stability: bool,
    as_read: bool,
    quick: bool,
) -> None:
    from os import cpu_count
    from pathlib import Path
    from time import perf_counter

    from studies.diagnosis.diagnose import diagnose
    from studies.diagnosis.findings import find, with_stability
    from studies.diagnosis.measurement_file import read_measurement
    from studies.diagnosis.report import record, terminal, write_report
    from studies.reporting.manifest import results
    from studies.reporting.output import check_targets, write_json
    from tyre.ground.errors import InputError
    from tyre.ground.progress import progress_bar

    if folder and Path(folder).exists() and not Path(folder).is_dir():
        raise InputError(f"--out {folder} is a file; give a folder")
    if folder and quick:
        raise InputError("--quick writes no report; omit --quick or --out")
    check_targets(json=json_file)
    started = perf_counter()
    measurement = read_measurement(measurement_file)
    diagnosis = diagnose(measurement, without=without, with_=with_, progress=True, as_read=as_read, quick=quick)
    duration = perf_counter() - started  # s
    findings = find(diagnosis)
    if folder and not no_stability:
        processes = workers or (min(cpu_count() or 1, 4) if duration > 5.0 else 1)  # s, worth the start of processes
        with progress_bar(desc="does it stand?", unit=" variants", leave=False) as bar:

            def advance(variant: str) -> None:
                bar.set_postfix_str(variant, refresh=False)
                bar.update()

            findings = with_stability(findings, diagnosis, advance, workers=processes)
    if folder:
        with results(Path(folder)):
            write_report(diagnosis, Path(folder), findings)
    if json_file:
        write_json(record(diagnosis, findings), json_file)
    if json_file != "-":
        click.echo(terminal(diagnosis, findings, str(Path(folder) / "report.html") if folder else ""))
