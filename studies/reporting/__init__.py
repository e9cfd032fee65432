"""Output that all commands and studies share: tables, JSON, figures, reports, and the manifest of a folder."""

from tyre.ground.door import room

PLACES = {
    "analysis": ("analyse", "record", "records", "unstable_modes"),
    "command_context": ("count_seconds", "example", "made_by", "verbose", "version_of"),
    "manifest": ("inputs", "results", "unfinished_command"),
    "markdown_text": ("cell", "cells", "code", "escape_text", "html_template", "make_environment", "page",
                      "render_file"),
    "output": ("check_targets", "json_text", "parse_speeds", "print_critical", "print_few", "print_table",
               "print_warnings",
               "write_csv", "write_json"),
    "rider_report": ("with_provenance",),
    "terminal_letters": ("spell_out",),
    "plotting": ("drawing", "legend_columns", "look", "mode_look", "mode_marker", "mode_words"),
}  # fmt: skip

__getattr__, __dir__ = room(__name__, PLACES)
