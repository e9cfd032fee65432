"""Audit of Dell'Orto et al.: every quantitative claim of the text against the values of its own tables."""

from csv import DictReader
from pathlib import Path
from typing import Any

import pandas as pd

from studies.paper_audit.claims import TESTS, Tables, load_tables
from studies.reporting.markdown_text import render_file
from tyre.errors import InputError
from tyre.files import data_root, write_text
from tyre.table import write_csv


def audit(tables: Tables | None = None) -> list[dict[str, Any]]:
    """Test every claim on the packaged tables, or on others (without remarks); a record each, sorted by section."""
    used = tables or load_tables()
    claims = DictReader(data_root().joinpath("published", "paper_claims.csv").read_text(encoding="utf-8").splitlines())
    return [
        {key: one[key] for key in ("section", "claim", "text")}
        | vars(TESTS[one["name"]](used))
        | {"name": one["name"], "remark": one["remark"] if tables is None else ""}
        for one in sorted(claims, key=lambda one: (one["section"][0].isdigit(), one["section"]))
    ]


def as_markdown(records: list[dict[str, Any]]) -> str:
    """Write the audit as a Markdown page that says how the verdicts are made."""
    content = {"records": records, "verdicts": [record["verdict"] for record in records]}
    return render_file("studies.paper_audit", "audit.md.j2", content, escaped=False)


def write(records: list[dict[str, Any]], path: Path) -> list[Path]:
    """Write the audit into a ``.csv`` or ``.md`` file, or both into a folder; return the files written."""
    if path.suffix and path.suffix not in (".csv", ".md") and not path.is_dir():
        raise InputError(f"{path}: the audit is written as .csv or .md, or both into a folder, not as '{path.suffix}'.")
    files = [path] if path.suffix in (".csv", ".md") else [path / "paper_audit.csv", path / "paper_audit.md"]
    for file in files:
        file.parent.mkdir(parents=True, exist_ok=True)
        if file.suffix == ".csv":
            write_csv(file, pd.DataFrame(records)[["section", "claim", "text", "computed", "verdict", "remark"]])
        else:
            write_text(file, as_markdown(records))
    return files
