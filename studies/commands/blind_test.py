"""``velotyre blind-test``: how often the missing-effect search is right, on cases whose truth it cannot see."""

import click

from studies.reporting.examples import example

SHOWN = ("something_named", "right_when_named", "tentative", "misnamed", "truth_inside_95", "crashed")
MEDIANS = ("gap_left", "class_size", "seconds")


@click.command(
    help="Hide effects in synthetic measurements, diagnose them, and score. Resumable: run again to go on.",
    epilog=example("velotyre blind-test --cases 2 --out cases.jsonl --report blind"),
)
@click.option("--cases", default=20, show_default=True, help="Cases of each cell.")
@click.option(
    "--seed", type=click.IntRange(0), default=1, show_default=True, help="Seed of the first case; the others follow."
)
@click.option("--cell", "--cells", "cells", multiple=True, metavar="CELL", help="Only this cell; may be repeated.")
@click.option("--workers", default=2, show_default=True, help="Processes.")
@click.option("--out", "out_file", required=True, metavar="FILE", help="Results, one JSON object a line.")
@click.option("--report", "report_folder", metavar="DIR", help="Write tables (report.md) and the power curve.")
@click.option("--json", "json_file", metavar="FILE", help="Write the summary as JSON; - is standard output.")
def command(
    cases: int, seed: int, cells: tuple[str, ...], workers: int, out_file: str, report_folder: str | None,
    json_file: str | None,
) -> None:  # fmt: skip
    import os
    from pathlib import Path

    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # of the workers: one core each

    from studies.missing_effect.blind.cells import CELLS
    from studies.missing_effect.blind.report import write_report
    from studies.missing_effect.blind.run import blind_test, results_in
    from studies.missing_effect.blind.score import summary
    from studies.reporting.manifest import results
    from studies.reporting.output import print_table, write_json
    from tyre.base.errors import InputError, unknown

    for cell in cells:
        if cell not in CELLS:
            raise InputError(unknown("cell", cell, CELLS))
    if cases < 1 or workers < 1:
        raise InputError(f"cases = {cases} and workers = {workers} must be at least 1")
    path = Path(out_file)
    blind_test(path, cases=cases, seed=seed, cells=cells or CELLS, workers=workers)
    found = summary(results_in(path).read())
    if report_folder:
        with results(Path(report_folder)):
            write_report(found, Path(report_folder))
    if json_file:
        write_json(found, json_file)
    if json_file == "-":
        return

    def share(s: dict[str, float]) -> str | None:
        return f"{s['share']:.0%} ({s['low']:.0%}-{s['high']:.0%})" if s["of"] else None

    rows = [
        [cell, c["cases"], *(share(c[key]) for key in SHOWN), *(c[f"median_{key}"] for key in MEDIANS)]
        for cell, c in found["cells"].items()
    ]  # fmt: skip
    print_table(
        rows,
        ["cell", "cases", "named", "right", "tentative", "misnamed", "in 95 %", "crashed", "gap left", "class", "s"],
    )
