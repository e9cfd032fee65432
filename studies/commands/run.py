"""``velotyre run``: the main study, from measured tyres to figures, tables and a report."""

import click


@click.command(help="Measured tyres on a bicycle: modes, critical speeds, figures, tables and a report.")
@click.option("--out", default="out", show_default=True, help="Folder to write into.")
@click.option("--bicycle", default="pista_rider_drops", show_default=True, help="A packaged bicycle, or a file.")
@click.option(
    "--tyre", "tyres", multiple=True, help="File of a tyre table to study too (of tyre fit); may be repeated."
)
def command(out: str, bicycle: str, tyres: tuple[str, ...]) -> None:
    from pathlib import Path

    from studies.main_study.cases import Settings
    from studies.main_study.output import run_and_write
    from tyre.errors import InputError

    if not out.strip() or "\0" in out:
        raise InputError(f"--out {out!r} is no folder name; give a folder to write into, for example out")
    folder = Path(out)
    if folder.exists() and not folder.is_dir():
        raise InputError(f"--out {out!r} is a file; give a folder to write into, for example out")
    settings = Settings.of(bicycle, tyres)
    report = run_and_write(settings, folder)
    for warning in settings.bicycle.warnings:
        click.echo(f"warning: {warning}", err=True)
    click.echo(f"report: {report.as_posix()}")
