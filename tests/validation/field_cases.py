"""What does velotyre make of files as they come from the field? A table of cases: what is right, what is given.

Commands run as a user types them; cases and inputs lie in tests/field_cases. Inputs that are too large to keep are
taken from the folder that VELOTYRE_FIELD_CASES names; without it their case is left out.
"""

import contextlib
import csv
import gzip
import io
import json
import os
import re
import shlex
import shutil
import tempfile
import tomllib
from pathlib import Path
from typing import Any

from studies.cli import main

HERE = Path(__file__).parents[1] / "field_cases"
CASES: dict[str, dict[str, Any]] = tomllib.loads((HERE / "cases.toml").read_text(encoding="utf-8"))


def place_inputs(names: list[str], folder: Path) -> list[str]:
    """Put inputs by their names into a ``folder``; the names that are not there."""
    other, missing = os.environ.get("VELOTYRE_FIELD_CASES", ""), []
    for name in names:
        kept = HERE / "inputs" / name
        packed, further = kept.with_name(f"{name}.gz"), next(Path(other).rglob(name), None) if other else None
        if packed.exists():
            (folder / name).write_bytes(gzip.decompress(packed.read_bytes()))
        elif kept.exists() or further:
            shutil.copy(kept if kept.exists() else str(further), folder / name)
        else:
            missing.append(name)
    return missing


def typed(line: str) -> tuple[int, str, str]:
    """Run a command, or fill in a draft; exit code and what was written to both streams."""
    words = shlex.split(line)
    if words[0] == "fill":
        text = Path(words[1]).read_text(encoding="utf-8")
        for key, value in (word.split("=") for word in words[2:]):
            written = value if re.fullmatch(r"[\d.]+", value) else f'"{value}"'
            text = re.sub(rf"^{key} = .*", f"{key} = {written}", text, flags=re.M)
        Path(words[1]).write_text(text, encoding="utf-8")
        return 0, "", ""
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
        try:
            main(words)
            code = 0
        except SystemExit as end:
            code = int(end.code or 0)
    return code, out.getvalue(), err.getvalue()


def number(place: str, screen: str) -> float:
    """Find the number at FILE:key.key in what was written."""
    file, _, keys = place.partition(":")
    if file.endswith(".csv"):
        with Path(file).open(encoding="utf-8") as stream:
            rows = list(csv.DictReader(line for line in stream if not line.startswith("#")))
        found: Any = {name: [row[name] for row in rows] for name in rows[0]}
    else:
        found = json.loads(screen if file == "-" else Path(file).read_text(encoding="utf-8"))
    for key in keys.split("."):
        found = found[int(key)] if isinstance(found, list) else found[key]
    return float(found)


def examined(name: str) -> tuple[bool | None, str]:
    """Run a case in the working directory: whether it is right (None: inputs are missing), and what was given."""
    case, given = CASES[name], []
    if missing := place_inputs(case.get("files", []), Path()):
        return None, f"not kept here: {', '.join(missing)}"
    right, screen, said = True, "", ""
    for line in case["run"]:
        try:
            code, screen, told = typed(line)
        except Exception as error:
            return False, f"{type(error).__name__}: {error} ({line})"
        said += screen + told
        if "refused" in case:
            errors = [text for text in told.splitlines() if text.startswith("velotyre: ")]
            one_line = code == 2 and len(errors) == 1 and bool(re.search(case["refused"], errors[0]))
            right, given = right and one_line, [*given, errors[-1][10:90] if errors else f"exit {code}"]
        elif code and "not_written" not in case:
            return False, told.strip().splitlines()[-1][:150]
    for place, value in case.get("numbers", {}).items():
        try:
            found = number(place, screen)
        except (KeyError, IndexError, ValueError, OSError) as error:
            return False, f"{place}: {type(error).__name__} {error}"
        right, given = right and abs(found / value - 1) <= case["within"], [*given, f"{found:.7g}"]
    if "says" in case:
        right = right and bool(re.search(case["says"], said, flags=re.S))
    if "not_written" in case:
        right = right and not list(Path().rglob(case["not_written"]))
        given.append(said.strip().splitlines()[-1][:90] if said.strip() else "")
    return right, "; ".join(given)


def run(*, out: Path) -> dict[str, Any]:
    """Run every case and print the table."""
    from tabulate import tabulate

    rows = []
    for name in CASES:
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            right, given = examined(name)
        rows.append({"case": name, "right": CASES[name]["right"], "given": given, "is_right": right})
    cells = [
        [row["case"], row["right"], row["given"], {True: "yes", False: "NO", None: "-"}[row["is_right"]]]
        for row in rows
    ]
    print(tabulate(cells, ["case", "right", "velotyre", ""], maxcolwidths=[30, 50, 60, 4]))
    return {"cases": len(rows), "right": sum(row["is_right"] is True for row in rows), "rows": rows}
