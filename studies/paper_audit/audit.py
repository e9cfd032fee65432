"""Audit of Dell'Orto et al.: every quantitative claim of the text against the values of its own tables."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.paper_audit import (
    claim,
    cornering_stiffness,
    formulas,
    lateral_stiffness,
    relaxation_length,
)
from studies.paper_audit.claim import Claim, Outcome, PaperTables, load_paper_tables
from tyre.base.csv_text import write_csv
from tyre.base.errors import InputError
from tyre.base.files import write_text

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Finding:
    """A claim of the paper and what its tables say to it."""

    claim: Claim
    outcome: Outcome


def claims() -> list[Claim]:
    """Every claim of the claim modules, sorted by section; within one in the order in which the modules make them."""
    modules = (lateral_stiffness, cornering_stiffness, relaxation_length, formulas)
    found = [item for module in modules for item in vars(module).values() if isinstance(item, Claim)]
    return sorted(found, key=lambda item: (item.section[0].isdigit(), item.section))


def audit(tables: PaperTables | None = None) -> list[Finding]:
    """Test every claim on the packaged tables, or on others."""
    tables = tables if tables is not None else load_paper_tables()
    return [Finding(item, item.test(tables)) for item in claims()]


def as_records(findings: list[Finding]) -> list[dict[str, Any]]:
    """Return the findings as dictionaries: section, claim, text, computed, verdict, remark, name, values."""
    return [
        {
            "section": finding.claim.section,
            "claim": finding.claim.statement,
            "text": finding.claim.text,
            "computed": finding.outcome.computed,
            "verdict": finding.outcome.verdict,
            "remark": finding.outcome.remark,
            "name": finding.claim.name,
            "values": finding.outcome.values,
        }
        for finding in findings
    ]


def as_frame(findings: list[Finding]) -> "pd.DataFrame":
    """Return the findings as a data frame, one row per claim."""
    import pandas as pd

    return pd.DataFrame(as_records(findings)).drop(columns=["name", "values"])


def summary(findings: list[Finding]) -> str:
    """``52 claims: 30 hold, 12 partly, 10 fail``."""
    verdicts = [finding.outcome.verdict for finding in findings]
    return (
        f"{len(findings)} claims: {verdicts.count('holds')} hold, {verdicts.count('partly')} hold partly, "
        f"{verdicts.count('fails')} fail"
    )


def as_markdown(findings: list[Finding]) -> str:
    """Return the findings as a Markdown page that says how the verdicts are made."""
    from tabulate import tabulate

    rule = " ".join((claim.__doc__ or "").split("\n\n", 1)[1].split())
    table = tabulate(
        [list(record.values())[:6] for record in as_records(findings)],
        headers=["section", "claim of the text", "text", "from the tables", "verdict", "remark"],
        tablefmt="github",
        disable_numparse=True,
    )
    return (
        "# The paper's text against its tables\n\n"
        "Dell'Orto, Ballo, Mastinu & Gobbi, "
        "*Racing bicycle tyres: experimental indoor evaluation of relaxation length*.\n"
        "C is the cornering stiffness, K the lateral stiffness (C over relaxation length).\n\n"
        f"{rule}\n\n{summary(findings)}.\n\n{table}\n"
    )


def write(findings: list[Finding], path: Path) -> list[Path]:
    """Write the audit.

    Parameters
    ----------
    path : Path
        A ``.csv`` or ``.md`` file, or a folder that gets ``paper_audit.csv`` and ``paper_audit.md``.

    Returns
    -------
    list of Path
        The files written.
    """
    if path.suffix and path.suffix not in (".csv", ".md") and not path.is_dir():
        raise InputError(f"{path}: the audit is written as .csv or .md, or both into a folder, not as '{path.suffix}'.")
    files = [path] if path.suffix in (".csv", ".md") else [path / "paper_audit.csv", path / "paper_audit.md"]
    for file in files:
        file.parent.mkdir(parents=True, exist_ok=True)
        if file.suffix == ".csv":
            write_csv(file, as_frame(findings))
        else:
            write_text(file, as_markdown(findings))
    return files
