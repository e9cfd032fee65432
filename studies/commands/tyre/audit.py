"""``velotyre tyre audit``: the paper's claims against the values of its own tables."""

from pathlib import Path

import click

from studies.command_options import FOLDER, PATH
from studies.reporting.command_context import example


@click.command(short_help="The paper's claims against its tables.", epilog=example("velotyre tyre audit --out audit"))
@click.option(
    "--out", type=PATH, default=Path("out"), show_default=True,
    help="Folder for paper_audit.csv and paper_audit.md, or one .csv or .md file.",
)  # fmt: skip
@click.option("--figures", type=FOLDER, help="Folder for its Figs. 1, 5-6 and 9-14, redrawn.")
@click.option("--json", "json_file", metavar="FILE", help="Write JSON here; - is standard output.")
def command(out: Path, figures: Path | None, json_file: str | None) -> None:
    """Test every quantitative claim of the tyre paper on the values of its own tables.

    Prints claim, value of the text, value from the tables and verdict (holds, partly, fails), and writes the same with
    remarks as CSV and Markdown.
    """
    from contextlib import nullcontext

    from tabulate import tabulate

    from studies.paper_audit import audit, draw_paper_figures, write
    from studies.reporting.manifest import results
    from studies.reporting.output import write_json

    records = audit()
    with nullcontext() if out.suffix and not out.is_dir() else results(out):
        files = write(records, out)
    if figures:
        figures.mkdir(parents=True, exist_ok=True)
        draw_paper_figures(figures)
    if json_file:
        write_json({"claims": records}, json_file)
    if json_file == "-":
        return
    rows = [[r["section"], r["claim"], r["text"], r["computed"], r["verdict"]] for r in records]
    headers = ["section", "claim of the text", "text", "from the tables", "verdict"]
    widths = [8, 44, 16, 44, None]
    click.echo(tabulate(rows, headers=headers, maxcolwidths=widths, tablefmt="simple", disable_numparse=True))
    hold, partly, fail = ([r["verdict"] for r in records].count(verdict) for verdict in ("holds", "partly", "fails"))
    places = ", ".join(file.as_posix() for file in files)
    click.echo(f"\n{len(records)} claims: {hold} hold, {partly} hold partly, {fail} fail; written to {places}")
