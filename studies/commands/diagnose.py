"""``velotyre diagnose``: find where simulation and measurement disagree and name the missing effect."""

from typing import Any

import click

from studies.reporting.examples import example
from studies.reporting.output import verbose

WORTH_PROCESSES = 5.0  # s that a judgement takes, from which on processes are worth their start


@click.command(
    help="Find where simulation and MEASUREMENT (a file or a packaged name) disagree, and name the missing effect.",
    epilog=example("velotyre diagnose kooijman2008 --out diagnosis"),
)
@click.argument("measurement_file", metavar="MEASUREMENT")
@verbose
@click.option(
    "--out", "folder", metavar="DIR", help="Write the report (HTML, Markdown, figures, corrected model) there."
)
@click.option("--without", metavar="EFFECT", multiple=True, help="Do not try this effect; may be repeated.")
@click.option("--with", "with_", metavar="EFFECT", multiple=True, help="Try this motor too (steer_assist).")
@click.option("--json", "json_file", metavar="FILE", help="Write the verdict as JSON; - is standard output.")
@click.option("--no-stability", is_flag=True, help="With --out: do not judge variants of noise, priors and data.")
@click.option("--workers", type=click.IntRange(1), help="Processes for the variants; default: one a core, up to 4.")
def command(
    measurement_file: str, folder: str | None, without: tuple[str, ...], with_: tuple[str, ...], json_file: str | None,
    workers: int | None, *, no_stability: bool,
) -> Any:  # fmt: skip
    from os import cpu_count
    from pathlib import Path
    from time import perf_counter

    from studies.missing_effect import diagnose, read_measurement
    from studies.missing_effect.report import record, write_report
    from studies.missing_effect.reporting.corrected_model import why_none
    from studies.missing_effect.reporting.findings import find, with_stability
    from studies.missing_effect.reporting.sentences import (
        beside_name,
        closing,
        first_lines,
        fitting,
        next_note,
        stands,
        told_apart,
    )
    from studies.missing_effect.reporting.tables import named
    from studies.missing_effect.reporting.words import explains
    from studies.reporting.manifest import results
    from studies.reporting.output import check_targets, print_table, print_warnings, write_json
    from tyre.base.errors import InputError
    from tyre.base.progress import progress_bar

    if folder and Path(folder).exists() and not Path(folder).is_dir():
        raise InputError(f"--out {folder} is a file; give a folder")
    check_targets(json=json_file)
    started = perf_counter()
    found = diagnose(read_measurement(measurement_file), without=without, with_=with_, progress=True)
    took = perf_counter() - started
    verdict, findings = found.verdict, find(found)
    if folder and not no_stability:
        most = workers or (min(cpu_count() or 1, 4) if took > WORTH_PROCESSES else 1)
        with progress_bar(desc="does it stand?", unit=" variants", leave=False) as bar:

            def advance(what: str) -> None:
                bar.set_postfix_str(what, refresh=False)
                bar.update()

            findings = with_stability(findings, found, advance, workers=most)
    if folder:
        with results(Path(folder)):
            write_report(found, Path(folder), findings)
    if json_file:
        write_json(record(found, findings), json_file)
    if json_file == "-":
        return found, findings
    place = str(Path(folder) / "report.html") if folder else ""
    for line in first_lines(found, findings, place):
        click.echo(line)
    if none := why_none(found, findings.kept.residual if findings.kept is not None else None):
        click.echo(none)
    rows = named(found)

    def show() -> None:
        print_table([row[:-1] for row in rows], ["effect", "parameter", "value", "1 sd"])
        for effect, *_, does in rows:
            if does:
                click.echo(f"{effect}: {does}")

    if rows and verdict.verdict != "partial":
        show()
    for member in verdict.equivalent[1:]:
        click.echo(beside_name(verdict, member))
    if not findings.further:
        click.echo(next_note(findings))
    elif findings.standing is not None:
        click.echo(stands(findings))
    for advice in findings.further[:3]:
        wider = ", the uncertainty of the parameters doubled" if findings.doubled else ""
        click.echo(f"measure next: {advice.what} (tells {told_apart(findings)} by {advice.gain:.1f} sd{wider})")
    click.echo(closing(found).replace("χ²", "chi^2"))
    click.echo(fitting(found).replace("χ²", "chi^2"))
    for mimic in [m for m in verdict.mimics if m.chi2 < verdict.chi2["final"]][:3]:
        click.echo(
            f"would mimic the rest beside {explains(found.final)}: {mimic.what} = {mimic.value:.3g} "
            f"(chi^2 {mimic.chi2:.1f})"
        )
    if rows and verdict.verdict == "partial":
        show()
    print_warnings(verdict.warnings)
    return found, findings  # for the page of velotyre explore
