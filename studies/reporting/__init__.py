"""Output that all commands and studies share: tables, JSON, figures, reports, and the manifest of a folder."""

from tyre.ground.door import room

PLACES = {
    "analysis": ("analyse", "record", "records", "unstable_modes"),
    "command_context": ("example", "made_by", "verbose", "version_of", "working_told"),
    "manifest": ("inputs", "results", "unfinished"),
    "markdown_text": ("cell", "cells", "code", "html_template", "make_environment", "page", "plain", "render_file"),
    "output": ("check_targets", "json_text", "parse_speeds", "print_critical", "print_table", "print_warnings",
               "write_csv", "write_json"),
    "rider_report": ("with_provenance",),
    "plotting": ("drawing", "legend_columns", "look", "mode_look", "mode_marker", "mode_words"),
}  # fmt: skip

__getattr__, __dir__ = room(__name__, PLACES)
