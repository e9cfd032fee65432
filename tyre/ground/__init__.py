"""Errors, units, schemas, tables, files and parallel work: the base of the other packages."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "arrays": ("Array",),
        "errors": (
            "InputError",
            "Note",
            "extrapolated",
            "fold_notes",
            "hint",
            "nearest_name",
            "read_number",
            "refuse_unknown",
            "unknown",
        ),
        "files": (
            "data_root",
            "files_below",
            "left_by_a_killed_run",
            "make_folder",
            "named_folder",
            "own_ends",
            "read_toml",
            "slugs",
            "write_bytes",
            "write_text",
        ),
        "number_with_sd": (
            "MeasuredNumber",
            "measured_number",
            "read_key_values",
            "number_text",
            "with_sd",
        ),
        "number_with_unit": (
            "typed_number",
            "typed_numbers",
        ),
        "progress": (
            "install_command",
            "interrupts_arrive",
            "optional_module",
            "progress_bar",
        ),
        "renamed": (
            "new_name",
            "now_called",
        ),
        "schema": (
            "by_name",
            "flag",
            "name_in",
            "list_of",
            "maybe",
            "needed",
            "number",
            "read",
            "table",
            "text",
            "whole_number",
        ),
        "text_table": (
            "csv_text",
            "escape_formula",
            "read_cells",
            "read_columns",
            "write_csv",
        ),
        "units": (
            "GRAVITY",
            "PASCAL_PER_BAR",
            "SPELLINGS",
            "SYMBOLS",
            "factor_to_si",
            "find_unit",
            "is_si",
            "is_unit",
            "quantity_of",
        ),
        "workers": (
            "one_blas_thread",
            "worker_pool",
        ),
    },
)
