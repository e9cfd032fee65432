"""Output that the commands share: lists of speeds, tables and warnings on the screen, CSV and JSON."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from numpy.typing import NDArray

from studies.reporting.command_context import VERBOSE
from tyre.ground.errors import InputError, Note, fold_notes
from tyre.ground.files import write_text
from tyre.ground.number_with_unit import typed_numbers
from tyre.ground.text_table import csv_text

if TYPE_CHECKING:
    import pandas as pd

    from bicycle.model.state_space import LinearModel

ENDINGS = {"CSV": ".csv", "JSON": ".json"}
OTHERS = (
    ".xlsx", ".xls", ".ods", ".parquet", ".feather", ".h5", ".hdf5", ".mat", ".nc", ".zarr", ".toml", ".html", ".png",
    ".svg", ".pdf",
)  # fmt: skip
"""Endings that no table or result is written under."""


def parse_speeds(text: str, most: int = 1_000_000) -> NDArray[np.float64]:
    """Read speeds in m/s from a ``text`` ``start:stop:step`` (both ends included) or ``v1,v2,...``."""
    parts = text.split(":")
    numbers = typed_numbers(parts if len(parts) > 1 else text.split(","), "m/s")
    if not numbers or len(parts) not in (1, 3):
        raise InputError(f"speeds {text!r}: give start:stop:step, for example 0:20:0.5, or a list such as 2,5,8 (m/s)")
    if len(parts) == 1:
        return np.array(numbers)
    start, stop, step = numbers
    if step <= 0 or stop < start:
        raise InputError(f"speeds {text!r}: the step must be positive and stop >= start")
    count = math.floor((stop - start) / step * (1 + 1e-12) + 1e-9) + 1
    if count > most:
        raise InputError(f"speeds {text!r}: {count:.3g} speeds are more than {most}; take a larger step")
    speeds = start + step * np.arange(count)
    if stop - speeds[-1] > 1e-9 * step:
        speeds = np.append(speeds, stop)
    return np.round(speeds, 12)


def write_json(content: Mapping[str, Any], target: str) -> None:
    """Write ``content`` as JSON to a file, or to standard output if the ``target`` is ``-``."""
    text = json_text(content)
    if not target:
        raise InputError(f"--json {target!r} is no file name; give a file, or - for standard output")
    _write(text + "\n", target, "JSON", "result")


def _write(text: str, target: str | Path, form: str, contents: str) -> None:
    if target == "-":
        click.echo(text, nl=False)
        return
    _check_ending(target, form)
    try:
        write_text(target, text)
    except OSError as error:
        raise InputError(f"{target}: cannot write the {contents}: {error.strerror}") from error


def check_targets(**targets: str | None) -> None:
    """Refuse ``targets`` (file names by option; ``json``, all others CSV) before anything is computed."""
    on_screen = [f"--{name} -" for name, target in targets.items() if target == "-"]
    if len(on_screen) > 1:
        raise InputError(f"{' and '.join(on_screen)} would write into each other; give one of them a file")
    for name, target in targets.items():
        if not target or target == "-":
            continue
        if Path(target).is_dir():  # whose files would be taken for what the command reads
            raise InputError(f"--{name} {target}: is a folder; give a file")
        _check_ending(target, "JSON" if name == "json" else "CSV")
        if not Path(target).parent.is_dir():
            raise InputError(f"--{name} {target}: no such folder; make it first")


def _check_ending(target: str | Path, form: str) -> None:
    ending = Path(target).suffix.lower()
    if ending in OTHERS or (ending in ENDINGS.values() and ending != ENDINGS[form]):
        raise InputError(f"{target}: what is written is {form}; give a name that ends in {ENDINGS[form]}")


def json_text(content: Mapping[str, Any]) -> str:
    """Write ``content`` as JSON; a number that is NaN or infinite is refused: nothing is ever reported with one."""
    for name, value in _numbers(content):
        if not math.isfinite(value):
            raise InputError(
                f"nothing is written: {name} came out as {value:g}, which is no result; a number of the input is too "
                "large or a standard deviation too small to be computed with"
            )
    return json.dumps(content, indent=1, allow_nan=False)


def _numbers(content: Any, name: str = "") -> Iterator[tuple[str, float]]:
    """Yield every number of a nested ``content`` under its name."""
    if isinstance(content, Mapping):
        for key, value in content.items():
            yield from _numbers(value, f"{name}.{key}" if name else str(key))
    elif isinstance(content, list | tuple):
        for place, value in enumerate(content):
            yield from _numbers(value, f"{name}[{place}]")
    elif isinstance(content, float):
        yield name, content


def write_csv(table: "pd.DataFrame", target: str | Path) -> None:
    """Write a ``table`` with column names and all digits as CSV to ``target``, ``-`` for standard output."""
    _write(csv_text(table), target, "CSV", "table")


def critical_table(critical: Sequence[Any]) -> "pd.DataFrame":
    """Tabulate critical speeds, a row each, with the unit in the column names."""
    import pandas as pd

    columns = ("speed_m_s", "mode", "kind", "frequency_Hz", "as_speed_grows", "bifurcation")
    rows = [(c.speed, c.mode, c.kind, c.frequency_hz, c.direction, c.bifurcation) for c in critical]
    return pd.DataFrame(rows, columns=columns)


MOST_LINES = 6
"""Lines of one kind that a screen shows before the rest is counted."""


def print_few(label: str, lines: Sequence[str]) -> None:
    """Print ``lines`` of one kind behind their ``label``; of many the first, and how many more there are."""
    shown = lines if len(lines) <= MOST_LINES else lines[: MOST_LINES - 1]
    for line in shown:
        click.echo(f"{label}: {line}")
    if len(lines) > len(shown):
        click.echo(f"{label}: {len(lines) - len(shown)} more")


def print_table(rows: Sequence[Sequence[Any]], headers: Sequence[str]) -> None:
    """Print ``rows`` under ``headers``; numbers with four digits, text as it is, missing values as a dash."""
    from tabulate import tabulate

    numbers = [[None if cell != cell else cell for cell in row] for row in rows]  # NaN is a missing value
    cells = [[f"{cell:.4g}" if isinstance(cell, float) else cell for cell in row] for row in numbers]
    click.echo(tabulate(cells, headers=headers, missingval="-", disable_numparse=True))


def stack_tables(tables: Sequence["pd.DataFrame"]) -> "pd.DataFrame":
    """Stack tables of the same columns; as objects, for a column may be empty in one of ``tables``."""
    import pandas as pd

    return pd.concat([table.astype(object) for table in tables], ignore_index=True) if len(tables) > 1 else tables[0]


def named_rows(table: "pd.DataFrame", name: str) -> "pd.DataFrame":
    """Put the ``name`` of its bicycle into the first column of a ``table``, none for an empty name."""
    if not name:
        return table
    filled = table if len(table) else table.reindex([0])
    filled.insert(0, "bicycle", name)
    return filled


def print_critical(
    critical: Mapping[str, Sequence[Any]], models: Mapping[str, "LinearModel"], *, max_speed: float
) -> None:
    """Print ``critical`` speeds up to ``max_speed`` (m/s) of the ``models`` by name, one per row; no empty name is
    shown."""
    from studies.reporting.analysis import unstable_modes

    within = max_speed / 2
    throughout = {name: unstable_modes(models[name], within) for name, speeds in critical.items() if not speeds}
    if "" in throughout:
        modes = ", ".join(throughout[""])
        stability = f"{modes} unstable throughout (checked at {within:g} m/s)" if modes else "stable throughout"
        click.echo(f"no critical speed up to {max_speed:g} m/s: {stability}")
        return
    rows: list[list[Any]] = []
    bifurcations = any(c.bifurcation for speeds in critical.values() for c in speeds)
    for name, speeds in critical.items():
        lines = [[f"{c.speed:.6f}", c.mode, c.kind, c.frequency_hz, c.direction] for c in speeds]
        if bifurcations:
            lines = [[*cells, c.bifurcation] for cells, c in zip(lines, speeds, strict=True)]
        if not lines:
            state = "unstable" if throughout[name] else "not unstable"
            lines = [["none", None, None, None, f"{state} throughout"]]
        rows += [[name, *cells] if name else cells for cells in lines]
    headers = ["critical speed m/s", "mode", "kind", "frequency Hz", "with increasing speed"]
    if any(critical):
        headers.insert(0, "bicycle")
    if bifurcations:
        headers.append("bifurcation")
    print_table(rows, headers)


def print_exchanges(models: Mapping[str, "LinearModel"], fastest: float) -> None:
    """Print where modes of the ``models`` by name exchange character, and so their names, up to a speed (m/s)."""
    from bicycle.stability.named_modes import mode_events

    for name, model in models.items():
        for event in mode_events(model, 0.0, fastest):
            if event.kind == "exchange":
                click.echo(f"{name}: {event}" if name else str(event))


def print_warnings(warnings: Sequence[str]) -> None:
    """Print ``warnings`` to standard error, a line each; several notes on one tyre are one line without --verbose.

    A note on a tyre inside of its tests is called a note: it informs, and no reading changes by it.
    """
    print_named_warnings({"": warnings})


def print_named_warnings(warnings: Mapping[str, Sequence[str]]) -> None:
    """Print ``warnings`` of bicycles by name as :func:`print_warnings`; what all of them have once."""
    context = click.get_current_context(silent=True)
    full = context is not None and context.meta.get(VERBOSE, False)
    lines = {name: list(texts if full else fold_notes(texts)) for name, texts in warnings.items()}
    common = [text for text in next(iter(lines.values()), []) if all(text in texts for texts in lines.values())]
    by_name = [(name, text) for name, texts in lines.items() for text in texts if text not in common]
    for name, text in [*(("", text) for text in common), *by_name]:
        prefix = f"{name}: " if name else ""
        kind = "note" if isinstance(text, Note) and text.inside else "warning"
        click.echo(f"{kind}: {prefix}{' '.join(text.split())}", err=True)
