"""Output that all commands and studies share: tables, JSON, figures, reports, and the manifest of a folder."""

from importlib import import_module
from typing import Any

PLACES = {
    "analysis": ("analyse", "record", "records", "unstable_modes"),
    "command_context": ("example", "made_by", "verbose", "version_of", "working_told"),
    "manifest": ("inputs", "results", "unfinished"),
    "markdown_text": ("cell", "cells", "code", "html_template", "page", "plain", "render_file", "rendered",
                      "write_pages"),
    "output": ("check_targets", "json_text", "parse_speeds", "print_critical", "print_table", "print_warnings",
               "write_csv", "write_json"),
    "plotting": ("drawing", "legend_columns", "look", "mode_look", "mode_marker", "mode_words"),
}  # fmt: skip


def __getattr__(name: str) -> Any:
    for module, names in PLACES.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
