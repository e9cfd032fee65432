"""The paper's text against its own tables: every quantitative claim, tested; and its figures, redrawn."""

from studies.paper_audit.audit import as_markdown, audit, write
from studies.paper_audit.claims import judge_all, judge_number, load_tables
from studies.paper_audit.figures import draw_paper_figure, draw_paper_figures

__all__ = [
    "as_markdown", "audit", "draw_paper_figure", "draw_paper_figures", "judge_all", "judge_number", "load_tables",
    "write",
]  # fmt: skip
