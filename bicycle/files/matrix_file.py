"""Files that hold the canonical matrices of a bicycle: how they are recognised, and what they say."""

import re
from pathlib import Path
from typing import Any

from tyre.ground.errors import InputError
from tyre.ground.files import read_text, read_toml

ASSIGNMENT = re.compile(r"(?:\w+\.)*(\w+)\s*=\s*(\[[^\]]*\]|[^\s;,]+)")
REFUSAL = "holds matrices M, C1, K0, K2, on which no tyre or effect can be put"


def holds_matrices(path: str | Path) -> bool:
    """True if a file gives canonical matrices: a ``.m`` or ``.txt`` of assignments, or a TOML file."""
    file = Path(path)
    if file.suffix.lower() not in (".m", ".txt", ".toml") or not file.is_file():
        return False
    try:
        return {"C1", "K0", "K2"} <= set(matrix_content(file))
    except InputError:
        return False  # whoever reads it as something else says what is wrong


def matrix_content(file: Path) -> dict[str, Any]:
    """Read the assignments of a ``file`` of matrices, by name: matrices as rows of numbers, SI, and numbers."""
    if file.suffix.lower() == ".toml":
        return dict(read_toml(file, "file of matrices"))
    text = "\n".join(line.partition("%")[0].partition("#")[0] for line in read_text(file).splitlines())
    return {name: _value(value) for name, value in ASSIGNMENT.findall(text)}


def _value(text: str) -> Any:
    """A matrix of MATLAB as its rows, or a number; text where it is neither."""
    rows = re.split(r"[;\n]", text.strip("[]")) if text.startswith("[") else [text]
    try:
        table = [[float(number) for number in re.split(r"[,\s]+", row.strip())] for row in rows if row.strip()]
    except ValueError:
        return text
    return table if text.startswith("[") else table[0][0]
