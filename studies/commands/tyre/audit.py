"""``velotyre tyre audit``: the paper's claims against the values of its own tables."""

from pathlib import Path

import click

from studies.reporting.examples import example


@click.command(
    name="audit",
    short_help="The paper's claims against its own tables.",
    epilog=example("velotyre tyre audit --out audit"),
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("out"),
    show_default=True,
    help="Folder for paper_audit.csv and paper_audit.md, or one .csv or .md file.",
)
@click.option("--json", "json_file", type=click.Path(allow_dash=True), help="Write JSON to a file, or - for stdout.")
def command(out: Path, json_file: str | None) -> None:
    """Test every quantitative claim of the tyre paper on the values of its own tables.

    Prints claim, value of the text, value from the tables and verdict (holds, partly, fails), and writes the same with
    remarks as CSV and Markdown.
    """
    import json
    from contextlib import nullcontext

    from tabulate import tabulate

    from studies.paper_audit import audit
    from studies.reporting.manifest import results
    from tyre.base.files import write_text

    findings = audit.audit()
    with nullcontext() if out.suffix and not out.is_dir() else results(out):
        files = audit.write(findings, out)
    records = audit.as_records(findings)
    if json_file == "-":
        click.echo(json.dumps({"claims": records}, indent=2))
        return
    if json_file:
        write_text(json_file, json.dumps({"claims": records}, indent=2) + "\n")
    rows = [
        [record["section"], record["claim"], record["text"], record["computed"], record["verdict"]]
        for record in records
    ]
    headers = ["section", "claim of the text", "text", "from the tables", "verdict"]
    click.echo(
        tabulate(rows, headers=headers, maxcolwidths=[8, 44, 16, 44, None], tablefmt="simple", disable_numparse=True)
    )
    click.echo(f"\n{audit.summary(findings)}; written to {', '.join(file.as_posix() for file in files)}")
