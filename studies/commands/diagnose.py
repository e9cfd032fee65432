"""``velotyre diagnose``: find where simulation and measurement disagree and name the missing effect."""

import click

from studies.reporting.examples import example
from studies.reporting.output import verbose


@click.command(
    help="Find where simulation and MEASUREMENT (a file or a packaged name) disagree, and name the missing effect.",
    epilog=example("velotyre diagnose kooijman2008 --out diagnosis"),
)
@click.argument("measurement_file", metavar="MEASUREMENT")
@verbose
@click.option("--out", "folder", metavar="DIR", help="Write the report (Markdown, HTML, figures) there.")
@click.option("--without", metavar="EFFECT", multiple=True, help="Do not try this effect; may be repeated.")
@click.option("--with", "with_", metavar="EFFECT", multiple=True, help="Try this motor too (steer_assist).")
@click.option("--json", "json_file", metavar="FILE", help="Write the verdict as JSON; - is standard output.")
def command(
    measurement_file: str, folder: str | None, without: tuple[str, ...], with_: tuple[str, ...], json_file: str | None
) -> None:
    from pathlib import Path

    from studies.missing_effect import diagnose, read_measurement
    from studies.reporting.output import print_table, print_warnings, write_json
    from tyre.base.errors import InputError

    if folder and Path(folder).exists() and not Path(folder).is_dir():
        raise InputError(f"--out {folder} is a file; give a folder")
    if json_file and json_file != "-" and not Path(json_file).parent.is_dir():
        raise InputError(f"--json {json_file}: no such folder; make it first")
    found = diagnose(read_measurement(measurement_file), without=without, with_=with_, progress=True)
    verdict = found.verdict
    if folder:
        from studies.missing_effect.report import write_report

        write_report(found, Path(folder))
    if json_file:
        write_json(verdict.to_dict(), json_file)
    if json_file == "-":
        return
    chi2 = verdict.chi2
    click.echo(f"verdict: {verdict.verdict}")
    rows = [
        [e.identifier, name, value, sd] for e in verdict.effects for name, (value, sd) in e.parameters.items()
    ]  # fmt: skip
    if rows:
        print_table(rows, ["effect", "parameter", "value (SI)", "1 sd"])
    if len(verdict.equivalent) > 1:
        click.echo(f"cannot be told apart: {', '.join(verdict.equivalent)}")
    for advice in verdict.separating_measurements[:3]:
        click.echo(f"measure next: {advice.what} (separates by {advice.gain:.1f} sd)")
    click.echo(
        f"chi^2 of {chi2['n']} numbers: base model {chi2['nominal']:.1f}, "
        f"parameters adjusted {chi2['nuisance_only']:.1f}, "
        f"final {chi2['final']:.1f} (p = {verdict.goodness_of_fit_p:.2g})"
    )
    for mimic in verdict.mimics[:3]:
        click.echo(f"would mimic the rest: {mimic.what} = {mimic.value:.3g} (chi^2 {mimic.chi2:.1f})")
    print_warnings(verdict.warnings)
