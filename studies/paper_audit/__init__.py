"""The paper's text against its own tables: every quantitative claim, tested."""

from studies.paper_audit.audit import as_markdown, audit, write
from studies.paper_audit.verdict import judge_all, judge_number, load_tables

__all__ = ["as_markdown", "audit", "judge_all", "judge_number", "load_tables", "write"]
