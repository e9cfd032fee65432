"""The files that a page of the documentation shows, each under its caption."""

import re
from pathlib import Path

BLOCK = re.compile(r"^```\{code-block\} \w+\n:caption: (\S+)\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)


def page(name: str) -> str:
    """The text of a page in docs, by its name without an ending."""
    return (Path(__file__).parents[2] / "docs" / f"{name}.md").read_text(encoding="utf-8")


def write_files(text: str, folder: Path) -> Path:
    """Write what the page shows into a folder; the folder."""
    for name, content in BLOCK.findall(text):
        (folder / name).write_text(content, encoding="utf-8")
    return folder
