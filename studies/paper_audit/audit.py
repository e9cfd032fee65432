"""Audit of Dell'Orto et al.: every quantitative claim of the text against the values of its own tables."""

from pathlib import Path
from typing import Any

from studies.paper_audit.claims import CLAIMS
from studies.paper_audit.verdict import Tables, load_tables
from studies.reporting.markdown_text import render_file
from tyre.errors import InputError
from tyre.files import write_text
from tyre.table import write_csv


def audit(tables: Tables | None = None) -> list[dict[str, Any]]:
    """Test every claim on the packaged tables, or on others; a record each, sorted by section."""
    tables, found = tables or load_tables(), []
    for one in sorted(CLAIMS, key=lambda one: (one.section[0].isdigit(), one.section)):
        outcome = one.test(tables)
        found.append({
            "section": one.section, "claim": one.statement, "text": one.text, "computed": outcome.computed,
            "verdict": outcome.verdict, "remark": outcome.remark, "name": one.name, "values": outcome.values,
        })  # fmt: skip
    return found


def as_markdown(records: list[dict[str, Any]]) -> str:
    """Write the audit as a Markdown page that says how the verdicts are made."""
    content = {"records": records, "verdicts": [record["verdict"] for record in records]}
    return render_file("studies.paper_audit", "audit.md.j2", content, escaped=False)


def write(records: list[dict[str, Any]], path: Path) -> list[Path]:
    """Write the audit into a ``.csv`` or ``.md`` file, or both into a folder; return the files written."""
    import pandas as pd

    if path.suffix and path.suffix not in (".csv", ".md") and not path.is_dir():
        raise InputError(f"{path}: the audit is written as .csv or .md, or both into a folder, not as '{path.suffix}'.")
    files = [path] if path.suffix in (".csv", ".md") else [path / "paper_audit.csv", path / "paper_audit.md"]
    for file in files:
        file.parent.mkdir(parents=True, exist_ok=True)
        if file.suffix == ".csv":
            write_csv(file, pd.DataFrame(records).drop(columns=["name", "values"]))
        else:
            write_text(file, as_markdown(records))
    return files
